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
from kinematics_service.diagnosis.calibration.corrections import corrected_robot
from kinematics_service.kinematics.uncertainty.parameters import parameters_of

OK, WARN, ERROR = 0, 1, 2
POSES = 60


@pytest.fixture
def arm(arm):
    """Return the function of that name, for arms that send and hear hundreds of messages."""
    return partial(arm, executor=EventsExecutor)


def watched(one, change=lambda q: q, lag=0, true=None):
    """
    Move the arm and say its pose from elsewhere, at joint positions `change(q)`; return `frames`.

    `true` is the arm that moves, if it is not that of the file.
    """
    robot = one.robot
    true = true or robot
    publisher = one.peer.create_publisher(PoseStamped, one.topic('reference_pose'), 10)
    one.spin_until(lambda: publisher.get_subscription_count() == 1, 'listener')
    arrays = one.listen('/diagnostics', DiagnosticArray)
    offset = np.eye(4)
    offset[:3, 3] = (0.5, -0.2, 0.1)
    random = np.random.default_rng(3)
    kept = None
    tried = 0
    while tried < POSES:
        q = random.uniform(-1.0, 1.0, robot.dof)
        pose = offset @ ks.forward_kinematics(true, change(q))
        if 1.0 + np.trace(pose[:3, :3]) < 0.1:
            continue  # the test's own conversion to quaternions is the simple one
        tried += 1
        # A little before, at and after the pose, the arm stands.
        stamp = one.stamp + 2 * STEP
        for k in range(1, 4):
            if k == 2 and not lag:
                publisher.publish(pose_target(pose, robot.base_frame, stamp))
            one.answer(q)
        if lag:
            publisher.publish(pose_target(pose, robot.base_frame, stamp))
            one.answer(q)

    def diagnosed():
        nonlocal kept
        one.node._health.say()
        # It computes: whoever asks on takes the processor from it, the more the longer it takes.
        one.node._reference._thread.join()
        statuses = [s for array in arrays for s in array.status if s.name.endswith('frames')]
        kept = next((s for s in statuses if 'poses' in values_of(s)), None)
        arrays.clear()
        return kept is not None

    one.spin_until(diagnosed, 'diagnosis of the frames')
    return kept


@pytest.mark.parametrize('lag', [0, 1], ids=['in time', 'late'])
def test_the_offset_of_a_second_source_is_found(arm, lag):
    status = watched(arm('ur5e'), lag=lag)
    assert level_of(status) == OK, status.message
    values = values_of(status)
    assert int(values['poses']) >= 20
    assert float(values['position error, rms (m)']) < 1e-6
    offset = [float(x) for x in values['base offset xyz (m)'].split()]
    np.testing.assert_allclose(offset, (0.5, -0.2, 0.1), atol=1e-5)
    assert values['cause'] == ''


def test_a_planted_fault_is_named(arm):
    def other_sign(q):
        return q * np.array([1, 1, -1, 1, 1, 1])

    status = watched(arm('ur5e'), other_sign)
    assert level_of(status) == ERROR
    assert values_of(status)['cause'] == 'joint_sign'
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
    assert status.message.endswith('collects poses for a robot file of this very arm')
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
    assert f'the poses are {1e-6 * late * STEP:.0f} ms behind' in status_text.sentence.lower()
    assert status_text.level == ERROR


def test_without_a_second_source_nothing_is_said_of_frames(arm):
    one = arm('ur5e')
    one.answer([0.1] * 6)
    assert one.diagnose().name == 'kinematics: input'
    assert one.node._reference.status_text() is None


def test_a_pose_that_is_none_is_refused_with_the_reason(arm):
    one = arm('ur5e')
    publisher = one.peer.create_publisher(PoseStamped, one.topic('reference_pose'), 10)
    one.spin_until(lambda: publisher.get_subscription_count() == 1, 'listener')
    message = PoseStamped()
    message.pose.position.x = math.nan
    publisher.publish(message)
    one.spin_until(lambda: one.node._reference.status_text() is not None, 'notice')
    assert 'not finite' in one.node._reference.status_text().sentence


@pytest.mark.parametrize(
    ('true', 'said'),
    [
        (
            'ur5e',
            'they fit the robot file of ur5e: 0 mm, 0 deg remain of 10 reference poses (rms)',
        ),
        ('ur10e', 'the bundled robot ur10e leaves 0 mm, 0 deg: which arm is it?'),
    ],
)
def test_the_first_ten_poses_say_whether_this_is_the_robot_of_the_file(arm, true, said):
    one, lines = arm('ur5e'), []
    one.peer.create_subscription(Log, '/rosout', lines.append, 50)
    watched(one, true=ks.load_robot(true))
    told = []

    def heard():
        one.send([0.1] * 6)  # it is told at the next state
        told.extend(x for x in lines if 'reference_pose: they ' in x.msg)
        return told

    one.spin_until(heard, 'line')
    assert said in told[0].msg
    assert {x.msg for x in told} == {told[0].msg}
