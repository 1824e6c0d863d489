cimport cython
cimport numpy as cnp
from libc cimport math

from ..layout cimport arrays, places

# With AVX2 the measures of one pose take 0.85 of the time.
cdef extern from *:
    """
    #if defined(__PYX_HAVE__kinematics_service__kernel__measures__singular_values) \
        && defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
    static void kinematics_orthogonalise_rows(
        double*, int, int, int
    ) __attribute__((target_clones("avx2", "default")));
    #endif
    """

cdef int MAX_SWEEPS
cdef double ORTHOGONAL, SETTLED

@cython.locals(
    aa=double, bb=double, ab=double, x=double, y=double, c=double, s=double, t=double, k=int
)
cdef inline double _turn_pair(double* a, double* b, int length, int width) noexcept nogil
@cython.locals(worst=double, last=int, turn=int, i=int, j=int)
cdef void orthogonalise "kinematics_orthogonalise_rows"(double* W, int count, int length, int width) noexcept nogil
@cython.locals(squares=double, best=int, i=int, j=int, k=int)
cdef void sort_by_norm(
    double* W, double* sigma, int count, int length, int width
) noexcept nogil
@cython.locals(row='double*', scale=double, width=int, i=int, k=int)
cdef void unit_rows(double* W, double* sigma, int count, int length) noexcept nogil
@cython.locals(
    row='double*', above='double*', used=double, least=double, along=double, norm=double,
    axis=int, j=int, k=int,
)
cdef void write_orthogonal_row(double* W, int i, int length, int width) noexcept nogil
@cython.locals(
    product=double, factor=double, x=double, pivot=int, i=int, j=int, k=int
)
cdef double determinant(double* A, int size) noexcept nogil
@cython.locals(
    first=double, last=double, pivot=double, factor=double, x=double, row=int, column=int,
    i=int, j=int, k=int,
)
cdef double least_pivot(double* A, int count, int length) noexcept nogil
@cython.locals(count=int, length=int, W='double*', values='double*')
cpdef decompose(cnp.ndarray work, cnp.ndarray sigma)
@cython.locals(size=int)
cpdef double determinant_of(cnp.ndarray A) except? -9.0
