# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Find a bundled robot that explains measured poses if the robot file does not."""

from collections.abc import Iterator
from typing import NamedTuple, TypeGuard

import numpy as np

from ...errors import KinematicsError
from ...kernel import Floats
from ...kinematics.tool_state import evaluate
from ...robot.bundled import bundled_robots
from ...robot.robot import Robot, load_robot
from .errors import Errors, PoseLimit, errors_of
from .offsets import fit_offsets

# Another robot is named if the measured poses fit it at least 3 times better than the given robot
# (position residuals, RMS).
MIN_RATIO = 3.0


class OtherRobot(NamedTuple):
    """A bundled robot, and the residuals of the measured poses with this robot."""

    name: str
    left: Errors

    def in_words(self) -> str:
        """Return a text with the bundled robot and its residuals, and ask which arm was used."""
        return f'the bundled robot {self.name} leaves {self.left.in_words()}: which arm is it?'


def left_by(robot: Robot, q: Floats, poses: Floats) -> Errors | None:
    """
    Return the residuals of poses (N, 4, 4) at joint positions q (N, n), rad or m, with offsets of
    base and tool fitted.

    Return None if a closed loop does not close.
    """
    try:
        A = evaluate(robot, q).pose
    except KinematicsError:
        return None
    fit = fit_offsets(A[None], poses[None]).one(0)
    return errors_of(fit.position, fit.rotation)


def explains(residuals: Errors | None, errors: Errors, limit: PoseLimit) -> TypeGuard[Errors]:
    """
    Return whether another robot explains the poses: its `residuals` are within `limit`, and its
    position residuals are at least 3 times smaller than those of the given robot, `errors`.
    """
    return (
        residuals is not None
        and residuals.within(limit)
        and MIN_RATIO * residuals.position_rms < errors.position_rms
    )


def other_robot(
    robot: Robot, errors: Errors, q: Floats, poses: Floats, limit: PoseLimit
) -> OtherRobot | None:
    """
    Return the bundled robot with the smallest residuals, if it explains the poses; else None.

    `errors` are the residuals of `robot`; the residuals of another robot must be within `limit`.
    """
    tried = [(name, left_by(other, q, poses)) for name, other in _robots_like(robot)]
    good = [OtherRobot(name, rms) for name, rms in tried if explains(rms, errors, limit)]
    return min(good, key=lambda other: other.left.position_rms, default=None)


def _robots_like(robot: Robot) -> Iterator[tuple[str, Robot]]:
    for name in bundled_robots():
        other = load_robot(name)
        same = other.dof == robot.dof and np.array_equal(other.prismatic, robot.prismatic)
        if same and other.name != robot.name:
            yield name, other
