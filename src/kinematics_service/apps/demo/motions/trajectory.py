# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define two motions: `smooth` passes through a singular pose; `sine` moves joints by sines."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ....kernel import Floats
from ....robot.robot import Robot
from .motion import JointMotion, allowed_speeds, inside_limits
from .passage import Passage, smooth_trajectory


class Sines(NamedTuple):
    """
    The motion q_j(t) = centre_j + amplitude_j sin(frequency_j t + phase_j).

    Attributes
    ----------
    centre, amplitude : shape (n,), rad or m
    frequency : shape (n,), rad/s
    phase : shape (n,), rad
    period
        The time after which the motion repeats, s.
    """

    centre: Floats
    amplitude: Floats
    frequency: Floats
    phase: Floats
    period: float

    def at(self, t: npt.ArrayLike) -> JointMotion:
        """Return joint positions and velocities at times t (...,), s."""
        angle = self.frequency * np.asarray(t, dtype=np.float64)[..., None] + self.phase
        return JointMotion(
            self.centre + self.amplitude * np.sin(angle),
            self.amplitude * self.frequency * np.cos(angle),
        )


def sine_trajectory(robot: Robot) -> Sines:
    """
    Return a motion of sines: q_1 = sin t, q_2 = cos 2t, q_3 = sin 3t and so on, shifted and scaled
    into the joint limits.

    If a joint would exceed its velocity limit, the whole motion is slower.
    """
    n = robot.dof
    inside = inside_limits(robot)
    low, high = inside[:, 0], inside[:, 1]
    amplitude = np.minimum(1.0, 0.5 * (high - low))
    w = np.arange(1.0, n + 1.0)
    # Slow the whole motion by a factor of at most 1, so that no joint exceeds its velocity limit.
    clock = min(1.0, float(np.min(allowed_speeds(robot) / (amplitude * w))))
    return Sines(
        centre=np.clip(0.0, low + amplitude, high - amplitude),
        amplitude=amplitude,
        frequency=clock * w,
        phase=np.where(np.arange(n) % 2 == 0, 0.0, 0.5 * math.pi),
        period=2.0 * math.pi / clock,
    )


Trajectory = Passage | Sines
TRAJECTORIES: dict[str, Callable[[Robot], Trajectory]] = {
    'smooth': smooth_trajectory,
    'sine': sine_trajectory,
}
