# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Measure over random configurations how exactly a robot file agrees with a URDF."""

import math
from dataclasses import dataclass

import numpy as np

from ...kernel import Floats
from ...rigid_motion import rotation_vector
from ..chain import poses_and_jacobians
from ..robot import Robot
from .chain import UrdfChain

CONFIGURATIONS = 1000
SEED = 20240611
UNLIMITED_STROKE = 1.0  # m; range in which a prismatic joint without limits is sampled
FULL_TURN = 2.0 * math.pi
# Largest sampled joint position, rad or m. Round-off grows with the position, so larger positions
# would hide small errors.
MAX_POSITION = 10.0 * FULL_TURN


@dataclass(frozen=True)
class Certificate:
    """
    The largest differences between the tool poses of a robot file and those of its source URDF.

    Parameters
    ----------
    configurations
        The number of random configurations inside the limits that were compared.
    position_error, rotation_error : m, rad
        The largest errors, which may be at different configurations.
    """

    configurations: int
    position_error: float
    rotation_error: float

    def __str__(self) -> str:
        """Return the certificate as a sentence."""
        return (
            f'worst pose error over {self.configurations} random configurations inside the '
            f'limits: {self.position_error:.1e} m, {self.rotation_error:.1e} rad'
        )


def configurations(chain: UrdfChain, count: int = CONFIGURATIONS) -> Floats:
    """
    Return random configurations of a URDF chain inside its limits, shape (count, n), rad or m.

    The seed is fixed, so every call for a chain returns the same configurations. The range of a
    joint without limits is a full turn, or one metre if the joint is prismatic. If a limit is
    beyond MAX_POSITION, positions come only from the part of the joint's range that is nearest to
    zero.
    """
    low, high = [], []
    for joint in chain.variables:
        span = UNLIMITED_STROKE if joint.type == 'prismatic' else FULL_TURN
        lower, upper = joint.limits.lower, joint.limits.upper
        if math.isinf(lower):
            lower = -span / 2.0 if math.isinf(upper) else upper - span
        upper = lower + span if math.isinf(upper) else upper
        low.append(max(lower, min(-MAX_POSITION, upper - MAX_POSITION)))
        high.append(min(upper, max(MAX_POSITION, lower + MAX_POSITION)))
    return np.random.default_rng(SEED).uniform(low, high, (count, len(low)))


def certify(chain: UrdfChain, robot: Robot) -> Certificate:
    """
    Compare the tool poses of a robot with the poses of the URDF chain from which it was made.
    """
    q = configurations(chain)
    expected, actual = chain.poses(q), poses_and_jacobians(robot.chain, q)[0]
    position = np.linalg.norm(actual[:, :3, 3] - expected[:, :3, 3], axis=1)
    turned = np.swapaxes(expected[:, :3, :3], 1, 2) @ actual[:, :3, :3]
    rotation = np.linalg.norm(rotation_vector(turned), axis=1)
    return Certificate(len(q), float(position.max()), float(rotation.max()))
