cimport cython
from libc cimport math

from ..layout cimport places

cdef double BORDER, APART
cdef int SWEEPS

ctypedef (double, double) Pair

cdef int circle_roots(double A, double B, double C, double* roots) noexcept nogil
cdef double square_root_apart(double square, double size) noexcept nogil
cdef double absolute(double x, double y) noexcept nogil
@cython.locals(
    radius=double, last=double, share=double, turn=double, largest=double, dx=double, dy=double,
    k=int,
)
cdef void polynomial_roots(double* c, int degree, double* z) noexcept nogil
@cython.locals(
    x=double, y=double, value=double, value_i=double, slope=double, slope_i=double,
    product=double, others=double, others_i=double, dx=double, dy=double, square=double,
    below=double, below_i=double, i=int,
)
cdef Pair _correction(double* c, int degree, double* z, int k) noexcept nogil
