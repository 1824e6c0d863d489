cimport cython
from libc cimport math

from ..layout cimport arrays, places
from ..loops cimport closed_pass, closing
from . cimport gradient, singularity
from .arm cimport Arm

cdef double HORIZON, SINGULAR, NEXT_STEP, NO_STEP, FLAT, LONGEST, SHARE, THIRD, STRAIGHT, LESS, TRUSTED
cdef int STEPS, LAST_STEPS, IDLE

@cython.locals(n=int, m=int, groups=int, own=int)
cdef int room(Arm arm) noexcept nogil
@cython.locals(
    n=int, groups=int, least='double*', found='double*', free='double*', best=double, seen=double,
    expected=double, away=double, of_arm=cython.bint, first=int, turn=int, k=int, j=int,
)
cdef double look(
    Arm arm, double* q, double* row, double estimate, double* distances, double* pose,
    double* work
) noexcept nogil
@cython.locals(i=int, j=int)
cdef void _start(Arm arm, double* begin, double* d, double* row) noexcept nogil
@cython.locals(squares=double, j=int)
cdef double _length(double* d, int n) noexcept nogil
@cython.locals(squares=double, along=double, target=double, j=int)
cdef double _write_step(
    int n, double value, double* slope, double* d, bint slides, double* step
) noexcept nogil
@cython.locals(
    n=int, slope='double*', step='double*', row='double*', last='double*', free='double*',
    before=double, idle=int, value=double, length=double, moved=double, arrived=cython.bint,
    lost=cython.bint, turn=int,
)
cdef double _run_to_arm(
    Arm arm, double* q, double* begin, double best, double* d, double* work
) noexcept nogil
@cython.locals(
    n=int, slope='double*', step='double*', row='double*', last='double*', free='double*',
    value=double, onto=double, length=double, moved=double, share=double, turn=int, j=int,
)
cdef double _run_to_flat(
    Arm arm, double* q, double* begin, int k, double* d, double* work
) noexcept nogil
@cython.locals(
    n=int, section='double*', there='double*', total=double, i=int, j=int,
)
cdef bint _move(
    Arm arm, double* q, double* d, double share, double* row, double* last, double* step
) noexcept nogil
@cython.locals(n=int, results='double*', j=int)
cdef double _write_half(Arm arm, double* row, int k, double* slope, double* work) noexcept nogil
@cython.locals(n=int, m=int, W='double*', sigma='double*', Y='double*', j=int)
cdef double _write_least(Arm arm, double* row, double* slope, double* work) noexcept nogil
