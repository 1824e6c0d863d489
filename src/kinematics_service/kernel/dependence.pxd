cimport cython
cimport numpy as cnp

from . cimport aims, arrays, chain_pass, places, singular_values

@cython.locals(
    n=Py_ssize_t, count=Py_ssize_t, width=Py_ssize_t, i=Py_ssize_t, j=Py_ssize_t, k=Py_ssize_t
)
cpdef free_motions(
    cnp.ndarray integers, cnp.ndarray numbers, cnp.ndarray aim, cnp.ndarray scales,
    cnp.ndarray q, cnp.ndarray sigma, cnp.ndarray motions,
)
@cython.locals(n=int)
cdef double share_of_last_pivot(
    long long* integers, double* numbers, double* aim, double* scales, double* q, double* work
) noexcept nogil
@cython.locals(n=Py_ssize_t, count=Py_ssize_t, k=Py_ssize_t)
cpdef pivots(
    cnp.ndarray integers, cnp.ndarray numbers, cnp.ndarray aim, cnp.ndarray scales,
    cnp.ndarray q, cnp.ndarray shares,
)
