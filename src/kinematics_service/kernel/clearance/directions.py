# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the singular values and singular vectors of the task Jacobian J_t, including its null
space.
"""

import math

from ..forward.chain import Chain
from ..layout import arrays
from ..layout.arrays import Flat
from ..measures import singular_values, singularity
from ..measures.task_rows import TaskRows


class Directions:
    """
    Joint positions q, the Jacobian at q, and the singular value decomposition of the task Jacobian
    J_t (m, n).

    J_t maps joint motions (n numbers) to tool motions (m numbers). It has two sets of singular
    vectors: n joint motions and m tool motions. In this package, the vectors of the larger set are
    called "lines", and the vectors of the smaller set "turns". If the arm is redundant (n > m),
    the lines are the joint motions and the turns are the tool motions. Otherwise the lines are the
    tool motions and the turns are the joint motions.

    Attributes
    ----------
    q, still : shape (n,)
        Joint positions, rad or m, and zero velocities.
    row
        The row of results of `evaluate` at q: pose, Jacobian, twist and screws.
    sigma
        The singular values of J_t in descending order.
    W
        The singular vectors of J_t, one row for each line. Row i begins with line i (`length`
        numbers). Each of the first min(m, n) rows then has turn i (min(m, n) numbers). In the
        other rows, the numbers after the line are not used.
    length
        max(m, n): the number of lines, and the number of components of a line.
    width
        Length of a row of W.
    count
        Number of lines that belong to the smallest singular value or to the null space.
    """

    def __init__(self, chain: Chain, task: TaskRows) -> None:
        self.chain, self.task = chain, task
        n, m = self.chain.dof, self.task.count
        self.turns: int = min(m, n)
        self.length: int = max(m, n)
        self.width = self.turns + self.length
        self.count = self.length - task.generic_rank + 1
        self.q, self.still, self.row = arrays.rooms(n, n, self.chain.frames_at)
        self.W, self.sigma = arrays.rooms(self.length * self.width, self.turns)
        arrays.fill(self.still, n, 0.0)

    def decompose(self) -> None:
        """Fill W and sigma with the singular vectors and singular values of the J_t in `row`."""
        singularity.write_directions(self.chain.dof, self.task, self.row, self.W, self.sigma)
        for i in range(self.turns, self.length):
            singular_values.write_orthogonal_row(self.W, i, self.length, self.width)


def length_of(v: Flat, count: int) -> float:
    """Return the Euclidean length of a vector v (count,)."""
    return math.sqrt(arrays.dot(v, v, count))
