# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
A message taken from its bytes makes the same state as one that was read first, to the last bit.
"""

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.estimation.estimator import Estimator, EstimatorSettings, RefusedMessage
from kinematics_service.estimation.input_checks import messages_of
from kinematics_service.estimation.joint_state_form import SerializedSample
from kinematics_service.kinematics.singularity import singularity_of
from kinematics_service.node.messages.joint_state_reader import JointStateReader

pytestmark = pytest.mark.ros

SECOND = 1_000_000_000
MESSAGES = 200
FIELDS = (
    *('determinant', 'manipulability', 'condition_number', 'smallest_singular_value'),
    *('singular_values', 'rank', 'distance', 'lost_direction', 'joint_motion', 'way_out'),
    *('rate', 'time_to_warning', 'level'),
)


def stream(robot, random):
    """Yield serialized messages: mostly good ones, of two drivers, with all that goes wrong."""
    names, n = list(robot.joint_names), robot.dof
    orders = [np.arange(n), random.permutation(n)]
    stamp, q = 1000 * SECOND, random.uniform(0.1, 0.9, n)
    for _ in range(MESSAGES):
        kind = random.integers(0, 24)
        stamp += int(random.choice([10_000_000, 3_000_000, 0, -5_000_000]))
        q = q + random.normal(scale=1e-2, size=n)
        order = orders[int(kind < 4)]
        message = JointState(name=[names[j] for j in order], position=q[order].tolist())
        if kind % 3:
            message.velocity = random.normal(size=n)[order].tolist()
        if kind == 5:
            message.position[int(random.integers(n))] = random.choice([np.nan, np.inf, 1e300])
        if kind == 6 and message.velocity:
            message.velocity[int(random.integers(n))] = np.nan
        if kind == 7:
            message.name = ['gripper', *message.name]
            message.position = [0.5, *message.position]
            message.velocity = []
        if kind == 8:
            message.position = message.position[:-1]
        if kind == 9:
            message.name = [names[0]] * n
        if kind == 10:
            message.name, message.position, message.velocity = ['wheel'], [1.0], []
        if kind == 11:
            message.name, message.position = message.name[: n // 2], message.position[: n // 2]
            message.velocity = message.velocity[: n // 2]
        if kind == 12:
            stamp -= 5 * SECOND
        said = 0 if kind == 13 else stamp
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(said, SECOND)
        yield serialize_message(message)


def read_first(reader, estimator, data, arrival):
    sample = reader.read(data)
    return estimator.take(sample._replace(received=sample.stamp or arrival, arrival=arrival))


def from_bytes(reader, estimator, data, arrival):
    for form in reader.forms(len(data)):
        outcome = estimator.take(SerializedSample(form, data, arrival))
        if outcome is not None:
            return outcome, True
    return read_first(reader, estimator, data, arrival), False


def same(one, other):
    if one is None or other is None:
        return one is other
    return np.asarray(one).tobytes() == np.asarray(other).tobytes()


@pytest.mark.slow
@pytest.mark.parametrize('source', ['auto', 'message', 'difference'])
@pytest.mark.parametrize('name', ['craig_3r', 'scara_hsr065', 'panda'])
def test_the_state_is_the_same_to_the_last_bit(name, source):
    robot = ks.load_robot(name)
    settings = EstimatorSettings(velocity_source=source)
    readers = JointStateReader(), JointStateReader()
    ours, official = Estimator(robot, settings), Estimator(robot, settings)
    random = np.random.default_rng(sum(map(ord, name + source)))
    fast = accepted = 0
    for k, data in enumerate(stream(robot, random)):
        arrival = 1_000_000 * k
        outcome, was_fast = from_bytes(readers[0], ours, data, arrival)
        expected = read_first(readers[1], official, data, arrival)
        fast += was_fast
        if isinstance(expected, RefusedMessage):
            assert outcome == expected
            continue
        accepted += 1
        assert outcome.stamp == expected.stamp
        assert outcome.velocity_source == expected.velocity_source
        assert same(
            outcome.state.continuous_quaternion_xyzw, expected.state.continuous_quaternion_xyzw
        )
        assert same(outcome.state.row, expected.state.row)
        assert outcome.state.moving == expected.state.moving
        found, right = singularity_of(outcome.state), singularity_of(expected.state)
        for field in FIELDS:
            assert same(getattr(found, field), getattr(right, field)), field
    assert ours.counts == official.counts
    assert accepted > MESSAGES / 4
    assert fast > MESSAGES / 3, 'hardly any message was taken from its bytes'


def test_bytes_of_another_form_change_nothing():
    robot = ks.load_robot('craig_3r')
    reader, estimator = JointStateReader(), Estimator(robot, EstimatorSettings())
    message = JointState(name=robot.joint_names, position=[0.1, 0.2, 0.3])
    message.header.stamp.sec = 5
    data = serialize_message(message)
    reader.read(data)
    (form,) = reader.forms(len(data))
    wrong = bytearray(data)
    wrong[data.index(b'q2')] ^= 1

    def memory():
        return [column.tobytes() for column in estimator.joints.columns]

    before = memory()
    for other in (bytes(wrong), data[:-1], data + b'\0', b''):
        assert estimator.take(SerializedSample(form, other, 1)) is None
    assert memory() == before
    assert estimator.take(SerializedSample(form, data, 1)).stamp == 5 * SECOND
    assert kernel.NOT_THIS_FORM < 0


def test_messages_of_two_drivers_that_are_as_long_are_told_apart():
    recent = []
    for k in range(6):
        name, other = ('left', 'right') if k % 3 else ('lower', 'upper')
        message = JointState(name=[name, other], position=[float(k), -1.0])
        message.header.stamp.sec = k
        recent.append((k, serialize_message(message)))
    assert len({len(raw) for _, raw in recent}) == 1
    found = {group.names: group for group in messages_of(recent, 6)}
    assert found['left', 'right'].q[:, 0].tolist() == [1.0, 2.0, 4.0, 5.0]
    assert found['lower', 'upper'].q[:, 0].tolist() == [0.0, 3.0]
    assert found['lower', 'upper'].seconds.tolist() == [0, 3]
