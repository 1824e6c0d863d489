cimport cython
from libc cimport math

from ..layout cimport arrays
from . cimport symmetric

cdef double ROUND_OFF

@cython.final
cdef class Norms:
    cdef double* room
    cdef double* W
    cdef double* G
    cdef double* Z

    @cython.locals(
        squares=double, k=int, i=int, j=int, a='double*', b='double*', value=double,
        largest=double,
    )
    cdef double norm(self, int count, int length) noexcept nogil
