cimport cython
from libc cimport math

from ..forward cimport chain_pass, linear_equations
from ..layout cimport arrays, places
from . cimport gradient, singular_values, singularity
from ..forward.chain cimport Chain
from .task_rows cimport TaskRows

cdef double FLAT, LONGEST

@cython.final
cdef class SingularEquations:
    cdef Chain chain
    cdef TaskRows task
    cdef int n, rank, count, turns, length, width, size
    cdef double smallest, largest
    cdef bint wide, corrected
    cdef double* room
    cdef double* q
    cdef double* still
    cdef double* row
    cdef double* W
    cdef double* sigma
    cdef double* Y
    cdef double* A
    cdef double* turned
    cdef double* slopes
    cdef double* wanted
    cdef double* c
    cdef double* B
    cdef double* y
    cdef double* X
    cdef long long* order

    @cython.locals(j=int)
    cdef void move_to(self, double* origin, double* d, bint close) noexcept nogil
    @cython.locals(
        turns=int, size=int, count=int, length=int, first=int, B='double*', lost='double*',
        squares=double, r=int, i=int, k=int, line='double*', row='double*', norm=double,
        x='double*',
    )
    cdef bint _correct(self) noexcept nogil
    @cython.locals(
        x='double*', p=int, k=int, before='double*', along=double, norm=double
    )
    cdef bint _is_another(self, int i) noexcept nogil
    @cython.locals(k=int)
    cdef void take(self, double* row, double* W, double* sigma) noexcept nogil
    @cython.locals(i=int)
    cdef void complete(self) noexcept nogil
    cdef void decompose(self) noexcept nogil
    cdef bint are_singular(self, double share) noexcept nogil
    @cython.locals(left='double[6]', right=double, i=int, j=int)
    cdef void write_products(self, double* tool, double* joints) noexcept nogil
    @cython.locals(many='double*', few='double*')
    cdef void write_form(self, int turn, int line) noexcept nogil
    @cython.locals(j=int)
    cdef void write_slope(self, int turn, int line, double* slope) noexcept nogil
    @cython.locals(n=int, count=int, k=int, width=int, i=int, j=int)
    cdef void linearise(self) noexcept nogil
    @cython.locals(n=int, count=int, i=int, j=int, slope=double, along=double, sees=cython.bint)
    cdef void write_normals(self, double* normals) noexcept nogil
    @cython.locals(n=int, count=int, i=int, j=int, slope=double, share=double, row='double*')
    cdef double write_least(self, double* d) noexcept nogil
    @cython.locals(i=int, length=double)
    cdef double write_step_onto(self, double* d) noexcept nogil
    @cython.locals(i=int, j=int, squares=double, left=double)
    cdef bint are_fulfilled(self, double* d) noexcept nogil
    @cython.locals(i=int, j=int, along=double)
    cdef double write_nearest(self, double* away, double* d) noexcept nogil

@cython.locals(squares=double, j=int)
cdef double length_of(double* d, int n) noexcept nogil
