cimport cython
cimport numpy as cnp
from libc cimport math

from . cimport aims, arrays, chain_pass, places
from .chain cimport Chain

cdef double ROUND_OFF, SLOW, STIFFEST, LEAST_LENGTH
cdef int PATIENCE

cdef Py_ssize_t room(Py_ssize_t n, Py_ssize_t row) noexcept nogil
@cython.locals(value=double, i=int, j=int, k=int)
cdef bint _damped_step(
    int n, double* A, double* g, double damping, double* L, double* step
) noexcept nogil
@cython.locals(size=double, upper=cython.bint, i=int, j=int, k=int)
cdef double _normal_equations(
    int n, double* columns, double* error, double* q, double* limits, double* A, double* g
) noexcept nogil
@cython.locals(moved=double, value=double, j=int)
cdef double _move_within(
    int n, double* q, double* scales, double* step, double* limits, double* trial
) noexcept nogil
@cython.locals(
    n=int, square=double, length=double, enough=double, nearly=double, slow=int,
    fresh=cython.bint, size=double, moved=double, new=double, j=int,
)
cdef double refine_one(
    Chain chain, double* aim, double* scales, double* limits,
    double damping, int steps, double* q, double* work,
) noexcept nogil
@cython.locals(n=Py_ssize_t, count=Py_ssize_t, k=Py_ssize_t)
cpdef refine(
    Chain chain, cnp.ndarray aim, cnp.ndarray scales,
    cnp.ndarray limits, double damping, int steps, cnp.ndarray q, cnp.ndarray errors,
)
