"""
Covariances of the tool's pose and twist by what may be off in an arm.

Whatever may be off, a joint's position or a number of the table, moves the tool as a small motion
along a screw that stands still in some frame of the arm. So its derivatives follow from the frames
of one pass: where the screw is gives that of the pose; the twists of the arm before and behind it,
which it turns against each other, that of the twist.
"""

from typing import NamedTuple

import numpy as np

from ..layout import arrays, places
from ..layout.arrays import Flat, Floats, Integers, Numbers
from .chain import Chain

# The numbers of two covariances, of the pose and of the twist, 6 x 6 each.
COVARIANCES = 72


class PoseErrorTable(NamedTuple):
    """
    The arrays of what may be off.

    Attributes
    ----------
    frame : shape (screws,)
        The frame of the table in which each screw stands still, ascending.
    screw : shape (screws, 6)
        Along it, linear velocity of that frame's origin and angular velocity, in its axes.
    gear : shape (screws,)
        The joint that moves along it by a share more than it says; -1: it is moved by itself.
    spread : shape (screws, causes)
        How far each of independent causes, at one standard deviation, moves along it.
    rates : shape (n,)
        Standard deviations of the joint velocities, rad/s or m/s.
    floor : shape (6,)
        Variances that the pose has besides: x y z in m^2, rotations in rad^2.
    """

    frame: Integers
    screw: Floats
    gear: Integers
    spread: Floats
    rates: Floats
    floor: Floats


def _goes_together(chain: Chain, table: PoseErrorTable) -> bool:
    # Returns whether every index exists and every array is as long as the others say.
    screws = len(table.frame)
    return bool(
        table.screw.shape == (screws, 6)
        and table.gear.shape == (screws,)
        and np.all((table.gear >= -1) & (table.gear < chain.dof))
        and table.spread.ndim == 2
        and len(table.spread) == screws
        and table.rates.shape == (chain.dof,)
        and table.floor.shape == (6,)
        and np.all((table.frame >= 0) & (table.frame < chain.frames))
        and np.all(np.diff(table.frame) >= 0)
        and np.all(np.diff(chain.table.frame_parent) >= 0)
        and np.all(chain.table.joint < chain.dof)
    )


def _reaches(spread: Floats) -> Integers:
    # The first cause that moves along each screw, and one past the last.
    screws, causes = spread.shape
    found = np.zeros((screws, 2), dtype=np.int64)
    for one, row in zip(found, spread):
        moving = np.flatnonzero(row)
        if len(moving):
            one[0], one[1] = moving[0], moving[len(moving) - 1] + 1
    return found


class PoseErrors:
    """
    What may be off in an arm, as the kernel reads it: frozen.

    Attributes
    ----------
    chain
        Of the arm.
    table
        The arrays, read-only; the kernel has the same ones.
    reaches : shape (screws, 2)
        The causes that move along each screw: the first, and one past the last.
    screws, causes
        Their number.
    """

    def __init__(self, chain: Chain, table: PoseErrorTable) -> None:
        for array in table:
            array.setflags(write=False)
        if not _goes_together(chain, table):
            raise TypeError('the arrays of what may be off do not go together')
        self.chain, self.table, self.screws = chain, table, len(table.frame)
        self.causes: int = table.spread.shape[1]
        self.reaches: Integers = _reaches(table.spread)
        self.frame = arrays.whole(table.frame, self.screws)
        self.screw = arrays.numbers(table.screw, 6 * self.screws)
        self.gear = arrays.whole(table.gear, self.screws)
        self.spread = arrays.numbers(table.spread, self.screws * self.causes)
        self.rates = arrays.numbers(table.rates, chain.dof)
        self.floor = arrays.numbers(table.floor, 6)
        self.reach = arrays.whole(self.reaches, 2 * self.screws)


def room(errors: PoseErrors) -> int:
    """Return how many numbers `write_covariances` needs room for."""
    return 12 * errors.causes + 6 * errors.chain.dof


def _write_column(errors: PoseErrors, s: int, row: Flat, column: Numbers) -> None:
    # How the tool moves along a screw: linear velocity of its origin, angular velocity.
    T = arrays.after(row, errors.chain.frames_at + 16 * errors.frame[s])
    screw = arrays.after(errors.screw, 6 * s)
    for i in range(3):
        R = arrays.after(T, 4 * i)
        column[i] = R[0] * screw[0] + R[1] * screw[1] + R[2] * screw[2]
        column[3 + i] = R[0] * screw[3] + R[1] * screw[4] + R[2] * screw[5]
    x, y, z = row[3] - T[3], row[7] - T[7], row[11] - T[11]
    column[0] = column[0] + (column[4] * z - column[5] * y)
    column[1] = column[1] + (column[5] * x - column[3] * z)
    column[2] = column[2] + (column[3] * y - column[4] * x)


def _write_rate(column: Numbers, before: Numbers, twist: Flat, rate: Numbers) -> None:
    # How a motion along a screw changes the twist: what is behind it moves in another direction,
    # w x v; and the tool is elsewhere in the motion of what is before it.
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        vj, vk = twist[j] - before[j], twist[k] - before[k]
        wj, wk = twist[3 + j] - before[3 + j], twist[3 + k] - before[3 + k]
        rate[i] = (column[3 + j] * vk - column[3 + k] * vj) + (
            before[3 + j] * column[k] - before[3 + k] * column[j]
        )
        rate[3 + i] = column[3 + j] * wk - column[3 + k] * wj


def _drive(share: float, rate_of_share: float, column: Numbers, rate: Numbers) -> None:
    # From a motion along a screw to that by a share of a joint's position.
    for i in range(6):
        rate[i] = share * rate[i] + rate_of_share * column[i]
        column[i] = share * column[i]


def _turn_into_tool_axes(row: Flat, column: Numbers, twist: Flat, rate: Numbers) -> None:
    # The change of a twist's numbers in the axes of the tool, which turn with the error.
    turned = [0.0] * 6
    for part in range(0, 6, 3):
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            along = column[3 + j] * twist[part + k] - column[3 + k] * twist[part + j]
            turned[part + i] = rate[part + i] - along
        for i in range(3):
            rate[part + i] = (
                row[i] * turned[part]
                + row[4 + i] * turned[part + 1]
                + row[8 + i] * turned[part + 2]
            )


def _carry_on(chain: Chain, element: int, row: Flat, qdot: Flat, before: Numbers) -> None:
    # Adds an element's share of the twist to that of what is before it.
    screws = arrays.after(row, chain.screws_at)
    for e in range(chain.first_entry[element], chain.first_entry[element + 1]):
        rate = qdot[chain.joint[e]]
        for i in range(6):
            before[i] = before[i] + screws[i * chain.entries + e] * rate


def _add_causes(errors: PoseErrors, s: int, column: Numbers, moved: Flat) -> None:
    # Of the causes that move along a screw, what they do to the tool: moved (causes, 6). The six
    # are written out: the compiler takes two at once.
    spread = arrays.after(errors.spread, s * errors.causes)
    vx, vy, vz = column[0], column[1], column[2]
    wx, wy, wz = column[3], column[4], column[5]
    for k in range(errors.reach[2 * s], errors.reach[2 * s + 1]):
        along, one = spread[k], arrays.after(moved, 6 * k)
        one[0] += vx * along
        one[1] += vy * along
        one[2] += vz * along
        one[3] += wx * along
        one[4] += wy * along
        one[5] += wz * along


def _write_noise(errors: PoseErrors, row: Flat, in_tool_axes: bool, moved: Flat) -> None:
    # The noise of each velocity is a cause of its own: what it does to the twist, moved (n, 6).
    n = errors.chain.dof
    twist = arrays.after(row, places.JACOBIAN_AT + 6 * n)
    still, rate = [0.0] * 6, [0.0] * 6
    for j in range(n):
        for i in range(6):
            rate[i] = row[places.JACOBIAN_AT + n * i + j] * errors.rates[j]
        if in_tool_axes:
            _turn_into_tool_axes(row, still, twist, rate)
        arrays.copy(arrays.after(moved, 6 * j), 6, rate)


def _write_products(moved: Flat, count: int, covariance: Flat) -> None:
    # The sum of products of each two of (count, 6).
    sums = [0.0] * 36
    for k in range(count):
        one = arrays.after(moved, 6 * k)
        for i in range(6):
            for j in range(6):
                sums[6 * i + j] += one[i] * one[j]
    arrays.copy(covariance, 36, sums)


def write_covariances(
    errors: PoseErrors,
    row: Flat,
    q: Flat,
    qdot: Flat,
    of_pose: bool,
    of_twist: bool,
    in_tool_axes: bool,
    covariances: Flat,
    work: Flat,
) -> None:
    """
    Write the covariance of the pose, and behind it that of the twist: those that are wanted.

    In base axes; with `in_tool_axes` that of the twist is of its numbers in the axes of the tool.

    Parameters
    ----------
    errors
        What may be off.
    row, q, qdot
        As `evaluate` fills it with ALL_FRAMES, at these joint positions and velocities.
    covariances : shape (2, 6, 6)
        Rows and columns x y z of the tool's origin, rotations about x y z.
    work
        Has room for `room` numbers.
    """
    n, causes = errors.chain.dof, errors.causes
    changed = arrays.after(work, 6 * causes)
    twist = arrays.after(row, places.JACOBIAN_AT + 6 * n)
    column, rate, before = [0.0] * 6, [0.0] * 6, [0.0] * 6
    arrays.fill(work, 12 * causes + 6 * n, 0.0)
    element = 0
    for s in range(errors.screws):
        _write_column(errors, s, row, column)
        if of_twist:
            while element <= errors.chain.frame_parent[errors.frame[s]]:
                _carry_on(errors.chain, element, row, qdot, before)
                element += 1
            _write_rate(column, before, twist, rate)
        gear = errors.gear[s]
        if gear >= 0:
            _drive(q[gear], qdot[gear], column, rate)
        if of_pose:
            _add_causes(errors, s, column, work)
        if of_twist:
            if in_tool_axes:
                _turn_into_tool_axes(row, column, twist, rate)
            _add_causes(errors, s, rate, changed)
    if of_pose:
        _write_products(work, causes, covariances)
        for i in range(6):
            covariances[7 * i] += errors.floor[i]
    if of_twist:
        _write_noise(errors, row, in_tool_axes, arrays.after(changed, 6 * causes))
        _write_products(changed, causes + n, arrays.after(covariances, 36))


def covariances(
    errors: PoseErrors,
    rows: Floats,
    q: Floats,
    qdot: Floats,
    in_tool_axes: bool,
    results: Floats,
) -> None:
    """
    Fill `results` (N, 2, 6, 6) with the covariances of pose and twist of each evaluated row.

    Those of the twist are of its numbers in base axes, or in the axes of the tool.

    Parameters
    ----------
    errors
        What may be off.
    rows : shape (N, width)
        As `evaluate` filled them with ALL_FRAMES.
    q, qdot : shape (N, n), rad or m, rad/s or m/s
        Where they were evaluated.
    """
    n, count, width = errors.chain.dof, arrays.extent(rows, 0), arrays.extent(rows, 1)
    if width < errors.chain.width:
        raise TypeError('the arrays of covariances do not go together')
    table, positions = arrays.numbers(rows, 0), arrays.numbers(q, count * n)
    rates = arrays.numbers(qdot, count * n)
    found = arrays.results(results, COVARIANCES * count)
    work = arrays.scratch(room(errors))
    lock = arrays.let_go()
    for k in range(count):
        write_covariances(
            errors,
            arrays.after(table, k * width),
            arrays.after(positions, k * n),
            arrays.after(rates, k * n),
            True,
            True,
            in_tool_axes,
            arrays.after(found, COVARIANCES * k),
            work,
        )
    arrays.take_back(lock)
    arrays.give_back(work)
