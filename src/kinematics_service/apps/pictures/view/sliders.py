# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Offer a slider for each joint, and choose the sliders' initial positions."""

import math
import time
from collections import deque

import numpy as np
import viser

from ....kernel import Floats
from ....kinematics.singular_poses import singular_poses
from ....node.drawing.scene import short_names
from ....robot.robot import Robot
from ..plots.ranges import clear_pose, finite_ranges

# Largest step of a slider, rad or m.
STEP = 0.001
# Time over which the velocity of a slider is averaged, s.
VELOCITY_WINDOW = 0.25


def singular_pose(robot: Robot, inside: Floats, near: Floats) -> Floats | None:
    """
    Return the singular pose (n,) inside ranges (n, 2) that is nearest to `near` (n,), or None.
    """
    poses = singular_poses(robot, inside)
    if not len(poses):
        return None
    return np.asarray(poses[int(np.argmin(np.linalg.norm(poses - near, axis=1)))])


class Sliders:
    """
    A slider for each joint in the panel of a server.

    Parameters
    ----------
    server
        The web server. The sliders are added to the panel of the page, in the folder that the
        caller has opened by `with server.gui.add_folder(...)`.
    robot
        The arm.

    Attributes
    ----------
    ranges : shape (n, 2), rad or m
        The lowest and the highest position of each slider.
    """

    def __init__(self, server: viser.ViserServer, robot: Robot) -> None:
        self.ranges = finite_ranges(robot, whole=True)
        self._continuous = robot.continuous
        self._history: deque[tuple[float, Floats]] = deque()
        start = np.clip(np.round(clear_pose(robot), 3), self.ranges[:, 0], self.ranges[:, 1])
        self._handles = []
        for j, (name, unit) in enumerate(zip(short_names(robot.joint_names), robot.units)):
            low, high = self.ranges[j].tolist()
            limited = bool(np.all(np.isfinite(robot.limits[j])))
            self._handles.append(
                server.gui.add_slider(
                    f'{name} ({unit})',
                    min=low,
                    max=high,
                    step=min(STEP, (high - low) / 100.0) if high > low else STEP,
                    initial_value=float(start[j]),
                    marks=((low, f'{low:.2f}'), (high, f'{high:.2f}')) if limited else None,
                    hint=f'{robot.joint_types[j]}; '
                    + ('it ends at the limits' if limited else 'no limits'),
                )
            )

    @property
    def positions(self) -> Floats:
        """Return the positions of the sliders, shape (n,), rad or m, inside their ranges."""
        q = np.array([float(handle.value) for handle in self._handles])
        inside: Floats = np.clip(np.nan_to_num(q), self.ranges[:, 0], self.ranges[:, 1])
        return inside

    def velocities(self, q: Floats) -> Floats | None:
        """
        Return the velocities of the sliders, shape (n,), rad/s or m/s, or None if the sliders
        rest.
        """
        now = time.monotonic()
        self._history.append((now, q))
        while now - self._history[0][0] > VELOCITY_WINDOW:
            self._history.popleft()
        then, before = self._history[0]
        if now == then or np.array_equal(q, before):
            return None
        return np.asarray((q - before) / (now - then))

    def move(self, q: Floats) -> None:
        """
        Move the sliders to joint positions (n,); angles of continuous joints are shown within
        +-pi.
        """
        for handle, value, continuous in zip(self._handles, q.tolist(), self._continuous):
            if continuous:
                value = math.remainder(value, 2.0 * math.pi)
            if abs(float(handle.value) - value) > STEP / 2.0:
                handle.value = value

    def jump(self, q: Floats) -> None:
        """Set the sliders to joint positions (n,) without computing a velocity from the jump."""
        self._history.clear()
        self.move(q)

    def enable(self, enabled: bool) -> None:
        """Unlock the sliders if `enabled`, else lock them."""
        for handle in self._handles:
            if handle.disabled == enabled:
                handle.disabled = not enabled
