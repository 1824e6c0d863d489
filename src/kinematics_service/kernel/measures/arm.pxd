from ..layout cimport places
from ..forward.chain cimport Chain
from .atlas cimport Atlas
from .factors cimport Tape
from .task_rows cimport TaskRows

cdef class Arm:
    cdef readonly Chain chain
    cdef readonly TaskRows task
    cdef readonly Tape tape
    cdef readonly bint factors_complete
    cdef readonly int watched
    cdef readonly double warn, stop, reach
    cdef readonly object spans
    cdef Atlas _atlas
