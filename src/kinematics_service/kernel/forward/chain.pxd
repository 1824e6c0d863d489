from ..layout cimport arrays, places

cdef class Chain
cdef class Loop
cdef class LoopGroup
cdef class Closure

cdef class Loop:
    cdef readonly tuple arguments
    cdef readonly Chain there, back
    cdef readonly Loop following
    cdef readonly int count, row, entries
    cdef long long* axis

cdef class LoopGroup:
    cdef readonly tuple arguments
    cdef readonly Loop loop
    cdef readonly LoopGroup following
    cdef readonly int loops, first, count, entries, variables
    cdef readonly double size, scale
    cdef readonly object spans
    cdef double* unit
    cdef double* span

cdef class Closure:
    cdef readonly tuple arguments
    cdef readonly LoopGroup first
    cdef readonly int dof, loops, groups, variables, passive, width
    cdef readonly int coupling_at, told_at, screws_at
    cdef long long* turns
    cdef double* start

cdef class Chain:
    cdef readonly object table, at_rest
    cdef readonly Closure closure
    cdef readonly tuple widths, single_widths
    cdef readonly int dof, elements, entries, frames, form, screws_at, frames_at, width
    cdef readonly int variables, loops, groups, closure_at, pose_width
    cdef double* before
    cdef double* theta_0
    cdef double* d_0
    cdef long long* first_entry
    cdef long long* joint
    cdef double* by_theta
    cdef double* by_d
    cdef long long* frame_parent
    cdef double* frame_offset
