cimport cython
cimport numpy as cnp
from libc cimport math

from . cimport arrays, evaluation, factors, places, singularity

@cython.locals(
    count=int, task_rows=int, nearest=int, f=int, j=int, squares=double, slope=double
)
cdef int _judge_factors(
    double* arm, int n, double* q, double* judged, double* steps
) noexcept nogil
@cython.locals(
    n=int, count=int, nearest=int, distance=double, estimate=double, complete=cython.bint,
    watched=double, warn=double, stop=double, sign=double, level=double,
)
cdef void judge_row(
    double* arm, double* row, double* q, double* measures, double* work
) noexcept nogil
@cython.locals(n=Py_ssize_t, m=Py_ssize_t)
cdef Py_ssize_t room(double* arm) noexcept nogil
@cython.locals(n=Py_ssize_t, m=Py_ssize_t, judged=Py_ssize_t)
cdef Py_ssize_t width(double* arm) noexcept nogil
@cython.locals(
    count=Py_ssize_t, row_width=Py_ssize_t, n=Py_ssize_t, columns=Py_ssize_t, k=Py_ssize_t,
)
cpdef measure(cnp.ndarray arm, cnp.ndarray rows, cnp.ndarray q, cnp.ndarray measures)
@cython.locals(tail=Py_ssize_t)
cpdef measure_one(cnp.ndarray arm, cnp.ndarray row, cnp.ndarray measures)
@cython.locals(bad=int)
cpdef int evaluate_and_measure_one(
    cnp.ndarray arm, cnp.ndarray q, cnp.ndarray qdot, cnp.ndarray row, cnp.ndarray measures
) except -9
