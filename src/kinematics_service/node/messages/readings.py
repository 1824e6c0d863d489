# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Convert messages of the node to plain data, for the screen and for JSON."""

from typing import NamedTuple

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import (
    AccelStamped,
    Point,
    Pose,
    Quaternion,
    TwistStamped,
    Vector3,
    WrenchStamped,
)
from std_msgs.msg import Float64, Float64MultiArray, Header

from ...errors import LayoutError
from ...kernel import Floats
from ...rigid_motion import rotation_of_quaternion
from ...robot.measures import Level


class Stamp(NamedTuple):
    """A time as two integers, because a double cannot hold a present time to the nanosecond."""

    sec: int
    nanosec: int

    @classmethod
    def of(cls, header: Header) -> 'Stamp':
        """Return the stamp in a message header."""
        return cls(int(header.stamp.sec), int(header.stamp.nanosec))


class ScaleReading(NamedTuple):
    """The scale of a commanded joint velocity, 0 to 1: the allowed fraction of the velocity."""

    scale: float


class JacobianReading(NamedTuple):
    """A Jacobian (rows, columns), with labels of its rows and columns."""

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    jacobian: Floats


class VectorReading(NamedTuple):
    """
    Two vectors (3,) by name, such as a twist, in the axes of `frame`; a wrench refers to the
    origin of this frame.
    """

    stamp: Stamp
    frame: str
    vectors: dict[str, Floats]


class VectorPair(NamedTuple):
    """
    A kind of message that consists of two vectors, such as a twist.

    Parameters
    ----------
    field
        The field of the message with both vectors.
    vectors
        For each name of a vector, the names of the components and the unit.
    """

    field: str
    vectors: dict[str, tuple[str, str]]

    def of(self, message: TwistStamped | AccelStamped | WrenchStamped) -> VectorReading:
        """Return the stamp, the frame and the two vectors of a message."""
        pair = getattr(message, self.field)
        vectors = {name: numbers_of(getattr(pair, name)) for name in self.vectors}
        return VectorReading(Stamp.of(message.header), message.header.frame_id, vectors)


TWIST = VectorPair('twist', {'linear': ('vx vy vz', 'm/s'), 'angular': ('wx wy wz', 'rad/s')})


class WarningReading(NamedTuple):
    """
    A singularity warning, or the reason why a command is slowed: level, sentence, and values by
    key.
    """

    level: str
    sentence: str
    name: str
    values: dict[str, str]

    @property
    def cause(self) -> str:
        """
        Return what slows a commanded joint velocity, such as `position limit of elbow`; empty if
        the command is not slowed.
        """
        cause, of = (self.values.get(key, '') for key in ('cause', 'of'))
        return f'{cause} of {of}' if of else cause


def jacobian_of(message: Float64MultiArray) -> JacobianReading:
    """
    Return the Jacobian in a Float64MultiArray message, without a change of its row order.

    Raises
    ------
    LayoutError
        The layout is not a two-dimensional row-major array with a label for each row and column.
    """
    dims, data = message.layout.dim, message.data
    if len(dims) != 2:
        raise LayoutError(
            f'layout: {len(dims)} dimensions; give two, rows and columns', code='wrong-shape'
        )
    rows, columns = (tuple(dim.label.split(',')) for dim in dims)
    sizes = tuple(int(dim.size) for dim in dims)
    for names, size in zip((rows, columns), sizes):
        if len(names) != size:
            raise LayoutError(
                f'layout: {len(names)} labels for {size} entries; give one label for each',
                code='wrong-length',
            )
    stride, at = int(dims[1].stride), int(message.layout.data_offset)
    if stride < sizes[1] or at + (sizes[0] - 1) * stride + sizes[1] > len(data):
        raise LayoutError(
            f'data: {len(data)} numbers do not fill {sizes[0]} x {sizes[1]}', code='wrong-length'
        )
    flat = np.asarray(data, dtype=np.float64)[at:]
    values = np.stack([flat[k * stride : k * stride + sizes[1]] for k in range(sizes[0])])
    return JacobianReading(rows, columns, values)


def numbers_of(vector: Point | Vector3 | Quaternion) -> Floats:
    """Return the components of a message: x y z of a vector or point, x y z w of a quaternion."""
    return np.array([getattr(vector, name) for name in vector.get_fields_and_field_types()])


def matrix_of(pose: Pose) -> Floats:
    """Return the homogeneous matrix (4, 4) of a pose message."""
    T = np.eye(4)
    T[:3, :3] = rotation_of_quaternion(numbers_of(pose.orientation))
    T[:3, 3] = numbers_of(pose.position)
    return T


def in_base_axes(six_rows: Floats, tool: Floats) -> Floats:
    """Rotate a twist (6,), or the six rows of a Jacobian, from tool axes to base axes."""
    R = tool[:3, :3]
    return np.concatenate([R @ six_rows[:3], R @ six_rows[3:]])


def scale_of(message: Float64) -> ScaleReading:
    """Return the scale in a Float64 message."""
    return ScaleReading(float(message.data))


def warned_of(message: DiagnosticStatus) -> WarningReading:
    """Return the warning in a DiagnosticStatus message."""
    level = ord(message.level)
    name = Level(level).name if level in list(Level) else f'LEVEL {level}'
    values = {value.key: value.value for value in message.values}
    return WarningReading(name, message.message, message.name, values)
