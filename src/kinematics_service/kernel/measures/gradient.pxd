cimport cython

from ..forward.chain cimport Chain, Closure, Loop, LoopGroup
from ..layout cimport arrays, places
from ..forward cimport linear_equations
from ..loops cimport residual

cdef int LOOP_SCREWS

@cython.locals(
    elements=int, entries=int, j=int, k=int, e=int, bx=double, by=double, bz=double,
    ax=double, ay=double, az=double,
)
cdef void write_of_screws(
    Chain chain, double* screws, double* Y, double* gradient
) noexcept nogil
@cython.locals(slopes=int)
cdef int room(Chain chain) noexcept nogil
@cython.locals(screws='double*')
cdef void write_gradient(
    Chain chain, double* row, double* Y, double* gradient, double* work
) noexcept nogil
@cython.locals(
    n=int, variables=int, passive=int, section='double*', coupling='double*', screws='double*',
    total='double*', weights='double*', mu='double*', free='double*', own='double*', k=int, a=int,
    i=int, j=int, e=int,
)
cdef void _write_closed(
    Chain chain, Closure closure, double* row, double* Y, double* gradient, double* work
) noexcept nogil
@cython.locals(j=int, a=int)
cdef void _follow(
    int n, int passive, double* coupling, double* total, double* gradient
) noexcept nogil
@cython.locals(
    n=int, count=int, gap='double[18]', order='long long[18]', slopes='double*',
    following='double*', own='double*', coupling='double*', i=int, j=int,
)
cdef void _add_groups(
    LoopGroup group, int left, Closure closure, double* section, double* screws, double* mu,
    double* weights, double* total, double* free,
) noexcept nogil
cdef double* _behind_screws(Closure closure, double* free) noexcept nogil
@cython.locals(
    n=int, first=int, own='double*', following='double*', axis=int, i=int, j=int, k=int, a=int,
)
cdef void _add_loops(
    Loop loop, int left, LoopGroup group, Closure closure, double* coupling, double* screws,
    double* mu, double* weights, double* total, double* free,
) noexcept nogil
@cython.locals(variable=int, slope=double, e=int, i=int, j=int)
cdef void _pass_on(
    Chain chain, int first, int n, Loop loop, double* screws, int at, double sign, double* own,
    double* mu,
) noexcept nogil
@cython.locals(gradient='double*', own='double*', k=int)
cdef void _add_residual(
    Loop loop, double* screws, double* weights, double* total, double* free
) noexcept nogil
@cython.locals(e=int, i=int)
cdef void _side_by_side(Chain chain, double* screws, int at, double* own) noexcept nogil
@cython.locals(arrived='double*', screws='double*')
cdef void write_determinants(
    Chain chain, double* row, double* results, double* work
) noexcept nogil
@cython.locals(
    n=int, count=int, variables=int, following='double*', others='double*', slopes='double*',
    order='long long[18]', determinant=double, total='double*', weights='double*', free='double*',
    coupling='double*', k=int,
)
cdef void _write_determinant(
    LoopGroup group, int left, Closure closure, double* section, double* screws, double* results,
    double* work,
) noexcept nogil
@cython.locals(gap='double[18]', following='double*', i=int, k=int)
cdef void _add_inverse(
    Loop loop, int left, LoopGroup group, double determinant, double* slopes, long long* order,
    double* screws, double* weights, double* total, double* free,
) noexcept nogil
