cimport cython
cimport numpy as cnp
from libc cimport math

from .forward cimport chain_lanes, chain_pass
from .layout cimport arrays, places
from .loops cimport closed_pass
from .measures.arm cimport Arm
from .forward.chain cimport Chain

@cython.locals(
    positions='double*', rates='double*', results='double*', work='double*', count=Py_ssize_t,
    n=Py_ssize_t, each=Py_ssize_t, stopped=Py_ssize_t,
)
cpdef Py_ssize_t evaluate(
    Chain chain, cnp.ndarray q, cnp.ndarray qdot, int depth, cnp.ndarray rows
) except -9
cdef Py_ssize_t _width(Chain chain, int depth) noexcept nogil
@cython.locals(
    nothing=double, k=Py_ssize_t, n=Py_ssize_t, j=Py_ssize_t, q_k='double*', qdot_k='double*',
    row='double*', side_by_side=cython.bint,
)
cdef Py_ssize_t _evaluate_rows(
    Chain chain, Py_ssize_t count, double* q, double* qdot, Py_ssize_t each, int depth,
    double* rows, Py_ssize_t width, double* work,
) noexcept nogil
@cython.locals(
    positions='double*', rates='double*', result='double*', n=int, tail=int,
    at=int, bad=int, j=int, i=int,
)
cpdef int evaluate_one(Arm arm, cnp.ndarray q, cnp.ndarray qdot, cnp.ndarray row) except -9
@cython.locals(nothing=double, total=double, n=int, depth=int, j=int)
cdef int evaluate_tail(Chain chain, double* row, int at, bint closed) noexcept nogil
@cython.locals(motions='double*', results='double*', count=Py_ssize_t, k=Py_ssize_t)
cpdef quaternions(cnp.ndarray poses, cnp.ndarray quaternions_xyzw)
