# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the scale of a commanded joint velocity: the fraction of the velocity, 0 to 1, that is
allowed. The limit or singular pose that makes the scale less than 1 is published, too. The scale
is not a safety function.
"""

import math
import time
from collections.abc import Callable
from dataclasses import replace
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
from .messages import topics
from .messages.message_check import read_message
from .messages.messages import full_name, stamp_of, status_message
from .messages.topics import output_publisher, raw_subscription
from .parameters.settings import NodeSettings
from .steady_time import Throttle

# Scale below which a command counts as slowed, and scale above which the command no longer counts
# as slowed (hysteresis).
SLOWED_SCALES = (0.95, 0.99)
# Scale below which a command counts as stopped, and scale above which the command no longer counts
# as stopped.
STOPPED_SCALES = (0.01, 0.05)
# The status names one constraint (a limit, the singularity) as cause of the scale. The cause
# changes to a constraint with a smaller scale only if the difference of the scales is above this.
CAUSE_HYSTERESIS = 0.05
NO_SAFETY = 'no safety function: it knows positions and commands as they are reported'
# Codes of moveit_msgs/ServoStatus.
INVALID = -1
NO_WARNING = 0
HALT_FOR_SINGULARITY = 2
# For each cause, its code: DECELERATE_FOR_APPROACHING_SINGULARITY (1),
# DECELERATE_FOR_LEAVING_SINGULARITY (3), JOINT_BOUND (6).
SERVO_CODES = {SINGULARITY: 1, LEAVING: 3, POSITION: 6}


class _Reason(NamedTuple):
    # The reason for a scale: the level (OK, WARN for slowed, ERROR for stopped), and the index k
    # of the constraint that slows or stops the motion (-1 for none).
    level: Level
    k: int = -1


class Scaling:
    """
    Answers each commanded joint velocity with its scale, the allowed fraction of this velocity.

    Parameters
    ----------
    node
        The node with the topics.
    settings
        The settings in force.
    present
        A function that returns the arm's present state; it raises RefusedTargetError if no state
        is known.
    """

    def __init__(
        self, node: Node, settings: NodeSettings, present: Callable[[], EstimatorOutput]
    ) -> None:
        self._node, self._present = node, present
        self._throttle = Throttle(5.0)
        self._scale = output_publisher(node, Float64, topics.SCALE)
        self._code = output_publisher(node, Int8, topics.SERVO_STATUS)
        self._why = node.create_publisher(
            DiagnosticStatus, topics.SCALE_REASON, topics.WARNING_QOS
        )
        raw_subscription(node, JointState, topics.COMMAND, self._on_command, topics.COMMAND_QOS)
        self.configure(settings)

    def configure(self, settings: NodeSettings) -> None:
        """Apply other settings, and forget the last scale and its reason."""
        self._settings = settings
        self._reason: _Reason | None = None
        self._last: tuple[float, float] | None = None  # last scale, and its time (s)

    def _on_command(self, data: bytes) -> None:
        try:
            scales = self._scales_of(read_message(data, JointState))
        except Exception as error:  # no message may stop the node
            self._refuse(error)
            return
        value = self._limit_rise(float(scales.value[0]))
        reason = self._reason_for(scales)
        self._publish_scale(value, _servo_code(scales, reason))
        if reason != self._reason:
            self._reason = reason
            self._publish_reason(_reason_in_words(scales, reason, value))

    def _scales_of(self, message: JointState) -> MotionScales:
        settings, present = self._settings, self._present()
        qdot = _velocities(message, settings.joint_names)
        # Compare the command's stamp with the stamp of the joint state, not with the node's clock,
        # because this process may have another ROS clock than the sender of the joint states.
        stamp, timeout = stamp_of(message), settings.estimator.timeout
        if stamp and present.stamp - stamp > timeout:
            raise RefusedTargetError(
                f'header.stamp: {1e-9 * (present.stamp - stamp):.4g} s older than the joint '
                f'states; at most {1e-9 * timeout:g} s (joint_state_timeout) is accepted',
                code='too-old',
            )
        # Pass a batch of one pose, because the fields of the result are then arrays.
        return scale(
            settings.robot,
            present.state.q[None],
            qdot[None],
            horizon=settings.values['scale.horizon'],
            reduced=settings.scale_reduced,
            rule=settings.scale_rule,
        )

    def _limit_rise(self, value: float) -> float:
        # The scale may rise by at most `scale.rise` (a parameter) per second. It may fall at once.
        now = time.monotonic()
        if self._last is not None:
            before, at = self._last
            value = min(value, before + self._settings.values['scale.rise'] * (now - at))
        self._last = value, now
        return value

    def _reason_for(self, scales: MotionScales) -> _Reason:
        # Return the level (OK, WARN for slowed, ERROR for stopped), and the constraint that slows
        # or stops the motion. The function uses the scales as computed, before `_limit_rise`
        # limits their rise.
        former, values = self._reason or _Reason(Level.OK), scales.values[0]
        level, value = Level.OK, float(np.min(values))
        if value < STOPPED_SCALES[former.level is Level.ERROR]:
            level = Level.ERROR
        elif value < SLOWED_SCALES[former.level is not Level.OK]:
            level = Level.WARN
        if level is Level.OK:
            return _Reason(level)
        k = int(np.argmin(values))
        if 0 <= former.k < len(values) and values[former.k] <= values[k] + CAUSE_HYSTERESIS:
            k = former.k
        return _Reason(level, k)

    def _refuse(self, error: Exception) -> None:
        sentence = self._throttle.reason_of(self._node, 'a command', error)
        self._last = 0.0, time.monotonic()
        self._publish_scale(0.0, INVALID)
        reason = _Reason(Level.STALE)
        if reason != self._reason:
            self._reason = reason
            self._publish_reason(StatusText(reason.level, f'no scale: {sentence}', ()))

    def _publish_scale(self, value: float, code: int) -> None:
        self._scale.publish(Float64(data=value))
        if self._code.get_subscription_count() > 0:
            self._code.publish(Int8(data=code))

    def _publish_reason(self, text: StatusText) -> None:
        robot = ('robot', self._settings.robot.name)
        text = replace(text, values=(robot, *text.values, ('note', NO_SAFETY)))
        self._why.publish(status_message(f'{full_name(self._node)}: scale', text))


def _velocities(message: JointState, names: tuple[str, ...]) -> Floats:
    if len(message.velocity) != len(message.name):
        raise RefusedTargetError(
            f'velocity: {len(message.velocity)} numbers for {len(message.name)} names; give one '
            'for each name',
            code='wrong-length',
        )
    for name in names:
        if message.name.count(name) > 1:
            raise RefusedTargetError(f'name: {name!r} is repeated', code='duplicate-name')
    velocities = dict(zip(message.name, message.velocity))
    if not velocities.keys() & set(names):
        raise RefusedTargetError(
            f'name: no joint of this arm; give some of {", ".join(names)}', code='unknown-name'
        )
    qdot = np.array([velocities.get(name, 0.0) for name in names])
    if not (np.abs(qdot) <= LARGEST).all():
        name = names[int(np.argmax(~(np.abs(qdot) <= LARGEST)))]
        value = velocities[name]
        raise RefusedTargetError(
            f'velocity: {value} for {name}; give a number of at most {LARGEST:g}',
            code='out-of-range' if math.isfinite(value) else 'not-finite',
        )
    return qdot


def _servo_code(scales: MotionScales, reason: _Reason) -> int:
    if reason.k < 0:
        return NO_WARNING
    cause = scales.constraints[reason.k].cause
    if cause == SINGULARITY and reason.level is Level.ERROR:
        return HALT_FOR_SINGULARITY
    return SERVO_CODES.get(cause, NO_WARNING)


def _reason_in_words(scales: MotionScales, reason: _Reason, value: float) -> StatusText:
    proved = 'proved', 'yes' if scales.proved[0] else 'no'
    scale = 'scale', f'{value:.3g}'
    if reason.k < 0:
        rising = '; the scale rises to it' if value < SLOWED_SCALES[0] else ''
        return StatusText(reason.level, f'the command may be kept{rising}', (scale, proved))
    constraint = scales.constraints[reason.k]
    cause, of, unit = constraint
    margin, time_left = (float(column[0][reason.k]) for column in (scales.margins, scales.times))
    action = 'stopped' if reason.level is Level.ERROR else f'slowed to {value:.2g}'
    values = (
        scale,
        ('cause', cause),
        ('of', of),
        ('margin', f'{margin:.6g} {unit}'),
        ('time left', f'{time_left:.3g} s'),
        proved,
    )
    sentence = f'{action}: {constraint.words}, {margin:.3g} {unit} left'
    return StatusText(reason.level, sentence, values)
