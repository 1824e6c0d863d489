# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute samples of the singular poses of an arm: project random joint positions by Newton's method.

The search for the nearest singular pose starts from first-order estimates and from some of these
samples. The estimates alone may lead to a branch of singular poses that is not the nearest.
"""

import math

import numpy as np

from ..forward.chain import Chain
from ..layout import arrays, places
from ..layout.arrays import Flat, FlatIntegers, Floats
from ..measures.task_rows import TaskRows
from .projection import Projection

# Largest number of random joint positions from which the samples are computed. For six joints the
# mean distance between samples is then about 0.7 rad.
SEEDS = 3000
# If k joints change the rank of the task Jacobian, the samples are computed from
# SEEDS_PER_JOINT ** k random joint positions, but at most from SEEDS.
SEEDS_PER_JOINT = 10
# Largest number of random joint positions from which the samples are computed, if the arm has
# closed loops. The number is small, because an evaluation of the arm takes 20 times as long as
# without loops.
SEEDS_OF_LOOPS = 300
SEED = 1


class SingularAtlas:
    """
    Samples of the singular poses of an arm, over the whole ranges of its joints; immutable.

    Parameters
    ----------
    chain, task
        The arm.
    spans : shape (n, 3)
        First position, length and period of the range of each joint, rad; prismatic joints are
        divided by the characteristic length. The length 0 marks a joint that never changes the
        rank of the task Jacobian J_t.

    Attributes
    ----------
    count
        Number of samples; 0 if there are more than MAX_SEARCHED_JOINTS joints.
    """

    def __init__(self, chain: Chain, task: TaskRows, spans: Floats) -> None:
        n = chain.dof
        self.n = n
        seeds = min(SEEDS, SEEDS_PER_JOINT ** int(np.sum(spans[:, 1] > 0.0)))
        if chain.loops > 0:
            seeds = min(SEEDS_OF_LOOPS, seeds)
        if n > places.MAX_SEARCHED_JOINTS:
            seeds = 0
        random = np.random.default_rng(SEED)
        poses = spans[:, 0] + spans[:, 1] * random.random((seeds, n))
        projection = Projection(chain, task, spans)
        self.count = _project(projection, task, poses)
        self.poses = arrays.numbers(poses, self.count * n)
        kept = np.ascontiguousarray(spans)
        self.spans = arrays.numbers(kept, 3 * n)

    def matters(self, j: int) -> bool:
        """
        Return whether joint j can change the rank of the task Jacobian.

        The task Jacobian J_t has the rows of the Jacobian that the task uses.
        """
        return self.spans[3 * j + 1] > 0.0

    def nearest(self, u: Flat, max_count: int, picked: FlatIntegers, distances: Flat) -> int:
        """
        Fill `picked` with the samples nearest to joint positions u, nearest first; return their
        number.

        Parameters
        ----------
        u : shape (n,)
            Joint positions, rad; prismatic joints are divided by the characteristic length.
        max_count
            Largest number of samples.
        picked, distances : shape (max_count,)
            Filled with the indices of the samples, and their distances from u, rad.
        """
        count = 0
        for k in range(self.count):
            pose, squares = arrays.after(self.poses, k * self.n), 0.0
            limit = distances[max_count - 1] if count == max_count else places.INFINITY
            for j in range(self.n):
                step = self._apart(pose, u, j)
                squares += step * step
            length = math.sqrt(squares)
            if not length < limit:
                continue
            count = min(count + 1, max_count)
            i = count - 1
            while i > 0 and distances[i - 1] > length:
                distances[i], picked[i] = distances[i - 1], picked[i - 1]
                i -= 1
            distances[i], picked[i] = length, k
        return count

    def write_motion(self, u: Flat, k: int, d: Flat) -> None:
        """Fill d (n,), rad, with the shortest motion from joint positions u to sample k."""
        for j in range(self.n):
            d[j] = self._apart(arrays.after(self.poses, k * self.n), u, j)

    def _apart(self, pose: Flat, u: Flat, j: int) -> float:
        # Returns the shortest motion of joint j from u to `pose`, rad.
        if not self.spans[3 * j + 1] > 0.0:
            return 0.0
        step, period = pose[j] - u[j], self.spans[3 * j + 2]
        if period < places.INFINITY:
            step -= period * math.floor(step / period + 0.5)
        return step


def _project(projection: Projection, task: TaskRows, poses: Floats) -> int:
    # Projects each row of `poses` (joint positions) onto the set of singular poses, in place.
    # Moves the rows that converge to the front, and returns their number.
    n, count = projection.n, arrays.extent(poses, 0)
    table, converged = arrays.results(poses, 0), 0
    with arrays.without_lock():
        for i in range(count):
            projection.equations.begin_assembled()
            for j in range(n):
                projection.origin[j] = task.column_scale[j] * table[i * n + j]
                projection.d[j] = 0.0
            if projection.run(places.INFINITY, 0, 0.0) < places.INFINITY:
                for j in range(n):
                    table[converged * n + j] = table[i * n + j] + projection.d[j]
                converged += 1
    return converged
