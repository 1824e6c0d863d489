from ..layout cimport arrays

cdef class TaskRows:
    cdef tuple _arrays
    cdef readonly int joints, count, generic_rank
    cdef long long* axis
    cdef double* rotation
    cdef double* row_scale
    cdef double* column_scale
