# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Find a path through a singular pose: a straight line in joint space, slower in its middle."""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ....kernel import Floats
from ....kinematics.singular_poses import singular_poses
from ....kinematics.singularity import singularity
from ....robot.closed_poses import close_at
from ....robot.robot import Robot
from .motion import JointMotion, allowed_speeds, inside_limits

# Largest motion of a revolute joint from the middle of the path to an end, rad.
TURNING_REACH = 0.7
# Largest motion of a prismatic joint from the middle of the path to an end, m.
SLIDING_REACH = 0.2
# Shortest period of the motion, s. It gives a person time to read the levels OK, WARN and ERROR in
# the live table of the demo.
MIN_PERIOD = 12.0
# Number of random straight lines in joint space that the search tries through each singular pose,
# and the seed of their directions.
DIRECTIONS = 16
SEED = 560


class Passage(NamedTuple):
    """
    The motion q(t) = centre + x * reach, with x = cos(u) (1 + 2 cos(u)^2) / 3 and u = 2 pi t /
    period.

    The motion is slow at the centre. The joints pass x = 0 at a third of the speed that they would
    have with x = cos(u), and their largest speed is 97 % of the largest speed with x = cos(u).

    Attributes
    ----------
    centre : shape (n,), rad or m
        The joint positions at x = 0: those of a singular pose, if the search found one.
    reach : shape (n,), rad or m
        The joint motion from the centre to one end of the path.
    period
        The time after which the motion repeats, s.
    """

    centre: Floats
    reach: Floats
    period: float

    def at(self, t: npt.ArrayLike) -> JointMotion:
        """Return joint positions and velocities at times t (...,), s."""
        rate = 2.0 * math.pi / self.period
        u = rate * np.asarray(t, dtype=np.float64)[..., None]
        x = np.cos(u) * (1.0 + 2.0 * np.cos(u) ** 2) / 3.0
        slope = -np.sin(u) * (1.0 + 6.0 * np.cos(u) ** 2) / 3.0
        return JointMotion(self.centre + x * self.reach, rate * slope * self.reach)


def smooth_trajectory(robot: Robot) -> Passage:
    """
    Return a path back and forth on a line in joint space that leads exactly through a singular
    pose.

    The search compares straight lines in joint space that pass through the singular poses of the
    arm in random directions. It returns the line whose ends are farthest from singular poses. If
    the limits exclude singular poses, or leave no room around them, the middle of the line is a
    regular pose. The path of an arm with closed loops goes through the position `assembled` of the
    robot file.
    """
    centre, reach = _line_of_loops(robot) if robot.chain.loops else _line(robot)
    slowest = np.max(np.abs(reach) / allowed_speeds(robot), initial=0.0)
    return Passage(centre, reach, max(MIN_PERIOD, 2.0 * math.pi * float(slowest)))


def _line(robot: Robot) -> tuple[Floats, Floats]:
    low, high = inside_limits(robot).T
    largest = np.where(robot.prismatic, SLIDING_REACH, TURNING_REACH)

    def room(centre: Floats) -> Floats:
        return np.asarray(np.minimum(largest, np.minimum(centre - low, high - centre)))

    centres = singular_poses(robot, np.stack([low, high], axis=1))
    centres = centres[np.all(room(centres) > 0.0, axis=1)]
    if not len(centres):
        middle = np.minimum(largest, 0.5 * (high - low))
        centres = np.clip(0.0, low + middle, high - middle)[None]
    random = np.random.default_rng(SEED)
    sides = random.choice([-1.0, 1.0], (DIRECTIONS, 1, robot.dof))
    reach = room(centres) * sides
    ends = np.stack([centres + reach, centres - reach])
    clearance = np.min(singularity(robot, ends).distance, axis=0)
    best = np.unravel_index(int(np.argmax(clearance)), clearance.shape)
    return centres[best[1]], reach[best]


def _line_of_loops(robot: Robot) -> tuple[Floats, Floats]:
    # Return centre and reach of a path for an arm with closed loops: a straight line in joint
    # space along which all joints move. The centre is the position `assembled` of the robot file.
    # Halve the reach until the whole line is inside the joint limits, and every loop closes at 21
    # points of the line.
    centre, units = robot.chain.closure.assembled(), np.minimum(robot.chain.closure.units(), 1.0)
    x = np.linspace(-1.0, 1.0, 21)[:, None]
    low, high = robot.limits.T
    for halvings in range(1, 11):
        reach = 0.5**halvings * units
        q = centre + x * reach
        if np.all((q >= low) & (q <= high)) and not np.any(close_at(robot.chain, q)[1]):
            return centre, reach
    return centre, 0.0 * units
