cimport cython
cimport numpy as cnp
from libc cimport math

from ..layout cimport arrays

cdef int MAX_SWEEPS
cdef double NEGLIGIBLE

@cython.locals(
    off=double, half=double, root=double, t=double, c=double, s=double, x=double, y=double, k=int
)
cdef void _rotate(double* H, double* Z, int size, int i, int j) noexcept nogil
@cython.locals(largest=double, worst=double, i=int, j=int)
cdef void diagonalise(double* H, double* Z, int size) noexcept nogil
@cython.locals(value=double, i=int, j=int, k=int)
cdef bint damped_step(
    int n, double* A, double* g, double damping, double* L, double* step
) noexcept nogil
@cython.locals(size=int)
cpdef eigenvectors(cnp.ndarray H, cnp.ndarray Z)
