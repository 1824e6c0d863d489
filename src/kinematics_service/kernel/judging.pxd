cimport cython
cimport numpy as cnp
from libc cimport math

from . cimport arrays, evaluation, factors, places, singularity
from .arm cimport Arm

@cython.locals(n=int, count=int, nearest=int, f=int, j=int, squares=double, slope=double)
cdef int _judge_factors(Arm arm, double* q, double* judged, double* steps) noexcept nogil
@cython.locals(
    n=int, count=int, nearest=int, distance=double, estimate=double, watched=double,
    sign=double, level=double,
)
cdef void judge_row(
    Arm arm, double* row, double* q, double* measures, double* work
) noexcept nogil
@cython.locals(n=Py_ssize_t, m=Py_ssize_t)
cdef Py_ssize_t room(Arm arm) noexcept nogil
@cython.locals(n=Py_ssize_t, m=Py_ssize_t, judged=Py_ssize_t)
cdef Py_ssize_t width(Arm arm) noexcept nogil
@cython.locals(
    count=Py_ssize_t, row_width=Py_ssize_t, n=Py_ssize_t, columns=Py_ssize_t, k=Py_ssize_t,
)
cpdef measure(Arm arm, cnp.ndarray rows, cnp.ndarray q, cnp.ndarray measures)
@cython.locals(tail=Py_ssize_t)
cpdef measure_one(Arm arm, cnp.ndarray row, cnp.ndarray measures)
@cython.locals(bad=int)
cpdef int evaluate_and_measure_one(
    Arm arm, cnp.ndarray q, cnp.ndarray qdot, cnp.ndarray row, cnp.ndarray measures
) except -9
