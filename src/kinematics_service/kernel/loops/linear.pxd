cimport cython

@cython.locals(product=double, factor=double, i=int, j=int, k=int, pivot=int)
cdef double factorise(double* A, int size, int* order) noexcept nogil
@cython.locals(x='double[6]', i=int, k=int)
cdef void solve(double* A, int size, int* order, double* b) noexcept nogil
@cython.locals(x='double[6]', i=int, k=int)
cdef void solve_transposed(double* A, int size, int* order, double* b) noexcept nogil
