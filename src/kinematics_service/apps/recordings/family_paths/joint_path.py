"""A joint path through a posture of each target: its full turns, and how far the tool strays."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ....kernel import Floats
from ....kinematics.forward import forward_kinematics
from ....kinematics.inverse.problem.plan import InversePlan
from ....rigid_motion import exponential, rotation_vector
from ....robot.robot import Robot

# Where the tool is looked at between two targets.
BETWEEN = np.arange(1, 8)[:, None] / 8.0
# Round-off of a joint at a limit, rad or m.
AT_LIMIT = 1e-9


class StepRule(NamedTuple):
    """
    The largest step from a target to the next.

    Attributes
    ----------
    scales : shape (n,)
        The unit of each joint: 1 rad, or the arm's length (m) for prismatic joints.
    periods : shape (n,)
        The period of joints whose limits are wider than a turn or missing; infinite for others.
    most : rad
        The largest motion of a joint.
    """

    scales: Floats
    periods: Floats
    most: float

    def shortest(self, way: Floats, joint: int | slice = slice(None)) -> Floats:
        """Return ways (..., n), or of a joint (...), less the full turns that joints can make."""
        period = self.periods[joint]
        turn = np.where(np.isfinite(period), period, 0.0)
        return np.asarray(way - np.round(way / period) * turn)


def step_rule(plan: InversePlan, most: float) -> StepRule:
    """Return the rule of an arm."""
    stroke = plan.limits[:, 1] - plan.limits[:, 0]
    return StepRule(plan.scales, np.where(stroke < plan.periods, np.inf, plan.periods), most)


def on_turns_inside(q: Floats, limits: Floats, rule: StepRule, held: bool) -> Floats | None:
    """
    Return a path (N, n) by full turns inside the limits (n, 2), in their middle; None if none is.

    `held`: only as it is.
    """
    turned = q.copy()
    for j, period in enumerate(rule.periods.tolist()):
        low, high = limits[j] + [-AT_LIMIT, AT_LIMIT]
        least, most = float(q[:, j].min()), float(q[:, j].max())
        turns = 0
        if np.isfinite(period) and np.all(np.isfinite(limits[j])) and not held:
            first, last = np.ceil((low - least) / period), np.floor((high - most) / period)
            if first > last:
                return None
            turns = int(np.clip(np.round((low + high - least - most) / (2 * period)), first, last))
            turned[:, j] += turns * period
        elif least < low or most > high:
            return None
    return turned


def deviations(
    robot: Robot, poses: Sequence[Floats], q: Floats, whole: bool
) -> tuple[float, float]:
    """
    Return how far (m, rad) the tool leaves straight lines and shortest turns between its targets.

    Parameters
    ----------
    poses
        Of the targets, (4, 4) each.
    q : shape (N, n), rad or m
        A posture at each.
    whole
        Whether rotations count.
    """
    farthest = turned = 0.0
    for a, b, first, last in zip(poses, poses[1:], q, q[1:]):
        T = forward_kinematics(robot, first + BETWEEN * (last - first))
        line = a[:3, 3] + BETWEEN * (b[:3, 3] - a[:3, 3])
        farthest = max(farthest, float(np.max(np.linalg.norm(T[:, :3, 3] - line, axis=1))))
        if whole:
            R = a[:3, :3] @ exponential(BETWEEN * rotation_vector(a[:3, :3].T @ b[:3, :3]))
            off = rotation_vector(np.swapaxes(R, 1, 2) @ T[:, :3, :3])
            turned = max(turned, float(np.max(np.linalg.norm(off, axis=1))))
    return farthest, turned
