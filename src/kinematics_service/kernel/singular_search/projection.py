"""
Project a pose onto the set of singular poses: sequential quadratic programming from one start.

S is zero where J_t has lost rank (`rank_equations.py`), and dS is its slope. With d_i the motion
from the given pose after step i, each step solves min |d|^2 with S + dS (d - d_i) = 0 (Nocedal and
Wright, Numerical Optimization, section 18.1, with the identity as Hessian): the least-norm step is
d - d_i = -dS^+ S - (1 - dS^+ dS) d_i. A trust radius bounds both parts. The last steps leave out
the part along the set: Newton's method converges to a singular pose.
"""

import math

from ..forward.chain import Chain
from ..layout import arrays, places
from ..layout.arrays import Floats, Public
from ..measures.task_rows import TaskRows
from . import rank_equations
from .rank_equations import RankEquations

# Longest step, rad: a sine differs from its tangent by 1.5 % there.
TRUST_RADIUS = 0.3
# Longest next step onto the set of a converged run, relative to the motion.
STEP_TOLERANCE = 1e-9
# Least motion, rad, for STEP_TOLERANCE: a step of 1e-12 rad is round-off.
MIN_MOTION = 1e-3
# Converged along the set, relative to the motion: the distance is at most 1e-5 too large.
SLIDE_TOLERANCE = 5e-3
# Bounds of the step along the set, relative to the whole step of the linear equations.
MIN_STEP_RATIO = 0.1
MAX_STEP_RATIO = 2.0  # for sets that bend half as much as dS says
# Steps of Newton's method after the projection: at a double zero each halves the rest.
NEWTON_STEPS = 24
# Steps after which the linear estimate of the distance decides whether a start is dropped.
TRIAL_STEPS = 2


class Projection:
    """
    Room for one run, and its result.

    Attributes
    ----------
    origin, d : shape (n,)
        The given pose, rad or m; and the motion of the run, in rad.
    radius
        Longest step, rad.
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

    def run(self, limit: float, most: int, tolerance: float) -> float:
        """
        Bring the motion d to the singular pose nearest to the origin, and return its length.

        It is infinite if the run does not converge, or if its linear estimate is beyond a limit.

        Parameters
        ----------
        limit
            Length beyond which a run is dropped, rad.
        most
            Steps of the projection at most; 0 for Newton's method alone.
        tolerance
            The motion along the set has converged at this, relative to the motion.
        """
        # Steps along the set come first; Newton's method alone ends the run. If a step along the
        # set would still be long then, both are done once more.
        n, best, remaining, is_second_round = self.n, places.INFINITY, most, False
        self.equations.restart()
        for _ in range(2 * (most + NEWTON_STEPS)):
            if not self._linearise():
                break
            length = rank_equations.length_of(self.d, n)
            onto = rank_equations.length_of(self.onto, n)
            share = self._share_along() if remaining < most else 1.0
            along = share * rank_equations.length_of(self.along, n)
            slides = remaining > 0 and max(along, onto) > tolerance * length
            is_singular = self._is_singular(length, onto)
            if is_singular and length < best:
                best = self._take_last_step(length)
            if slides:
                if most - remaining >= TRIAL_STEPS and self._estimate() > limit:
                    break
                self._move_along(share * min(1.0, self.radius / along) if along > 0.0 else share)
                remaining -= 1
            elif is_singular:
                if is_second_round or remaining > 0 or not along > tolerance * length:
                    break
                is_second_round, remaining = True, most
            else:
                remaining = 0
            share = min(1.0, self.radius / onto) if onto > 0.0 else 0.0
            for j in range(n):
                self.d[j] += share * self.onto[j]
        arrays.copy(self.d, n, self.result)
        return best

    def _is_singular(self, length: float, onto: float) -> bool:
        # Whether Newton's method has converged: S is small and so is the next step. At a double
        # zero the steps stay long; there S must be as small as round-off makes it.
        if not self.equations.are_singular(places.SINGULAR_VALUE_RATIO):
            return False
        is_small = onto <= STEP_TOLERANCE * max(length, MIN_MOTION)
        return is_small or self.equations.are_singular(places.RANK_TOLERANCE)

    def _take_last_step(self, length: float) -> float:
        # Take the last, small steps, which are not evaluated; returns the length of the motion.
        n, onto, along = self.n, 0.0, 0.0
        if rank_equations.length_of(self.onto, n) <= SLIDE_TOLERANCE * length:
            onto = 1.0
        if rank_equations.length_of(self.along, n) <= places.SOLUTION_TOLERANCE * length:
            along = 1.0
        for j in range(n):
            self.result[j] = self.d[j] + onto * self.onto[j] + along * self.along[j]
        return rank_equations.length_of(self.result, n)

    def _linearise(self) -> bool:
        # Fill the steps at d; False if a loop does not close there, or no motion changes S.
        if not self.equations.move_to(self.origin, self.d):
            return False
        self.equations.linearise()
        self.evaluations += 1
        return self.equations.write_steps(self.d, self.onto, self.along)

    def _share_along(self) -> float:
        # Step length along the set (Barzilai and Borwein, 1988) by the last change of the step.
        squares, change = 0.0, 0.0
        for j in range(self.n):
            squares += self.moved[j] * self.moved[j]
            change += self.moved[j] * (self.before[j] - self.along[j])
        if not change > 0.0:
            return 1.0
        return max(MIN_STEP_RATIO, min(MAX_STEP_RATIO, squares / change))

    def _move_along(self, share: float) -> None:
        for j in range(self.n):
            self.before[j] = self.along[j]
            self.moved[j] = share * self.along[j]
            self.d[j] += self.moved[j]

    def _estimate(self) -> float:
        # Length of the motion to the nearest point of the linear set.
        squares = 0.0
        for j in range(self.n):
            end = self.d[j] + self.onto[j] + self.along[j]
            squares += end * end
        return math.sqrt(squares)
