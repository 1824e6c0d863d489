cimport cython
cimport numpy as cnp

from ..layout cimport arrays, places
from . cimport dependence, posture, solutions, targets
from .closed_forms cimport ClosedForm
from .refinement cimport Refinement
from .joints cimport Joints
from ..six_joints.six_joints cimport Roots, SixJoints
from .solutions cimport SolutionCandidates, Solutions

cdef double SURE, LAST

@cython.locals(T='double[12]', free='double[6]', count=int, i=Py_ssize_t)
cdef int _find(
    ClosedForm form, double* pose, double* near, double* psi, SolutionCandidates found,
    double* said
) noexcept nogil
@cython.locals(q='double*', misses=double, i=int)
cdef int _keep_nearest(
    Refinement refinement, Joints joints, double* near, double proved,
    int count, SolutionCandidates found, Solutions kept,
) noexcept nogil
@cython.locals(q='double*', distinct=int, best=int, row=Py_ssize_t, i=int)
cdef int _keep_all(
    Refinement refinement, Joints joints, double* near, double proved,
    int count, SolutionCandidates found, Solutions kept,
) noexcept nogil
@cython.locals(
    most=Py_ssize_t, middle='double*', found=SolutionCandidates, psi='double*', count=int,
    said='double[1]', candidates=int, q='double*', i=Py_ssize_t,
)
cpdef closed_solutions(
    ClosedForm form, Refinement refinement, Joints joints,
    cnp.ndarray near, double proved, bint only_one, Solutions kept,
)
@cython.locals(
    most=Py_ssize_t, middle='double*', written='long long*', found=SolutionCandidates, roots=Roots,
    count=int, q='double*', i=Py_ssize_t,
)
cpdef eliminated_solutions(
    SixJoints arm, Refinement refinement, Joints joints, cnp.ndarray near, double proved,
    Solutions kept, cnp.ndarray counts,
)
@cython.locals(T='double[12]', count=int, k=Py_ssize_t)
cdef int _find_roots(
    SixJoints arm, double* pose, Roots roots, SolutionCandidates found
) noexcept nogil
