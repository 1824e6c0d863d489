cimport cython
cimport numpy as cnp
from libc cimport math

from ..forward.vectors cimport Triple
from ..layout cimport arrays, places
from . cimport gradient, singular_values
from ..forward.chain cimport Chain
from .task_rows cimport TaskRows

@cython.locals(x=double, y=double, z=double, half=int, i=int)
cdef void to_base_axes(TaskRows task, double* vector) noexcept nogil
@cython.locals(axis=int, v=Triple, k=int, along=double)
cdef double task_component(
    TaskRows task, int r, Triple linear, Triple angular
) noexcept nogil
@cython.locals(
    m=int, count=int, length=int, axis=int, component=int, i=int, j=int,
    a=double, b=double, c=double, value=double,
)
cdef void _fill_task_rows(
    int n, TaskRows task, double* row, double* W, int width
) noexcept nogil
@cython.locals(m=int, place=int, i=int, j=int)
cdef void _scale_task_rows(int n, TaskRows task, double* W, int width) noexcept nogil
cdef void write_scaled_rows(
    int n, TaskRows task, double* row, double* W, int width
) noexcept nogil
cdef void _decompose(
    double* W, double* sigma, int count, int length, int width
) noexcept nogil
@cython.locals(m=int, count=int, length=int)
cdef void write_directions(
    int n, TaskRows task, double* row, double* W, double* sigma
) noexcept nogil
@cython.locals(i=int, j=int)
cdef void _write_determinant(int n, double* W, double* spare, double* measures) noexcept nogil
@cython.locals(m=int, count=int, length=int, i=int)
cdef void _write_volume(
    int n, TaskRows task, double* row, double* W, double* sigma, double* measures
) noexcept nogil
@cython.locals(rank=int, i=int)
cdef int _rank(double* sigma, int count) noexcept nogil
@cython.locals(
    m=int, wide=cython.bint, length=int, width=int, left='double[6]', i=int, j=int, r=int,
    weight=double, component=double, right=double,
)
cdef void _fill_slopes(
    int n, int first, int last, bint lost, TaskRows task, double* W, double* sigma, double* Y
) noexcept nogil
@cython.locals(last=int)
cdef void write_slopes_of_least(
    int n, TaskRows task, double* W, double* sigma, double* Y
) noexcept nogil
@cython.locals(m=int, wide=cython.bint, length=int, axis=int, i=int, j=int, along=double)
cdef void _write_direction(
    int n, TaskRows task, double* direction, double* lost, double* motion
) noexcept nogil
@cython.locals(
    n=int, m=int, generic_rank=int, count=int, length=int, by_determinant=cython.bint,
    lost=cython.bint, rank=int, last=int, first=int, j=int, squares=double, norm=double,
)
cdef void measure_row(
    Chain chain, TaskRows task, double* row, double* measures, double* work
) noexcept nogil
