# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Topics of points: what they say, when they cost something, and which names are refused."""

import json

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.parameter import Parameter
from refusal import refused
from ros_harness import nanoseconds
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Trigger
from tolerances import DIFFERENCE, DIFFERENCE_STEP, ROUND_OFF

import kinematics_service as ks
from kinematics_service.errors import SettingsError
from kinematics_service.node import point_states
from kinematics_service.node.parameters.settings import defaults, settings_from

Q, QDOT = (0.3, -0.4, 1.2), (0.5, -0.2, 0.7)
POINTED = """\
points:
  elbow: {row: 2, xyz: [0.4, 0, 0]}
  camera: {row: 3, xyz: [0.1, 0.05, 0.2], rpy: [0.3, -0.7, 1.1]}
  plate: {row: 0}
"""
KINDS = {'pose': PoseStamped, 'jacobian': Float64MultiArray, 'twist': TwistStamped}


@pytest.fixture(scope='module')
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp('points') / 'arm.yaml'
    path.write_text(ks.bundled_robots()['craig_3r'].read_text(encoding='utf-8') + POINTED)
    return str(path)


@pytest.fixture
def pointed(arm, file):
    """Return a node with topics of two points."""

    def start(*more, points='[elbow, camera]'):
        words = [word for one in (f'points:={points}', *more) for word in ('-p', one)]
        return arm(file, ros_args=words)

    return start


def xyz(vector):
    return np.array([vector.x, vector.y, vector.z])


def six(twist):
    return np.concatenate([xyz(twist.linear), xyz(twist.angular)])


def heard_of(one, point):
    """Send one pose; return pose, J (6, n) and twist of a point, with the stamp sent."""
    heard = {name: one.hear(f'{point}/{name}', kind) for name, kind in KINDS.items()}
    stamp = one.send(Q, QDOT)
    one.spin_until(lambda: all(heard.values()), f'messages of {point}')
    pose, J, twist = (messages[0] for messages in heard.values())
    return pose, np.reshape(J.data, (6, -1)), twist, stamp


def place(robot, q, point):
    """Return position and rotation of a point by the frames of the table and its own place."""
    described = next(one for one in robot.description.points if one.name == point)
    T = ks.link_frames(robot, q)[described.row] @ described.motion.matrix
    return T[:3, 3], T[:3, :3]


@pytest.mark.parametrize('point', ['elbow', 'camera'])
def test_pose_jacobian_and_twist_of_a_point_against_differences(pointed, file, point):
    robot, one = ks.load_robot(file), pointed()
    stamps = one.hear(f'{point}/jacobian/stamp', Time)
    pose, J, twist, stamp = heard_of(one, point)
    one.spin_until(lambda: stamps, 'stamp of the Jacobian')
    position, R = place(robot, Q, point)
    np.testing.assert_allclose(xyz(pose.pose.position), position, rtol=0, atol=ROUND_OFF)
    turn = pose.pose.orientation
    about = 4 * turn.w * np.array([turn.x, turn.y, turn.z])
    skew = [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
    np.testing.assert_allclose(about, skew, rtol=0, atol=ROUND_OFF)
    for j, step in enumerate(DIFFERENCE_STEP * np.eye(3)):
        (ahead, R_ahead), (behind, R_behind) = (
            place(robot, Q + sign * step, point) for sign in (1, -1)
        )
        turned = (R_ahead - R_behind) @ R.T / (2 * DIFFERENCE_STEP)
        column = [
            *(ahead - behind) / (2 * DIFFERENCE_STEP),
            *(turned[2, 1], turned[0, 2], turned[1, 0]),
        ]
        np.testing.assert_allclose(J[:, j], column, rtol=0, atol=DIFFERENCE)
    np.testing.assert_allclose(six(twist.twist), J @ QDOT, rtol=0, atol=ROUND_OFF)
    assert (pose.header.frame_id, twist.header.frame_id) == ('base_link', 'base_link')
    given = (pose.header.stamp, twist.header.stamp, *stamps)
    assert [nanoseconds(one) for one in given] == [stamp] * 3
    if point == 'elbow':
        assert not J[:, 2].any()


@pytest.mark.peers
def test_two_points_at_once_against_pinocchio(pointed, file):
    pinocchio = pytest.importorskip('pinocchio')
    robot, one = ks.load_robot(file), pointed()
    model = pinocchio.buildModelFromXML(ks.export_urdf(robot))
    data, whole = model.createData(), pinocchio.neutral(model)
    for name, value in zip(robot.joint_names, Q):
        joint = model.joints[model.getJointId(name)]
        values = [np.cos(value), np.sin(value)] if joint.nq == 2 else value
        whole[joint.idx_q : joint.idx_q + joint.nq] = values
    heard = {
        point: one.hear(f'{point}/jacobian', Float64MultiArray) for point in ('elbow', 'camera')
    }
    poses = one.hear('camera/pose', PoseStamped)
    one.send(Q, QDOT)
    one.spin_until(lambda: poses and all(heard.values()), 'messages of both points')
    for point, messages in heard.items():
        expected = pinocchio.computeFrameJacobian(
            model,
            data,
            whole,
            model.getFrameId(point),
            pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED,
        )
        np.testing.assert_allclose(
            np.reshape(messages[0].data, (6, 3)), expected, rtol=0, atol=ROUND_OFF
        )
    pinocchio.framesForwardKinematics(model, data, whole)
    where = data.oMf[model.getFrameId('camera')].translation
    np.testing.assert_allclose(xyz(poses[0].pose.position), where, rtol=0, atol=ROUND_OFF)


def test_the_topics_of_the_tool_are_what_they_are_without_points(pointed):
    told = []
    for points in ('[]', '[elbow, camera]'):
        one = pointed(points=points)
        heard = {name: one.hear(name, kind) for name, kind in KINDS.items()}
        if points != '[]':
            heard_of(one, 'elbow')
        else:
            one.send(Q, QDOT)
        one.spin_until(lambda heard=heard: all(heard.values()), 'messages of the tool')
        pose, J, twist = (messages[0] for messages in heard.values())
        told.append((pose, J, twist))
        one.close()
    assert told[0] == told[1]


def test_points_that_nobody_hears_are_not_computed(pointed, monkeypatch):
    asked = []
    answer = point_states.PointStates.answer

    def noted(self, of, robot, known):
        asked.append(of)
        return answer(self, of, robot, known)

    monkeypatch.setattr(point_states.PointStates, 'answer', noted)
    one = pointed()
    one.answer(Q, QDOT)
    assert asked == []
    heard_of(one, 'camera')
    # Once for its three topics; the elbow stays unheard.
    assert asked == ['camera']


def test_axes_of_a_point_are_its_own_where_the_tools_are_asked_for(pointed, file):
    robot = ks.load_robot(file)
    one = pointed('jacobian_frame:=tool', 'twist_frame:=tool', 'frame_prefix:=left_')
    _, J, twist, _ = heard_of(one, 'camera')
    expected = ks.jacobian(robot, Q, 'camera', of='camera')
    np.testing.assert_allclose(J, expected, rtol=0, atol=ROUND_OFF)
    np.testing.assert_allclose(six(twist.twist), expected @ QDOT, rtol=0, atol=ROUND_OFF)
    assert twist.header.frame_id == 'left_camera'


def test_points_follow_a_change_of_parameters(pointed, file):
    one = pointed()
    heard_of(one, 'camera')
    assert one.node.set_parameters([Parameter('row_order', value='angular_first')])[0].successful
    _, J, _, _ = heard_of(one, 'camera')
    expected = ks.jacobian(ks.load_robot(file), Q, of='camera')
    np.testing.assert_allclose(
        J, np.concatenate([expected[3:], expected[:3]]), rtol=0, atol=ROUND_OFF
    )


def test_the_quaternion_of_a_point_keeps_its_sign(pointed):
    one = pointed()
    poses = one.hear('camera/pose', PoseStamped)
    turns = np.linspace(0.0, 2 * np.pi, 20)
    for angle in turns:
        one.send((angle - np.pi, 0.2, -0.3), ())
    one.spin_until(lambda: len(poses) == len(turns), 'poses')
    turned = [message.pose.orientation for message in poses]
    quaternions = np.array([[q.x, q.y, q.z, q.w] for q in turned])
    assert np.all(np.sum(quaternions[1:] * quaternions[:-1], axis=1) > 0.9)
    assert quaternions[:, 3].min() < 0.0
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1.0, atol=ROUND_OFF)


def test_a_twist_of_a_point_is_not_made_up_where_velocities_are_unknown(pointed):
    one = pointed('velocity_source:=message')
    poses, twists = (one.hear(f'elbow/{name}', KINDS[name]) for name in ('pose', 'twist'))
    one.send(Q)
    one.spin_until(lambda: poses, 'a pose')
    one.send(Q, QDOT)
    one.spin_until(lambda: twists, 'a twist')
    assert (len(poses), len(twists)) == (2, 1)


def test_describe_names_the_points_and_their_topics(pointed):
    one = pointed()
    told = json.loads(one.call(Trigger, '/kinematics/describe', Trigger.Request()).message)
    assert told['points'] == {'elbow': 'elbow', 'camera': 'camera'}
    assert {f'/kinematics/{point}/{name}' for point in told['points'] for name in KINDS} <= set(
        told['publishes']
    )


@pytest.mark.parametrize(
    ('points', 'code', 'word'),
    [
        (['elbo'], 'unknown-name', "'elbo'"),
        (['tool'], 'unknown-name', "'tool'"),
        (['elbow', 'elbow'], 'duplicate-name', 'each once'),
        ('elbow', 'wrong-type', '[elbow]'),
        ([2], 'wrong-type', '[2]'),
    ],
)
def test_points_that_the_node_cannot_answer_for_are_refused(file, points, code, word):
    robot = ks.load_robot(file)
    with refused(SettingsError, code, 'parameter points: ', word, 'elbow, camera, plate'):
        settings_from(defaults(robot), robot, points)


def test_a_file_without_points_says_so():
    robot = ks.load_robot('puma560')
    with refused(SettingsError, 'unknown-name', "'elbow'", 'puma560 has no points'):
        settings_from(defaults(robot), robot, ['elbow'])


def test_a_point_like_a_frame_of_the_node_is_refused(file):
    robot = ks.load_robot(file)
    with refused(SettingsError, 'conflict', "points: 'elbow'", 'base or the tool'):
        settings_from(defaults(robot) | {'tool_frame': 'elbow'}, robot, ['elbow'])


def test_an_unknown_point_ends_the_node_at_its_start(arm, file):
    with refused(SettingsError, 'unknown-name', "points: 'wrist'"):
        arm(file, ros_args=['-p', 'points:=[wrist]'])
