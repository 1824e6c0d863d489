# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""An arm and a second source of its poses, simulated: a wrong table, noise, zeros that slip."""

from dataclasses import replace

import numpy as np

import kinematics_service as ks
from kinematics_service.apps.calibration.collecting import CollectedPoses
from kinematics_service.apps.calibration.corrections import corrected_robot
from kinematics_service.kinematics.uncertainty.parameters import parameters_of
from kinematics_service.rigid_motion import exponential
from kinematics_service.robot.file.parts.description import Uncertainty
from kinematics_service.robot.robot import build_robot

# Standard deviations of one number of a position (m) and of a rotation vector (rad).
TRACKER = 1e-4, np.radians(0.02)
CAMERA = 5e-4, np.radians(0.1)
# Errors of a table (rad, m): after a calibration, and without one.
CALIBRATED, NOMINAL = 1e-5, 1e-3


def with_known_table(robot, deviation):
    """Return an arm whose file says how far each number of the table may be off."""
    own = tuple((one.name, deviation) for one in parameters_of(robot).table)
    none = (0.0,) * robot.dof
    said = Uncertainty(none, none, none, None, own, (), 0.0, 0.0)
    return build_robot(replace(robot.description, uncertainty=said))


class WatchedArm:
    """An arm whose true table differs from its file, and its second source anywhere."""

    def __init__(self, name, error, noise, random):
        file = ks.load_robot(name)
        table = parameters_of(file).table
        self.true = corrected_robot(file, table, error * random.normal(size=len(table)))
        self.file = with_known_table(file, error) if error < 1e-4 else file
        self.noise, self.random = noise, random
        self.X, self.Y = (self.anywhere() for _ in range(2))
        low, high = np.nan_to_num(file.limits, posinf=np.pi, neginf=-np.pi).T
        self.low, self.high = np.maximum(low, -2.0), np.minimum(high, 2.0)

    def anywhere(self):
        """Return a placement 0.3 m off, in any rotation."""
        T, random = np.eye(4), self.random
        T[:3, :3] = exponential(random.uniform(-2.5, 2.5, 3))
        T[:3, 3] = random.normal(size=3) * 0.3 / np.sqrt(3.0)
        return T

    def poses(self, q, offset=0.0, rates=None):
        """Return what the second source sees with the zeros off."""
        T = self.X @ ks.forward_kinematics(self.true, q + offset) @ self.Y
        position, rotation = self.noise
        T[:, :3, 3] += position * self.random.normal(size=(len(q), 3))
        T[:, :3, :3] = exponential(rotation * self.random.normal(size=(len(q), 3))) @ T[:, :3, :3]
        rates = np.zeros_like(q) if rates is None else rates
        return CollectedPoses(q, rates, T, tuple(range(len(q))))

    def region(self, count, width):
        """Return joint positions in a region of this width (rad)."""
        middle = self.random.uniform(self.low, self.high)
        q = middle + width * self.random.uniform(-0.5, 0.5, (count, len(middle)))
        return np.clip(q, self.low, self.high)

    def everywhere(self, count):
        """Return joint positions of the whole arm."""
        return self.random.uniform(self.low, self.high, (count, len(self.low)))

    def path(self, count):
        """Return joint positions along a smooth path."""
        way = np.linspace(0.0, count * 0.05, count)[:, None]
        phase, speed = self.random.uniform(0.0, 6.0, (2, len(self.low)))
        middle, half = (self.low + self.high) / 2, (self.high - self.low) / 4
        return middle + half * np.sin(phase + way * (0.3 + speed / 6.0))
