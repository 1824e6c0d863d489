cimport cython
cimport numpy as cnp
from libc cimport math

from ..forward cimport vectors
from ..layout cimport arrays, places
from . cimport complex_numbers, elimination, pairs, pencils, trigonometric_roots
from .complex_motion cimport Motion
from .pairs cimport Pair
from .elimination cimport Elimination
from .loop_positions cimport Positions
from .six_screws cimport SixScrews
from .spherical_linkage cimport SphericalLinkage
from .pencils cimport Pencil

cdef double NOISE, NEAR_CIRCLE, FAR, SHARP, SAME_ROOT, MARGIN, CAUTION
cdef int THIRD, MOST

@cython.final
cdef class SixJoints:
    cdef tuple _arrays
    cdef double* screws
    cdef double* home_inverse
    cdef double* to_joints
    cdef long long* options
    cdef Py_ssize_t count
    cdef readonly int bound
    cdef int slides

    @cython.locals(i=int, j=int)
    cdef void write_joints(self, double* psi, double* q) noexcept nogil
    @cython.locals(i=int, j=int, k=int)
    cdef void write_motion(self, double* pose, double* T) noexcept nogil

@cython.final
cdef class Roots:
    cdef double* room
    cdef double* psi
    cdef double* radii
    cdef double* lengths
    cdef long long* is_real
    cdef double* z
    cdef double* bounds
    cdef double* t
    cdef double* one
    cdef SixScrews loop
    cdef Elimination elimination
    cdef Pencil pencil
    cdef SphericalLinkage linkage
    cdef int hidden
    cdef Positions positions
    cdef Motion motion
    cdef int count
    cdef bint proved
    cdef double noise
    cdef double first_step

    @cython.locals(k=Py_ssize_t)
    cdef void find(self, SixJoints arm, double* T) noexcept nogil
    @cython.locals(slides=cython.bint, share=double, i=int, j=int, e=int)
    cdef void follow(self, SixJoints arm, double* T, double* starts, int count) noexcept nogil
    @cython.locals(
        options='long long*', swapped=cython.bint, slides=cython.bint, c='double*', degree=int,
        roots=int, errors=double,
    )
    cdef void _find_by(self, SixJoints arm, double* T, Py_ssize_t k) noexcept nogil
    @cython.locals(accounted=cython.bint, taken=cython.bint, z=Pair, away=double, i=int)
    cdef void _take_roots(self, SixJoints arm, int roots, bint swapped) noexcept nogil
    @cython.locals(moved=double)
    cdef bint _is_of_none(self, Pair z, double bound) noexcept nogil
    @cython.locals(size=double, on_circle=Pair, taken=cython.bint)
    cdef bint _take_root(
        self, SixJoints arm, Pair z, double away, double bound, bint swapped
    ) noexcept nogil
    @cython.locals(
        written=cython.bint, taken=cython.bint, only=cython.bint, best=int, least=double, j=int,
        k=int,
    )
    cdef bint _take_positions(
        self, SixJoints arm, Pair start, Pair z, double bound, bint swapped
    ) noexcept nogil
    @cython.locals(first=double)
    cdef bint _take_candidate(self, Pair z, double bound) noexcept nogil
    @cython.locals(here=Pair, re=double, im=double)
    cdef bint _is_of(self, Pair z, double bound) noexcept nogil
    @cython.locals(
        length=double, radius=double, imaginary=double, share=double, real=cython.bint, j=int,
        k=Py_ssize_t,
    )
    cdef void _take(self) noexcept nogil
    @cython.locals(i=int, j=int)
    cdef void _add(self, bint real, double radius, double length) noexcept nogil
    @cython.locals(square=double, re=double, im=double, share=double, j=int, k=int)
    cdef double _are_one(self, int i, double length) noexcept nogil

@cython.locals(square=double)
cdef double _log_size(Pair z) noexcept nogil
cdef double _size(double* c, int k) noexcept nogil
@cython.locals(roots=Roots, found='double*', about='double*', k=int)
cpdef int complex_solutions(
    SixJoints arm, cnp.ndarray T, cnp.ndarray psi, cnp.ndarray said
) except -9
@cython.locals(roots=Roots, found='double*', k=int)
cpdef int followed_solutions(
    SixJoints arm, cnp.ndarray T, int count, cnp.ndarray psi
) except -9
