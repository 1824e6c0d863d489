"""What the lengths of an arm say of its Jacobian at every pose: bounds of how it bends."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .. import kernel
from ..kernel import Chain, ChainTable, Floats, Integers
from .task import Task

# With more entries no derivatives beyond the second are bounded: there are entries^5 parts of the
# fourth.
MOST_ENTRIES = 12
# Axes nearer to parallel (sine of their angle) have no common point.
PARALLEL = 1e-6
# Of sums of lengths, as a share.
ROUND_OFF = 1e-12


class ClearanceBounds(NamedTuple):
    """
    What `kernel.Clearance` takes of an arm, as it is documented there.

    Attributes
    ----------
    moving : shape (d,)
        The joints that can change the rank of J_t.
    point : shape (3,), m
        In the axes of the tool, from its origin.
    bend, twist, fourth
        Bounds of the second, third and fourth derivatives.
    """

    moving: Integers
    point: Floats
    bend: float
    twist: float
    fourth: float


class _Elements(NamedTuple):
    """The elements of a chain at some joint positions, in the base frame."""

    turns: npt.NDArray[np.bool_]
    axis: Floats
    point: Floats
    tool: Floats
    rotation: Floats


def _elements(chain: Chain, q: Floats) -> _Elements:
    row = np.zeros(chain.widths[kernel.JACOBIAN])
    kernel.evaluate(chain, q[None], np.zeros((1, chain.dof)), kernel.JACOBIAN, row[None])
    pose = row[:16].reshape(4, 4)
    screws = row[chain.screws_at : chain.screws_at + 6 * chain.entries].reshape(6, -1).T
    first = chain.table.first_entry
    count = len(first) - 1
    turns, axis, point = np.zeros(count, bool), np.zeros((count, 3)), np.zeros((count, 3))
    for k in range(count):
        entries = range(first[k], first[k + 1])
        # The entry that turns the element most has its axis; v = w x (tool - point).
        e = max(entries, key=lambda entry: abs(chain.table.by_theta[entry]))
        if chain.table.by_theta[e] != 0.0:
            v, w = screws[e, :3], screws[e, 3:]
            size = np.linalg.norm(w)
            turns[k], axis[k] = True, w / size
            point[k] = pose[:3, 3] + np.cross(w, v) / size**2
    return _Elements(turns, axis, point, pose[:3, 3], pose[:3, :3])


def _point(elements: _Elements, six_rows: bool, farthest: float) -> Floats:
    # Where all six rows count, the point of the last axis that is nearest to the axis before it:
    # the centre of a spherical wrist. The rank of J is the same for each point of the tool. Of
    # axes that are nearly parallel it may be anywhere: where it is far away it is of no use.
    if not six_rows or len(elements.turns) < 2 or not elements.turns[-2:].all():
        return elements.tool
    a, b = elements.axis[-1], elements.axis[-2]
    p, o = elements.point[-1], elements.point[-2]
    across = np.cross(a, b)
    square = float(across @ across)
    along = np.linalg.det(np.array([o - p, b, across])) / square if square > PARALLEL**2 else 0.0
    point = np.asarray(p + a * along)
    return point if np.linalg.norm(point - elements.tool) <= farthest else elements.tool


class _Feet(NamedTuple):
    """How far a point can come from the axis of each element, shape (d,), and from which point."""

    farthest: Floats
    first: Floats


def _feet(chain: Chain, elements: _Elements, point: Floats, strokes: Floats) -> _Feet:
    # The sum of the ways from foot to foot along the axes, which never change, and of the ways
    # that elements slide.
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
    """A sphere in the base frame that the tool never leaves: its centre (3,) and radius, m."""

    centre: Floats
    radius: float


def reach_of(chain: Chain, limits: Floats) -> Reach:
    """
    Return what the tool never leaves while sliding joints are inside limits (n, 2), rad or m.

    What passive variables of loops slide is not bounded: then it is infinite.
    """
    elements = _elements(
        chain, np.zeros(chain.dof) if chain.closure is None else chain.closure.assembled()
    )
    strokes = np.full(max(chain.dof, int(np.max(chain.table.joint)) + 1), np.inf)
    strokes[: chain.dof] = np.max(np.abs(limits), axis=1)
    feet = _feet(chain, elements, elements.tool, strokes)
    # With what the sum is off by.
    still = float(np.max(np.abs(elements.point)))
    return Reach(feet.first, (1.0 + ROUND_OFF) * float(feet.farthest[0]) + ROUND_OFF * still)


def moving_joints(chain: Chain, task: Task) -> Integers:
    """
    Return the joints that can change the rank of J_t, shape (d,).

    The first joint turns or moves all columns alike, the last one moves none of them, where that
    is all it drives; and so do those behind and before it about the same axis. Joints of closed
    loops always count.
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
    # The entries of the first elements that have one axis, each of a joint that drives no other.
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
    # Shape (entries, ...): at most so large is the derivative of a column by `order` entries:
    # the product of their angular velocities and the speed of the last of all in the chain; for
    # the angular rows, of all that are before the column.
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
    # Entries become joints, each with what a unit of it counts.
    scales = np.zeros((chain.dof, E))
    scales[table.joint, np.arange(E)] = task.column_scales[table.joint]
    for axis in range(order + 1):
        parts = np.moveaxis(np.tensordot(scales, parts, axes=(1, axis)), 0, axis)
    return np.asarray(parts)


def _norm(matrix: Floats) -> float:
    return float(np.linalg.norm(matrix, 2))


def strokes_of(chain: Chain, limits: Floats) -> Floats:
    """
    Return how far from zero the limits let each sliding joint be, shape (n,); -1 without limits.

    0 for joints that only turn.
    """
    slides = np.zeros(chain.dof, bool)
    slides[chain.table.joint[chain.table.by_d != 0.0]] = True
    farthest = np.max(np.abs(limits), axis=1)
    return np.where(slides, np.where(np.isfinite(farthest), farthest, -1.0), 0.0)


def find_bounds(chain: Chain, task: Task, strokes: Floats) -> ClearanceBounds:
    """
    Return the bounds of an arm, within kernel.FARTHEST of poses inside the strokes.

    Parameters
    ----------
    chain, task
        The arm.
    strokes : shape (n,), rad or m
        How far from zero each joint is; only those of sliding ones count.
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
    for order in (2, 3, 4) if chain.entries <= MOST_ENTRIES else (2,):
        parts = _largest_parts(chain, task, farthest, order)
        parts = parts[np.ix_(np.arange(n), *[moving] * order)]
        # The flattenings of a tensor with many indices bound what it does along one direction.
        flat = (parts.reshape(n * d**k, -1) for k in range(order))
        bounds[order - 2] = min(_norm(one if len(one) < len(one.T) else one.T) for one in flat)
    point = elements.rotation.T @ (point - elements.tool)
    return ClearanceBounds(moving, point, bounds[0], bounds[1], bounds[2])
