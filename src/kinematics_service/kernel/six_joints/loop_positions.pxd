cimport cython

from ..forward cimport vectors
from ..layout cimport arrays
from . cimport complex_motion, complex_numbers, lines, pairs
from .pairs cimport Pair
from .complex_motion cimport Motion
from .elimination cimport Elimination
from .six_screws cimport SixScrews
from .pencils cimport Pencil

cdef double ONE, MAYBE_ONE
cdef int MOST

@cython.locals(
    re=double, im=double, square=double, a=Pair, b=Pair, i=int, k=int
)
cdef Pair _ratio(double* terms, int count, int width) noexcept nogil
cdef Pair _rotated(Pair a, Pair b, double sign) noexcept nogil
@cython.locals(
    terms='double[24]', value=Pair, cosine=Pair, sine=Pair, b=int, i=int, k=int
)
cdef Pair _multiplied_joint(double* x, bint slides) noexcept nogil
@cython.locals(terms='double[24]', one=Pair, c=Pair, s=Pair, k=int)
cdef Pair _last_joint(double* x, bint slides) noexcept nogil
cdef void _write_parts_of(Pair t, bint slides, double* three) noexcept nogil
cdef vectors.Triple _across(vectors.Triple axis, vectors.Triple v) noexcept nogil

@cython.final
cdef class Positions:
    cdef double* room
    cdef double* t
    cdef double* x
    cdef double* line
    cdef double* three
    cdef double* fourth
    cdef double* fifth
    cdef double* parts
    cdef double* parts_i
    cdef double* C
    cdef double* six
    cdef double* seconds
    cdef double* vector
    cdef double* turn
    cdef double* moved
    cdef double* wanted
    cdef double* missed
    cdef Motion motion
    cdef int count

    @cython.locals(
        third=Pair, a=Pair, b=Pair, fourth=Pair, fifth=Pair, second=Pair,
        first=Pair, sixth=Pair, side=vectors.Triple, t='double*', slides=cython.bint, many=int,
        last=int, i=int,
    )
    cdef void find(
        self, SixScrews loop, Elimination elimination, Pencil pencil, bint swapped, Pair z
    ) noexcept nogil
    @cython.locals(
        left=Pair, share=Pair, parts='double*', re=double, im=double, a=int, b=int, h=int,
        i=int,
    )
    cdef void _write_line(
        self, SixScrews loop, Elimination elimination, Pair third, Pair fourth, Pair fifth
    ) noexcept nogil
    @cython.locals(screws='double*', to=int, i=int, k=int)
    cdef int _second_joints(self, SixScrews loop, Elimination elimination) noexcept nogil
    @cython.locals(i=int)
    cdef void _write_column(self, double* screws, double* V, int to, int part) noexcept nogil
    @cython.locals(re=double, im=double, u=Pair, v=Pair, i=int)
    cdef Pair _inner(self, int a, int b) noexcept nogil
    @cython.locals(
        longer=int, shorter=int, square=double, rest=double, shared=Pair, wanted=Pair,
        u=Pair, v=Pair, w=Pair, across=Pair, x=Pair, y=Pair, cosine=Pair,
        sine=Pair, count=int, i=int,
    )
    cdef int _solve_pair(self, bint slides) noexcept nogil
    @cython.locals(A=Pair, B=Pair, under=Pair, r=Pair, q=Pair, sign=double)
    cdef int _solve_one(self, Pair a, Pair b, Pair y, int count) noexcept nogil
    @cython.locals(
        screws='double*', best=double, axis=vectors.Triple, point=vectors.Triple,
        p=vectors.Triple, q=vectors.Triple, q_i=vectors.Triple, back=vectors.Triple,
        goal=vectors.Triple, u=vectors.Triple, v=vectors.Triple, turned=vectors.Triple,
        cosine=Pair, sine=Pair, re=double, im=double, c=double, c_im=double, x=double,
        y=double, size=double, at=int, i=int, k=int,
    )
    cdef Pair _first_joint(
        self, SixScrews loop, Elimination elimination, Pair second
    ) noexcept nogil
