"""
Sample the set of singular poses of an arm: random poses, projected by Newton's method.

The samples are starts of a search: they keep it from depending on the branch of the set that is
nearest by first order.
"""

import math

import numpy as np

from ..forward.chain import Chain
from ..layout import arrays, places
from ..layout.arrays import Flat, FlatIntegers, Floats
from ..measures.task_rows import TaskRows
from .projection import Projection

# Random poses: the mean distance between samples is then about 0.7 rad for six joints.
SEEDS = 3000
# Few joints need fewer random poses: k joints that matter get SEEDS_PER_JOINT ** k, SEEDS at most.
SEEDS_PER_JOINT = 10
# Random poses of an arm with closed loops, whose evaluation takes 20 times as long.
SEEDS_OF_LOOPS = 300
SEED = 1


class SingularAtlas:
    """
    Singular poses from all over the ranges of the joints, frozen.

    Parameters
    ----------
    chain, task
        The arm.
    spans : shape (n, 3)
        Begin, reach and period of each joint, in rad, a prismatic joint divided by the length. A
        joint of reach 0 does not matter: it changes the rank of J_t nowhere.

    Attributes
    ----------
    count
        Number of poses; 0 for more than MAX_SEARCHED_JOINTS joints.
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
        """Return whether a joint changes the singular values."""
        return self.spans[3 * j + 1] > 0.0

    def nearest(self, u: Flat, max_count: int, picked: FlatIntegers, distances: Flat) -> int:
        """
        Fill in the samples nearest to u, the nearest first, and return their number.

        Parameters
        ----------
        u : shape (n,)
            Positions in rad.
        max_count
            How many at max_count.
        picked, distances : shape (max_count,)
            Filled with the samples, and their distances from u.
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
        """Fill the shortest motion d (n,) from u to a sample."""
        for j in range(self.n):
            d[j] = self._apart(arrays.after(self.poses, k * self.n), u, j)

    def _apart(self, pose: Flat, u: Flat, j: int) -> float:
        # Shortest motion of a joint.
        if not self.spans[3 * j + 1] > 0.0:
            return 0.0
        step, period = pose[j] - u[j], self.spans[3 * j + 2]
        if period < places.INFINITY:
            step -= period * math.floor(step / period + 0.5)
        return step


def _project(projection: Projection, task: TaskRows, poses: Floats) -> int:
    # Bring the poses onto the set, those that converge to the front; returns their number.
    n, count = projection.n, arrays.extent(poses, 0)
    table, converged = arrays.results(poses, 0), 0
    lock = arrays.let_go()
    for i in range(count):
        projection.equations.begin_assembled()
        for j in range(n):
            projection.origin[j] = task.column_scale[j] * table[i * n + j]
            projection.d[j] = 0.0
        if projection.run(places.INFINITY, 0, 0.0) < places.INFINITY:
            for j in range(n):
                table[converged * n + j] = table[i * n + j] + projection.d[j]
            converged += 1
    arrays.take_back(lock)
    return converged
