# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Minimize the weighted distance of the tool from a target by Levenberg-Marquardt, with bounds on the
joints.

Nocedal and Wright, Numerical Optimization, section 10.3: each step solves (J^T J + mu I) step =
J^T error, where I is the identity. The number mu is the damping times the largest squared norm of
a column of J. If a step reduces the error, the damping is divided by 10, otherwise multiplied by
8. If a step would move a joint at a bound beyond the bound, the joint is held. The steps of other
joints are cut off at the bounds.
"""

import math

from ..layout import arrays, places
from ..layout.arrays import Flat, Floats
from ..measures import symmetric
from .residuals import Residual

# The iteration has converged if the error, divided by the length `residual.size()`, is at most
# this number. It is five times the machine epsilon, 2.2e-16.
ERROR_TOLERANCE = 1e-15
# A step is refused if it increases the error. If the error, divided by the length
# `residual.size()`, is below this number, the error is round-off. A refused step then ends the
# iteration.
REFUSED_STEP_TOLERANCE = 1e-12
# A step is slow if it decreases the squared error by less than this fraction, 0.1 %.
MIN_DECREASE = 1e-3
# A refused step also counts as a slow step (MIN_DECREASE) if the largest motion of a joint is
# below this, rad or m. The bound is 500 times the round-off of a position.
MIN_MOTION = 1e-13
# The iteration ends after this number of slow steps in sequence, because q is then at a local
# minimum.
MAX_SLOW_STEPS = 12
# Largest damping. A larger damping gives steps shorter than round-off.
MAX_DAMPING = 1e8
# Least damping after a failed Cholesky factorization: five times the machine epsilon.
MIN_FACTOR_DAMPING = 1e-15
# Least damping after a refused step. From this value, factors of 8 reach MAX_DAMPING in 22 steps.
MIN_STEP_DAMPING = 1e-12
# Damping that is added in each step, so that J^T J + damping is never exactly singular.
MIN_DAMPING = 1e-18


class Refinement:
    """
    Moves joint positions to a minimum of the distance between tool and target.

    Parameters
    ----------
    residual
        The residual of the target.
    scales : shape (n,), rad or m
        For each joint, the motion that is taken as equal to 1 rad: 1 for a revolute joint, the
        characteristic length for a prismatic joint, 0 for a joint that must not move.
    limits : shape (n, 2), rad or m
        Bounds of the joints, infinite for a joint without bounds.
    damping
        Initial damping, relative to the largest squared norm of a column of J: 1e-3 for any start,
        0 near a solution.
    steps
        Largest number of steps.
    """

    def __init__(
        self,
        residual: Residual,
        scales: Floats,
        limits: Floats,
        damping: float,
        steps: int,
    ) -> None:
        self.residual, self.damping, self.steps = residual, damping, steps
        n = self.residual.n
        self.scales, self.limits = arrays.numbers(scales, n), arrays.numbers(limits, 2 * n)
        self.A, self.L = arrays.rooms(n * n, n * n)
        self.g, self.step, self.trial = arrays.rooms(n, n, n)

    def refine_one(self, q: Flat) -> float:
        """
        Move joint positions q (n,), in place, to a local minimum of the weighted error between
        tool and target. Return the remaining error, m.
        """
        square = self.residual.square(q, places.JACOBIAN)
        if square == places.INFINITY:
            return places.INFINITY
        length = self.residual.size()
        converged = (ERROR_TOLERANCE * length) * (ERROR_TOLERANCE * length)
        negligible = (REFUSED_STEP_TOLERANCE * length) * (REFUSED_STEP_TOLERANCE * length)
        damping, slow_steps, has_moved, size = self.damping, 0, True, 0.0
        for _ in range(self.steps):
            if square <= converged or slow_steps >= MAX_SLOW_STEPS:
                break
            if has_moved:
                size = self._linearise(q)
                has_moved = False
            if size == 0.0:
                break
            added = damping * size + MIN_DAMPING * size
            if not symmetric.damped_step(
                self.residual.n, self.A, self.g, added, self.L, self.step
            ):
                damping = max(10.0 * damping, MIN_FACTOR_DAMPING)
                continue
            moved = self._try_step(q)
            if moved == 0.0:
                break
            new = self.residual.square(self.trial, places.JACOBIAN)
            if new < square:
                slow_steps = slow_steps + 1 if new > (1.0 - MIN_DECREASE) * square else 0
                arrays.copy(q, self.residual.n, self.trial)
                square = new
                damping = min(0.1 * damping, square / (length * length))
                has_moved = True
            else:
                if square <= negligible or damping > MAX_DAMPING:
                    break
                # The step was refused, so q is unchanged, and the normal equations A and g at q
                # stay valid. Do not call `_linearise` now: it would fill A and g for `trial`,
                # where the residual was last evaluated.
                damping = max(8.0 * damping, MIN_STEP_DAMPING)
                slow_steps += 1 if moved < MIN_MOTION else 0
        return math.sqrt(square)

    def _linearise(self, q: Flat) -> float:
        # Fills the normal equations A and g at q, and returns the largest squared norm of a column
        # of J. Call this function only if the residual was last evaluated at q.
        n, A, g, limits = self.residual.n, self.A, self.g, self.limits
        columns, error = self.residual.columns, self.residual.error
        self.residual.write_columns(self.scales)
        size = 0.0
        for i in range(n):
            column = arrays.after(columns, 6 * i)
            g[i] = arrays.dot(column, error, 6)
            for j in range(i + 1):
                A[i * n + j] = arrays.dot(column, arrays.after(columns, 6 * j), 6)
            size = max(size, A[i * n + i])
        # If the step would move a joint beyond its bound, hold the joint: set its equation to step
        # = 0.
        for i in range(n):
            upper = q[i] >= limits[2 * i + 1] and g[i] > 0.0
            if upper or (q[i] <= limits[2 * i] and g[i] < 0.0):
                g[i] = 0.0
                for j in range(n):
                    A[i * n + j] = 0.0
                    A[j * n + i] = 0.0
                A[i * n + i] = size
        return size

    def _try_step(self, q: Flat) -> float:
        # Fills `trial` with q plus the step, cut off at the bounds; returns the largest motion of
        # a joint.
        moved: float = 0.0
        for j in range(self.residual.n):
            value = q[j] + self.scales[j] * self.step[j]
            value = min(max(value, self.limits[2 * j]), self.limits[2 * j + 1])
            moved = max(moved, abs(value - q[j]))
            self.trial[j] = value
        return moved


def refine(refinement: Refinement, q: Floats, errors: Floats) -> None:
    """
    Move each row of q, in place, to a local minimum of the distance of the tool from the target.

    Parameters
    ----------
    refinement
        The target, weights and bounds of the minimization.
    q : shape (N, n), rad or m
        Starts, overwritten by the minima.
    errors : shape (N,), m
        Remaining errors at the minima: the norm of the weighted error of position and rotation.
    """
    count, n = arrays.extent(q, 0), refinement.residual.n
    positions, remaining = arrays.results(q, count * n), arrays.results(errors, count)
    with arrays.without_lock():
        for k in range(count):
            remaining[k] = refinement.refine_one(arrays.after(positions, k * n))
