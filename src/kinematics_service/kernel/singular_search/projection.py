# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find a singular pose near joint positions by projection onto the set of singular poses (sequential
quadratic programming).

S is an array of functions of the joint positions. All of them are zero if the task Jacobian J_t
has lost rank (`rank_equations.py`). dS is the derivative of S. The joint positions near which a
singular pose is wanted are called the origin. Let d_i be the motion from the origin after step i.
Each step solves min |d|^2 with S + dS (d - d_i) = 0 (Nocedal and Wright, Numerical Optimization,
section 18.1, with the identity I as Hessian). The solution is d - d_i = -dS^+ S - (I - dS^+ dS)
d_i. The first term is a step onto the set of singular poses, the second a step along this set. A
trust radius bounds both steps. The last iterations leave out the step along the set. These
iterations are Newton's method, which converges to a singular pose.
"""

import math

from ..forward.chain import Chain
from ..layout import arrays, places
from ..layout.arrays import Floats, Public
from ..measures.task_rows import TaskRows
from . import rank_equations
from .rank_equations import RankEquations

# Longest step of the projection, rad. The sine of this angle differs from the angle by 1.5 %, so
# the equations that are linearised at the start of a step are nearly exact at its end.
TRUST_RADIUS = 0.3
# Let d be the joint motion from the given joint positions to the present iterate. A projection has
# converged if the next step onto the set of singular poses is at most
# `STEP_TOLERANCE * max(|d|, MIN_MOTION)`, rad.
STEP_TOLERANCE = 1e-9
# Let d be the joint motion from the given joint positions to the present iterate. The tolerance of
# a projection is `STEP_TOLERANCE * max(|d|, MIN_MOTION)`, rad. MIN_MOTION keeps the tolerance at
# 1e-12 rad or above, because shorter steps are round-off.
MIN_MOTION = 1e-3
# Let d be the joint motion from the given joint positions to the present iterate. The steps along
# the set of singular poses have converged if the next of these steps is at most
# `SLIDE_TOLERANCE * |d|`. The relative error of the computed distance is then at most about 1e-5.
SLIDE_TOLERANCE = 5e-3
# Smallest factor by which the step along the set of singular poses is multiplied. With the factor
# 1, the step leads to the nearest point of the linearised set.
MIN_STEP_RATIO = 0.1
# Largest factor by which the step along the set of singular poses is multiplied. The factor may
# exceed 1, because the set is curved: the nearest point of the set can be farther than the nearest
# point of the linearised set.
MAX_STEP_RATIO = 2.0
# Largest number of Newton steps onto the set of singular poses, after the steps along the set. The
# Newton steps solve S = 0, the equations of a singular pose (rank_equations.py). If the zero is
# double, each step halves the distance to the zero.
NEWTON_STEPS = 24
# `Projection.run` estimates the distance to the singular pose and ends early if the estimate
# exceeds the argument `limit`. This is the number of steps along the set of singular poses before
# the first estimate.
TRIAL_STEPS = 2


class Projection:
    """
    Projects joint positions onto the set of singular poses, from one start at a time.

    Attributes
    ----------
    origin, d : shape (n,)
        The joint positions near which a singular pose is wanted, rad or m, and the motion from
        them to the present iterate, rad.
    radius
        Length of the longest step, rad.
    evaluations
        Number of evaluations of S and dS so far.
    """

    def __init__(self, chain: Chain, task: TaskRows, spans: Floats) -> None:
        self.n = chain.dof
        self.equations = RankEquations(chain, task, spans)
        self.evaluations: Public[int] = 0
        self.radius: float = TRUST_RADIUS
        n = chain.dof
        self.origin, self.d, self.result, self.onto = arrays.rooms(n, n, n, n)
        self.along, self.before, self.moved = arrays.rooms(n, n, n)

    def run(self, limit: float, max_steps: int, tolerance: float) -> float:
        """
        Change the joint motion d until it leads to a locally nearest singular pose.

        The motion d begins at the joint positions `origin`. Returns the length of d, rad. The
        length is infinite if the iteration does not converge, or if the linear estimate of the
        length exceeds `limit`.

        Parameters
        ----------
        limit
            Length of d beyond which the iteration ends, rad.
        max_steps
            Largest number of steps along the set of singular poses. If it is 0, the run does only
            Newton steps onto this set.
        tolerance
            The run has converged if the step along the set of singular poses is at most
            `tolerance` times the length of d.
        """
        # A round has two phases. In the first phase, each step leads onto the set of singular
        # poses and along the set. In the second phase, Newton steps lead only onto the set. If the
        # next step along the set then exceeds the tolerance, do a second round.
        n, best, remaining, is_second_round = self.n, places.INFINITY, max_steps, False
        self.equations.restart()
        for _ in range(2 * (max_steps + NEWTON_STEPS)):
            if not self._linearise():
                break
            length = rank_equations.length_of(self.d, n)
            onto = rank_equations.length_of(self.onto, n)
            ratio = self._share_along() if remaining < max_steps else 1.0
            along = ratio * rank_equations.length_of(self.along, n)
            slides = remaining > 0 and max(along, onto) > tolerance * length
            is_singular = self._is_singular(length, onto)
            if is_singular and length < best:
                best = self._take_last_step(length)
            if slides:
                if max_steps - remaining >= TRIAL_STEPS and self._estimate() > limit:
                    break
                self._move_along(ratio * min(1.0, self.radius / along) if along > 0.0 else ratio)
                remaining -= 1
            elif is_singular:
                if is_second_round or remaining > 0 or not along > tolerance * length:
                    break
                is_second_round, remaining = True, max_steps
            else:
                remaining = 0
            ratio = min(1.0, self.radius / onto) if onto > 0.0 else 0.0
            for j in range(n):
                self.d[j] += ratio * self.onto[j]
        arrays.copy(self.d, n, self.result)
        return best

    def _is_singular(self, length: float, onto: float) -> bool:
        # Let S = 0 be the equations of a singular pose (rank_equations.py). Returns whether the
        # joint motion d leads to a singular pose. S must be small. Also, the next Newton step must
        # be short, or S must be as small as round-off. The last condition is for a double zero of
        # S: near it, the Newton steps are still long when S is already round-off.
        if not self.equations.are_singular(places.SINGULAR_VALUE_RATIO):
            return False
        is_small = onto <= STEP_TOLERANCE * max(length, MIN_MOTION)
        return is_small or self.equations.are_singular(places.RANK_TOLERANCE)

    def _take_last_step(self, length: float) -> float:
        # Writes to `result` the joint motion d plus two vectors: `self.onto`, the last step onto
        # the set of singular poses, and `self.along`, the last step along the set. A vector is
        # added only if it is short, because the result is not tested again. Returns the length of
        # `result`, rad.
        n, onto, along = self.n, 0.0, 0.0
        if rank_equations.length_of(self.onto, n) <= SLIDE_TOLERANCE * length:
            onto = 1.0
        if rank_equations.length_of(self.along, n) <= places.SOLUTION_TOLERANCE * length:
            along = 1.0
        for j in range(n):
            self.result[j] = self.d[j] + onto * self.onto[j] + along * self.along[j]
        return rank_equations.length_of(self.result, n)

    def _linearise(self) -> bool:
        # Fills two steps from the joint motion d: `onto` leads onto the set of singular poses, and
        # `along` leads along this set. Returns False if a loop does not close at d. Returns False
        # if no motion changes S, where S = 0 are the equations of a singular pose.
        if not self.equations.move_to(self.origin, self.d):
            return False
        self.equations.linearise()
        self.evaluations += 1
        return self.equations.write_steps(self.d, self.onto, self.along)

    def _share_along(self) -> float:
        # Returns the factor by which the next step along the set of singular poses is multiplied.
        # The factor follows from the last motion along the set, and from the difference between
        # the steps that were computed before and after this motion (Barzilai and Borwein, 1988).
        squares, change = 0.0, 0.0
        for j in range(self.n):
            squares += self.moved[j] * self.moved[j]
            change += self.moved[j] * (self.before[j] - self.along[j])
        if not change > 0.0:
            return 1.0
        return max(MIN_STEP_RATIO, min(MAX_STEP_RATIO, squares / change))

    def _move_along(self, ratio: float) -> None:
        for j in range(self.n):
            self.before[j] = self.along[j]
            self.moved[j] = ratio * self.along[j]
            self.d[j] += self.moved[j]

    def _estimate(self) -> float:
        # Returns an estimate of the distance from the joint positions `origin` to the nearest
        # singular pose, rad. The estimate is the distance from `origin` to the linearised set of
        # singular poses. The motion from `origin` to this set is d + onto + along.
        squares = 0.0
        for j in range(self.n):
            end = self.d[j] + self.onto[j] + self.along[j]
            squares += end * end
        return math.sqrt(squares)
