cimport cython
cimport numpy as cnp

from ..layout cimport arrays
from . cimport dependence, solutions
from .refinement cimport Refinement
from .joints cimport Joints
from .solutions cimport Solutions

@cython.locals(n=int, inside='double*', value=double, left=double, j=int, k=Py_ssize_t)
cdef int _first_of(
    Refinement refinement, Joints joints, double* near, double proved,
    Py_ssize_t count, double* starts, double* q, Solutions solution,
) noexcept nogil
@cython.locals(count=Py_ssize_t, q='double*', middle='double*', tries='double*')
cpdef first_solution(
    Refinement refinement, Joints joints, cnp.ndarray near, double proved,
    cnp.ndarray starts, Solutions solution,
)
