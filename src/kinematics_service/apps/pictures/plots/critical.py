# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find points of a plane at which the tool cannot move in some direction of the plane.

Damped Newton steps, from random configurations, solve the equations of such points.
"""

from dataclasses import dataclass

import numpy as np

from ....kernel import Floats
from ....kinematics.singularity import singularity
from ....kinematics.tool_state import evaluate
from ....robot.closed_poses import closed_poses, closes_at
from ....robot.robot import Robot
from ....robot.task import SEED
from .plane import Plane
from .ranges import finite_ranges, random_positions

# Number of random configurations from which the Newton steps start. Arms with closed loops get
# fewer, because each step must close the loops, which takes time.
STARTS = 2500
STARTS_OF_LOOPS = 400
# Number of damped Newton steps from each random configuration.
STEPS = 25
# Damping of the Newton steps toward points at which the tool cannot move in some direction. It is
# added to the diagonal of J^T J; J has the derivatives of the solved equations.
DAMPING = 1e-9
# Step of each joint in the central differences that give the derivatives of A, a scaled Jacobian
# (see `_gradients`). The unit is rad for a revolute joint, and the characteristic length for a
# prismatic joint.
DIFFERENCE_STEP = 1e-5
# After the last Newton step, a configuration is a solution if the norm of its residuals is below
# this (no unit).
RESIDUAL_TOLERANCE = 1e-8
# A singular factor is taken as zero at a configuration if the estimated distance (rad) from the
# configuration to the nearest zero of the factor is below this value. The result then contains the
# name of the factor (`CriticalPoints.names`).
FACTOR_TOLERANCE = 1e-5


@dataclass(frozen=True, eq=False)
class CriticalPoints:
    """
    Points of a plane at which the tool cannot move in some direction of the plane.

    Attributes
    ----------
    points : shape (k, 2), m
        Coordinates in the plane.
    names : k
        For each point the names of the singular factors that are zero, joined by ` + `; empty if
        no factor is zero.
    """

    points: Floats
    names: tuple[str, ...]


def critical_points(robot: Robot, plane: Plane, starts: int | None = None) -> CriticalPoints:
    """
    Return points of the plane at which the tool cannot move in some direction of the plane.

    Let A(q) be the Jacobian of the plane's coordinates by the joints, scaled (see `_gradients`).
    At such a point A(q)^T c = 0 for a vector c with |c| = 1: the coordinates cannot change in the
    direction c. The search solves these equations, with the tool in the plane. The result omits
    points at which only a joint limit stops the tool, although such points bound the workspace.
    """
    ranges = finite_ranges(robot)
    random = np.random.default_rng(SEED)
    if starts is None:
        starts = STARTS_OF_LOOPS if robot.chain.loops else STARTS
    q = closed_poses(robot.chain, random_positions(robot, random, starts))
    vectors = _number_of_vectors(robot, plane, q)
    c = random.normal(size=(len(q), vectors))
    c /= np.linalg.norm(c, axis=1, keepdims=True)
    scales = robot.singularity.task.column_scales
    for _ in range(STEPS):
        F, J = _system(robot, plane, q, c)
        closed = np.isfinite(F).all(axis=1) & np.isfinite(J).all(axis=(1, 2))
        q, c, F, J = q[closed], c[closed], F[closed], J[closed]
        normal = np.swapaxes(J, 1, 2) @ J + DAMPING * np.eye(J.shape[2])
        step = np.linalg.solve(normal, (np.swapaxes(J, 1, 2) @ F[..., None]))[..., 0]
        longest = np.max(np.abs(step), axis=1, keepdims=True)
        step *= 0.5 / np.maximum(longest, 0.5)
        q = q - step[:, : robot.dof] * scales
        c = c - step[:, robot.dof :]
        q = np.where(robot.prismatic, q, np.remainder(q + np.pi, 2.0 * np.pi) - np.pi)
    F, _ = _system(robot, plane, q, c)
    inside = np.all((q >= ranges[:, 0]) & (q <= ranges[:, 1]), axis=1)
    # Drop poses at which c, the direction without motion, is normal to the plane, because there
    # the tool can move in every direction of the plane.
    within = np.linalg.norm(c[:, :2], axis=1) > 1e-3
    q = q[(np.linalg.norm(F, axis=1) < RESIDUAL_TOLERANCE) & inside & within]
    return CriticalPoints(plane.coordinates(evaluate(robot, q).position), _names(robot, q))


def _gradients(robot: Robot, plane: Plane, q: Floats) -> Floats:
    # Return A, shape (..., k, n): the scaled Jacobian of the plane's k coordinates. Let G be the
    # gradients of the k coordinates by position, and J the Jacobian of the tool's position. Then A
    # is G J with scaled columns, divided by the reach. A is nan if a loop does not close.
    position, J = _position_and_jacobian(robot, q)
    task = robot.singularity.task
    return plane.gradients(position) @ (J * task.column_scales) / task.reach


def _position_and_jacobian(robot: Robot, q: Floats) -> tuple[Floats, Floats]:
    position = np.full(q.shape[:-1] + (3,), np.nan)
    J = np.full(q.shape[:-1] + (3, robot.dof), np.nan)
    closed = closes_at(robot.chain, q)
    state = evaluate(robot, q[closed])
    position[closed], J[closed] = state.position, state.jacobian[:, :3]
    return position, J


def _number_of_vectors(robot: Robot, plane: Plane, q: Floats) -> int:
    # Return k, the number of tool coordinates (rows of A) that the search uses. Two coordinates
    # are in the plane. A third coordinate, along the plane's normal, is used if the arm can move
    # the tool along the normal.
    A = _gradients(robot, plane, q[:50])
    moved = np.max(np.abs(A), axis=(0, 2)) > 1e-9
    return 2 if len(moved) == 2 or not moved[2] else 3


def _system(robot: Robot, plane: Plane, q: Floats, c: Floats) -> tuple[Floats, Floats]:
    # Let A(q) (k, n) be the scaled Jacobian of k coordinates of the tool: two coordinates in the
    # plane and, if k is 3, one along the plane's normal. Let c (k,) be a direction in which the
    # tool cannot move. The equations are A(q)^T c = 0 and |c| = 1. If k is 3, a further equation
    # says that the tool is in the plane. Return the residuals of the equations at q and c, shape
    # (N, n + 1), or (N, n + 2) if k is 3. Return also the derivatives of the residuals by q
    # (scaled) and c.
    n, k = robot.dof, c.shape[1]
    scales = robot.singularity.task.column_scales
    A = _gradients(robot, plane, q)[:, :k]
    ahead = q[:, None] + DIFFERENCE_STEP * np.diag(scales)
    behind = q[:, None] - DIFFERENCE_STEP * np.diag(scales)
    change = _gradients(robot, plane, ahead)[:, :, :k] - _gradients(robot, plane, behind)[:, :, :k]
    slope = np.einsum('njki,nk->nij', change / (2.0 * DIFFERENCE_STEP), c)
    F = [np.einsum('nki,nk->ni', A, c), (np.sum(c * c, axis=1) - 1.0)[:, None] / 2.0]
    top = np.concatenate([slope, np.swapaxes(A, 1, 2)], axis=2)
    unit = np.concatenate([np.zeros((len(q), 1, n)), c[:, None]], axis=2)
    parts = [top, unit]
    if k == 3:
        height = (_position_and_jacobian(robot, q)[0] - plane.origin) @ plane.normal
        height /= robot.singularity.task.reach
        F.append(height[:, None])
        parts.append(np.concatenate([A[:, 2:], np.zeros((len(q), 1, k))], axis=2))
    return np.concatenate(F, axis=1), np.concatenate(parts, axis=1)


def _names(robot: Robot, q: Floats) -> tuple[str, ...]:
    factors = singularity(robot, q).factors
    if factors is None:
        return ('',) * len(q)
    zero = factors.estimates < FACTOR_TOLERANCE
    return tuple(
        ' + '.join(name for name, is_zero in zip(factors.names, row) if is_zero) for row in zero
    )
