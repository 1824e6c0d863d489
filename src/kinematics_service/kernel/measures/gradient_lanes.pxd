cimport cython

from ..layout cimport arrays, places
from ..forward.chain cimport Chain

@cython.locals(
    w='double*', lane=Py_ssize_t, x=double, y=double, z=double, wx=double, wy=double, wz=double
)
cdef void _add_turned(double* Y, double* screw, Py_ssize_t step, double* total) noexcept nogil
@cython.locals(
    w='double*', lane=Py_ssize_t, x=double, y=double, z=double, a=double, b=double, c=double,
    vx=double, vy=double, vz=double, wx=double, wy=double, wz=double,
)
cdef void _add_carried(double* Y, double* screw, Py_ssize_t step, double* total) noexcept nogil
@cython.locals(lane=Py_ssize_t, x=double, y=double, z=double)
cdef void _add_along(double* screw, Py_ssize_t step, double* total, double* gradient) noexcept nogil
@cython.locals(
    step=Py_ssize_t, before='double[48]',
    behind='double[48]', k=Py_ssize_t, column=Py_ssize_t, e=Py_ssize_t, into='double*', y='double*',
)
cdef void fill_gradient(
    Chain chain, double* screws, double* Y, double* gradient
) noexcept nogil
