# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Topics of the motion: what they say, and when they are silent."""

import itertools
import json

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from geometry_msgs.msg import AccelStamped, WrenchStamped
from recordings import PR2, recorded
from ros_harness import (
    BOTH_TRANSPORTS,
    SECOND,
    STEP,
    change,
    joint_state,
    level_of,
    nanoseconds,
    values_of,
)
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Trigger
from tolerances import ROUND_OFF

import kinematics_service as ks

POINTED = 'points: {camera: {row: 3, xyz: [0.1, 0.05, 0.2], rpy: [0.3, -0.7, 1.1]}}\n'
Q, QDOT, QDDOT = (
    np.array(numbers) for numbers in ((0.3, -0.4, 1.2), (0.5, -0.2, 0.7), (3, 2, -4))
)
# Second differences of positions over STEP, 10 ms: the fourth derivative leaves 1e-4 of them.
SECOND_DIFFERENCE = 0.02


def xyz(vector):
    return np.array([vector.x, vector.y, vector.z])


def six(message):
    return np.concatenate([xyz(message.linear), xyz(message.angular)])


@pytest.fixture(scope='module')
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp('points') / 'arm.yaml'
    path.write_text(ks.bundled_robots()['craig_3r'].read_text(encoding='utf-8') + POINTED)
    return str(path)


def moving(k):
    """Return positions and velocities of a steady acceleration at message k."""
    t = k * STEP / SECOND
    return Q + QDOT * t + 0.5 * QDDOT * t * t, QDOT + QDDOT * t


def sent(one, count=7):
    """Send a steady acceleration; return the stamps."""
    return [one.send(q.tolist(), qdot.tolist()) for q, qdot in map(moving, range(count))]


@BOTH_TRANSPORTS
@pytest.mark.parametrize('axes', ['base', 'tool'])
def test_the_acceleration_of_a_motion_is_the_librarys(arm, file, axes):
    one = arm(file, ['-p', f'twist_frame:={axes}', '-p', 'points:=[camera]'])
    heard = {
        of: one.hear(name, AccelStamped)
        for of, name in (('tool', 'acceleration'), ('camera', 'camera/acceleration'))
    }
    stamps = sent(one)
    one.spin_until(lambda: all(len(some) == 6 for some in heard.values()), 'accelerations')
    robot = ks.load_robot(file)
    for of, some in heard.items():
        assert [nanoseconds(message.header.stamp) for message in some] == stamps[1:]
        frame = {'tool': 'tool0', 'camera': 'camera'}[of] if axes == 'tool' else 'base_link'
        for message, (q, qdot) in zip(some, map(moving, range(1, 7))):
            assert message.header.frame_id == frame
            told = of if axes == 'tool' else 'base'
            expected = ks.acceleration(robot, q, qdot, QDDOT, told, of=of)
            np.testing.assert_allclose(six(message.accel), expected, rtol=0, atol=1e-11)


def test_the_acceleration_is_the_second_difference_of_the_pose(arm):
    one = arm('craig_3r')
    heard = one.hear('acceleration', AccelStamped)
    places = [xyz(one.answer(*map(list, moving(k))).pose.position) for k in range(7)]
    one.spin_until(lambda: len(heard) == 6, 'accelerations')
    for k in range(1, 6):
        second = (places[k + 1] - 2 * places[k] + places[k - 1]) / (STEP / SECOND) ** 2
        np.testing.assert_allclose(
            xyz(heard[k - 1].accel.linear), second, rtol=0, atol=SECOND_DIFFERENCE
        )


@BOTH_TRANSPORTS
def test_the_acceleration_of_an_arm_with_a_closed_loop_is_the_librarys(arm):
    one = arm('crank_slider')
    heard = one.hear('acceleration', AccelStamped)
    for k in range(3):
        one.send([0.4 + 0.02 * k + 0.001 * k * k], [2.0 + 0.2 * k])
    one.spin_until(lambda: len(heard) == 2, 'accelerations')
    expected = ks.acceleration(one.robot, [0.444], [2.4], [20.0])
    np.testing.assert_allclose(six(heard[-1].accel), expected, rtol=1e-9, atol=ROUND_OFF)


def test_the_diagnostics_say_how_late_an_acceleration_is(arm):
    one = arm('craig_3r')
    heard = one.hear('acceleration', AccelStamped)
    assert 'acceleration delay' not in one.counts()
    sent(one, 8)
    one.spin_until(lambda: len(heard) == 7, 'accelerations')
    assert one.counts()['acceleration delay'] == '0.025 s'  # half of 50 ms


def test_there_is_no_acceleration_of_differences_of_positions(arm):
    one = arm('craig_3r')
    heard = one.hear('acceleration', AccelStamped)
    for k in range(4):
        one.answer(moving(k)[0].tolist())
    sent(one, 2)
    one.spin_until(lambda: bool(heard), 'acceleration')
    assert len(heard) == 1


# Self-motion

# The bend of an arm of seven joints that is 0.2 rad from a singular pose.
BENT = np.array([0.2, 0.4, 0.1, -0.25, 0.3, 0.6, 0.5])
# A way without singular poses on which the largest number of the basis changes its sign.
BEGIN = np.array([0.7, 0.1, -0.4, -1.2, -0.9, 1.5, 0.3])
WAY = np.array([-0.2, 1.0, 1.0, 0.4, 0.3, 0.4, -0.2])


def heard_matrix(message):
    rows, columns = message.layout.dim
    assert (rows.stride, columns.stride) == (rows.size * columns.size, columns.size)
    return np.reshape(message.data, (rows.size, columns.size))


@BOTH_TRANSPORTS
def test_the_null_space_is_continuous_and_leaves_the_tool_at_rest(arm):
    one = arm('panda')
    heard = one.hear('null_space', Float64MultiArray)
    poses = [BEGIN + 0.06 * k * WAY for k in range(30)]
    for q in poses:
        one.send(q.tolist())
    one.spin_until(lambda: len(heard) == 30, 'bases')
    before, turned = None, False
    for q, message in zip(poses, heard):
        assert message.layout.dim[0].label == ','.join(one.names)
        basis = heard_matrix(message)
        np.testing.assert_allclose(ks.jacobian(one.robot, q) @ basis, 0.0, atol=1e-11)
        np.testing.assert_allclose(basis.T @ basis, [[1.0]], rtol=0, atol=ROUND_OFF)
        np.testing.assert_array_equal(basis, ks.null_space(one.robot, q, near=before))
        assert before is None or np.linalg.norm(basis - before) < 0.1
        turned = turned or bool(np.any(basis * ks.null_space(one.robot, q) < 0))
        before = basis
    assert turned  # a sign chosen alone would have jumped


def test_the_self_motion_leads_away_from_the_singular_pose(arm):
    one = arm('panda')
    heard = one.hear('null_space/away', Float64MultiArray)
    one.send(BENT.tolist())
    one.spin_until(lambda: bool(heard), 'self-motion')
    motion = np.array(heard[0].data)
    # A pose asked alone is searched for longer; each of many as the first one of a node.
    of_many = ks.self_motion(one.robot, np.array([BENT, BENT]))[0]
    np.testing.assert_allclose(motion, of_many, rtol=0, atol=1e-9)
    step = 1e-3 / np.linalg.norm(motion)
    ahead, here = (ks.singularity(one.robot, q).distance for q in (BENT + step * motion, BENT))
    assert (ahead - here) / step == pytest.approx(motion @ motion, rel=0.05)


def test_only_an_arm_with_self_motion_offers_it(arm):
    for name, offered in (('puma560', False), ('panda', True)):
        names = arm(name).node._outputs.names
        assert ('/kinematics/null_space' in names) == offered
        assert ('/kinematics/null_space/away' in names) == offered


def test_another_tool_begins_another_basis(arm):
    one = arm('panda')
    heard = one.hear('null_space', Float64MultiArray)
    one.send(BENT.tolist())
    one.spin_until(lambda: bool(heard), 'basis')
    assert change(one, tool__xyz=[0.1, 0.2, 0.3]).successful
    one.send(BENT.tolist())
    one.spin_until(lambda: len(heard) == 2, 'another basis')
    expected = ks.null_space(one.node.settings.robot, BENT)
    np.testing.assert_array_equal(heard_matrix(heard[1]), expected)


# Wrenches

EFFORT = np.array([1.5, -2.0, 0.7])


def pushed(one, efforts, q=Q, names=None):
    """Send a pose with efforts."""
    one.stamp += STEP
    message = joint_state(names or one.names, list(map(float, q)), (), one.stamp)
    message.effort = list(map(float, efforts))
    one.publish(message)


def force_torque(message):
    return np.concatenate([xyz(message.wrench.force), xyz(message.wrench.torque)])


def wrench_status(one):
    one.diagnose()
    (found,) = (s for s in one._diagnostics[-1].status if s.name.endswith(': wrench'))
    return found


def zeroed(one):
    return one.call(Trigger, '/kinematics/wrench/zero', Trigger.Request())


@BOTH_TRANSPORTS
def test_the_wrench_is_that_of_the_efforts_at_the_frame_it_names(arm, file):
    one = arm(file, ['-p', 'points:=[camera]'])
    heard = {
        of: one.hear(name, WrenchStamped)
        for of, name in (('tool', 'wrench'), ('camera', 'camera/wrench'))
    }
    pushed(one, EFFORT)
    one.spin_until(lambda: all(heard.values()), 'wrenches')
    robot = ks.load_robot(file)
    for of, (message, *_) in heard.items():
        assert nanoseconds(message.header.stamp) == one.stamp
        assert message.header.frame_id == {'tool': 'tool0', 'camera': 'camera'}[of]
        expected = ks.wrench_from_torques(robot, Q, EFFORT, of, of=of, damping=0.025)
        np.testing.assert_allclose(force_torque(message), expected.wrench, rtol=0, atol=1e-10)


def test_the_wrench_is_the_one_the_tool_exerts(arm):
    one = arm('planar_2r')
    heard = one.hear('wrench', WrenchStamped)
    # The arm of two links of 1 m is bent to the left; pressing up along y asks the first joint for
    # 1 N m a newton.
    pushed(one, [3.0, 0.0], (0.0, np.pi / 2))
    one.spin_until(lambda: bool(heard), 'wrench')
    T = ks.forward_kinematics(one.robot, (0.0, np.pi / 2))
    force = T[:3, :3] @ force_torque(heard[0])[:3]
    J = ks.jacobian(one.robot, (0.0, np.pi / 2))
    turned = np.concatenate([force, T[:3, :3] @ force_torque(heard[0])[3:]])
    np.testing.assert_allclose(J.T @ turned, [3.0, 0.0], rtol=0, atol=1e-11)
    assert force[1] > 0


@pytest.mark.slow
@pytest.mark.parametrize('side', ['r'])
def test_the_wrench_of_a_pr2s_arm_explains_the_efforts_of_its_bag(arm, tmp_path, side):
    rosbags = pytest.importorskip('rosbags.highlevel', reason='needs rosbags')
    path = tmp_path / 'pr2.yaml'
    path.write_text(PR2.format(side=side, y=0.188))
    one = arm(str(path))
    heard = one.hear('wrench', WrenchStamped)
    states = {}
    with rosbags.AnyReader([recorded('pr2_jsk_ros1_bags/pr1012_deb3032.bag')]) as reader:
        wanted = [c for c in reader.connections if c.topic == '/joint_states']
        for connection, _, raw in itertools.islice(reader.messages(wanted), 0, None, 12):
            told = reader.deserialize(raw, connection.msgtype)
            stamp = told.header.stamp.sec * 1_000_000_000 + told.header.stamp.nanosec
            message = joint_state(list(told.name), told.position.tolist(), told.velocity, stamp)
            message.effort = told.effort.tolist()
            one.publish(message)
            places = [told.name.index(name) for name in one.names]
            states[stamp] = told.position[places], told.effort[places]
            one.spin_until(lambda: len(heard) == len(states), 'wrench')
    robot, compared = one.robot, 0
    for message in heard:
        q, efforts = states[nanoseconds(message.header.stamp)]
        J = ks.jacobian(robot, q, 'tool')
        # Seven joints and six numbers: what explains the efforts best, where nothing is damped.
        if ks.wrench_from_torques(robot, q, efforts, damping=0.025).damping > 0.0:
            continue
        best, *_ = np.linalg.lstsq(J.T, efforts, rcond=None)
        np.testing.assert_allclose(force_torque(message), best, rtol=0, atol=1e-9)
        assert np.linalg.norm(efforts) > 0.1  # it holds its weight
        compared += 1
    assert compared > 10


@BOTH_TRANSPORTS
def test_efforts_that_are_none_make_no_wrench_and_are_named(arm):
    one = arm()
    heard, poses = one.hear('wrench', WrenchStamped), one.poses
    for k, (efforts, unknown) in enumerate(
        (
            ((), 'q1, q2, q3'),
            ((1.0, 2.0), 'q1, q2, q3'),
            ((1.0, np.nan, 2.0), 'q2'),
            ((np.inf, 1.0, -np.inf), 'q1, q3'),
            ((1.0, 2.0, 1e300), 'q3'),
        ),
        1,
    ):
        pushed(one, efforts)
        one.spin_until(lambda k=k: len(poses) == 2 * k - 1, 'pose')
        status = wrench_status(one)
        assert level_of(status) == 1
        assert status.message.startswith('no wrench: ')
        assert status.message.endswith(f' {unknown}')
        response = zeroed(one)
        assert not response.success
        assert response.message.endswith(f' {unknown}')
        pushed(one, EFFORT)
        one.spin_until(lambda k=k: len(poses) == 2 * k, 'pose')
        one.spin_until(lambda k=k: len(heard) == k, 'wrench')
        assert level_of(wrench_status(one)) == 0


@BOTH_TRANSPORTS
def test_efforts_of_two_drivers_are_one_wrench(arm):
    one = arm()
    heard, poses = one.hear('wrench', WrenchStamped), one.poses
    pushed(one, EFFORT[:1], Q[:1], ['q1'])
    pushed(one, EFFORT[1:], Q[1:], ['q2', 'q3'])
    pushed(one, [9.0, EFFORT[0]], [1.0, Q[0]], ['gripper', 'q1'])
    one.spin_until(lambda: len(poses) == 2, 'poses')
    one.spin_until(lambda: bool(heard), 'wrench')
    expected = ks.wrench_from_torques(one.robot, Q, EFFORT, 'tool', damping=0.025).wrench
    np.testing.assert_allclose(force_torque(heard[0]), expected, rtol=0, atol=1e-10)
    assert len(heard) == 1  # the first answer knows no effort of q1


def test_zero_takes_the_bias_and_only_then_the_wrench_is_external(arm):
    one = arm()
    assert 'subscribe' in zeroed(one).message
    heard = one.hear('wrench', WrenchStamped)
    for noise in (0.1, -0.1, 0.3, -0.3):
        pushed(one, EFFORT + noise)
    one.spin_until(lambda: len(heard) == 4, 'wrenches')
    assert wrench_status(one).message.startswith('not external: ')
    response = zeroed(one)
    assert response.success
    assert 'mean of 4 messages' in response.message
    pushed(one, EFFORT)
    one.spin_until(lambda: len(heard) == 5, 'wrench')
    np.testing.assert_allclose(force_torque(heard[-1]), 0.0, rtol=0, atol=1e-12)
    assert wrench_status(one).message.startswith('external, ')
    pushed(one, EFFORT + [0.0, 0.0, 1.0])
    one.spin_until(lambda: len(heard) == 6, 'wrench')
    expected = ks.wrench_from_torques(one.robot, Q, [0, 0, 1], 'tool', damping=0.025).wrench
    np.testing.assert_allclose(force_torque(heard[-1]), expected, rtol=0, atol=1e-10)


def test_near_a_singular_pose_the_status_says_what_is_hardly_felt(arm):
    one = arm('puma560')
    heard = one.hear('wrench', WrenchStamped)
    q, friction = [0.1, -0.4, 0.6, 0.2, 1e-3, 0.3], [0, 0, 0, 0.02, 0, -0.01]
    pushed(one, friction, q)
    one.spin_until(lambda: bool(heard), 'wrench')
    plain = ks.wrench_from_torques(one.robot, q, friction, 'tool').wrench
    assert np.linalg.norm(force_torque(heard[0])) < 0.1 * np.linalg.norm(plain)
    status = wrench_status(one)
    assert level_of(status) == 1
    assert 'along (0.87, 0.16, -0.47) with' in status.message
    assert '~/wrench/zero' in status.message
    values = values_of(status)
    assert values['directions felt'] == '6 of 6'
    assert values['not felt'] == ''
    assert float(values['torques unexplained']) > 0.01


def test_directions_that_an_arm_of_few_joints_never_feels_are_named(arm):
    one = arm('planar_2r')
    heard = one.hear('wrench', WrenchStamped)
    pushed(one, [1.0, 0.5], (0.1, 1.0))
    one.spin_until(lambda: bool(heard), 'wrench')
    status = wrench_status(one)
    assert level_of(status) == 0
    values = values_of(status)
    assert values['directions felt'] == '2 of 6'
    assert 'torque about x' in values['not felt']


# Closed loops


def test_the_wrench_of_an_arm_with_a_closed_loop_is_that_of_its_motors(arm):
    one = arm('crank_slider')
    heard = one.hear('wrench', WrenchStamped)
    pushed(one, [0.8], [0.7])
    one.spin_until(lambda: bool(heard), 'wrench')
    J = ks.jacobian(one.robot, [0.7], 'tool')
    np.testing.assert_allclose(J.T @ force_torque(heard[0]), [0.8], rtol=0, atol=1e-11)


@pytest.mark.parametrize('name', ['excavator', 'flexpicker', 'five_bar'])
def test_a_loop_that_is_driven_fully_offers_no_self_motion(arm, name):
    one = arm(name)
    assert '/kinematics/wrench' in one.node._outputs.names
    assert ('/kinematics/null_space' in one.node._outputs.names) == (
        one.robot.dof > one.robot.singularity.task.generic_rank
    )


def test_describe_says_what_the_numbers_of_the_motion_are(arm):
    one = arm('craig_3r', ['-p', 'acceleration_window:=0.02'])
    told = json.loads(one.call(Trigger, '/kinematics/describe', Trigger.Request()).message)
    assert told['acceleration'] == {'axes': 'base', 'window': pytest.approx(0.02)}
    assert told['wrench']['exerted by'] == 'the tool'
    assert '/kinematics/acceleration' in told['publishes']
