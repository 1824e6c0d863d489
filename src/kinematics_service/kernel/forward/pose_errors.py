# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute covariances of the tool's pose and twist by linear error propagation.

An error of a joint position or of a number of the DH table moves the tool along a screw. Each
screw is fixed in one frame of the DH table. One pass over the chain computes the poses of the
frames. The screw, in base axes, is the derivative of the tool pose by the error. The derivative of
the tool's twist by the error follows from two parts of the twist: the part due to the joints from
the base to the screw, and the part due to the joints from the screw to the tool.
"""

from typing import NamedTuple

import numpy as np

from ..layout import arrays, places
from ..layout.arrays import Flat, Floats, Integers, Numbers
from .chain import Chain

# Count of numbers in the covariances of pose and twist together: two 6 x 6 matrices.
COVARIANCES = 72


class PoseErrorTable(NamedTuple):
    """
    The arrays that describe the errors of an arm. Errors move the tool along screws. A cause, for
    example a wrong length in the DH table, produces motions along one or several screws.

    Attributes
    ----------
    frame : shape (screws,)
        Index of the frame of the DH table in which each screw is constant; the screws are sorted
        by this index.
    screw : shape (screws, 6)
        Linear velocity of the origin of the frame, and angular velocity, in the axes of the frame.
    gear : shape (screws,)
        Index of a joint if the motion along the screw is caused by a scale error of this joint. A
        scale error is relative, so the motion is proportional to the position of the joint. -1 for
        all other errors.
    spread : shape (screws, causes)
        The motion along each screw that one standard deviation of each independent cause produces.
    rates : shape (n,)
        Standard deviations of the joint velocities, rad/s or m/s.
    floor : shape (6,)
        Variances that are added to the diagonal of the covariance of the pose: x y z in m^2,
        rotations in rad^2.
    """

    frame: Integers
    screw: Floats
    gear: Integers
    spread: Floats
    rates: Floats
    floor: Floats


def _goes_together(chain: Chain, table: PoseErrorTable) -> bool:
    # Returns whether all indices in the table are valid and the lengths of its arrays agree.
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
    # A cause is a source of errors, for example a wrong length in the DH table. Returns for each
    # screw the causes that move the tool along the screw, as a range, shape (screws, 2): the index
    # of the first of these causes, and the index of the last plus 1. Both numbers are 0 if no
    # cause moves the tool along the screw.
    ranges = np.zeros((len(spread), 2), dtype=np.int64)
    for bounds, row in zip(ranges, spread):
        moving = np.flatnonzero(row)
        if len(moving):
            bounds[0], bounds[1] = moving[0], moving[len(moving) - 1] + 1
    return ranges


class PoseErrors:
    """
    The errors of an arm, as the kernel uses them; immutable.

    An error has a cause, for example a wrong length in the DH table. A cause moves the tool along
    one or several screws.

    Attributes
    ----------
    chain
        The chain of the arm.
    table
        The arrays of the errors, read-only; the kernel reads these arrays without a copy.
    reaches : shape (screws, 2)
        For each screw, a range of indices of causes: the first index, and the last index plus 1.
        Causes outside of the range do not move the tool along the screw.
    screws, causes
        Number of screws, and number of causes.
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
    """Return how many numbers of scratch memory `write_covariances` needs."""
    return 12 * errors.causes + 6 * errors.chain.dof


def _write_column(errors: PoseErrors, s: int, row: Flat, column: Numbers) -> None:
    # Writes to `column` the motion of the tool along screw s: linear velocity of the tool's origin
    # and angular velocity, in base axes.
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
    # Writes to `rate` the change of the tool's twist by a unit motion along a screw. The twist has
    # two parts. The part `before` comes from the joints between the base and the screw. The part
    # `twist` - `before` comes from the joints between the screw and the tool, and the motion
    # rotates this part. The motion also moves the tool's origin, so it changes the linear velocity
    # in `before`.
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        vj, vk = twist[j] - before[j], twist[k] - before[k]
        wj, wk = twist[3 + j] - before[3 + j], twist[3 + k] - before[3 + k]
        rate[i] = (column[3 + j] * vk - column[3 + k] * vj) + (
            before[3 + j] * column[k] - before[3 + k] * column[j]
        )
        rate[3 + i] = column[3 + j] * wk - column[3 + k] * wj


def _turn_into_tool_axes(row: Flat, column: Numbers, twist: Flat, rate: Numbers) -> None:
    # An error of a joint position or of a number of the DH table moves the tool. The motion is
    # `column` (linear, angular), and `rate` is the change of the tool's twist, both in base axes.
    # Converts `rate` to tool axes. The angular part of `column` rotates the tool axes, so it also
    # changes the components of the twist in tool axes.
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
    # Adds the twist of one element to `before`, so that `before` is the twist of the part of the
    # arm up to this element.
    screws = arrays.after(row, chain.screws_at)
    for e in range(chain.first_entry[element], chain.first_entry[element + 1]):
        rate = qdot[chain.joint[e]]
        for i in range(6):
            before[i] = before[i] + screws[i * chain.entries + e] * rate


def _add_causes(errors: PoseErrors, s: int, column: Numbers, moved: Flat) -> None:
    # A cause is a source of errors, for example a wrong length in the DH table. Row k of `moved`
    # (causes, 6) has the change of the tool's pose or twist that cause k produces. Adds to each
    # row the part of this change that comes from motion along screw s. `column` has the change for
    # a unit motion along screw s.
    # The loop has one line for each of the six components instead of an inner loop, because the
    # compiler then makes instructions that each compute two components.
    spread = arrays.after(errors.spread, s * errors.causes)
    vx, vy, vz = column[0], column[1], column[2]
    wx, wy, wz = column[3], column[4], column[5]
    for k in range(errors.reach[2 * s], errors.reach[2 * s + 1]):
        along, motion = spread[k], arrays.after(moved, 6 * k)
        motion[0] += vx * along
        motion[1] += vy * along
        motion[2] += vz * along
        motion[3] += wx * along
        motion[4] += wy * along
        motion[5] += wz * along


def _write_noise(errors: PoseErrors, row: Flat, in_tool_axes: bool, moved: Flat) -> None:
    # Writes to row j of `moved` (n, 6) the change of the tool's twist if the velocity of joint j
    # changes by one standard deviation.
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
    # Writes the matrix product M^T M to `covariance` (6, 6), where M is `moved` (count, 6).
    sums = [0.0] * 36
    for k in range(count):
        motion = arrays.after(moved, 6 * k)
        for i in range(6):
            for j in range(6):
                sums[6 * i + j] += motion[i] * motion[j]
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
    Write the covariances (6, 6) of pose and twist for one row of results.

    If `of_pose` is set, the covariance of the pose is written, in base axes. If `of_twist` is set,
    the covariance of the twist is written: in tool axes if `in_tool_axes` is set, otherwise in
    base axes.

    Parameters
    ----------
    errors
        The errors of the arm.
    row, q, qdot
        A row of results of `evaluate` with depth ALL_FRAMES, and the joint positions and
        velocities of this row.
    covariances : shape (2, 6, 6)
        Pose, then twist. Rows and columns: x y z of the tool's origin, rotations about x y z.
    work
        Scratch memory for `room` numbers.
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
            # The error is a relative error of a joint's scale. It moves the tool along the screw
            # of this joint, in proportion to the joint position q. Let c be the screw, `column`.
            # Then the motion for a unit error is q c, and its rate is q dc/dt + qdot c.
            for i in range(6):
                rate[i] = q[gear] * rate[i] + qdot[gear] * column[i]
                column[i] = q[gear] * column[i]
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
    Fill `results` (N, 2, 6, 6) with the covariances of pose and twist at N joint positions.

    The covariance of the pose is in base axes. The covariance of the twist is in tool axes if
    `in_tool_axes` is set, otherwise in base axes.

    Parameters
    ----------
    errors
        The errors of the arm.
    rows : shape (N, width)
        The row of results of `evaluate` at each of the joint positions, with depth ALL_FRAMES.
    q, qdot : shape (N, n), rad or m, rad/s or m/s
        Joint positions and velocities of the rows.
    """
    n, count, width = errors.chain.dof, arrays.extent(rows, 0), arrays.extent(rows, 1)
    if width < errors.chain.width:
        raise TypeError('the arrays of covariances do not go together')
    table, positions = arrays.numbers(rows, 0), arrays.numbers(q, count * n)
    rates = arrays.numbers(qdot, count * n)
    filled = arrays.results(results, COVARIANCES * count)
    work = arrays.scratch(room(errors))
    with arrays.without_lock():
        for k in range(count):
            write_covariances(
                errors,
                arrays.after(table, k * width),
                arrays.after(positions, k * n),
                arrays.after(rates, k * n),
                True,
                True,
                in_tool_axes,
                arrays.after(filled, COVARIANCES * k),
                work,
            )
    arrays.give_back(work)
