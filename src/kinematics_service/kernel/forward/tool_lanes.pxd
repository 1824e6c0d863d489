cimport cython
from libc cimport math

from ..layout cimport arrays, lanes, places
from .chain cimport Chain

@cython.locals(
    lane=Py_ssize_t, xx=double, xy=double, xz=double, yx=double, yy=double, yz=double, zx=double,
    zy=double, zz=double, x=double, y=double, z=double, w=double, scale=double,
    larger=cython.bint,
)
cdef void _write_quaternions(double* T, double* quaternions) noexcept nogil
@cython.locals(
    step=Py_ssize_t, screws='double*', twists='double*', screw='double[96]', twist='double[96]',
    sizes='double[16]', tool='double[48]', lane=Py_ssize_t, k=Py_ssize_t, e=Py_ssize_t,
    i=Py_ssize_t, by_theta=double, by_d=double, at='double*', rate='double*', x=double, y=double,
    z=double, zx=double, zy=double, zz=double, vx=double, vy=double, vz=double, wx=double,
    wy=double, wz=double, along=double,
)
cdef bint _write_screws(Chain chain, double* rates, double* row) noexcept nogil
@cython.locals(
    n=Py_ssize_t, J='double*', screws='double*', column='double*', screw='double*', k=Py_ssize_t,
    e=Py_ssize_t, i=Py_ssize_t, lane=Py_ssize_t,
)
cdef void _add_up_screws(Chain chain, double* row) noexcept nogil
@cython.locals(i=Py_ssize_t, point='double*')
cdef bint finish_rows(Chain chain, double* rates, int depth, double* row) noexcept nogil
