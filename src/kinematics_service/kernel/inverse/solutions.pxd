cimport cython
cimport numpy as cnp
from libc cimport math

from ..layout cimport arrays, places
from .joints cimport Joints
from .residuals cimport Residual

cdef double MAYBE_SAME, AS_GOOD

@cython.final
cdef class Solutions:
    cdef readonly object q
    cdef readonly int count
    cdef readonly bint regular
    cdef readonly bint sure
    cdef double* room
    cdef double* rows
    cdef double* misses
    cdef double* margins
    cdef double* shares
    cdef long long* beyond
    cdef long long* postures
    cdef Py_ssize_t most
    cdef Py_ssize_t n

    @cython.locals(n=Py_ssize_t, i=int, j=int)
    cdef void take(self, Py_ssize_t k, Joints joints, double* q, double misses) noexcept nogil
    cdef int require(self, Py_ssize_t k) except -1
    cpdef double miss(self, Py_ssize_t k) except? -9.0
    cpdef double margin(self, Py_ssize_t k) except? -9.0
    cpdef double share(self, Py_ssize_t k) except? -9.0
    cpdef bint is_beyond(self, Py_ssize_t k, Py_ssize_t j) except -1
    @cython.locals(signs='long long*')
    cpdef tuple posture(self, Py_ssize_t k)

@cython.final
cdef class SolutionCandidates:
    cdef double* room
    cdef double* q
    cdef double* errors
    cdef double* away
    cdef double* halfway
    cdef long long* which
    cdef long long* met
    cdef Py_ssize_t n

    @cython.locals(
        n=Py_ssize_t, q='double*', errors='double*', x=double, i=int, j=Py_ssize_t, k=int
    )
    cdef void sort_by_error(self, int count) noexcept nogil
    @cython.locals(kept=int, known=cython.bint, i=int, k=int)
    cdef int keep_distinct(
        self, int count, Residual residual, Joints joints, double proved
    ) noexcept nogil
    @cython.locals(
        a='double*', b='double*', distance=double, away=double, left=double, length=double,
        j=int,
    )
    cdef bint _are_one(
        self, int one, int other, Residual residual, Joints joints
    ) noexcept nogil

cdef int require_fit(
    Residual residual, Joints joints, Solutions solution, Py_ssize_t most
) except -1
@cython.locals(
    n=Py_ssize_t, rows=Py_ssize_t, positions='double*', left='double*', kept='long long*',
    times='long long*', found=SolutionCandidates, count=int, k=Py_ssize_t,
)
cpdef int distinct(
    Residual residual, Joints joints, double proved, cnp.ndarray q,
    cnp.ndarray errors, cnp.ndarray which, cnp.ndarray met,
) except -9
@cython.locals(at=int, i=int)
cdef int least(double* numbers, int count) noexcept nogil
