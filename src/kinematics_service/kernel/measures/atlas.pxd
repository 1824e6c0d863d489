cimport cython
cimport numpy as cnp
from libc cimport math

from ..forward.chain cimport Chain
from ..layout cimport arrays, places
from . cimport factor_zeros
from .factors cimport Tape
from .singular_equations cimport SingularEquations
from .task_rows cimport TaskRows

cdef double LONGEST, SINGULAR, ARRIVED, BENDS, FLAT, ROUND_OFF
cdef int STEPS, BINS

@cython.final
cdef class Atlas:
    cdef tuple _arrays
    cdef readonly int joints, sets, codimension, width
    cdef double* charts
    cdef long long* begins
    cdef long long* sorting
    cdef double* counts
    cdef double* spans
    cdef long long* dimensions

    cdef int dimension(self, int f) noexcept nogil

    @cython.locals(n=int, first=int, j=int, found=int, k=int)
    cdef int nearest(
        self, int f, double* u, double radius, int most, double* motions, double* scores
    ) noexcept nogil
    @cython.locals(span='double*', half=double, away=double)
    cdef double _apart(self, int first, int k, double value) noexcept nogil
    @cython.locals(
        n=int, second=int, begin=int, end=int, count=int, period=double, place=int,
        away='double*', turn=int, at=int, chart='double*', step=double, score=double, i=int, j=int,
    )
    cdef int _look_into(
        self, int f, int k, double* u, double radius, int found, int most, double* motions,
        double* scores
    ) noexcept nogil
    @cython.locals(low=int, high=int, middle=int)
    cdef int _place(self, int begin, int end, int second, double value) noexcept nogil
    @cython.locals(
        n=int, whole=double, j=int, step=double, half=double, across=double, i=int, share=double,
    )
    cdef double _score(
        self, int f, double* u, double most, double* chart, double* away
    ) noexcept nogil
    @cython.locals(normal='double*', share=double, j=int)
    cdef double _across(self, double* chart, int i, double* away) noexcept nogil
    @cython.locals(n=int, j=int, i=int, share=double, normal='double*', along=double, rest=double)
    cdef void _slide(self, double* chart, double* away, double* motion) noexcept nogil

cdef double _wrapped(double value, double period) noexcept nogil
@cython.locals(ratio=double, counted=int, j=int, power=double, share=double, turn=double)
cdef void _write_seed(int n, int i, double* spans, double* u) noexcept nogil
@cython.locals(
    n=int, seeds=int, given='double*', charts='double*', width=int, work='double*', found=int,
    i=int,
)
cdef int _fill(SingularEquations equations, cnp.ndarray spans, cnp.ndarray table) except -1
@cython.locals(
    n=int, u='double*', step='double*', still='double*', j=int, close=cython.bint, length=double,
    share=double,
)
cdef int _go(
    SingularEquations equations, int i, double* spans, double* chart, double* work
) noexcept nogil
@cython.locals(
    n=int, seeds=int, given='double*', charts='double*', work='double*', origin='double*',
    d='double*', normal='double*', found=int, i=int, j=int, chart='double*',
)
cdef int _fill_of_factor(
    Tape tape, int f, TaskRows task, cnp.ndarray spans, cnp.ndarray table
) except -1
