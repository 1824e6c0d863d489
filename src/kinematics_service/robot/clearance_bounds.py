# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Bound the derivatives of an arm's Jacobian at all joint positions, from the arm's lengths."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .. import kernel
from ..kernel import Chain, ChainTable, Floats, Integers
from .chain import evaluated
from .task import Task

# Largest number of entries of a chain for which bounds of the third and fourth derivatives of J_t
# by the joints are computed. An entry is a pair of a screw and a joint that moves it. The fourth
# derivative has entries^5 components, so for longer chains only a bound of the second derivative
# is computed.
MAX_BOUNDED_ENTRIES = 12
# Two axes count as parallel if the sine of the angle between them is below this number. Parallel
# axes have no unique nearest points.
PARALLEL_SINE = 1e-6
# Relative round-off by which `reach_of` enlarges the radius of the sphere around the arm. The
# radius is a sum of lengths. The value is a few thousand times machine epsilon.
LENGTH_SUM_ERROR = 1e-12


class ClearanceBounds(NamedTuple):
    """
    The constants of an arm with which `kernel.Clearance` proves that no pose is singular within
    some distance (a joint motion) of a pose.

    Attributes
    ----------
    moving : shape (d,)
        Indices of the joints that can change the rank of J_t (the task rows of the Jacobian).
    point : shape (3,), m
        The reference point of J: the vector from the origin of the tool to the point, in the axes
        of the tool.
    bend, twist, fourth
        Upper bounds of the second, third and fourth derivatives of J_t by the joint positions;
        infinite if not computed.
    """

    moving: Integers
    point: Floats
    bend: float
    twist: float
    fourth: float


class _Elements(NamedTuple):
    """
    The screws of a chain and the pose of the tool at one joint configuration, in the base frame.

    Screw k turns if `turns[k]` is true. Its axis has the direction `axis[k]` and passes through
    the point `point[k]`, m. The tool has the position `tool` (3,), m, and the rotation `rotation`
    (3, 3).
    """

    turns: npt.NDArray[np.bool_]
    axis: Floats
    point: Floats
    tool: Floats
    rotation: Floats


def _elements(chain: Chain, q: Floats) -> _Elements:
    row = evaluated(chain, q[None])[0]
    pose = row[:16].reshape(4, 4)
    screws = row[chain.screws_at : chain.screws_at + 6 * chain.entries].reshape(6, -1).T
    first = chain.table.first_entry
    count = len(first) - 1
    turns, axis, point = np.zeros(count, bool), np.zeros((count, 3)), np.zeros((count, 3))
    for k in range(count):
        entries = range(first[k], first[k + 1])
        # Several joints may turn this screw. Compute the axis from the joint that turns the screw
        # fastest: the joint's column (v, w) of the Jacobian satisfies v = w x (tool - point) for
        # each point on the axis.
        e = max(entries, key=lambda entry: abs(chain.table.by_theta[entry]))
        if chain.table.by_theta[e] != 0.0:
            v, w = screws[e, :3], screws[e, 3:]
            size = np.linalg.norm(w)
            turns[k], axis[k] = True, w / size
            point[k] = pose[:3, 3] + np.cross(w, v) / size**2
    return _Elements(turns, axis, point, pose[:3, 3], pose[:3, :3])


def _point(elements: _Elements, six_rows: bool, farthest: float) -> Floats:
    # Return the reference point of J, (3,), m. For a task of six rows, J has the same rank at
    # every point of the tool. Therefore return the wrist centre: the point on the last axis where
    # the common normal with the previous axis ends. If the wrist centre is farther from the tool
    # than `farthest` (m), return the position of the tool.
    if not six_rows or len(elements.turns) < 2 or not elements.turns[-2:].all():
        return elements.tool
    a, b = elements.axis[-1], elements.axis[-2]
    p, o = elements.point[-1], elements.point[-2]
    across = np.cross(a, b)
    square = float(across @ across)
    parallel = square <= PARALLEL_SINE**2
    along = 0.0 if parallel else np.linalg.det(np.array([o - p, b, across])) / square
    point = np.asarray(p + a * along)
    return point if np.linalg.norm(point - elements.tool) <= farthest else elements.tool


class _Feet(NamedTuple):
    """
    Upper bounds of the distance from a given point to the axis of each screw of a chain.

    `farthest` has the bounds, shape (screws,), m. `first` is a point on the first axis of
    rotation, shape (3,), m: the foot of the perpendicular from the foot on the next axis.
    """

    farthest: Floats
    first: Floats


def _feet(chain: Chain, elements: _Elements, point: Floats, strokes: Floats) -> _Feet:
    # Drop a perpendicular from `point` to the last joint axis, then from the foot of this
    # perpendicular to the previous axis, and so on. The perpendiculars have constant lengths. So
    # the distance to an axis is at most the sum of these lengths and of the strokes of sliding
    # joints.
    count = len(elements.turns)
    first = chain.table.first_entry
    hops, foot = np.zeros(count), point
    for k in range(count - 1, -1, -1):
        if elements.turns[k]:
            a, c = elements.axis[k], elements.point[k]
            below = c + a * float(a @ (foot - c))
            hops[k] = float(np.linalg.norm(foot - below))
            foot = below
        for e in range(first[k], first[k + 1]):
            if chain.table.by_d[e] != 0.0:
                hops[k] += abs(chain.table.by_d[e]) * strokes[chain.table.joint[e]]
    return _Feet(np.cumsum(hops[::-1])[::-1], foot)


class Reach(NamedTuple):
    """A sphere in the base frame that the tool never leaves: centre, shape (3,), and radius, m."""

    centre: Floats
    radius: float


def reach_of(chain: Chain, limits: Floats) -> Reach:
    """
    Return a sphere that the tool cannot leave while joints are inside limits (n, 2), rad or m.

    The radius is infinite if a passive joint of a loop slides, because its stroke has no bound.
    """
    elements = _elements(
        chain, np.zeros(chain.dof) if chain.closure is None else chain.closure.assembled()
    )
    strokes = np.full(max(chain.dof, int(np.max(chain.table.joint)) + 1), np.inf)
    strokes[: chain.dof] = np.max(np.abs(limits), axis=1)
    feet = _feet(chain, elements, elements.tool, strokes)
    radius = float(feet.farthest[0])
    error = LENGTH_SUM_ERROR * (radius + float(np.max(np.abs(elements.point))))
    return Reach(feet.first, radius + error)


def moving_joints(chain: Chain, task: Task) -> Integers:
    """
    Return the indices of the joints that can change the rank of J_t, shape (d,).

    The first joint moves the arm as one rigid body. It is left out if it slides, or if J_t has the
    rows x y z, the rows rx ry rz, or all six. If J_t has six rows, the last joint is also left
    out, because it moves no joint axis. Together with the first (last) joint, the joints that
    follow (precede) it on the same axis are left out. A joint is kept if it moves two rows of the
    table, or is part of a closed loop.
    """
    six_rows = len(task.rows) == 6
    table = chain.table
    counts = np.ones(max(chain.dof, 1 + int(np.max(table.joint, initial=-1))), bool)
    whole = set(task.rows) in ({'x', 'y', 'z'}, {'rx', 'ry', 'rz'}) or six_rows
    order = range(len(table.theta_0))
    for entry in _alone_about_one_axis(table, order):
        if not whole and table.by_theta[entry] != 0.0:
            break
        counts[table.joint[entry]] = False
    for entry in _alone_about_one_axis(table, order[::-1]) if six_rows else ():
        counts[table.joint[entry]] = False
    counts = counts[: chain.dof]
    if chain.closure is not None:
        counts |= np.isfinite(chain.closure.units())
    return np.flatnonzero(counts).astype(np.int64)


def _alone_about_one_axis(table: ChainTable, order: range) -> Iterator[int]:
    # Take the screws in the given order, and yield the entries (joints) of the screws before the
    # axis changes. Stop at a screw that several joints move, or whose joint also moves another
    # screw.
    for place, k in enumerate(order):
        entry = table.first_entry[k]
        alone = table.first_entry[k + 1] == entry + 1
        if not alone or np.sum(table.joint == table.joint[entry]) != 1:
            return
        if place > 0:
            between = table.before[max(k, order[place - 1])]
            if not np.array_equal(between[:, 2], [0.0, 0.0, 1.0]) or np.any(between[:2, 3]):
                return
        yield int(entry)


def _largest_parts(chain: Chain, task: Task, farthest: Floats, order: int) -> Floats:
    # Return upper bounds of the norms of the derivatives of each column of J_t by `order` joints,
    # shape (n, ..., n). First compute the bounds for entries (pairs of a screw and a joint that
    # moves it). A derivative involves `order` + 1 entries of the chain: one for the column, and
    # one for each joint of the derivative. Let w be the angular velocity that an entry causes at
    # unit joint speed, and v the largest speed of the reference point. The linear part is at most
    # v of the entry that is last in the chain, times w of the other entries. The angular part is
    # at most the product of all w. It is zero unless the entry of the column comes after all other
    # entries in the chain.
    table, E = chain.table, chain.entries
    element = np.repeat(np.arange(len(table.theta_0)), np.diff(table.first_entry))
    w = np.abs(table.by_theta)
    v = w * farthest[element] + np.abs(table.by_d)
    grid = np.indices((E,) * (order + 1))
    inner = np.sort(grid, axis=0)
    linear = np.prod(w[inner[:-1]], axis=0) * v[inner[-1]]
    before = np.all(element[grid[1:]] < element[grid[:1]], axis=0)
    angular = np.prod(w[grid], axis=0) * before
    has_linear = any(axis < 3 for axis in task.axes)
    has_angular = any(axis >= 3 for axis in task.axes)
    parts = np.hypot(linear * has_linear, angular * task.length * has_angular)
    # A joint has several entries if it moves several screws. Add up the bounds of all entries of a
    # joint. Multiply the bounds of sliding joints by the characteristic length.
    scales = np.zeros((chain.dof, E))
    scales[table.joint, np.arange(E)] = task.column_scales[table.joint]
    for axis in range(order + 1):
        parts = np.moveaxis(np.tensordot(scales, parts, axes=(1, axis)), 0, axis)
    return np.asarray(parts)


def strokes_of(chain: Chain, limits: Floats) -> Floats:
    """
    Return the largest absolute position of each joint that slides, shape (n,), in m (rad for a
    helical joint).

    The value is -1 for a sliding joint without limits, and 0 for a joint that only turns.
    """
    slides = np.zeros(chain.dof, bool)
    slides[chain.table.joint[chain.table.by_d != 0.0]] = True
    farthest = np.max(np.abs(limits), axis=1)
    return np.where(slides, np.where(np.isfinite(farthest), farthest, -1.0), 0.0)


def find_bounds(chain: Chain, task: Task, strokes: Floats) -> ClearanceBounds:
    """
    Return upper bounds of the derivatives of an arm's Jacobian. The bounds hold if no joint is
    farther from 0 than its stroke plus `kernel.FARTHEST` (1 rad, or the characteristic length).

    Parameters
    ----------
    chain, task
        The arm.
    strokes : shape (n,), rad or m
        The largest absolute position of each joint; ignored for joints that only turn.
    """
    six_rows = len(task.rows) == 6
    elements = _elements(chain, np.zeros(chain.dof))
    point = _point(elements, six_rows, max(task.reach, task.length))
    around = strokes + kernel.FARTHEST * task.column_scales
    farthest = _feet(chain, elements, point, around).farthest
    moving = moving_joints(chain, task)
    n, d = chain.dof, len(moving)
    if d == 0:
        return ClearanceBounds(moving, np.zeros(3), 0.0, 0.0, 0.0)
    bounds = [np.inf, np.inf, np.inf]
    for order in (2, 3, 4) if chain.entries <= MAX_BOUNDED_ENTRIES else (2,):
        parts = _largest_parts(chain, task, farthest, order)
        parts = parts[np.ix_(np.arange(n), *[moving] * order)]
        # The first dimension of the array `parts` is the column of J_t, and each other dimension
        # is a joint of the derivative. Flatten the first k + 1 dimensions to rows and the others
        # to columns of a matrix. The 2-norm of the matrix bounds the derivative along joint
        # motions of norm 1. Take the smallest norm over k.
        flat = (parts.reshape(n * d**k, -1) for k in range(order))
        flat = (part if len(part) < len(part.T) else part.T for part in flat)
        bounds[order - 2] = min(float(np.linalg.norm(part, 2)) for part in flat)
    point = elements.rotation.T @ (point - elements.tool)
    return ClearanceBounds(moving, point, bounds[0], bounds[1], bounds[2])
