cimport cython

from .layout cimport arrays, places

cdef class JointMemory:
    cdef readonly object columns
    cdef readonly int joints, closure
    cdef public long long timeout
    cdef public int velocity_source
    cdef public bint is_new_tool, is_closed
    cdef double* position
    cdef double* before
    cdef double* velocity
    cdef long long* differenced
    cdef long long* known
    cdef long long* stamped
    cdef long long* wraps
    cdef long long* stamp
    cdef long long* arrival
    cdef long long* jump_count
    cdef long long* jumps
    cdef double* last_quaternion
    cdef double* closed

cdef class OurJoints:
    cdef readonly tuple table
    cdef readonly Py_ssize_t count, joints_needed, places_needed
    cdef long long* joint
    cdef long long* place

@cython.locals(j=Py_ssize_t)
cdef void clear(JointMemory memory) noexcept nogil
cpdef forget(JointMemory memory)
