"""
The estimator: the one object with memory between a JointState message and the state of the tool.
"""

import array
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .. import kernel
from ..errors import JointVectorError
from ..kernel import Floats, IncomingForm, NearestSearch, OurJoints, OutgoingMessages
from ..kinematics.closure import why_not_closed
from ..kinematics.null_space import basis_of
from ..kinematics.singularity import Singularity, watched_value
from ..kinematics.tool_state import ToolState, as_the_kernel_takes_it, evaluate
from ..robot.measures import Level
from ..robot.robot import Robot
from .alarm import Alarm
from .integration import Integration
from .joint_accelerations import JointAccelerations
from .joint_efforts import JointEfforts
from .joint_memory import MessageJoints, NamedJoints, joint_names
from .joint_sample import JointSample
from .joint_state_form import JointStateForm

VELOCITY_SOURCES = ('auto', 'message', 'difference')


@dataclass(frozen=True)
class EstimatorSettings:
    """
    How messages become states.

    Attributes
    ----------
    joint_prefix
        Put before the joint names of the robot file.
    velocity_source
        `auto` (the message's velocities, differences where it has none), `message`, `difference`.
    timeout : ns
        A joint without a position for longer is stale; stamps that step back by more start a new
        time.
    acceleration_window : ns
        Time over which velocities are fitted by a line, whose slope is the acceleration.
    integrate_velocities
        Whether messages without positions are counted on from the last ones.
    """

    joint_prefix: str = ''
    velocity_source: str = 'auto'
    timeout: int = 1_000_000_000
    acceleration_window: int = 50_000_000
    integrate_velocities: bool = False


class EstimatorOutput(NamedTuple):
    """
    A new state of the tool.

    Attributes
    ----------
    state
        Pose, Jacobian, frames, and the twist where the velocities are known.
    quaternion_xyzw : shape (4,)
        Orientation, of unit length, its sign continuous from answer to answer.
    stamp : ns
        Stamp of the message that made it; time of its receipt if it has no stamp.
    velocity_source
        `message`, `difference`, or `none`.
    qddot : shape (n,), rad/s^2 or m/s^2, or None
        Joint accelerations, where they have been asked for and are known.
    null_space : shape (n, k), or None
        Basis of the joint motions that leave the task's rows at rest, where it has been asked for;
        continuous from answer to answer.
    torques : shape (n,), N m or N, or None
        Joint efforts less their bias, where they have been asked for and are all known.
    """

    state: ToolState
    quaternion_xyzw: Floats
    stamp: int
    velocity_source: str
    qddot: Floats | None = None
    null_space: Floats | None = None
    torques: Floats | None = None


class AcceptedMessage(NamedTuple):
    """
    Joint positions and velocities that are known after a message.

    Attributes
    ----------
    q : shape (n,), rad or m
        Joint positions, in the arm's order.
    qdot : shape (n,), rad/s or m/s, or None
        Joint velocities, if all are known.
    stamp : ns
        Stamp of the message; time of its receipt if it has no stamp.
    velocity_source
        `message`, `difference`, or `none`.
    """

    q: Floats
    qdot: Floats | None
    stamp: int
    velocity_source: str


class RefusedMessage(NamedTuple):
    """
    A message that makes no new state.

    Attributes
    ----------
    reason
        Key of the count it was added to.
    sentence
        A message for the user; empty if there is none.
    """

    reason: str
    sentence: str = ''


# Reasons, as they are counted and shown in the diagnostics.
UNREADABLE = 'not a JointState'
NOT_OURS = 'none of our joints'
NO_POSITION = 'no position'
MALFORMED = 'position and name of different length'
DUPLICATE = 'joint named twice'
NOT_FINITE = 'position not finite'
TOO_LARGE = 'position too large'
TOO_FAST = 'velocity too large'
NOT_CLOSED = 'loop does not close'
DROPPED = 'stamp not newer'
WAITING = 'waiting for other joints'
ACCEPTED = 'accepted'
NOT_STAMPED = 'not stamped'
RESETS = 'resets'

LARGEST = kernel.LARGEST

# Number of disagreements within joint_memory.DISPUTE_WINDOW from which on a joint is in dispute.
JUMPS = 4

# Source of the velocities, by the outcome of `kernel.observe` if there is a state.
_SOURCES = ('none', 'message', 'difference')
_REFUSALS = {
    kernel.NOT_NEWER: RefusedMessage(DROPPED),
    kernel.INCOMPLETE: RefusedMessage(WAITING),
    kernel.NOT_COMPUTABLE: RefusedMessage(
        TOO_LARGE, 'positions or velocities are too large to compute with'
    ),
}
_NOTHING = np.empty(0)
# Forms of streams kept.
FORMS = 16
_DOUBLES = 'd'


class Estimator:
    """
    Merges joint samples by name and time and runs the kernel on what is known.

    Nothing it holds grows with time, and no sample makes it raise.

    Parameters
    ----------
    robot
        The arm.
    settings
        How messages become states.

    Attributes
    ----------
    counts
        Number of messages by what became of them.
    efforts
        Of the joints, as far as they have been asked for.
    integration
        What has been counted on from velocities alone.
    """

    def __init__(self, robot: Robot, settings: EstimatorSettings) -> None:
        self.robot = robot
        self.settings = settings
        self.counts: Counter[str] = Counter()
        self._joints = self._new_joints()
        self._search = NearestSearch(robot.singularity.arm)
        self._alarm = Alarm()
        self._null_space: Floats | None = None
        self._is_open = False
        self._prepare()

    def configure(self, robot: Robot, settings: EstimatorSettings) -> None:
        """Apply another arm or other settings; joints that keep their names keep their states."""
        former = self._joints
        if robot is not self.robot:
            self._search = NearestSearch(robot.singularity.arm)
            former.is_closed = False  # the loops are closed from their known position
        moves_alike = robot.chain is self.robot.chain
        self.robot, self.settings = robot, settings
        same_names = joint_names(robot, settings.joint_prefix) == former.names
        if same_names and former.fits(robot):
            former.configure(robot, self._source, settings.timeout)
            self._accelerations.configure(settings.acceleration_window, settings.timeout)
            self._forms.clear()
        else:
            self._joints = self._new_joints()
            self._joints.remember(former)
        if not moves_alike:
            self._joints.is_new_tool = True
            self._alarm = Alarm()
            self._null_space = None
        self._prepare()

    def anew(self, answer: EstimatorOutput) -> EstimatorOutput | None:
        """
        Return the last answer for the arm in force now; None if not all of its joints are known.
        """
        known = self._joints.joint_vectors()
        if known is None:
            return None
        try:
            state = evaluate(self.robot, *known)
        except JointVectorError:
            return None
        return answer._replace(state=state, quaternion_xyzw=state.row[-kernel.ROW_TAIL :])

    @property
    def _source(self) -> int:
        return VELOCITY_SOURCES.index(self.settings.velocity_source)

    def _new_joints(self) -> NamedJoints:
        settings = self.settings
        # Forms as the kernel takes them; None for a form whose messages make no state of this arm.
        self._forms: dict[JointStateForm, IncomingForm | None] = {}
        self.efforts = JointEfforts(self.robot.dof)
        self.integration = Integration(self.robot)
        self._accelerations = JointAccelerations(
            self.robot.dof, settings.acceleration_window, settings.timeout
        )
        return NamedJoints(self.robot, settings.joint_prefix, self._source, settings.timeout)

    def _prepare(self) -> None:
        # The values `take_bytes` needs for each message, looked up once.
        robot = self.robot
        self._arguments = (
            self._search,
            self._joints,
            robot.chain.single_widths,
            robot.singularity.measure_places.width,
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the joints in messages."""
        return self._joints.names

    def reset(self) -> None:
        """Forget every joint: the clock or the recording started again."""
        self.counts[RESETS] += 1
        kernel.forget(self._joints)
        self.integration.forget()
        self._joints.is_new_tool = True

    def clock_stepped_back(self, now: int, back: int) -> bool:
        """
        Return whether the ROS clock's step back by `back` to `now` (ns) made a reset necessary.

        If messages of the new time came before the clock's step, they have made the reset already.
        """
        latest = self._joints.newest()
        if latest is None or latest <= now + back // 2:
            return False
        self.reset()
        return True

    def missing(self, arrival: int) -> tuple[str, ...]:
        """
        Return the names of joints not heard for the timeout before `arrival` (steady clock, ns).
        """
        return self._joints.missing(arrival, self.settings.timeout)

    def unmatched(self) -> tuple[tuple[str, ...], ...]:
        """Return the lists of names in messages, if none of them has a joint of the arm."""
        return self._joints.unmatched()

    def age(self, arrival: int) -> float:
        """Return the age in seconds of the oldest joint position, inf if a joint has none."""
        return self._joints.age(arrival)

    def beyond_limits(self) -> tuple[str, ...]:
        """Return the names of known joints that are outside their limits."""
        return self._joints.beyond(self.robot.limits)

    def disputed(self, arrival: int) -> tuple[str, ...]:
        """Return the names of joints about which messages have disagreed lately."""
        return self._joints.disputed(arrival, JUMPS)

    def is_settled(self, state: ToolState, arrival: int) -> bool:
        """
        Return whether `judge` would publish nothing and change nothing, by the kernel's level.
        False if that needs a closer look.
        """
        alarm, measures = self._alarm, state.measures
        if measures is None or alarm.level is not Level.OK:
            return False
        level: float = measures.item(self.robot.singularity.measure_places.judged + kernel.LEVEL)
        return level == 0.0 and alarm.is_settled(Level.OK, arrival)

    def judge(self, singularity: Singularity, arrival: int) -> tuple[Level, bool]:
        """Return the level of a new state, with hysteresis, and whether to publish it."""
        alarm = self._alarm
        if alarm.level is Level.OK or alarm.level is Level.STALE:
            level: Level = singularity.level  # there is no level to leave
        else:
            value = watched_value(self.robot, singularity)
            # That of the pose is the higher one where the pose is nearly singular.
            level = max(
                self.robot.singularity.thresholds.level(value, alarm.level), singularity.level
            )
        if alarm.is_settled(level, arrival):
            return level, False
        factors = singularity.factors
        self._alarm, say = alarm.step(
            level,
            singularity.lost_direction,
            arrival,
            None if factors is None else factors.nearest,
        )
        return level, say

    def go_stale(self, arrival: int) -> bool:
        """Return whether to publish that the state is stale: once each time it becomes stale."""
        self._alarm, say = self._alarm.step(Level.STALE, None, arrival)
        return say

    def take(
        self, sample: JointSample, depth: int = kernel.ALL_FRAMES
    ) -> EstimatorOutput | RefusedMessage:
        """
        Return the new state a sample makes, with its measures there, or why it makes none.

        Parameters
        ----------
        sample
            The message.
        depth
            `kernel.JACOBIAN`, or `kernel.ALL_FRAMES` if the link frames are needed.
        """
        row = np.empty(self.robot.chain.single_widths[depth])
        outcome = self._observe(sample, row)
        if isinstance(outcome, RefusedMessage):
            return outcome
        measures = np.empty(self.robot.singularity.measure_places.width)
        kernel.measure_one(self._search, row, measures)
        moving = outcome != kernel.SAID_WITHOUT_VELOCITIES
        state = ToolState(self.robot, row, moving, None, measures)
        return EstimatorOutput(
            state, row[-kernel.ROW_TAIL :], sample.stamp or sample.received, _SOURCES[outcome]
        )

    def take_bytes(
        self,
        form: JointStateForm,
        data: bytes,
        arrival: int,
        depth: int = kernel.ALL_FRAMES,
        answers: OutgoingMessages | None = None,
    ) -> EstimatorOutput | RefusedMessage | None:
        """
        Return what `take` returns for a serialized message.

        None for bytes of another form, for a message without a stamp, and for one that needs a
        message of refusal: then nothing was done, and the caller reads it and gives it to `take`.

        Parameters
        ----------
        form, data, arrival
            The message, the form it should have, and the time of its arrival (steady clock, ns).
        depth
            As in `take`.
        answers
            Messages to be filled with the answer.
        """
        try:
            incoming = self._forms[form]
        except KeyError:
            incoming = self._keep(form)
        if incoming is None:
            return None
        search, memory, widths, width = self._arguments
        row, measures = np.empty(widths[depth]), np.empty(width)
        outcome: int = kernel.observe_bytes(
            search,
            memory,
            incoming,
            data,
            arrival,
            row,
            measures,
            answers,
        )
        if outcome == kernel.NOT_THIS_FORM or outcome == kernel.BAD_POSITION:
            return None
        if outcome >= kernel.STARTED_ANEW:
            self.counts[RESETS] += 1
            outcome -= kernel.STARTED_ANEW
        if outcome > kernel.SAID_WITH_DIFFERENCES:
            return self._refused(outcome)
        self.counts[ACCEPTED] += 1
        self._is_open = False
        moving = outcome != kernel.SAID_WITHOUT_VELOCITIES
        state = ToolState(self.robot, row, moving, None, measures)
        return EstimatorOutput(state, row[-kernel.ROW_TAIL :], incoming.stamp, _SOURCES[outcome])

    def _keep(self, form: JointStateForm) -> IncomingForm | None:
        ours, duplicates = self._joints.joints_in(form.names)
        one_each = form.counts[0] == len(form.names)
        incoming = None
        if ours.count and not duplicates and one_each and not self.settings.integrate_velocities:
            incoming = form.for_joints(ours)
        if len(self._forms) >= FORMS:
            self._forms.clear()
        self._forms[form] = incoming
        return incoming

    @property
    def acceleration_delay(self) -> float:
        """Return by how much the last joint accelerations were late, s."""
        return self._accelerations.delay

    def with_accelerations(self, answer: EstimatorOutput) -> EstimatorOutput:
        """
        Return the answer to the last message with its joint accelerations, where they are known.

        They are of velocities that messages report: differences of positions differ by the noise
        of these over the square of the time between them.
        """
        if answer.velocity_source != 'message':
            self._accelerations.forget()
            return answer
        columns = self._joints.columns
        qddot = self._accelerations.take(columns.stamp, columns.velocity)
        return answer._replace(qddot=qddot)

    def hear_efforts(self, names: Sequence[str], efforts: Sequence[float] | Floats) -> None:
        """Note the efforts of a message with these names that has been answered."""
        ours = self._joints.joints_in(names).ours
        self.efforts.take(ours, len(names), _doubles(efforts))

    def with_torques(self, answer: EstimatorOutput) -> EstimatorOutput:
        """Return an answer with the joint efforts less their bias, where all are known."""
        return answer._replace(torques=self.efforts.torques())

    def with_null_space(self, answer: EstimatorOutput) -> EstimatorOutput:
        """Return an answer with the basis of its null space that is nearest to the last one."""
        basis = basis_of(self.robot.singularity.task, answer.state.jacobian, self._null_space)
        self._null_space = basis
        return answer._replace(null_space=basis)

    def accept(self, sample: JointSample) -> AcceptedMessage | RefusedMessage:
        """
        Return the joints that are known after a sample, or why it makes no new state.

        This is the part of `take` with a memory; a recording passes it message by message, and the
        kernel in one batch.
        """
        n, chain = self.robot.dof, self.robot.chain
        # Whether loops close decides, too.
        tail = 2 * n + kernel.ROW_TAIL
        row = np.empty(chain.single_widths[kernel.POSE] if chain.loops else tail)
        outcome = self._observe(sample, row)
        if isinstance(outcome, RefusedMessage):
            return outcome
        joints = row[-tail:]
        qdot = None if outcome == kernel.SAID_WITHOUT_VELOCITIES else joints[n : 2 * n]
        return AcceptedMessage(
            joints[:n], qdot, sample.stamp or sample.received, _SOURCES[outcome]
        )

    def _observe(self, sample: JointSample, row: Floats) -> int | RefusedMessage:
        # One of the first three outcomes of `kernel.observe`, or a refusal; counted.
        named, refusal = self._joints.joints_in(sample.names), None
        if self.settings.integrate_velocities and named.ours.count:
            sample, refusal = self._counted_on(sample, named.ours)
        refusal = refusal or self._shape_refusal(sample, named)
        if refusal is None:
            positions, velocities = _doubles(sample.positions), _doubles(sample.velocities)
            outcome: int = kernel.observe(
                self.robot.singularity.arm,
                self._joints,
                named.ours,
                positions,
                velocities,
                sample.stamp,
                sample.received,
                sample.arrival,
                row,
            )
            if sample.stamp == 0 and outcome != kernel.BAD_POSITION:
                self.counts[NOT_STAMPED] += 1
            if outcome >= kernel.STARTED_ANEW:
                self.counts[RESETS] += 1
                outcome -= kernel.STARTED_ANEW
            if outcome <= kernel.SAID_WITH_DIFFERENCES:
                self.counts[ACCEPTED] += 1
                self._is_open = False
                return outcome
            if outcome in _REFUSALS or outcome == kernel.NOT_CLOSED:
                return self._refused(outcome)
            refusal = self._bad_position(named.ours, positions)
        self.counts[refusal.reason] += 1
        return refusal

    def _counted_on(
        self, sample: JointSample, ours: OurJoints
    ) -> tuple[JointSample, RefusedMessage | None]:
        if len(sample.positions):
            self.integration.forget(ours.table[0])
            return sample, None
        velocities = _doubles(sample.velocities)
        if fast := self.integration.too_fast(velocities, self.names, ours):
            return sample, RefusedMessage(TOO_FAST, fast)
        found = self.integration.positions(sample, velocities, self._joints, ours)
        return (sample if found is None else sample._replace(positions=found)), None

    def _refused(self, outcome: int) -> RefusedMessage:
        if outcome == kernel.NOT_COMPUTABLE:
            # The lengths of an arm made in Python can overflow; such a position must not be kept.
            kernel.forget(self._joints)
        refusal = self._not_closed() if outcome == kernel.NOT_CLOSED else _REFUSALS[outcome]
        self.counts[refusal.reason] += 1
        return refusal

    def _not_closed(self) -> RefusedMessage:
        # Said once: to look for it takes a hundred times as long as a message.
        if self._is_open:
            return RefusedMessage(NOT_CLOSED)
        self._is_open = True
        _, sentence = why_not_closed(self.robot, self._joints.positions())
        return RefusedMessage(
            NOT_CLOSED,
            sentence or f'a loop of {self.robot.name} ends on the way from the last position',
        )

    def _shape_refusal(self, sample: JointSample, named: MessageJoints) -> RefusedMessage | None:
        if not named.ours.count:
            return RefusedMessage(NOT_OURS)
        if len(sample.positions) != len(sample.names):
            if len(sample.positions) == 0:
                return RefusedMessage(NO_POSITION)
            return RefusedMessage(
                MALFORMED,
                f'{len(sample.names)} names but {len(sample.positions)} positions',
            )
        if named.duplicates:
            return RefusedMessage(DUPLICATE, f'joint {named.duplicates[0]!r} is named twice')
        return None

    def _bad_position(self, ours: OurJoints, positions: Floats) -> RefusedMessage:
        for j, index in zip(*ours.table):
            position = float(positions[index])
            if not abs(position) <= kernel.LARGEST:
                reason = TOO_LARGE if math.isfinite(position) else NOT_FINITE
                return RefusedMessage(
                    reason, f'position of joint {self._joints.names[j]!r} is {position}'
                )
        raise AssertionError('the kernel found a position that is not finite or too large')


def _doubles(numbers: Sequence[float] | Floats) -> Floats:
    # In the only layout the kernel takes; arrays that have it are not copied.
    if type(numbers) is array.array and numbers.typecode == _DOUBLES:
        return np.asarray(numbers)
    if as_the_kernel_takes_it(numbers):
        return numbers
    return np.array(numbers, dtype=np.float64) if len(numbers) else _NOTHING
