# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Convert tool poses that a second source measured to 4 x 4 matrices."""

import math
from collections.abc import Callable, Iterator

import numpy as np

from ....kernel import Floats
from ....rigid_motion import exponential, rotation_of_quaternion
from ...checking.euler_orders import EULER_ORDERS, rotation_of_euler
from ...checking.pose_format import EULER, PoseFormat
from .block import Flags, Times
from .joint_format import LENGTHS
from .source import PoseTrack
from .stored_columns import Column, StateTable, spans

# Largest difference of a valid quaternion's norm from 1. It allows for float32 and few printed
# digits.
UNIT_LENGTH_TOLERANCE = 0.05
# If the ratio of rows without a valid pose exceeds this, all poses are refused. Otherwise only
# these rows are left out.
MAX_REJECTED_RATIO = 0.05
# Largest plausible distance (m) of the tool from the origin of the poses' frame, for an arm on a
# fixed base.
MAX_DISTANCE = 20.0
# Largest valid rotation vector or angle, rad: one turn plus 0.1 %. An angle that was printed with
# few digits may be rounded to slightly more than one turn.
MAX_ANGLE = 1.001 * math.tau
ANGLE_WORDS = {'rotvec': 'a rotation vector has the length', **dict.fromkeys(EULER, 'an angle is')}
# Norm of a valid quaternion, for the kinds of orientation that are quaternions.
QUATERNION_LENGTH = {'xyzw': 1.0, 'wxyz': 1.0}


class PoseRows:
    """
    Collects measured tool poses as rows of numbers, piece by piece, and converts them to matrices
    at the end.

    A few invalid rows, such as uninitialised first messages, are left out and reported.

    Parameters
    ----------
    form
        The format of the numbers of a pose.
    columns
        Number of columns of a pose.
    dof
        Number of joint positions in each row, or 0.

    Attributes
    ----------
    count
        Number of rows taken.
    """

    def __init__(self, form: PoseFormat, columns: int, dof: int = 0) -> None:
        self.count = 0
        self._form = form
        self._stamps, self._rows, self._q = Column(np.int64), StateTable(columns), StateTable(dof)
        self._numbers = Column(np.int64)
        self._finite = self._rising = True
        self._latest = -1
        # The most implausible orientation so far, as a number. For quaternions it is the norm that
        # differs most from 1. For rotation vectors it is the largest norm (rad), and for Euler
        # angles the largest angle (rad).
        self._worst = QUATERNION_LENGTH.get(form.kind, 0.0)
        # Rows of sixteen numbers are 4 x 4 matrices. `_upright` is true if all rows so far can be
        # matrices written row by row, `_turned` if all can be matrices written column by column.
        self._upright = self._turned = True

    def take(
        self, stamps: Times, rows: Floats, q: Floats | None = None, numbers: Times | None = None
    ) -> None:
        """
        Add the next N poses: their stamps (N,), ns, and their numbers `rows` (N, k).

        If the poses come from a table, `q` (N, n) has the joint positions in the table row of each
        pose, and `numbers` (N,) has the index of this table row.
        """
        finite = np.all(np.isfinite(rows), axis=1)
        self.count += len(rows)
        self._finite &= bool(np.all(finite))
        good = self._judged(rows[finite])
        kept = np.flatnonzero(finite)[good]
        steps = np.diff(stamps[kept], prepend=self._latest)
        self._rising &= bool(np.all(steps >= 0))
        self._latest = int(stamps[kept[-1]]) if len(kept) else self._latest
        self._stamps.append(stamps[kept])
        self._rows.append(rows[kept])
        if q is not None:
            self._q.append(q[kept])
        if numbers is not None:
            self._numbers.append(numbers[kept])

    def _judged(self, rows: Floats) -> Flags:
        # Returns whether each row is a valid pose. A quaternion must have a norm near 1.
        form = self._form
        if form.kind == 'matrix':
            if rows.shape[1] == 16:
                self._upright &= _is_last_row(rows[:, 12:])
                self._turned &= _is_last_row(rows[:, 3::4])
            return np.ones(len(rows), dtype=bool)
        numbers, usual = _numbers(rows[:, 3:], form), QUATERNION_LENGTH.get(form.kind, 0.0)
        norms = np.linalg.norm(numbers, axis=1)
        sizes = np.max(np.abs(numbers), axis=1) if form.kind in EULER else norms
        sizes_seen = np.append(sizes, self._worst)
        self._worst = float(sizes_seen[np.argmax(np.abs(sizes_seen - usual))])
        tolerance = UNIT_LENGTH_TOLERANCE if form.kind in QUATERNION_LENGTH else np.inf
        return np.asarray(np.abs(sizes - usual) <= tolerance)

    def track(self, name: str, frame: str, limit: int | None = None) -> PoseTrack:
        """
        Return the poses in the order of their stamps: all poses, or at most `limit` poses at equal
        distances in the list.
        """
        total = len(self._stamps)
        many = (self.count - total) / self.count > MAX_REJECTED_RATIO
        refused = self._refusal(many)
        if refused:
            none = np.zeros(0, dtype=np.int64), np.zeros((0, 4, 4))
            return PoseTrack(name, frame, *none, None, refused, (), self.count if many else total)
        chosen = slice(None) if limit is None else self._chosen(limit)
        return PoseTrack(
            name,
            frame,
            self._stamps[chosen],
            self._poses(self._rows[chosen]),
            self._q[chosen] if self._q.columns else None,
            '',
            tuple(self._doubts(total)),
            total,
            self._form.kind,
            self._numbers[chosen] if len(self._numbers) else None,
        )

    def _refusal(self, many: bool) -> str:
        kind = self._form.kind
        if many and not self._finite:
            return 'a pose is not finite'
        if many:
            return f'a quaternion has the length {self._worst:.3g}, which should be 1'
        if kind in ANGLE_WORDS and self._worst > MAX_ANGLE:
            return _more_than_a_turn(ANGLE_WORDS[kind], self._worst, self._form)
        if not self._upright and not self._turned:
            return 'a matrix has no row 0 0 0 1, so it is no pose'
        return ''

    def _chosen(self, limit: int) -> Times:
        rows: Times = np.unique(np.linspace(0, len(self._stamps) - 1, limit).astype(np.int64))
        return rows if self._rising else np.argsort(self._stamps[:], kind='stable')[rows]

    def _doubts(self, total: int) -> Iterator[str]:
        if total < self.count:
            yield (
                f'{self.count - total:,} of {self.count:,} poses are left out: they are not '
                'finite or have a quaternion that is not of unit length'
            )
        form, far = self._form, 0.0
        for k in self._position_columns():
            column = self._rows.columns[k]
            for rows in spans(total):
                far = max(far, float(np.max(np.abs(column[rows] * LENGTHS[form.length]))))
        if far > MAX_DISTANCE:
            ask = ': are these millimetres? (--pose-format mm)' if form.length == 'm' else ''
            yield f'positions are up to {far:,.0f} m away{ask}'

    def _position_columns(self) -> tuple[int, int, int]:
        if self._form.kind != 'matrix':
            return 0, 1, 2
        return (3, 7, 11) if self._upright else (12, 13, 14)

    def _poses(self, rows: Floats) -> Floats:
        form = self._form
        T = np.zeros((len(rows), 4, 4))
        T[:, 3, 3] = 1.0
        if form.kind == 'matrix':
            numbers = rows.reshape(len(rows), -1, 4)
            T[:, :3] = (numbers if self._upright else np.swapaxes(numbers, 1, 2))[:, :3]
        else:
            T[:, :3, :3], T[:, :3, 3] = ROTATIONS[form.kind](rows[:, 3:], form), rows[:, :3]
        T[:, :3, 3] *= LENGTHS[form.length]
        return T


def _is_last_row(numbers: Floats) -> bool:
    return bool(np.allclose(numbers, (0.0, 0.0, 0.0, 1.0), atol=1e-6))


ROTATIONS: dict[str, Callable[[Floats, PoseFormat], Floats]] = {
    'xyzw': lambda numbers, form: rotation_of_quaternion(numbers),
    'wxyz': lambda numbers, form: rotation_of_quaternion(np.roll(numbers, -1, axis=1)),
    'rotvec': lambda numbers, form: exponential(_numbers(numbers, form)),
    'rpy': lambda numbers, form: rotation_of_euler('xyz', _numbers(numbers, form)),
    'position': lambda numbers, form: np.tile(np.eye(3), (len(numbers), 1, 1)),
    **dict.fromkeys(
        EULER_ORDERS, lambda numbers, form: rotation_of_euler(form.kind, _numbers(numbers, form))
    ),
}


def _numbers(orientations: Floats, form: PoseFormat) -> Floats:
    # Returns the orientations (N, k) with angles and rotation vectors converted to rad.
    in_degrees = form.angle == 'deg' and form.kind not in QUATERNION_LENGTH
    return np.radians(orientations) if in_degrees else orientations


def _more_than_a_turn(words: str, angle: float, form: PoseFormat) -> str:
    if form.angle == 'deg':
        return f'{words} {math.degrees(angle):.4g} deg, more than a turn'
    other = 'deg' if form.kind in EULER else 'deg, or deg,rpy if they are roll pitch yaw'
    return f'{words} {angle:.4g} rad, more than a turn: are these degrees? (--pose-format {other})'
