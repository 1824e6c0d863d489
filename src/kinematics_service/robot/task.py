# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Choose the task: the rows of the Jacobian that decide whether a pose is singular."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .. import kernel
from ..errors import KinematicsError
from ..kernel import Chain, Floats, Integers, TaskRows
from .chain import FrozenArrays, poses_and_jacobians
from .closed_poses import closed_poses

ROW_NAMES = ('x', 'y', 'z', 'rx', 'ry', 'rz')
TWIST_ROWS = ('vx', 'vy', 'vz', 'wx', 'wy', 'wz')

# Number of random joint positions from which generic properties of an arm, such as the rank of J,
# are computed.
SEEDED_POSES = 1000
SEED = 20240523

# If no joint moves the tool along (or about) the axis of a row of J, the row contains only
# round-off. In an angular row, an entry counts as round-off if it is at most this fraction of the
# largest entry of the three angular rows. In a linear row, an entry counts as round-off if it is
# at most this fraction of the largest entry of the three linear rows, or at most `least_motion`
# (m).
MOVED_ROW_RATIO = 1e-9
# Round-off of the tool's position, relative to the sum of the constant lengths before the first
# joint.
ROUND_OFF_RATIO = 1e-14

# A row of J can be 0 for parallel joint axes, and small for nearly parallel axes. A linear row is
# taken as small if all entries of the row are below this fraction of the largest entry of the
# three linear rows. For an angular row, the largest entry is that of the three angular rows. If
# the angle between the axes is x rad, small entries are about x times the largest entry. So the
# value stands for 0.01 rad, or 0.57 deg.
TILT_RATIO = 0.01

# Number of joint configurations at which the rank of J is computed first. Nearly all arms have
# full rank at one of these configurations. Then the rank at the other configurations is not
# needed.
FIRST_POSES = 20

# If the null space of J_t depends on q, the search for `dependent_joints` uses the null spaces at
# this number of joint configurations.
CLEAREST_POSES = 20


@dataclass(frozen=True, eq=False)
class Task(FrozenArrays):
    """
    The m rows of the Jacobian (J_t) whose rank decides whether a pose is singular, and properties
    of J_t at generic q.

    Attributes
    ----------
    rows
        Names of the rows in the axes of frame 0: some of x y z rx ry rz, in that order.
    length
        Characteristic length, m. The angular rows and the prismatic columns of J_t are multiplied
        by it.
    generic_rank
        Rank of J_t at random joint positions.
    dependent_joints
        Names of joints that can move at every configuration while the tool rests; empty for most
        arms. If joints share an axis, the ratios of the joint velocities in such a motion are
        constant. If J_t never has full rank (four parallel axes), the ratios depend on q.
    reach
        Largest distance from frame 0 to the tool over random joint positions, in m.
    axes : shape (m,)
        The index of each row of J_t in the whole Jacobian, 0 to 5.
    rotation : shape (3, 3)
        The rotation of frame 0 in the base frame.
    row_scales : shape (m,), column_scales : shape (n,)
        Scale factors of the rows and columns of J_t: `length` for angular rows and prismatic
        joints, 1 for the others.
    plain_rows
        `rows` without those rows of J_t that would be 0 if nearly parallel axes were exactly
        parallel. For most arms, `plain_rows` is equal to `rows`.
    """

    rows: tuple[str, ...]
    length: float
    generic_rank: int
    dependent_joints: tuple[str, ...]
    reach: float
    axes: Integers
    rotation: Floats
    row_scales: Floats
    column_scales: Floats
    plain_rows: tuple[str, ...] = ()

    @cached_property
    def kernel_rows(self) -> TaskRows:
        """Return the task as an object of the kernel."""
        scales = self.row_scales, self.column_scales
        zero = kernel.RANK_TOLERANCE * self.length
        return TaskRows(self.generic_rank, self.axes, self.rotation, *scales, zero)

    @property
    def square(self) -> bool:
        """Return whether J_t is square, so that it has a determinant."""
        return len(self.rows) == len(self.column_scales)

    @property
    def barely_moved(self) -> str:
        """
        Return a warning if a row of J_t is small because joint axes are nearly parallel; else ''.

        If the axes were exactly parallel, the row would be zero.
        """
        if self.plain_rows == self.rows:
            return ''
        tilted = ' '.join(name for name in self.rows if name not in self.plain_rows)
        plain, rows = (', '.join(names) for names in (self.plain_rows, self.rows))
        return (
            f'joints move the rows {tilted} by less than {TILT_RATIO:.0%} of the others, yet '
            'they count: if axes are parallel, write their angles exactly; else write '
            f'task: [{plain}], or task: [{rows}] if these are meant'
        )

    @property
    def structurally_deficient(self) -> bool:
        """Return whether J_t has less than full rank at every configuration."""
        return self.generic_rank < min(len(self.rows), len(self.column_scales))


def seeded_poses(limits: Floats, prismatic: Iterable[bool]) -> Floats:
    """
    Return random joint positions inside the limits. The seed is fixed, so every call with equal
    limits returns the same positions.

    Parameters
    ----------
    limits : shape (n, 2), rad or m
        Limits, infinite for no limit. The range of a joint without limits is a full turn, or 0 to
        1 m if the joint is prismatic.
    prismatic : n
        Whether each joint slides.

    Returns
    -------
    shape (SEEDED_POSES, n), rad or m
    """
    low, high = limits.T
    slides = np.array([*prismatic], dtype=bool)
    span, begin = np.where(slides, 1.0, 2 * math.pi), np.where(slides, 0.0, -math.pi)
    low = np.where(np.isfinite(low), low, np.where(np.isfinite(high), high - span, begin))
    high = np.where(np.isfinite(high), high, low + span)
    random = np.random.default_rng(SEED)
    return random.uniform(low, high, (SEEDED_POSES, len(low)))


def generic_poses(chain: Chain, limits: Floats, prismatic: Iterable[bool]) -> Floats:
    """
    Return random joint positions, (N, n), rad or m, at which the closed loops of a chain close.
    """
    return closed_poses(chain, seeded_poses(limits, prismatic))


def _rank(J: Floats) -> int:
    # Return the largest rank of J, shape (N, m, n), over N joint configurations. If J has full
    # rank at one of the first FIRST_POSES configurations, do not compute its rank at the other
    # configurations.
    rank = 0
    for batch in (J[:FIRST_POSES], J[FIRST_POSES:]):
        sigma = np.linalg.svd(batch, compute_uv=False)
        above = np.sum(sigma > kernel.RANK_TOLERANCE * sigma[:, :1], axis=1)
        rank = max(rank, int(np.max(above, initial=0)))
        if rank == min(J.shape[1:]):
            break
    return rank


def least_motion(chain: Chain) -> float:
    """Return the length, m, below which a linear entry of J counts as zero."""
    # The result is the larger of two lengths: MOVED_ROW_RATIO times the sum of the arm's constant
    # lengths after the first joint, and the round-off of the constant lengths before the first
    # joint.
    table = chain.table
    steps = np.linalg.norm(table.before[:, :, 3], axis=1)
    moved = float(np.sum(steps[1:]) + np.sum(np.abs(table.d_0[1:])))
    still = float(steps[0] + np.sum(np.abs(table.d_0[:1])))
    return max(MOVED_ROW_RATIO * moved, ROUND_OFF_RATIO * still)


def _moved(J: Floats, least: float, ratio: float = MOVED_ROW_RATIO) -> list[bool]:
    # Return, for each of the six rows of J, (N, 6, n), whether a joint moves the tool along (or
    # about) the axis of the row. The answer is yes if an entry of the row exceeds `ratio` times
    # the largest entry of all linear rows (or of all angular rows). An entry of a linear row must
    # also exceed `least`, m.
    largest = np.max(np.abs(J), axis=(0, 2))
    linear, angular = np.max(largest[:3]), np.max(largest[3:])
    limits = [max(ratio * linear, least)] * 3 + [ratio * angular] * 3
    return [bool(size > limit) for size, limit in zip(largest, limits)]


def _default_rows(J: Floats, moved: Sequence[bool]) -> tuple[str, ...]:
    n = J.shape[2]
    names = tuple(name for name, moves in zip(ROW_NAMES, moved) if moves)
    # Leave out rows that contain only round-off: no joint moves the tool along (or about) the axis
    # of such a row.
    for half in (ROW_NAMES[:3], ROW_NAMES[3:]) if n < 6 else ():
        kind = tuple(name for name in names if name in half)
        if kind and _rank(J[:, [ROW_NAMES.index(name) for name in kind]]) >= n:
            return kind
    return names


def find_task(
    chain: Chain,
    joint_names: Sequence[str],
    q: Floats,
    prismatic: Iterable[bool],
    rows: tuple[str, ...] | None = None,
    length: float | None = None,
) -> Task:
    """
    Return the task of an arm: its rows, its length, and its properties at the joint positions q.

    Parameters
    ----------
    chain
        The arm.
    joint_names, prismatic
        Names of the joints, and whether each joint slides, as in `robot.Robot`.
    q : shape (N, n), rad or m
        Random joint positions of the arm, as `generic_poses` returns them.
    rows
        Names of the rows. Default for n < 6 joints: the linear rows if their generic rank is at
        least n, else the angular rows if their generic rank is at least n, else all rows. Default
        for six joints or more: all rows. Rows that are zero at every q are left out.
    length
        Characteristic length in m; default: the RMS distance of the tool from frame 0.

    Raises
    ------
    KinematicsError
        No joint moves the tool, or the given rows are zero at every q.
    """
    T, J = poses_and_jacobians(chain, q)
    frame_0 = chain.table.frame_offset[0]
    rotation = frame_0[:, :3].copy()
    J = np.concatenate([rotation.T @ J[:, :3], rotation.T @ J[:, 3:]], axis=1)
    distances = np.linalg.norm(T[:, :3, 3] - frame_0[:, 3], axis=1)
    least = least_motion(chain)
    if length is None:
        length = float(np.sqrt(np.mean(distances**2)))
        if length <= least:
            length = 1.0  # the tool never leaves the origin of frame 0
    column_scales = np.array([length if slides else 1.0 for slides in prismatic])
    # Scale J as the kernel does, so that ranks do not depend on the size of the arm.
    J = J * np.repeat([1.0, length], 3)[:, None] * column_scales
    moved = _moved(J, least)
    plain_rows = rows or _default_rows(J, _moved(J, least, TILT_RATIO))
    rows = rows or _default_rows(J, moved)
    indices = [ROW_NAMES.index(name) for name in rows]
    if not any(moved[i] for i in indices):
        task_name = ' '.join(rows) or 'tool'
        message = f'no joint moves the tool (task {task_name}): nothing to judge'
        raise KinematicsError(message, code='no-effect')

    row_scales = np.array([length if i >= 3 else 1.0 for i in indices])
    J_t = J[:, indices]
    generic_rank = _rank(J_t)
    return Task(
        rows=rows,
        length=length,
        generic_rank=generic_rank,
        dependent_joints=_dependent_joints(J_t, joint_names, generic_rank),
        reach=float(np.max(distances)),
        axes=np.array(indices, dtype=np.int64),
        rotation=rotation,
        row_scales=row_scales,
        column_scales=column_scales,
        plain_rows=plain_rows,
    )


def _dependent_joints(J_t: Floats, joint_names: Sequence[str], rank: int) -> tuple[str, ...]:
    # Stack the matrices J_t of all joint configurations into one matrix. Its null space has the
    # joint velocities that never move the tool.
    m, n = J_t.shape[1:]
    _, sigma, right = np.linalg.svd(J_t.reshape(-1, n), full_matrices=False)
    idle = right[sigma <= kernel.RANK_TOLERANCE * sigma[0]]
    if len(idle) < n - rank and n <= m:
        # J_t has more null directions than `idle`, which has only null directions that are the
        # same at every q. Replace `idle` by all null directions at some configurations. Choose the
        # configurations where the smallest nonzero singular value is largest, because null
        # directions are most accurate there.
        _, sigma, right = np.linalg.svd(J_t)
        clearest = np.argsort(sigma[:, rank - 1])[-CLEAREST_POSES:]
        idle = right[clearest, rank:].reshape(-1, n)
    return tuple(name for j, name in enumerate(joint_names) if np.any(np.abs(idle[:, j]) > 1e-6))
