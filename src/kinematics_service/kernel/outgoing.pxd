cimport cython
cimport numpy as cnp

from .forward cimport pose_errors
from .forward.chain cimport Chain
from .forward.pose_errors cimport PoseErrors
from .layout cimport arrays, places

cdef class OutgoingMessages:
    cdef readonly object table, found
    cdef readonly PoseErrors errors
    cdef readonly bint of_pose, of_twist
    cdef readonly Py_ssize_t stamped, count, needed
    cdef unsigned char* data
    cdef long long* stamps
    cdef long long* targets
    cdef long long* sources
    cdef double* covariances

@cython.locals(size=Py_ssize_t, measured=Py_ssize_t)
cpdef fill_messages(
    OutgoingMessages messages, long long stamp, cnp.ndarray row, cnp.ndarray measures
)
@cython.locals(
    seconds='long long', nanoseconds='long long', source='long long', number=double, k=Py_ssize_t
)
cdef void fill(
    OutgoingMessages messages, long long stamp, double* row, Py_ssize_t size, double* measures,
    Py_ssize_t measured,
) noexcept nogil
cdef int check_fit(
    OutgoingMessages messages, Chain chain, Py_ssize_t width, Py_ssize_t numbers
) except -1
@cython.locals(work='double*')
cdef int spread(OutgoingMessages messages, double* row, double* q, double* qdot) except -1
