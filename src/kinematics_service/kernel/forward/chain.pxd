from ..layout cimport arrays, places

cdef class Chain:
    cdef readonly object table, at_rest
    cdef readonly tuple widths, single_widths
    cdef readonly int dof, elements, entries, frames, form, screws_at, frames_at, width
    cdef double* before
    cdef double* theta_0
    cdef double* d_0
    cdef long long* first_entry
    cdef long long* joint
    cdef double* by_theta
    cdef double* by_d
    cdef long long* frame_parent
    cdef double* frame_offset
