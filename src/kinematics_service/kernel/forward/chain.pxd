from ..layout cimport arrays, places

cdef class Chain
cdef class Loop
cdef class Closure

cdef class Loop:
    cdef readonly tuple arguments
    cdef readonly Chain there, back
    cdef readonly Loop following
    cdef readonly int count, first
    cdef readonly double size, scale
    cdef long long* axis
    cdef double* unit

cdef class Closure:
    cdef readonly tuple arguments
    cdef readonly Loop first
    cdef readonly int dof, loops, variables, passive, width, coupling_at, told_at
    cdef long long* turns
    cdef double* start

cdef class Chain:
    cdef readonly object table, at_rest
    cdef readonly Closure closure
    cdef readonly tuple widths, single_widths
    cdef readonly int dof, elements, entries, frames, form, screws_at, frames_at, width
    cdef readonly int variables, loops, closure_at, pose_width
    cdef double* before
    cdef double* theta_0
    cdef double* d_0
    cdef long long* first_entry
    cdef long long* joint
    cdef double* by_theta
    cdef double* by_d
    cdef long long* frame_parent
    cdef double* frame_offset
