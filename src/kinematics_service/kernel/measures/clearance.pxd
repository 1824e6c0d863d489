cimport cython
cimport numpy as cnp
from libc cimport math

from ..forward cimport chain_pass, vectors
from ..forward.vectors cimport Triple
from ..layout cimport arrays, places
from . cimport singular_equations
from . cimport singularity, symmetric
from .arm cimport Arm
from .bends cimport Bends
from .norms cimport Norms
from .singular_equations cimport SingularEquations

cdef int HALVINGS, MULTIPLIER_HALVINGS, LINES
cdef double SINGULAR, TINY, NEXT_LINE

@cython.final
cdef class Clearance:
    cdef Arm arm
    cdef SingularEquations equations
    cdef tuple _arrays
    cdef int count
    cdef long long* moving
    cdef double* point
    cdef Bends bends
    cdef Norms norms
    cdef double bend, twist, singular
    cdef double complement, gradient, second
    cdef double by_block, by_turns, by_lines
    cdef double bend_of_block, bend_of_turns, bend_of_lines
    cdef double* room
    cdef double* slope
    cdef double* b
    cdef double* c
    cdef double* H
    cdef double* g
    cdef double* turned
    cdef double* Q
    cdef double* Z
    cdef double* B
    cdef double* C
    cdef double* D
    cdef double* P
    cdef double* lines
    cdef double* best
    cdef double* shares
    cdef double* A

    @cython.locals(
        k=int, sigma='double*', smallest=double, change=double, radius=double, turn=int
    )
    cdef double radius(self, double* q) noexcept nogil
    @cython.locals(
        n=int, j=int, e=int, entries=int, row='double*', px=double, py=double, pz=double,
        x=double, y=double, z=double, v='double*', w='double*', wx=double, wy=double, wz=double,
    )
    cdef void _stand_at(self, double* q) noexcept nogil
    @cython.locals(
        n=int, m=int, entries=int, v='double*', w='double*', moved=Triple, turned=Triple, k=int,
        j=int, f=int, e=int,
    )
    cdef void _write_changes(self) noexcept nogil
    @cython.locals(n=int, m=int, r=int, scale=double, value=double)
    cdef void _add_change(self, int j, int i, Triple moved, Triple turned) noexcept nogil
    @cython.locals(few=int, many=int, r=int, i=int)
    cdef double _matrix_norm(self, double* M, int count, int length) noexcept nogil
    @cython.locals(d=int, j=int, r=int, i=int, least=double)
    cdef double _tensor_norm(self, double* T, int rows, int columns) noexcept nogil
    @cython.locals(good=double, bad=double, r=double)
    cdef double _by_change(self, double smallest, double change) noexcept nogil
    @cython.locals(
        d=int, count=int, k=int, length=int, width=int, i=int, j=int, p=int, gram='double*',
        factor='double*', line='double*', trace=double, value=double,
    )
    cdef void _choose_line(self) noexcept nogil
    @cython.locals(count=int, k=int, length=int, i=int, p=int, line='double*', value=double)
    cdef void _take_line(self, double share) noexcept nogil
    @cython.locals(n=int, d=int, k=int, i=int, j=int, r=int, share=double)
    cdef void _write_complement(self) noexcept nogil
    @cython.locals(
        n=int, m=int, k=int, a=int, b=int, j=int, r=int, i=int, width=int, length=int,
        tool='double*', joints='double*', change='double*', share=double, value=double,
        along=double,
    )
    cdef void _write_block(self) noexcept nogil
    @cython.locals(
        d=int, k=int, i=int, j=int, order=int, along=double, good=double, bad=double, r=double
    )
    cdef double _by_complement(self, double best) noexcept nogil
    @cython.locals(
        bent=double, twisted=double, half=double, root=double, inside=double, before=double,
        behind=double, both=double, left=double, rest=double,
    )
    cdef bint _is_proved(self, double r, int order) noexcept nogil
    @cython.locals(
        d=int, i=int, least=double, size=double, low=double, high=double, multiplier=double,
        squares=double, away=double, value=double,
    )
    cdef double _lowest(self, double r) noexcept nogil

@cython.locals(size=double, i=int)
cdef bint unit(double* v, int count) noexcept nogil
@cython.locals(n=int, count=Py_ssize_t, k=Py_ssize_t, positions='double*', results='double*')
cpdef clearances(Clearance clearance, cnp.ndarray q, cnp.ndarray radii)
