"""The task: which rows of the Jacobian singularities are judged by, and how the arm moves them."""

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

# Poses the generic properties of an arm are found over, and the seed that makes them repeatable.
SEEDED_POSES = 1000
SEED = 20240523

# A row counts as moved when some pose moves it by more than this share of the largest entry of J
# among its kind, and of the arm's lengths; less than the second share of where the arm stands is
# round-off.
MOVED, ROUND_OFF = 1e-9, 1e-14

# A row that every joint moves by less than this share of the largest entry of J is moved because
# axes are not quite parallel: by 0.57 deg at most.
BARELY_MOVED = 0.01

# Poses at which joints are found that cancel, each pose in a way of its own.
CLEAREST = 20

# Poses that are looked at first for the rank: on nearly all arms one of them has all of it.
FIRST = 20


@dataclass(frozen=True, eq=False)
class Task(FrozenArrays):
    """
    The rows J_t of the Jacobian, in the axes of frame 0, and what is true of them at every pose.

    Attributes
    ----------
    rows
        Names of the rows, a part of x y z rx ry rz in that order.
    length
        Characteristic length in m: angular rows and prismatic columns are multiplied by it.
    generic_rank
        Rank of J_t at random poses.
    dependent_joints
        Names of joints whose motions cancel at every pose: always the same motions (of joints that
        share an axis, for example), or, where J_t has full rank at no pose, others at each (of
        four parallel axes). Empty for most arms.
    reach
        Largest distance from frame 0 to the tool over the seeded poses, in m.
    axes : shape (m,)
        Which row of the Jacobian each row is, 0 to 5.
    rotation : shape (3, 3)
        Of frame 0 in the base frame.
    row_scales : shape (m,), column_scales : shape (n,)
        What a unit of each row, in m, and of each joint, in rad, counts: the length for angular
        rows and for prismatic joints.
    plain_rows
        The default rows if rows that are barely moved did not count: as `rows`, for most arms.
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
        """Return the rows as the kernel reads them."""
        scales = self.row_scales, self.column_scales
        zero = kernel.RANK_TOLERANCE * self.length
        return TaskRows(self.generic_rank, self.axes, self.rotation, *scales, zero)

    @property
    def square(self) -> bool:
        """Return whether J_t is square, so that it has a determinant."""
        return len(self.rows) == len(self.column_scales)

    @property
    def barely_moved(self) -> str:
        """Return in a sentence which rows count by a tilt of axes alone; empty if none does."""
        if self.plain_rows == self.rows:
            return ''
        tilted = ' '.join(name for name in self.rows if name not in self.plain_rows)
        plain, rows = (', '.join(names) for names in (self.plain_rows, self.rows))
        return (
            f'joints move the rows {tilted} by less than {BARELY_MOVED:.0%} of the others, yet '
            'they count: if axes are parallel, write their angles exactly; else write '
            f'task: [{plain}], or task: [{rows}] if these are meant'
        )

    @property
    def structurally_deficient(self) -> bool:
        """Return whether J_t has full rank at no pose at all."""
        return self.generic_rank < min(len(self.rows), len(self.column_scales))


def seeded_poses(limits: Floats, prismatic: Iterable[bool]) -> Floats:
    """
    Return the same random joint positions inside the limits each time.

    Parameters
    ----------
    limits : shape (n, 2), rad or m
        Infinite where there is none: an unlimited revolute joint samples a full turn, an unlimited
        prismatic one 0 to 1 m.
    prismatic : n
        Whether a joint slides.

    Returns
    -------
    shape (SEEDED_POSES, n), rad or m
    """
    low, high = np.array(limits[:, 0]), np.array(limits[:, 1])
    for j, slides in enumerate(prismatic):
        span = 1.0 if slides else 2 * math.pi
        if math.isinf(low[j]) and math.isinf(high[j]):
            low[j] = 0.0 if slides else -math.pi
        elif math.isinf(low[j]):
            low[j] = high[j] - span
        if math.isinf(high[j]):
            high[j] = low[j] + span
    random = np.random.default_rng(SEED)
    return random.uniform(low, high, (SEEDED_POSES, len(low)))


def generic_poses(chain: Chain, limits: Floats, prismatic: Iterable[bool]) -> Floats:
    """Return those of the seeded poses (N, n), and others like them, at which loops close."""
    return closed_poses(chain, seeded_poses(limits, prismatic))


def _rank(J: Floats) -> int:
    # The rank most poses have: the largest over all of them, which a few show for most arms.
    rank = 0
    for some in (J[:FIRST], J[FIRST:]):
        sigma = np.linalg.svd(some, compute_uv=False)
        above = np.sum(sigma > kernel.RANK_TOLERANCE * sigma[:, :1], axis=1)
        rank = max(rank, int(np.max(above, initial=0)))
        if rank == min(J.shape[1:]):
            break
    return rank


def least_motion(chain: Chain) -> float:
    """Return the length, in m, below which a way of the tool is round-off or next to none."""
    # Against the lengths that joints move, and those before them.
    table = chain.table
    steps = np.linalg.norm(table.before[:, :, 3], axis=1)
    moved = float(np.sum(steps[1:]) + np.sum(np.abs(table.d_0[1:])))
    still = float(steps[0] + np.sum(np.abs(table.d_0[:1])))
    return max(MOVED * moved, ROUND_OFF * still)


def _moved(J: Floats, least: float, share: float = MOVED) -> list[bool]:
    # Which rows of J some pose moves; `least` is none of a linear one.
    largest = np.max(np.abs(J), axis=(0, 2))
    linear, angular = np.max(largest[:3]), np.max(largest[3:])
    none = [max(share * linear, least)] * 3 + [share * angular] * 3
    return [bool(size > limit) for size, limit in zip(largest, none)]


def _default_rows(J: Floats, moved: Sequence[bool]) -> tuple[str, ...]:
    n = J.shape[2]
    names = tuple(name for name, moves in zip(ROW_NAMES, moved) if moves)
    linear = tuple(name for name in names if name in ROW_NAMES[:3])
    angular = tuple(name for name in names if name in ROW_NAMES[3:])
    if n >= 6:
        return names
    # Of the rows that are moved: what is left of the others is round-off, which has any rank.
    for some in (linear, angular):
        if some and _rank(J[:, [ROW_NAMES.index(name) for name in some]]) >= n:
            return some
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
    Return the task of an arm, over poses inside its limits.

    Parameters
    ----------
    chain
        The arm.
    joint_names, prismatic
        As `robot.Robot` has them.
    q : shape (N, n), rad or m
        Its `generic_poses`.
    rows
        Rows asked for; without them the linear ones where they have generic rank n or more (for
        six joints and more: all six), else the angular ones, else all that move.
    length
        Characteristic length in m; without it the RMS distance of the tool from frame 0.

    Raises
    ------
    KinematicsError
        No joint moves the tool, or none moves the rows asked for.
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
            length = 1.0  # the tool never leaves frame 0: nothing to compare, so unit scale
    column_scales = np.array([length if slides else 1.0 for slides in prismatic])
    # Scaled as the kernel scales it, so that ranks do not depend on the size of the arm.
    J = J * np.repeat([1.0, length], 3)[:, None] * column_scales
    moved = _moved(J, least)
    plain_rows = rows or _default_rows(J, _moved(J, least, BARELY_MOVED))
    rows = rows or _default_rows(J, moved)
    indices = [ROW_NAMES.index(name) for name in rows]
    if not any(moved[i] for i in indices):
        asked = ' '.join(rows) or 'tool'
        raise KinematicsError(f'no joint moves the tool (task {asked}): nothing to judge')

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
    # Joint motions that move the tool at no pose are the null space of all J_t on top of another.
    m, n = J_t.shape[1:]
    _, sigma, right = np.linalg.svd(J_t.reshape(-1, n), full_matrices=False)
    idle = right[sigma <= kernel.RANK_TOLERANCE * sigma[0]]
    if len(idle) < n - rank and n <= m:
        # At each pose others cancel, too: seen best where the rest are farthest from it.
        _, sigma, right = np.linalg.svd(J_t)
        clearest = np.argsort(sigma[:, rank - 1])[-CLEAREST:]
        idle = right[clearest, rank:].reshape(-1, n)
    return tuple(name for j, name in enumerate(joint_names) if np.any(np.abs(idle[:, j]) > 1e-6))
