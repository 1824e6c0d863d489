"""How much of a commanded motion may be kept, and why not all of it; no safety function."""

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Int8

from ..errors import RefusedTargetError
from ..estimation.estimator import EstimatorOutput
from ..estimation.status_text import StatusText
from ..kernel import LARGEST, Floats
from ..kinematics.scale import LEAVING, POSITION, SINGULARITY, MotionScales, scale
from ..robot.measures import Level
from .messages.message_check import read_message
from .messages.messages import full_name, stamp_of, status_message
from .messages.topics import (
    COMMAND,
    COMMAND_QOS,
    OUTPUT_QOS,
    SCALE,
    SCALE_REASON,
    SERVO_STATUS,
    WARNING_QOS,
    overridable,
)
from .parameters.settings import NodeSettings
from .steady_time import Throttle

# Shares below which a motion is called slowed, and stopped; and above which it no longer is.
SLOWED, STOPPED = (0.95, 0.99), (0.01, 0.05)
# Another cause is named when it asks for so much less than the one that was named.
OTHER_CAUSE = 0.05
NO_SAFETY = 'no safety function: it knows positions and commands as they are reported'
# What MoveIt Servo calls these states (moveit_msgs/ServoStatus).
INVALID, NO_WARNING, APPROACHING, HALTED, MOVING_OFF, JOINT_BOUND = -1, 0, 1, 2, 3, 6


class _Reason(NamedTuple):
    # What was said last: level, and the index of the constraint, -1 for none.
    level: Level
    k: int = -1


class Scaling:
    """
    Answers each commanded joint velocity with the share of it that may be kept.

    Parameters
    ----------
    node
        The node that it belongs to.
    settings
        The settings in force.
    present
        Returns the arm's present state; RefusedTargetError if it is not known.
    """

    def __init__(
        self, node: Node, settings: NodeSettings, present: Callable[[], EstimatorOutput]
    ) -> None:
        self._node, self._present = node, present
        self._throttle = Throttle(5.0)
        self._scale = node.create_publisher(Float64, SCALE, **overridable(OUTPUT_QOS))
        self._code = node.create_publisher(Int8, SERVO_STATUS, **overridable(OUTPUT_QOS))
        self._why = node.create_publisher(DiagnosticStatus, SCALE_REASON, WARNING_QOS)
        # Raw: refused here with a reason.
        node.create_subscription(
            JointState, COMMAND, self._on_command, raw=True, **overridable(COMMAND_QOS)
        )
        self.configure(settings)

    def configure(self, settings: NodeSettings) -> None:
        """Apply other settings: nothing is remembered of the arm before."""
        self._settings = settings
        self._reason: _Reason | None = None
        self._last: tuple[float, float] | None = None  # share, and its time (s)

    def _on_command(self, data: bytes) -> None:
        try:
            found = self._found(read_message(data, JointState))
        except Exception as error:  # no message may stop the node
            self._refuse(error)
            return
        value = self._smooth(float(found.value[0]))
        reason = self._judged(found)
        self._publish(value, _servo_code(found, reason))
        if reason != self._reason:
            self._reason = reason
            self._say(reason.level, *_in_words(found, reason, value))

    def _found(self, message: JointState) -> MotionScales:
        settings, present = self._settings, self._present()
        qdot = _velocities(message, settings.joint_names)
        # Both clocks are the robot's: the ROS clock of this process may be another one.
        stamp, timeout = stamp_of(message), settings.estimator.timeout
        if stamp and present.stamp - stamp > timeout:
            raise RefusedTargetError(
                f'the stamp of the command is {1e-9 * (present.stamp - stamp):.4g} s older than '
                f'that of the joint states, and joint_state_timeout is {1e-9 * timeout:g} s'
            )
        # As one pose of a batch, which is searched for less long than a pose asked alone.
        return scale(
            settings.robot,
            present.state.q[None],
            qdot[None],
            horizon=settings.scale_horizon,
            reduced=settings.scale_reduced,
            rule=settings.scale_rule,
        )

    def _smooth(self, value: float) -> float:
        # It falls at once, since a limit does not wait, and rises at a rate.
        now = time.monotonic()
        if self._last is not None:
            before, at = self._last
            value = min(value, before + self._settings.scale_rise * (now - at))
        self._last = value, now
        return value

    def _judged(self, found: MotionScales) -> _Reason:
        # Of what may be kept: what still rises to it has no cause.
        former, values = self._reason or _Reason(Level.OK), found.values[0]
        level, value = Level.OK, float(np.min(values))
        if value < STOPPED[former.level is Level.ERROR]:
            level = Level.ERROR
        elif value < SLOWED[former.level is not Level.OK]:
            level = Level.WARN
        if level is Level.OK:
            return _Reason(level)
        k = int(np.argmin(values))
        if 0 <= former.k < len(values) and values[former.k] <= values[k] + OTHER_CAUSE:
            k = former.k
        return _Reason(level, k)

    def _refuse(self, error: Exception) -> None:
        sentence = self._throttle.reason_of(self._node, 'a command', error)
        self._last = 0.0, time.monotonic()
        self._publish(0.0, INVALID)
        reason = _Reason(Level.STALE)
        if reason != self._reason:
            self._reason = reason
            self._say(reason.level, f'no scale: {sentence}', ())

    def _publish(self, value: float, code: int) -> None:
        self._scale.publish(Float64(data=value))
        if self._code.get_subscription_count() > 0:
            self._code.publish(Int8(data=code))

    def _say(self, level: Level, sentence: str, values: tuple[tuple[str, str], ...]) -> None:
        robot = ('robot', self._settings.robot.name)
        text = StatusText(level, sentence, (robot, *values, ('note', NO_SAFETY)))
        self._why.publish(status_message(f'{full_name(self._node)}: scale', text))


def _velocities(message: JointState, names: tuple[str, ...]) -> Floats:
    if len(message.velocity) != len(message.name):
        raise RefusedTargetError(
            f'the command has {len(message.name)} names and {len(message.velocity)} velocities'
        )
    for name in names:
        if message.name.count(name) > 1:
            raise RefusedTargetError(f'the command names joint {name!r} twice')
    told = dict(zip(message.name, message.velocity))
    if not told.keys() & set(names):
        raise RefusedTargetError(f'the command names no joint of {", ".join(names)}')
    qdot = np.array([told.get(name, 0.0) for name in names])
    if not (np.abs(qdot) <= LARGEST).all():
        name = names[int(np.argmax(~(np.abs(qdot) <= LARGEST)))]
        raise RefusedTargetError(f'the commanded velocity of {name} is {told[name]}')
    return qdot


def _servo_code(found: MotionScales, reason: _Reason) -> int:
    if reason.k < 0:
        return NO_WARNING
    cause = found.constraints[reason.k].cause
    if cause == SINGULARITY:
        return HALTED if reason.level is Level.ERROR else APPROACHING
    return {LEAVING: MOVING_OFF, POSITION: JOINT_BOUND}.get(cause, NO_WARNING)


def _in_words(
    found: MotionScales, reason: _Reason, value: float
) -> tuple[str, tuple[tuple[str, str], ...]]:
    proved = 'proved', 'yes' if found.proved[0] else 'no'
    if reason.k < 0:
        rising = '; the scale rises to it' if value < SLOWED[0] else ''
        return f'the command may be kept{rising}', (('scale', f'{value:.3g}'), proved)
    constraint = found.constraints[reason.k]
    cause, of, unit = constraint
    margin, left = (float(column[0][reason.k]) for column in (found.margins, found.times))
    how = 'stopped' if reason.level is Level.ERROR else f'slowed to {value:.2g}'
    return f'{how}: {constraint.words}, {margin:.3g} {unit} left', (
        ('scale', f'{value:.3g}'),
        ('cause', cause),
        ('of', of),
        ('margin', f'{margin:.6g} {unit}'),
        ('time left', f'{left:.3g} s'),
        proved,
    )
