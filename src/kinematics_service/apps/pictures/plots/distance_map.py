# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute the distance to a singular pose over a grid of two joints; the other joints are held."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....errors import PlotError
from ....kernel import Floats
from ....kinematics.singularity import singularity
from ....robot.closed_poses import closed_poses, closes_at
from ....robot.file.parts.loop_groups import all_in_words
from ....robot.robot import Robot
from ....robot.task import SEED
from .batches import map_batches
from .ranges import clear_pose, finite_ranges, random_positions

# Number of positions of each joint in the search for the two joints with the largest effect on the
# distance to singularity.
POSITIONS = 24
# Number of random configurations for the choice of a map's two joints. At each of these
# configurations, one joint after the other is moved alone (`_pair_with_most_change`).
POSES = 16
# A singular factor is taken as zero on the whole map if its absolute value is below this at all
# points of the map. `DistanceMap.everywhere` has the names of such factors.
TOLERANCE = 1e-12


@dataclass(frozen=True, eq=False)
class DistanceMap:
    """
    The distance to the nearest singular pose over a grid of two joints.

    Attributes
    ----------
    joints
        Indices of the horizontal and of the vertical joint.
    q : shape (n,), rad or m
        Positions of all joints. All joints except the two of the map are held at these positions.
    horizontal, vertical : shape (size,), rad or m
        Positions of the horizontal and of the vertical joint on the grid.
    distance : shape (size, size), rad
        Entry [i, k] is at vertical[i], horizontal[k]; nan if a loop does not close.
    functions
        Functions that are zero at singular poses, by name, each of shape (size, size). They are
        the named singular factors of the robot. The determinant of J is added unless it is the
        product of the factors. Entries are nan if a loop does not close.
    everywhere
        Names of the singular factors that are zero on the whole map because of the held joints.
    """

    joints: tuple[int, int]
    q: Floats
    horizontal: Floats
    vertical: Floats
    distance: Floats
    functions: dict[str, Floats]
    everywhere: tuple[str, ...]

    @property
    def open_share(self) -> float:
        """Return the share of grid points at which a loop does not close, 0 to 1."""
        return float(np.mean(np.isnan(self.distance)))


def singular_table(robot: Robot, q: Floats) -> Floats:
    """
    Return a table with the distance to the nearest singular pose, the determinant of J and the
    values of the robot's F singular factors.

    The table has a row for each of N joint positions q (N, n), shape (N, 2 + F). The distance is
    in rad. The determinant is nan if J is not square. A whole row is nan if a loop does not close.
    """
    rows = np.full((len(q), 2 + len(robot.singularity.factors.names)), np.nan)
    closed = closes_at(robot.chain, q)
    near = singularity(robot, q[closed])
    rows[closed, 0] = near.distance
    if near.determinant is not None:
        rows[closed, 1] = near.determinant
    if near.factors is not None:
        rows[closed, 2:] = near.factors.values
    return rows


def distance_map(
    robot: Robot, joints: tuple[int, int], q: Floats, size: int, workers: str | None = None
) -> DistanceMap:
    """
    Return the map of the distance to a singular pose over two joints, given by index.

    The other joints are held at their positions in q (n,).

    Raises
    ------
    SweepError
        The workers cannot be used.
    PlotError
        At every position of the map, some loop does not close.
    """
    ranges = finite_ranges(robot)
    across, up = joints
    horizontal = np.linspace(ranges[across, 0], ranges[across, 1], size)
    vertical = np.linspace(ranges[up, 0], ranges[up, 1], size)
    poses = np.empty((size, size, robot.dof))
    poses[:] = q
    poses[..., across] = horizontal
    poses[..., up] = vertical[:, None]
    table = map_batches(singular_table, robot, poses.reshape(-1, robot.dof), workers)
    grids = table.reshape(size, size, -1)
    if np.all(np.isnan(grids[..., 0])):
        raise PlotError(
            f'{robot.name}: no position of the map closes the {all_in_words(robot.loop_names)}; '
            'hold the other joints elsewhere with --q',
            code='open-loop',
        )
    functions = {name: grids[..., 2 + k] for k, name in enumerate(robot.singularity.factors.names)}
    everywhere = tuple(name for name, f in functions.items() if np.nanmax(np.abs(f)) < TOLERANCE)
    task = robot.singularity.task
    if task.square and not task.structurally_deficient and not robot.singularity.factors.complete:
        functions['det J'] = grids[..., 1]
    return DistanceMap(joints, q, horizontal, vertical, grids[..., 0], functions, everywhere)


def joint_pair(robot: Robot, names: Sequence[str] | None) -> tuple[int, int]:
    """
    Return the indices of two joints given by name or variable.

    If `names` is None, return the two joints with the largest effect on the distance to
    singularity.

    Raises
    ------
    PlotError
        The names are not two different joints of the arm.
    """
    choices = ', '.join(_joint_name(robot, j) for j in range(robot.dof))
    if robot.dof < 2:
        message = f'{robot.name} has one joint ({choices}), and a map needs two'
        raise PlotError(message, code='too-few')
    if names is None:
        return _pair_with_most_change(robot)
    indices = dict(zip((*robot.variables, *robot.joint_names), 2 * [*range(robot.dof)]))
    for name in names:
        if name not in indices:
            message = f'--joints: {robot.name} has no joint {name!r}; choose from {choices}'
            raise PlotError(message, code='unknown-name')
    pair = [indices[name] for name in names]
    if len(pair) != 2 or pair[0] == pair[1]:
        raise PlotError(
            f'--joints: give two different joints, such as '
            f'--joints {robot.variables[0]},{robot.variables[1]}; {robot.name} has {choices}',
            code='wrong-length',
        )
    return pair[0], pair[1]


def _joint_name(robot: Robot, j: int) -> str:
    name, variable = robot.joint_names[j], robot.variables[j]
    return name if name == variable else f'{variable} ({name})'


def _pair_with_most_change(robot: Robot) -> tuple[int, int]:
    # Return the two joints with the largest standard deviation of the distance to singularity
    # while each one alone moves. The result is in the order from base to tool.
    ranges = finite_ranges(robot)
    others = random_positions(robot, np.random.default_rng(SEED), POSES)
    starts = np.vstack([clear_pose(robot), closed_poses(robot.chain, others)[:POSES]])
    changes = []
    for j in range(robot.dof):
        q = np.repeat(starts[:, None], POSITIONS, axis=1)
        q[..., j] = np.linspace(ranges[j, 0], ranges[j, 1], POSITIONS + 1)[:-1]
        table = singular_table(robot, q.reshape(-1, robot.dof))
        distances = table[:, 0].reshape(len(q), POSITIONS)
        closed = distances[np.any(np.isfinite(distances), axis=1)]
        changes.append(float(np.mean(np.nanstd(closed, axis=1))) if len(closed) else 0.0)
    first, second = sorted(np.argsort(-np.round(changes, 6), kind='stable')[:2])
    return int(first), int(second)
