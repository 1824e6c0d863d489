cimport cython

from ..layout cimport arrays
from ..forward.chain cimport Chain

@cython.locals(
    w='double*', t='double*', tx=double, ty=double, tz=double, bx=double, by=double, bz=double,
    ax=double, ay=double, az=double,
)
cdef inline double _third_change(
    double* row, int screws_at, int entries, int a, int b, int c, double x, double y, double z
) noexcept nogil
@cython.locals(
    n=int, entries=int, at=int, i=int, j=int, k=int, first=int, last=int, a=int, b=int,
    y='double*', change=double,
)
cdef void write_curvature(Chain chain, double* row, double* Y, double* H) noexcept nogil
