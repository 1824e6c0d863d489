cimport cython
from libc cimport math

from ..layout cimport places
from . cimport pairs
from .pairs cimport Pair

cdef int SWEEPS, MOST_ROOTS
cdef double ROUND_OFF, STANDS

@cython.locals(
    arrived='int[24]', radius=double, s=double, cosine=double, count=int, left=int, k=int
)
cdef int roots_on_plane(double* c, int degree, double* z) noexcept nogil
@cython.locals(turn=double)
cdef Pair _start(int k, int count) noexcept nogil
cdef Pair _coefficient(double* c, int degree, int k) noexcept nogil
@cython.locals(
    here=Pair, x=Pair, a=Pair, p=Pair, derivative=Pair, bent=Pair, step=Pair,
    outside=cython.bint, small=cython.bint, size=double, shrink=double, value=double,
    value_i=double, slope=double, slope_i=double, product=double, terms=double, count=int, i=int,
)
cdef bint _improve(double* c, int degree, double* z, int k) noexcept nogil
@cython.locals(
    here=Pair, below=Pair, re=double, im=double, dx=double, dy=double, square=double, i=int
)
cdef Pair _step(Pair p, Pair derivative, double* z, int k, int count) noexcept nogil
@cython.locals(
    here=Pair, x=Pair, a=Pair, value=Pair, size=double, shrink=double, terms=double, away=double,
    leading=double, way=double, missed=double, outside=cython.bint, count=int, i=int, k=int,
)
cdef void write_bounds(
    double* c, int degree, double noise, double* z, double* bounds
) noexcept nogil
@cython.locals(here=Pair, other=Pair, size=double, there=double, radii=double, i=int)
cdef bint is_alone(double* z, double* bounds, int count, int k) noexcept nogil
