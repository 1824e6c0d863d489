cimport cython
from libc cimport math

from ..forward cimport chain_pass
from ..forward.chain cimport Chain, Loop
from ..layout cimport arrays, places

@cython.locals(
    theta=double, d=double, value=double, rx=double, ry=double, rz=double, zx=double, zy=double,
    zz=double, by_theta=double, by_d=double, i=int, k=int, e=int,
)
cdef void _walk(Chain chain, double* x, double* T, double* screws, int at) noexcept nogil
@cython.locals(
    x=double, y=double, z=double, along=double, ax=double, ay=double, az=double, bx=double,
    by=double, bz=double, sine=double, angle=double, share=double, i=int,
)
cdef void _write_gap(double* there, double* back, double* gap) noexcept nogil
@cython.locals(
    there='double[12]', back='double[12]', gap='double[6]', largest=double, amount=double, i=int,
)
cdef double write_residual(
    Loop loop, double* x, double* residual, double* screws
) noexcept nogil
@cython.locals(i=int, e=int, k=int)
cdef void write_slopes(Loop loop, double* screws, double* slopes) noexcept nogil
@cython.locals(column=int, i=int)
cdef void _add_slope(
    Loop loop, int variable, double* screws, int at, double sign, double* slopes
) noexcept nogil
@cython.locals(share=double, i=int, e=int, k=int)
cdef void write_by_joint(
    Loop loop, int dof, int joint, double* screws, double* section, double* slopes
) noexcept nogil
cdef double _share(
    Loop loop, int dof, int joint, int variable, double* section
) noexcept nogil
