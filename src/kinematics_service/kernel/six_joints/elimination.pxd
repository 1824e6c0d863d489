cimport cython
from libc cimport math

from ..forward cimport vectors
from ..layout cimport arrays
from . cimport lines
from .six_screws cimport SixScrews

cdef int EQUATIONS, LEFT, RIGHT
cdef double PIVOT, DEPENDENT, ROUND_OFF

@cython.final
cdef class Elimination:
    cdef double* room
    cdef double* line
    cdef double* goal
    cdef double* fifth
    cdef double* fourth
    cdef double* left
    cdef double* first
    cdef double* right
    cdef double* table
    cdef double* equations
    cdef int count
    cdef int rank
    cdef double error

    @cython.locals(row='double*', width=int, i=int, k=int)
    cdef void eliminate(self, SixScrews loop) noexcept nogil
    @cython.locals(screws='double*', to='double*', a=int, b=int, h=int, i=int)
    cdef void _write_sides(self, SixScrews loop) noexcept nogil
    @cython.locals(odd=int, i=int)
    cdef void _invert(self, double* screws, int k, double* parts) noexcept nogil
    @cython.locals(
        A='double*', largest=double, best=double, x=double, share=double, p=int, c=int, i=int,
        j=int, k=int,
    )
    cdef int _pivot(self, int width) noexcept nogil
    @cython.locals(
        F='double*', longest=double, shortest=double, best=double, square=double, share=double, x=double, rows=int,
        p=int, i=int, j=int, k=int,
    )
    cdef void _orthonormalise(self, int rank, int width) noexcept nogil
    @cython.locals(F='double*', along=double, j=int, k=int)
    cdef void _clear_below(self, int i, int rows) noexcept nogil
