ctypedef (double, double) Pair


cdef inline Pair pair(double* numbers, Py_ssize_t k) noexcept nogil:
    return (numbers[2 * k], numbers[2 * k + 1])


cdef inline void put(double* numbers, Py_ssize_t k, Pair value) noexcept nogil:
    numbers[2 * k] = value[0]
    numbers[2 * k + 1] = value[1]


cdef inline Pair times(Pair a, Pair b) noexcept nogil:
    return (a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0])


cdef inline Pair plus(Pair a, double factor, Pair b) noexcept nogil:
    return (a[0] + factor * b[0], a[1] + factor * b[1])


cdef inline double square_of(Pair a) noexcept nogil:
    return a[0] * a[0] + a[1] * a[1]


cdef inline Pair over(Pair a, Pair b) noexcept nogil:
    cdef double square = b[0] * b[0] + b[1] * b[1]
    return ((a[0] * b[0] + a[1] * b[1]) / square, (a[1] * b[0] - a[0] * b[1]) / square)
