cimport cython
cimport numpy as cnp
from libc cimport math

from ..forward cimport vectors
from ..layout cimport arrays, places
from ..loops cimport closed_pass
from ..forward.chain cimport Chain

ctypedef (double, double) Pair

cdef double LEAST

@cython.locals(
    x=double, y=double, z=double, a=double, b=double, c=double, sine=double, cosine=double,
    angle=double, share=double,
)
cdef vectors.Triple _rotation_vector(double* R) noexcept nogil
@cython.locals(normal=vectors.Triple, sine=double, angle=double, share=double)
cdef vectors.Triple _turn_between(vectors.Triple a, vectors.Triple b) noexcept nogil
cdef vectors.Triple _turned_back(double* axes, vectors.Triple v) noexcept nogil
cdef void _write_weighted(
    double* weights, double scale, vectors.Triple linear, vectors.Triple angular, double* six
) noexcept nogil

@cython.final
cdef class Residual:
    cdef Chain chain
    cdef tuple _arrays
    cdef double* room
    cdef double* pose
    cdef double* axes
    cdef double* weights
    cdef double* error
    cdef double* columns
    cdef double* still
    cdef double* row
    cdef int n
    cdef int tool_axis
    cdef double reach

    @cython.locals(total=double)
    cdef bint evaluate(self, double* q, int depth) noexcept nogil
    @cython.locals(
        goal='double*', row='double*', error='double*', R='double[9]', linear=vectors.Triple,
        angular=vectors.Triple, turn=vectors.Triple, square=double, i=int, j=int, k=int,
    )
    cdef double square(self, double* q, int depth) noexcept nogil
    @cython.locals(
        n=int, linear=vectors.Triple, angular=vectors.Triple, turn=vectors.Triple,
        axis=vectors.Triple, J='double*', j=int, k=int,
    )
    cdef void write_columns(self, double* scales) noexcept nogil
    cdef double length(self) noexcept nogil
    cdef double size(self) noexcept nogil

@cython.locals(error='double*', length=double, angular=double, linear=double)
cpdef tuple parts_of_error(Residual residual, cnp.ndarray q)
