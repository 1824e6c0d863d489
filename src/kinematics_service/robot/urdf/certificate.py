"""How exactly a robot file agrees with a URDF, measured over random configurations."""

import math
from dataclasses import dataclass

import numpy as np

from ...kernel import Floats
from ...rigid_motion import rotation_vector
from ..chain import poses_and_frames
from ..robot import Robot
from .chain import UrdfChain

CONFIGURATIONS = 1000
SEED = 20240611
STROKE = 1.0  # m, of a slide without limits
FULL_TURN = 2.0 * math.pi
# Nothing is learned farther out than this (rad or m), where round-off grows with the way.
FARTHEST = 10.0 * FULL_TURN


@dataclass(frozen=True)
class Certificate:
    """
    The worst of many poses: the table against the plain product of the URDF's joints.

    Parameters
    ----------
    configurations
        Random joint positions inside the limits.
    position_error, rotation_error : m, rad
        The largest, not necessarily of one pose.
    """

    configurations: int
    position_error: float
    rotation_error: float

    def __str__(self) -> str:
        """Return it as a sentence."""
        return (
            f'worst pose error over {self.configurations} random configurations inside the '
            f'limits: {self.position_error:.1e} m, {self.rotation_error:.1e} rad'
        )


def configurations(chain: UrdfChain, count: int = CONFIGURATIONS) -> Floats:
    """
    Return random joint positions inside the limits, the same each time, shape (count, n).

    Joints without limits take a full turn, slides without limits one metre; wide limits are drawn
    from where they are nearest to zero.
    """
    low, high = [], []
    for joint in chain.variables:
        span = STROKE if joint.type == 'prismatic' else FULL_TURN
        lower, upper = joint.limits.lower, joint.limits.upper
        if math.isinf(lower):
            lower = -span / 2.0 if math.isinf(upper) else upper - span
        upper = lower + span if math.isinf(upper) else upper
        low.append(max(lower, min(-FARTHEST, upper - FARTHEST)))
        high.append(min(upper, max(FARTHEST, lower + FARTHEST)))
    return np.random.default_rng(SEED).uniform(low, high, (count, len(low)))


def certify(chain: UrdfChain, robot: Robot) -> Certificate:
    """Return how far the robot is from the chain it was made from."""
    q = configurations(chain)
    expected, found = chain.poses(q), poses_and_frames(robot.chain, q)[0]
    position = np.linalg.norm(found[:, :3, 3] - expected[:, :3, 3], axis=1)
    turned = np.swapaxes(expected[:, :3, :3], 1, 2) @ found[:, :3, :3]
    rotation = np.linalg.norm(rotation_vector(turned), axis=1)
    return Certificate(len(q), float(position.max()), float(rotation.max()))
