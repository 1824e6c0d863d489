# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Prove that no pose within a radius around given joint positions is singular, by bounds of the
Jacobian's derivatives.
"""

import functools

import numpy as np

from .. import kernel
from ..kernel import Floats
from ..robot.clearance_bounds import ClearanceBounds, find_bounds, strokes_of
from ..robot.robot import Robot
from .threads import in_parts


def clearances(robot: Robot, q: Floats) -> Floats:
    """
    Return for each q a proved radius, shape (N,), rad: no pose within the radius is singular.

    A radius is at most 1 rad. It is a norm of a joint motion: the root of the sum of squares, with
    prismatic motions divided by the characteristic length. If the arm has closed loops or more
    than 16 joints, the radius is 0, because nothing is proved for such arms.

    Parameters
    ----------
    robot
        The arm.
    q : shape (N, n), rad or m
        Joint positions, in C order.
    """
    # Return 0 if nothing can be proved. The bounds are not valid for loops, and for 128 joints
    # their computation takes 2 s.
    if robot.chain.loops or robot.dof > kernel.MAX_SEARCHED_JOINTS:
        return np.zeros(len(q))
    sizes = _sizes(robot, q)
    radii = np.empty(len(q))
    # Use a set instead of np.unique, because np.unique imports numpy.ma, which takes 10 ms at the
    # first pose.
    for size in set(sizes.tolist()):
        chosen = sizes == size
        radii[chosen] = _radii(robot, _bounds(robot, size), q[chosen])
    return radii


def _sizes(robot: Robot, q: Floats) -> Floats:
    # Returns for each pose the largest absolute position of a prismatic joint, rounded up to 2^k
    # times the characteristic length with a whole number k. Only prismatic joints without limits
    # or beyond their limits are taken; 0 if there are none. Because of the rounding, one
    # computation of bounds serves many poses.
    strokes = _strokes(robot)
    slides = strokes != 0.0
    if not slides.any():
        return np.zeros(len(q))
    away = np.abs(q[:, slides])
    farthest = np.max(np.where(away > strokes[slides], away, 0.0), axis=1, initial=0.0)
    _, powers = np.frexp(farthest / robot.singularity.task.length)
    return np.where(farthest > 0.0, np.ldexp(robot.singularity.task.length, powers), 0.0)


@functools.lru_cache(maxsize=64)
def _strokes(robot: Robot) -> Floats:
    return strokes_of(robot.chain, robot.limits)


@functools.lru_cache(maxsize=64)
def _bounds(robot: Robot, size: float) -> ClearanceBounds:
    strokes = _strokes(robot)
    reached = np.where(strokes != 0.0, np.maximum(strokes, size), 0.0)
    return find_bounds(robot.chain, robot.singularity.task, reached)


def _radii(robot: Robot, bounds: ClearanceBounds, q: Floats) -> Floats:
    radii, rows = np.full(len(q), kernel.FARTHEST), np.ascontiguousarray(q)
    if not len(bounds.moving):  # no joint changes the rank of the Jacobian
        return radii

    def part(begin: int, end: int) -> int:
        clearance = kernel.Clearance(robot.singularity.arm, *bounds)
        kernel.clearances(clearance, rows[begin:end], radii[begin:end])
        return -1

    in_parts(len(q), part)
    return radii
