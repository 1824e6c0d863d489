cimport cython
cimport numpy as cnp

from ..layout cimport arrays, places
from ..measures cimport singular_values
from .residuals cimport Residual

@cython.locals(n=int, width=int, i=int, j=int)
cdef void _write_free_motions(
    Residual residual, double* scales, double* q, double* W, double* sigma,
    double* motions,
) noexcept nogil
@cython.locals(n=Py_ssize_t, count=Py_ssize_t, k=Py_ssize_t)
cpdef free_motions(
    Residual residual, cnp.ndarray scales, cnp.ndarray q, cnp.ndarray sigma,
    cnp.ndarray motions,
)
cdef double share_of_last_pivot(
    Residual residual, double* scales, double* q
) noexcept nogil
@cython.locals(n=Py_ssize_t, count=Py_ssize_t, k=Py_ssize_t)
cpdef pivots(
    Residual residual, cnp.ndarray scales, cnp.ndarray q, cnp.ndarray shares
)
