cimport cython
cimport numpy as cnp
from libc cimport math

from ..layout cimport arrays, places
from ..measures cimport singular_values
from ..measures.task_rows cimport TaskRows

cdef double AT_REST

@cython.final
cdef class Servo:
    cdef TaskRows task
    cdef tuple _arrays
    cdef int m
    cdef int n
    cdef double damping
    cdef double damped_below
    cdef double length
    cdef double horizon
    cdef double* limits
    cdef double* fastest

    cdef double upper(self, double* q, int j) noexcept nogil
    cdef double lower(self, double* q, int j) noexcept nogil

@cython.final
cdef class ServoOutput:
    cdef Servo servo
    cdef readonly object qdot
    cdef readonly double damping
    cdef readonly double least_singular_value
    cdef readonly double followed
    cdef readonly double shortened
    cdef readonly int slowest
    cdef double largest
    cdef double* room
    cdef double* rates
    cdef double* J
    cdef double* v
    cdef double* u
    cdef double* sigma
    cdef double* W
    cdef long long* free
    cdef long long* held
    cdef int count

    @cython.locals(j=int)
    cdef void begin(self) noexcept nogil
    cpdef bint is_held(self, Py_ssize_t j) except -1
    @cython.locals(
        n=int, axes='double*', axis=int, first=int, component=int, jacobian='double*', x=double,
        y=double, z=double, a=double, b=double, c=double, weight=double, value=double, i=int,
        j=int,
    )
    cdef void write_task(self, double* row, double* twist, double size) noexcept nogil
    @cython.locals(
        m=int, count=int, W='double*', free='long long*', damping=double, below=double,
        wide=cython.bint, rows=int, length=int, width=int, row='double*', turns='double*',
        square=double, share=double, along=double, least=double, made=double, wanted=double,
        own=double, i=int, j=int, k=int,
    )
    cdef void solve(self) noexcept nogil
    @cython.locals(n=int, width=int, wide=cython.bint, at=int, i=int, j=int)
    cdef void _write_matrix(self, int rows, int length) noexcept nogil
    @cython.locals(
        worst=int, over=double, upper=double, lower=double, beyond=double, j=int, k=int
    )
    cdef int worst(self, double* q) noexcept nogil
    @cython.locals(n=int, j=int, upwards=cython.bint, done=double, i=int)
    cdef void hold(self, int k, double* q) noexcept nogil
