"""
Singular poses of an arm: Newton's method on its distance, from seeded poses.

"""

from typing import NamedTuple

import numpy as np

from .kernel import Floats
from .robot import Robot
from .singularity import singularity
from .task import seeded_poses

# So many seeded poses are let go, and so often; the distance is a first-order estimate, so each
# step about squares the error, and what has not arrived by then has met a limit.
STARTS = 200
STEPS = 25
# Longest step in rad (of the fastest joint, prismatic ones divided by the length).
LONGEST_STEP = 0.3
# A pose nearer than this is singular, in rad: far below what a sensor tells apart.
ARRIVED = 1e-6


class NearestPoses(NamedTuple):
    """
    Poses as near to a singular one as the limits allow, the nearest first.

    Attributes
    ----------
    q : shape (STARTS, n), rad or m
        Joint positions inside the limits.
    distance : shape (STARTS,)
        What is left to the singular pose, rad.

    """

    q: Floats
    distance: Floats

    @property
    def singular(self) -> Floats:
        """
        Return the poses that are singular, shape (k, n): none where the limits keep them out.

        """
        return self.q[self.distance < ARRIVED]


def nearest_poses(robot: Robot, inside: Floats) -> NearestPoses:
    """
    Return where seeded poses end when they walk towards the nearest singular pose.

    Parameters
    ----------
    robot
        The arm; its task says what is singular.
    inside : shape (n, 2), rad or m
        Limits the poses stay inside; infinite where there are none.

    """
    slides = [kind == 'prismatic' for kind in robot.joint_types]
    q = seeded_poses(inside, slides)[:STARTS]
    scale = np.where(slides, robot.task.length, 1.0)
    for _ in range(STEPS):
        near = singularity(robot, q)
        # The way out is the direction in which ln w grows fastest: back along it, as far as the
        # first order says that w is zero.
        step = near.distance[:, None] * near.way_out
        fastest = np.max(np.abs(step) / scale, axis=1, keepdims=True)
        shorter = LONGEST_STEP / np.maximum(fastest, LONGEST_STEP)
        q = np.clip(q - shorter * step, inside[:, 0], inside[:, 1])
    distance = singularity(robot, q).distance
    order = np.argsort(distance, kind='stable')
    return NearestPoses(q[order], distance[order])
