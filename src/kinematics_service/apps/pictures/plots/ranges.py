"""
Where each joint is looked at: finite ranges, and a pose to start from that is worth looking at.
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

# What a sliding joint without an end is looked at over, m.
SLIDES = 1.0
# Number of poses from which a clear pose is chosen. Farther than this from a singular one (rad) is
# far enough; taken off are so much of it per rad from the middle, and all that hangs below the
# base.
CANDIDATES, FAR, TIDINESS = 4000, 0.9, 0.06
# The same with closed loops: a search takes 20 times as long.
CANDIDATES_OF_LOOPS = 400
# Poses that are searched from before it is seen whether another can be better.
AT_ONCE = 128


def finite_ranges(robot: Robot, whole: bool = False) -> Floats:
    """
    Return where each joint is looked at, shape (n, 2), rad or m.

    Its limits; a full turn of one that turns farther, unless these are wanted whole; and a turn or
    1 m of one without an end.
    """
    low, high = robot.limits.T
    length = np.where(robot.prismatic, SLIDES, 2.0 * math.pi)
    start = np.clip(np.where(robot.prismatic, 0.0, -math.pi), low, high - length)
    bounded = np.isfinite(high - low) & (robot.prismatic | whole | (high - low <= length))
    return np.where(bounded[:, None], robot.limits, np.stack([start, start + length], axis=1))


def random_positions(robot: Robot, random: np.random.Generator, count: int) -> Floats:
    """
    Return joint positions spread evenly over the finite ranges, shape (count, n), rad or m.

    Loops need not close there.
    """
    low, high = finite_ranges(robot).T
    return np.asarray(low + (high - low) * random.uniform(size=(count, robot.dof)))


@lru_cache(maxsize=8)
def clear_pose(robot: Robot) -> Floats:
    """
    Return joint positions worth looking at, shape (n,): far from singular, bent, above the base.

    The same each time, and inside the limits; rounded to 0.1 where there is room. Read only.
    """
    ranges = finite_ranges(robot)
    # A tenth of the range stays free at either end, and no joint bends by more than two thirds of
    # a half turn: an arm that looks like one.
    count = CANDIDATES_OF_LOOPS if robot.chain.loops else CANDIDATES
    middle, half = ranges.mean(axis=1), 0.4 * np.ptp(ranges, axis=1)
    q = middle + np.minimum(half, 2.0 * math.pi / 3.0) * np.random.default_rng(SEED).uniform(
        -1.0, 1.0, (count, robot.dof)
    )
    rounded = np.round(q, 1)
    inside = np.all((rounded >= ranges[:, 0]) & (rounded <= ranges[:, 1]), axis=1)
    q = closed_poses(robot.chain, np.where(inside[:, None], rounded, q))
    within = np.all((q >= ranges[:, 0]) & (q <= ranges[:, 1]), axis=1)
    q = q[within] if np.any(within) else q
    bent = np.sum(np.abs(q - middle) * ~robot.prismatic, axis=1)
    lowest = np.min(evaluate(robot, q, depth=kernel.ALL_FRAMES).link_frames[..., 2, 3], axis=-1)
    hangs = np.maximum(-lowest, 0.0) / robot.singularity.task.reach
    # What each is worth at most: the search for the singular pose nearest to it takes the time.
    worth = FAR - TIDINESS * bent - hangs
    order, best = np.argsort(-worth, kind='stable'), -math.inf
    for some in np.split(order, range(AT_ONCE, len(q), AT_ONCE)):
        if worth[some[0]] < best:
            worth[some] = -math.inf
            continue
        distance = singularity(robot, q[some]).distance
        worth[some] = np.minimum(distance, FAR) - TIDINESS * bent[some] - hangs[some]
        best = max(best, np.max(worth[some]))
    found: Floats = q[int(np.argmax(worth))] + 0.0  # no negative zero
    found.setflags(write=False)
    return found


def not_all_closed(names: Sequence[str]) -> str:
    """Return that the loops of groups do not close, in words: `loop a does not close`."""
    words = all_in_words(names)
    return f'{words} do not all close' if ' and ' in words else f'{words} does not close'
