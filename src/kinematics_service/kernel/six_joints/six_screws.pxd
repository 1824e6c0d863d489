cimport cython
from libc cimport math

from ..forward cimport vectors
from ..layout cimport arrays

cdef double LEAST_SHARE

@cython.locals(i=int, j=int)
cdef void write_inverse(double* T, double* inverse) noexcept nogil

@cython.final
cdef class SixScrews:
    cdef double* room
    cdef double* screws
    cdef double* goal
    cdef long long* order
    cdef double length

    @cython.locals(
        back='double[12]', axis=vectors.Triple, point=vectors.Triple, j=int, k=int, source=int
    )
    cdef void close(self, double* screws, double* T, int first, bint backwards) noexcept nogil
    @cython.locals(screw='double*')
    cdef void _put(
        self, int k, vectors.Triple axis, vectors.Triple point, double slides
    ) noexcept nogil
    @cython.locals(
        away='double[6]', origin=vectors.Triple, axis=vectors.Triple, middle=vectors.Triple,
        v=vectors.Triple, along=double, distance=double, length=double, i=int, k=int,
    )
    cdef void _choose_unit(self) noexcept nogil
    @cython.locals(
        axis=vectors.Triple, v=vectors.Triple, foot=vectors.Triple, moved=vectors.Triple,
        share=double, k=int,
    )
    cdef void _move_origin(self, vectors.Triple origin) noexcept nogil
