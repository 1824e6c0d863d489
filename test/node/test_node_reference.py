# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""A second source of the tool's pose: the status `frames` on /diagnostics."""

import math
from functools import partial

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from rcl_interfaces.msg import Log
from rclpy.experimental import EventsExecutor
from rclpy.parameter import Parameter
from ros_harness import STEP, level_of, values_of
from target_harness import pose_target

import kinematics_service as ks
from kinematics_service.apps.calibration.corrections import corrected_robot
from kinematics_service.kinematics.uncertainty.parameters import parameters_of

OK, WARN, ERROR = 0, 1, 2
POSES = 40


@pytest.fixture
def arm(arm):
    """Return the function of that name, for arms that send and hear hundreds of messages."""
    return partial(arm, executor=EventsExecutor)


class SecondSource:
    """Moves the arm and says its pose from elsewhere; `true` is the arm that moves, if another."""

    def __init__(self, one, true=None, lag=0):
        self.one, self.true, self.lag = one, true or one.robot, lag
        self.publisher = one.peer.create_publisher(PoseStamped, one.topic('reference_pose'), 10)
        one.spin_until(lambda: self.publisher.get_subscription_count() == 1, 'listener')
        self.arrays = one.listen('/diagnostics', DiagnosticArray)
        self.offset = np.eye(4)
        self.offset[:3, 3] = (0.5, -0.2, 0.1)
        self.random = np.random.default_rng(3)

    def say(self, count, change=lambda q: q):
        """Say so many poses at joint positions `change(q)`."""
        one, tried = self.one, 0
        while tried < count:
            q = self.random.uniform(-1.0, 1.0, one.robot.dof)
            pose = self.offset @ ks.forward_kinematics(self.true, change(q))
            if 1.0 + np.trace(pose[:3, :3]) < 0.1:
                continue  # the test's own conversion to quaternions is the simple one
            tried += 1
            # A little before, at and after the pose, the arm stands.
            stamp = one.stamp + 2 * STEP
            for k in range(1, 4):
                if k == 2 and not self.lag:
                    self.publisher.publish(pose_target(pose, one.robot.base_frame, stamp))
                (one.answer if k == 3 else one.send)(q)
            if self.lag:
                self.publisher.publish(pose_target(pose, one.robot.base_frame, stamp))
                one.answer(q)

    def status(self, suits=lambda status: True):
        """Return the status `frames` once it has numbers and suits."""
        kept = None

        def diagnosed():
            nonlocal kept
            self.one.node._health.say()
            # It computes: whoever asks on takes the processor from it, the more the longer it
            # takes.
            self.one.node._reference.watch.thread.join()
            statuses = [s for a in self.arrays for s in a.status if s.name.endswith('frames')]
            kept = next((s for s in statuses if 'poses' in values_of(s) and suits(s)), None)
            self.arrays.clear()
            return kept is not None

        self.one.spin_until(diagnosed, 'diagnosis of the frames')
        return kept


def logged(one):
    """Return a function for the lines of the log about the second source so far."""
    lines = []
    one.peer.create_subscription(Log, '/rosout', lines.append, 50)
    return lambda: [line.msg for line in lines if 'reference_pose: ' in line.msg]


def watched(one, change=lambda q: q, lag=0, true=None):
    """Return the status `frames` after poses at joint positions `change(q)`."""
    source = SecondSource(one, true, lag)
    source.say(POSES, change)
    return source.status()


def expect_the_offset(status):
    assert level_of(status) == OK, status.message
    values = values_of(status)
    assert int(values['poses']) >= 20
    assert float(values['position error, rms (m)']) < 1e-6
    offset = [float(x) for x in values['base offset xyz (m)'].split()]
    np.testing.assert_allclose(offset, (0.5, -0.2, 0.1), atol=1e-5)
    assert values['cause'] == ''


def test_the_offset_of_a_second_source_that_comes_late_is_found(arm):
    expect_the_offset(watched(arm('ur5e'), lag=1))


def test_a_planted_fault_is_named(arm):
    def other_sign(q):
        return q * np.array([1, 1, -1, 1, 1, 1])

    status = watched(arm('ur5e'), other_sign)
    assert level_of(status) == ERROR
    assert values_of(status)['cause'] == 'joint_sign'
    assert 'elbow_joint' in status.message


def test_a_zero_that_slips_is_named_until_it_is_back(arm):
    def slipped(q):
        return q + np.radians([0.0, 0.0, 0.3, 0.0, 0.0, 0.0])

    one = arm('ur5e')
    source, told = SecondSource(one), logged(one)
    source.say(40)
    status = source.status(lambda status: values_of(status)['smallest jumps found'])
    expect_the_offset(status)
    one.spin_until(told, 'line of the first result')
    assert 'constant offset' in told()[0]
    assert 'no jump in' in status.message
    assert 'elbow_joint 0.0' in values_of(status)['smallest jumps found']
    one.node._reference._throttle._passed.clear()
    source.say(16, slipped)
    status = source.status(lambda status: level_of(status) != OK)
    assert level_of(status) == WARN, status.message
    one.spin_until(lambda: len(told()) == 2, 'line of the rise')
    assert 'zero of joint elbow_joint +0.3' in told()[1]
    assert 'zero of joint elbow_joint +0.3' in status.message
    values = values_of(status)
    assert values['jump'] == 'elbow_joint'
    assert float(values['jump (rad, m or s)']) == pytest.approx(math.radians(0.3), rel=0.02)
    assert 10 <= int(values['jump, poses ago']) <= 18
    source.say(30, slipped)
    assert values_of(source.status())['jump'] == 'elbow_joint'
    source.say(24)
    assert level_of(source.status(lambda status: level_of(status) == OK)) == OK
    assert len(told()) == 2


def test_a_joint_of_wrong_sign_that_begins_to_move_is_no_slip(arm):
    source = SecondSource(arm('ur5e'))
    still, moved = np.array([1, 1, 0, 1, 1, 1]), np.array([1, 1, -1, 1, 1, 1])
    uniform = source.random.uniform
    source.random = type('Still', (), {'uniform': lambda *a: uniform(*a[1:]) * still})()
    source.say(40)
    assert level_of(source.status()) == OK
    source.random = np.random.default_rng(5)
    source.say(60, lambda q: q * moved)
    status = source.status(lambda status: 'joint_sign' in values_of(status)['cause'])
    assert level_of(status) == ERROR
    assert 'elbow_joint' in status.message


def test_how_far_the_file_is_from_what_is_heard_is_judged_by_limits(arm):
    one = arm('ur5e', ['-p', 'reference.position_warn:=0.0005', '-p', 'reference.angle_stop:=1.0'])
    errors = 1e-3 * np.resize([1.0, -1.0, 0.5], len(parameters_of(one.robot).table))
    true = corrected_robot(one.robot, parameters_of(one.robot).table, errors)
    status = watched(one, true=true)
    values = values_of(status)
    assert 0.0005 < float(values['position error, rms (m)']) < 0.004
    assert level_of(status) == WARN, status.message
    assert values['warning from (rms)'] == '0.5 mm or 0.5 deg'
    assert values['error from (rms)'] == '20 mm or 57.3 deg'
    assert 'poses for a robot file' in status.message
    # The limits in force count, also those that have changed since.
    assert one.node.set_parameters([Parameter('reference.position_warn', value=0.01)])[
        0
    ].successful
    assert one.node._reference.status_text().level == OK


def test_a_lag_of_the_second_source_is_named(arm):
    one = arm('ur5e')
    publisher = one.peer.create_publisher(PoseStamped, one.topic('reference_pose'), 10)
    one.spin_until(lambda: publisher.get_subscription_count() == 1, 'listener')

    def joints(k):
        return 0.9 * np.sin(0.03 * k * np.array([1.0, 0.7, 1.3, 0.5, 1.1, 0.9]) + np.arange(6))

    late = 12
    for k in range(320):
        pose = ks.forward_kinematics(one.robot, joints(k - late))
        if k % 4 == 0 and 1.0 + np.trace(pose[:3, :3]) > 0.1:
            publisher.publish(pose_target(pose, one.robot.base_frame, one.stamp + STEP))
        one.answer(joints(k).tolist())

    def diagnosed():
        status_text = one.node._reference.status_text()
        return status_text is not None and 'behind' in status_text.sentence

    one.spin_until(diagnosed, 'lag of the frames', 120.0)
    status_text = one.node._reference.status_text()
    assert f'{1e-6 * late * STEP:.0f} ms behind' in status_text.sentence
    assert status_text.level == ERROR


def test_without_a_pose_nothing_is_said_of_frames_and_a_wrong_pose_is_refused(arm):
    one = arm('craig_3r')
    one.answer([0.1] * 3)
    assert one.diagnose().name == 'kinematics: input'
    assert one.node._reference.status_text() is None
    publisher = one.peer.create_publisher(PoseStamped, one.topic('reference_pose'), 10)
    one.spin_until(lambda: publisher.get_subscription_count() == 1, 'listener')
    message = PoseStamped()
    message.pose.position.x = math.nan
    publisher.publish(message)
    one.spin_until(lambda: one.node._reference.status_text() is not None, 'notice')
    assert 'position: nan' in one.node._reference.status_text().sentence


def test_the_log_has_the_first_result_once_and_names_another_bundled_robot(arm):
    one = arm('ur5e')
    told, source = logged(one), SecondSource(one, ks.load_robot('ur10e'))
    source.say(40)
    assert level_of(source.status()) == ERROR
    one.spin_until(told, 'line')
    assert 'ur10e leaves 0 mm' in told()[0]
    source.say(16)
    source.status()
    assert len(told()) == 1
