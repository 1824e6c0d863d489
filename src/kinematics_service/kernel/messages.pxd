cimport cython
cimport numpy as cnp

from . cimport arrays, joint_memory, judging, outgoing, places
from .arm cimport Arm
from .outgoing cimport OutgoingMessages

@cython.locals(other='unsigned char', k=int)
cdef bint _is_of_form(long long* form, unsigned char* data, int size) noexcept nogil
cdef void _copy_numbers(
    unsigned char* data, Py_ssize_t at, Py_ssize_t count, double* numbers
) noexcept nogil
@cython.locals(
    size=Py_ssize_t, at=Py_ssize_t, stamp='long long', n=Py_ssize_t, width=Py_ssize_t,
    count=Py_ssize_t, velocity_count=Py_ssize_t, said=int,
)
cpdef int observe_bytes(
    Arm arm, cnp.ndarray memory, cnp.ndarray form, cnp.ndarray data, long long arrival,
    cnp.ndarray row, cnp.ndarray results, OutgoingMessages answers,
) except -9
