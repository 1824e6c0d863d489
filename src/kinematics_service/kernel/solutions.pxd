cimport cython
cimport numpy as cnp
from libc cimport math

from . cimport aims, arrays, places, refinement
from .chain cimport Chain

cdef double MAYBE_SAME, AS_GOOD

cdef double _without_turns(double away, double period) noexcept nogil
@cython.locals(n=int, distance=double, away=double, left=double, length=double, j=int)
cdef bint _are_one(
    Chain chain, double* aim, double* scales, double* periods,
    double error, double* a, double* b, double* work,
) noexcept nogil
@cython.locals(n=Py_ssize_t, count=int, known=cython.bint, i=int, k=Py_ssize_t)
cdef int distinct_rows(
    Chain chain, double* aim, double* scales, double* periods,
    double proved, int rows, double* q, double* errors, long long* which, long long* met,
    double* work,
) noexcept nogil
cdef Py_ssize_t room(Py_ssize_t n, Py_ssize_t row) noexcept nogil
@cython.locals(n=Py_ssize_t, rows=Py_ssize_t, count=int)
cpdef int distinct(
    Chain chain, cnp.ndarray aim, cnp.ndarray scales,
    cnp.ndarray periods, double proved, cnp.ndarray q, cnp.ndarray errors, cnp.ndarray which,
    cnp.ndarray met,
) except -9
@cython.locals(period=double, low=double, high=double, x=double, j=int)
cdef void _represent(
    int n, double* limits, double* periods, double* near, double* q
) noexcept nogil
@cython.locals(count=Py_ssize_t, n=Py_ssize_t, k=Py_ssize_t)
cpdef representatives(
    cnp.ndarray limits, cnp.ndarray periods, cnp.ndarray near, cnp.ndarray q
)
@cython.locals(away=double, margin=double, space=double, share=double, j=int)
cdef double stand(
    int n, double* limits, double* periods, double* scales, double* near, double* q,
    double* facts,
) noexcept nogil
@cython.locals(at=int, i=int)
cdef int least(double* numbers, int count) noexcept nogil
@cython.locals(x=double, i=int, j=int, k=int)
cdef void sort_by_error(int n, int count, double* q, double* errors) noexcept nogil
