cimport cython
cimport numpy as cnp
from libc cimport math

from . cimport arrays, places, vectors

cdef int _sign(double value, double size) noexcept nogil
@cython.locals(
    turn_2=cython.bint, has_shoulder=cython.bint, has_elbow=cython.bint, square=double
)
cdef void write_posture(
    int way, double* screws, vectors.Triple point, double* psi, long long* signs
) noexcept nogil
@cython.locals(count=Py_ssize_t, k=Py_ssize_t, i=Py_ssize_t)
cpdef postures(
    int way, cnp.ndarray screws, cnp.ndarray point, cnp.ndarray psi, cnp.ndarray signs
)
