# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""List the parameters of a node: names, defaults, descriptions and accepted values."""

import math
from typing import Any, NamedTuple

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor

from ...estimation.estimator import VELOCITY_SOURCES
from ...kinematics.inverse.self_motion.best_posture import CRITERIA
from ...kinematics.inverse.servo import ServoSettings
from ...kinematics.servo_rule import ServoRule
from ...robot.file.parts.quantities import Kind
from ...robot.measures import MEASURES

AXES = ('base', 'tool')
# Descriptions of the parameters for the scaling rule `servo`, which is the rule of MoveIt Servo.
# The word `Likewise` means: for the rule `servo`, like the first parameter.
SERVO_RULE = {
    'lower_singularity_threshold': 'Of `scale.rule` servo: condition number from which a motion '
    'is slowed.',
    'hard_stop_singularity_threshold': 'Likewise, from which it is stopped.',
    'leaving_singularity_threshold_multiplier': 'Likewise: what leads away is slowed this many '
    'times less.',
    'singularity_step_scale': 'Likewise: the step, in m and rad, that shows which way the '
    'condition number grows.',
}
# Ranges and descriptions of the parameters `ik.*` that are numbers of `ServoSettings`.
SERVO = {
    'damping': (
        (1e-6, 1.0),
        "Largest damping of joint velocities at a singularity, a share of the arm's length.",
    ),
    'damped_below': (
        (1e-6, 10.0),
        "Damping begins where the smallest singular value is this share of the arm's length.",
    ),
    'horizon': (
        (1e-3, 3600.0),
        'A joint approaches its limit no faster than would take it there in this many seconds.',
    ),
    'default_rate': (
        (1e-6, 1e6),
        'Velocity limit of angles that have none in the robot file, rad/s.',
    ),
    'default_speed': (
        (1e-6, 1e6),
        'Velocity limit of prismatic joints that have none in the robot file, m/s.',
    ),
}
# Defaults, largest values, kinds and descriptions of the parameters `reference.*`.
REFERENCE: dict[str, tuple[float, float, Kind, str]] = {
    'position_warn': (
        *(4e-3, 1e6, 'length'),
        'A warning where poses of ~/reference_pose remain this far off (rms), base and tool '
        'fitted, m.',
    ),
    'position_stop': (20e-3, 1e6, 'length', 'An error where they remain this far off, m.'),
    'angle_warn': (
        *(math.radians(0.5), 10.0, 'angle'),
        'A warning where their orientations remain this far off (rms), rad.',
    ),
    'angle_stop': (
        *(math.radians(2.0), 10.0, 'angle'),
        'An error where their orientations remain this far off, rad.',
    ),
}
ROW_ORDERS = ('linear_first', 'angular_first')


class Parameter(NamedTuple):
    """One parameter: its default, its description, and its accepted values."""

    name: str
    default: Any
    description: str
    choices: tuple[str, ...] = ()
    range: tuple[float, float] | None = None
    # If `least` is not 0, the parameter accepts two kinds of values: 0, which has a special
    # meaning, and numbers from `least` on.
    least: float = 0.0
    numbers: int = 0  # required length of a list of numbers; the list may also be empty
    # Kind of the number. If a length is implausibly large, a warning asks whether it is in mm. If
    # an angle is implausibly large, a warning asks whether it is in degrees.
    kind: Kind = 'number'
    read_only: bool = False

    def descriptor(self) -> ParameterDescriptor:
        """Return the descriptor that `ros2 param describe` shows."""
        descriptor = ParameterDescriptor()
        descriptor.description = self.description
        descriptor.read_only = self.read_only
        # without dynamic typing, rclpy takes an empty list for a list of bytes
        descriptor.dynamic_typing = self.default == []
        if self.choices:
            descriptor.additional_constraints = 'one of: ' + ', '.join(self.choices)
        if self.numbers:
            descriptor.additional_constraints = f'empty, or {self.numbers} numbers'
        if self.least:
            descriptor.additional_constraints = f'0, or at least {self.least:g}'
        if self.range is not None:
            low, high = self.range
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=low, to_value=high, step=0.0)
            ]
        return descriptor


ROBOT = Parameter(
    'robot', 'puma560', 'Robot file, or name of a bundled robot; set at start.', read_only=True
)

TRANSPORT = Parameter(
    'transport',
    'bytes',
    "How messages are read and written: straight in their bytes, or as rclpy's messages; both "
    'give the same, the second costs more. Set at start.',
    ('bytes', 'messages'),
    read_only=True,
)

POINTS = Parameter(
    'points',
    [],
    'Points of the robot file that have topics of their own, such as `~/NAME/pose` and '
    '`~/NAME/jacobian`: a list of names; set at start.',
    read_only=True,
)

PARAMETERS = (
    Parameter('joint_prefix', '', 'Prefix before the joint names of the robot file.'),
    Parameter(
        'joint_names',
        [],
        "Names of the joints on the topics, in the order of the robot's joints, instead of "
        '`joint_prefix`; empty: those of the robot file.',
    ),
    Parameter('frame_prefix', '', 'Put before the names of the base and tool frames.'),
    Parameter('base_frame', '', "Name of the base frame; empty: the robot file's."),
    Parameter('tool_frame', '', "Name of the tool frame; empty: the robot file's."),
    Parameter(
        'tool.xyz',
        [],
        'Origin of the tool in the frame after the last row, three numbers in m; empty: the robot '
        "file's.",
        numbers=3,
        kind='length',
    ),
    Parameter(
        'tool.rpy',
        [],
        'Orientation of the tool in that frame, roll pitch yaw in rad, R = Rz(yaw) Ry(pitch) '
        "Rx(roll); empty: the robot file's.",
        numbers=3,
        kind='angle',
    ),
    Parameter('jacobian_frame', 'base', 'Axes of the Jacobian; its point is the tool.', AXES),
    Parameter('twist_frame', 'base', 'Axes of the twist; its point is the tool.', AXES),
    Parameter('row_order', 'linear_first', "Order of the Jacobian's rows.", ROW_ORDERS),
    Parameter(
        'velocity_source',
        'auto',
        'Source of joint velocities: the message, differences of positions, or auto: the message '
        'if it has velocities, else differences.',
        VELOCITY_SOURCES,
    ),
    Parameter(
        'integrate_velocities',
        False,
        'Count positions on from the last reported ones where messages have velocities alone; how '
        'long, and how far they may be off, is told in /diagnostics.',
    ),
    Parameter(
        'acceleration_window',
        0.05,
        'Joint accelerations are slopes of the velocities of the last so many seconds, which is '
        'the acceleration half of it ago; 0: of the last two.',
        range=(0.0, 10.0),
    ),
    Parameter(
        'publish_rate',
        0.0,
        'Most answers per second, by stamp; 0: every message.',
        range=(0.0, 1e6),
        least=1e-3,
    ),
    Parameter(
        'joint_state_timeout',
        1.0,
        'A joint without a new position for this many seconds is stale.',
        range=(1e-3, 3600.0),
    ),
    Parameter('publish_tf', False, 'Publish the tool on /tf (needs tf2_msgs).'),
    Parameter(
        'publish_robot_description',
        False,
        'Publish a URDF made from the table on robot_description.',
    ),
    Parameter(
        'scale.horizon',
        0.1,
        'Reaction time of what is slowed by `~/scale`, in s: not less than the time until the '
        'next command.',
        range=(1e-3, 10.0),
    ),
    Parameter('scale.rise', 2.0, 'How fast `~/scale` may rise, 1/s.', range=(1e-3, 1e6)),
    Parameter('scale.reduced', False, "Whether the robot file's `reduced` speeds hold."),
    Parameter(
        'scale.rule',
        'distance',
        "What slows `~/scale` before singular poses: the distance, or MoveIt Servo's rule with "
        'the settings that follow, named as Servo has them.',
        ('distance', 'servo'),
    ),
    *(
        Parameter(f'scale.{name}', getattr(ServoRule, name), description, range=(1e-9, 1e6))
        for name, description in SERVO_RULE.items()
    ),
    Parameter(
        'singularity.measure', 'distance', ('Measure that the warning watches.'), tuple(MEASURES)
    ),
    Parameter(
        'singularity.warn',
        0.0,
        "WARN beyond this, in the measure's unit; 0: the robot file's or the measure's default.",
        range=(0.0, 1e12),
    ),
    Parameter(
        'singularity.stop',
        0.0,
        "ERROR beyond this, in the measure's unit; 0: the robot file's or the measure's default.",
        range=(0.0, 1e12),
    ),
    Parameter(
        'singularity.length',
        0.0,
        "Characteristic length in m; 0: the robot file's, or the RMS reach.",
        range=(0.0, 1e6),
        kind='length',
    ),
    Parameter(
        'ik.rows',
        '',
        'Which of x y z rx ry rz of a target pose or twist count, separated by spaces; '
        "empty: the rows of the arm's task.",
    ),
    Parameter(
        'ik.axis',
        '',
        'The axis of the tool (x, y or z) whose direction counts of a target pose instead of the '
        'rows rx ry rz, as for arms of five joints; empty: none. Twists are not affected.',
    ),
    Parameter(
        'ik.tolerance',
        1e-6,
        'A target pose counts as reached up to this error, m and rad. `~/ik/status` has the '
        'residual.',
        range=(0.0, 1.0),
    ),
    Parameter(
        'ik.redundancy',
        'near',
        'Which posture of an arm with one joint more than its target pose asks for is the answer: '
        'the nearest to where it is; or, on the arc of postures that this one is on, that of '
        'largest clearance from singular poses, or of largest margin from the joint limits. '
        '`~/ik/status` has the ends of the arc.',
        ('near', *CRITERIA),
    ),
    Parameter(
        'ik.redundancy_step',
        0.1,
        'How far along the arc an answer may be from the nearest posture, rad (prismatic joints '
        "divided by the arm's length), so that answers do not jump; 0: as far as the best is.",
        range=(0.0, 100.0),
        least=1e-6,
    ),
    Parameter(
        'ik.target_timeout',
        0.2,
        'A twist holds for this many seconds; then the joints are stopped.',
        range=(1e-3, 3600.0),
    ),
    *(
        Parameter(f'ik.{name}', getattr(ServoSettings, name), description, range=accepted)
        for name, (accepted, description) in SERVO.items()
    ),
    *(
        Parameter(f'reference.{name}', default, description, range=(1e-9, largest), kind=kind)
        for name, (default, largest, kind, description) in REFERENCE.items()
    ),
)
