cimport cython
cimport numpy as cnp
from libc cimport math

from ..forward cimport vectors
from ..layout cimport arrays, places
from . cimport roots, three_joints

@cython.locals(k=int)
cdef vectors.Triple _back(
    double* screws, double* values, int count, vectors.Triple v
) noexcept nogil
@cython.locals(count=int)
cdef int _circle_roots_or(
    double A, double B, double C, double error, double free, double* found
) noexcept nogil
@cython.locals(fifths='double[3]', fourth=double, ab=double, bc=double, count=int, i=int)
cdef int _wrist(
    double* screws, double* T, double* arm, double turn, double* free, double* found
) noexcept nogil
@cython.locals(
    arms='double[25]', wrists='double[7]', arm='double[3]', count=int, known=int, doubled=int,
    i=int, j=int, k=int
)
cdef int _with_wrist(
    double* screws, double* T, vectors.Triple point, double turn, double way, double* free,
    double* found, double* said
) noexcept nogil
cdef int _first_joint(
    double* screws, double* T, vectors.Triple point, double way, double free, double* found
) noexcept nogil
cdef int _fifth_joint(
    double* screws, vectors.Triple seen, double turn, double free, double* found
) noexcept nogil
@cython.locals(
    thirds='double[3]', total=double, height=double, reach=double, size=double, second=double,
    count=int, k=int,
)
cdef int _plane_arm(
    double* screws, double* T, double first, double fifth, double sixth, double way,
    double* free, double* found, double* said
) noexcept nogil
@cython.locals(
    firsts='double[3]', fifths='double[3]', seen=vectors.Triple, to_goal=vectors.Triple,
    to_wrist=vectors.Triple, lever=double, sixth=double, off=double, count=int, known=int,
    doubled=int, i=int, j=int,
)
cdef int _with_parallel_axes(
    double* screws, double* T, vectors.Triple point, double turn, double way, double* free,
    double* found, double* said
) noexcept nogil
@cython.locals(i=int, j=int)
cdef void _times(int rows, int columns, double* A, double* x, double* y) noexcept nogil

@cython.final
cdef class ClosedForm:
    cdef tuple _arrays
    cdef int way
    cdef bint backwards
    cdef double error
    cdef double size
    cdef Py_ssize_t n
    cdef Py_ssize_t k
    cdef double* screws
    cdef double* point
    cdef double* home_inverse
    cdef double* to_joints
    cdef double* to_screws

    cdef void write_screws(self, double* q, double* psi) noexcept nogil
    cdef void write_joints(self, double* psi, double* q) noexcept nogil
    @cython.locals(M='double[12]', i=int, j=int, k=int)
    cdef void write_motion(self, double* pose, double* T) noexcept nogil
    @cython.locals(
        arm='double[25]', start=vectors.Triple, to=vectors.Triple, goal=vectors.Triple,
        turn=double, way=double, count=int, k=int,
    )
    cdef int candidates(
        self, double* T, double off, double* free, double* found, double* said
    ) noexcept nogil

cpdef int inverse_candidates(
    ClosedForm form, cnp.ndarray T, cnp.ndarray free, cnp.ndarray found, cnp.ndarray said
) except -9
