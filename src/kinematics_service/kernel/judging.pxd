cimport cython
cimport numpy as cnp
from libc cimport math

from . cimport evaluation
from .layout cimport arrays, lanes, places
from .measures cimport (
    factor_lanes, factors, gradient, measure_lanes, nearest_closed, singularity,
)
from .measures.arm cimport Arm
from .measures.nearest_singular cimport NearestSearch

@cython.locals(n=int, count=int, f=int, j=int, squares=double, slope=double)
cdef void _judge_factors(Arm arm, double* q, double* judged, double* steps) noexcept nogil
@cython.locals(
    n=int, count=int, distances='double*', results='double*', way_out='double*', squares=double,
    slope=double, determinant=double, norm=double, away=double, nearest=double, sign=double, k=int,
    j=int,
)
cdef void _judge_loops(Arm arm, double* row, double* measures, double* work) noexcept nogil
@cython.locals(
    nearest=int, f=int, judged='double*', distances='double*', watched=double, sign=double,
    level=double,
)
cdef void _judge(Arm arm, double* measures, double not_excluded) noexcept nogil
@cython.locals(estimate=double, nearest=double, distances='double*', f=int)
cdef double _first_order(Arm arm, double* measures) noexcept nogil
@cython.locals(judged='double*', pose='double*', estimate=double, j=int)
cdef void _judge_first_order(Arm arm, double* measures) noexcept nogil
@cython.locals(judged='double*')
cdef void _take_over(Arm arm, double* measures, NearestSearch search) noexcept nogil
@cython.locals(judged='double*', distances='double*', pose='double*', estimate=double, away=double)
cdef void _look_behind_loops(
    Arm arm, double* row, double* q, double* measures, double* work
) noexcept nogil
@cython.locals(judged='double*', estimate=double)
cdef void judge_row(
    Arm arm, double* row, double* q, double* measures, double* work, NearestSearch search
) noexcept nogil
@cython.locals(steps='double*')
cdef void _judge_one(Arm arm, double* row, double* q, double* measures, double* work) noexcept nogil
@cython.locals(
    n=Py_ssize_t, columns=Py_ssize_t, length=Py_ssize_t, measured='double*', evaluated='double*',
    free='double*', positions='double*', judged='double*', left=int, lane=Py_ssize_t,
)
cdef int _judge_rows(
    Arm arm, double* rows, Py_ssize_t row_width, double* q, double* measures, double* work
) noexcept nogil
@cython.locals(
    n=Py_ssize_t, columns=Py_ssize_t, regular=cython.bint, k=Py_ssize_t, together=Py_ssize_t,
    left=int, one=Py_ssize_t,
)
cdef void _judge_all(
    Arm arm, Py_ssize_t count, double* rows, Py_ssize_t row_width, double* q, double* measures,
    double* work
) noexcept nogil
@cython.locals(
    n=Py_ssize_t, columns=Py_ssize_t, k=Py_ssize_t, position='double*', one='double*',
    judged='double*', estimate=double, row='double*', sigma='double*',
)
cdef void _find_all(
    Arm arm, Py_ssize_t count, double* rows, Py_ssize_t row_width, double* q, double* measures,
    double* work, NearestSearch search, bint in_order
) noexcept nogil
cdef Py_ssize_t _judged_at(Arm arm) noexcept nogil
cdef int _factors(Arm arm) noexcept nogil
@cython.locals(n=Py_ssize_t, m=Py_ssize_t)
cdef Py_ssize_t _directions(Arm arm) noexcept nogil
@cython.locals(n=Py_ssize_t, spare=Py_ssize_t, own=Py_ssize_t)
cdef Py_ssize_t room(Arm arm) noexcept nogil
cdef Py_ssize_t width(Arm arm) noexcept nogil
@cython.locals(n=Py_ssize_t, m=Py_ssize_t, free=Py_ssize_t)
cdef Py_ssize_t _room_side_by_side(Arm arm) noexcept nogil
cdef _check_rows(Arm arm, cnp.ndarray rows, cnp.ndarray measures)
@cython.locals(count=Py_ssize_t, row_width=Py_ssize_t)
cpdef measure(Arm arm, cnp.ndarray rows, cnp.ndarray q, cnp.ndarray measures)
@cython.locals(count=Py_ssize_t, row_width=Py_ssize_t, arm=Arm)
cpdef find_nearest(
    NearestSearch search, cnp.ndarray rows, cnp.ndarray q, cnp.ndarray measures, bint in_order
)
@cython.locals(tail=Py_ssize_t, arm=Arm)
cpdef measure_one(NearestSearch search, cnp.ndarray row, cnp.ndarray measures)
@cython.locals(bad=int)
cpdef int evaluate_and_measure_one(
    Arm arm, cnp.ndarray q, cnp.ndarray qdot, cnp.ndarray row, cnp.ndarray measures
) except -9
