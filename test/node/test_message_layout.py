# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The layouts written down are the official serializer's, and a wrong one is found out."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2: ros-jazzy-rclpy or a sourced Jazzy')

from built_messages import bits
from geometry_msgs.msg import PoseStamped
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

import kinematics_service as ks
from kinematics_service.estimation import cdr
from kinematics_service.node.messages import message_layout
from kinematics_service.node.messages.content import Built
from kinematics_service.node.messages.message_layout import MessageLayout
from kinematics_service.node.messages.output_topics import TOPICS
from kinematics_service.node.parameters.settings import defaults, settings_from

SECOND = 1_000_000_000
BUILT = '~/markers'
FILLED = [topic for topic in TOPICS if topic.name != BUILT]
TYPES = {(topic.type, topic.template): topic for topic in FILLED}.values()


def settings_of(n, text, order='linear_first', twist_frame='base', names=None):
    return SimpleNamespace(
        base_frame='b' * text,
        tool_frame='t' * (9 - text),
        twist_frame=twist_frame,
        row_order=order,
        joint_names=['q' * ((k + text) % 9) for k in range(n)] if names is None else names,
        robot=SimpleNamespace(
            dof=n,
            chain=SimpleNamespace(frames=n + 1),
            singularity=SimpleNamespace(task=SimpleNamespace(generic_rank=min(n - 1, 6))),
        ),
    )


def any_numbers(random, count):
    # Any bits at all: denormals, huge ones. A signalling NaN may be quieted by any move.
    numbers = random.integers(0, 256, 8 * count, np.uint8).view(np.float64)
    numbers[np.isnan(numbers)] = np.nan
    return numbers


def check(layout, random):
    stamp = int(random.integers(-(2**62), 2**62))
    numbers = any_numbers(random, layout.count)
    built = layout.message(stamp, numbers)
    said = deserialize_message(layout.bytes_of(stamp, numbers), type(built))
    assert bits(said) == bits(built)
    assert layout.is_official()


def test_every_published_message_but_the_markers_is_filled():
    # What costs far more than its message is computed for who listens, and built.
    settings = settings_from(defaults(robot := ks.load_robot('puma560')), robot)
    contents = {topic.name: topic.content(settings) for topic in TOPICS}
    assert [name for name, content in contents.items() if isinstance(content, Built)] == [BUILT]


@pytest.mark.parametrize('topic', TYPES, ids=lambda topic: topic.name)
def test_frames_of_every_length(topic):
    random = np.random.default_rng(5)
    for text in range(10):
        for frame in ('base', 'tool'):
            check(MessageLayout(topic.blank(settings_of(6, text, twist_frame=frame))), random)


@pytest.mark.parametrize('order', ['linear_first', 'angular_first'])
@pytest.mark.parametrize('name', ['~/jacobian', '~/link_frames'])
def test_one_to_twelve_joints_with_names_of_every_length(name, order):
    (topic,) = (topic for topic in FILLED if topic.name == name)
    random = np.random.default_rng(6)
    for n in range(1, 13):
        for length in range(9):
            layout = MessageLayout(topic.blank(settings_of(n, length, order)))
            assert layout.count == (6 * n if 'jacobian' in name else 7 * (n + 1))
            if length < 3 or n == 6:
                check(layout, random)
            else:
                assert layout.is_official()


def test_texts_that_are_not_ascii():
    random = np.random.default_rng(7)
    for topic in TYPES:
        settings = settings_of(3, 3, names=['é', 'ジョイント', 'q_3'])
        settings.base_frame = 'süß'
        check(MessageLayout(topic.blank(settings)), random)


def pose_layout(frame='base_link'):
    return MessageLayout(PoseStamped(header=Header(frame_id=frame)))


@pytest.mark.parametrize('number', [-0.0, 5e-324, np.inf, -np.inf, np.nan, 1.7976931348623157e308])
@pytest.mark.parametrize('stamp', [0, -1, 2**31 * SECOND - 1, 2**31 * SECOND, -(2**33) * SECOND])
def test_hard_numbers_and_stamps(number, stamp):
    layout, numbers = pose_layout(), np.full(7, number)
    said = deserialize_message(layout.bytes_of(stamp, numbers), PoseStamped)
    assert bits(said) == bits(layout.message(stamp, numbers))
    seconds = max(-(2**31), min(2**31 - 1, stamp // SECOND))
    assert (said.header.stamp.sec, said.header.stamp.nanosec) == (seconds, stamp % SECOND)


def test_bytes_stay_as_they_were_when_the_next_are_made():
    layout = pose_layout()
    first = layout.bytes_of(5, np.full(7, 1.5))
    layout.bytes_of(6, np.full(7, 2.5))
    assert deserialize_message(first, PoseStamped).pose.position.x == 1.5


def rounded(layout, stamp, numbers):
    with np.errstate(over='ignore'):
        return layout, stamp, numbers.astype(np.float32).astype(np.float64)


def reversed_(layout, stamp, numbers):
    return layout, stamp, numbers[::-1].copy()


def without_signed_zeros(layout, stamp, numbers):
    return layout, stamp, numbers + 0.0


def without_times_before_the_epoch(layout, stamp, numbers):
    return layout, max(stamp, 0), numbers


@pytest.mark.parametrize(
    'change', [rounded, reversed_, without_signed_zeros, without_times_before_the_epoch]
)
def test_bytes_that_say_something_else_are_found_out(monkeypatch, change):
    assert pose_layout().is_official()
    bytes_of = MessageLayout.bytes_of
    monkeypatch.setattr(MessageLayout, 'bytes_of', lambda *given: bytes_of(*change(*given)))
    assert not pose_layout().is_official()


def without_its_zero(writer, text):
    writer.whole(len(text))
    at = writer.room(1, len(text))
    writer.data[at:] = text.encode()


def unaligned(writer, size, count=1, room=cdr.CdrWriter.room):
    return room(writer, 1, size * count)


def aligned_to_four(writer, size, count=1, room=cdr.CdrWriter.room):
    return room(writer, 4, 2 * count) if size == 8 else room(writer, size, count)


@pytest.mark.parametrize(
    ('name', 'wrong'),
    [('text', without_its_zero), ('room', unaligned), ('room', aligned_to_four)],
)
def test_a_wrong_layout_is_found_out(monkeypatch, name, wrong):
    assert pose_layout('abcdef').is_official()
    monkeypatch.setattr(cdr.CdrWriter, name, wrong)
    assert not pose_layout('abcdef').is_official()


def test_a_clamp_forgotten_is_found_out(monkeypatch):
    def set_time(message, stamp):
        message.sec, message.nanosec = (stamp // SECOND) % 2**31, stamp % SECOND
        return message

    monkeypatch.setattr(message_layout, 'set_time', set_time)
    assert not pose_layout().is_official()


def test_a_field_of_another_kind_has_no_layout_and_is_built():
    # Positions and velocities stand apart; a status has an octet.
    apart = MessageLayout(JointState(position=[0.0], velocity=[0.0]))
    assert not apart.is_official()
    built = apart.message(5 * SECOND, np.array([1.0, 2.0]))
    assert (built.header.stamp.sec, *built.position, *built.velocity) == (5, 1.0, 2.0)
