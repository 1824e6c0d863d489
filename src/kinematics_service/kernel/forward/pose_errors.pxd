cimport cython
cimport numpy as cnp

from ..layout cimport arrays, places
from .chain cimport Chain

cdef int COVARIANCES

cdef class PoseErrors:
    cdef readonly Chain chain
    cdef readonly object table, reaches
    cdef readonly int screws, causes
    cdef long long* frame
    cdef double* screw
    cdef long long* gear
    cdef double* spread
    cdef double* rates
    cdef double* floor
    cdef long long* reach

cdef Py_ssize_t room(PoseErrors errors) noexcept nogil
@cython.locals(
    T='double*', screw='double*', R='double*', i=int, x=double, y=double, z=double
)
cdef void _write_column(PoseErrors errors, int s, double* row, double* column) noexcept nogil
@cython.locals(i=int, j=int, k=int, vj=double, vk=double, wj=double, wk=double)
cdef void _write_rate(
    double* column, double* before, double* twist, double* rate
) noexcept nogil
@cython.locals(i=int)
cdef void _drive(
    double share, double rate_of_share, double* column, double* rate
) noexcept nogil
@cython.locals(turned='double[6]', part=int, i=int, j=int, k=int, along=double)
cdef void _turn_into_tool_axes(
    double* row, double* column, double* twist, double* rate
) noexcept nogil
@cython.locals(screws='double*', e=int, i=int, rate=double)
cdef void _carry_on(
    Chain chain, int element, double* row, double* qdot, double* before
) noexcept nogil
@cython.locals(
    spread='double*', one='double*', vx=double, vy=double, vz=double, wx=double, wy=double,
    wz=double, k=int, along=double,
)
cdef void _add_causes(PoseErrors errors, int s, double* column, double* moved) noexcept nogil
@cython.locals(
    n=int, twist='double*', still='double[6]', rate='double[6]', j=int, i=int,
)
cdef void _write_noise(
    PoseErrors errors, double* row, bint in_tool_axes, double* moved
) noexcept nogil
@cython.locals(sums='double[36]', one='double*', i=int, j=int, k=int)
cdef void _write_products(double* moved, int count, double* covariance) noexcept nogil
@cython.locals(
    causes=int, n=int, changed='double*', twist='double*',
    column='double[6]', rate='double[6]', before='double[6]', k=int, element=int, s=int, i=int,
    gear='long long',
)
cdef void write_covariances(
    PoseErrors errors, double* row, double* q, double* qdot, bint of_pose, bint of_twist,
    bint in_tool_axes, double* covariances, double* work,
) noexcept nogil
@cython.locals(
    n=Py_ssize_t, count=Py_ssize_t, width=Py_ssize_t, table='double*', rates='double*',
    positions='double*', found='double*', work='double*', k=Py_ssize_t,
)
cpdef covariances(
    PoseErrors errors, cnp.ndarray rows, cnp.ndarray q, cnp.ndarray qdot, bint in_tool_axes,
    cnp.ndarray results,
)
