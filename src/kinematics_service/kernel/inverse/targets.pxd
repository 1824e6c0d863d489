cimport cython
cimport numpy as cnp
from libc cimport math

from ..forward cimport vectors
from ..layout cimport arrays, places

cdef double NEARLY_ROTATION, ROTATION

@cython.locals(most=double, a=vectors.Triple, b=vectors.Triple, i=int, j=int)
cdef double off(double* T) noexcept nogil
cpdef double off_rotation(cnp.ndarray T) except? -9.0
@cython.locals(size=Py_ssize_t, from_rotation=double, i=Py_ssize_t, k=Py_ssize_t)
cpdef int take_target(cnp.ndarray target, cnp.ndarray pose) except -9
