cimport cython
cimport numpy as cnp
from libc cimport math

from ..forward cimport chain_pass
from ..layout cimport arrays, places
from . cimport singular_equations
from . cimport singularity, symmetric
from .arm cimport Arm
from .cubic cimport Cubic
from .expansion cimport Expansion
from .singular_equations cimport SingularEquations

cdef int HALVINGS, SUMS
cdef double SINGULAR

@cython.final
cdef class Clearance:
    cdef Arm arm
    cdef SingularEquations equations
    cdef Expansion expansion
    cdef tuple _arrays
    cdef int count
    cdef bint known
    cdef double* point
    cdef double bend, twist, fourth, share, largest, change
    cdef double by_block, bend_of_block, second
    cdef double by_turns, bend_of_turns, twist_of_turns
    cdef double by_lines, bend_of_lines, twist_of_lines
    cdef Cubic sum
    cdef Cubic steep
    cdef double* room
    cdef double* F
    cdef double* B
    cdef double* C
    cdef double* shares
    cdef double* across
    cdef double* steepest
    cdef double* first
    cdef double* gram
    cdef double* factor

    @cython.locals(k=int, sigma='double*', smallest=double, radius=double, i=int, turn=int)
    cdef double radius(self, double* q) noexcept nogil
    @cython.locals(i=int)
    cdef void _mix(self, double share) noexcept nogil
    @cython.locals(count=int, smallest=double)
    cdef void _become(self, Cubic cubic, double* shares) noexcept nogil
    @cython.locals(
        n=int, j=int, e=int, entries=int, row='double*', px=double, py=double, pz=double,
        x=double, y=double, z=double, v='double*', w='double*', wx=double, wy=double, wz=double,
    )
    cdef void _stand_at(self, double* q) noexcept nogil
    @cython.locals(away=double, i=int, length=double, root=double)
    cdef double _condition(self) noexcept nogil
    cdef double _changed(self, double r) noexcept nogil
    @cython.locals(good=double, bad=double, r=double, moved=double)
    cdef double _by_change(self, double smallest) noexcept nogil
    @cython.locals(
        d=int, k=int, count=int, terms=int, pairs=int, a=int, b=int, i=int, p=int, B='double*',
        C='double*', F='double*', squared='double*', cubed='double*', line='double*',
        turn='double*',
    )
    cdef void _write_complement(self) noexcept nogil
    @cython.locals(cell=int)
    cdef double* _cell(self, int turn, int line) noexcept nogil
    @cython.locals(d=int, pair='long long*', triple='long long*', i=int, j=int, p=int)
    cdef void _subtract(self, double* a, double* b, int order, double* product) noexcept nogil
    @cython.locals(
        k=int, count=int, d=int, terms=int, pairs=int, step=int, cubed=int, block='double*',
        turns='double*', lines='double*',
    )
    cdef void _write_norms(self) noexcept nogil
    @cython.locals(
        d=int, count=int, terms=int, trace=double, most=double, i=int, p=int, j=int, a='double*',
        b='double*', value=double, slope=double,
    )
    cdef bint _choose_shares(self) noexcept nogil
    @cython.locals(good=double, bad=double, r=double)
    cdef double _by_complement(self, double best) noexcept nogil
    @cython.locals(
        square=double, singular=double, third=double, fourth=double, root=double, bent=double,
        inside=double, twisted=double, turns=double, before=double, rest=double, behind=double,
        slope=double, bend=double, steep=double,
    )
    cdef bint _is_proved(self, double r) noexcept nogil

@cython.locals(size=double, i=int)
cdef bint unit(double* v, int count) noexcept nogil
@cython.locals(n=int, count=Py_ssize_t, k=Py_ssize_t, positions='double*', results='double*')
cpdef clearances(Clearance clearance, cnp.ndarray q, cnp.ndarray radii)
