# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Targets for the tool: what the node answers, and what it refuses."""

import copy
import math
import threading

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from geometry_msgs.msg import PoseStamped
from rclpy.experimental import EventsExecutor
from refusal import refused
from ros_harness import change, level_of, nanoseconds, values_of
from target_harness import BASE, Targets, pose_target, twist_target

import kinematics_service as ks
from kinematics_service.errors import RefusedTargetError, SettingsError
from kinematics_service.kinematics.inverse.problem.plan import plan_for
from kinematics_service.node import targets as node_targets
from kinematics_service.node.messages.target_messages import (
    pose_in_base,
    pose_of,
    twist_in_base,
    twist_of,
)
from kinematics_service.node.parameters.settings import defaults, settings_from

OK, WARN, ERROR, STALE = range(4)
# A solution is exact to round-off of the arm's lengths.
EXACT = 1e-9
UR5E = (0.3, -1.1, 1.4, -0.9, 0.8, 0.2)
CRAIG = (0.3, -0.4, 1.2)
SCARA = (0.4, 0.9, 0.1, 0.2)
PERIOD = 0.01


@pytest.fixture
def targets(arm):
    def make(robot='ur5e', q=UR5E, ros_args=(), **options):
        one = arm(robot, ros_args, **options)
        targets = Targets(one)
        if q is not None:
            one.answer(q)
        return targets

    return make


def test_a_pose_is_answered_with_the_nearest_solution_and_all_of_them(targets):
    one = targets()
    robot = one.arm.robot
    q = np.array(UR5E) + 0.05
    target = pose_target(ks.forward_kinematics(robot, q), stamp=123_456_789_012)
    made = plan_for.cache_info().misses
    status = one.ask(target)
    # The plan of the arm was made before its first target.
    assert plan_for.cache_info().misses == made
    one.arm.spin_until(lambda: one.joint_states and one.solutions, 'answers')
    assert level_of(status) == OK
    assert status.name == 'kinematics: target_pose'
    answer, table = one.joint_states[-1], one.solutions[-1]
    assert answer.name == list(robot.joint_names)
    assert nanoseconds(answer.header.stamp) == 123_456_789_012
    np.testing.assert_allclose(answer.position, q, atol=EXACT)
    expected = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q), near=UR5E)
    rows, columns = table.layout.dim
    assert columns.label == ','.join(robot.joint_names)
    assert (rows.size, columns.size) == (len(expected), 6)
    assert (rows.stride, columns.stride) == (6 * len(expected), 6)
    assert len(rows.label.split(',')) == rows.size
    assert len(set(rows.label.split(','))) == 8
    found = np.array(table.data).reshape(rows.size, 6)
    np.testing.assert_allclose(found, [solution.q for solution in expected], atol=EXACT)
    assert values_of(status)['solutions'] == str(rows.size)
    assert float(values_of(status)['largest joint motion']) == pytest.approx(0.05)


def test_a_pose_in_the_tool_frame_is_relative_to_the_tool(targets):
    one = targets()
    robot = one.arm.robot
    step = np.eye(4)
    step[:3, 3] = (0.01, -0.02, 0.03)
    assert level_of(one.ask(pose_target(step, 'tool0'))) == OK
    one.arm.spin_until(lambda: one.joint_states, 'answer')
    reached = ks.forward_kinematics(robot, one.joint_states[-1].position)
    expected = ks.forward_kinematics(robot, UR5E) @ step
    np.testing.assert_allclose(reached, expected, atol=EXACT)


@pytest.mark.parametrize(
    ('robot', 'q', 'rows'),
    [('craig_3r', CRAIG, slice(0, 3)), ('spherical_rrp', (0.3, 0.9, 0.6), slice(0, 3))],
)
def test_an_arm_of_three_joints_is_asked_for_a_position(targets, robot, q, rows):
    one = targets(robot, q)
    T = np.eye(4)
    T[:3, 3] = ks.forward_kinematics(one.arm.robot, np.array(q) + 0.05)[:3, 3]
    assert level_of(one.ask(pose_target(T))) == OK
    one.arm.spin_until(lambda: one.joint_states, 'answer')
    reached = ks.forward_kinematics(one.arm.robot, one.joint_states[-1].position)
    np.testing.assert_allclose(reached[:3, 3], T[:3, 3], atol=EXACT)


def test_a_redundant_arm_is_answered_near_where_it_is(targets):
    q = (0.1, -0.4, 0.2, -1.8, 0.1, 1.6, 0.5)
    one = targets('panda', q)
    robot = one.arm.robot
    T = ks.forward_kinematics(robot, np.array(q) + 0.02)
    step = ks.forward_kinematics(robot, q)
    relative = np.linalg.inv(step) @ T
    status = one.ask(pose_target(relative, robot.tool_frame))
    assert level_of(status) == OK
    one.arm.spin_until(lambda: one.joint_states, 'answer')
    found = np.array(one.joint_states[-1].position)
    np.testing.assert_allclose(ks.forward_kinematics(robot, found), T, atol=EXACT)
    assert np.max(np.abs(found - q)) < 0.2


PANDA = (1.1, -0.5, 1.4, -1.7, 0.2, 2.1, 2.5)


def answered(one, q):
    """Ask for the pose at joint positions; return the joint positions answered, and the status."""
    heard = len(one.joint_states)
    T = np.linalg.inv(ks.forward_kinematics(one.arm.robot, PANDA))
    T = T @ ks.forward_kinematics(one.arm.robot, q)
    status = one.ask(pose_target(T, one.arm.robot.tool_frame))
    one.arm.spin_until(lambda: len(one.joint_states) > heard, 'answer')
    return np.array(one.joint_states[-1].position), status


@pytest.mark.parametrize('criterion', ['margin', 'clearance'])
def test_a_redundant_arm_is_answered_with_the_best_posture_of_its_arc(targets, criterion):
    one = targets('panda', PANDA, ['-p', f'ik.redundancy:={criterion}'])
    robot, q = one.arm.robot, np.array(PANDA) + 0.02

    def worth(q):
        least = np.min([q - robot.limits[:, 0], robot.limits[:, 1] - q])
        return least if criterion == 'margin' else ks.singularity(robot, q).clearance

    near = ks.inverse_kinematics(
        robot, ks.forward_kinematics(robot, q), near=PANDA, curves=False
    ).families[0]
    found, status = answered(one, q)
    values = values_of(status)
    assert level_of(status) == OK
    assert values['redundancy'] == criterion
    assert values['other arcs'] == 'not looked for'
    # The limits that the arc is between, as the whole family has them.
    whole = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q))
    arcs = [arc for family in whole.families for arc in family.intervals]
    arc = min(arcs, key=lambda arc: np.min(np.linalg.norm(arc.q - near.q, axis=1)))
    ends = {f'{end.joint} {end.limit}' for end in arc.ends}
    assert set(values['arc'].removeprefix('from ').split(' to ')) == ends
    assert float(values['arc length']) == pytest.approx(arc.length, rel=1e-2)
    # A step by default.
    T = ks.forward_kinematics(robot, q)
    np.testing.assert_allclose(ks.forward_kinematics(robot, found), T, atol=EXACT)
    assert np.linalg.norm(found - near.q) < 0.1 + 1e-6
    assert float(values['left to the best']) > 0.1
    assert float(values['margin']) == pytest.approx(
        np.min([found - robot.limits[:, 0], robot.limits[:, 1] - found]), abs=1e-5
    )
    # And all of the way.
    assert change(one.arm, ik__redundancy_step=0.0).successful
    best, status = answered(one, q)
    assert values_of(status)['left to the best'] == '0'
    np.testing.assert_allclose(ks.forward_kinematics(robot, best), T, atol=EXACT)
    assert worth(best) > worth(found) + 0.02 > worth(near.q) + 0.02
    # Back to the nearest.
    assert change(one.arm, ik__redundancy='near').successful
    found, status = answered(one, q)
    assert 'arc' not in values_of(status)
    np.testing.assert_allclose(found, near.q, atol=1e-6)


def test_an_arm_without_arcs_says_once_that_it_has_no_best_posture(targets, capfd):
    said = 'ik.redundancy: margin has no effect'
    one = targets(ros_args=['-p', 'ik.redundancy:=margin'])
    assert capfd.readouterr().err.count(said) == 1
    assert level_of(one.ask(pose_target(ks.forward_kinematics(one.arm.robot, UR5E)))) == OK
    assert change(one.arm, ik__tolerance=1e-5).successful
    assert said not in capfd.readouterr().err
    # With the direction of an axis instead of a rotation it has.
    assert change(one.arm, ik__axis='x').successful
    status = one.ask(pose_target(ks.forward_kinematics(one.arm.robot, UR5E)))
    assert values_of(status)['redundancy'] == 'margin'
    assert said not in capfd.readouterr().err


def test_a_singular_posture_is_answered_as_near(targets):
    stretched = (0.4, 0.5, 0.0, 0.0, 0.0, 0.0, 0.3)
    one = targets('kuka_iiwa14', stretched, ['-p', 'ik.redundancy:=margin'])
    values = values_of(one.ask(pose_target(np.eye(4), one.arm.robot.tool_frame)))
    assert values['redundancy'] == 'near'
    assert values['arc'].startswith('none ')


def test_the_joint_prefix_is_in_the_answers(targets):
    one = targets('craig_3r', CRAIG, ['-p', 'joint_prefix:=left_'])
    T = np.eye(4)
    T[:3, 3] = ks.forward_kinematics(one.arm.robot, CRAIG)[:3, 3]
    one.ask(pose_target(T))
    one.arm.spin_until(lambda: one.joint_states and one.solutions, 'answer')
    assert one.joint_states[-1].name == ['left_q1', 'left_q2', 'left_q3']
    assert one.solutions[-1].layout.dim[1].label == 'left_q1,left_q2,left_q3'


def good_pose():
    T = np.eye(4)
    T[:3, 3] = (0.3, 0.2, 0.1)
    return pose_target(T)


def _with_orientation(w):
    message = good_pose()
    message.pose.orientation.w = w
    return message


def _with_nan(message):
    part = message.pose.position if isinstance(message, PoseStamped) else message.twist.angular
    part.y = math.nan
    return message


def unreachable():
    T = np.eye(4)
    T[:3, 3] = (9.0, 0.0, 0.0)
    return pose_target(T)


REFUSED = {
    'unknown frame': (pose_target(np.eye(4), 'camera'), 'unknown-name', "frame_id: 'camera'"),
    'no frame': (pose_target(np.eye(4), ''), 'unknown-name', "frame_id: ''"),
    'NaN': (_with_nan(good_pose()), 'not-finite', 'position: 0.3 nan'),
    'infinite quaternion': (_with_orientation(math.inf), 'not-finite', 'orientation: '),
    'no quaternion': (_with_orientation(0.0), 'not-normalized', 'length 0'),
    'long quaternion': (_with_orientation(1.1), 'not-normalized', 'length 1.1'),
    'twist in an unknown frame': (twist_target([0.1] * 6, 'cam'), 'unknown-name', "'cam'"),
    'NaN in a twist': (_with_nan(twist_target([0.1] * 6)), 'not-finite', 'angular velocity: '),
}


@pytest.mark.parametrize('case', REFUSED)
def test_a_wrong_target_is_refused_with_its_field(case):
    (message, code, words), robot = REFUSED[case], ks.load_robot('ur5e')
    settings, tool = settings_from(defaults(robot), robot), np.eye(4)
    message = copy.deepcopy(message)
    if message.header.frame_id == BASE:
        message.header.frame_id = robot.base_frame
    with refused(RefusedTargetError, code, words):
        if isinstance(message, PoseStamped):
            pose_in_base(pose_of(message), message.header.frame_id, tool, settings)
        else:
            twist_in_base(twist_of(message), message.header.frame_id, tool, settings)


def test_a_target_that_is_refused_moves_nothing(targets):
    one = targets()
    for message, _, words in (*REFUSED.values(), (unreachable(), '', 'away')):
        status = one.ask(message)
        assert level_of(status) == ERROR
        assert words in status.message
    one.settle()
    assert not one.joint_states
    assert not one.velocities
    # And the next one is answered.
    assert level_of(one.ask(twist_target([0.01, 0, 0, 0, 0, 0]))) == OK


def test_without_joint_states_targets_are_refused(targets):
    one = targets(q=None)
    for message in (good_pose(), twist_target([0.1] * 6)):
        status = one.ask(message)
        assert level_of(status) == ERROR
        assert 'shoulder_pan_joint' in status.message
    one.settle()
    assert not one.joint_states
    assert not one.velocities


def test_a_twist_is_followed_in_base_and_in_tool_axes(targets):
    one = targets(ros_args=['-p', 'ik.target_timeout:=100.0'])
    robot = one.arm.robot
    twist = np.array([0.05, -0.02, 0.03, 0.1, 0.2, -0.1])
    R = ks.forward_kinematics(robot, UR5E)[:3, :3]
    for frame, turn in ((BASE, np.eye(3)), (robot.tool_frame, R)):
        assert level_of(one.ask(twist_target(twist, frame))) == OK
        heard = len(one.velocities)
        one.arm.spin_until(lambda n=heard: len(one.velocities) >= max(n, 1), 'velocities')
        one.settle()
        wanted = np.concatenate([turn @ twist[:3], turn @ twist[3:]])
        reached = ks.twist(robot, UR5E, one.velocities[-1].velocity)
        np.testing.assert_allclose(reached, wanted, atol=EXACT)
        assert list(one.velocities[-1].position) == []


def test_a_twist_that_stops_coming_is_ended_once(targets):
    one = targets(ros_args=['-p', 'ik.target_timeout:=0.05'])
    one.ask(twist_target([0.05, 0, 0, 0, 0, 0]))
    one.arm.spin_until(lambda: len(one.velocities) == 2, 'end of the motion')
    assert np.any(one.velocities[0].velocity)
    assert not np.any(one.velocities[1].velocity)
    one.arm.spin_until(lambda: len(one.statuses) == 2, 'status')
    assert level_of(one.statuses[-1]) == STALE
    one.settle()
    assert len(one.velocities) == 2


def test_a_refused_twist_ends_a_motion_once_and_nothing_is_watched_at_rest(targets):
    one = targets(ros_args=['-p', 'ik.target_timeout:=100.0'])
    watch = one.arm.node._targets._timer
    one.ask(twist_target([0.05, 0, 0, 0, 0, 0]))
    assert not watch.is_canceled()
    for _ in range(3):
        assert level_of(one.ask(_with_nan(twist_target([0.05] * 6)))) == ERROR
    assert watch.is_canceled()
    one.settle()
    assert len(one.velocities) == 2
    assert not np.any(one.velocities[1].velocity)
    one.ask(twist_target([0.05, 0, 0, 0, 0, 0]))
    assert not watch.is_canceled()
    one.ask(twist_target([0.0] * 6))
    assert watch.is_canceled()


def test_wrong_parameters_are_refused_with_the_reason():
    robot = ks.load_robot('ur5e')
    values = defaults(robot)
    for name, value, code, word in (
        ('ik.rows', 'x y up', 'unknown-name', 'x y z rx ry rz'),
        ('ik.rows', 'x x', 'duplicate-name', 'each once'),
        ('ik.axis', 'w', 'unknown-name', 'one of x y z'),
        ('ik.tolerance', -1.0, 'out-of-range', '-1.0'),
        ('ik.damping', math.nan, 'not-finite', 'nan'),
        ('ik.horizon', 0.0, 'out-of-range', '0.0'),
    ):
        with refused(SettingsError, code, f'parameter {name}: ', word):
            settings_from({**values, name: value}, robot)
    rows = settings_from({**values, 'ik.rows': 'z x'}, robot).target_rows
    assert rows == ('x', 'z')
    with refused(SettingsError, 'conflict', "ik.axis: 'z'", 'ik.rows'):
        settings_from({**values, 'ik.axis': 'z', 'ik.rows': 'x y z rx'}, robot)
    pointing = settings_from({**values, 'ik.axis': 'z'}, robot)
    assert (pointing.target_rows, pointing.target_axis) == (('x', 'y', 'z'), 'z')
    # Twists are not about it.
    assert pointing.servo.rows is None


# A path through the wrist singularity of the ur5e: joint 5 goes from bent to straight and beyond.
WRIST = np.array([0.3, -1.1, 1.4, -0.9, 0.25, 0.2])


@pytest.mark.parametrize('aside', [0.0, 1e-3], ids=['through', 'just beside'])
def test_a_stream_of_twists_is_tracked_through_a_wrist_singularity(targets, aside):
    one = targets(q=WRIST, executor=EventsExecutor)
    arm, robot = one.arm, one.arm.robot
    # The tool turns as joint 5 alone would turn it; beside the singularity q4 must swing too.
    steps = 100
    q = WRIST.copy()
    path = [
        ks.forward_kinematics(robot, WRIST - [0, 0, 0, 0, 0.5 * k / steps, 0])
        for k in range(steps + 1)
    ]
    axis = np.array([0.0, aside, 0.0])
    fastest, levels, worst, distances = 0.0, set(), 0.0, []
    for k in range(steps):
        T = ks.forward_kinematics(robot, q)
        ahead = path[k + 1].copy()
        ahead[:3, 3] += axis * math.sin(math.pi * (k + 1) / steps)
        error = _twist_between(T, ahead) / PERIOD
        heard = len(one.velocities)
        status = one.ask(twist_target(error))
        arm.spin_until(lambda n=heard: len(one.velocities) > n, 'velocities')
        qdot = np.array(one.velocities[-1].velocity)
        fastest = max(fastest, float(np.max(np.abs(qdot) / robot.velocity_limits)))
        levels.add(level_of(status))
        q = q + qdot * PERIOD
        arm.answer(q)
        distances.append(float(ks.singularity(robot, q).distance))
        off = _twist_between(ks.forward_kinematics(robot, q), ahead)
        worst = max(worst, float(np.linalg.norm(off)))
    assert min(distances) < 0.01, 'path beside the singularity'
    assert fastest <= 1.0 + EXACT
    assert WARN in levels
    assert ERROR not in levels
    # Tracked: off by little on the way (the damped direction), and there in the end.
    assert worst < 0.02
    assert float(np.linalg.norm(off)) < 1e-3


def test_a_twist_in_the_lost_direction_is_reported_until_the_arm_has_left_it(targets):
    # The wrist is straight: its lost direction, asked for exactly.
    q = np.array([*UR5E[:4], 0.0, UR5E[5]])
    one = targets(q=q)
    robot = one.arm.robot
    weights = np.array([1] * 3 + [robot.singularity.task.length] * 3)
    lost = np.linalg.svd(weights[:, None] * ks.jacobian(robot, q))[0][:, -1] / weights
    status = one.ask(twist_target(0.05 * lost))
    assert level_of(status) == WARN
    assert 'lost the direction' in status.message
    assert 'way_out' in status.message
    q += 0.2 * ks.singularity(robot, q).way_out
    one.arm.answer(q)
    status = one.ask(twist_target(0.05 * lost))
    assert 'lost' not in status.message
    assert float(values_of(status)['followed']) == pytest.approx(1.0)


def test_a_pose_may_be_asked_by_the_direction_of_a_tool_axis(targets):
    one = targets(ros_args=['-p', 'ik.axis:=z'])
    robot = one.arm.robot
    target = ks.forward_kinematics(robot, np.array(UR5E) + 0.02)
    turned = target.copy()
    turned[:3, :2] = turned[:3, :2] @ np.array([[0.6, -0.8], [0.8, 0.6]])
    assert level_of(one.ask(pose_target(turned))) == OK
    one.arm.spin_until(lambda: one.joint_states, 'answer')
    reached = ks.forward_kinematics(robot, one.joint_states[-1].position)
    np.testing.assert_allclose(reached[:3, 2:], target[:3, 2:], atol=EXACT)
    # The last joint turns about that axis: it has no reason to move.
    assert one.joint_states[-1].position[5] == pytest.approx(UR5E[5])


def test_a_pose_that_is_rounded_is_reached_within_the_tolerance(targets):
    rows = ['-p', "ik.rows:='x y z rx ry rz'"]
    one = targets('scara_hsr065', SCARA, [*rows, '-p', 'ik.tolerance:=1e-6'])
    target = ks.forward_kinematics(one.arm.robot, SCARA)
    tilt = 4e-7
    target[:3, :3] = np.array([[1, 0, 0], [0, 1, -tilt], [0, tilt, 1]]) @ target[:3, :3]
    status = one.ask(pose_target(target))
    assert level_of(status) == OK
    assert 'within the tolerance' in status.message
    told = float(values_of(status)['residual'])
    assert told == pytest.approx(tilt * one.arm.robot.singularity.task.length, rel=1e-2)
    assert change(one.arm, ik__tolerance=0.0).successful
    assert level_of(one.ask(pose_target(target))) == ERROR


def _twist_between(T, ahead):
    # The twist that turns and moves T into `ahead` in a second, base axes, at the tool.
    R = ahead[:3, :3] @ T[:3, :3].T
    vector = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2.0
    return np.concatenate([ahead[:3, 3] - T[:3, 3], vector])


def test_poses_are_answered_through_a_wrist_singularity_without_a_jump(targets):
    # The path of joint 5 alone through zero, every pose asked for; the answer becomes the state.
    one = targets(q=WRIST, executor=EventsExecutor)
    robot = one.arm.robot
    q = WRIST.copy()
    for k in range(1, 51):
        ahead = WRIST - [0, 0, 0, 0, 0.5 * k / 50, 0]
        T = ks.forward_kinematics(robot, q)
        relative = np.linalg.inv(T) @ ks.forward_kinematics(robot, ahead)
        heard = len(one.joint_states)
        assert level_of(one.ask(pose_target(relative, robot.tool_frame))) == OK
        one.arm.spin_until(lambda n=heard: len(one.joint_states) > n, 'answer')
        found = np.array(one.joint_states[-1].position)
        assert np.max(np.abs(found - q)) < 0.05
        q = found
        one.arm.answer(q)
    np.testing.assert_allclose(
        ks.forward_kinematics(robot, q), ks.forward_kinematics(robot, ahead), atol=1e-6
    )


def hold_answers(one, monkeypatch):
    """Let answers to poses wait; return the targets that are being answered, and what ends it."""
    begun, go_on = [], threading.Event()

    def solve(robot, T, **options):
        begun.append(T)
        assert go_on.wait(30.0)
        return ks.inverse_kinematics(robot, T, **options)

    monkeypatch.setattr(node_targets, 'inverse_kinematics', solve)
    return begun, go_on


def test_joint_states_do_not_wait_for_a_target_and_the_newest_target_is_next(targets, monkeypatch):
    one = targets('panda', PANDA)
    begun, go_on = hold_answers(one, monkeypatch)
    waiting = one.arm.node._targets._poses
    for k in range(6):
        T = np.eye(4)
        T[0, 3] = 0.001 * k
        one._publishers[PoseStamped].publish(pose_target(T, one.arm.robot.tool_frame, stamp=k + 1))
        one.arm.spin_until(lambda n=k: begun and waiting.qsize() == n, 'target')
        one.arm.answer(PANDA)
    assert len(begun) == 1
    assert not one.statuses
    go_on.set()
    one.arm.spin_until(lambda: len(one.statuses) == 2, 'statuses')
    assert [values_of(status)['replaced'] for status in one.statuses] == ['0', '4']
    one.arm.spin_until(lambda: len(one.joint_states) == 2, 'answers')
    assert [nanoseconds(answer.header.stamp) for answer in one.joint_states] == [1, 6]


def test_an_answer_is_of_the_settings_in_force_when_it_goes_out(targets, monkeypatch):
    one = targets()
    begun, go_on = hold_answers(one, monkeypatch)
    heard = len(one.statuses)
    target = pose_target(ks.forward_kinematics(one.arm.robot, UR5E), one.arm.robot.base_frame)
    publisher = one._publishers[PoseStamped]
    publisher.publish(target)
    one.arm.spin_until(lambda: begun, 'target')
    assert change(one.arm, tool__xyz=[0.0, 0.0, 0.1]).successful
    go_on.set()
    one.arm.spin_until(lambda: len(one.statuses) > heard, 'status')
    one.arm.spin_until(lambda: one.joint_states, 'answer')
    assert len(begun) == 2
    q = one.joint_states[-1].position
    reached = ks.forward_kinematics(one.arm.node.settings.robot, q)
    np.testing.assert_allclose(reached, ks.forward_kinematics('ur5e', UR5E), atol=EXACT)


def test_no_answer_goes_out_after_the_node_has_fallen_silent(targets, monkeypatch):
    one = targets()
    begun, go_on = hold_answers(one, monkeypatch)
    publisher = one._publishers[PoseStamped]
    publisher.publish(pose_target(np.eye(4), one.arm.robot.tool_frame))
    one.arm.spin_until(lambda: begun, 'target')
    one.arm.node.fall_silent('the node is not active')
    go_on.set()
    one.arm.spin_until(lambda: one.statuses, 'status')
    assert 'the node is not active' in one.statuses[-1].message
    one.settle()
    assert not one.joint_states
