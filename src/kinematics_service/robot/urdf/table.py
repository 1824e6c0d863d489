# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the Denavit-Hartenberg table of a URDF chain from common normals of the joint axes.

Each row is computed in the frame after the previous rows, with all joints at 0. The numbers of the
previous rows are already rounded as in the robot file that is written, so each row corrects the
round-off of the previous rows.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from ...kernel import Floats
from ...rigid_motion import exact_rpy, inverse, pose_of, screw_x, screw_z
from .chain import UrdfChain, moved
from .quantity import ROUND_OFF, WrittenNumber, angle_of, length_of

# Axes count as parallel if the angle between them is less than this, rad. Such a small angle is
# round-off. It would put the common normal of the axes at an arbitrary position.
PARALLEL_TOLERANCE = 1e-13
# Largest accepted distance from a joint to the origin of its table frame, divided by the length of
# the chain. Let B be the axis of the joint, and A the axis of the previous joint. The origin is
# the point where the common normal of A and B meets B. If A and B are nearly parallel (a URDF with
# rpy="1.5708"), the origin may be kilometres away, and the pose would lose digits. If the distance
# is too large, the table has two rows from A to B, and an additional z axis between A and B. The
# additional axis crosses B at a right angle.
MAX_NORMAL_DISTANCE = 2.0
# Limit, rad, of the angle from the last joint's axis to the tip's z axis. An angle below the limit
# becomes part of the tool pose. A larger angle becomes alpha of the last row.
TOOL_AXIS_TOLERANCE = 1e-3
# If |theta| of a row would be above this, rad, theta is changed by pi, and the sign of a or alpha
# is changed. The value is a right angle plus a tolerance. Without the tolerance, round-off could
# change a theta of exactly pi/2.
RIGHT_ANGLE = math.pi / 2.0 + 1e-9


@dataclass(frozen=True)
class Term:
    """
    A term of theta (if `turns`) or of d: a factor times the joint variable with index `variable`.
    """

    turns: bool
    variable: int
    factor: float


@dataclass(frozen=True)
class UrdfRow:
    """
    A row Rz(theta) Tz(d) Tx(a) Rx(alpha) of a table; `terms` are added to theta and d.

    Parameters
    ----------
    follows
        Whether the joint of the row mimics another joint.
    """

    theta: WrittenNumber
    d: WrittenNumber
    a: WrittenNumber
    alpha: WrittenNumber
    terms: tuple[Term, ...] = ()
    follows: bool = False


@dataclass(frozen=True)
class ConstantPose:
    """A constant pose with the numbers that the robot file has, R = Rz(yaw) Ry(pitch) Rx(roll)."""

    xyz: tuple[WrittenNumber, ...]
    rpy: tuple[WrittenNumber, ...]

    @property
    def matrix(self) -> Floats:
        """Return the pose as a matrix, shape (4, 4), translation in m."""
        roll, pitch, yaw = (angle.value for angle in self.rpy)
        return pose_of([length.value for length in self.xyz], (roll, pitch, yaw))


@dataclass(frozen=True)
class UrdfTable:
    """
    The rows of a table, and the constant poses of base and tool.

    `base` is the pose of frame 0 in the base link, `tool` the pose of the tip in the frame after
    the last row.
    """

    rows: tuple[UrdfRow, ...]
    base: ConstantPose
    tool: ConstantPose


@dataclass(frozen=True, eq=False)
class _Line:
    # A joint axis: a point on the axis, m, and its direction, a unit vector, (3,) each.
    point: Floats
    direction: Floats

    def seen_from(self, T: Floats) -> '_Line':
        back = inverse(T)
        return _Line(back[:3, :3] @ self.point + back[:3, 3], back[:3, :3] @ self.direction)


def table_of(chain: UrdfChain) -> UrdfTable:
    """Return the table of a URDF's chain in the standard convention."""
    lines, tip = _lines(chain)
    size = sum(float(np.linalg.norm(motion.before[:3, 3])) for motion in chain.motions)
    size += float(np.linalg.norm(chain.end[:3, 3]))
    base = _base(lines[0])
    T, sign = base.matrix, 1.0
    rows: list[UrdfRow] = []
    for joint, next_joint, line in zip(chain.motions, [*chain.motions[1:], None], lines[1:]):
        line = line.seen_from(T)
        if next_joint is not None and not next_joint.turns:
            # The next joint is prismatic, so only the direction of its axis has an effect. Use an
            # axis through the origin of the present frame.
            line = _Line(np.zeros(3), line.direction)
        next_sign = 1.0
        if next_joint is not None and (joint.follows or next_joint.follows) and _coincide(line):
            # The axes of the two joints are one line, so the joints will be in one row of the
            # table. If the axis of the next joint has the direction of -z, the term of the next
            # joint gets a minus sign.
            next_sign = math.copysign(1.0, line.direction[2])
        line = _Line(line.point, next_sign * line.direction)
        steps = _last_steps(line, size) if next_joint is None else _steps(line, size)
        term = Term(joint.turns, joint.variable, sign * joint.factor)
        rows += [replace(steps[0], terms=(term,), follows=joint.follows), *steps[1:]]
        for step in steps:
            T = T @ _matrix(step)
        sign = next_sign
    return UrdfTable(tuple(_merged(rows)), base, _pose(inverse(T) @ tip))


def modified(table: UrdfTable) -> UrdfTable:
    """
    Convert a standard table to Craig's convention: move a and alpha of each row to the next row.

    The a and alpha of the last row become part of the tool.
    """
    rows, zero = [], length_of(0.0)
    a, alpha = zero, zero
    for row in table.rows:
        rows.append(replace(row, a=a, alpha=alpha))
        a, alpha = row.a, row.alpha
    tool = table.tool
    if (a.value, alpha.value) != (0.0, 0.0):
        tool = _pose(screw_x(alpha.value, a.value) @ tool.matrix)
    return UrdfTable(tuple(rows), table.base, tool)


def _lines(chain: UrdfChain) -> tuple[list[_Line], Floats]:
    # Return the joint axes at q = 0, followed by the z axis of the tip. Return also the pose of
    # the tip.
    T = np.eye(4)
    lines = []
    for motion in chain.motions:
        T = T @ motion.before
        lines.append(_Line(T[:3, 3], T[:3, :3] @ motion.axis))
        T = T @ moved(motion.turns, motion.axis, np.array([motion.offset]))[0]
    T = T @ chain.end
    return [*lines, _Line(T[:3, 3], T[:3, 2])], T


def _base(line: _Line) -> ConstantPose:
    # Return the pose of frame 0 in the base link. The z axis of frame 0 is the first joint axis.
    # The origin of frame 0 is the point on the first joint axis that is nearest to the origin of
    # the base link.
    theta, alpha = _turns(line.direction)
    nearest = line.point - (line.point @ line.direction) * line.direction
    zero = length_of(0.0)
    return ConstantPose(tuple(map(length_of, nearest)), (angle_of(alpha), zero, angle_of(theta)))


def _pose(T: Floats) -> ConstantPose:
    return ConstantPose(
        tuple(map(length_of, T[:3, 3])), tuple(map(angle_of, exact_rpy(T[:3, :3])))
    )


def _matrix(row: UrdfRow) -> Floats:
    return screw_z(row.theta.value, row.d.value) @ screw_x(row.alpha.value, row.a.value)


def _row(theta: float, d: float, a: float, alpha: float) -> UrdfRow:
    return UrdfRow(angle_of(theta), length_of(d), length_of(a), angle_of(alpha))


def _parallel(direction: Floats) -> bool:
    return math.hypot(direction[0], direction[1]) < PARALLEL_TOLERANCE


def _coincide(line: _Line) -> bool:
    x, y, _ = line.point
    return _parallel(line.direction) and math.hypot(x, y) <= ROUND_OFF


def _turns(direction: Floats) -> tuple[float, float]:
    # Return theta and alpha with Rz(theta) Rx(alpha) z = direction, and |theta| <= pi/2.
    x, y, z = direction
    if _parallel(direction):
        return 0.0, 0.0 if z > 0.0 else math.pi
    theta, alpha = math.atan2(x, -y), math.atan2(math.hypot(x, y), z)
    if abs(theta) > RIGHT_ANGLE:
        return theta - math.copysign(math.pi, theta), -alpha
    return theta, alpha


def _step(line: _Line) -> tuple[UrdfRow, float]:
    # Return a row that leads to a frame whose z axis is the line `line`, and the distance from
    # `line.point` to the origin of this frame. The line is given in the frame before the row. The
    # common normal of the old z axis and the line has the direction n = (cos theta, sin theta, 0).
    # Let m = (-sin theta, cos theta, 0). The direction of the line is
    # W = -sin(alpha) m + cos(alpha) z. The new origin is point + t W. It lies on the common
    # normal, which crosses the old z axis. So (point + t W).m = 0, and t = point.m / sin(alpha).
    x, y, z = line.point
    theta, alpha = _turns(line.direction)
    if _parallel(line.direction):
        # Parallel axes have many common normals. Use the common normal through the origin of the
        # present frame, so that d is 0.
        a = math.hypot(x, y)
        theta = math.atan2(y, x) if a > ROUND_OFF else 0.0
        if abs(theta) > RIGHT_ANGLE:
            theta, a = theta - math.copysign(math.pi, theta), -a
        return _row(theta, 0.0, a if abs(a) > ROUND_OFF else 0.0, alpha), abs(z)
    c, s = math.cos(theta), math.sin(theta)
    t = (c * y - s * x) / math.sin(alpha)
    return _row(theta, z + t * math.cos(alpha), c * x + s * y, alpha), abs(t)


def _steps(line: _Line, size: float) -> list[UrdfRow]:
    row, away = _step(line)
    if _parallel(line.direction) or away <= MAX_NORMAL_DISTANCE * size:
        return [row]
    # The present z axis and the next axis are nearly parallel. Return two rows with an additional
    # z axis between the two axes. The additional axis goes through the point P where the next axis
    # crosses the present xy plane. The additional axis is perpendicular to the next axis, and
    # nearly perpendicular to the line from the present origin to P.
    W = line.direction
    point = line.point - line.point[2] / W[2] * W
    distance = math.hypot(point[0], point[1])
    x, y = point[:2] / distance if distance > ROUND_OFF else (1.0, 0.0)
    across = np.array([-y, x, 0.0])
    across -= (across @ W) * W
    first, _ = _step(_Line(point, across / np.linalg.norm(across)))
    second, _ = _step(_Line(point, W).seen_from(_matrix(first)))
    return [first, second]


def _last_steps(line: _Line, size: float) -> list[UrdfRow]:
    # Return the last row. After this row, the z axis of the frame is the z axis of the tip. The
    # constant rotation about this axis and shift along it become part of the tool pose.
    z = line.direction[2]
    if math.hypot(*line.direction[:2]) < TOOL_AXIS_TOLERANCE:
        row, _ = _step(_Line(line.point, np.array([0.0, 0.0, math.copysign(1.0, z)])))
        return [replace(row, d=length_of(line.point[2]))]
    row, away = _step(line)
    return [row] if away <= MAX_NORMAL_DISTANCE * size else [_row(0.0, 0.0, 0.0, 0.0)]


def _merged(rows: list[UrdfRow]) -> list[UrdfRow]:
    # If one of several joints on one axis is a mimic joint, merge their rows into one row, such as
    # `theta: q3 - q2`.
    result = rows[:1]
    for row in rows[1:]:
        last = result[-1]
        if (last.a.value, last.alpha.value) == (0.0, 0.0) and (
            last.terms and row.terms and (last.follows or row.follows)
        ):
            result[-1] = replace(
                row,
                theta=angle_of(last.theta.value + row.theta.value),
                d=length_of(last.d.value + row.d.value),
                terms=_sum((*last.terms, *row.terms)),
                follows=True,
            )
        else:
            result.append(row)
    return result


def _sum(terms: tuple[Term, ...]) -> tuple[Term, ...]:
    factors: dict[tuple[bool, int], float] = {}
    for term in terms:
        key = (term.turns, term.variable)
        factors[key] = factors.get(key, 0.0) + term.factor
    return tuple(Term(*key, factor) for key, factor in factors.items() if factor != 0.0)
