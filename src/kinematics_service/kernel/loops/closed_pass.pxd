cimport cython

from ..forward cimport chain_pass
from ..forward.chain cimport Chain
from ..layout cimport arrays, places
from . cimport closing

cdef double evaluate_row(
    Chain chain, double* q, double* qdot, int depth, double* row
) noexcept nogil
@cython.locals(
    n=int, variables=int, x='double*', rates='double*', coupling='double*', rate=double,
    total=double, i=int, j=int,
)
cdef double evaluate_closed(Chain chain, double* qdot, int depth, double* row) noexcept nogil
@cython.locals(n=int, entries=int, J='double*', variable=int, share=double, e=int, i=int, j=int, k=int)
cdef void _add_up_screws(
    Chain chain, double* screws, double* coupling, double* row
) noexcept nogil
