"""
The reachable workspace in a plane: the points the tool reaches, and how far from singular it can
be there.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from ....errors import PlotError
from ....kernel import Floats, Integers
from ....kinematics.singularity import singularity_of
from ....kinematics.tool_state import evaluate
from ....robot.closed_poses import closes_at
from ....robot.robot import Robot
from ....robot.task import SEED
from .batches import map_batches
from .plane import Plane
from .ranges import finite_ranges, not_all_closed, random_positions

# Cells along the longest side.
CELLS = 100
# A workspace less wide than this share of the reach is a point.
SMALL = 1e-6
# Steps that bring a pose into the plane, and the tolerance (share of the reach).
STEPS, IN_PLANE = 8, 1e-9
# Rounds that change poses found so far, and the change: shares of the joints' ranges, from to.
ROUNDS, SHARE = 24, 2  # number of poses in all rounds, as a multiple of the first poses
SMALLEST, LARGEST = -3.0, -0.7  # powers of ten


@dataclass(frozen=True, eq=False)
class Workspace:
    """
    The cells of a plane that the tool reached.

    Attributes
    ----------
    plane
        The plane of the section.
    size
        Edge of a cell, m.
    corner : shape (2,), m
        Lower left corner of `best`.
    best : shape (rows, columns), rad
        The largest distance to singularity found with the tool in each cell; nan outside.
    poses
        Number of joint positions that were tried.
    open_poses
        At so many of them a closed loop does not close.
    """

    plane: Plane
    size: float
    corner: Floats
    best: Floats
    poses: int
    open_poses: int


def section_rows(robot: Robot, q: Floats, plane: Plane) -> Floats:
    """
    Return both coordinates, distance to singularity, and joint positions, shape (N, 3 + n).

    For a plane along base axes each pose is first moved into it by its least joint motion; rows of
    poses that do not reach it inside their limits, with closed loops on the way, are nan.
    """
    rows = np.full((len(q), 3 + robot.dof), np.nan)
    there = np.full(len(q), True)
    if not plane.half:
        q, there = _into_plane(robot, q, plane)
    state = evaluate(robot, q[there])
    distance = singularity_of(state).distance
    rows[there] = np.column_stack([plane.coordinates(state.position), distance, state.q])
    return rows


def _into_plane(robot: Robot, q: Floats, plane: Plane) -> tuple[Floats, npt.NDArray[np.bool_]]:
    # Newton's method with the least motion, in which a unit of each joint counts the same.
    ranges, near = finite_ranges(robot), IN_PLANE * robot.singularity.task.reach
    scales, normal = robot.singularity.task.column_scales, plane.normal
    at = float(plane.origin @ normal)
    q, off = np.array(q), np.full(len(q), np.inf)
    closed = np.full(len(q), True)
    for step in range(STEPS + 1):
        closed &= closes_at(robot.chain, q)
        away = np.flatnonzero((np.abs(off) > near) & closed)
        if not len(away):
            break
        state = evaluate(robot, q[away])
        off[away] = state.position @ normal - at
        if step == STEPS:
            break
        slope = np.einsum('i,nij->nj', normal, state.jacobian[:, :3]) * scales
        square = np.einsum('nj,nj->n', slope, slope)
        factor = np.divide(off[away], square, out=np.zeros(len(away)), where=square > 0.0)
        moved = q[away] - factor[:, None] * slope * scales
        moving = np.abs(off[away]) > near
        q[away[moving]] = np.clip(moved[moving], ranges[:, 0], ranges[:, 1])
    return q, (np.abs(off) <= near) & closed


def workspace(robot: Robot, plane: Plane, points: int, workers: str | None = None) -> Workspace:
    """
    Return the workspace in a plane, from random joint positions inside the limits.

    Then the poses found are changed a little and kept if they are better than the pose of their
    cell, mostly those beside an empty cell, so that the border fills, too: J.-B. Mouret, J. Clune,
    *Illuminating search spaces by mapping elites*, 2015.

    Parameters
    ----------
    robot
        The arm.
    plane
        Of `plane_of`.
    points
        Number of joint positions to begin with; twice as many follow in the rounds.
    workers
        As `sweep.map_batches` takes them.

    Raises
    ------
    SweepError
        The workers cannot be used.
    PlotError
        The tool does not reach the plane, or loops close at none of the positions.
    """
    random = np.random.default_rng(SEED)
    ranges = finite_ranges(robot)
    function = partial(section_rows, plane=plane)
    tried = random_positions(robot, random, points)
    count = len(tried)
    tried = tried[closes_at(robot.chain, tried)]
    open_poses = count - len(tried)
    if not len(tried):
        raise PlotError(
            f'{robot.name}: {not_all_closed(robot.loop_names)} at any of {count} positions'
        )
    found = map_batches(function, robot, tried, workers)
    found = found[np.isfinite(found[:, 0])]
    if not len(found):
        raise PlotError(f'{robot.name}: the tool does not reach the {plane.title}')
    widest = max(float(np.max(np.ptp(found[:, :2], axis=0))), SMALL * robot.singularity.task.reach)
    size = widest / CELLS
    found = _kept(found, size)
    each = max(SHARE * points // ROUNDS, 1)
    span = np.ptp(ranges, axis=1)
    for _ in range(ROUNDS):
        parents = _chosen(random, found, size, each)
        scale = 10.0 ** random.uniform(SMALLEST, LARGEST, (each, 1))
        change = random.normal(size=(each, robot.dof)) * scale * span
        tried = np.clip(parents + change, ranges[:, 0], ranges[:, 1])
        count += each
        tried = tried[closes_at(robot.chain, tried)]
        open_poses += each - len(tried)
        # A round takes less time than sending it to workers.
        found = _kept(np.vstack([found, function(robot, tried)]), size)
    cells = _cells(found[:, :2], size)
    low = cells.min(axis=0)
    across, up = (cells - low).T
    best = np.full((up.max() + 1, across.max() + 1), np.nan)
    best[up, across] = found[:, 2]
    return Workspace(plane, size, low * size, best, count, open_poses)


def _cells(coordinates: Floats, size: float) -> Integers:
    return np.floor(coordinates / size).astype(np.int64)


def _kept(rows: Floats, size: float) -> Floats:
    # Returns the row with the largest distance of each cell.
    rows = rows[np.isfinite(rows[:, 0])]
    rows = rows[np.argsort(-rows[:, 2], kind='stable')]
    first = np.unique(_cells(rows[:, 1::-1], size), axis=0, return_index=True)[1]
    return np.asarray(rows[first])


def _chosen(random: np.random.Generator, found: Floats, size: float, count: int) -> Floats:
    # Half of the parents are from cells with an empty neighbour.
    cells = _cells(found[:, :2], size)
    cells = cells - cells.min(axis=0) + 1
    taken = np.zeros(cells.max(axis=0) + 2, dtype=bool)
    taken[cells[:, 0], cells[:, 1]] = True
    around = [(1, 0), (-1, 0), (0, 1), (0, -1)]
    full = np.all([taken[cells[:, 0] + i, cells[:, 1] + k] for i, k in around], axis=0)
    edge = np.flatnonzero(~full)
    half = count // 2
    at_edge = edge[random.integers(len(edge), size=half)]
    anywhere = random.integers(len(found), size=count - half)
    return found[np.concatenate([at_edge, anywhere]), 3:]
