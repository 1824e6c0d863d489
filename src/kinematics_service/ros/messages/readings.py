"""The content of the node's messages, as plain data: for the screen and for JSON."""

from typing import Any, NamedTuple

import numpy as np

from ...errors import LayoutError
from ...kernel import Floats
from ...rigid_motion import roll_pitch_yaw, rotation_of_quaternion
from ...robot.measures import Level


class Stamp(NamedTuple):
    """A time as messages have it: a double cannot hold the nanoseconds of a present one."""

    sec: int
    nanosec: int


class ScaleReading(NamedTuple):
    """The share of a commanded motion that may be kept, 0 to 1."""

    scale: float


class JacobianReading(NamedTuple):
    """A Jacobian (rows, columns) with the labels of its rows and columns."""

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    jacobian: Floats


class PoseReading(NamedTuple):
    """A pose in a frame: position (3,) in m, quaternion x y z w, roll pitch yaw (3,) in rad."""

    stamp: Stamp
    frame: str
    position: Floats
    quaternion_xyzw: Floats
    roll_pitch_yaw: Floats


class TwistReading(NamedTuple):
    """A twist in the axes of a frame: linear (3,) in m/s, angular (3,) in rad/s."""

    stamp: Stamp
    frame: str
    linear: Floats
    angular: Floats


class AccelerationReading(NamedTuple):
    """An acceleration in the axes of a frame: linear (3,) in m/s^2, angular (3,) in rad/s^2."""

    stamp: Stamp
    frame: str
    linear: Floats
    angular: Floats


class WrenchReading(NamedTuple):
    """A wrench in the axes and at the origin of a frame: force (3,) in N, torque (3,) in N m."""

    stamp: Stamp
    frame: str
    force: Floats
    torque: Floats


class WarningReading(NamedTuple):
    """A warning, or the reason of a scale: level, sentence, and keys with values."""

    level: str
    sentence: str
    name: str
    values: dict[str, str]

    @property
    def cause(self) -> str:
        """Return what slows a command: `position limit of elbow`; empty where nothing does."""
        cause, of = (self.values.get(key, '') for key in ('cause', 'of'))
        return f'{cause} of {of}' if of else cause


def jacobian_of(message: Any) -> JacobianReading:
    """
    Return the Jacobian that a Float64MultiArray holds, whatever the order of its rows.

    Raises
    ------
    LayoutError
        The layout is not that of a two-dimensional row-major array with a label for each entry.
    """
    dims, data = message.layout.dim, message.data
    if len(dims) != 2:
        raise LayoutError(f'the layout has {len(dims)} dimensions, not rows and columns')
    rows, columns = (tuple(dim.label.split(',')) for dim in dims)
    sizes = tuple(int(dim.size) for dim in dims)
    for names, size in zip((rows, columns), sizes):
        if len(names) != size:
            raise LayoutError(f'the layout has {len(names)} labels for a dimension of {size}')
    stride, at = int(dims[1].stride), int(message.layout.data_offset)
    if stride < sizes[1] or at + (sizes[0] - 1) * stride + sizes[1] > len(data):
        raise LayoutError(f'{len(data)} numbers do not fill {sizes[0]} x {sizes[1]}')
    flat = np.asarray(data, dtype=np.float64)[at:]
    values = np.stack([flat[k * stride : k * stride + sizes[1]] for k in range(sizes[0])])
    return JacobianReading(rows, columns, values)


def _stamp(message: Any) -> Stamp:
    return Stamp(int(message.header.stamp.sec), int(message.header.stamp.nanosec))


def _xyz(vector: Any) -> Floats:
    return np.array([vector.x, vector.y, vector.z])


def pose_of(message: Any) -> PoseReading:
    """Return the pose of a PoseStamped."""
    orientation = message.pose.orientation
    quaternion = np.array([orientation.x, orientation.y, orientation.z, orientation.w])
    return PoseReading(
        _stamp(message),
        message.header.frame_id,
        _xyz(message.pose.position),
        quaternion,
        roll_pitch_yaw(rotation_of_quaternion(quaternion)),
    )


def velocity_of(message: Any) -> TwistReading:
    """Return the twist of a TwistStamped."""
    twist = message.twist
    return TwistReading(
        _stamp(message), message.header.frame_id, _xyz(twist.linear), _xyz(twist.angular)
    )


def acceleration_of(message: Any) -> AccelerationReading:
    """Return the acceleration of an AccelStamped."""
    accel = message.accel
    return AccelerationReading(
        _stamp(message), message.header.frame_id, _xyz(accel.linear), _xyz(accel.angular)
    )


def wrench_of(message: Any) -> WrenchReading:
    """Return the wrench of a WrenchStamped."""
    wrench = message.wrench
    return WrenchReading(
        _stamp(message), message.header.frame_id, _xyz(wrench.force), _xyz(wrench.torque)
    )


def scale_of(message: Any) -> ScaleReading:
    """Return the scale of a Float64."""
    return ScaleReading(float(message.data))


def warned_of(message: Any) -> WarningReading:
    """Return the warning of a DiagnosticStatus."""
    level = ord(message.level)
    name = Level(level).name if level in list(Level) else f'LEVEL {level}'
    values = {value.key: value.value for value in message.values}
    return WarningReading(name, message.message, message.name, values)
