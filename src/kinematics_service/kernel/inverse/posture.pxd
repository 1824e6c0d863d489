cimport cython
cimport numpy as cnp
from libc cimport math

from ..forward cimport vectors
from ..layout cimport arrays, places
from .closed_forms cimport ClosedForm

cdef int _sign(double value, double size) noexcept nogil
@cython.locals(side=vectors.Triple, reach=vectors.Triple)
cdef int _shoulder(double* screws, vectors.Triple end) noexcept nogil
@cython.locals(
    z2=vectors.Triple, o2=vectors.Triple, chord=vectors.Triple, upper=vectors.Triple,
    off=vectors.Triple, square=double,
)
cdef int _elbow(double* screws, double second, vectors.Triple tip) noexcept nogil
@cython.locals(a=vectors.Triple, first=vectors.Triple, across=vectors.Triple)
cdef int _wrist(double* screws, double fifth) noexcept nogil
@cython.locals(
    psi='double[6]', screws='double*', z1=vectors.Triple, z2=vectors.Triple, z3=vectors.Triple,
    side=vectors.Triple, elbow=vectors.Triple, end=vectors.Triple, tip=vectors.Triple,
    turn_2=cython.bint, has_shoulder=cython.bint, has_elbow=cython.bint,
)
cdef void write_posture(
    ClosedForm form, double* q, long long* signs
) noexcept nogil
@cython.locals(count=Py_ssize_t, i=Py_ssize_t)
cpdef postures(ClosedForm form, cnp.ndarray q, cnp.ndarray signs)
