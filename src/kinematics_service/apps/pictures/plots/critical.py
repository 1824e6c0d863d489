"""Points of a plane at which no joint motion moves the tool in some direction of the plane."""

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

# Random starts, and those of arms whose loops have to be closed at each step; steps of Newton's
# method from each, and its damping.
STARTS, STARTS_OF_LOOPS, STEPS, DAMPING = 2500, 400, 25, 1e-9
# Step of the differences of J (rad, or m over the length), and the residual of a solution.
DIFFERENCE, ARRIVED = 1e-5, 1e-8
# A factor is zero below this distance to its zero, rad.
AT_ZERO = 1e-5


@dataclass(frozen=True, eq=False)
class CriticalPoints:
    """
    Singular poses of the position in a plane, as points.

    Attributes
    ----------
    points : shape (k, 2), m
        Coordinates in the plane.
    names : k
        The named factors that are zero there, joined by ` + `; empty if none is.
    """

    points: Floats
    names: tuple[str, ...]


def critical_points(robot: Robot, plane: Plane, starts: int | None = None) -> CriticalPoints:
    """
    Return points of the curves on which the position loses a direction of the plane.

    There a combination c of the gradients of the coordinates is across all columns of J: the
    system A(q)^T c = 0, |c| = 1 (and the tool in the plane), solved from random poses by damped
    Newton steps. Poses at joint limits end the workspace too, but are not among them.
    """
    ranges = finite_ranges(robot)
    random = np.random.default_rng(SEED)
    if starts is None:
        starts = STARTS_OF_LOOPS if robot.chain.loops else STARTS
    q = closed_poses(robot.chain, random_positions(robot, random, starts))
    rows = _rows(robot, plane, q)
    c = random.normal(size=(len(q), rows))
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
    # A c across the plane only means that the arm cannot leave it, which is no border within it.
    within = np.linalg.norm(c[:, :2], axis=1) > 1e-3
    q = q[(np.linalg.norm(F, axis=1) < ARRIVED) & inside & within]
    return CriticalPoints(plane.coordinates(evaluate(robot, q).position), _names(robot, q))


def _gradients(robot: Robot, plane: Plane, q: Floats) -> Floats:
    # Returns the position's scaled Jacobian along the plane's vectors, over the reach, (..., k,
    # n); nan where loops do not close.
    position, J = _position_and_jacobian(robot, q)
    return (
        plane.gradients(position)
        @ (J * robot.singularity.task.column_scales)
        / robot.singularity.task.reach
    )


def _position_and_jacobian(robot: Robot, q: Floats) -> tuple[Floats, Floats]:
    position = np.full(q.shape[:-1] + (3,), np.nan)
    J = np.full(q.shape[:-1] + (3, robot.dof), np.nan)
    closed = closes_at(robot.chain, q)
    state = evaluate(robot, q[closed])
    position[closed], J[closed] = state.position, state.jacobian[:, :3]
    return position, J


def _rows(robot: Robot, plane: Plane, q: Floats) -> int:
    # Returns the number of vectors of the plane along which the arm can move: fewer for a planar
    # arm.
    A = _gradients(robot, plane, q[:50])
    moved = np.max(np.abs(A), axis=(0, 2)) > 1e-9
    return 2 if len(moved) == 2 or not moved[2] else 3


def _system(robot: Robot, plane: Plane, q: Floats, c: Floats) -> tuple[Floats, Floats]:
    # Returns residuals (N, n + 1 or 2) and their derivatives by q (scaled) and c.
    n, k = robot.dof, c.shape[1]
    scales = robot.singularity.task.column_scales
    A = _gradients(robot, plane, q)[:, :k]
    ahead = q[:, None] + DIFFERENCE * np.diag(scales)
    behind = q[:, None] - DIFFERENCE * np.diag(scales)
    change = _gradients(robot, plane, ahead)[:, :, :k] - _gradients(robot, plane, behind)[:, :, :k]
    slope = np.einsum('njki,nk->nij', change / (2.0 * DIFFERENCE), c)
    F = [np.einsum('nki,nk->ni', A, c), (np.sum(c * c, axis=1) - 1.0)[:, None] / 2.0]
    top = np.concatenate([slope, np.swapaxes(A, 1, 2)], axis=2)
    unit = np.concatenate([np.zeros((len(q), 1, n)), c[:, None]], axis=2)
    parts = [top, unit]
    if k == 3:
        off = (_position_and_jacobian(robot, q)[0] - plane.origin) @ plane.normal
        off /= robot.singularity.task.reach
        F.append(off[:, None])
        parts.append(np.concatenate([A[:, 2:], np.zeros((len(q), 1, k))], axis=2))
    return np.concatenate(F, axis=1), np.concatenate(parts, axis=1)


def _names(robot: Robot, q: Floats) -> tuple[str, ...]:
    if not len(q):
        return ()
    factors = singularity(robot, q).factors
    if factors is None:
        return ('',) * len(q)
    zero = factors.estimates < AT_ZERO
    return tuple(
        ' + '.join(name for name, is_zero in zip(factors.names, row) if is_zero) for row in zero
    )
