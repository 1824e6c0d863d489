# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Choose a finite range of each joint for pictures. Find, by random search, a configuration that is
easy to see.
"""

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from .... import kernel
from ....kernel import Floats
from ....kinematics.singularity import singularity
from ....kinematics.tool_state import evaluate
from ....robot.closed_poses import closed_poses
from ....robot.file.parts.loop_groups import all_in_words
from ....robot.robot import Robot
from ....robot.task import SEED

# Length of the range of a prismatic joint without limits, m.
SLIDING_RANGE = 1.0
# Number of random configurations from which `clear_pose` chooses.
CANDIDATES = 4000
# Number of random configurations from which `clear_pose` chooses for an arm with closed loops. It
# is small, because computing a distance to singularity takes 20 times as long with closed loops.
CANDIDATES_OF_LOOPS = 400
# `clear_pose` takes the configuration with the largest score: its distance to singularity minus
# penalties. Distances above this value (rad) count as this value.
MAX_DISTANCE = 0.9
# Penalty of bent joints in `clear_pose`: each radian between a joint angle and the middle of the
# joint's range reduces the score of a configuration by this value (rad).
BEND_WEIGHT = 0.06
# Number of configurations whose distances to singularity are computed in one call.
BATCH_SIZE = 128


def finite_ranges(robot: Robot, whole: bool = False) -> Floats:
    """
    Return a finite range of each joint, shape (n, 2), rad or m.

    The range lies between the limits; for a revolute joint it is at most a full turn unless
    `whole` is True. If a limit is infinite, the range is -pi to pi (revolute), or 0 to 1 m
    (prismatic), shifted if a limit would cut it.
    """
    low, high = robot.limits.T
    length = np.where(robot.prismatic, SLIDING_RANGE, 2.0 * math.pi)
    start = np.clip(np.where(robot.prismatic, 0.0, -math.pi), low, high - length)
    bounded = np.isfinite(high - low) & (robot.prismatic | whole | (high - low <= length))
    return np.where(bounded[:, None], robot.limits, np.stack([start, start + length], axis=1))


def random_positions(robot: Robot, random: np.random.Generator, count: int) -> Floats:
    """
    Return uniformly distributed joint positions in `finite_ranges`, shape (count, n), rad or m.

    Closed loops need not close at these positions.
    """
    low, high = finite_ranges(robot).T
    return np.asarray(low + (high - low) * random.uniform(size=(count, robot.dof)))


@lru_cache(maxsize=8)
def clear_pose(robot: Robot) -> Floats:
    """
    Return a configuration (n,) for pictures: far from singular, little bent, above the base.

    The configuration is inside the limits. Its numbers are rounded to 0.1 if the limits allow it.
    The array is read only. Every call returns the same configuration for an arm.
    """
    ranges = finite_ranges(robot)
    # Draw random positions in the middle 80 % of each range, at most 2 pi / 3 from the middle.
    count = CANDIDATES_OF_LOOPS if robot.chain.loops else CANDIDATES
    middle, half = ranges.mean(axis=1), 0.4 * np.ptp(ranges, axis=1)
    random = np.random.default_rng(SEED).uniform(-1.0, 1.0, (count, robot.dof))
    q = middle + np.minimum(half, 2.0 * math.pi / 3.0) * random
    rounded = np.round(q, 1)
    inside = np.all((rounded >= ranges[:, 0]) & (rounded <= ranges[:, 1]), axis=1)
    q = closed_poses(robot.chain, np.where(inside[:, None], rounded, q))
    within = np.all((q >= ranges[:, 0]) & (q <= ranges[:, 1]), axis=1)
    q = q[within] if np.any(within) else q
    bent = np.sum(np.abs(q - middle) * ~robot.prismatic, axis=1)
    lowest = np.min(evaluate(robot, q, depth=kernel.ALL_FRAMES).link_frames[..., 2, 3], axis=-1)
    hangs = np.maximum(-lowest, 0.0) / robot.singularity.task.reach
    # First, `score` has upper bounds of the scores, with MAX_DISTANCE as the distance to
    # singularity. The true distances take most of the time. So skip a batch if the largest bound
    # in it is below the best score so far.
    score = MAX_DISTANCE - BEND_WEIGHT * bent - hangs
    order, best = np.argsort(-score, kind='stable'), -math.inf
    for batch in np.split(order, range(BATCH_SIZE, len(q), BATCH_SIZE)):
        if score[batch[0]] < best:
            score[batch] = -math.inf
            continue
        distance = singularity(robot, q[batch]).distance
        score[batch] = (
            np.minimum(distance, MAX_DISTANCE) - BEND_WEIGHT * bent[batch] - hangs[batch]
        )
        best = max(best, np.max(score[batch]))
    result: Floats = q[int(np.argmax(score))] + 0.0  # turns -0.0 into 0.0
    result.setflags(write=False)
    return result


def not_all_closed(names: Sequence[str]) -> str:
    """Return a sentence that the named loops do not close, such as `loop a does not close`."""
    words = all_in_words(names)
    return f'{words} do not all close' if ' and ' in words else f'{words} does not close'
