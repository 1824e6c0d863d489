cimport cython
cimport numpy as cnp

from ..layout cimport arrays, places
from .servo_step cimport ServoOutput

cdef double FASTEST

@cython.locals(rate=double, i=int, j=int)
cdef void _shorten_alike(ServoOutput step, double size) noexcept nogil
@cython.locals(worst=int, k=int)
cdef void _hold_back(ServoOutput step, double* q) noexcept nogil
@cython.locals(share=double, upper=double, lower=double, j=int)
cdef void _keep_to_limits(ServoOutput step, double* q) noexcept nogil
@cython.locals(size=double, i=int)
cdef void _fill(ServoOutput step, double* q, double* row, double* twist) noexcept nogil
@cython.locals(n=int, positions='double*', wanted='double*')
cpdef servo(ServoOutput step, cnp.ndarray q, cnp.ndarray row, cnp.ndarray twist)
