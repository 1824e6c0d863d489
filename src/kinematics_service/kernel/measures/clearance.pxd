cimport cython
cimport numpy as cnp
from libc cimport math

from ..forward cimport chain_pass
from ..layout cimport arrays, places
from . cimport singular_equations, singular_values
from . cimport singularity, symmetric
from .arm cimport Arm
from .singular_equations cimport SingularEquations

cdef int HALVINGS, MULTIPLIER_HALVINGS
cdef double SINGULAR, NORM_ROUND_OFF, TINY

@cython.final
cdef class Clearance:
    cdef Arm arm
    cdef SingularEquations equations
    cdef tuple _arrays
    cdef int count
    cdef long long* moving
    cdef double* point
    cdef double bend, twist, singular
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
    cdef double* W
    cdef double* P
    cdef double* norms
    cdef double* A

    @cython.locals(
        k=int, sigma='double*', smallest=double, change=double, radius=double, complement=double
    )
    cdef double radius(self, double* q) noexcept nogil
    @cython.locals(
        n=int, j=int, e=int, entries=int, row='double*', px=double, py=double, pz=double,
        x=double, y=double, z=double, v='double*', w='double*', wx=double, wy=double, wz=double,
    )
    cdef void _stand_at(self, double* q) noexcept nogil
    @cython.locals(
        n=int, m=int, entries=int, v='double*', w='double*', moved='double[6]', k=int, j=int,
        f=int, e=int, first=int, last=int,
    )
    cdef void _write_changes(self) noexcept nogil
    @cython.locals(
        n=int, m=int, r=int, p=int, axis=int, half=int, component=int, scale=double, value=double
    )
    cdef void _add_change(self, int j, int i, double* moved) noexcept nogil
    cdef double _norm(self, int count, int length) noexcept nogil
    @cython.locals(few=int, many=int, r=int, i=int)
    cdef double _matrix_norm(self, double* M, int count, int length) noexcept nogil
    @cython.locals(d=int, j=int, r=int, i=int, least=double)
    cdef double _tensor_norm(self, double* T, int rows, int columns) noexcept nogil
    @cython.locals(good=double, bad=double, r=double)
    cdef double _by_change(self, double smallest, double change) noexcept nogil
    @cython.locals(
        d=int, count=int, k=int, length=int, width=int, i=int, j=int, p=int, gram='double*',
        factor='double*', right='double*', shares='double*', line='double*', trace=double,
        value=double, size=double,
    )
    cdef double _choose_line(self) noexcept nogil
    @cython.locals(n=int, d=int, k=int, i=int, j=int, r=int, share=double)
    cdef void _write_complement(self) noexcept nogil
    @cython.locals(
        n=int, m=int, k=int, a=int, b=int, j=int, r=int, i=int, width=int, length=int,
        tool='double*', joints='double*', change='double*', share=double, value=double,
        along=double,
    )
    cdef void _write_block(self) noexcept nogil
    @cython.locals(
        d=int, k=int, i=int, j=int, order=int, block=double, b=double, c=double, slope=double,
        along=double, second=double, best=double, good=double, bad=double, r=double,
    )
    cdef double _by_complement(self, double complement) noexcept nogil
    @cython.locals(bent=double, inside=double, root=double, both=double, rest=double, lowest=double)
    cdef bint _is_proved(
        self, double r, int order, double complement, double slope, double b, double c,
        double block, double second,
    ) noexcept nogil
    @cython.locals(
        d=int, i=int, least=double, size=double, low=double, high=double, multiplier=double,
        squares=double, away=double, value=double,
    )
    cdef double _lowest(self, double r) noexcept nogil

@cython.locals(ax=double, ay=double, az=double, bx=double, by=double, bz=double)
cdef void _write_cross(
    double* a, int i, double* b, int j, int entries, double* product, int at
) noexcept nogil
@cython.locals(n=int, count=Py_ssize_t, k=Py_ssize_t, positions='double*', results='double*')
cpdef clearances(Clearance clearance, cnp.ndarray q, cnp.ndarray radii)
