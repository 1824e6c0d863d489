cimport cython
from libc cimport math

from ..layout cimport arrays, places
from . cimport singular_values

cdef extern from *:
    """
    #if defined(__PYX_HAVE__kinematics_service__kernel__measures__jacobi_lanes) \
        && defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
    static void kinematics_orthogonalise(
        double*, Py_ssize_t, Py_ssize_t, Py_ssize_t
    ) __attribute__((target_clones("avx2", "default")));
    #endif
    """

cdef double ANY_ROWS

@cython.locals(
    lane=Py_ssize_t, k=Py_ssize_t, column=Py_ssize_t, x=double, y=double, aa=double, bb=double,
    ab=double, square=double, limit=double, away=double, root=double, both=double, t=double,
    c=double, s=double, cosine=double,
)
cdef inline void _turn_pairs(
    double* a, double* b, Py_ssize_t length, Py_ssize_t width, double* tolerances, double* worst,
    double* room,
) noexcept nogil
@cython.locals(
    tolerances='double[16]', worst='double[16]', room='double[48]', last=int, turn=int, i=Py_ssize_t, j=Py_ssize_t, lane=Py_ssize_t,
    a='double*', b='double*', turning=int, settled=cython.bint,
)
cdef void orthogonalise "kinematics_orthogonalise"(double* W, Py_ssize_t count, Py_ssize_t length, Py_ssize_t width) noexcept nogil
@cython.locals(x=double, k=Py_ssize_t, column=Py_ssize_t)
cdef void _swap(double* numbers, Py_ssize_t first, Py_ssize_t second, Py_ssize_t count) noexcept nogil
@cython.locals(
    squares='double[16]', largest='double[16]', best='double[16]', row='double*',
    norms='double*', i=Py_ssize_t, j=Py_ssize_t, k=Py_ssize_t, column=Py_ssize_t, lane=Py_ssize_t, other=Py_ssize_t, larger=cython.bint,
)
cdef void sort_by_norm(
    double* W, double* sigma, Py_ssize_t count, Py_ssize_t length, Py_ssize_t width
) noexcept nogil
@cython.locals(scales='double[16]', row='double*', i=Py_ssize_t, k=Py_ssize_t, column=Py_ssize_t, lane=Py_ssize_t)
cdef void unit_rows(double* W, double* sigma, Py_ssize_t count, Py_ssize_t length, Py_ssize_t width) noexcept nogil
@cython.locals(
    largest='double[16]', pivots='double[16]', zeros='double[16]', factors='double[16]',
    below='double*', row='double*', i=Py_ssize_t, j=Py_ssize_t, k=Py_ssize_t, column=Py_ssize_t, at=Py_ssize_t, lane=Py_ssize_t, pivot=Py_ssize_t,
    larger=cython.bint,
)
cdef void determinants(double* A, Py_ssize_t size, double* found) noexcept nogil
