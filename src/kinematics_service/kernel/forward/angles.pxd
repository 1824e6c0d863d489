cimport cython
from libc cimport math

from ..layout cimport places
from . cimport chain_pass

@cython.locals(size=double, m=double, c=double, r=double)
cpdef double shortest_angle(double step) noexcept nogil
cpdef tuple sine_and_cosine(double x)
