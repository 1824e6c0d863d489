cimport cython
from libc cimport math

from ..layout cimport arrays, places
from . cimport factor_zeros, singular_equations
from .arm cimport Arm
from .atlas cimport Atlas
from .singular_equations cimport SingularEquations
from .singular_quadric cimport SingularQuadric

cdef int ENOUGH
cdef double HORIZON, SINGULAR, NEXT_STEP, NO_STEP, NO_GAIN, FOLLOWED, KEPT, LITTLE_NEARER, SAME, KNOWN, AGREES, CLOSE, ON_ITS_WAY, LATE, NEARER
cdef double COARSE, SURE, SADDLE, SPREAD, ZEROS_APART, WIDE, APART, MISSED, CURVED, LOCAL
cdef int CHARTS, ZEROS, MEMORY
cdef int STEPS, FULL_STEPS, LAST_STEPS, FOLLOWING_STEPS, MORE_STEPS

@cython.final
cdef class NearestSearch:
    cdef Arm arm
    cdef Atlas atlas
    cdef SingularEquations here, equations
    cdef SingularQuadric quadric
    cdef public int budget
    cdef readonly int evaluations
    cdef int n, count
    cdef public double horizon
    cdef readonly double estimate, distance, lasting, free
    cdef readonly bint ran, complete
    cdef double by_product, by_least, by_quadric, smallest, second, slope, missed
    cdef bint standing, settled
    cdef int known, stands_for
    cdef double* room
    cdef double* origin
    cdef double* first
    cdef double* d
    cdef double* onto
    cdef double* along
    cdef double* reached
    cdef double* nearest
    cdef double* searched
    cdef double* wrapped
    cdef double* before
    cdef double* tape
    cdef double* motions
    cdef double* scores
    cdef double* poses
    cdef double* slid_at
    cdef double* lengths_of

    @cython.locals(
        n=int, k=int, j=int, way_out='double*', sigma='double*', found=double,
        singular=cython.bint, known=cython.bint,
    )
    cdef void look(
        self, double* q, double* row, double* W, double* measures, double first_order
    ) noexcept nogil
    cdef void forget(self) noexcept nogil
    cdef bint follow(self, double* q, double first_order) noexcept nogil
    @cython.locals(first=int, away=double, k=int, length=double)
    cdef bint _bring_known(self, double* q) noexcept nogil
    @cython.locals(moved=double)
    cdef bint _may_be_nearer(self, int k, double* q) noexcept nogil
    @cython.locals(
        pose='double*', at='double*', scale='double*', moved=double, before=double, j=int,
        away=double, found=cython.bint,
    )
    cdef bint _bring(self, int k, double* q) noexcept nogil
    @cython.locals(n=int, place=int, k=int, pose='double*', at='double*', j=int)
    cdef void _remember(self, double away) noexcept nogil
    @cython.locals(pose='double*', squares=double, j=int, apart=double)
    cdef bint _is_known(self, int k, double away) noexcept nogil
    @cython.locals(j=int)
    cdef void _stand_at(self, double* q) noexcept nogil
    @cython.locals(squares=double, j=int, moved=double)
    cdef double _moved_from(self, double* pose, double* q) noexcept nogil
    @cython.locals(k=int, reach=double, falls=double)
    cdef void _estimate(self, double* sigma, double by_product) noexcept nogil
    @cython.locals(by_product=double, settled=cython.bint)
    cdef bint _search(self) noexcept nogil
    @cython.locals(n=int, near=double, radius=double, j=int, count=int, k=int, motion='double*')
    cdef void _run_from_known_poses(self) noexcept nogil
    @cython.locals(
        n=int, f=int, j=int, radius=double, count=int, k=int,
        motion='double*',
    )
    cdef void _look_at_factors(self) noexcept nogil
    @cython.locals(n=int, length=double, j=int, k=int, beside=cython.bint)
    cdef bint _leads_to_known(self, double* motion) noexcept nogil
    @cython.locals(away=double, j=int, farthest=double)
    cdef void _go_to_zero(self, int f) noexcept nogil
    cdef bint found(self) noexcept nogil
    cdef bint is_near(self) noexcept nogil
    cdef bint is_decided(self) noexcept nogil
    @cython.locals(missed=double, nearer=cython.bint)
    cdef double not_excluded(self) noexcept nogil
    @cython.locals(j=int)
    cdef void write_pose(self, double* pose) noexcept nogil
    @cython.locals(found=double, by_least=double)
    cdef bint _is_settled(self) noexcept nogil
    cdef bint _is_where_the_first_order_says(self) noexcept nogil
    @cython.locals(j=int)
    cdef void _run_from(
        self, double* motion, double length, double factor, double longest
    ) noexcept nogil
    @cython.locals(
        n=int, j=int, step=int, best=double, left=double,
        away=double, nearest=double, gain=double, share=double, standing=cython.bint,
        close=cython.bint, curved=cython.bint, curves=cython.bint,
        slide=double, length=double,
    )
    cdef void _run(self, int steps, double longest, bint known) noexcept nogil
    cdef bint _is_late(self, int more, double left, double away) noexcept nogil
    @cython.locals(j=int)
    cdef void _keep(self, double best, bint standing) noexcept nogil
    @cython.locals(j=int, length=double)
    cdef void _run_from_second_order(self, bint other) noexcept nogil
    @cython.locals(i=int, j=int, length=double)
    cdef void _run_along_axes(self) noexcept nogil
    @cython.locals(squares=double, j=int, away=double)
    cdef double _apart(self, double* motion) noexcept nogil
    @cython.locals(j=int, squares=double, step=double, straight=double, length=double)
    cdef bint _is_curved(self) noexcept nogil

cdef double _share_along(int step, int steps) noexcept nogil
