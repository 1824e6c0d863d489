cimport cython
from libc cimport math

from ..forward cimport vectors
from ..layout cimport places
from . cimport roots

cdef double OFF_CIRCLE, NOTHING

ctypedef (double, double) Pair

@cython.locals(a=vectors.Triple, b=vectors.Triple, length=double, square=double)
cdef void _write_conditions(double* screws, vectors.Triple p, double* F, double* G) noexcept nogil
cdef void _write_condition(
    double* f, double square, vectors.Triple direction, double constant
) noexcept nogil
@cython.locals(guide=vectors.Triple, square=double)
cdef void _write_guide(double* f, vectors.Triple z2, vectors.Triple o2, double least) noexcept nogil
cdef double _left_over(double* f, vectors.Triple u) noexcept nogil
cdef double _wanted(double* f, vectors.Triple b, double across) noexcept nogil
@cython.locals(
    along=double, rest=double, size=double, height=double, across=double, first=double,
    second=double, size_0=double, size_1=double, value=double, product=double,
)
cdef Pair _eliminated(double* F, double* G, vectors.Triple z2, vectors.Triple o2, bint slides, vectors.Triple w) noexcept nogil
@cython.locals(turn=double, k=int, j=int)
cdef void _write_coefficients(bint slides, double* g, double* c) noexcept nogil
@cython.locals(
    slides_2=cython.bint, slides_3=cython.bint, g='double[5]', c='double[10]', z='double[8]',
    size=double, x=double, y=double, value=double, terms=double, largest=double, away=double,
    degree=int, count=int, j=int, k=int,
)
cdef int _third_joint(
    double* screws, vectors.Triple point, double* F, double* G, double scale, double* found
) noexcept nogil
@cython.locals(along=double, middle=double, half=double)
cdef int _second_joint_slides(
    vectors.Triple z2, double* F, double* G, vectors.Triple w, double free, double* found
) noexcept nogil
@cython.locals(
    height=double, across=double, first=double, second=double, count=int, v=vectors.Triple
)
cdef int _second_joint(
    double* screws, double* F, double* G, vectors.Triple w, double free, double* found
) noexcept nogil
@cython.locals(
    here='double[21]', F='double[9]', G='double[9]', thirds='double[4]', seconds='double[2]', scale=double,
    count=int, count_2=int, count_3=int, i=int, j=int, k=int,
)
cdef int first_three(
    double* screws, vectors.Triple point, vectors.Triple p, double* free, double* found
) noexcept nogil
