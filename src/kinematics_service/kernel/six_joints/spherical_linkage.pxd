cimport cython
from libc cimport math

from ..forward cimport vectors
from ..layout cimport arrays, places
from . cimport complex_motion, complex_numbers, pairs, trigonometric_samples
from .complex_motion cimport Motion
from .pairs cimport Pair
from .six_screws cimport SixScrews

cdef int SAMPLES
cdef double TINY, ROUND_OFF, ROOT_THIRD, ACROSS

cdef void _put(double* V, Py_ssize_t at, vectors.Triple v) noexcept nogil
cdef double _mean(int p, int turn) noexcept nogil
@cython.locals(value=Pair, other=Pair, i=int, j=int, k=int)
cdef void _cross(double* a, double* b, double* to) noexcept nogil
@cython.locals(value=Pair)
cdef Pair _dot(double* a, double* b) noexcept nogil

@cython.locals(v=vectors.Triple)
cdef vectors.Triple _at(double* table, double c, double s) noexcept nogil

@cython.final
cdef class SphericalLinkage:
    cdef double* room
    cdef long long* order
    cdef double* way
    cdef double* E
    cdef double* F
    cdef double* circle
    cdef double* values
    cdef double* coefficients
    cdef double* vector
    cdef double* turn
    cdef double* columns
    cdef int turning
    cdef int second
    cdef int before
    cdef int hidden
    cdef int other
    cdef int degree
    cdef bint across
    cdef double bent
    cdef double reach
    cdef double noise

    cdef void build(self, SixScrews loop, bint swapped) noexcept nogil
    @cython.locals(place=int, k=int)
    cdef void _sort(self, SixScrews loop) noexcept nogil
    @cython.locals(
        screws='double*', order='long long*', first=vectors.Triple, last=vectors.Triple,
        axis=vectors.Triple, foot=vectors.Triple, end=vectors.Triple, normal=vectors.Triple,
        between=vectors.Triple, a=vectors.Triple, b=vectors.Triple, carried=vectors.Triple,
        twice=vectors.Triple, tool=vectors.Triple, left=vectors.Triple, slide=vectors.Triple,
        other=vectors.Triple, square=double, share=double,
    )
    cdef bint _write_way(self, SixScrews loop) noexcept nogil
    @cython.locals(share=double, at=int, i=int, j=int, k=int, p=int, q=int)
    cdef void _write_tables(self, SixScrews loop, bint swapped) noexcept nogil
    @cython.locals(
        screws='double*', order='long long*', y=vectors.Triple, z=vectors.Triple,
        goal=vectors.Triple, still=double, a=vectors.Triple, b=vectors.Triple,
        way=vectors.Triple, carried=vectors.Triple, slide=vectors.Triple, x=vectors.Triple,
        last=double,
    )
    cdef void _evaluate(self, SixScrews loop, double alpha, double beta) noexcept nogil
    @cython.locals(
        E='double*', F='double*', largest=double, steepest=double, c=double, s=double,
        v=vectors.Triple, moved=double, n=int,
    )
    cdef void _sample(self, int degree) noexcept nogil
    @cython.locals(
        joint=int, v=vectors.Triple, angle=Pair, k=int
    )
    cdef bint write_positions(
        self, SixScrews loop, Motion motion, Pair z, double* t
    ) noexcept nogil
    @cython.locals(
        turn='double*', C='double*', V='double*', first=Pair, unit=Pair, angle=Pair, e=int, k=int
    )
    cdef bint _write_other(self, double* t) noexcept nogil
    @cython.locals(
        left='double*', M='double*', C='double*', normal='double*', p=Pair, axis=Pair,
        under=Pair, way=Pair, i=int, k=int,
    )
    cdef bint _write_ways(self, SixScrews loop, Motion motion, double* t) noexcept nogil
