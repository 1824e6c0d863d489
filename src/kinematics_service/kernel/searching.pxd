cimport cython
cimport numpy as cnp

from . cimport arrays, dependence, places, refinement, solutions
from .chain cimport Chain

@cython.locals(
    n=Py_ssize_t, count=Py_ssize_t, k=Py_ssize_t, j=Py_ssize_t, taken=int, value=double,
    left=double,
)
cpdef int first_solution(
    Chain chain, cnp.ndarray aim, cnp.ndarray held,
    cnp.ndarray scales, cnp.ndarray periods, cnp.ndarray bounds, cnp.ndarray limits,
    cnp.ndarray near, double proved, cnp.ndarray starts, cnp.ndarray q, cnp.ndarray facts,
) except -9
