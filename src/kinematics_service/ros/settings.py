"""
The node's parameters: a table, and the frozen settings that follow from their values.

"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor

from ..errors import KinematicsError
from ..estimator import VELOCITY_SOURCES, EstimatorSettings
from ..measures import MEASURES, Thresholds, thresholds_for
from ..robot import Robot, with_singularity

AXES = ('base', 'tool')
ROW_ORDERS = ('linear_first', 'angular_first')
ROW_LABELS = {
    'linear_first': 'vx,vy,vz,wx,wy,wz',
    'angular_first': 'wx,wy,wz,vx,vy,vz',
}


class SettingsError(KinematicsError, ValueError):
    """
    A parameter's value is refused; the message names it, the value and what is accepted.

    """


@dataclass(frozen=True)
class Parameter:
    """
    One parameter: its default, what it means, and what is accepted.

    """

    name: str
    default: Any
    description: str
    choices: tuple[str, ...] = ()
    range: tuple[float, float] | None = None
    read_only: bool = False

    def descriptor(self) -> ParameterDescriptor:
        """
        Return the descriptor that `ros2 param describe` shows.

        """
        descriptor = ParameterDescriptor()
        descriptor.description = self.description
        descriptor.read_only = self.read_only
        if self.choices:
            descriptor.additional_constraints = 'one of: ' + ', '.join(self.choices)
        if self.range is not None:
            low, high = self.range
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=low, to_value=high, step=0.0)
            ]
        return descriptor


ROBOT = Parameter(
    'robot', 'puma560', 'Robot file, or name of a bundled robot; set at start.', read_only=True
)

PARAMETERS = (
    Parameter('joint_prefix', '', 'Put before the joint names of the robot file.'),
    Parameter('frame_prefix', '', 'Put before the names of the base and tool frames.'),
    Parameter('base_frame', '', "Name of the base frame; empty: the robot file's."),
    Parameter('tool_frame', '', "Name of the tool frame; empty: the robot file's."),
    Parameter('jacobian_frame', 'base', 'Axes of the Jacobian; its point is the tool.', AXES),
    Parameter('twist_frame', 'base', 'Axes of the twist; its point is the tool.', AXES),
    Parameter('row_order', 'linear_first', "Order of the Jacobian's rows.", ROW_ORDERS),
    Parameter(
        'velocity_source',
        'auto',
        'Joint velocities: of the message, differences of positions, or whichever there is.',
        VELOCITY_SOURCES,
    ),
    Parameter(
        'publish_rate',
        0.0,
        'Answers a second at most, by stamp; 0: every message.',
        (),
        (0.0, 1e6),
    ),
    Parameter(
        'joint_state_timeout',
        1.0,
        'A joint unheard for so many seconds is stale.',
        (),
        (1e-3, 3600.0),
    ),
    Parameter('publish_tf', False, 'Publish the tool on /tf (needs tf2_msgs).'),
    Parameter('singularity.measure', 'distance', 'Measure the warning watches.', tuple(MEASURES)),
    Parameter(
        'singularity.warn',
        0.0,
        "WARN beyond this, in the measure's unit; 0: the robot file's or the measure's default.",
        (),
        (0.0, 1e12),
    ),
    Parameter(
        'singularity.stop',
        0.0,
        "ERROR beyond this, in the measure's unit; 0: the robot file's or the measure's default.",
        (),
        (0.0, 1e12),
    ),
    Parameter(
        'singularity.length',
        0.0,
        "Characteristic length in m; 0: the robot file's, or the RMS reach.",
        (),
        (0.0, 1e6),
    ),
)


@dataclass(frozen=True)
class Settings:
    """
    All settings of a running node, valid together.

    Attributes
    ----------
    robot
        The arm, with the task's length and the thresholds that are in force.
    estimator
        How messages become states.
    base_frame, tool_frame
        Names, prefix included.
    jacobian_frame, twist_frame
        `base` or `tool`.
    row_order
        `linear_first` or `angular_first`.
    period : ns
        Least difference of stamps between answers that are published; 0: publish all.
    publish_tf
        Whether to publish the tool on /tf.

    """

    robot: Robot
    estimator: EstimatorSettings
    base_frame: str
    tool_frame: str
    jacobian_frame: str
    twist_frame: str
    row_order: str
    period: int
    publish_tf: bool


def tf_is_importable() -> bool:
    """
    Return whether tf2_msgs is there, which the wheels on PyPI do not carry.

    """
    return find_spec('tf2_msgs') is not None


def _refuse(name: str, value: object, accepted: str) -> SettingsError:
    return SettingsError(f'parameter {name}: {value!r} is not accepted ({accepted})')


def _checked_name(name: str, value: str, what: str) -> str:
    printable = value.isprintable() and not any(character.isspace() for character in value)
    if not printable or value.startswith('/') or ',' in value:
        raise _refuse(name, value, f'{what}: no spaces, no commas, no leading slash')
    return value


def settings_from(values: Mapping[str, Any], robot: Robot) -> Settings:
    """
    Return the settings that parameter values mean.

    Parameters
    ----------
    values
        A value for each of `PARAMETERS`, of its type.
    robot
        The arm as its file has it.

    Raises
    ------
    SettingsError
        Some value is refused, alone or together with another.

    """
    for parameter in PARAMETERS:
        value = values[parameter.name]
        if parameter.choices and value not in parameter.choices:
            raise _refuse(parameter.name, value, 'one of ' + ', '.join(parameter.choices))
        if parameter.range is not None:
            low, high = parameter.range
            if not (math.isfinite(value) and low <= value <= high):
                raise _refuse(parameter.name, value, f'{low:g} to {high:g}')
    prefix = _checked_name('frame_prefix', values['frame_prefix'].lstrip('/'), 'part of a frame')
    base = _checked_name('base_frame', values['base_frame'], 'a frame') or robot.base_frame
    tool = _checked_name('tool_frame', values['tool_frame'], 'a frame') or robot.tool_frame
    if base == tool:
        raise SettingsError(
            f'parameters base_frame and tool_frame: both are {tool!r}, and must differ'
        )
    if values['publish_tf'] and not tf_is_importable():
        raise _refuse('publish_tf', True, 'only where the package tf2_msgs can be imported')
    rate = values['publish_rate']
    return Settings(
        robot=_judged(values, robot),
        estimator=EstimatorSettings(
            joint_prefix=_checked_name('joint_prefix', values['joint_prefix'], 'part of a name'),
            velocity_source=values['velocity_source'],
            timeout=round(values['joint_state_timeout'] * 1e9),
        ),
        base_frame=prefix + base,
        tool_frame=prefix + tool,
        jacobian_frame=values['jacobian_frame'],
        twist_frame=values['twist_frame'],
        row_order=values['row_order'],
        period=round(1e9 / rate) if rate > 0.0 else 0,
        publish_tf=values['publish_tf'],
    )


def _judged(values: Mapping[str, Any], robot: Robot) -> Robot:
    # The parameters override the file; thresholds of the file hold for its own measure only.
    measure = values['singularity.measure']
    of_file = robot.thresholds if measure == robot.thresholds.measure else None
    warn = values['singularity.warn'] or (of_file.warn if of_file else None)
    stop = values['singularity.stop'] or (of_file.stop if of_file else None)
    try:
        thresholds: Thresholds = thresholds_for(robot.task, measure, warn, stop)
    except KinematicsError as error:
        raise SettingsError(
            f'parameters singularity.measure, .warn and .stop go together: {error}'
        ) from None
    return with_singularity(robot, values['singularity.length'] or None, thresholds)


def defaults(robot: Robot) -> dict[str, Any]:
    """
    Return the default of every parameter for an arm.

    """
    values = {parameter.name: parameter.default for parameter in PARAMETERS}
    values['singularity.measure'] = robot.thresholds.measure
    return values
