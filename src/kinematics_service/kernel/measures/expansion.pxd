cimport cython
from libc cimport math

from ..forward cimport vectors
from ..forward.chain cimport Chain
from ..forward.vectors cimport Triple
from ..layout cimport arrays
from . cimport singularity
from .norms cimport Norms
from .singular_equations cimport SingularEquations
from .task_rows cimport TaskRows

cdef int ORDERS

@cython.final
cdef class Expansion:
    cdef Chain chain
    cdef TaskRows task
    cdef Norms norms
    cdef int count, orders, turns, length, rank, terms
    cdef bint wide
    cdef double* room
    cdef long long* begins
    cdef long long* sizes
    cdef long long* place
    cdef long long* pair
    cdef long long* triple
    cdef long long* chosen
    cdef double* share
    cdef double* K
    cdef double* G
    cdef double* half

    @cython.locals(d=int, k=int, a=int, b=int)
    cdef void _number_pairs(self) noexcept nogil
    @cython.locals(d=int, k=int, a=int, b=int, c=int, orders=double)
    cdef void _number_triples(self) noexcept nogil
    @cython.locals(
        d=int, entries=int, joint='long long*', k=int, f=int, g=int, h=int, a=int, b=int, c=int,
        share=double, at=int, one=double,
    )
    cdef void write(self, double* row) noexcept nogil
    cdef double _scale(self, int entry) noexcept nogil
    @cython.locals(
        entries=int, v='double*', w='double*', K='double*', i=int, last=int, moved=Triple,
        left=cython.bint, k=int, turned=Triple, j=int, scale=double, r=int, value=double,
    )
    cdef void _add(self, int term, int order, double share, double* row) noexcept nogil
    @cython.locals(
        turns=int, length=int, rank=int, terms=int, k=int, K='double*', a=int, few='double*',
        share=double, half='double*', i=int, r=int, weight=double, b=int, many='double*',
        value=double,
    )
    cdef void turn(self, SingularEquations equations) noexcept nogil
    @cython.locals(cells=int)
    cdef double change(self) noexcept nogil
    @cython.locals(
        count=int, W='double*', share='double*', a=int, b=int, cell='double*', k=int, least=double,
    )
    cdef double norm(
        self, double* terms, int outer, int step, int inner, int stride, int apart, int order
    ) noexcept nogil
