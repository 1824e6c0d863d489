# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
# Declare only the names of Python and C that the kernel uses. Cython's own files declare all
# names. Reading those files takes a third of the build time of each kernel module.
cdef extern from "Python.h":
    void* PyMem_RawMalloc(size_t) nogil
    void PyMem_RawFree(void*) nogil
    char* PyBytes_AS_STRING(bytes)

cdef extern from "<string.h>" nogil:
    void* memcpy(void*, const void*, size_t)

cdef extern from "<stdint.h>":
    ctypedef int int32_t
    ctypedef unsigned int uint32_t
    ctypedef size_t uintptr_t

# Declare the names of numpy's C interface that the kernel uses; the kernel imports nothing from
# numpy.
cdef extern from "numpy/arrayobject.h":
    enum:
        NPY_DOUBLE
        NPY_INT64
        NPY_UINT8
    ctypedef class numpy.ndarray [object PyArrayObject, check_size ignore]:
        pass
    int PyArray_NDIM(ndarray)
    Py_ssize_t PyArray_DIM(ndarray, int)
    int PyArray_TYPE(ndarray)
    bint PyArray_ISCARRAY(ndarray)
    bint PyArray_ISCARRAY_RO(ndarray)
    void* PyArray_DATA(ndarray)

ctypedef (double, double) Pair
ctypedef (double, double, double) Triple


cdef inline int given(object thing) except -1:
    if thing is None:
        raise TypeError('the kernel takes an object of its own here, not None')
    return 0


cdef inline Py_ssize_t size(ndarray array) except -1:
    cdef Py_ssize_t count = 1
    cdef int k
    if array is None:
        raise TypeError('the kernel takes arrays')
    for k in range(PyArray_NDIM(array)):
        count *= PyArray_DIM(array, k)
    return count


cdef inline Py_ssize_t extent(ndarray array, int axis) except -1:
    if array is None or PyArray_NDIM(array) <= axis:
        raise TypeError(f'the kernel takes an array of at least {axis + 1} dimensions here')
    return PyArray_DIM(array, axis)


cdef inline void* _checked(
    ndarray array, Py_ssize_t count, int kind, str name, bint written
) except NULL:
    if (
        array is None
        or PyArray_TYPE(array) != kind
        or not (PyArray_ISCARRAY(array) if written else PyArray_ISCARRAY_RO(array))
    ):
        raise TypeError(f'the kernel takes an array of {name} here, aligned and in C order')
    if size(array) < count:
        raise TypeError('an array is shorter than the kernel needs it')
    return PyArray_DATA(array)


cdef inline double* numbers(ndarray array, Py_ssize_t count) except NULL:
    return <double*> _checked(array, count, NPY_DOUBLE, 'float64', False)


cdef inline double* results(ndarray array, Py_ssize_t count) except NULL:
    return <double*> _checked(array, count, NPY_DOUBLE, 'float64', True)


cdef inline long long* whole(ndarray array, Py_ssize_t count) except NULL:
    return <long long*> _checked(array, count, NPY_INT64, 'int64', False)


cdef inline long long* whole_results(ndarray array, Py_ssize_t count) except NULL:
    return <long long*> _checked(array, count, NPY_INT64, 'int64', True)


cdef inline unsigned char* octets(ndarray array, Py_ssize_t count) except NULL:
    return <unsigned char*> _checked(array, count, NPY_UINT8, 'uint8', False)


cdef inline unsigned char* octets_to_fill(ndarray array, Py_ssize_t count) except NULL:
    return <unsigned char*> _checked(array, count, NPY_UINT8, 'uint8', True)


cdef inline unsigned char* octets_of(bytes data) except NULL:
    return <unsigned char*> PyBytes_AS_STRING(data)


# Alignment of scratch memory, bytes: its first number begins a cache line. A batch of measures
# takes 14 % longer if four numbers that are loaded at once are in two lines. With the address
# sanitizer the memory gets no padding at its end.
cdef extern from *:
    """
    #ifdef __SANITIZE_ADDRESS__
    #define KINEMATICS_LINE sizeof(void*)
    #else
    #define KINEMATICS_LINE 64
    #endif
    """
    enum:
        LINE "KINEMATICS_LINE"


# Returns aligned memory for `count` doubles. The address for `PyMem_RawFree` is stored just before
# the first double.
cdef inline double* scratch(Py_ssize_t count) except NULL:
    cdef size_t spare = sizeof(void*) + LINE - 1
    cdef void* memory = PyMem_RawMalloc(count * sizeof(double) + spare)
    cdef double* room
    if memory == NULL:
        raise MemoryError()
    room = <double*> ((<uintptr_t> memory + spare) & ~(<uintptr_t> LINE - 1))
    (<void**> room - 1)[0] = memory
    return room


cdef inline void give_back(double* room) noexcept nogil:
    if room != NULL:
        PyMem_RawFree((<void**> room - 1)[0])


cdef inline double* after(double* numbers, Py_ssize_t place) noexcept nogil:
    return numbers + place


cdef inline void copy(double* to, Py_ssize_t count, double* numbers) noexcept nogil:
    cdef Py_ssize_t k
    for k in range(count):
        to[k] = numbers[k]


cdef inline void fill(double* to, Py_ssize_t count, double number) noexcept nogil:
    cdef Py_ssize_t k
    for k in range(count):
        to[k] = number


cdef inline double dot(double* a, double* b, Py_ssize_t count) noexcept nogil:
    cdef Py_ssize_t k
    cdef double total = 0.0
    for k in range(count):
        total += a[k] * b[k]
    return total


cdef inline long long* whole_after(long long* integers, Py_ssize_t place) noexcept nogil:
    return integers + place


cdef inline long long* as_whole(double* numbers) noexcept nogil:
    return <long long*> numbers


cdef inline double number_at(unsigned char* data, Py_ssize_t place) noexcept nogil:
    cdef double number
    memcpy(&number, data + place, sizeof(number))
    return number


cdef inline long long seconds_at(unsigned char* data, Py_ssize_t place) noexcept nogil:
    cdef int32_t number
    memcpy(&number, data + place, sizeof(number))
    return number


cdef inline long long nanoseconds_at(unsigned char* data, Py_ssize_t place) noexcept nogil:
    cdef uint32_t number
    memcpy(&number, data + place, sizeof(number))
    return number


cdef inline void put_number(unsigned char* data, Py_ssize_t place, double number) noexcept nogil:
    memcpy(data + place, &number, sizeof(number))


cdef inline void put_half_word(
    unsigned char* data, Py_ssize_t place, long long number
) noexcept nogil:
    cdef uint32_t half = <uint32_t> number
    memcpy(data + place, &half, sizeof(half))
