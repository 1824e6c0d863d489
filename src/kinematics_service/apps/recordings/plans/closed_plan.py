"""
A plan of an arm with closed loops, at many of its poses: what refutes it, and no proof.

Neither how far loops bend the arm between two poses nor that they close there is known. So what
is not refuted is not decided.
"""

from typing import NamedTuple

import numpy as np

from ....errors import PlanError
from ....kernel import Floats, Integers
from ....kinematics.closure import why_not_closed
from ....kinematics.forward import twist
from ....kinematics.singularity import singularity
from ....robot.closed_poses import closes_at
from ....robot.robot import Robot
from .point_speed import SLACK, TOOL, chain_to
from .polynomials import Pieces, PolynomialMotion, derivative, moment_at
from .verdicts import PlanClosure, PlanSingularity, PlanSpeed, PlanVerdict

# Between two samples the fastest joint moves no more than this (rad, or as a share of the
# characteristic length), unless there would be more samples than so many.
STEP, MOST = 0.02, 20_000
# Positions (rad or m) beyond which round-off keeps loops from closing, and each pose is searched.
FARTHEST = 1e8
# Samples of which it is looked at once whether the loops close: where one does not, the search
# for how they might takes milliseconds, and the plan is refuted.
AT_ONCE = 256
# The end of a branch and a change of sign of det(J_t) are looked for in so many halvings.
HALVINGS = 40
# A pose nearer than this, by first order, is singular, rad.
ARRIVED = 1e-6


class ClosedPlan:
    """
    Samples of a motion of an arm with closed loops.

    Parameters
    ----------
    robot, motion
        The arm and its motion.

    Attributes
    ----------
    x : shape (N,)
        The places of the samples: segment and share of it, added up.
    closed : shape (N,)
        Whether the loops close there; False behind the first samples at which they do not.
    """

    def __init__(self, robot: Robot, motion: PolynomialMotion) -> None:
        self._robot, self._motion = robot, motion
        farthest = float(np.max(np.sum(np.abs(motion.coefficients), axis=1)))
        if farthest > FARTHEST:
            raise PlanError(
                f'{robot.name} has closed loops, and a joint moves to {farthest:g} rad or m: '
                f'at most {FARTHEST:g}',
                'q',
                [f'at most {FARTHEST:g}'],
                farthest,
            )
        moves = (
            np.sum(np.abs(motion.coefficients[:, 1:]), axis=1)
            / robot.singularity.task.column_scales
        )
        wanted = np.ceil(np.max(moves, axis=1, initial=0.0) / STEP)
        most = max(1, MOST // len(wanted))
        each = np.clip(wanted, 1, most).astype(np.int64)
        parts = [k + np.arange(count) / count for k, count in enumerate(each.tolist())]
        self.x = np.append(np.concatenate(parts), float(len(each)))
        self.closed = np.zeros(len(self.x), dtype=bool)
        for begin in range(0, len(self.x), AT_ONCE):
            part = slice(begin, begin + AT_ONCE)
            self.closed[part] = closes_at(robot.chain, self._positions(self.x[part]))
            if not np.all(self.closed[part]):
                break

    def closure(self) -> PlanClosure:
        """Return whether the loops close at the samples."""
        count = len(self.x)
        if np.all(self.closed):
            return PlanClosure('not decided', '', '', count, None)
        k = int(np.argmin(self.closed))
        closes, fails = self.x[max(k - 1, 0)], self.x[k]
        for _ in range(HALVINGS if k else 0):
            middle = 0.5 * (closes + fails)
            if closes_at(self._robot.chain, self._positions(np.array([middle])))[0]:
                closes = middle
            else:
                fails = middle
        moment = moment_at(self._motion, *self._place(float(fails)))
        loop, sentence = why_not_closed(self._robot, moment.q)
        return PlanClosure('refuted', loop, sentence, count, moment)

    def singularity(self, threshold: float) -> PlanSingularity:
        """Return whether a singular pose within a threshold (rad) of a sample is found."""
        motion = self._motion
        x = self.x[self.closed]
        found = _NearestSample(np.inf, float(x[0]) if len(x) else 0.0, None)
        if len(x):
            near = singularity(self._robot, self._positions(x))
            found = self._nearest(x, near.nearest_singular, found)
            if near.determinant is not None and not found.distance < threshold:
                found = self._crossing(near.determinant, found)
        refuted = found.distance < threshold
        ends = float(motion.begins[0]), float(motion.begins[-1] + motion.durations[-1])
        return PlanSingularity(
            'refuted' if refuted else 'not decided',
            threshold,
            0.0,
            found.distance,
            moment_at(motion, *self._place(found.x)),
            found.pose,
            () if refuted else (ends,),
            len(x),
        )

    def _nearest(self, x: Floats, poses: Floats, found: '_NearestSample') -> '_NearestSample':
        # Of the singular poses that the search has found from the samples.
        away = (poses - self._positions(x)) / self._robot.singularity.task.column_scales
        distances = np.linalg.norm(np.where(np.isfinite(away), away, np.inf), axis=1)
        k = int(np.argmin(distances))
        if not np.isfinite(distances[k]):
            return found
        return _NearestSample(float(distances[k]), float(x[k]), poses[k].copy())

    def _crossing(self, determinants: Floats, found: '_NearestSample') -> '_NearestSample':
        # Where det(J_t) changes its sign between two samples there is a singular pose, if the
        # branch is the same all the way: the pose itself is looked at.
        at, signs = np.flatnonzero(self.closed), np.sign(determinants)
        changes = np.flatnonzero((signs[:-1] * signs[1:] <= 0.0) & (np.diff(at) == 1))
        for k in changes.tolist():
            before, after = float(self.x[at[k]]), float(self.x[at[k + 1]])
            for _ in range(HALVINGS):
                middle = 0.5 * (before + after)
                q = self._positions(np.array([middle]))
                if not closes_at(self._robot.chain, q)[0]:
                    break
                determinant = singularity(self._robot, q).determinant
                if determinant is not None and determinant[0] * signs[k] > 0.0:
                    before = middle
                else:
                    after = middle
            q = self._positions(np.array([after]))
            if singularity(self._robot, q).distance[0] < ARRIVED:
                return _NearestSample(0.0, after, q[0])
        return found

    def speed(self, of: str, limit: float | None) -> PlanSpeed:
        """Return the largest speed of a point at the samples; more than that is not known."""
        chain_to(self._robot, of)  # refuses a point that there is not
        x = self.x[self.closed]
        if not len(x):
            moment = moment_at(self._motion, 0, 0.0)
            return PlanSpeed(of, 0.0, np.inf, moment, limit, _verdict(limit, False))
        row = TOOL if of == TOOL else int(of)
        speeds = np.linalg.norm(
            twist(self._robot, self._positions(x), self._velocities(x), of=row)[:, :3], axis=1
        )
        k = int(np.argmax(speeds))
        moment = moment_at(self._motion, *self._place(float(x[k])))
        fast = limit is not None and speeds[k] > limit * (1.0 + SLACK)
        return PlanSpeed(of, float(speeds[k]), np.inf, moment, limit, _verdict(limit, fast))

    def _place(self, x: float) -> tuple[int, float]:
        segment = min(int(x), len(self._motion.begins) - 1)
        return segment, x - segment

    def _places(self, x: Floats) -> tuple[Integers, Floats]:
        segment = np.minimum(x.astype(np.int64), len(self._motion.begins) - 1)
        return segment, x - segment

    def _positions(self, x: Floats) -> Floats:
        return self._motion.positions(*self._places(x))

    def _velocities(self, x: Floats) -> Floats:
        segment, s = self._places(x)
        taylor = self._motion.taylor(Pieces(segment, s, np.zeros(len(s))))
        return derivative(taylor, 1, self._motion.seconds(segment))


class _NearestSample(NamedTuple):
    """The singular pose nearest to a sample: its distance in rad, the sample's place, the pose."""

    distance: float
    x: float
    pose: Floats | None


def _verdict(limit: float | None, fast: bool) -> PlanVerdict | None:
    if limit is None:
        return None
    return 'refuted' if fast else 'not decided'
