cimport cython
from libc cimport math

from ..forward cimport chain_pass
from . cimport pairs
from .pairs cimport Pair

cdef double FARTHEST

cdef bint is_near(Pair t) noexcept nogil
@cython.locals(size=double, larger=double, smaller=double)
cdef Pair root(Pair a) noexcept nogil
@cython.locals(square=double)
cdef Pair angle_of(Pair unit) noexcept nogil
@cython.locals(length=Pair)
cdef Pair angle(Pair cosine, Pair sine) noexcept nogil
@cython.locals(up=double, down=double, even=double, odd=double, s=double, c=double)
cdef void write_turn(Pair t, double* turn) noexcept nogil
