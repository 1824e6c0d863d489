cimport cython
from libc cimport math

from ..layout cimport arrays, places
from .chain cimport Chain

cdef extern from *:
    """
    #if defined(__PYX_HAVE__kinematics_service__kernel__forward__chain_pass) \
        && defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
    static void kinematics_sines_and_cosines(
        double*, double*, double*
    ) __attribute__((target_clones("avx2", "default")));
    #endif
    """

cdef double SIN_3, SIN_5, SIN_7, SIN_9, SIN_11, SIN_13
cdef double COS_4, COS_6, COS_8, COS_10, COS_12, COS_14
cdef double ROUNDER, TWO_BY_PI, HALF_PI_1, HALF_PI_2, HALF_PI_3

ctypedef (double, double) Pair

@cython.locals(
    turns=double, first=double, second=double, r=double, rest=double, y=double, tail=double,
    z=double, p=double, sine=double, half=double, w=double, cosine=double, quarter=int,
    sign=double, other=double,
)
cdef inline Pair _sincos_reduced(double x) noexcept nogil
cdef Pair sincos(double x) noexcept nogil
@cython.locals(s='double[16]', c='double[16]', lane=Py_ssize_t, pair=Pair)
cdef void sines_and_cosines "kinematics_sines_and_cosines"(
    double* angles, double* sines, double* cosines
) noexcept nogil
cdef void start(double* T, double* motion) noexcept nogil
@cython.locals(i=int, x=double, y=double, z=double)
cdef void times(double* T, double* motion) noexcept nogil
@cython.locals(i=int, x=double, y=double, z=double)
cdef void _times_twist(double* T, double* motion) noexcept nogil
@cython.locals(i=int, x=double, y=double)
cdef void times_screw(double* T, double theta, double d) noexcept nogil
cdef void _write_motion(double* T, double* row, int at) noexcept nogil
cdef void write_quaternion(double* T, double* row, int at) noexcept nogil
cdef void _write_point_and_axis(double* T, int entries, double* screw) noexcept nogil
cdef void _write_screw(
    double by_theta, double by_d, int entries, double* row, double* screw
) noexcept nogil
@cython.locals(frame=int)
cdef int _write_fixed_frames(Chain chain, double* row) noexcept nogil
@cython.locals(pose='double[12]', i=int)
cdef int _write_frames(
    Chain chain, int element, int frame, double* T, double* row
) noexcept nogil
@cython.locals(
    elements=int, entries=int, screws='double*', twisted=cython.bint, frame=int, k=int, e=int,
    theta=double, d=double, q_k=double, T='double[12]',
)
cdef double evaluate_row(Chain chain, double* q, double* qdot, int depth, double* row) noexcept nogil
@cython.locals(screws='double*', e=int, total=double)
cdef double _finish_row(
    Chain chain, double* T, double* qdot, int depth, double* row
) noexcept nogil
@cython.locals(n=int, k=int, e=int, i=int, j=int)
cdef void add_up_screws(Chain chain, double* screws, double* row) noexcept nogil
@cython.locals(entries=int, twist=int, along=double, total=double, screw=int, e=int, i=int)
cdef double _write_twist(Chain chain, double* screws, double* qdot, double* row) noexcept nogil
