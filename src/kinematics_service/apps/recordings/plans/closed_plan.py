# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Check a plan of an arm with closed loops at sampled poses. The samples can refute the plan but
prove nothing.

How far passive joints move between two samples is not bounded. So if no sample refutes a claim
about the plan, the claim is not decided.
"""

import numpy as np

from ....errors import PlanError
from ....kernel import Floats
from ....kinematics.closure import why_not_closed
from ....kinematics.forward import twist
from ....kinematics.singularity import singularity
from ....robot.closed_poses import closes_at
from ....robot.robot import Robot
from .point_speed import TOOL, chain_to, speed_between
from .polynomials import PolynomialMotion, moment_at
from .verdicts import PlanClosure, PlanSingularity, PlanSpeed

# Largest motion of a joint between two samples: rad, or m divided by the characteristic length. If
# the least allowed distance to singular poses is below this value, the motion is at most that
# distance.
MAX_STEP = 0.02
# Largest number of samples. A longer plan is sampled with larger steps between samples.
MAX_SAMPLES = 20_000
# Largest accepted joint position (rad, m), because at larger positions round-off prevents closing
# the loops.
MAX_POSITION = 1e8
# Number of samples whose loops are closed at once. If a loop does not close in one of them, later
# samples are not tried, because each failed search takes milliseconds.
BATCH = 256
# Number of bisections of the interval in which a loop stops closing. The bisections reduce this
# interval to 1e-12 of a sampling step.
HALVINGS = 40


class ClosedPlan:
    """
    The planned motion of an arm with closed loops, which is evaluated at sampled poses.

    Parameters
    ----------
    robot, motion
        The arm and the planned motion of its joints.
    threshold : rad
        The least allowed distance to a singular pose.

    Attributes
    ----------
    x : shape (N,)
        Position of each sample along the plan: the number of the segment (from 0), plus the
        fraction of the segment's duration. For example, 1.25 means a quarter of the duration of
        segment 1.
    closed : shape (N,)
        Whether the loops close at each sample. The samples are tested in groups of `BATCH`. After
        a group with an open loop the test stops, and all samples of later groups are False.
    """

    def __init__(self, robot: Robot, motion: PolynomialMotion, threshold: float) -> None:
        self._robot, self._motion, self._threshold = robot, motion, threshold
        farthest = float(np.max(np.sum(np.abs(motion.coefficients), axis=1)))
        if farthest > MAX_POSITION:
            accepted = f'at most {MAX_POSITION:g}'
            far = f'a joint moves to {farthest:g} rad or m; accepted is {accepted}'
            message = f'{robot.name} has closed loops, and {far}'
            raise PlanError(message, 'q', [accepted], farthest, code='too-large')
        moves = (
            np.sum(np.abs(motion.coefficients[:, 1:]), axis=1)
            / robot.singularity.task.column_scales
        )
        needed = np.ceil(np.max(moves, axis=1, initial=0.0) / min(MAX_STEP, threshold))
        limit = max(1, MAX_SAMPLES // len(needed))
        counts = np.clip(needed, 1, limit).astype(np.int64)
        parts = [k + np.arange(count) / count for k, count in enumerate(counts.tolist())]
        self.x = np.append(np.concatenate(parts), float(len(counts)))
        self.closed = np.zeros(len(self.x), dtype=bool)
        for begin in range(0, len(self.x), BATCH):
            part = slice(begin, begin + BATCH)
            self.closed[part] = closes_at(robot.chain, self._positions(self.x[part]))
            if not np.all(self.closed[part]):
                break

    def closure(self) -> PlanClosure:
        """
        Return whether the loops close at all samples. If not, return the first moment at which a
        loop does not close, and which loop.
        """
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
        moment = moment_at(self._motion, *self._motion.place(fails))
        loop, sentence = why_not_closed(self._robot, moment.q)
        return PlanClosure('refuted', loop, sentence, count, moment)

    def singularity(self) -> PlanSingularity:
        """Return whether a sample was found nearer to a singular pose than the threshold."""
        motion = self._motion
        x = self.x[self.closed]
        distance, at, pose = np.inf, 0.0, None
        if len(x):
            q = self._positions(x)
            poses = singularity(self._robot, q).nearest_singular
            away = np.linalg.norm((poses - q) / self._robot.singularity.task.column_scales, axis=1)
            k = int(np.argmin(np.where(np.isnan(away), np.inf, away)))
            at = float(x[k])
            if not np.isnan(away[k]):
                distance, pose = float(away[k]), poses[k].copy()
        refuted = distance < self._threshold
        ends = float(motion.begins[0]), float(motion.begins[-1] + motion.durations[-1])
        return PlanSingularity(
            'refuted' if refuted else 'not decided',
            self._threshold,
            0.0,
            distance,
            moment_at(motion, *motion.place(at)),
            pose,
            () if refuted else (ends,),
            len(x),
        )

    def speed(self, of: str, limit: float | None) -> PlanSpeed:
        """
        Return the largest speed of the point `of` at the samples, m/s. Between the samples no
        bound of the speed is known, so the upper bound is infinite.
        """
        chain_to(self._robot, of)  # raises an error for an unknown point
        x = self.x[self.closed]
        if not len(x):
            moment = moment_at(self._motion, 0, 0.0)
            return speed_between(of, 0.0, np.inf, moment, limit)
        row = TOOL if of == TOOL else int(of)
        q, qdot = self._positions(x), self._motion.velocities(*self._motion.place(x))
        speeds = np.linalg.norm(twist(self._robot, q, qdot, of=row)[:, :3], axis=1)
        k = int(np.argmax(speeds))
        moment = moment_at(self._motion, *self._motion.place(x[k]))
        return speed_between(of, float(speeds[k]), np.inf, moment, limit)

    def _positions(self, x: Floats) -> Floats:
        return self._motion.positions(*self._motion.place(x))
