"""Singular poses of an arm: Newton's method on its distance, from seeded poses."""

import numpy as np

from ..kernel import Floats
from ..robot.robot import Robot
from ..robot.task import seeded_poses
from .singularity import singularity

# Number of seeded poses, and of steps: far away the distance is a first-order estimate, so each
# step about squares the error, and a pose that has not converged by then has met a limit.
STARTS = 200
STEPS = 25
# Longest step in rad (of the fastest joint; a prismatic one divided by the length).
LONGEST_STEP = 0.3
# A pose nearer than this is singular, in rad: far below what an encoder tells apart.
ARRIVED = 1e-6


def singular_poses(robot: Robot, inside: Floats) -> Floats:
    """
    Return singular poses (k, n) in rad or m, the same each time; k is 0 if none was found.
    Of an arm with closed loops none is looked for.

    Parameters
    ----------
    robot
        The arm; its task defines singular poses.
    inside : shape (n, 2), rad or m
        Limits the poses stay inside; infinite if there are none.
    """
    if robot.chain.loops:
        return np.empty((0, robot.dof))  # on the way a loop might not close
    q = seeded_poses(inside, robot.prismatic)[:STARTS]
    scale = np.where(robot.prismatic, robot.singularity.task.length, 1.0)
    for _ in range(STEPS):
        near = singularity(robot, q)
        # To the pose that was found; or back along the way out, where ln w grows fastest, as far
        # as by the first order w is zero.
        found = np.isfinite(near.nearest_singular)
        step = np.where(found, q - near.nearest_singular, near.distance[:, None] * near.way_out)
        fastest = np.max(np.abs(step) / scale, axis=1, keepdims=True)
        shorter = LONGEST_STEP / np.maximum(fastest, LONGEST_STEP)
        q = np.clip(q - shorter * step, inside[:, 0], inside[:, 1])
    distance = singularity(robot, q).distance
    return q[np.argsort(distance, kind='stable')][: int(np.sum(distance < ARRIVED))]
