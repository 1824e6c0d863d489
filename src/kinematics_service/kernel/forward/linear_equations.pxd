cimport cython

@cython.locals(
    pivot=int, x=double, inverse=double, product=double, factor=double, i=int, j=int, k=int
)
cdef double factorise(double* A, int size, long long* order) noexcept nogil
@cython.locals(value=double, pivot=int, i=int, k=int)
cdef void solve(double* A, int size, long long* order, double* x) noexcept nogil
@cython.locals(value=double, pivot=int, i=int, k=int)
cdef void solve_transposed(double* A, int size, long long* order, double* x) noexcept nogil
