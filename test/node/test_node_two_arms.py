# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Two arms on one network: neither hears the other."""

import contextlib
import json

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from node_process import NodeProcess
from ros_harness import START, STEP, Arm, Peer, joint_state, nanoseconds, values_of
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Trigger

import kinematics_service as ks

ROUND_OFF = 1e-12
LEFT, RIGHT = (0.1, 0.2, 0.3), (-0.5, 0.6, -0.7)


def position(message):
    p = message.pose.position
    return np.array([p.x, p.y, p.z])


def expected(q):
    return ks.forward_kinematics(ks.load_robot('craig_3r'), q)[:3, 3]


@pytest.fixture
def two(arm):
    """Return two arms in namespaces of their own, with prefixes of joints and frames."""
    return {
        side: arm(
            'craig_3r',
            ['-p', f'joint_prefix:={side}_', '-p', f'frame_prefix:={side}/'],
            namespace=f'/{side}',
        )
        for side in ('left', 'right')
    }


def test_two_arms_in_two_namespaces_answer_their_own_joints_under_their_own_names(two):
    left, right = two['left'], two['right']
    assert left.node.get_fully_qualified_name() == '/left/kinematics'
    right.poses  # noqa: B018 listens from here on
    pose = left.answer(LEFT)
    np.testing.assert_allclose(position(pose), expected(LEFT), atol=ROUND_OFF)
    assert pose.header.frame_id == 'left/base_link'
    pose = right.answer(RIGHT)
    np.testing.assert_allclose(position(pose), expected(RIGHT), atol=ROUND_OFF)
    assert pose.header.frame_id == 'right/base_link'
    assert len(left.poses) == len(right.poses) == 1
    # The columns of the Jacobian carry the prefix.
    jacobians = left.hear('jacobian', Float64MultiArray)
    left.send(LEFT)
    left.spin_until(lambda: jacobians, 'Jacobian')
    assert jacobians[0].layout.dim[1].label == 'left_q1,left_q2,left_q3'
    told = json.loads(left.call(Trigger, '/left/kinematics/describe', Trigger.Request()).message)
    assert told['frames'] == {'base': 'left/base_link', 'tool': 'left/tool0'}
    assert told['subscribes'] == '/left/joint_states'
    # Their diagnostics can be told apart.
    arrays = left.listen('/diagnostics', DiagnosticArray)

    def names():
        right.executor.spin_once(timeout_sec=0.0)
        return {array.status[0].name for array in arrays}

    left.spin_until(
        lambda: names() >= {'left/kinematics: input', 'right/kinematics: input'}, 'both arms'
    )


def shared(arm) -> dict[str, Arm]:
    return {
        side: arm(
            'craig_3r',
            ['-p', f'joint_prefix:={side}_', '-r', 'joint_states:=/joint_states'],
            namespace=f'/{side}',
        )
        for side in ('left', 'right')
    }


def sum_of_counts(one):
    counts = one.counts()
    return int(counts['accepted']) + int(counts['ignored: none of our joints'])


def both_joints(left, right, stamp):
    names = [f'{side}_{name}' for side in ('right', 'left') for name in ('q3', 'q1', 'q2')]
    order = (2, 0, 1)
    q = [right[i] for i in order] + [left[i] for i in order]
    return joint_state(names, q, (), stamp)


def test_two_arms_share_one_topic_and_one_message(arm):
    arms = shared(arm)
    poses = {side: one.hear('pose', PoseStamped) for side, one in arms.items()}
    publisher = arms['left'].speaker('/joint_states', listeners=2)
    for one in arms.values():
        one.await_publishers(1)
    publisher.publish(both_joints(LEFT, RIGHT, 77))
    for side, q in (('left', LEFT), ('right', RIGHT)):
        arms[side].spin_until(lambda side=side: poses[side], f'pose of the {side} arm')
        np.testing.assert_allclose(position(poses[side][0]), expected(q), atol=ROUND_OFF)
        assert nanoseconds(poses[side][0].header.stamp) == 77


def test_two_arms_share_one_topic_with_a_message_for_each(arm):
    arms = shared(arm)
    left, right = arms['left'], arms['right']
    left_poses, right_poses = left.poses, right.poses
    for one in (left, right):
        one.attach(listeners=2)
    for one in (left, right):
        one.await_publishers(2)
    for k in range(5):
        # The same stamps for both: what one arm has heard must not make the other's look old.
        stamp = 1000 + k
        left.send(LEFT, stamp=stamp)
        right.send(RIGHT, stamp=stamp)
    left.spin_until(lambda: len(left_poses) == 5, 'poses of the left arm')
    right.spin_until(lambda: len(right_poses) == 5, 'poses of the right arm')
    for one, q in ((left, LEFT), (right, RIGHT)):
        np.testing.assert_allclose(position(one.poses[-1]), expected(q), atol=ROUND_OFF)
        one.spin_until(lambda one=one: sum_of_counts(one) == 10, 'all messages')
        values = one.counts()
        assert values['accepted'] == '5'
        assert values['ignored: none of our joints'] == '5'
        assert values['joints that publishers disagree about'] == ''


def await_publishers(peer, nodes, publishers):
    """
    Return when so many nodes of another process know so many publishers.

    They hear nothing before; and they know what the peer subscribed to before.
    """
    arrays = peer.listen('/diagnostics', DiagnosticArray)

    def are_known():
        known = {array.status[0].name: values_of(array.status[0]) for array in arrays}
        told = [values['publishers'] for values in known.values()]
        return told == [str(publishers)] * nodes

    peer.spin_until(are_known, 'publishers in the nodes')


CELL = """
cell: bench
arms:
  left: {robot: craig_3r, joint_prefix: left_}
  right: {robot: craig_3r, joint_prefix: right_, xyz: [2, 0, 0], rpy: [0, 0, pi]}
"""


def test_a_cell_has_a_node_for_each_arm_and_one_for_the_motion_between(ros_domain, tmp_path):
    file = tmp_path / 'cell.yaml'
    file.write_text(CELL)
    process = NodeProcess('--robot', f'lab={file}')
    try:
        with contextlib.closing(Peer()) as one:
            frames = {}
            for name in ('left/kinematics', 'right/kinematics', 'kinematics/relative'):
                frames[name] = one.listen(f'/lab/{name}/pose', PoseStamped)
            jacobians = one.listen('/lab/kinematics/relative/jacobian', Float64MultiArray)
            drivers = [one.speaker('/lab/joint_states', listeners=3) for _ in 'lr']
            await_publishers(one, nodes=3, publishers=2)
            both = ks.load_robot(file)
            # Two drivers in turns, with stamps of their own.
            for k, (side, q) in enumerate((('left', LEFT), ('right', RIGHT), ('left', RIGHT))):
                names = [f'{side}_q{j}' for j in (1, 2, 3)]
                drivers[k % 2].publish(joint_state(names, q, stamp=START + k * STEP))
                one.spin_until(lambda n=k: len(frames['kinematics/relative']) >= n, 'pose')
            one.spin_until(
                lambda: (*map(len, frames.values()), len(jacobians)) == (2, 1, 2, 2), 'all answers'
            )
            ((_, first), *_) = [(name, found[0]) for name, found in frames.items()]
            assert first.header.frame_id == 'cell'
            for pose, jacobian, q in zip(
                frames['kinematics/relative'], jacobians, ((*LEFT, *RIGHT), (*RIGHT, *RIGHT))
            ):
                assert pose.header.frame_id == 'left_tool0'
                T = ks.forward_kinematics(both, q)
                np.testing.assert_allclose(position(pose), T[:3, 3], atol=ROUND_OFF)
                J = np.reshape(jacobian.data, (6, 6))
                np.testing.assert_allclose(J, ks.jacobian(both, q), atol=ROUND_OFF)
                labels = jacobian.layout.dim[1].label
                assert labels == ','.join(both.joint_names)
            # It has the stamp of the newest message; what is older of the other arm is told.
            stamp = frames['kinematics/relative'][-1].header.stamp
            assert nanoseconds(stamp) == START + 2 * STEP
    finally:
        process.kill()
