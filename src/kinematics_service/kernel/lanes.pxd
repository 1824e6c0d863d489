cimport cython
from libc cimport math

from . cimport arrays, chain_pass, places
from .chain cimport Chain

@cython.locals(k=Py_ssize_t, lane=Py_ssize_t)
cdef void _start(double* T, double* motion) noexcept nogil
@cython.locals(
    row=int, i=Py_ssize_t, lane=Py_ssize_t, x=double, y=double, z=double,
    xx=double, xy=double, xz=double, xp=double, yx=double, yy=double, yz=double, yp=double,
    zx=double, zy=double, zz=double, zp=double,
)
cdef void _times(double* T, double* motion) noexcept nogil
@cython.locals(
    row=int, i=Py_ssize_t, lane=Py_ssize_t, x=double, y=double, z=double, a=double, c=double, s=double
)
cdef void _times_twist(double* T, double* motion) noexcept nogil
@cython.locals(row=int, i=Py_ssize_t, lane=Py_ssize_t, x=double, y=double, s=double, c=double)
cdef void _times_screw(double* T, double* sines, double* cosines, double* d) noexcept nogil
@cython.locals(i=Py_ssize_t, lane=Py_ssize_t, screw='double*')
cdef void _write_points_and_axes(
    double* T, int entries, Py_ssize_t width, double* screws
) noexcept nogil
@cython.locals(nothing=double, k=Py_ssize_t, lane=Py_ssize_t)
cdef bint _finite(double* q, double* qdot, Py_ssize_t n, Py_ssize_t each) noexcept nogil
@cython.locals(beyond=int, lane=Py_ssize_t)
cdef bint _reducible(double* angles) noexcept nogil
@cython.locals(
    n=Py_ssize_t, elements=int, screws='double*', twisted=cython.bint, joint=int, k=Py_ssize_t, e=Py_ssize_t,
    i=Py_ssize_t, lane=Py_ssize_t, by_theta=double, by_d=double, total=double, T='double[192]',
    theta='double[16]', d='double[16]', sines='double[16]', cosines='double[16]',
    pose='double[12]',
)
cdef bint evaluate_rows(
    Chain chain, double* q, double* qdot, Py_ssize_t each, int depth, Py_ssize_t width,
    double* rows,
) noexcept nogil
