cimport cython
cimport numpy as cnp
from libc cimport math

from . cimport arrays, chain_pass, places, vectors
from .chain cimport Chain

cdef double NEARLY_ROTATION, ROTATION

ctypedef (double, double) Pair

@cython.locals(
    x=double, y=double, z=double, a=double, b=double, c=double, sine=double, cosine=double,
    angle=double, share=double,
)
cdef vectors.Triple _rotation_vector(double* R) noexcept nogil
cdef vectors.Triple _turned_back(double* aim, vectors.Triple v) noexcept nogil
cdef void _write_weighted(
    double* aim, double scale, vectors.Triple linear, vectors.Triple angular, double* six
) noexcept nogil
@cython.locals(
    linear=vectors.Triple, angular=vectors.Triple, R='double[9]', square=double, i=int, j=int
)
cdef double miss(double* aim, double* row, double* error) noexcept nogil
@cython.locals(linear=vectors.Triple, angular=vectors.Triple, j=int)
cdef void write_columns(
    double* aim, int n, double* row, double* scales, double* columns
) noexcept nogil
cdef double length_of(double* aim) noexcept nogil
@cython.locals(
    n=int, row='double*', error='double[6]', length=double, angular=double, linear=double
)
cpdef tuple parts_of_error(
    Chain chain, cnp.ndarray aim, cnp.ndarray q
)
@cython.locals(off=double, a=vectors.Triple, b=vectors.Triple, i=int, j=int)
cdef double _off(double* T) noexcept nogil
cpdef double off_rotation(cnp.ndarray T) except? -9.0
@cython.locals(size=Py_ssize_t, off=double, i=Py_ssize_t, k=Py_ssize_t)
cpdef int take_aim(cnp.ndarray target, cnp.ndarray aim) except -9
