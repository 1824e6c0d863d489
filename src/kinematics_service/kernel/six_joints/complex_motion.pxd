cimport cython
from libc cimport math

from ..forward cimport vectors
from ..layout cimport arrays
from . cimport complex_numbers, pairs
from .pairs cimport Pair
from .six_screws cimport SixScrews

cdef int MOST_STEPS, WIDTH
cdef double LONGEST, STANDS, MISSES, ROUND_OFF, CERTAIN

cdef void _add(double* row, int j, int part, double re, double im) noexcept nogil
@cython.locals(
    along=double, u=vectors.Triple, w=vectors.Triple, c=double, c_im=double, s=double,
    s_im=double,
)
cdef void add_turned(
    double* row, vectors.Triple v, int part, vectors.Triple axis, double* turn
) noexcept nogil

@cython.locals(
    axis=vectors.Triple, side=vectors.Triple, goal=vectors.Triple, other=vectors.Triple, re=vectors.Triple,
    im=vectors.Triple, g=double, i=int, j=int,
)
cdef Pair angle_left(
    SixScrews loop, double* t, int k, vectors.Triple v, double* vector, double* turn
) noexcept nogil
@cython.locals(re=vectors.Triple, im=vectors.Triple, i=int)
cdef void _turn_back(double* v, vectors.Triple axis, double* turn) noexcept nogil

@cython.final
cdef class Motion:
    cdef double* room
    cdef double* R
    cdef double* p
    cdef double* axes
    cdef double* points
    cdef double* J
    cdef double* turn
    cdef double first
    cdef double radius

    @cython.locals(step=double, share=double, j=int, k=int, e=int)
    cdef bint improve(self, SixScrews loop, double* t) noexcept nogil
    @cython.locals(
        turning=double, reaching=double, sizes=double, axis=double, reach=double, arm=Pair,
        size=double, bound=double, step=double, inverse=double, row='double*', beta=double,
        way=double, unit=double, i=int, j=int, k=int,
    )
    cdef bint certify(self, SixScrews loop, double* t) noexcept nogil
    @cython.locals(unit=double, at=int, i=int, k=int)
    cdef double _measure_by_ways(self, SixScrews loop, double* t) noexcept nogil
    @cython.locals(
        R='double*', p='double*', row='double*', axis=vectors.Triple, point=vectors.Triple,
        re=vectors.Triple, im=vectors.Triple, z=Pair, o=Pair, d=Pair, way=Pair, i=int,
        j=int, k=int,
    )
    cdef void _multiply(self, SixScrews loop, double* t) noexcept nogil
    @cython.locals(row='double*')
    cdef Pair _row_times(self, int i, vectors.Triple v) noexcept nogil
    @cython.locals(missed=double, re=double, i=int, j=int)
    cdef double miss(self, SixScrews loop, double* t) noexcept nogil
    @cython.locals(
        goal='double*', slides=cython.bint, z=Pair, linear=Pair, left=Pair, re=double,
        im=double, a=int, b=int, i=int, k=int, m=int,
    )
    cdef void _fill(self, SixScrews loop) noexcept nogil
    @cython.locals(way=Pair)
    cdef Pair _moment(self, int k, int a, int b) noexcept nogil
    @cython.locals(
        J='double*', best=double, square=double, x=double, inverse=Pair, share=Pair, p=int,
        at=int, i=int, j=int, k=int,
    )
    cdef bint _solve(self, int width) noexcept nogil
    @cython.locals(to='double*', row='double*', x=double, y=double, j=int)
    cdef void _subtract(
        self, int i, int k, int start, int width, double re, double im
    ) noexcept nogil
    @cython.locals(largest=double, square=double, j=int)
    cdef double _largest_step(self) noexcept nogil
