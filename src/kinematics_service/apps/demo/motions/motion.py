"""Joint motions of a simulated arm, and their limits."""

from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from ....kernel import Floats
from ....robot.robot import Robot

# A path stays away from limits by this share of their range, and of a one-sided limit by this.
MARGIN, ONE_SIDED_MARGIN = 0.05, 0.05
# A path uses at most this share of a velocity limit.
SPEED_SHARE = 0.5


class JointMotion(NamedTuple):
    """Joint positions (..., n) in rad or m, and velocities (..., n) in rad/s or m/s."""

    q: Floats
    qdot: Floats


class Trajectory(Protocol):
    """A motion that repeats itself after `period` seconds."""

    @property
    def centre(self) -> Floats:
        """Return the pose in the middle, shape (n,), rad or m."""

    @property
    def period(self) -> float:
        """Return the time after which the motion repeats itself, s."""

    def at(self, t: npt.ArrayLike) -> JointMotion:
        """Return positions and velocities at times t (...,) in s."""


def inside_limits(robot: Robot) -> Floats:
    """Return the limits, a little narrower, shape (n, 2), rad or m."""
    low, high = np.array(robot.limits[:, 0]), np.array(robot.limits[:, 1])
    both = np.isfinite(high - low)
    margin = np.where(both, MARGIN * np.where(both, high - low, 0.0), ONE_SIDED_MARGIN)
    return np.stack([low + margin, high - margin], axis=1)


def allowed_speeds(robot: Robot, turning: float, sliding: float) -> Floats:
    """
    Return the speeds a path may use, shape (n,), rad/s or m/s: the last two are those of joints
    without a limit.
    """
    limits = robot.velocity_limits
    free = np.where(robot.prismatic, sliding, turning)
    return np.where(np.isinf(limits), free, SPEED_SHARE * limits)
