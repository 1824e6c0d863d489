cimport cython
cimport numpy as cnp

from ..forward.chain cimport Chain, Closure, LoopGroup
from ..layout cimport arrays, places
from ..forward cimport linear_equations
from . cimport residual

cdef double CLOSED, FINE, CORRECTION, ROUGH, LONGEST, SHORTEST, SHRUNK, GROWN, FLAT, LEVER
cdef double TRUSTED, BEND
cdef int NEWTON_STEPS, MOST_STEPS, BOTH_WAYS

@cython.locals(
    gap='double[18]', order='long long[18]', before=double, size=double, closed=cython.bint,
    least=double, step=int, i=int,
)
cdef int _solve(
    LoopGroup group, double* x, double largest, double* screws, double* slopes, double* told,
    int at,
) noexcept nogil
@cython.locals(product=double, longest=double, slope=double, i=int, k=int)
cdef double _levers(LoopGroup group, double* slopes) noexcept nogil
@cython.locals(steps=int, ratio=double, following='double*')
cdef int _solve_all(
    LoopGroup group, int left, double* x, double* before, double* screws, double* slopes,
    double* told, int at,
) noexcept nogil
@cython.locals(
    gap='double[18]', order='long long[18]', count=int, coupling='double*', following='double*',
    i=int, j=int,
)
cdef void _couple(
    LoopGroup group, int left, int n, double* section, double* screws, double* slopes
) noexcept nogil
@cython.locals(farthest=double, moved=double, j=int)
cdef double _farthest(LoopGroup group, int dof, double* q, double* section) noexcept nogil
@cython.locals(
    n=int, variables=int, told_at=int, screws='double*', before='double*', x='double[152]',
    told='double[72]', slopes='double[324]', length=double, steps=int, arrived=cython.bint, away=double, share=double, failed=int, i=int, j=int, k=int,
)
cdef int _go(Closure closure, double* q, double* section) noexcept nogil
@cython.locals(ways=int, k=int, j=int, away=double, whole='long long', turns=double)
cdef int _begin(
    Closure closure, double* numbers, double* q, int other_ways, double* section
) noexcept nogil
@cython.locals(unit=double, beside='double[128]', j=int)
cdef bint _go_beside(
    Closure closure, double* q, int joint, double bend, double* section
) noexcept nogil
@cython.locals(ways=int, failed=int, other=int, j=int)
cdef int close(Closure closure, double* q, double* section) noexcept nogil
cdef int close_next(
    Closure closure, double* last, double* q, double* section
) noexcept nogil
@cython.locals(steps=int, following='double*')
cdef int _assemble_all(
    LoopGroup group, int left, double* section, double* screws, double* slopes, double* told,
    int at,
) noexcept nogil
@cython.locals(
    known=int, passive=int, told='double[72]', slopes='double[324]', told_at=int, numbers='double*',
    screws='double*', failed=int, k=int,
)
cpdef int assemble(LoopGroup first, int groups, int dof, cnp.ndarray section) except -9
@cython.locals(
    count=Py_ssize_t, n=Py_ssize_t, width=Py_ssize_t, positions='double*', results='double*',
    said='double*', k=Py_ssize_t,
)
cpdef close_at(Chain chain, cnp.ndarray q, cnp.ndarray sections, cnp.ndarray closed)
