cimport cython
cimport numpy as cnp
from libc cimport math

from . cimport evaluation, joint_memory
from .forward cimport angles
from .layout cimport arrays, places
from .loops cimport closing
from .measures.arm cimport Arm
from .joint_memory cimport JointMemory, OurJoints

cdef double MOVED_APART, RETURNED

@cython.locals(count='long long')
cdef void _note_jump(JointMemory memory, Py_ssize_t j, long long arrival) noexcept nogil
@cython.locals(
    j=Py_ssize_t, k=Py_ssize_t, velocity=double, speed=double, moved=double, away=double
)
cdef void _note_late(
    JointMemory memory, OurJoints ours, double* positions, long long stamp, long long arrival
) noexcept nogil
@cython.locals(
    j=Py_ssize_t, k=Py_ssize_t, place=Py_ssize_t, position=double, known=double, jump=double,
    back=double, velocity=double, differenced=int, since='long long', step=double,
)
cdef void _store(
    JointMemory memory, OurJoints ours, double* positions, double* velocities, bint heard,
    long long at, bint stamped, long long arrival,
) noexcept nogil
@cython.locals(computable=cython.bint, k=Py_ssize_t)
cdef bint _all_computable(double* numbers, OurJoints ours) noexcept nogil
@cython.locals(latest='long long', j=Py_ssize_t, k=Py_ssize_t)
cdef long long _latest_stamp(JointMemory memory, OurJoints ours) noexcept nogil
@cython.locals(
    new_start=int, latest='long long', heard=cython.bint, at='long long', outcome=int, j=Py_ssize_t,
    unheard='long long',
)
cdef int _merge(
    JointMemory memory, OurJoints ours, double* positions, double* velocities,
    bint has_velocities, long long stamp, long long received, long long arrival,
) noexcept nogil
@cython.locals(along=double, sign=double, i=int)
cdef void _write_continuous_quaternion(
    JointMemory memory, double* row, Py_ssize_t at
) noexcept nogil
@cython.locals(failed=int, k=int)
cdef bint _close(Arm arm, JointMemory memory, double* q, double* section) noexcept nogil
@cython.locals(
    outcome=int, moving=cython.bint, loops=cython.bint, n=Py_ssize_t, j=Py_ssize_t
)
cdef int take(
    Arm arm, JointMemory memory, OurJoints ours, double* positions, double* velocities,
    bint has_velocities, long long stamp, long long received, long long arrival, double* row,
    Py_ssize_t at,
) noexcept nogil
cdef int check_fit(
    Arm arm, JointMemory memory, OurJoints ours, Py_ssize_t count, Py_ssize_t at
) except -1
@cython.locals(at=Py_ssize_t)
cpdef int observe(
    Arm arm, JointMemory memory, OurJoints ours, cnp.ndarray positions, cnp.ndarray velocities,
    long long stamp, long long received, long long arrival, cnp.ndarray row,
) except -9
