# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the node says of joint states that make no sense: in its log, and on /diagnostics."""

import math
import re
import time

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from diagnostic_msgs.msg import DiagnosticStatus
from ros_harness import (
    BOTH_TRANSPORTS,
    LATCHED,
    SECOND,
    START,
    STEP,
    change,
    joint_state,
    level_of,
    nanoseconds,
)
from std_msgs.msg import String

from kinematics_service.node.health import why_no_joint_states

OK, WARN, ERROR, STALE = range(4)
Q = (0.3, -0.4, 1.2)
NAMES = ['q1', 'q2', 'q3']
SHORT = ['-p', 'joint_state_timeout:=0.2']
SIMULATED = ['-p', 'use_sim_time:=true']


@pytest.fixture
def watched(arm):
    """Return a function that returns a node that looks at its input when it is told to."""

    def start(*args, **options):
        one = arm(*args, **options)
        for timer in one.node.timers:
            if timer.callback == one.node._health.say_when_due:
                timer.cancel()
        return one

    return start


def sent(one, count, stamp_of, q_of=lambda k: Q, qdot_of=lambda k: ()):
    """Send messages, with sec and nanosec as they are, until the node has seen all of them."""
    recent = one.node._input.recent
    if not recent:
        one.publish(joint_state([], ()))
        one.spin_until(lambda: len(recent) == 1, 'first message')
    recent.clear()
    for k in range(count):
        message = joint_state(NAMES, q_of(k), qdot_of(k))
        message.header.stamp.sec, message.header.stamp.nanosec = stamp_of(k)
        one.publish(message)
        if k % 50 == 49:
            one.spin_until(lambda k=k: len(recent) == k + 1, 'messages')
    one.spin_until(lambda: len(recent) == count, 'messages')
    # As if they had come at a steady rate: on a busy machine they come in bursts.
    latest, told = recent[-1][0], [data for _, data in recent]
    recent.clear()
    recent.extend((latest - (count - 1 - k) * 1_000_000, data) for k, data in enumerate(told))


def paced(one, stamp_of, count=12, period=0.1):
    """Send messages at a rate; their arrivals count."""
    recent, ticks = one.node._input.recent, []
    one.attach()
    timer = one.peer.create_timer(period, lambda: ticks.append(None))
    for k in range(count):
        one.spin_until(lambda k=k: len(ticks) > k, 'tick')
        message = joint_state(NAMES, Q)
        message.header.stamp.sec, message.header.stamp.nanosec = stamp_of(k)
        one.publish(message)
        one.spin_until(lambda k=k: len(recent) == k + 1, 'message')
    one.peer.destroy_timer(timer)


def logged(one, capfd):
    """Return the warnings of two looks at the input, which are those of one look."""
    capfd.readouterr()
    for _ in range(2):
        one.node._health.say()
    lines = capfd.readouterr().err.splitlines()
    return [line.partition(' joint states: ')[2] for line in lines if ' joint states: ' in line]


STAMPS = {
    'the stamp 1133099831.1126656057': lambda k: (1133099831, 1126656057),
    '6 of 8 messages': lambda k: (1000 + k // 4, 0),
    'likely holds milliseconds': lambda k: (1000 + k // 4, 250 * (k % 4)),
    'likely holds microseconds': lambda k: (1000 + k // 4, 250_000 * (k % 4)),
    'a second or more': lambda k: (1000, 3_000_000_000 + k * STEP),
}


@BOTH_TRANSPORTS
def test_wrong_stamps_are_named_in_the_log_and_in_the_diagnostics(watched, capfd):
    one = watched()
    for says, stamp_of in STAMPS.items():
        one.node._health._throttle._passed.clear()
        sent(one, 8, stamp_of)
        (line,) = logged(one, capfd)
        assert says in line
        # Statuses of the looks before may still come.
        one.spin_until(lambda line=line: one.diagnose().message == line, f'status: {line}')
        assert level_of(one.diagnose()) == WARN


def test_what_arrived_is_said_of_a_stale_arm(watched):
    one = watched(ros_args=SHORT)
    warnings = one.hear('singularity/warning', DiagnosticStatus, LATCHED)
    sent(one, 8, lambda k: (1133099831, 1126656057))
    one.node._health.say()
    one.spin_until(lambda: one.node._estimator.joints.missing(time.monotonic_ns()), 'stale arm')
    status = one.diagnose()
    assert level_of(status) == ERROR
    assert 'missing q1, q2, q3; 8 messages' in status.message
    assert 'the stamp 1133099831.1126656057: ' in status.message
    one.spin_until(lambda: level_of(warnings[-1]) == STALE, 'warning STALE')
    assert 'the stamp 1133099831.1126656057: ' in warnings[-1].message


def test_a_driver_slower_than_the_timeout_is_named(watched):
    one = watched(ros_args=SHORT)
    paced(one, lambda k: (1000 + k, 0), count=3, period=0.3)
    said = re.search(
        r'every (0\.\d+) s, but joint_state_timeout is 0\.2 s: set it to (0\.\d+)',
        one.diagnose().message,
    )
    period, proposed = map(float, said.groups())
    assert period == pytest.approx(0.3, rel=0.2)
    assert proposed == pytest.approx(2.0 * period, rel=0.03)


def test_messages_without_positions_name_the_parameter_that_uses_velocities(watched):
    one = watched()
    one.publish(joint_state(NAMES, (), (0.1, 0.2, 0.3), START))
    one.spin_until(lambda: one.counts()['ignored: no position'] == '1', 'message')
    assert 'set integrate_velocities' in one.diagnose().message


@pytest.mark.parametrize(
    ('stamp_of', 'said'),
    [
        (lambda k: (1000 + k + 500 * (k % 2), 0), 1),  # two clocks
        (lambda k: (1000 + k - 100 * (k > 5), 0), 0),  # a recording starts again
    ],
)
def test_stamps_of_two_clocks_are_named(watched, stamp_of, said):
    one = watched()
    sent(one, 12, stamp_of)
    one.node._health.say()
    lines = [text for text in one.node._health.warnings if 'stepped back' in text]
    assert len(lines) == said
    assert all('5 times within 10 s: ' in line for line in lines)


def test_a_topic_of_another_type_is_named(arm):
    one = arm('craig_3r')
    one.attach()
    one.peer.create_publisher(String, '/words', 1)
    seen = one.node.get_topic_names_and_types
    one.spin_until(lambda: '/words' in dict(seen()), 'publisher')
    says = 'as std_msgs/msg/String, not as sensor_msgs/msg/JointState; '
    assert says in why_no_joint_states(one.node, '/words', '/words')


@pytest.mark.parametrize(
    ('factor', 'says'),
    [(10, 'faster than'), (1000, 'likely holds milliseconds')],
)
def test_time_by_stamps_that_runs_too_fast_is_named(watched, capfd, factor, says):
    one = watched()
    paced(one, lambda k: divmod(START + factor * k * SECOND // 10, SECOND))
    (line,) = logged(one, capfd)
    assert line.startswith('time by stamps is wrong: ')
    assert says in line
    assert float(line.split()[7]) == pytest.approx(factor, rel=0.1)


def test_simulated_time_may_run_at_any_rate(watched, capfd):
    one = watched(ros_args=SIMULATED)
    paced(one, lambda k: divmod(START + 20 * k * SECOND // 10, SECOND))
    assert logged(one, capfd) == []


def test_stamps_at_the_pace_of_arrival_are_fine(watched, capfd):
    one = watched()
    paced(one, lambda k: divmod(START + k * SECOND // 10, SECOND))
    assert logged(one, capfd) == []
    assert level_of(one.diagnose()) == OK


def test_zero_stamps_are_said_once_with_the_noise_they_make(watched, capfd):
    one = watched()
    sent(one, 20, lambda k: (0, 0))
    (line,) = logged(one, capfd)
    assert line.startswith('no stamps: ')
    assert 'arrival' in line
    assert line.endswith(' %')
    one.send(Q, stamp=0)
    one.spin_until(lambda: len(one.node._input.recent) == 21, 'message')
    status = one.diagnose()
    assert level_of(status) == OK
    assert '; no stamps: ' in status.message


def test_without_stamps_and_clock_it_is_said_that_there_is_no_twist(watched, capfd):
    one = watched(ros_args=SIMULATED)
    sent(one, 6, lambda k: (0, 0))
    lines = logged(one, capfd)
    assert 'no /clock was received' in lines[-1]


# Motion


def swing(factors):
    """Return positions and velocities of joints that swing, as functions of the message."""

    def angle(k):
        return 2.0 * k * STEP / SECOND + np.arange(3.0)

    return (
        lambda k: (0.3 * np.sin(angle(k))).tolist(),
        lambda k: (factors(k) * 0.6 * np.cos(angle(k))).tolist(),
    )


def stamped(k):
    return divmod(START + k * STEP, SECOND)


def test_velocities_that_change_their_sign_are_named_with_their_joint(watched, capfd):
    one = watched(ros_args=SIMULATED)  # arrivals on a busy machine are no matter here
    sent(one, 100, stamped, *swing(lambda k: np.ones(3)))
    assert logged(one, capfd) == []
    flipped = np.array([1.0, -1.0, 1.0])
    sent(one, 200, stamped, *swing(lambda k: flipped if k >= 100 else np.ones(3)))
    (line,) = logged(one, capfd)
    assert line.startswith('reported velocities contradict the positions: ')
    assert 'that of q2 is -' in line
    assert 'wrong sign' in line
    assert one.diagnose().message == line
    assert change(one, velocity_source='difference').successful
    assert level_of(one.diagnose()) == OK


def test_degrees_and_speeds_of_a_joint_at_rest_are_named(watched, capfd):
    one = watched('ur5e', SIMULATED)
    names = list(one.robot.joint_names)
    recent = one.node._input.recent
    for k in range(150):
        q, qdot = np.full(6, 0.4), np.zeros(6)
        q[0], qdot[0] = 0.4 * k / 100, math.degrees(0.4)
        qdot[3] = 1e6
        one.publish(joint_state(names, q.tolist(), qdot.tolist(), START + k * STEP))
    one.spin_until(lambda: len(recent) == 150, 'messages')
    (line,) = logged(one, capfd)
    assert 'of shoulder_pan_joint is 57.3 times ' in line
    assert 'degrees?' in line
    assert 'wrist_1_joint is up to 1e+06' in line


def test_one_message_of_zeros_in_25_is_named(watched, capfd):
    one = watched()
    sent(one, 50, stamped, lambda k: (0.0, 0.0, 0.0) if k % 25 == 12 else Q)
    (line,) = logged(one, capfd)
    assert line.startswith('positions jump: 12 steps ')
    assert 'largest of q3 by ' in line


def test_other_warnings_of_the_input_are_logged_too(watched, capfd):
    one = watched('ur3e')
    one.answer([0.1, 0.2, 6.5, 0.4, 0.5, 0.6])
    assert logged(one, capfd) == ['beyond the limits: elbow_joint']


# Mimic joints

MIMIC = """<robot name="arm">
<link name="base"/><link name="l1"/><link name="l2"/><link name="l3"/><link name="tool"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="10" velocity="2"/></joint>
<joint name="j2" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="0.1 0 0"
rpy="1.57 0 0"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="10" velocity="2"/></joint>
<joint name="j3" type="revolute"><parent link="l2"/><child link="l3"/><origin xyz="0.4 0 0"/>
<axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="10" velocity="2"/>
<mimic joint="j2" multiplier="-1"/></joint>
<joint name="end" type="fixed"><parent link="l3"/><child link="tool"/><origin xyz="0.3 0 0"/>
</joint></robot>"""


def test_a_mimic_joint_that_is_reported_otherwise_is_named_with_both_numbers(
    watched, capfd, tmp_path
):
    urdf = tmp_path / 'arm.urdf'
    urdf.write_text(MIMIC)
    one = watched(str(urdf), ['-p', 'joint_prefix:=left_'])
    names = ['left_j1', 'left_j2', 'left_j3']
    poses = one.poses
    for value, found in ((0.5, 0), (0.7, 1)):
        one.stamp += STEP
        one.publish(joint_state(names, (0.3, -0.5, value), (), one.stamp))
        one.spin_until(lambda: poses and nanoseconds(poses[-1].header.stamp) == one.stamp, 'pose')
        lines = logged(one, capfd)
        status = one.diagnose()
        one.node._input.recent.clear()
        assert len(lines) == found
    assert lines[0].startswith('mimic joint left_j3 ')
    assert ': 0.7 rad in ' in lines[0]
    assert '-left_j2 = 0.5 rad' in lines[0]
    assert status.message == lines[0]
