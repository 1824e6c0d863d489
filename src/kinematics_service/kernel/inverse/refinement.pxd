cimport cython
cimport numpy as cnp
from libc cimport math

from ..layout cimport arrays, places
from ..measures cimport symmetric
from .residuals cimport Residual

cdef double ROUND_OFF, SLOW, STIFFEST
cdef int SLOW_STEPS

@cython.final
cdef class Refinement:
    cdef tuple _arrays
    cdef double* room
    cdef Residual residual
    cdef double* scales
    cdef double* limits
    cdef double damping
    cdef int steps
    cdef double* A
    cdef double* L
    cdef double* g
    cdef double* step
    cdef double* trial

    @cython.locals(
        square=double, length=double, enough=double, nearly=double, damping=double, slow=int,
        fresh=cython.bint, size=double, moved=double, new=double, j=int,
    )
    cdef double refine_one(self, double* q) noexcept nogil
    @cython.locals(
        n=int, A='double*', g='double*', limits='double*', columns='double*', error='double*',
        size=double, upper=cython.bint, i=int, j=int, k=int,
    )
    cdef double _linearise(self, double* q) noexcept nogil
    @cython.locals(moved=double, value=double, j=int)
    cdef double _try_step(self, double* q) noexcept nogil

@cython.locals(k=Py_ssize_t)
cdef void _refine_rows(
    Refinement refinement, Py_ssize_t rows, double* q, double* errors
) noexcept nogil
@cython.locals(count=Py_ssize_t)
cpdef refine(Refinement refinement, cnp.ndarray q, cnp.ndarray errors)
