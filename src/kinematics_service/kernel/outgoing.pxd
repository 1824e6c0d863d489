cimport cython
cimport numpy as cnp

from .layout cimport arrays, places

cdef class OutgoingMessages:
    cdef readonly object table
    cdef readonly Py_ssize_t stamped, count, needed
    cdef unsigned char* data
    cdef long long* stamps
    cdef long long* targets
    cdef long long* sources

@cython.locals(size=Py_ssize_t)
cpdef fill_messages(
    OutgoingMessages messages, long long stamp, cnp.ndarray row, cnp.ndarray measures
)
@cython.locals(
    seconds='long long', nanoseconds='long long', source='long long', number=double, k=Py_ssize_t
)
cdef void fill(
    OutgoingMessages messages, long long stamp, double* row, Py_ssize_t size, double* measures
) noexcept nogil
cdef int check_fit(OutgoingMessages messages, Py_ssize_t numbers) except -1
