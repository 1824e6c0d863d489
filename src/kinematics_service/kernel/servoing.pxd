cimport cython
cimport numpy as cnp
from libc cimport math

from . cimport arrays, places, singular_values
from .task_rows cimport TaskRows

cdef double FASTEST, AT_REST

@cython.locals(
    wide=cython.bint, rows=int, length=int, width=int, square=double, share=double, used=double,
    along=double, i=int, j=int, k=int,
)
cdef void _write_damped_motion(
    int m, int n, double* J, long long* free, int count, double* v, int rank, double damping,
    double below, double* W, double* sigma, double* u, double* report,
) noexcept nogil
@cython.locals(
    m=int, axis=int, first=int, component=int, x=double, y=double, z=double, a=double, b=double,
    c=double, weight=double, value=double, largest=double, i=int, j=int,
)
cdef double _write_task(
    int n, TaskRows task, double* row, double* twist,
    double size, double* J, double* v,
) noexcept nogil
cdef double _upper(double* limits, double* q, int j, double horizon) noexcept nogil
cdef double _lower(double* limits, double* q, int j, double horizon) noexcept nogil
@cython.locals(
    worst=int, over=double, upper=double, lower=double, beyond=double, j=int, k=int
)
cdef int _worst(
    long long* free, int count, double* limits, double* q, double horizon, double* qdot,
    double* scales,
) noexcept nogil
@cython.locals(
    m=int, rank=int, scales='double*', length=double, horizon=double, size=double,
    largest=double, damping=double, below=double, rate=double, share=double, upper=double,
    lower=double, worst=int, count=int, i=int, j=int, k=int,
)
cdef void _servo(
    int n, TaskRows task, double* settings, double* limits, double* fastest, double* q,
    double* row, double* twist, double* qdot, long long* held, double* report, double* work,
) noexcept nogil
@cython.locals(n=Py_ssize_t, m=Py_ssize_t)
cpdef servo(
    TaskRows task, cnp.ndarray settings, cnp.ndarray limits, cnp.ndarray fastest, cnp.ndarray q,
    cnp.ndarray row, cnp.ndarray twist, cnp.ndarray qdot, cnp.ndarray held, cnp.ndarray report,
)
