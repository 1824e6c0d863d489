# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute which cells of a plane the tool reaches, and the distance to singularity in each cell.

For each cell, the search finds joint positions that put the tool into the cell and have the
largest distance to singularity.

The search uses random joint positions, then MAP-Elites: J.-B. Mouret, J. Clune, *Illuminating
search spaces by mapping elites*, 2015.
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

# Number of square cells along the longer side of the workspace.
CELLS = 100
# Smallest width of a workspace, divided by the reach. A smaller workspace is drawn as a point.
MIN_WIDTH_RATIO = 1e-6
# Maximum number of Newton steps that move a configuration until the tool is in the plane.
MAX_STEPS = 8
# The Newton steps end if the tool's distance from the plane, divided by the reach, is below this.
PLANE_TOLERANCE = 1e-9
# Number of rounds of MAP-Elites.
ROUNDS = 24
# Total number of configurations in all rounds of MAP-Elites, divided by the number of random
# configurations before the first round.
CHANGED_RATIO = 2
# Smallest and largest standard deviation of a random change of a joint position, divided by the
# joint's range; as exponents of 10.
CHANGE_POWERS = (-3.0, -0.7)


@dataclass(frozen=True, eq=False)
class Workspace:
    """
    The cells of a plane that the tool reached.

    Attributes
    ----------
    plane
        The plane that is divided into cells.
    size
        Edge of a cell, m.
    corner : shape (2,), m
        Plane coordinates of the lower left corner of `best`.
    best : shape (rows, columns), rad
        The largest distance to singularity found with the tool in each cell; nan if no pose was
        found.
    poses
        Number of joint positions that were tried.
    open_poses
        Number of tried joint positions at which a closed loop does not close.
    """

    plane: Plane
    size: float
    corner: Floats
    best: Floats
    poses: int
    open_poses: int


def section_rows(robot: Robot, q: Floats, plane: Plane) -> Floats:
    """
    Return, for each of N joint positions q (N, n), a row (3 + n,): two coordinates of the tool in
    the plane (m), distance to the nearest singular pose (rad), and joint positions.

    If the plane is along base axes, Newton steps of least norm first move the tool into the plane.
    A row is nan if the tool does not get into the plane with joints inside the limits and loops
    closed.
    """
    rows = np.full((len(q), 3 + robot.dof), np.nan)
    arrived = np.full(len(q), True)
    if not plane.half:
        q, arrived = _into_plane(robot, q, plane)
    state = evaluate(robot, q[arrived])
    distance = singularity_of(state).distance
    rows[arrived] = np.column_stack([plane.coordinates(state.position), distance, state.q])
    return rows


def _into_plane(robot: Robot, q: Floats, plane: Plane) -> tuple[Floats, npt.NDArray[np.bool_]]:
    # Move the tool into the plane by Newton's method, with least-norm steps that are scaled by the
    # task's column scales. Return joint positions (N, n), and flags (N,): whether the tool is in
    # the plane.
    ranges, near = finite_ranges(robot), PLANE_TOLERANCE * robot.singularity.task.reach
    scales, normal = robot.singularity.task.column_scales, plane.normal
    at = float(plane.origin @ normal)
    q, off = np.array(q), np.full(len(q), np.inf)
    closed = np.full(len(q), True)
    for step in range(MAX_STEPS + 1):
        closed &= closes_at(robot.chain, q)
        away = np.flatnonzero((np.abs(off) > near) & closed)
        if not len(away):
            break
        state = evaluate(robot, q[away])
        off[away] = state.position @ normal - at
        if step == MAX_STEPS:
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
    Return the workspace in a plane, found by a search from random joint positions in the limits.

    The plane is divided into square cells. For each cell that the tool reaches, the search keeps
    the joint positions with the largest distance to singularity. Each round of MAP-Elites changes
    some of the kept joint positions a little and tries the changed positions. Half of the changed
    positions come from cells with an empty neighbour cell, so that cells at the border are filled.

    Parameters
    ----------
    robot
        The arm.
    plane
        A plane from `plane_of`.
    points
        Number of first random configurations; the rounds try CHANGED_RATIO times this number.
    workers
        `dask://HOST:PORT`; see `map_batches`.

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
            f'{robot.name}: {not_all_closed(robot.loop_names)} at any of {count} positions; try '
            'more with --points',
            code='open-loop',
        )
    rows = map_batches(function, robot, tried, workers)
    rows = rows[np.isfinite(rows[:, 0])]
    if not len(rows):
        message = f'{robot.name}: the tool does not reach the {plane.title}; choose another plane'
        raise PlotError(message, code='unreachable')
    widest = float(np.max(np.ptp(rows[:, :2], axis=0)))
    size = max(widest, MIN_WIDTH_RATIO * robot.singularity.task.reach) / CELLS
    rows = _best_of_cells(rows, size)
    batch = max(CHANGED_RATIO * points // ROUNDS, 1)
    span = np.ptp(ranges, axis=1)
    for _ in range(ROUNDS):
        parents = _parents(random, rows, size, batch)
        scale = 10.0 ** random.uniform(*CHANGE_POWERS, (batch, 1))
        change = random.normal(size=(batch, robot.dof)) * scale * span
        tried = np.clip(parents + change, ranges[:, 0], ranges[:, 1])
        count += batch
        tried = tried[closes_at(robot.chain, tried)]
        open_poses += batch - len(tried)
        # Compute in this process, because a round takes less time than its transfer to workers.
        rows = _best_of_cells(np.vstack([rows, function(robot, tried)]), size)
    cells = _cells(rows[:, :2], size)
    low = cells.min(axis=0)
    across, up = (cells - low).T
    best = np.full((up.max() + 1, across.max() + 1), np.nan)
    best[up, across] = rows[:, 2]
    return Workspace(plane, size, low * size, best, count, open_poses)


def _cells(coordinates: Floats, size: float) -> Integers:
    return np.floor(coordinates / size).astype(np.int64)


def _best_of_cells(rows: Floats, size: float) -> Floats:
    # Return, for each cell of the plane, the row of `section_rows` with the largest distance to
    # singularity.
    rows = rows[np.isfinite(rows[:, 0])]
    rows = rows[np.argsort(-rows[:, 2], kind='stable')]
    first = np.unique(_cells(rows[:, 1::-1], size), axis=0, return_index=True)[1]
    return np.asarray(rows[first])


def _parents(random: np.random.Generator, rows: Floats, size: float, count: int) -> Floats:
    # Return `count` joint positions that MAP-Elites changes next. Half of them are from cells with
    # an empty neighbour cell.
    cells = _cells(rows[:, :2], size)
    cells = cells - cells.min(axis=0) + 1
    taken = np.zeros(cells.max(axis=0) + 2, dtype=bool)
    taken[cells[:, 0], cells[:, 1]] = True
    around = [(1, 0), (-1, 0), (0, 1), (0, -1)]
    full = np.all([taken[cells[:, 0] + i, cells[:, 1] + k] for i, k in around], axis=0)
    edge = np.flatnonzero(~full)
    half = count // 2
    at_edge = edge[random.integers(len(edge), size=half)]
    anywhere = random.integers(len(rows), size=count - half)
    return rows[np.concatenate([at_edge, anywhere]), 3:]
