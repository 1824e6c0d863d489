cimport cython
from libc cimport math

from . cimport chain_pass

ctypedef (double, double, double) Triple

cdef double dot(Triple a, Triple b) noexcept nogil
cdef Triple cross(Triple a, Triple b) noexcept nogil
cdef Triple plus(Triple a, double factor, Triple b) noexcept nogil
cdef Triple three(double* numbers, Py_ssize_t at) noexcept nogil
cdef Triple apart(double* numbers, Py_ssize_t at, Py_ssize_t step) noexcept nogil
cdef Triple axis_of(double* screws, int k) noexcept nogil
cdef Triple point_of(double* screws, int k) noexcept nogil
cdef bint slides(double* screws, int k) noexcept nogil
cdef Triple turned(Triple axis, double angle, Triple v) noexcept nogil
cdef Triple moved(double* screws, int k, double value, Triple point) noexcept nogil
cdef double angle(Triple axis, Triple a, Triple b, double otherwise) noexcept nogil
cdef Triple across(Triple axis) noexcept nogil
cdef Triple times_vector(double* T, Triple v) noexcept nogil
cdef Triple times_point(double* T, Triple v) noexcept nogil
