# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The wire: the reader of bytes says what the official deserializer says.

Run as a program, `test_wire.py COUNT SEED [eager]`, it compares the reader with the official
deserializer on so many hostile messages; a process of its own, as the bytes might have killed it.
"""

import json
import random
import resource
import struct
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

pytest.importorskip('rclpy', reason='needs ROS 2: ros-jazzy-rclpy or a sourced Jazzy')

from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState

from kinematics_service.errors import WireError
from kinematics_service.node.messages import joint_state_reader as wire_reader
from kinematics_service.node.messages.joint_state_reader import JointStateReader

pytestmark = pytest.mark.ros

SECOND = 1_000_000_000
UR = ('shoulder_pan', 'shoulder_lift', 'elbow', 'wrist_1', 'wrist_2', 'wrist_3')


def joint_state(names=UR, position=None, velocity=None, effort=(), stamp=5, frame='base_link'):
    message = JointState(name=list(names), effort=list(effort))
    message.position = list(range(len(names)) if position is None else position)
    message.velocity = [0.5] * len(names) if velocity is None else list(velocity)
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, SECOND)
    message.header.frame_id = frame
    return message


def official(data):
    try:
        message = deserialize_message(data, JointState)
    except Exception:
        return None
    stamp = message.header.stamp.sec * SECOND + message.header.stamp.nanosec
    return (list(message.name), message.position.tobytes(), message.velocity.tobytes(), stamp)


def read(reader, data):
    try:
        state = reader.read(data)
    except WireError:
        return None
    assert type(state.stamp) is int
    for numbers in (state.positions, state.velocities):
        assert numbers.dtype == np.float64
        assert numbers.flags.aligned
        assert not numbers.flags.writeable
    return (
        list(state.names),
        state.positions.tobytes(),
        state.velocities.tobytes(),
        state.stamp,
    )


class CountingReader(JointStateReader):
    """A reader that counts what it reads officially."""

    def __init__(self):
        super().__init__()
        self.slow = 0

    def read_officially(self, data):
        self.slow += 1
        return super().read_officially(data)


def with_padding(message, generator):
    # A serialized message in which chance has filled the bytes between fields: those which make
    # no difference to the official deserializer, whatever they are.
    data = bytearray(serialize_message(message))
    for place in range(4, len(data)):
        said = set()
        for value in (0, 65, 66, 255, data[place]):
            other = data.copy()
            other[place] = value
            try:
                said.add(str(deserialize_message(bytes(other), JointState)))
            except RuntimeError:
                said.add(None)
        if len(said) == 1:
            data[place] = generator.randrange(256)
    return bytes(data)


def test_a_stream_is_read_from_its_bytes():
    reader, generator = CountingReader(), random.Random(1)
    values = [generator.uniform(-3, 3) for _ in UR]
    names = set()
    for k in range(50):
        values = [value + 1e-3 for value in values]
        message = joint_state(position=values, velocity=values, effort=values, stamp=k * SECOND)
        data = serialize_message(message)
        assert read(reader, data) == official(data)
        names.add(id(reader.read(data).names))
    assert len(names) == 1
    assert reader.slow == 0


def test_bytes_between_fields_do_not_matter():
    reader, generator = CountingReader(), random.Random(2)
    message = joint_state(names=('a', 'bb', 'ccc', 'dddd', 'eeeee', 'f'), frame='b')
    for _ in range(3):
        data = with_padding(message, generator)
        assert read(reader, data) == official(data)
    assert reader.slow == 0


def test_two_drivers_on_one_topic():
    reader = CountingReader()
    left, right = joint_state(UR, stamp=9), joint_state(('finger_1', 'finger_2'), velocity=())
    for _ in range(20):
        for message in (left, right):
            data = serialize_message(message)
            assert read(reader, data) == official(data)
    assert reader.slow == 0


@pytest.mark.parametrize(
    'change',
    [
        {'names': ('shoulder_pan', 'shoulder_lift', 'elbow', 'wrist_1', 'wrist_3', 'wrist_2')},
        {'velocity': ()},
        {'velocity': (1.0,) * 5},
        {'position': (), 'velocity': ()},
        {'frame': 'base_lynk'},
        {'frame': ''},
        {'effort': (1.0,)},
        {'names': UR[:5]},
        # Six doubles in all, divided otherwise.
        {'position': (1.0,) * 4, 'velocity': (2.0,) * 8},
    ],
    ids=str,
)
def test_another_layout_is_seen_at_once(change):
    reader = JointStateReader()
    for message in (joint_state(), joint_state(**change), joint_state(), joint_state(**change)):
        data = serialize_message(message)
        assert read(reader, data) == official(data)


@pytest.mark.parametrize('effort', [(), (1.0,) * 6], ids=['', 'with efforts'])
def test_padding_claimed_by_the_encapsulation_is_left_to_the_official_reader(effort):
    reader = CountingReader()
    good = serialize_message(joint_state(effort=effort))
    for claimed in range(8):
        data = good[:3] + bytes([claimed]) + good[4:]
        assert read(reader, good) == official(good)
        assert read(reader, data) == official(data)
    assert reader.slow == 6


@pytest.mark.parametrize(
    'text', [b'\xff\xfe\x80\x80', b'a\x00cd', b'abc\x00', b'\xc3\xa9xy', b'\xed\xa0\x80z']
)
def test_names_that_are_no_text(text):
    # Bytes that are no UTF-8 look alike in a name, so they must not be taken for padding.
    reader = JointStateReader()
    good = serialize_message(joint_state(names=('abcd',)))
    for data in (good, good.replace(b'abcd', text)):
        for last in (0, 1, 0x41, 0x80, 0xFE, 0xFF):
            for k in range(2):
                place = data.find(text if text in data else b'abcd')
                changed = data[: place + 3] + bytes([last]) + data[place + 4 :]
                assert read(reader, data) == official(data), (k, last)
                assert read(reader, changed) == official(changed), (k, last)


@pytest.mark.parametrize('size', range(0, 330, 21))
def test_truncated_messages(size):
    reader = JointStateReader()
    data = serialize_message(joint_state(effort=(1.0,) * 6))
    reader.read(data)
    assert read(reader, data[:size]) == official(data[:size])
    assert read(reader, data) == official(data)


def test_refused_bytes_are_an_error_of_one_sentence():
    with pytest.raises(WireError, match='^3 bytes .*JointState'):
        JointStateReader().read(b'abc')


def test_ever_new_forms_are_forgotten():
    reader = CountingReader()
    steady = serialize_message(joint_state())
    for k in range(100):
        data = serialize_message(joint_state(names=(f'joint_{k}',)))
        assert read(reader, data) == official(data)
        assert read(reader, steady) == official(steady)
        assert len(list(reader.forms(len(steady)))) == 1
    assert reader.slow == 0
    assert len(reader._forms) == wire_reader.MAX_FORMS


def test_a_huge_message_is_read_and_not_kept():
    reader = JointStateReader()
    data = serialize_message(joint_state(names=[f'joint_{k}' for k in range(20_000)]))
    assert read(reader, data) == official(data)
    assert not reader._forms


any_float = st.floats(allow_nan=True, allow_subnormal=True)


@st.composite
def messages(draw):
    names = draw(st.lists(st.text(max_size=5).filter(lambda s: '\0' not in s), max_size=4))
    names = [name.encode('utf-8', 'ignore').decode() for name in names]
    numbers = st.lists(any_float, max_size=5)
    return serialize_message(
        joint_state(
            names,
            draw(numbers),
            draw(numbers),
            draw(numbers),
            draw(st.integers(-(2**31) * SECOND, 2**31 * SECOND - 1)),
            draw(st.text(max_size=3).filter(lambda s: '\0' not in s))
            .encode('utf-8', 'ignore')
            .decode(),
        )
    )


@settings(max_examples=35, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    st.lists(messages(), min_size=1, max_size=3),
    st.lists(
        st.tuples(st.integers(0, 400), st.integers(0, 400), st.binary(max_size=4)), max_size=8
    ),
)
def test_any_bytes_are_read_as_officially(streams, edits):
    reader = JointStateReader()
    for data in streams:
        for _ in range(2):
            assert read(reader, data) == official(data)
        for place, length, patch in edits:
            place = min(place, len(data))
            cut = len(patch) if length % 3 else length % 17
            data = data[:place] + patch + data[place + cut :]
            assert read(reader, data) == official(data)


# Hostile bytes, in a process of their own

COUNTS = (0, 1, 2, 3, 7, 255, 65535, 2**20, 2**28, 2**29, 2**30, 2**31 - 1, 2**31)
COUNTS += (2**32 - 8, 2**32 - 4, 2**32 - 1)


def hostile(data, generator):
    data = bytearray(data)
    for _ in range(generator.choice((1, 1, 1, 2, 3))):
        place = generator.randrange(len(data)) if data else 0
        kind = generator.randrange(10)
        if kind < 3 and data:
            data[place] = generator.randrange(256)
        elif kind < 5 and data:
            data[place] ^= 1 << generator.randrange(8)
        elif kind < 7 and len(data) >= 4:
            place -= place % 4
            data[place : place + 4] = struct.pack('=I', generator.choice(COUNTS))[: len(data)]
        elif kind == 7:
            del data[place : place + generator.choice((1, 2, 4, 8, 1000))]
        elif kind == 8:
            data += generator.randbytes(generator.choice((1, 2, 4, 8)))
        elif len(data) > 3:
            data[generator.randrange(4)] = generator.randrange(12)
    return bytes(data)


def fuzz(count, seed, eager):
    generator = random.Random(seed)
    ones = [
        joint_state(),
        joint_state(effort=(1.0,) * 6, frame=''),
        joint_state(names=('a', 'bb', 'ccc'), velocity=()),
        joint_state(names=('é', '', 'x' * 17), position=(np.nan, -0.0, 5e-324)),
        joint_state(names=()),
        joint_state(names=[f'j{k}' for k in range(40)]),
    ]
    reader = CountingReader()
    refused, before = 0, 0
    for k in range(count):
        data = serialize_message(generator.choice(ones))
        if k % 5:
            data = hostile(data, generator)
        expected = official(data)
        refused += expected is None
        for _ in range(2 if eager else 1):
            assert read(reader, data) == expected, data.hex()
        if k == count // 5:
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    fast = (2 if eager else 1) * count - reader.slow
    print(json.dumps({'refused': refused, 'fast': fast, 'grown': grown}))


@pytest.mark.slow
@pytest.mark.parametrize('eager', [False, True], ids=['patient', 'eager'])
def test_hostile_bytes_are_read_as_officially(eager):
    count = 1_000 if eager else 2_500
    result = subprocess.run(
        [sys.executable, __file__, str(count), '3', *(['eager'] if eager else [])],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert result.returncode == 0, result.stderr[-2000:]
    told = json.loads(result.stdout)
    # All three kinds of bytes were there: read fast, read officially, refused.
    assert told['refused'] > count // 10
    assert told['fast'] > count // 5
    assert count - told['refused'] > count // 5
    assert told['grown'] < 340  # KiB: 175 bytes for each of the last 2,000


if __name__ == '__main__':
    fuzz(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3:] == ['eager'])
