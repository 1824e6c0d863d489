# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Check planned trajectories for singular poses, joint limits and speeds, at and between their
points.
"""

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from ....errors import PlanError
from ....robot.measures import Level
from ....robot.robot import Robot
from ..plans.check import check_plan
from ..plans.verdicts import PlanCheck
from ..readers.between_points import PlannedTrajectory
from ..readers.source import RecordingSource, Remark

# Half of the last printed digit of an angle, degrees. If a joint makes unnecessary full turns, a
# remark gives the angle that remains without the full turns. An angle below this limit would be
# printed as 0.0, so the remark says that the joint ends where it was.
TURN_RESOLUTION = 0.05


class PlanSettings(NamedTuple):
    """
    Settings of the check of plans: the arguments `distance`, `speed_limit` and `speed_of` of
    `check_plan`.

    Attributes
    ----------
    distance
        Least allowed distance to a singular pose, rad. None: the threshold `stop` of the distance,
        from the robot file or by default.
    speed_limit
        Largest allowed speed of the tool and of the points in `speed_of`, m/s; None without a
        limit.
    speed_of
        Names of further points of the arm whose largest speed is computed.
    """

    distance: float | None = None
    speed_limit: float | None = None
    speed_of: tuple[str, ...] = ()

    @property
    def speeds_requested(self) -> bool:
        """Return whether a speed limit, or the speed of points besides the tool, was requested."""
        return self.speed_limit is not None or bool(self.speed_of)


def checks_of(
    robot: Robot,
    source: RecordingSource,
    joint_prefix: str,
    settings: PlanSettings,
    progress: Callable[[int], None] = lambda plans: None,
) -> dict[int, PlanCheck]:
    """
    Return the checks of the trajectories in a file, by trajectory number from 1. If a trajectory
    cannot be checked, add a remark to the source.
    """
    checks = {}
    names = [joint_prefix + name for name in robot.joint_names]
    for number, plan in enumerate(source.plans, 1):
        label, several = 'The plan', len(source.plans)
        if several > 1:
            label = f'Trajectory {number} of {several}'
        arm_plan = plan.of(names)
        try:
            checks[number] = check_plan(robot, *arm_plan[1:], *settings)
        except PlanError as error:
            text = f'{label} is not checked: {error}'
            source.remarks.append(Remark(Level.ERROR, text, error.code))
        else:
            source.remarks.extend(_full_turns(robot, arm_plan, label))
        progress(1)
    return checks


def _full_turns(robot: Robot, plan: PlannedTrajectory, label: str) -> Iterator[Remark]:
    # Yields a remark for each joint that makes unnecessary full turns. Without these turns, the
    # joint would move within its limits, and the poses of the arm would be the same.
    for j, name in enumerate(robot.joint_names):
        q = plan.positions[:, j]
        sides = np.flatnonzero(np.diff(np.sign(np.diff(q)))) + 1
        ends = [0, *sides.tolist(), len(q) - 1]
        steps = [(k, k + 1) for k in range(len(q) - 1)]
        for begin, end in () if robot.prismatic[j] else (*steps, *zip(ends, ends[1:])):
            turn = float(q[end] - q[begin])
            whole = math.tau * round(turn / math.tau)
            low, high = robot.limits[j] + whole
            if whole and low <= np.min(q[end:]) and np.max(q[end:]) <= high:
                short = math.degrees(turn - whole)
                effect = f'{short:.1f} deg end at the same pose'
                effect = effect if abs(short) >= TURN_RESOLUTION else 'the joint ends where it was'
                yield Remark(
                    Level.WARN,
                    f'{label} turns {name} by {math.degrees(turn):.1f} deg from '
                    f'{plan.times[begin]:.3f} to {plan.times[end]:.3f} s, and {effect}',
                )
                break
