# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the node answers to what it hears: the input table, a test or more for each row."""

import math
import time

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from types import SimpleNamespace

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from ros_harness import (
    BEST_EFFORT,
    BOTH_TRANSPORTS,
    LATCHED,
    RELIABLE,
    SECOND,
    START,
    STEP,
    joint_state,
    level_of,
    nanoseconds,
    values_of,
)
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from target_harness import Targets, twist_target

import kinematics_service as ks
from kinematics_service.estimation import outcomes
from kinematics_service.node import best_subscription
from kinematics_service.node.health import JOINT_STATES, why_no_joint_states

ROUND_OFF = 1e-12
Q = (0.3, -0.4, 1.2)
NAMES = ['q1', 'q2', 'q3']
OK, WARN, ERROR, STALE = range(4)
SHORT = ['-p', 'joint_state_timeout:=0.2']


def position(q):
    return ks.forward_kinematics(ks.load_robot('craig_3r'), q)[:3, 3]


def expect(pose, q):
    p = pose.pose.position
    np.testing.assert_allclose([p.x, p.y, p.z], position(q), atol=ROUND_OFF)


# Names


@BOTH_TRANSPORTS
def test_names_may_come_in_any_order_with_others_between(arm):
    one = arm()
    poses = one.poses
    names = ['wheel', 'q3', 'q1', 'finger', 'q2']
    one.publish(joint_state(names, (9.0, Q[2], Q[0], math.nan, Q[1]), (), START))
    one.spin_until(lambda: poses, 'pose')
    expect(poses[0], Q)


def test_a_message_with_none_of_our_names_is_counted_without_a_warning(arm):
    one = arm()
    one.answer(Q)
    one.publish(joint_state(['a', 'b'], (1.0,), (), START + 2 * STEP))
    one.publish(joint_state([], (), (), START + 2 * STEP))
    one.answer(Q, stamp=START + 3 * STEP)
    status = one.diagnose()
    assert level_of(status) == OK
    assert values_of(status)['ignored: none of our joints'] == '2'
    assert one.stamps() == [START + STEP, START + 3 * STEP]


@BOTH_TRANSPORTS
def test_a_hundred_thousand_names_are_read(arm, transport):
    one = arm()
    # As objects they are read by ROS, name by name.
    count = 100_000 if transport == 'bytes' else 2_000
    names = [f'joint_{k}' for k in range(count)]
    poses = one.poses
    one.publish(joint_state([*names, *NAMES], [0.0] * count + list(Q), (), START + 1))
    one.spin_until(lambda: poses, 'pose')
    expect(poses[0], Q)
    expect(one.answer(Q), Q)


@BOTH_TRANSPORTS
def test_names_that_are_no_utf_8_do_no_harm(arm):
    one = arm()
    poses = one.poses
    message = joint_state(['XXXX', *NAMES], (9.0, *Q), (), START)
    raw = serialize_message(message)
    assert raw.count(b'XXXX') == 1
    publisher = one.speaker('/joint_states')
    publisher.publish(raw.replace(b'XXXX', b'\xff\xfe\x80\xc3'))
    one.spin_until(lambda: poses, 'pose')
    expect(poses[0], Q)


def broken_forms(message):
    """Return bytes that are no message: cut, with lengths that lie, in no encoding, noise."""
    raw = bytes(serialize_message(message))
    noise = np.random.default_rng(5)
    whole = raw[: len(raw) - len(raw) % 4]
    return [
        *(whole[:size] for size in range(0, len(whole) - 8, 3)),
        *(raw[:at] + b'\xff\xff\xff\x7f' + raw[at + 4 :] for at in (12,)),
        *(bytes([0, encoding]) + raw[2:] for encoding in (0, 4, 5, 12, 200)),
        *(b'\x07' + noise.bytes(size) for size in range(1, 90, 4)),
    ]


@BOTH_TRANSPORTS
def test_bytes_that_are_no_message_are_counted_and_said_once(arm, capfd):
    one = arm()
    publisher = one.speaker('/joint_states')
    arrays = one.listen('/diagnostics', DiagnosticArray)
    broken = broken_forms(joint_state(NAMES, Q, (0.1, 0.2, 0.3), START))
    for data in broken * 2:
        publisher.publish(data)
    expect(one.answer(Q), Q)
    assert len(one.poses) == 1
    values = one.counts()
    # Said by the first diagnostics after the messages, of the timer or of `counts`.
    said = 'messages rejected: not a JointState'
    one.spin_until(lambda: any(said in array.status[0].message for array in arrays), 'a warning')
    assert values['rejected: not a JointState'] == values['rejected'] == str(2 * len(broken))
    # Nothing but the node's own lines: the official deserializer has not been asked.
    lines = [line for line in capfd.readouterr().err.splitlines() if ' bytes ' in line]
    assert len(lines) == 1
    assert 'rejected: 0 bytes' in lines[0]


@pytest.mark.parametrize(
    ('topic', 'kind'),
    [
        ('target_pose', PoseStamped),
        ('target_twist', TwistStamped),
        ('reference_pose', PoseStamped),
    ],
)
def test_bytes_that_are_no_target_are_refused_and_leave_the_log_alone(arm, capfd, topic, kind):
    one = arm()
    publisher = one.peer.create_publisher(kind, one.topic(topic), BEST_EFFORT)
    statuses = one.hear('ik/status', DiagnosticStatus)
    one.spin_until(lambda: publisher.get_subscription_count() == 1, 'listener')
    message = kind()
    message.header.frame_id = 'base_link'
    capfd.readouterr()
    sent = 0

    def refused():
        if topic == 'reference_pose':
            one.node._health.say()
            return one.node._reference._refused
        return statuses

    def throw():
        nonlocal sent
        for data in broken_forms(message):
            publisher.publish(data)
            sent += 1
            one.executor.spin_once(timeout_sec=0.0)
        return refused()

    one.spin_until(throw, 'refusal')
    said = one.node._reference._refused if topic == 'reference_pose' else statuses[0].message
    assert f'not a {kind.__name__} message' in said
    assert sent
    assert capfd.readouterr().err == ''
    expect(one.answer(Q), Q)


def test_a_target_twist_that_cannot_be_read_stops_what_the_last_one_began(arm):
    one = arm(ros_args=['-p', 'ik.target_timeout:=3000.0'])
    targets = Targets(one)
    one.answer(Q)
    assert targets.ask(twist_target((0.0, 0.0, 0.1, 0.0, 0.0, 0.0))).level != b'\x02'
    one.spin_until(lambda: targets.velocities, 'joint velocities')
    assert any(targets.velocities[-1].velocity)
    targets._publishers[TwistStamped].publish(b'\x00\x01\x00\x00' + b'\x05' * 20)
    one.spin_until(lambda: not any(targets.velocities[-1].velocity), 'stop')


# Several messages and publishers


def test_joints_of_two_drivers_are_merged(arm):
    one = arm()
    poses = one.poses
    first = one.speaker('/joint_states')
    second = one.speaker('/joint_states', node=one.other('hand'))
    first.publish(joint_state(NAMES[:2], Q[:2], (), START))
    one.spin_until(lambda: one.counts()['waiting for other joints'] == '1', 'first half')
    assert values_of(one.diagnose())['missing joints'] == 'q3'
    second.publish(joint_state(NAMES[2:], Q[2:], (), START + 7))
    one.spin_until(lambda: len(poses) == 1, 'pose')
    first.publish(joint_state(NAMES[:2], (1.0, 1.0), (), START + 9))
    one.spin_until(lambda: len(poses) == 2, 'pose')
    expect(poses[0], Q)
    expect(poses[1], (1.0, 1.0, Q[2]))
    assert one.stamps() == [START + 7, START + 9]


def test_a_joint_that_falls_silent_makes_the_arm_stale_though_others_speak(arm):
    one = arm(ros_args=SHORT)
    warnings = one.hear('singularity/warning', DiagnosticStatus, LATCHED)
    one.answer(Q)
    one.spin_until(lambda: warnings, 'first warning')

    def stale():
        one.stamp += STEP
        one.publish(joint_state(NAMES[:2], Q[:2], (), one.stamp))
        return level_of(warnings[-1]) == STALE

    one.spin_until(stale, 'warning STALE')
    assert ' q3 on /joint_states' in warnings[-1].message
    assert 'q1' not in warnings[-1].message
    assert level_of(one.diagnose()) == ERROR


def test_publishers_that_disagree_are_both_named_with_the_joint(arm):
    one = arm()
    first = one.speaker('/joint_states')
    second = one.speaker('/joint_states', node=one.other('impostor'))

    def disputed():
        for publisher, shift in ((first, 0.0), (second, 0.5)):
            one.stamp += STEP
            publisher.publish(joint_state(NAMES, (Q[0], Q[1] + shift, Q[2]), (), one.stamp))
            one.executor.spin_once(timeout_sec=0.01)
        return 'disagree' in one.diagnose().message

    poses = one.poses
    first.publish(joint_state(NAMES, Q, (), one.stamp))
    one.spin_until(lambda: poses, 'pose')
    one.spin_until(disputed, 'dispute')
    status = one.diagnose()
    assert status.message.endswith(' about q2: /impostor and /peer')
    assert values_of(status)['joints that publishers disagree about'] == 'q2'
    for k in range(12):
        one.stamp += STEP
        q = (0.0, 0.0, 0.0) if k % 3 == 0 else Q
        first.publish(joint_state(NAMES, q, (), one.stamp))
    one.spin_until(lambda: 'report 0 for these joints' in one.diagnose().message, 'zeros')
    assert one.diagnose().message.startswith('publishers disagree about q')


def test_publishers_that_agree_are_not_accused(arm):
    one = arm()
    first = one.speaker('/joint_states')
    second = one.speaker('/joint_states', node=one.other('twin'))
    poses = one.poses
    for k in range(20):
        q = (0.01 * k, 0.2, 0.3)
        for publisher in (first, second):
            one.stamp += STEP
            publisher.publish(joint_state(NAMES, q, (), one.stamp))
    one.spin_until(lambda: len(poses) == 40, 'poses')
    one.node._input.recent.clear()  # stamps and arrivals do not agree on a busy machine
    status = one.diagnose()
    assert level_of(status) == OK
    assert values_of(status)['publishers'] == '2'


@pytest.mark.parametrize('qos', [RELIABLE, BEST_EFFORT], ids=['reliable', 'best effort'])
def test_reliable_and_best_effort_publishers_are_heard(arm, qos):
    one = arm()
    poses = one.poses
    one.speaker('/joint_states', qos).publish(joint_state(NAMES, Q, (), START))
    one.spin_until(lambda: poses, 'pose')


def test_a_publisher_that_comes_late_is_heard(arm):
    one = arm()
    one.answer(Q)
    late = one.speaker('/joint_states', node=one.other('late'))
    late.publish(joint_state(NAMES, Q, (), one.stamp + STEP))
    one.spin_until(lambda: len(one.poses) == 2, 'pose')


# Reliability, and what is lost


def test_a_best_effort_publisher_that_comes_later_is_heard_and_nothing_is_lost(arm, monkeypatch):
    given_back = []
    libc = SimpleNamespace(malloc_trim=given_back.append)
    monkeypatch.setattr(best_subscription, 'ctypes', SimpleNamespace(CDLL=lambda _: libc))
    one = arm()
    steady = one.speaker('/joint_states')
    poses, sent = one.poses, []

    def publish():
        one.stamp += STEP
        sent.append(one.stamp)
        steady.publish(joint_state(NAMES, Q, (), one.stamp))

    def becomes(reliability):
        # The first publisher speaks on meanwhile.
        publish()
        return one.counts()['reliability'] == reliability

    one.spin_until(lambda: becomes('reliable') and poses, 'pose')
    gripper = one.other('gripper')
    late = gripper.create_publisher(JointState, '/joint_states', BEST_EFFORT)
    one.spin_until(lambda: becomes('best effort'), 'second publisher')
    one.await_publishers(2)
    for _ in range(5):
        late.publish(joint_state(['finger'], (0.1,), (), one.stamp))
        publish()
        one.counts()
    gripper.destroy_publisher(late)
    one.spin_until(lambda: becomes('reliable'), 'reliability again')
    for _ in range(5):
        publish()
        one.counts()
    one.spin_until(lambda: sent[-1] in one.stamps(), 'last pose')
    assert one.stamps() == sent
    counts = one.counts()
    assert (counts['lost'], counts['dropped: stamp not newer']) == ('0', '0')
    assert counts['ignored: none of our joints'] == '5'
    # A subscription that ends gives its memory back: glibc would keep what messages took.
    one.spin_until(lambda: given_back, 'end of a subscription')
    assert set(given_back) == {0}


def test_the_input_is_best_effort_again_when_its_publishers_have_gone(arm):
    one = arm()
    assert one.counts()['reliability'] == 'best effort'
    driver = one.other('driver')
    steady = one.speaker('/joint_states', node=driver)
    one.spin_until(lambda: one.counts()['reliability'] == 'reliable', 'reliability')
    driver.destroy_publisher(steady)
    one.spin_until(lambda: one.counts()['reliability'] == 'best effort', 'best effort')


def test_a_message_published_once_by_one_who_goes_at_once_is_answered(arm):
    one = arm()
    poses = one.poses
    for k in range(3):
        passer_by = Node(f'once_{k}', context=one.context, use_global_arguments=False)
        publisher = passer_by.create_publisher(JointState, '/joint_states', QoSProfile(depth=1))
        one.spin_until(lambda p=publisher: p.get_subscription_count() == 1, 'listener')
        publisher.publish(joint_state(NAMES, Q, (), START + k))
        publisher.wait_for_all_acked()
        passer_by.destroy_node()
        one.spin_until(lambda k=k: len(poses) == k + 1, 'pose')


def test_what_is_lost_is_counted_and_warned_of(arm):
    one = arm(ros_args=['-p', 'qos_overrides./joint_states.subscription.depth:=7'])
    one.answer(Q)
    one.await_publishers(1)
    for _ in range(60):  # while the node does not run
        one.send(Q)
    one.spin_until(lambda: one.stamps()[-1:] == [one.stamp], 'last pose')
    status = one.diagnose()
    lost = 61 - len(one.poses)
    assert lost > 40
    assert values_of(status)['lost'] == str(lost)
    assert level_of(status) == WARN
    assert status.message.startswith(f'{lost} messages lost ')


def test_a_pause_a_slower_rate_and_a_second_publisher_are_no_losses(arm):
    one = arm()
    one.answer(Q)
    second = one.speaker('/joint_states', node=one.other('second'))
    one.await_publishers(2)
    for k in range(40):
        one.stamp += (k % 7) * 150_000_000
        one.send(Q)
        if k % 3 == 0:
            second.publish(joint_state(['finger'], (0.1,), (), one.stamp))
    one.answer(Q)
    counts = one.counts()
    assert counts['lost'] == '0'


def test_a_queue_holds_a_second_at_1_khz(arm):
    one = arm(executor=EventsExecutor)
    one.answer(Q)
    one.await_publishers(1)
    for _ in range(999):  # while the node does not run
        one.send(Q)
    while nanoseconds(one.poses[-1].header.stamp) != one.stamp:
        heard = len(one.poses)
        one.spin_until(lambda heard=heard: len(one.poses) > heard, 'further pose')
    assert one.counts()['accepted'] == '1000'


# Positions


@BOTH_TRANSPORTS
def test_an_empty_position_is_ignored_and_counted(arm):
    one = arm()
    one.answer(Q)
    one.publish(joint_state(NAMES, (), (1.0, 2.0, 3.0), START + 2 * STEP))
    one.answer(Q, stamp=START + 3 * STEP)
    status = one.diagnose()
    assert level_of(status) == OK
    assert values_of(status)['ignored: no position'] == '1'
    assert len(one.poses) == 2


@BOTH_TRANSPORTS
def test_a_bad_message_is_rejected_whole_and_the_next_good_one_answered(arm):
    one = arm()
    one.answer(Q)
    sent = [one.stamp]
    for names, q, reason, count in (
        (NAMES, (1.0, 2.0), outcomes.MALFORMED, '2'),
        (NAMES, (1.0, 2.0, 3.0, 4.0), outcomes.MALFORMED, '4'),
        ([*NAMES, 'q1'], (1.0, 2.0, 3.0, 1.0), outcomes.DUPLICATE, '2'),
        (NAMES, (1.0, math.nan, 3.0), outcomes.NOT_FINITE, '2'),
        (NAMES, (1.0, 2.0, math.inf), outcomes.NOT_FINITE, '4'),
        (NAMES, (-math.inf, 2.0, 3.0), outcomes.NOT_FINITE, '6'),
        (NAMES, (1e308, 2.0, 3.0), outcomes.TOO_LARGE, '2'),
    ):
        for k in (1, 2):
            one.publish(joint_state(names, q, (), one.stamp + k))
        expect(one.answer(Q), Q)  # where it was: a jump would be another fault
        sent.append(one.stamp)
        one.node._input.recent.clear()  # stamps and arrivals do not agree on a busy machine
        status = one.diagnose()
        assert level_of(status) == WARN
        assert status.message == f'messages rejected: {reason}'
        assert values_of(status)[f'rejected: {reason}'] == count
    assert one.stamps() == sent
    status = one.diagnose()
    assert level_of(status) == OK
    assert values_of(status)['rejected'] == '14'


def test_rejections_are_logged_once_in_a_while(arm, capfd):
    one = arm()
    for k in range(50):
        one.send((math.nan, 0.0, 0.0), stamp=START + k)
    one.answer(Q)
    lines = [line for line in capfd.readouterr().err.splitlines() if 'rejected' in line]
    assert len(lines) == 1
    assert "joint 'q1' is nan" in lines[0]


def test_a_joint_beyond_its_limit_is_answered_and_named(arm):
    one = arm('ur3e')
    q = [0.1, 0.2, 6.5, 0.4, 0.5, 100.0]
    p = one.answer(q).pose.position
    expected = ks.forward_kinematics(ks.load_robot('ur3e'), q)[:3, 3]
    np.testing.assert_allclose([p.x, p.y, p.z], expected, atol=ROUND_OFF)
    status = one.diagnose()
    assert level_of(status) == WARN
    assert status.message == 'beyond the limits: elbow_joint'


# Velocities


@BOTH_TRANSPORTS
def test_without_velocities_the_twist_is_that_of_differences(arm):
    one = arm()
    twists = one.hear('twist', TwistStamped)
    one.answer(Q)
    for k, velocity in enumerate([(), (1.0,), (1.0, math.nan, 1.0), (1.0, 2.0, 3.0, 4.0)], 1):
        one.answer((Q[0] + 0.02 * k, Q[1], Q[2]), velocity)  # 2 rad/s about axis 1
        one.spin_until(lambda k=k: len(twists) == k, 'twist')
        assert nanoseconds(twists[-1].header.stamp) == one.stamp
        assert twists[-1].twist.angular.z == pytest.approx(2.0, abs=1e-9)
    one.node._input.recent.clear()  # stamps and arrivals do not agree on a busy machine
    status = one.diagnose()
    assert values_of(status)['velocity source'] == 'difference'
    assert 'differences of positions' in status.message


def test_differences_of_a_joint_without_limits_take_the_shortest_angle(arm):
    one = arm()
    twists = one.hear('twist', TwistStamped)
    one.answer((math.pi - 0.01, 0.2, 0.3))
    one.answer((-math.pi + 0.01, 0.2, 0.3))
    one.spin_until(lambda: twists, 'twist')
    assert twists[0].twist.angular.z == pytest.approx(2.0, abs=1e-9)


def test_there_is_no_twist_after_a_gap(arm):
    one = arm(ros_args=['-p', 'joint_state_timeout:=1.0'])
    twists = one.hear('twist', TwistStamped)
    one.answer(Q)
    one.answer(Q, stamp=one.stamp + SECOND + 1)
    one.answer(Q, stamp=one.stamp + SECOND + STEP)
    one.spin_until(lambda: twists, 'twist')
    assert [nanoseconds(twist.header.stamp) for twist in twists] == [one.stamp + SECOND + STEP]


def test_velocity_source_message_publishes_no_twist_without_velocities(arm):
    one = arm(ros_args=['-p', 'velocity_source:=message'])
    twists = one.hear('twist', TwistStamped)
    one.answer(Q)
    one.answer(Q)
    assert one.counts()['velocity source'] == 'none'
    one.answer(Q, (0.0, 0.0, 0.5))
    one.spin_until(lambda: twists, 'twist')
    assert len(twists) == 1


# Stamps


@BOTH_TRANSPORTS
def test_an_equal_or_slightly_older_stamp_is_dropped(arm):
    one = arm()
    one.answer(Q, stamp=START + 5 * SECOND)
    for back in (0, 1, STEP, SECOND):
        one.send((9.0, 9.0, 9.0), stamp=START + 5 * SECOND - back)
    one.answer(Q, stamp=START + 5 * SECOND + 1)
    assert len(one.poses) == 2
    assert one.counts()['dropped: stamp not newer'] == '4'
    assert one.counts()['resets'] == '0'


def test_a_big_step_back_starts_anew_and_is_said_once(arm, capfd):
    one = arm()
    twists = one.hear('twist', TwistStamped)
    one.answer(Q, stamp=START)
    for k in range(3):
        expect(one.answer((0.1 * k, 0.2, 0.3), stamp=k * STEP + 1), (0.1 * k, 0.2, 0.3))
    one.spin_until(lambda: len(twists) == 2, 'twists')
    assert [nanoseconds(twist.header.stamp) for twist in twists] == [STEP + 1, 2 * STEP + 1]
    assert one.counts()['resets'] == '1'
    assert capfd.readouterr().err.count('the state starts again') == 1


@BOTH_TRANSPORTS
def test_a_message_without_stamp_is_answered_with_the_time_of_receipt(arm):
    one = arm()
    poses = one.poses
    twists = one.hear('twist', TwistStamped)
    before = one.peer.get_clock().now().nanoseconds
    for k in range(3):
        one.send((0.1 * k, 0.2, 0.3), stamp=0)
        one.spin_until(lambda k=k: len(poses) == k + 1, 'pose')
    after = one.peer.get_clock().now().nanoseconds
    one.spin_until(lambda: len(twists) == 2, 'twists of differences')
    stamps = one.stamps()
    assert before <= stamps[0] < stamps[1] < stamps[2] <= after
    rate = 0.1 / ((stamps[1] - stamps[0]) * 1e-9)
    assert twists[0].twist.angular.z == pytest.approx(rate, rel=1e-6)
    assert one.counts()['not stamped'] == '3'


def raw_stamp(sec, nanosec):
    message = joint_state(NAMES, Q)
    message.header.stamp.sec, message.header.stamp.nanosec = sec, nanosec
    return message


@BOTH_TRANSPORTS
def test_a_stamp_that_is_nonsense_is_answered_and_the_next_good_one_too(arm):
    one = arm()
    poses = one.poses
    # Each steps back by years, so that the node starts anew.
    for sec, nanosec in (
        (2**31 - 1, 4_294_967_295),
        (2**31 - 1, 999_999_999),
        (5, 4_000_000_000),
        (-1, 1_000_000_000),
        (-(2**31), 0),
        (-1, 5),
    ):
        del poses[:]
        one.publish(raw_stamp(sec, nanosec))
        one.spin_until(lambda: poses, 'pose')
        expect(poses[0], Q)
        assert 0 <= poses[0].header.stamp.nanosec < SECOND
        sane = -(2**31) * SECOND <= sec * SECOND + nanosec < 2**31 * SECOND
        if sane and sec * SECOND + nanosec != 0:
            assert nanoseconds(poses[0].header.stamp) == sec * SECOND + nanosec
        expect(one.answer((0.1, 0.2, 0.3)), (0.1, 0.2, 0.3))


# Silence and clocks


def test_a_timer_that_makes_up_for_its_calls_says_the_diagnostics_once(arm, monkeypatch):
    health, said = arm().node._health, []
    monkeypatch.setattr(health, 'say', lambda: said.append(None))
    health._published_at = time.monotonic()
    for _ in range(3):
        health.say_when_due()
    assert not said
    health._published_at -= 0.6  # more than half of the timer's period ago
    health.say_when_due()
    assert len(said) == 1


def test_silence_is_said_once_and_ends_with_the_next_message(arm):
    one = arm(ros_args=SHORT)
    warnings = one.hear('singularity/warning', DiagnosticStatus, LATCHED)
    one.answer(Q)
    one.spin_until(lambda: len(warnings) == 2, 'warning STALE')
    assert [level_of(warning) for warning in warnings] == [OK, STALE]
    assert ' q1, q2, q3 on /joint_states' in warnings[1].message
    one.node._watch()
    ticks = []
    one.peer.create_timer(0.25, lambda: ticks.append(None))
    one.spin_until(lambda: len(ticks) == 2, 'time for more warnings')
    assert len(warnings) == 2
    assert len(one.poses) == 1
    status = one.diagnose()
    assert level_of(status) == ERROR
    assert values_of(status)['missing joints'] == 'q1, q2, q3'
    expect(one.answer(Q), Q)
    one.spin_until(lambda: len(warnings) >= 4, 'warnings OK and STALE')
    assert [level_of(warning) for warning in warnings[2:]] == [OK, STALE]

    def fine():
        # More than one at a time: most intervals are shorter than the time-out.
        for _ in range(4):
            one.answer(Q)
        return level_of(one.diagnose()) == OK

    one.spin_until(fine, 'diagnostics within the time-out')


def test_an_arm_never_heard_is_said_to_be_stale_once(arm):
    one = arm(ros_args=SHORT)
    warnings = one.hear('singularity/warning', DiagnosticStatus, LATCHED)
    one.spin_until(lambda: warnings, 'warning')
    assert level_of(warnings[0]) == STALE


def ticking(one):
    """Return a function that sets the simulated clock and waits until the node has it."""
    clock = one.peer.create_publisher(Clock, '/clock', 10)
    one.spin_until(lambda: clock.get_subscription_count() > 0, 'listener to /clock')

    def tick(seconds):
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(round(seconds * 1e9), SECOND)
        clock.publish(message)
        one.spin_until(
            lambda: one.node.get_clock().now().nanoseconds == round(seconds * 1e9), 'clock'
        )

    return tick


SIMULATED = ['-p', 'use_sim_time:=true']


def test_without_stamps_the_simulated_time_is_used(arm):
    one = arm(ros_args=SIMULATED)
    tick = ticking(one)
    poses = one.poses
    tick(12.5)
    one.send(Q, stamp=0)
    one.spin_until(lambda: poses, 'pose')
    assert one.stamps() == [12_500_000_000]


def test_silence_is_noticed_while_the_simulated_clock_stands_still(arm):
    one = arm(ros_args=[*SIMULATED, *SHORT])
    ticking(one)(12.5)
    warnings = one.hear('singularity/warning', DiagnosticStatus, LATCHED)
    one.answer(Q, stamp=12 * SECOND)
    one.spin_until(lambda: len(warnings) == 2, 'warning STALE')
    assert level_of(warnings[1]) == STALE


@pytest.mark.parametrize('first', ['clock', 'message'])
@pytest.mark.parametrize('back', [0.3, 40.0])
def test_a_simulated_clock_that_jumps_back_resets_once(arm, capfd, first, back):
    one = arm(ros_args=SIMULATED)
    tick = ticking(one)
    tick(50.0)
    one.answer(Q, stamp=50 * SECOND)
    late = round((50.0 - back) * 1e9)
    if first == 'clock':
        tick(50.0 - back)
        one.answer(Q, stamp=late + 1)
    elif back > 1.0:
        one.answer(Q, stamp=late + 1)
        tick(50.0 - back)
    else:
        one.send(Q, stamp=late + 1)  # dropped: only the clock can tell it from a late message
        one.answer(Q, stamp=50 * SECOND + 1)
        tick(50.0 - back)
        one.answer(Q, stamp=late + 2)
    one.answer(Q, stamp=late + STEP)
    assert one.counts()['resets'] == '1'
    assert capfd.readouterr().err.count('the state starts again') == 1


def test_a_negative_simulated_time_is_ignored_and_said_once(arm, capfd):
    one = arm(ros_args=SIMULATED)
    clock, log = one.speaker('/clock', kind=Clock), []

    def is_said():
        log.append(capfd.readouterr().err)
        return '-5 s on /clock is negative' in ''.join(log)

    message = Clock()
    message.clock.sec = -5
    clock.publish(message)  # alone: the node keeps the last one
    one.spin_until(is_said, 'line of the log')
    clock.publish(message)
    message.clock.sec = 51
    clock.publish(message)
    one.spin_until(lambda: one.node.get_clock().now().nanoseconds == 51 * SECOND, 'clock')
    one.answer(Q, stamp=51 * SECOND)
    assert is_said()
    assert ''.join(log).count('negative') == 1
    assert 'callback' not in ''.join(log)


def test_a_simulated_clock_that_runs_on_resets_nothing(arm):
    one = arm(ros_args=SIMULATED)
    tick = ticking(one)
    for k in range(1, 6):
        tick(10.0 * k)
        one.answer(Q, stamp=10 * k * SECOND)
    assert one.counts()['resets'] == '0'


@BOTH_TRANSPORTS
def test_an_error_of_our_own_is_counted_and_the_node_goes_on(arm, capfd):
    one = arm()
    one.answer(Q)
    take = one.node._estimator.take

    def broken(*arguments):
        one.node._estimator.take = take
        raise RuntimeError('made for the test')

    one.node._estimator.take = broken
    one.send(Q)
    expect(one.answer((0.1, 0.2, 0.3)), (0.1, 0.2, 0.3))
    status = one.diagnose()
    assert level_of(status) == WARN
    assert values_of(status)['internal errors'] == '1'
    assert capfd.readouterr().err.count('made for the test') == 1


@BOTH_TRANSPORTS
def test_positions_as_large_as_doubles_can_be_are_rejected(arm):
    one = arm('scara_hsr065')
    good = [0.1, 0.2, 0.05, 0.3]
    one.answer(good)
    for huge in (1e308, -1e308, 1.7976931348623157e308):
        one.send([0.1, 0.2, huge, 0.3])
    one.answer(good)
    assert len(one.poses) == 2
    assert one.counts()['rejected: position too large'] == '3'
    assert isinstance(joint_state([], ()), JointState)


def test_a_topic_whose_publishers_are_silent_is_not_named_as_another_one():
    node = SimpleNamespace(
        count_publishers=lambda topic: 1,
        publishers=[],
        get_topic_names_and_types=lambda: [('/joint_states', [JOINT_STATES])],
    )
    text = why_no_joint_states(node, '/joint_states', 'joint_states')
    assert 'its publishers are silent; no other topic' in text
    assert 'try' not in text
