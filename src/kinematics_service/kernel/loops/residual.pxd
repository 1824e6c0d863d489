cimport cython
from libc cimport math

from ..forward cimport chain_pass
from ..forward.chain cimport Chain, Loop, LoopGroup
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
cdef double write_residual(
    LoopGroup group, double* x, double* residual, double* screws
) noexcept nogil
@cython.locals(
    there='double[12]', back='double[12]', gap='double[6]', component=double, amount=double, i=int,
    following='double*',
)
cdef double _write_residuals(
    Loop loop, int left, double size, double* x, double* residual, double* screws, double largest
) noexcept nogil
@cython.locals(i=int)
cdef void write_slopes(LoopGroup group, double* screws, double* slopes) noexcept nogil
@cython.locals(column=int, back='double*', following='double*', i=int, e=int)
cdef void _write_slopes(
    Loop loop, int left, int first, int count, double* screws, double* slopes
) noexcept nogil
cdef void write_by_joint(
    LoopGroup group, int dof, int joint, double* screws, double* section, double* slopes
) noexcept nogil
@cython.locals(share=double, following='double*', i=int, e=int, k=int)
cdef void _write_by_joint(
    Loop loop, int left, int first, int dof, int joint, double* screws, double* section,
    double* slopes,
) noexcept nogil
cdef double _share(
    Loop loop, int first, int dof, int joint, int variable, double* section
) noexcept nogil
