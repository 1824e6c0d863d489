cimport cython

from ..layout cimport arrays, lanes, places
from . cimport chain_pass, tool_lanes
from .chain cimport Chain

@cython.locals(k=Py_ssize_t, lane=Py_ssize_t)
cdef inline void _start(double* T, double* motion) noexcept nogil
@cython.locals(
    row=Py_ssize_t, i=Py_ssize_t, lane=Py_ssize_t, x=double, y=double, z=double,
    xx=double, xy=double, xz=double, xp=double, yx=double, yy=double, yz=double, yp=double,
    zx=double, zy=double, zz=double, zp=double,
)
cdef inline void _times(double* T, double* motion) noexcept nogil
@cython.locals(
    row=Py_ssize_t, i=Py_ssize_t, lane=Py_ssize_t, x=double, y=double, z=double, a=double,
    c=double, s=double,
)
cdef inline void _times_twist(double* T, double* motion) noexcept nogil
@cython.locals(
    row=Py_ssize_t, i=Py_ssize_t, lane=Py_ssize_t, x=double, y=double, s=double, c=double,
)
cdef inline void _times_screw(double* T, double* sines, double* cosines, double* d) noexcept nogil
@cython.locals(i=Py_ssize_t, lane=Py_ssize_t)
cdef inline void _write_point_and_axis(double* T, Py_ssize_t step, double* screw) noexcept nogil
@cython.locals(k=Py_ssize_t)
cdef inline void _put_motion(double* T, double* row) noexcept nogil
cdef Py_ssize_t room(Chain chain) noexcept nogil
@cython.locals(
    n=Py_ssize_t, elements=Py_ssize_t, step=Py_ssize_t, twisted=cython.bint, count=Py_ssize_t,
    k=Py_ssize_t, e=Py_ssize_t, lane=Py_ssize_t, positions='double*', rates='double*',
    screws='double*', value='double*', by_theta=double, by_d=double, T='double[192]',
    turn='double[16]', d='double[16]', theta='double[16]', sines='double[16]',
    cosines='double[16]',
)
cdef bint evaluate_rows(
    Chain chain, double* q, double* qdot, Py_ssize_t each, int depth, double* rows,
    Py_ssize_t width, double* work,
) noexcept nogil
