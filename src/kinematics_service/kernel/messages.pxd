cimport cython
cimport numpy as cnp

from . cimport judging, observing, outgoing
from .layout cimport arrays, places
from .measures.arm cimport Arm
from .joint_memory cimport JointMemory, OurJoints
from .measures.nearest_singular cimport NearestSearch
from .outgoing cimport OutgoingMessages

cdef class IncomingForm:
    cdef readonly object table
    cdef readonly OurJoints ours
    cdef readonly Py_ssize_t size
    cdef readonly long long stamp
    cdef Py_ssize_t stamp_at, positions_at, velocities_at, position_count, velocity_count
    cdef unsigned char* fixed
    cdef unsigned char* same

@cython.locals(other='unsigned char', k=Py_ssize_t)
cdef bint _fits(IncomingForm form, unsigned char* data) noexcept nogil
cdef void _copy_numbers(
    unsigned char* data, Py_ssize_t at, Py_ssize_t count, double* numbers
) noexcept nogil
@cython.locals(
    octets='unsigned char*', at=Py_ssize_t, stamp='long long', n=Py_ssize_t, width=Py_ssize_t, count=Py_ssize_t,
    evaluated='double*', measured='double*', work='double*', velocities='double*', said=int,
    arm=Arm, numbers=Py_ssize_t, q='double*', qdot='double*',
)
cpdef int observe_bytes(
    NearestSearch search, JointMemory memory, IncomingForm form, bytes data, long long arrival,
    cnp.ndarray row, cnp.ndarray measures, OutgoingMessages answers,
) except -9
