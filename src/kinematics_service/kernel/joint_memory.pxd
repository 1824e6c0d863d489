cimport cython
cimport numpy as cnp
from libc cimport math

from . cimport angles, arrays, evaluation, places
from .arm cimport Arm

cdef double MOVED_APART, RETURNED

cdef Py_ssize_t _joints(Py_ssize_t size) noexcept nogil
@cython.locals(count='long long', at=int)
cdef void _note_jump(long long* whole, int n, int j, long long arrival) noexcept nogil
@cython.locals(j=int)
cdef void _forget(double* memory, int n) noexcept nogil
cpdef forget(cnp.ndarray memory)
@cython.locals(j=int, k=int, velocity=double, speed=double, moved=double, away=double)
cdef void _note_late(
    double* memory, int n, int ours, long long* layout, double* positions, long long stamp,
    long long arrival,
) noexcept nogil
@cython.locals(
    j=int, k=int, place=int, position=double, known=double, jump=double, back=double,
    velocity=double, differenced=int, since='long long', step=double,
)
cdef void _store(
    double* memory, int n, int ours, long long* layout, double* positions, double* velocities,
    bint heard, long long at, bint stamped, long long arrival,
) noexcept nogil
@cython.locals(computable=cython.bint, k=int)
cdef bint _all_computable(double* numbers, long long* places_of, int count) noexcept nogil
@cython.locals(latest='long long', j=int, k=int)
cdef long long _latest_stamp(
    long long* joints, int n, int ours, long long* layout
) noexcept nogil
@cython.locals(
    anew=int, latest='long long', heard=cython.bint, at='long long', said=int, j=int,
    unheard='long long',
)
cdef int _merge(
    double* memory, int n, int ours, long long* layout, double* positions, double* velocities,
    bint has_velocities, long long stamp, long long received, long long arrival,
) noexcept nogil
@cython.locals(along=double, sign=double, i=int)
cdef void _write_continuous_quaternion(double* memory, double* row, int at) noexcept nogil
@cython.locals(said=int, moving=cython.bint, j=int)
cdef int take(
    Arm arm, double* memory, int n, int ours, long long* layout, double* positions,
    double* velocities, bint has_velocities, long long stamp, long long received,
    long long arrival, double* row, int at,
) noexcept nogil
@cython.locals(n=int, at=Py_ssize_t)
cpdef int observe(
    Arm arm, cnp.ndarray memory, cnp.ndarray layout, cnp.ndarray positions,
    cnp.ndarray velocities, long long stamp, long long received, long long arrival,
    cnp.ndarray row,
) except -9
