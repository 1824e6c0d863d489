cimport cython
from libc cimport math

from ..forward cimport chain_pass
from ..layout cimport places

@cython.locals(c=double, s=double, k=int)
cdef void write_circle(int samples, double* circle) noexcept nogil
@cython.locals(noise=double, re=double, im=double, m=int, n=int, k=int)
cdef double write_coefficients(
    double* values, int count, double* circle, double largest, int degree, double* c
) noexcept nogil
