# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Select the rows of the Jacobian that the task uses, by their names, in the axes of frame 0."""

import functools
from collections.abc import Sequence

import numpy as np

from ..errors import PointError
from ..kernel import Floats
from ..robot.points import TOOL
from ..robot.robot import Robot
from ..robot.task import Task, find_task, generic_poses
from .arguments import rows_in_order


def task_of(robot: Robot, rows: Sequence[str] | None, of: str | int = TOOL) -> Task:
    """
    Return the `Task` for a point of the arm and given rows of J; by default the rows of the arm's
    task.

    Raises
    ------
    PointError
        The arm has no frame `of`; `rows` is empty or has a name other than x y z rx ry rz.
    KinematicsError
        No joint moves the point in these rows.
    """
    if rows is None and type(of) is str and of == TOOL:
        return robot.singularity.task
    names = robot.singularity.task.rows if rows is None else rows_in_order(PointError, rows)
    robot.point(of)  # raise PointError if the arm has no such point
    return _cached_task(robot, names, of)


@functools.lru_cache(maxsize=128)
def _cached_task(robot: Robot, rows: tuple[str, ...], of: str | int) -> Task:
    chain, length = robot.point(of).chain, robot.singularity.task.length
    q = generic_poses(chain, robot.limits, robot.prismatic)
    return find_task(chain, robot.joint_names, q, robot.prismatic, rows, length)


def task_jacobian(task: Task, J: Floats) -> Floats:
    """
    Return the task Jacobian J_t (..., m, n): the task's rows of J, unscaled, in the axes of frame
    0.

    Parameters
    ----------
    task
        The task, which names the rows.
    J : shape (..., 6, n)
        The Jacobian, in base axes.
    """
    halves = J.reshape(*J.shape[:-2], 2, 3, J.shape[-1])
    turned = np.asarray(task.rotation.T @ halves).reshape(J.shape)
    return np.asarray(turned[..., task.axes, :])
