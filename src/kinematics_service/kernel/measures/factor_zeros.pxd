cimport cython
from libc cimport math

from ..layout cimport arrays, places
from . cimport factors
from .factors cimport Tape
from .task_rows cimport TaskRows

cdef int STEPS, FULL_STEPS, LAST_STEPS
cdef double ARRIVED, LONGEST, SLID

@cython.locals(
    n=int, turn=int, j=int, q='double*', values='double*', step='double*', squares=double,
    along=double, slope=double, norm=double, share=double, moved=double, onto=double,
    slide=double, move=double, slides=cython.bint, whole=double, slid=double, shorter=double,
)
cdef bint go(
    Tape tape, int f, TaskRows task, double* origin, double* d, double farthest, double* normal,
    double* work
) noexcept nogil
