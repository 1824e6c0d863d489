cimport cython
from libc cimport math

from ..layout cimport arrays, places
from . cimport curvature, singular_equations, symmetric
from .singular_equations cimport SingularEquations

cdef int HALVINGS
cdef double BOUND

@cython.final
cdef class SingularQuadric:
    cdef int n, steep
    cdef double f
    cdef double* room
    cdef double* g
    cdef double* along
    cdef double* b
    cdef double* c
    cdef double* x
    cdef double* K
    cdef double* Z

    @cython.locals(n=int, k=int, i=int, j=int, second=double, f=double, along=double, sign=double)
    cdef void stand_at(self, SingularEquations equations, double* d) noexcept nogil
    @cython.locals(n=int, k=int, i=int, j=int, r=int, scale='double*')
    cdef void _write_curvature(
        self, SingularEquations equations, double second
    ) noexcept nogil
    @cython.locals(n=int, k=int, i=int)
    cdef void _add_second(self, SingularEquations equations) noexcept nogil
    @cython.locals(n=int, i=int, j=int, both=double)
    cdef void _add_product(self, double factor) noexcept nogil
    @cython.locals(
        n=int, e=int, i=int, j=int, largest=double, steepest=double, slope=double, low=double,
        high=double, multiplier=double, left=double, root=double,
    )
    cdef double write_nearest(self, bint other, double* x) noexcept nogil
    @cython.locals(curved=double, along=double, inside=double, total=double, root=double, j=int)
    cdef double write_along_axis(self, int i, double* x) noexcept nogil
    @cython.locals(n=int, i=int, left=double, curved=double, x=double)
    cdef double _left(self, double multiplier) noexcept nogil
