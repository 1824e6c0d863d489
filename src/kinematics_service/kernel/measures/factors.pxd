cimport cython
cimport numpy as cnp
from libc cimport math

from ..forward cimport chain_pass
from ..layout cimport arrays, places

ctypedef (double, double, double) Triple

cdef class Tape:
    cdef tuple _arrays
    cdef readonly object dependences
    cdef readonly int steps, factors, joints
    cdef long long* operations
    cdef double* constants
    cdef long long* ends

@cython.locals(
    width=int, i=int, j=int, operation=int, first=int, second=int, number=double,
    step='double*', before='double*', other='double*', value=double, da=double, db=double,
)
cdef void run_tape(Tape tape, int n, double* q, double* steps) noexcept nogil
@cython.locals(s=double, c=double)
cdef Triple operate(int operation, double number, double a, double b) noexcept nogil
cdef double distance_to_zero(double value, double slope) noexcept nogil
@cython.locals(
    count=Py_ssize_t, n=Py_ssize_t, factors=Py_ssize_t, k=Py_ssize_t, f=Py_ssize_t,
    j=Py_ssize_t, positions='double*', result='double*', steps='double*', one='double*',
    step='double*',
)
cpdef evaluate_factors(Tape tape, cnp.ndarray q, cnp.ndarray results)
