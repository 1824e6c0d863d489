cimport cython
from libc cimport math

from ..forward cimport chain_pass
from ..layout cimport arrays, lanes, places
from . cimport factors
from .factors cimport Tape
from .task_rows cimport TaskRows

@cython.locals(
    angles='double[16]', sines='double[16]', cosines='double[16]', lane=Py_ssize_t
)
cdef bint _turn(
    int operation, double number, double* a, double* value, double* da, double* db
) noexcept nogil
@cython.locals(lane=Py_ssize_t)
cdef void _combine(
    int operation, double* a, double* b, double* value, double* da, double* db
) noexcept nogil
@cython.locals(lane=Py_ssize_t, one=factors.Triple)
cdef bint _operate(
    int operation, double number, double* a, double* b, double* value, double* da, double* db
) noexcept nogil
@cython.locals(
    width=Py_ssize_t, da='double[16]', db='double[16]', i=Py_ssize_t, k=Py_ssize_t, column=Py_ssize_t, lane=Py_ssize_t, operation=int,
    first=int, second=int, number=double, step='double*', value='double*', before='double*',
    other='double*',
)
cdef bint _run_tape(Tape tape, Py_ssize_t n, double* q, double* steps) noexcept nogil
@cython.locals(
    squares='double[16]', value='double*', j=Py_ssize_t, at=Py_ssize_t, lane=Py_ssize_t,
    scale=double, slope=double,
)
cdef void _write_factor(
    Py_ssize_t n, double* step, double* scales, double* distances, double* result
) noexcept nogil
@cython.locals(n=Py_ssize_t, f=Py_ssize_t)
cdef bint judge_factors(
    Tape tape, TaskRows task, double* q, double* judged, double* steps
) noexcept nogil
