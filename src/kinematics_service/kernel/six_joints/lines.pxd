cimport cython

from ..forward cimport vectors
from ..layout cimport arrays

cdef int LINE, POINT, DIRECTION, MOMENT, THIRD

cdef void _put(double* V, Py_ssize_t at, vectors.Triple v) noexcept nogil
@cython.locals(square=double, along=double)
cdef void write_line(vectors.Triple direction, vectors.Triple point, double* V) noexcept nogil
@cython.locals(
    p=vectors.Triple, direction=vectors.Triple, moment=vectors.Triple, third=vectors.Triple,
    square=double, along=double,
)
cdef void translate(double* V, vectors.Triple a) noexcept nogil
@cython.locals(k=int, at=int)
cdef void carry(double* V, double* T) noexcept nogil
@cython.locals(
    axis=vectors.Triple, point=vectors.Triple, v=vectors.Triple, along=double, i=int, j=int,
    at=int,
)
cdef void write_parts(double* screws, int k, double* V, double* parts) noexcept nogil
@cython.locals(
    p=vectors.Triple, direction=vectors.Triple, moment=vectors.Triple, third=vectors.Triple,
    none=vectors.Triple, along=double,
)
cdef void _write_slides(vectors.Triple axis, double* V, double* parts) noexcept nogil
@cython.locals(k=int)
cdef void _translate_all(double* parts, vectors.Triple point) noexcept nogil
@cython.locals(
    moved='double[15]', axis=vectors.Triple, point=vectors.Triple, side=vectors.Triple,
    p=vectors.Triple, i=int,
)
cdef void write_invariants(double* screws, int k, double* V, double* six) noexcept nogil
