cimport cython
cimport numpy as cnp

from . cimport arrays, closed_forms, dependence, places, posture, refinement, solutions, vectors
from .chain cimport Chain

cdef double LAST

@cython.locals(i=int, j=int, k=int)
cdef void _write_motion(
    int way, double* aim, double* point, double* home_inverse, bint backwards, double* T,
    double* B,
) noexcept nogil
@cython.locals(i=int, j=int)
cdef void _times(int rows, int columns, double* A, double* x, double* y) noexcept nogil
@cython.locals(n=int, one='double*', left=double, i=int, j=int)
cdef int _keep_nearest(
    Chain chain, double* aim, double* scales, double* periods,
    double* limits, double* near, double proved, int count, double* found, double* unlimited,
    double* away, double* q, double* facts, double* work,
) noexcept nogil
@cython.locals(n=int, about=int, kept=int, best=int, i=int, j=int)
cdef int _keep_all(
    Chain chain, double* aim, double* scales, double* periods,
    double* limits, double* near, double proved, int count, double* found, double* unlimited,
    double* away, double* q, double* facts, double* work,
) noexcept nogil
@cython.locals(
    most=Py_ssize_t, n=Py_ssize_t, k=Py_ssize_t, about=Py_ssize_t, count=int, kept=int,
    i=Py_ssize_t, j=Py_ssize_t,
)
cpdef int closed_solutions(
    Chain chain, cnp.ndarray aim, int way, cnp.ndarray screws,
    cnp.ndarray point, cnp.ndarray home_inverse, bint backwards, cnp.ndarray to_joints,
    cnp.ndarray to_screws, cnp.ndarray scales, cnp.ndarray periods, cnp.ndarray limits,
    cnp.ndarray near, double proved, bint only_one, cnp.ndarray q, cnp.ndarray facts,
    cnp.ndarray signs,
) except -9
