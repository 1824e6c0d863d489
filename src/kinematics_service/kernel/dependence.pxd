cimport cython
cimport numpy as cnp

from . cimport aims, arrays, chain_pass, places, singular_values
from .chain cimport Chain

@cython.locals(
    n=Py_ssize_t, count=Py_ssize_t, width=Py_ssize_t, i=Py_ssize_t, j=Py_ssize_t, k=Py_ssize_t
)
cpdef free_motions(
    Chain chain, cnp.ndarray aim, cnp.ndarray scales,
    cnp.ndarray q, cnp.ndarray sigma, cnp.ndarray motions,
)
@cython.locals(n=int)
cdef double share_of_last_pivot(
    Chain chain, double* aim, double* scales, double* q, double* work
) noexcept nogil
@cython.locals(n=Py_ssize_t, count=Py_ssize_t, k=Py_ssize_t)
cpdef pivots(
    Chain chain, cnp.ndarray aim, cnp.ndarray scales,
    cnp.ndarray q, cnp.ndarray shares,
)
