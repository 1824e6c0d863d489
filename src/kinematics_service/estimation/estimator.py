# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Merge JointState messages by joint name and stamp into joint positions, and evaluate the arm at
them.

The estimator is the only object that remembers earlier JointState messages.
"""

import array
import math
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple, TypeVar, cast

import numpy as np

from .. import kernel
from ..errors import JointVectorError
from ..kernel import Floats, ReportedJoints
from ..kinematics.closure import why_not_closed
from ..kinematics.singularity import Singularity, watched_value
from ..kinematics.tool_state import ToolState, as_the_kernel_takes_it, evaluate
from ..robot.measures import Level
from ..robot.robot import Robot
from . import outcomes
from .alarm import Alarm
from .integration import Integration
from .joint_memory import MessageJoints, NamedJoints, joint_names
from .joint_sample import JointSample
from .joint_state_form import JointStateForm, SerializedSample

VELOCITY_SOURCES = ('auto', 'message', 'difference')


@dataclass(frozen=True)
class EstimatorSettings:
    """
    Settings of the estimator.

    Attributes
    ----------
    joint_prefix
        Prefix of the joint names of the robot file.
    velocity_source
        `message`: velocities of messages. `difference`: differences of positions. `auto`:
        velocities of the message, or differences if the message has none.
    timeout : ns
        A joint is stale if its last position is older than `timeout`. If stamps step back by more,
        all joints are forgotten.
    acceleration_window : ns
        Time over which a line is fitted to velocities; its slope is the acceleration.
    integrate_velocities
        Whether the velocities of messages without positions are integrated from the last
        positions.
    """

    joint_prefix: str = ''
    velocity_source: str = 'auto'
    timeout: int = 1_000_000_000
    acceleration_window: int = 50_000_000
    integrate_velocities: bool = False


class EstimatorOutput(NamedTuple):
    """
    The tool's state after an accepted JointState message.

    Attributes
    ----------
    state
        Pose, Jacobian, frames, and the twist if the velocities are known.
    stamp : ns
        Stamp of the message. If the message has no stamp, the time at which it was received.
    velocity_source
        Source of the velocities: `message`, `difference`, or `none`.
    quantities
        Values of the quantities that were requested from `Estimator.take`, such as accelerations;
        None for a quantity that is unknown.
    """

    state: ToolState
    stamp: int
    velocity_source: str
    quantities: Mapping[type['StreamQuantity'], Floats | None] = MappingProxyType({})


class StreamQuantity(ABC):
    """
    A quantity, such as joint acceleration, that depends on several past messages, not only on the
    newest state of the tool.

    Parameters
    ----------
    robot
        The arm.
    settings
        Settings of the estimator.
    """

    def __init__(self, robot: Robot, settings: EstimatorSettings) -> None:
        self.robot, self.settings = robot, settings

    def configure(self, robot: Robot, settings: EstimatorSettings) -> None:
        """Apply new settings, or another arm with equal joint names."""
        self.robot, self.settings = robot, settings

    @abstractmethod
    def take(
        self, answer: EstimatorOutput, message: 'JointMessage', joints: NamedJoints
    ) -> Floats | None:
        """
        Return the quantity that this object computes, such as accelerations, after a new message.

        Returns None if the values are unknown.

        Parameters
        ----------
        answer
            The state of the arm after the message.
        message
            The new message.
        joints
            The last positions, velocities and times of all joints.
        """


class AcceptedMessage(NamedTuple):
    """
    The joint positions and velocities that the estimator knows after an accepted message.

    Attributes
    ----------
    q : shape (n,), rad or m
        Joint positions, in the arm's order.
    qdot : shape (n,), rad/s or m/s, or None
        Joint velocities; None if one is unknown.
    stamp : ns
        Stamp of the message. If the message has no stamp, the time at which it was received.
    velocity_source
        Source of the velocities: `message`, `difference`, or `none`.
    """

    q: Floats
    qdot: Floats | None
    stamp: int
    velocity_source: str


JointMessage = JointSample | SerializedSample
_StreamQuantity = TypeVar('_StreamQuantity', bound=StreamQuantity)


class RefusedMessage(NamedTuple):
    """
    The reason why a message did not lead to a new state of the tool.

    Attributes
    ----------
    reason
        Key in `Estimator.counts` under which the message is counted.
    sentence
        The reason as a sentence for the user, or empty.
    """

    reason: str
    sentence: str = ''


class MessageOutcome(NamedTuple):
    """
    The kernel's result for one message: a new state of the arm, a refusal, or neither. If neither,
    the message must be decoded to a `JointSample` and read again.

    Attributes
    ----------
    velocity_source
        `message`, `difference` or `none` if there is a new state; otherwise empty.
    refusal
        The reason why the message gave no new state. None if there is a new state, or if the
        message must be decoded and read again.
    starts_anew
        Whether all joints were forgotten, because the stamp stepped back by more than the timeout.
    """

    velocity_source: str = ''
    refusal: RefusedMessage | None = None
    starts_anew: bool = False


_UNREAD = MessageOutcome()
_NOT_COMPUTABLE = RefusedMessage(
    outcomes.TOO_LARGE, 'positions or velocities are too large to compute with'
)
# The `MessageOutcome` for each code that `kernel.observe` returns.
_OUTCOMES = {
    kernel.WITHOUT_VELOCITIES: MessageOutcome('none'),
    kernel.WITH_VELOCITIES: MessageOutcome('message'),
    kernel.WITH_DIFFERENCES: MessageOutcome('difference'),
    kernel.NOT_NEWER: MessageOutcome(refusal=RefusedMessage(outcomes.DROPPED)),
    kernel.INCOMPLETE: MessageOutcome(refusal=RefusedMessage(outcomes.WAITING)),
    kernel.NOT_COMPUTABLE: MessageOutcome(refusal=_NOT_COMPUTABLE),
    kernel.NOT_CLOSED: MessageOutcome(refusal=RefusedMessage(outcomes.NOT_CLOSED)),
}
_OUTCOMES |= {
    kernel.STARTED_ANEW + code: outcome._replace(starts_anew=True)
    for code, outcome in _OUTCOMES.items()
}
# NOT_THIS_FORM and BAD_POSITION mean that the kernel could not read the message and has stored
# nothing. If the message was given as bytes, the caller decodes it and calls `Estimator.take`
# again. If a decoded message also gives BAD_POSITION, it is refused with a sentence that names the
# bad position.
_OUTCOMES |= {kernel.NOT_THIS_FORM: _UNREAD, kernel.BAD_POSITION: _UNREAD}
_NOTHING = np.empty(0)
# Largest number of message forms that the estimator remembers. A form is the list of joint names
# and the lengths of the arrays in a message.
MAX_FORMS = 16


class Estimator:
    """
    Merges JointState messages by joint name and time, and evaluates the arm in the kernel.

    The estimator's memory does not grow with time, and no message raises an exception.

    Parameters
    ----------
    robot
        The arm.
    settings
        Settings of the estimator.

    Attributes
    ----------
    counts
        Number of messages for each outcome (accepted, or why refused); the keys are the texts of
        the module `outcomes`.
    joints
        The last position, velocity and times of each joint.
    integration
        Integrates the velocities of messages that have no positions.
    """

    def __init__(self, robot: Robot, settings: EstimatorSettings) -> None:
        self.robot = robot
        self.settings = settings
        self.counts: Counter[str] = Counter()
        self.joints = self._new_joints()
        self._search = kernel.NearestSearch(robot.singularity.arm)
        self._alarm = Alarm()
        self._is_open = False

    def configure(self, robot: Robot, settings: EstimatorSettings) -> None:
        """Apply another arm or new settings. Joints that keep their names keep their positions."""
        former = self.joints
        if robot is not self.robot:
            self._search = kernel.NearestSearch(robot.singularity.arm)
            # Solve the loops of the new arm from the assembled position in its file, not from the
            # last positions of the former arm.
            former.is_closed = False
        moves_alike = robot.chain is self.robot.chain
        self.robot, self.settings = robot, settings
        same_names = joint_names(robot, settings.joint_prefix) == former.names
        if same_names and former.fits(robot):
            former.configure(robot, self._source, settings.timeout)
            for quantity in self._quantities.values():
                quantity.configure(robot, settings)
            self._forms.clear()
        else:
            self.joints = self._new_joints()
            self.joints.remember(former)
        if not moves_alike:
            self.joints.is_new_tool = True
            self._alarm = Alarm()

    def anew(self, answer: EstimatorOutput) -> EstimatorOutput | None:
        """
        Return a copy of an earlier output with a new tool state.

        The tool state is computed for the present robot, at the joint positions that this
        estimator has in memory. Returns None if a joint position is unknown, or if the state
        cannot be computed.
        """
        known = self.joints.joint_vectors()
        if known is None:
            return None
        try:
            state = evaluate(self.robot, *known)
        except JointVectorError:
            return None
        return answer._replace(state=state)

    @property
    def _source(self) -> int:
        return VELOCITY_SOURCES.index(self.settings.velocity_source)

    def _new_joints(self) -> NamedJoints:
        settings = self.settings
        # For each message form, the kernel's description of that form. None if messages of that
        # form must be decoded before the kernel reads them.
        self._forms: dict[JointStateForm, kernel.IncomingForm | None] = {}
        self._quantities: dict[type[StreamQuantity], StreamQuantity] = {}
        self.integration = Integration(self.robot)
        return NamedJoints(self.robot, settings.joint_prefix, self._source, settings.timeout)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the joint names that messages must have: prefix and name in the robot file."""
        return self.joints.names

    def reset(self) -> None:
        """Forget all joint positions. Call it if the clock or the recording has started again."""
        self.counts[outcomes.RESETS] += 1
        kernel.forget(self.joints)
        self.integration.forget()
        self.joints.is_new_tool = True

    def clock_stepped_back(self, now: int, back: int) -> bool:
        """
        Forget all joint positions if the ROS clock stepped back by `back` to `now` (ns). Return
        False if nothing was forgotten.

        If the latest message was stamped after the step, this message has already reset the
        estimator, and nothing is forgotten.
        """
        latest = self.joints.newest()
        # If the latest stamp is nearer to the clock's new time than to its old time, the stamp was
        # set after the step, so keep the joints.
        if latest is None or latest <= now + back // 2:
            return False
        self.reset()
        return True

    def beyond_limits(self) -> tuple[str, ...]:
        """Return the names of known joints that are outside their limits."""
        return self.joints.beyond(self.robot.limits)

    def is_settled(self, state: ToolState, arrival: int) -> bool:
        """
        Return True if `judge` would return OK without a warning. This test takes less time than
        `judge`, because it reads only the singularity level that the kernel computed. If the
        result is False, call `judge`.
        """
        alarm, measures = self._alarm, state.measures
        if measures is None or alarm.level is not Level.OK:
            return False
        level: float = measures.item(self.robot.singularity.measure_places.judged + kernel.LEVEL)
        return level == 0.0 and alarm.is_settled(Level.OK, arrival)

    def judge(self, singularity: Singularity, arrival: int) -> tuple[Level, bool]:
        """
        Return the singularity level of a new state, with hysteresis, and whether to publish a
        warning.
        """
        alarm = self._alarm
        if alarm.level is Level.OK or alarm.level is Level.STALE:
            level: Level = singularity.level  # no hysteresis after OK and STALE
        else:
            value = watched_value(self.robot, singularity)
            # Take the higher of two levels. The first compares the watched measure (`value`) with
            # the thresholds, with hysteresis. The second is the kernel's level, which is WARN for
            # a nearly singular J even if the distance to the nearest singular pose is large.
            level = max(
                self.robot.singularity.thresholds.level(value, alarm.level), singularity.level
            )
        if alarm.is_settled(level, arrival):
            return level, False
        factor = None if singularity.factors is None else singularity.factors.nearest
        self._alarm, say = alarm.step(level, singularity.lost_direction, arrival, factor)
        return level, say

    def go_stale(self, arrival: int) -> bool:
        """
        Set the singularity level to STALE; return whether the node must publish this as a warning.
        """
        self._alarm, say = self._alarm.step(Level.STALE, None, arrival)
        return say

    def take(
        self,
        message: JointMessage,
        depth: int = kernel.ALL_FRAMES,
        answers: kernel.OutgoingMessages | None = None,
        quantities: Sequence[type[StreamQuantity]] = (),
    ) -> EstimatorOutput | RefusedMessage | None:
        """
        Return the tool's state and singularity measures after a message, or the reason why the
        message was refused.

        Returns None if a message given as bytes must be decoded and given again as a
        `JointSample`: if its joint names or lengths are not those of the expected form, if it has
        no stamp, or if it has a fault that an error sentence must name. The estimator's memory is
        then unchanged.

        Parameters
        ----------
        message
            The message, decoded (`JointSample`) or as bytes (`SerializedSample`).
        depth
            `kernel.JACOBIAN`, or `kernel.ALL_FRAMES` if the link frames are needed.
        answers
            Outgoing messages that the kernel fills if `message` is bytes.
        quantities
            Classes of the quantities that the result must contain.
        """
        robot = self.robot
        row = np.empty(robot.chain.single_widths[depth])
        measures = np.empty(robot.singularity.measure_places.width)
        outcome = self._observe(message, row, measures, answers)
        if not outcome.velocity_source:
            return outcome.refusal
        moving = outcome.velocity_source != 'none'
        state = ToolState(robot, row, moving, None, measures)
        answer = EstimatorOutput(state, message.time, outcome.velocity_source)
        if not quantities:
            return answer
        joints = self.joints
        values = {kind: self.quantity(kind).take(answer, message, joints) for kind in quantities}
        return answer._replace(quantities=values)

    def accept(self, sample: JointSample) -> AcceptedMessage | RefusedMessage:
        """
        Return the joint positions and velocities after a message, or the reason why it was
        refused.

        `accept` updates the memory like `take`, but does not evaluate the arm. Readers of
        recordings call `accept` for each message, and then evaluate the arm in one batch.
        """
        chain = self.robot.chain
        # The kernel writes joint positions and velocities into `row`. If the arm has closed loops,
        # `row` also needs the columns of the tool's pose and of the passive joints. With these
        # columns the kernel checks whether the loops close.
        pose = 0 if chain.loops else chain.widths[kernel.POSE]
        row = np.empty(chain.single_widths[kernel.POSE] - pose)
        outcome = self._observe(sample, row)
        if outcome.refusal is not None:
            return outcome.refusal
        joints = ToolState(self.robot, row, outcome.velocity_source != 'none')
        return AcceptedMessage(joints.q, joints.qdot, sample.time, outcome.velocity_source)

    def _observe(
        self,
        message: JointMessage,
        row: Floats,
        measures: Floats | None = None,
        answers: kernel.OutgoingMessages | None = None,
    ) -> MessageOutcome:
        # Stores the joints of a message in memory, writes the arm's new state into `row`, and
        # counts the message by its outcome.
        if isinstance(message, SerializedSample):
            assert measures is not None
            outcome = self._read_bytes(message, row, measures, answers)
        else:
            outcome = self._read_sample(message, row, measures)
        if outcome.starts_anew:
            self.counts[outcomes.RESETS] += 1
        if outcome.velocity_source:
            self.counts[outcomes.ACCEPTED] += 1
            self._is_open = False
        elif outcome.refusal is not None:
            refusal = self._explained(outcome.refusal)
            self.counts[refusal.reason] += 1
            return MessageOutcome(refusal=refusal)
        return outcome

    def _read_bytes(
        self,
        message: SerializedSample,
        row: Floats,
        measures: Floats,
        answers: kernel.OutgoingMessages | None,
    ) -> MessageOutcome:
        form, data, arrival = message
        incoming = self._forms[form] if form in self._forms else self._keep(form)
        if incoming is None:
            return _UNREAD
        memory, search = self.joints, self._search
        return _OUTCOMES[
            kernel.observe_bytes(search, memory, incoming, data, arrival, row, measures, answers)
        ]

    def _read_sample(
        self, sample: JointSample, row: Floats, measures: Floats | None
    ) -> MessageOutcome:
        named, refusal = self.joints.joints_in(sample.names), None
        if self.settings.integrate_velocities and named.ours.count:
            sample, refusal = self._counted_on(sample, named.ours)
        refusal = refusal or self._shape_refusal(sample, named)
        if refusal is not None:
            return MessageOutcome(refusal=refusal)
        positions, velocities = doubles(sample.positions), doubles(sample.velocities)
        times = sample.stamp, sample.received, sample.arrival
        reported = ReportedJoints(named.ours, positions, velocities, *times)
        outcome = _OUTCOMES[kernel.observe(self.robot.singularity.arm, self.joints, reported, row)]
        if outcome is _UNREAD:
            return MessageOutcome(refusal=self._bad_position(named.ours, positions))
        if sample.stamp == 0:
            self.counts[outcomes.NOT_STAMPED] += 1
        if measures is not None and outcome.velocity_source:
            kernel.measure_one(self._search, row, measures)
        return outcome

    def _keep(self, form: JointStateForm) -> kernel.IncomingForm | None:
        ours, duplicates = self.joints.joints_in(form.names)
        one_each = form.position_count == len(form.names)
        incoming = None
        if ours.count and not duplicates and one_each and not self.settings.integrate_velocities:
            incoming = form.for_joints(ours)
        if len(self._forms) >= MAX_FORMS:
            self._forms.clear()
        self._forms[form] = incoming
        return incoming

    def quantity(self, kind: type[_StreamQuantity]) -> _StreamQuantity:
        """
        Return the `StreamQuantity` of class `kind`. The first call creates this object without
        past messages.
        """
        if kind not in self._quantities:
            self._quantities[kind] = kind(self.robot, self.settings)
        return cast(_StreamQuantity, self._quantities[kind])

    def _counted_on(
        self, sample: JointSample, ours: kernel.OurJoints
    ) -> tuple[JointSample, RefusedMessage | None]:
        if len(sample.positions):
            self.integration.forget(ours.table[0])
            return sample, None
        velocities = doubles(sample.velocities)
        if fast := self.integration.too_fast(velocities, self.names, ours):
            return sample, RefusedMessage(outcomes.TOO_FAST, fast)
        positions = self.integration.positions(sample, velocities, self.joints, ours)
        return (sample if positions is None else sample._replace(positions=positions)), None

    def _explained(self, refusal: RefusedMessage) -> RefusedMessage:
        if refusal is _NOT_COMPUTABLE:
            # Forget all joint positions, because positions so large that the kernel's results
            # overflowed must not stay in memory.
            kernel.forget(self.joints)
        # If the loops do not close in several messages in a row, explain only the first message.
        # The explanation takes 100 times as long as reading a message.
        if refusal.reason != outcomes.NOT_CLOSED or self._is_open:
            return refusal
        self._is_open = True
        _, sentence = why_not_closed(self.robot, self.joints.positions())
        sentence = (
            sentence or f'a loop of {self.robot.name} ends on the way from the last position'
        )
        return RefusedMessage(outcomes.NOT_CLOSED, sentence)

    def _shape_refusal(self, sample: JointSample, named: MessageJoints) -> RefusedMessage | None:
        if not named.ours.count:
            return RefusedMessage(outcomes.NOT_OURS)
        names, positions = len(sample.names), len(sample.positions)
        if not positions:
            return RefusedMessage(outcomes.NO_POSITION)
        if names != positions:
            return RefusedMessage(outcomes.MALFORMED, f'{names} names but {positions} positions')
        if named.duplicates:
            name = named.duplicates[0]
            return RefusedMessage(outcomes.DUPLICATE, f'joint {name!r} is named twice')
        return None

    def _bad_position(self, ours: kernel.OurJoints, positions: Floats) -> RefusedMessage:
        numbers = ((j, float(positions[index])) for j, index in zip(*ours.table))
        j, position = next(pair for pair in numbers if not abs(pair[1]) <= kernel.LARGEST)
        reason = outcomes.TOO_LARGE if math.isfinite(position) else outcomes.NOT_FINITE
        return RefusedMessage(reason, f'position of joint {self.joints.names[j]!r} is {position}')


def doubles(numbers: Sequence[float] | Floats) -> Floats:
    """
    Return numbers as a float64 array for the kernel. An array that the kernel can read is not
    copied.
    """
    if type(numbers) is array.array and numbers.typecode == 'd':
        return np.asarray(numbers)
    if as_the_kernel_takes_it(numbers):
        return numbers
    return np.array(numbers, dtype=np.float64) if len(numbers) else _NOTHING
