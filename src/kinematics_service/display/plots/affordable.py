"""How many positions a picture of an arm with closed loops tries, so that nobody waits long."""

import math
import time

import numpy as np

from ...kinematics.singularity import singularity
from ...robot.loops import closes_at
from ...robot.robot import Robot
from ...robot.task import SEED
from .ranges import random_positions

# Seconds of a processor for all positions; of so many the time of one is measured.
BUDGET, MEASURED = 3.0, 200


def affordable(robot: Robot, most: int) -> int:
    """
    Return how many positions to try, at most `most`: all without closed loops.

    What does not close costs as much as many positions that do. One, two or five times a power of
    ten, which is most often the same the next time.
    """
    if not robot.chain.loops:
        return most
    q = random_positions(robot, np.random.default_rng(SEED), MEASURED)
    begin = time.process_time()
    singularity(robot, q[closes_at(robot.chain, q)])
    count = BUDGET * MEASURED / (time.process_time() - begin)
    power = 10.0 ** math.floor(math.log10(count))
    return min(most, int(power * max(share for share in (1, 2, 5) if share * power <= count)))
