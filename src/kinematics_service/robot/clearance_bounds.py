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

# Largest number E of entries of a chain for which the third and fourth derivatives of J_t by the
# joint positions are bounded. A chain has one entry for each screw and each joint that moves the
# screw. The fourth derivative has E**5 components, so for longer chains only the second derivative
# is bounded.
MAX_BOUNDED_ENTRIES = 12
# Two axes count as parallel if the sine of the angle between them is below this number. Parallel
# axes have no unique nearest points.
PARALLEL_SINE = 1e-6
# Relative round-off by which `reach_of` enlarges the radius of the sphere around the arm. The
# radius is a sum of lengths. The value is a few thousand times machine epsilon.
LENGTH_SUM_ERROR = 1e-12


class ClearanceBounds(NamedTuple):
    """
    Constants of an arm for `kernel.Clearance`, which computes a radius around a pose.

    The radius is the length of a joint motion, rad. It is proved that no shorter joint motion
    leads from the pose to a singular pose.

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
    # Return the reference point of J, (3,), m. Usually this is the position of the tool. But if J
    # has six rows, the rank of J is equal for all reference points. Then a point near the joint
    # axes is better, because the bounds grow with the distance from the axes. So return the wrist
    # centre, if it is at most `farthest` (m) from the tool. The wrist centre is the point on the
    # last axis where the common normal with the previous axis ends.
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

    `farthest` has the bounds, shape (screws,), m. `first`, shape (3,), m, is a point on the first
    axis of rotation. To find `first`, `_feet` drops a perpendicular from the given point to the
    last axis, then from the end of the perpendicular to the previous axis, up to the first axis.
    """

    farthest: Floats
    first: Floats


def _feet(chain: Chain, elements: _Elements, point: Floats, strokes: Floats) -> _Feet:
    # Drop a perpendicular from `point` to the last axis of rotation, then from the end of this
    # perpendicular to the previous axis, and so on. Joint motions do not change the lengths of the
    # perpendiculars. For screw k, hops[k] is the length of the perpendicular to the axis of the
    # screw, plus the strokes of the joints that slide along the axis. The distance from `point` to
    # the axis of screw k is at most hops[k] + hops[k + 1] + ... up to the last screw.
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

    Two groups of joints may be left out:

    - the first joint, and the joints directly after it on the same axis. They move the arm as one
      rigid body. Joints that turn are left out only if the rows of J_t are x y z, or rx ry rz, or
      all six. For other rows, the group ends before the first joint that turns.
    - the last joint, and the joints directly before it on the same axis. They move no other joint
      axis. They are left out only if J_t has six rows.

    A group ends before a joint that moves two rows of the table, and before a row that two joints
    move. No joint of a closed loop is left out.
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
    # Go through the screws in the given order, and yield the index of each screw's entry. A chain
    # has one entry for each screw and each joint that moves the screw. Stop before the first screw
    # that is not on the axis of the screws before it. Stop also before a screw that several joints
    # move, and before a screw whose joint moves a second screw.
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
    # shape (n, ..., n).
    #
    # One joint may move several screws, and several joints may move one screw. So the chain has
    # one entry for each screw and each joint that moves the screw. If the joint of entry e moves
    # with unit speed, the screw turns with the angular speed w[e], and the reference point moves
    # at most with the speed v[e].
    #
    # First compute bounds for entries: for every choice of one entry for the column, and one entry
    # for each of the `order` differentiations. Bound of the linear part: v of the chosen entry
    # that is last in the chain, times w of each other chosen entry. Bound of the angular part: the
    # product of w of all chosen entries. If the entry of the column does not come after all other
    # chosen entries in the chain, the angular part is 0.
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
    # So far the indices of `parts` are indices of entries. Replace them by indices of joints: a
    # joint that moves several screws has several entries, so add up the bounds of these entries.
    # Multiply the bounds of sliding joints by the characteristic length.
    scales = np.zeros((chain.dof, E))
    scales[table.joint, np.arange(E)] = task.column_scales[table.joint]
    for axis in range(order + 1):
        parts = np.moveaxis(np.tensordot(scales, parts, axes=(1, axis)), 0, axis)
    return np.asarray(parts)


def strokes_of(chain: Chain, limits: Floats) -> Floats:
    """
    Return the largest absolute position of each sliding joint inside its limits, shape (n,).

    The unit is m, or rad for a helical joint, which slides and turns. The value is -1 for a
    sliding joint without limits, and 0 for a joint that only turns.
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
        # parts[i, j1, j2, ...] is an upper bound of the norm of a partial derivative: column i of
        # J_t, differentiated with respect to joint j1, joint j2, and so on. Choose a number k, and
        # reshape `parts` to a matrix: the first k + 1 indices give the row, the other indices the
        # column. The 2-norm of the matrix is a bound of the derivative of J_t along joint motions
        # of norm 1. Take the smallest bound over all k.
        flat = (parts.reshape(n * d**k, -1) for k in range(order))
        flat = (part if len(part) < len(part.T) else part.T for part in flat)
        bounds[order - 2] = min(float(np.linalg.norm(part, 2)) for part in flat)
    point = elements.rotation.T @ (point - elements.tool)
    return ClearanceBounds(moving, point, bounds[0], bounds[1], bounds[2])
