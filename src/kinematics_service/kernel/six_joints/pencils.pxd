cimport cython
from libc cimport math

from ..forward cimport chain_pass
from ..layout cimport arrays, places
from . cimport pairs, trigonometric_samples
from .pairs cimport Pair
from .elimination cimport Elimination

cdef int SIZE, SQUARE, DEGREE, FULL_DEGREE, SAMPLES, MOST_SAMPLES
cdef double TINY, ROUND_OFF

@cython.final
cdef class Pencil:
    cdef double* room
    cdef double* rows
    cdef double* M
    cdef double* columns
    cdef double* work
    cdef double* coefficients
    cdef double* circle
    cdef double* samples
    cdef int degree
    cdef int count
    cdef double noise
    cdef double gap
    cdef double error
    cdef double pivot

    @cython.locals(count=int, h=int, r=int, i=int, k=int)
    cdef void build(self, Elimination elimination, bint swapped, bint slides) noexcept nogil
    @cython.locals(
        first='double*', second='double*', f='double*', f0=double, f1=double, f2=double,
        half_1=double, half_2=double, step=int, across=int, b=int,
    )
    cdef void _write_two_rows(
        self, Elimination elimination, int h, int r, bint swapped, bint slides
    ) noexcept nogil
    @cython.locals(share=double, i=int, j=int, k=int, r=int)
    cdef void _compress(self, int count) noexcept nogil
    @cython.locals(M='double*', square=double, x=double, share=double, i=int, j=int, k=int)
    cdef void _balance(self) noexcept nogil
    @cython.locals(
        largest=double, minor=double, c=double, s=double, noise=double, count=int, n=int, i=int,
    )
    cdef void sample(self) noexcept nogil
    @cython.locals(
        A='double*', product=double, pivot=double, x=double, share=double, p=int, i=int, j=int,
        k=int,
    )
    cdef double _determinant(self) noexcept nogil
    @cython.locals(
        order='int[12]', W='double*', best=double, square=double, first=double, last=double,
        p=int, c=int, at=int, i=int, j=int, k=int,
    )
    cdef void write_null_vector(self, Pair z, double* x) noexcept nogil
    @cython.locals(
        inverse=Pair, c_re=double, c_im=double, s_re=double, s_im=double, share=double,
        A=double, B=double, C=double, i=int,
    )
    cdef void _fill(self, Pair z) noexcept nogil
    @cython.locals(
        inverse=Pair, c=Pair, s=Pair, left=Pair, entry=Pair, longest=double, missed=double,
        square=double, terms=double, share=double, A=double, B=double, C=double, at=int, i=int,
        j=int,
    )
    cdef double misses(self, Pair z, double* x) noexcept nogil
    @cython.locals(W='double*', x=double, i=int, j=int, e=int)
    cdef void _exchange(self, int k, int p, int c) noexcept nogil
    @cython.locals(
        W='double*', inverse=Pair, share=Pair, re=double, im=double, x=double, y=double,
        i=int, j=int,
    )
    cdef void _clear_column(self, int k) noexcept nogil
    @cython.locals(
        W='double*', first=Pair, pivot=Pair, value=Pair, re=double, im=double, a=double,
        b=double, x=double, y=double, i=int, j=int,
    )
    cdef void _substitute(self) noexcept nogil
