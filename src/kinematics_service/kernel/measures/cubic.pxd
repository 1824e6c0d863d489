cimport cython

from ..layout cimport arrays
from . cimport singular_equations, symmetric
from .expansion cimport Expansion
from .norms cimport Norms

cdef int MULTIPLIER_HALVINGS, ROUNDS
cdef double TINY

@cython.final
cdef class Cubic:
    cdef Norms norms
    cdef int count
    cdef double constant, weight, size_of_l, size_of_M, size_of_Q, size_of_T
    cdef double* room
    cdef double* g
    cdef double* l
    cdef double* way
    cdef double* along
    cdef double* more
    cdef double* turned
    cdef double* Q
    cdef double* M
    cdef double* H
    cdef double* Z
    cdef double* half
    cdef double* T

    @cython.locals(d=int, begins='long long*', a=int, b=int, c=int, at=int, value=double)
    cdef void become(
        self, Expansion expansion, double* F, double* shares, int count, double constant
    ) noexcept nogil
    @cython.locals(d=int, slope=double, j=int, p=int)
    cdef void take_away(self, Cubic other) noexcept nogil
    @cython.locals(
        d=int, way='double*', whole=double, a=int, b=int, c=int, value=double, square=double,
        both=double,
    )
    cdef void _divide(self, double slope) noexcept nogil
    @cython.locals(
        d=int, one=double, more='double*', half='double*', a=int, b=int, c=int, p=int,
        both=double, value=double,
    )
    cdef void _add_product(self, Cubic other) noexcept nogil
    cdef void write_sizes(self) noexcept nogil
    @cython.locals(p=int)
    cdef double _norm(self, double* matrix, int length) noexcept nogil
    @cython.locals(d=int, p=int, i=int, j=int, along=double)
    cdef void diagonalise(self) noexcept nogil
    @cython.locals(
        d=int, i=int, least=double, size=double, low=double, high=double, multiplier=double,
        squares=double, away=double, value=double, whole=double, tiny=double,
    )
    cdef double lowest(self, double r) noexcept nogil

@cython.locals(value=double, i=int)
cdef double _sum(double* terms, double* shares, int count, int apart) noexcept nogil
