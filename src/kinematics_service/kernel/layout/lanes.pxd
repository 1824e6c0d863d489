cimport cython

from . cimport arrays, places

@cython.locals(k=Py_ssize_t, lane=Py_ssize_t)
cdef void put_side_by_side(
    double* rows, Py_ssize_t width, Py_ssize_t count, double* lanes
) noexcept nogil
@cython.locals(
    k=Py_ssize_t, lane=Py_ssize_t, row='double*', of_lane='double*', first=double, second=double
)
cdef void put_one_by_one(
    double* lanes, Py_ssize_t count, double* rows, Py_ssize_t width
) noexcept nogil
@cython.locals(k=Py_ssize_t, beyond=Py_ssize_t)
cdef bint all_within(double* numbers, Py_ssize_t count, double limit) noexcept nogil
