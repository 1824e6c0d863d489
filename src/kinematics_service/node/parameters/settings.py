# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define the settings of a node: immutable values, computed from the node's parameters."""

import math
from array import array
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from importlib.util import find_spec
from types import MappingProxyType
from typing import Any, NamedTuple

from ...errors import KinematicsError, RobotFileError, SettingsError
from ...estimation.estimator import EstimatorSettings
from ...kinematics.inverse.problem.target import TOOL_AXES
from ...kinematics.inverse.servo import ServoSettings
from ...kinematics.servo_rule import ServoRule
from ...robot.file.parts.quantities import LARGEST, LARGEST_USUAL_LENGTH, unit_doubt
from ...robot.measures import thresholds_for
from ...robot.points import TOOL
from ...robot.robot import Robot, with_singularity, with_tool
from ...robot.task import ROW_NAMES
from .table import PARAMETERS, SERVO, Parameter

# Largest accepted roll, pitch or yaw (rad); a larger number is most likely in degrees.
FULL_TURN = 2.0 * math.pi

ROW_LABELS = {
    'linear_first': 'vx,vy,vz,wx,wy,wz',
    'angular_first': 'wx,wy,wz,vx,vy,vz',
}


class ReferenceLimits(NamedTuple):
    """
    Thresholds of WARN and ERROR for the RMS difference (m, rad) between the node's tool poses and
    those of a second source.
    """

    position_warn: float
    position_stop: float
    angle_warn: float
    angle_stop: float


@dataclass(frozen=True)
class NodeSettings:
    """
    All settings of a running node, checked together.

    Attributes
    ----------
    robot
        The arm, with joint names, tool, length and thresholds from the parameters.
    estimator
        The settings of the estimator.
    base_frame, tool_frame
        Names of the frames, with the prefix.
    frame_prefix
        The prefix of the names of frames.
    jacobian_frame, twist_frame
        `base` or `tool`.
    row_order
        `linear_first` or `angular_first`.
    period : ns
        Smallest difference between the stamps of published answers; 0 publishes all answers.
    target_rows, target_axis
        The rows of a target pose that must be reached, and the axis of the tool whose direction
        must be reached, or None.
    redundancy, redundancy_step : rad
        The criterion that selects the solution of a redundant arm. The selected solution is at
        most `redundancy_step` along the solution curve from the solution nearest to the present
        joint positions.
    target_timeout : ns
        Time for which a target twist is valid.
    servo
        The settings that turn target twists into joint velocities.
    reference
        Thresholds for the difference between two tool poses: the computed pose, and the pose that
        another source publishes on `~/reference_pose`.
    scale_reduced
        Whether the reduced speed limits in the robot file apply.
    scale_rule
        The rule by which MoveIt Servo slows a motion; None if the motion is slowed by the distance
        to singular poses.
    points
        The settings for each point that has topics, by the point's name. In these settings, the
        point is the tool frame.
    doubts
        Sentences on parameters whose values may be in mm or degrees.
    values
        The value of each parameter, for parameters that one module uses as they are.
    of
        Name of the point to which these settings apply; `tool` for the tool.
    """

    robot: Robot
    estimator: EstimatorSettings
    base_frame: str
    tool_frame: str
    frame_prefix: str
    jacobian_frame: str
    twist_frame: str
    row_order: str
    period: int
    target_rows: tuple[str, ...]
    target_axis: str | None
    redundancy: str
    redundancy_step: float
    target_timeout: int
    servo: ServoSettings
    reference: ReferenceLimits
    scale_reduced: bool
    scale_rule: ServoRule | None
    points: Mapping[str, 'NodeSettings']
    doubts: tuple[str, ...]
    values: Mapping[str, Any]
    of: str = TOOL

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Return the names of the joints in messages."""
        return self.robot.joint_names


def _refuse(name: str, value: object, accepted: str, code: str) -> SettingsError:
    return SettingsError(f'parameter {name}: {value!r} is not accepted; {accepted}', code=code)


def _checked_name(name: str, value: str, noun: str) -> str:
    has_space = any(character.isspace() for character in value)
    if has_space or value.startswith('/') or not _is_plain(value):
        accepted = f'give {noun} without spaces, commas and a leading slash'
        raise _refuse(name, value, accepted, 'syntax')
    return value


def _joint_names(values: Mapping[str, Any], robot: Robot) -> tuple[str, ...]:
    prefix = _checked_name('joint_prefix', values['joint_prefix'], 'part of a name')
    names = _listed(values['joint_names'])
    if names == []:
        return tuple(prefix + name for name in robot.joint_names)
    if names is None:
        code = 'wrong-type'
    elif prefix:
        code = 'conflict'
    elif len(names) != robot.dof:
        code = 'wrong-length'
    elif len(set(names)) != len(names):
        code = 'duplicate-name'
    elif not all(isinstance(name, str) and name.strip() and _is_plain(name) for name in names):
        code = 'syntax'
    else:
        return tuple(names)
    accepted = (
        f'give {robot.dof} different names without commas, in the order of '
        f"{robot.name}'s {', '.join(robot.joint_names)}, with an empty joint_prefix"
    )
    raise _refuse('joint_names', names or values['joint_names'], accepted, code)


def _is_plain(name: str) -> bool:
    return name.isprintable() and ',' not in name


def _renamed(robot: Robot, names: tuple[str, ...], prefix: str) -> Robot:
    # Return the arm with the joint names `names`, which messages have. Names of mimic joints get
    # the prefix.
    name_of = dict(zip(robot.joint_names, names))
    mimics = tuple(
        mimic._replace(name=prefix + mimic.name, leader=name_of.get(mimic.leader, mimic.leader))
        for mimic in robot.description.mimics
    )
    return replace(robot, joint_names=names, description=replace(robot.description, mimics=mimics))


def _listed(value: Any) -> list[Any] | None:
    # Return a value as a list, or None if the value is not a list. At start, rclpy gives None for
    # an empty list.
    if value is None:
        return []
    is_list = isinstance(value, (Sequence, array)) and not isinstance(value, (str, bytes))
    return list(value) if is_list else None


def check_value(parameter: Parameter, value: Any) -> None:
    """
    Raise SettingsError if a value is not among a parameter's choices, or is out of its range.
    """
    if parameter.numbers:
        _check_numbers(parameter, value)
    if parameter.choices and value not in parameter.choices:
        accepted = f'give one of {", ".join(parameter.choices)}'
        raise _refuse(parameter.name, value, accepted, 'unknown-name')
    if parameter.range is not None:
        low, high = parameter.range
        accepted = f'give {low:g} to {high:g}'
        if parameter.least:
            accepted = f'give 0, or {parameter.least:g} to {high:g}'
        if not low <= value <= high or 0.0 < value < parameter.least:
            code = 'out-of-range' if math.isfinite(value) else 'not-finite'
            raise _refuse(parameter.name, value, accepted, code)


def settings_from(
    values: Mapping[str, Any], robot: Robot, points: Sequence[str] = ()
) -> NodeSettings:
    """
    Return the settings of a node, computed from the values of all parameters and the arm.

    Parameters
    ----------
    values
        The value of each parameter in `PARAMETERS`, by name, with the type of the parameter.
    robot
        The arm of the robot file.
    points
        Names of the points that have topics of their own.

    Raises
    ------
    SettingsError
        A value is wrong, or two values contradict each other.
    """
    for parameter in PARAMETERS:
        check_value(parameter, values[parameter.name])
    prefix = _checked_name('frame_prefix', values['frame_prefix'].lstrip('/'), 'part of a frame')
    base = _checked_name('base_frame', values['base_frame'], 'a frame') or robot.base_frame
    tool = _checked_name('tool_frame', values['tool_frame'], 'a frame') or robot.tool_frame
    if base == tool:
        raise SettingsError(
            f'parameters base_frame and tool_frame: both are {tool!r}; give different names',
            code='conflict',
        )
    if values['publish_tf'] and find_spec('tf2_msgs') is None:  # PyPI has no wheel of tf2_msgs
        accepted = 'install the package tf2_msgs, or set false'
        raise _refuse('publish_tf', True, accepted, 'missing-package')
    rate = values['publish_rate']
    judged = _judged(values, _with_tool(values, robot))
    judged = _renamed(judged, _joint_names(values, robot), values['joint_prefix'])
    rows = _rows(values['ik.rows'], judged)
    axis = _axis(values, rows)
    settings = NodeSettings(
        robot=judged,
        estimator=EstimatorSettings(
            velocity_source=values['velocity_source'],
            timeout=round(values['joint_state_timeout'] * 1e9),
            acceleration_window=round(values['acceleration_window'] * 1e9),
            integrate_velocities=values['integrate_velocities'],
        ),
        base_frame=prefix + base,
        tool_frame=prefix + tool,
        frame_prefix=prefix,
        jacobian_frame=values['jacobian_frame'],
        twist_frame=values['twist_frame'],
        row_order=values['row_order'],
        period=round(1e9 / rate) if rate > 0.0 else 0,
        target_rows=_linear(rows) if axis else rows,
        target_axis=axis,
        redundancy=values['ik.redundancy'],
        redundancy_step=values['ik.redundancy_step'] or math.inf,
        target_timeout=round(values['ik.target_timeout'] * 1e9),
        servo=_servo(values, rows, judged),
        reference=_reference(values),
        scale_reduced=_reduced(values, judged),
        scale_rule=_scale_rule(values, judged),
        points={},
        doubts=tuple(_doubts(values, robot)),
        values=MappingProxyType(dict(values)),
    )
    return replace(settings, points=_points(points, robot, settings))


def _doubts(values: Mapping[str, Any], robot: Robot) -> Iterator[str]:
    # A length is doubtful if it is above 20 m. For an arm shorter than 1 m, a length is doubtful
    # if it is above 20 times the arm's length.
    longest = LARGEST_USUAL_LENGTH * min(robot.singularity.task.length, 1.0)
    for parameter in PARAMETERS:
        if parameter.kind == 'number':
            continue
        value = values[parameter.name]
        if parameter.numbers:
            value = max(value or (), key=abs, default=0.0)
        degrees = f'are these degrees? write {math.radians(value):.6g}'
        millimetres = f'are these millimetres? write {value / 1000.0:.6g}'
        if doubt := unit_doubt(value, parameter.kind, longest, degrees, millimetres):
            yield f'parameter {parameter.name}: {doubt}'


def _points(names: Any, robot: Robot, settings: NodeSettings) -> dict[str, NodeSettings]:
    points = robot.points[1:]
    choices = f'give some of {", ".join(points)}, each once'
    if not points:
        choices = f'leave it empty, because {robot.name} has no points'
    listed = isinstance(names, (list, tuple)) and all(isinstance(name, str) for name in names)
    if not listed:
        raise _refuse('points', names, f'{choices}, in a list such as [elbow]', 'wrong-type')
    settings_of: dict[str, NodeSettings] = {}
    for name in names:
        if name not in points or name in settings_of:
            code = 'duplicate-name' if name in settings_of else 'unknown-name'
            raise _refuse('points', name, choices, code)
        frame = settings.frame_prefix + name
        if frame in (settings.base_frame, settings.tool_frame):
            accepted = f'give {frame} to a point only, not to the base or the tool'
            raise _refuse('points', name, accepted, 'conflict')
        settings_of[name] = replace(settings, tool_frame=frame, of=name)
    return settings_of


def _rows(text: str, robot: Robot) -> tuple[str, ...]:
    rows = text.split()
    if len(set(rows)) != len(rows) or not set(rows) <= set(ROW_NAMES):
        code = 'unknown-name' if set(rows) - set(ROW_NAMES) else 'duplicate-name'
        raise _refuse('ik.rows', text, f'give some of {" ".join(ROW_NAMES)}, each once', code)
    return tuple(name for name in ROW_NAMES if name in rows) or robot.singularity.task.rows


def _linear(rows: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(name for name in rows if name in ROW_NAMES[:3])


def _axis(values: Mapping[str, Any], rows: tuple[str, ...]) -> str | None:
    axis: str = values['ik.axis']
    if not axis:
        return None
    if axis not in TOOL_AXES:
        accepted = f'give one of {" ".join(TOOL_AXES)}, or nothing'
        raise _refuse('ik.axis', axis, accepted, 'unknown-name')
    if not _linear(rows) or (values['ik.rows'] and rows != _linear(rows)):
        accepted = 'give rows of x y z only in ik.rows, because it replaces rx ry rz'
        raise _refuse('ik.axis', axis, accepted, 'conflict')
    return axis


def _check_numbers(parameter: Parameter, value: Any) -> None:
    numbers, count = _listed(value), parameter.numbers
    largest, unit = (FULL_TURN, ' rad') if parameter.kind == 'angle' else (LARGEST, '')
    accepted = f'give {count} numbers of at most {largest:g}{unit}, such as [0.0, 0.0, 0.1]'
    if numbers is None or not {type(number) for number in numbers} <= {float, int}:
        raise _refuse(parameter.name, numbers or value, accepted, 'wrong-type')
    farthest = max(filter(math.isfinite, numbers), key=abs, default=0.0)
    if len(numbers) not in (0, count):
        code = 'wrong-length'
    elif not all(map(math.isfinite, numbers)):
        code = 'not-finite'
    elif abs(farthest) > largest:
        code = 'out-of-range'
    else:
        return
    if unit and abs(farthest) > largest:
        accepted += f'; are these degrees? write {math.radians(farthest):.6g}'
    raise _refuse(parameter.name, numbers, accepted, code)


def _with_tool(values: Mapping[str, Any], robot: Robot) -> Robot:
    xyz, rpy = (tuple(map(float, values[name] or ())) or None for name in ('tool.xyz', 'tool.rpy'))
    try:
        return with_tool(robot, xyz, rpy)
    except RobotFileError as error:
        reason = '; '.join(fault.message for fault in error.faults)
        code = error.faults[0].code
        raise SettingsError(f'parameters tool.xyz and tool.rpy: {reason}', code=code) from None


def _reference(values: Mapping[str, Any]) -> ReferenceLimits:
    limits = ReferenceLimits(*(values[f'reference.{name}'] for name in ReferenceLimits._fields))
    for quantity in ('position', 'angle'):
        warn, stop = (values[f'reference.{quantity}_{end}'] for end in ('warn', 'stop'))
        if stop < warn:
            name = f'reference.{quantity}_stop'
            accepted = f'give at least reference.{quantity}_warn, {warn:g}'
            raise _refuse(name, stop, accepted, 'wrong-order')
    return limits


def _reduced(values: Mapping[str, Any], robot: Robot) -> bool:
    limits = robot.description.speed_limits
    if values['scale.reduced'] and not any(math.isfinite(limit.reduced) for limit in limits):
        accepted = f'set false, or write a reduced speed in speed_limits of {robot.name}'
        raise _refuse('scale.reduced', True, accepted, 'missing-key')
    return bool(values['scale.reduced'])


@contextmanager
def _refused_as(names: str) -> Iterator[None]:
    # Turns a KinematicsError in the `with` block into a SettingsError that begins with `names`.
    try:
        yield
    except KinematicsError as error:
        raise SettingsError(f'{names}: {error}', code=error.code) from None


def _scale_rule(values: Mapping[str, Any], robot: Robot) -> ServoRule | None:
    with _refused_as('parameters scale.*'):
        rule = ServoRule(*(values[f'scale.{field.name}'] for field in fields(ServoRule)))
        if values['scale.rule'] == 'distance':
            return None
        rule.check(robot)
        return rule


def _servo(values: Mapping[str, Any], rows: tuple[str, ...], robot: Robot) -> ServoSettings:
    numbers = {name: values[f'ik.{name}'] for name in SERVO}
    with _refused_as('parameters ik.*'):
        return ServoSettings(**numbers, rows=None if rows == robot.singularity.task.rows else rows)


def _judged(values: Mapping[str, Any], robot: Robot) -> Robot:
    # Take the thresholds from the parameters if they are set, otherwise from the robot file. The
    # file's thresholds apply only to the file's own measure.
    measure, file_thresholds = values['singularity.measure'], robot.singularity.thresholds
    is_measure_of_file = measure == file_thresholds.measure
    warn = values['singularity.warn'] or (file_thresholds.warn if is_measure_of_file else None)
    stop = values['singularity.stop'] or (file_thresholds.stop if is_measure_of_file else None)
    with _refused_as('parameters singularity.measure, .warn and .stop go together'):
        thresholds = thresholds_for(robot.singularity.task, measure, warn, stop)
    return with_singularity(robot, values['singularity.length'] or None, thresholds)


def defaults(robot: Robot) -> dict[str, Any]:
    """Return the default value of every parameter of a node for an arm, by name."""
    values = {parameter.name: parameter.default for parameter in PARAMETERS}
    values['singularity.measure'] = robot.singularity.thresholds.measure
    return values
