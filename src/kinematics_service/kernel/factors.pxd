cimport cython
cimport numpy as cnp
from libc cimport math

from . cimport arrays, chain_pass, places

ctypedef (double, double, double) Triple

@cython.locals(
    width=int, i=int, j=int, operation=int, first=int, second=int, number=double,
    step='double*', before='double*', other='double*', value=double, da=double, db=double,
)
cdef void run_tape(
    long long* integers, double* numbers, int count, int n, double* q, double* steps
) noexcept nogil
@cython.locals(s=double, c=double)
cdef Triple _operate(int operation, double number, double a, double b) noexcept nogil
cdef double distance_to_zero(double value, double slope) noexcept nogil
@cython.locals(
    count=Py_ssize_t, n=Py_ssize_t, tape_steps=Py_ssize_t, factors=Py_ssize_t, k=Py_ssize_t,
    f=Py_ssize_t, j=Py_ssize_t, tape='long long*', constants='double*', last='long long*',
    positions='double*', result='double*', steps='double*', one='double*', step='double*',
)
cpdef evaluate_factors(
    cnp.ndarray integers, cnp.ndarray numbers, cnp.ndarray ends, cnp.ndarray q,
    cnp.ndarray results,
)
