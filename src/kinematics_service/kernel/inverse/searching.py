"""The first solution that refinement meets, in one call."""

from ..layout import arrays
from ..layout.arrays import Flat, Floats
from . import dependence, solutions
from .joints import Joints
from .refinement import Refinement
from .solutions import Solutions


def _first_of(
    refinement: Refinement,
    joints: Joints,
    near: Flat,
    proved: float,
    count: int,
    starts: Flat,
    q: Flat,
    solution: Solutions,
) -> int:
    # Does what `first_solution` does, with room for joint positions q (n,).
    n, inside = joints.n, refinement.limits
    for k in range(count + 1):
        for j in range(n):
            value = near[j]
            if k > 0 and refinement.scales[j] != 0.0:
                value = starts[(k - 1) * n + j]
            q[j] = min(max(value, inside[2 * j]), inside[2 * j + 1])
        left = refinement.refine_one(q)
        if not left < proved:
            continue
        joints.represent(near, q)
        if joints.are_inside(q):
            solution.take(0, joints, q, left)
            solution.shares[0] = dependence.share_of_last_pivot(
                refinement.residual, joints.scales, q
            )
            return 1
    return 0


def first_solution(
    refinement: Refinement,
    joints: Joints,
    near: Floats,
    proved: float,
    starts: Floats,
    solution: Solutions,
) -> None:
    """
    Fill in the first solution inside the limits that refinement meets, if it meets any.

    It starts from `near`, then from the starts in their order.

    Parameters
    ----------
    refinement
        The refinement for the target; joints that it holds stay as in `near`.
    joints
        Of the arm.
    near : shape (n,), rad or m
        The first start.
    proved
        Largest error of a solution, m.
    starts : shape (N, n), rad or m
        Where to start from.
    solution
        Room for one.
    """
    solutions.require_fit(refinement.residual, joints, solution, 1)
    count = arrays.extent(starts, 0)
    middle, tries = arrays.numbers(near, joints.n), arrays.numbers(starts, count * joints.n)
    q = arrays.scratch(joints.n)
    lock = arrays.let_go()
    solution.count = _first_of(refinement, joints, middle, proved, count, tries, q, solution)
    arrays.take_back(lock)
    arrays.give_back(q)
