cimport cython
from libc cimport math

from ..forward cimport vectors
from ..layout cimport places

cdef double BORDER, APART, MARGIN
cdef int SWEEPS

ctypedef (double, double) Pair

@cython.locals(
    radius=double, room=double, unsure=double, share=double, middle=double, sine=double,
    half=double,
)
cdef int circle_roots(
    double A, double B, double C, double error, double* roots
) noexcept nogil
@cython.locals(half=double)
cdef int square_roots(
    double middle, double square, double size, double error, double* roots
) noexcept nogil
@cython.locals(across=vectors.Triple, length=double)
cdef double turn_error(vectors.Triple axis, vectors.Triple v, double error) noexcept nogil
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
@cython.locals(
    x=double, y=double, value=double, value_i=double, product=double,
    away=double, i=int,
)
cdef double root_bound(double* c, int degree, double error, double* z, int k) noexcept nogil
@cython.locals(away=double, i=int)
cdef bint is_apart(double* z, double* bounds, int count, int k) noexcept nogil
