# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Real robots' data through the node and the estimator: `../shared/recordings`, or the folder named
in KINEMATICS_RECORDINGS. Nothing of it is part of this project; without it these tests skip.
"""

import csv
import json
import math
from decimal import Decimal
from typing import NamedTuple

import numpy as np
import pytest
from recordings import PR2, recorded

import kinematics_service as ks
from kinematics_service.estimation import outcomes as reasons
from kinematics_service.estimation.estimator import Estimator, EstimatorOutput, EstimatorSettings
from kinematics_service.estimation.joint_sample import JointSample
from kinematics_service.kinematics.singularity import singularity_of
from kinematics_service.robot.measures import Level

SECOND = 1_000_000_000

# What the factory calibration of one UR3e makes against the nominal table, with a margin.
CALIBRATION = 1.5e-3
CALIBRATION_ANGLE = math.radians(0.2)
CALIBRATION_SPEED = 1e-3

# As ur_robot_driver sends them.
ELBOW_FIRST = (
    'elbow_joint',
    'shoulder_lift_joint',
    'shoulder_pan_joint',
    'wrist_1_joint',
    'wrist_2_joint',
    'wrist_3_joint',
)
ORDER = (2, 1, 0, 3, 4, 5)


class Row(NamedTuple):
    leg: str
    stamp: int
    q: np.ndarray
    qd: np.ndarray
    position: np.ndarray
    rotation: np.ndarray
    speed: np.ndarray


def rotation_of(vector):
    """Return the rotation matrix of a rotation vector (rad), by Rodrigues' formula."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K


def quaternion_rotation(x, y, z, w):
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def angle_between(A, B):
    """Return the angle of A^T B, exact for small ones."""
    return 2 * math.asin(min(1.0, float(np.linalg.norm(A - B)) / (2 * math.sqrt(2))))


@pytest.fixture(scope='module')
def rows():
    with recorded('ur3e_rad/rad_ur3e_25hz.csv').open(newline='') as file:
        table = list(csv.DictReader(file))

    def six(row, name):
        return np.array([float(row[f'{name}_{k}']) for k in range(6)])

    return [
        Row(
            row['leg'],
            int(Decimal(row['timestamp']) * SECOND),
            six(row, 'actual_q'),
            six(row, 'actual_qd'),
            six(row, 'actual_TCP_pose')[:3],
            rotation_of(six(row, 'actual_TCP_pose')[3:]),
            six(row, 'actual_TCP_speed'),
        )
        for row in table
    ]


@pytest.fixture(scope='module')
def ur3e_file(tmp_path_factory):
    """Return the bundled UR3e with the tool that was mounted."""
    text = ks.bundled_robots()['ur3e'].read_text()
    text = text.partition('known_poses:')[0]  # those are the flange's
    with_tool = text.replace('tool: {frame: tool0}', 'tool: {frame: tool0, xyz: [0, 0, 0.150]}')
    assert with_tool != text
    file = tmp_path_factory.mktemp('robots') / 'ur3e.yaml'
    file.write_text(with_tool)
    return file


# The estimator


class Said(NamedTuple):
    row: int
    level: Level
    lost: np.ndarray


@pytest.fixture(scope='module')
def judged(rows, ur3e_file):
    """Return what is said, and the level of each row, arrivals being the stamps."""
    robot = ks.load_robot(ur3e_file)
    estimator = Estimator(robot, EstimatorSettings())
    warnings, levels = [], []
    for k, row in enumerate(rows):
        answer = estimator.take(
            JointSample(
                ELBOW_FIRST,
                row.q[list(ORDER)],
                row.qd[list(ORDER)],
                row.stamp,
                row.stamp,
                row.stamp,
            )
        )
        assert isinstance(answer, EstimatorOutput)
        singularity = singularity_of(answer.state)
        level, say = estimator.judge(singularity, row.stamp)
        levels.append(level)
        if say:
            warnings.append(Said(k, level, np.array(singularity.lost_direction)))
    return warnings, levels


def test_the_arm_is_at_a_singularity_twice_in_one_episode(rows, judged):
    warnings, levels = judged
    bad = [k for k, level in enumerate(levels) if level != Level.OK]
    assert bad == list(range(bad[0], bad[-1] + 1))
    assert {rows[k].leg for k in bad} <= {'L1L2', 'L2L3'}
    assert levels[87] == levels[92] == Level.ERROR


def test_both_lost_directions_are_said(judged):
    warnings, _ = judged
    errors = [each for each in warnings if each.level == Level.ERROR]
    turns = [
        (earlier.row, later.row)
        for earlier, later in zip(errors, errors[1:])
        if abs(float(earlier.lost @ later.lost)) < math.cos(math.radians(30.0))
    ]
    assert turns
    assert any(earlier <= 92 and later >= 88 for earlier, later in turns)


@pytest.mark.parametrize('leg', ['L0L1', 'L3L4', 'L4L5'])
def test_nothing_is_said_of_a_leg_without_singularity(rows, judged, leg):
    _, levels = judged
    assert {level for row, level in zip(rows, levels) if row.leg == leg} == {Level.OK}


# The node, in the time of the recording


class Replay(NamedTuple):
    poses: list
    twists: list
    warnings: list


@pytest.fixture(scope='module')
def replay(rows, ur3e_file, ros_domain):
    pytest.importorskip('rclpy', reason='needs ROS 2')
    from diagnostic_msgs.msg import DiagnosticStatus
    from geometry_msgs.msg import TwistStamped
    from ros_harness import LATCHED, Arm, joint_state

    one = Arm(str(ur3e_file))
    try:
        twists = one.hear('twist', TwistStamped)
        warnings, poses, sent = [], one.poses, []
        one.peer.create_subscription(
            DiagnosticStatus,
            one.topic('singularity/warning'),
            lambda warning: warnings.append((len(sent) - 1, warning)),
            LATCHED,
        )
        one.attach()

        def send():
            if len(sent) < len(rows):
                row = rows[len(sent)]
                sent.append(row)
                q, qd = row.q[list(ORDER)].tolist(), row.qd[list(ORDER)].tolist()
                one.publish(joint_state(ELBOW_FIRST, q, qd, row.stamp))

        one.peer.create_timer(0.04, send)
        one.spin_until(lambda: len(poses) == len(twists) == len(rows), 'end of the replay', 30.0)
        return Replay(list(poses), list(twists), list(warnings))
    finally:
        one.close()


@pytest.mark.slow
def test_poses_are_the_controllers(rows, replay):
    from ros_harness import nanoseconds

    errors, angles = [], []
    for row, message in zip(rows, replay.poses):
        assert nanoseconds(message.header.stamp) == row.stamp
        assert message.header.frame_id == 'base'
        p, o = message.pose.position, message.pose.orientation
        errors.append(np.linalg.norm([p.x, p.y, p.z] - row.position))
        angles.append(angle_between(quaternion_rotation(o.x, o.y, o.z, o.w), row.rotation))
    assert max(errors) < CALIBRATION
    assert max(angles) < CALIBRATION_ANGLE


def test_twists_are_the_controllers(rows, replay):
    errors = []
    for row, message in zip(rows, replay.twists):
        v = message.twist.linear
        errors.append(np.linalg.norm([v.x, v.y, v.z] - row.speed[:3]))
    assert max(errors) < CALIBRATION_SPEED


def test_the_node_warns_of_both_singularities_and_of_nothing_else(rows, replay):
    levels = [(row, warning.level[0]) for row, warning in replay.warnings]
    assert levels[0][1] == 0
    changes = [levels[0]] + [
        later for earlier, later in zip(levels, levels[1:]) if later[1] != earlier[1]
    ]
    numbers = [level for _, level in changes]
    assert numbers[0] == numbers[-1] == 0
    assert 2 in numbers
    assert 0 not in numbers[1:-1]  # one episode
    for row, level in levels:
        if level:
            assert rows[row].leg in ('L1L2', 'L2L3')
    lost = []
    for _, warning in replay.warnings:
        values = {pair.key: pair.value for pair in warning.values}
        if warning.level[0] == 2:
            lost.append(np.array(values['lost_direction'].split(), float))
    cosines = [abs(float(a @ b)) for a, b in zip(lost, lost[1:])]
    assert min(cosines) < math.cos(math.radians(30.0))
    told = ' '.join(warning.message for _, warning in replay.warnings if warning.level[0] == 2)
    assert 'at a singularity: wrist: sin(q5) = ' in told
    assert 'at a singularity: shoulder' in told


# Bags


@pytest.mark.parametrize('bag', ['rad_ur3e_mcap', 'rad_ur3e_sqlite3'])
def test_a_bag_gives_the_answers_of_its_table(rows, ur3e_file, bag):
    rosbags = pytest.importorskip('rosbags.highlevel', reason='needs rosbags')
    robot = ks.load_robot(ur3e_file)
    estimator = Estimator(robot, EstimatorSettings())
    with rosbags.AnyReader([recorded(f'derived_ros2_bags/{bag}')]) as reader:
        wanted = [c for c in reader.connections if c.topic == '/joint_states']
        for row, (connection, time, raw) in zip(rows, reader.messages(wanted)):
            message = reader.deserialize(raw, connection.msgtype)
            answer = estimator.take(sample_of(message, time))
            assert answer.stamp == row.stamp
            np.testing.assert_allclose(answer.state.q, row.q, atol=1e-8)
            assert np.linalg.norm(answer.state.position - row.position) < CALIBRATION
    assert estimator.counts[reasons.ACCEPTED] == len(rows)


def sample_of(message, time):
    stamp = message.header.stamp.sec * SECOND + message.header.stamp.nanosec
    return JointSample(
        message.name, message.position.tolist(), message.velocity.tolist(), stamp, time, time
    )


@pytest.mark.slow
def test_a_pr2s_arm_is_found_among_45_joints_and_its_pose_is_that_of_tf():
    side, y = 'l', 0.188
    rosbags = pytest.importorskip('rosbags.highlevel', reason='needs rosbags')
    robot = ks.robot_from_text(PR2.format(side=side, y=y))
    estimator = Estimator(robot, EstimatorSettings())
    poses, joints, transforms = {}, 0, {}
    with rosbags.AnyReader([recorded('pr2_jsk_ros1_bags/pr1012_deb3032.bag')]) as reader:
        wanted = [c for c in reader.connections if c.topic in ('/joint_states', '/tf')]
        for connection, time, raw in reader.messages(wanted):
            message = reader.deserialize(raw, connection.msgtype)
            if connection.topic == '/joint_states':
                joints += 1
                answer = estimator.take(sample_of(message, time))
                if isinstance(answer, EstimatorOutput):
                    poses[answer.stamp] = answer.state.pose
                continue
            for transform in message.transforms:
                stamp = transform.header.stamp
                transforms.setdefault(transform.child_frame_id, {})[
                    stamp.sec * SECOND + stamp.nanosec
                ] = transform
    assert joints == 280
    assert estimator.counts[reasons.ACCEPTED] + estimator.counts[reasons.DROPPED] == joints
    compared = 0
    for stamp, pose in poses.items():
        expected = _from_torso(transforms, f'/{side}_wrist_roll_link', stamp)
        if expected is not None:
            np.testing.assert_allclose(pose, expected, atol=1e-9)
            compared += 1
    assert compared > 50


def _from_torso(transforms, frame, stamp):
    # A moving joint's transform must be of this very stamp; a fixed one's may be of any.
    T = np.eye(4)
    while frame != '/torso_lift_link':
        of_frame = transforms[frame]
        transform = of_frame.get(stamp)
        if transform is None:
            if not frame.endswith(('upper_arm_link', 'forearm_link')):
                return None
            transform = next(iter(of_frame.values()))
        step, r = np.eye(4), transform.transform.rotation
        t = transform.transform.translation
        step[:3, :3] = quaternion_rotation(r.x, r.y, r.z, r.w)
        step[:3, 3] = t.x, t.y, t.z
        T = step @ T
        frame = transform.header.frame_id
    return T


@pytest.mark.parametrize(
    ('bag', 'beyond'),
    [
        ('C-Shape-1_joints', ('joint_4',)),
        ('ptp-trajectory', ('joint_2', 'joint_4', 'joint_6')),  # in degrees, which nothing says
    ],
)
def test_messages_without_stamps_and_velocities_are_all_answered(bag, beyond):
    rosbags = pytest.importorskip('rosbags.highlevel', reason='needs rosbags')
    robot = ks.load_robot('kuka_iiwa14')
    estimator = Estimator(robot, EstimatorSettings())
    with rosbags.AnyReader([recorded(f'dmp_ros1_bags_malformed/{bag}.bag')]) as reader:
        for connection, time, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            answer = estimator.take(sample_of(message, time))
            assert isinstance(answer, EstimatorOutput)
            assert answer.stamp == time
            assert np.all(np.isfinite(answer.state.numbers))
            singularity_of(answer.state)
    assert estimator.counts[reasons.ACCEPTED] == estimator.counts[reasons.NOT_STAMPED] == 150
    assert estimator.beyond_limits() == beyond


# Vendors' own numbers


def test_a_pandas_printed_state_is_ours(tmp_path):
    data = json.loads(recorded('vendor_reference/franka_docs_state_sample.json').read_text())
    panda = ks.load_robot('panda')
    flange_tool = np.array(data['F_T_EE']).reshape(4, 4).T
    expected = np.array(data['O_T_EE']).reshape(4, 4).T
    estimator = Estimator(panda, EstimatorSettings())
    answer = estimator.take(JointSample(panda.joint_names, data['q'], data['dq'], 1, 1, 1))
    T = answer.state.pose @ flange_tool
    np.testing.assert_allclose(T[:3, 3], expected[:3, 3], atol=3e-6)  # six digits are printed
    np.testing.assert_allclose(T[:3, :3], expected[:3, :3], atol=3e-5)
