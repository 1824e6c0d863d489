cimport cython
from libc cimport math

from . cimport places

@cython.locals(size=double, m=double, c=double, r=double)
cpdef double shortest_angle(double step) noexcept nogil
