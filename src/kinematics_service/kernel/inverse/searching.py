"""The first solution that refinement meets, in one call."""

from ..layout import arrays
from ..layout.arrays import Flat, Floats
from . import dependence
from .refinement import Refinement
from .solutions import Solutions


def _first_of(
    refinement: Refinement, count: int, starts: Flat, q: Flat, solution: Solutions
) -> int:
    # Does what `first_solution` does, with room for joint positions q (n,).
    n, inside = solution.n, refinement.limits
    for k in range(count + 1):
        for j in range(n):
            value = solution.near[j]
            if k > 0 and refinement.scales[j] != 0.0:
                value = starts[(k - 1) * n + j]
            q[j] = min(max(value, inside[2 * j]), inside[2 * j + 1])
        left = refinement.refine_one(q)
        if left < solution.proved and solution.represent(q):
            solution.take(0, q, left)
            solution.shares[0] = dependence.share_of_last_pivot(
                refinement.residual, solution.joints.scales, q
            )
            return 1
    return 0


def first_solution(refinement: Refinement, starts: Floats, solution: Solutions) -> None:
    """
    Fill in the first solution inside the limits that refinement meets, if it meets any.

    It starts from where solutions should be near, then from the starts in their order.

    Parameters
    ----------
    refinement
        The refinement for the target; joints that it holds stay where they should be near.
    starts : shape (N, n), rad or m
        Where to start from.
    solution
        Room for one.
    """
    solution.require_fit(refinement.residual, solution.n, 1)
    n, count = solution.n, arrays.extent(starts, 0)
    tries, q = arrays.numbers(starts, count * n), arrays.scratch(n)
    lock = arrays.let_go()
    solution.count = _first_of(refinement, count, tries, q, solution)
    arrays.take_back(lock)
    arrays.give_back(q)
