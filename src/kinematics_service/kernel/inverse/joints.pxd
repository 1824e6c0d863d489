cimport cython
cimport numpy as cnp
from libc cimport math

from ..layout cimport arrays, places

@cython.final
cdef class Joints:
    cdef tuple _arrays
    cdef double* scales
    cdef double* periods
    cdef double* limits
    cdef int n

    @cython.locals(period=double)
    cdef double without_turns(self, int j, double away) noexcept nogil
    @cython.locals(period=double, low=double, high=double, x=double, j=int)
    cdef void represent(self, double* near, double* q) noexcept nogil
    @cython.locals(square=double, share=double, j=int)
    cdef double square_to(self, double* near, double* q) noexcept nogil
    cdef double space(self, int j, double* q) noexcept nogil
    @cython.locals(margin=double, j=int)
    cdef double margin(self, double* q) noexcept nogil
    cdef bint are_inside(self, double* q) noexcept nogil
@cython.locals(count=Py_ssize_t, n=Py_ssize_t, k=Py_ssize_t)
cpdef representatives(Joints joints, cnp.ndarray near, cnp.ndarray q)
