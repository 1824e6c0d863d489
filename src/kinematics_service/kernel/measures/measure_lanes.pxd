cimport cython
from libc cimport math

from ..layout cimport arrays, places
from . cimport gradient_lanes, jacobi_lanes
from ..forward.chain cimport Chain
from .task_rows cimport TaskRows

cdef double LARGEST_NORM
cdef int ALL_LANES

@cython.locals(
    half=Py_ssize_t, v='double*', lane=Py_ssize_t, x=double, y=double, z=double, xx=double,
    xy=double, xz=double, yx=double, yy=double, yz=double, zx=double, zy=double, zz=double,
)
cdef void _to_base_axes(TaskRows task, double* vectors) noexcept nogil
@cython.locals(
    m=int, count=int, length=int, axis=Py_ssize_t, component=int, i=Py_ssize_t, j=Py_ssize_t, place=Py_ssize_t, lane=Py_ssize_t,
    a=double, b=double, c=double, x='double*', y='double*', z='double*', into='double*',
)
cdef void _fill_task_rows(
    int n, TaskRows task, double* J, double* W, Py_ssize_t width
) noexcept nogil
@cython.locals(
    m=Py_ssize_t, width=Py_ssize_t, i=Py_ssize_t, j=Py_ssize_t, place=Py_ssize_t, lane=Py_ssize_t, into='double*', scale=double
)
cdef void _scale_task_rows(int n, TaskRows task, double* W) noexcept nogil
@cython.locals(small=int, lane=Py_ssize_t)
cdef bint _decompose(
    double* W, double* sigma, Py_ssize_t count, Py_ssize_t length, Py_ssize_t width
) noexcept nogil
@cython.locals(determinants='double*', i=Py_ssize_t, k=Py_ssize_t, column=Py_ssize_t, lane=Py_ssize_t)
cdef void _write_determinant(int n, double* W, double* spare, double* measures) noexcept nogil
@cython.locals(m=int, count=int, length=int, volume='double*', k=Py_ssize_t, column=Py_ssize_t, lane=Py_ssize_t)
cdef bint _write_volume(
    int n, TaskRows task, double* J, double* W, double* sigma,
    double* measures,
) noexcept nogil
@cython.locals(lanes=int, smallest='double*', lane=Py_ssize_t)
cdef int _irregular(double* sigma, Py_ssize_t count) noexcept nogil
@cython.locals(smallest='double*', lane=Py_ssize_t)
cdef void _write_values(double* sigma, Py_ssize_t count, double* measures) noexcept nogil
@cython.locals(
    m=int, wide=cython.bint, count=int, length=int, width=Py_ssize_t, weights='double[16]',
    left='double[96]', i=Py_ssize_t, j=Py_ssize_t, k=Py_ssize_t, column=Py_ssize_t, r=Py_ssize_t, lane=Py_ssize_t, axis=Py_ssize_t, direction='double*',
    component='double*', right='double*', y='double*', scale=double,
)
cdef void _fill_slopes(
    int n, TaskRows task, double* W, double* sigma, double* Y
) noexcept nogil
@cython.locals(
    norms='double[16]', j=Py_ssize_t, lane=Py_ssize_t, along=double, norm=double, inverse=double,
    scale=double,
)
cdef void _write_way_out(
    int n, double* column_scales, double* way_out, double* distances
) noexcept nogil
@cython.locals(
    m=int, wide=cython.bint, length=int, i=Py_ssize_t, j=Py_ssize_t, k=Py_ssize_t, column=Py_ssize_t, lane=Py_ssize_t, axis=Py_ssize_t,
    component='double*', along='double*', scale=double,
)
cdef void _write_direction(
    int n, TaskRows task, double* direction, double* lost,
    double* motion,
) noexcept nogil
@cython.locals(
    n=int, m=int, count=int, length=int, W='double*', Y='double*', J='double*', lost='double*',
    motion='double*', way_out='double*', sigma='double*', irregular=int, screws='double*',
    distances='double*', direction='double*',
)
cdef int measure_rows(
    Chain chain, TaskRows task, double* rows,
    double* measures, double* work,
) noexcept nogil
