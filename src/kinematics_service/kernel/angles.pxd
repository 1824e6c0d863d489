cimport cython
from libc cimport math

from . cimport chain_pass, places

@cython.locals(size=double, m=double, c=double, r=double)
cpdef double shortest_angle(double step) noexcept nogil
cpdef tuple sine_and_cosine(double x)
