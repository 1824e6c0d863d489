cimport cython
from libc cimport math

from ..forward cimport vectors
from ..layout cimport places
from . cimport roots

cdef double OFF_CIRCLE, ACROSS, ROUND_OFF

ctypedef (double, double) Pair

@cython.locals(
    z1=vectors.Triple, z2=vectors.Triple, a=vectors.Triple, b=vectors.Triple, length=double,
)
cdef double _write_conditions(
    double* screws, vectors.Triple p, double turn, double* F, double* G
) noexcept nogil
cdef void _write_condition(
    double* f, double square, vectors.Triple direction, double constant
) noexcept nogil
@cython.locals(guide=vectors.Triple, square=double)
cdef void _write_guide(double* f, vectors.Triple z2, vectors.Triple o2, double error) noexcept nogil
cdef double _left_over(double* f, vectors.Triple u) noexcept nogil
cdef double _wanted(double* f, vectors.Triple b, double across) noexcept nogil
cdef double _error_of(double* f, vectors.Triple b, double across, double way) noexcept nogil
@cython.locals(
    along=double, rest=double, off=double, left=double, height=double, across=double, first=double,
    second=double, off_1=double, off_2=double, value=double, sized=double, u=vectors.Triple,
    b=vectors.Triple, v=vectors.Triple,
)
cdef Pair _eliminated(
    double* F, double* G, vectors.Triple z2, vectors.Triple o2, bint slides, vectors.Triple w,
    double turn, double way,
) noexcept nogil
@cython.locals(turn=double, k=int, j=int)
cdef void _write_coefficients(bint slides, double* g, double* c) noexcept nogil
@cython.locals(
    slides_2=cython.bint, slides_3=cython.bint, g='double[5]', c='double[10]', z='double[8]',
    bounds='double[4]', error=double, largest=double, unit=double, off=double, x=double, y=double, away=double, beside=double,
    z2=vectors.Triple, o2=vectors.Triple, w=vectors.Triple, degree=int, count=int, j=int, k=int,
)
cdef int _third_joint(
    double* screws, vectors.Triple point, double* F, double* G, double scale, double turn,
    double way, double* found
) noexcept nogil
cdef double _size(double* c, int k) noexcept nogil
@cython.locals(
    f='double*', along=double, rest=double, middle=double, square=double, error=double, count=int,
)
cdef int _second_joint_slides(
    vectors.Triple z2, double* F, double* G, vectors.Triple w, double turn, double way,
    double free, double* found
) noexcept nogil
@cython.locals(
    f='double*', height=double, across=double, first=double, second=double, off=double, count=int,
    z2=vectors.Triple, o2=vectors.Triple, b=vectors.Triple, from_axis=vectors.Triple,
    v=vectors.Triple, guide=vectors.Triple,
)
cdef int _second_joint(
    double* screws, double* F, double* G, vectors.Triple w, double turn, double way,
    double free, double* found
) noexcept nogil
@cython.locals(
    here='double[21]', F='double[10]', G='double[10]', thirds='double[5]', seconds='double[3]',
    scale=double, worst=double, carried=double, off=double, o1=vectors.Triple, z1=vectors.Triple,
    z2=vectors.Triple, o2=vectors.Triple, w=vectors.Triple, u=vectors.Triple, count=int,
    count_2=int, count_3=int, i=int, j=int, k=int,
)
cdef int first_three(
    double* screws, vectors.Triple point, vectors.Triple p, double turn, double way, double* free,
    double* found
) noexcept nogil
@cython.locals(lever=vectors.Triple)
cdef double _carried(double* screws, int k, vectors.Triple point, double error) noexcept nogil
