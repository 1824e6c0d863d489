# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Search one solution of inverse kinematics inside the limits. Levenberg-Marquardt runs from several
starts, one after the other, until a run converges.
"""

from ..layout import arrays
from ..layout.arrays import Floats
from . import dependence
from .refinement import Refinement
from .solutions import Solutions


def first_solution(refinement: Refinement, starts: Floats, solution: Solutions) -> None:
    """
    Run Levenberg-Marquardt from start positions, one by one, until a run converges to a solution
    inside the limits. Store this solution.

    The first start is `solution.near`; the rows of `starts` follow. If no start converges,
    `solution.count` stays 0.

    Parameters
    ----------
    refinement
        The refinement for the target. Joints that the refinement holds stay at `solution.near`.
    starts : shape (N, n), rad or m
        Joint positions at which the iteration starts.
    solution
        Receives the solution; its arrays must have at least one row.
    """
    solution.require_fit(refinement.residual, solution.n, 1)
    n, count, k = solution.n, arrays.extent(starts, 0), 0
    positions, q, inside = arrays.numbers(starts, count * n), arrays.scratch(n), refinement.limits
    with arrays.without_lock():
        while k <= count and solution.count == 0:
            for j in range(n):
                value = solution.near[j]
                if k > 0 and refinement.scales[j] != 0.0:
                    value = positions[(k - 1) * n + j]
                q[j] = min(max(value, inside[2 * j]), inside[2 * j + 1])
            error = refinement.refine_one(q)
            if error < solution.proved and solution.represent(q):
                solution.add(q, error)
                solution.shares[0] = dependence.pivot_ratio(
                    refinement.residual, solution.joints.scales, q
                )
            k += 1
    arrays.give_back(q)
