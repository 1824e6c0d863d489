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

@cython.final
cdef class Bends:
    cdef Chain chain
    cdef TaskRows task
    cdef Norms norms
    cdef int count, turns, length, pairs
    cdef bint wide
    cdef double* room
    cdef long long* place
    cdef double* K
    cdef double* F

    @cython.locals(
        entries=int, joint='long long*', v='double*', w='double*', k=int, f=int, g=int, a=int, b=int,
        i=int, first=int, last=int, share=double, wf=Triple, wg=Triple, moved=Triple,
        turned=Triple,
    )
    cdef void write(self, double* row) noexcept nogil
    @cython.locals(low=int, high=int)
    cdef int _pair(self, int a, int b) noexcept nogil
    @cython.locals(K='double*', r=int, value=double)
    cdef void _add(
        self, int pair, int i, double share, Triple moved, Triple turned
    ) noexcept nogil
    @cython.locals(a=int, b=int)
    cdef double of_block(self, SingularEquations equations, int count) noexcept nogil
    @cython.locals(a=int)
    cdef double of_turns(self, SingularEquations equations, int count) noexcept nogil
    @cython.locals(a=int)
    cdef double of_lines(self, SingularEquations equations, int count) noexcept nogil
    @cython.locals(
        few='double*', many='double*', share=double, pair=int, K='double*', value=double, r=int,
        along=double, i=int,
    )
    cdef void _write_form(
        self, SingularEquations equations, int turn, int line, int at, bint both
    ) noexcept nogil
    @cython.locals(
        d=int, pairs=int, W='double*', root=double, a=int, b=int, pair=int, k=int, least=double,
        turned=int, p=int, F='double*', at=int,
    )
    cdef double _norm(self, int outer, int inner) noexcept nogil
