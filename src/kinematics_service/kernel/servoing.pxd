cimport cython
cimport numpy as cnp

from . cimport arrays, places
from .servo_step cimport ServoStep

cdef double FASTEST

@cython.locals(rate=double, i=int, j=int)
cdef void _shorten_alike(ServoStep step, double size) noexcept nogil
@cython.locals(worst=int, k=int)
cdef void _hold_back(ServoStep step, double* q) noexcept nogil
@cython.locals(share=double, upper=double, lower=double, j=int)
cdef void _keep_to_limits(ServoStep step, double* q) noexcept nogil
@cython.locals(size=double, i=int)
cdef void _fill(ServoStep step, double* q, double* row, double* twist) noexcept nogil
@cython.locals(n=int, positions='double*', wanted='double*')
cpdef servo(ServoStep step, cnp.ndarray q, cnp.ndarray row, cnp.ndarray twist)
