# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Poses of a bag as a second source: stamped poses, points, transforms, and one frame of /tf."""

import functools
import json

import numpy as np
import pytest
from arms import robot_of
from audits import header, joint_states, quaternions, write_bag
from recordings import motion, samples_of
from refused_files import refuse

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.recordings.readers.open_file import open_source
from kinematics_service.apps.recordings.readers.source import Selection

UR = robot_of('ur5e')
SAMPLES = samples_of(UR, *motion(UR, 30))
T = ks.forward_kinematics(UR, np.array([one.positions for one in SAMPLES]))
ROUND_OFF = 1e-12
MESSAGES = 'geometry_msgs/msg/'


def poses(store, kind, children=('tool0_controller',)):
    types = store.types

    def placed(row, vector):
        quaternion = types[f'{MESSAGES}Quaternion'](*row[3:])
        return types[f'{MESSAGES}{vector}'](*row[:3]), quaternion

    for one, row in zip(SAMPLES, quaternions(T).tolist()):
        head = header(store, one.stamp, 'base')
        point, quaternion = placed(row, 'Point')
        transform = types[f'{MESSAGES}Transform'](*placed(row, 'Vector3'))
        stamped = types[f'{MESSAGES}TransformStamped']
        if kind == 'TransformStamped':
            yield '/pose', MESSAGES + kind, one.stamp, stamped(head, children[0], transform)
        elif kind == 'TFMessage':
            tf = [stamped(head, child, transform) for child in children]
            message = types['tf2_msgs/msg/TFMessage'](tf)
            yield '/pose', 'tf2_msgs/msg/TFMessage', one.stamp, message
        else:
            pose = types[f'{MESSAGES}Pose'](point, quaternion)
            content = point if kind == 'PointStamped' else pose
            yield '/pose', MESSAGES + kind, one.stamp, types[MESSAGES + kind](head, content)


@pytest.fixture(scope='module')
def bag_of(tmp_path_factory):
    """Return a function that returns a bag with poses of a type, written once."""
    typesys = pytest.importorskip('rosbags.typesys', reason='needs rosbags')
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)

    @functools.cache
    def bag_of(kind, children):
        messages = [*joint_states(store, SAMPLES), *poses(store, kind, children or ('tcp',))]
        return write_bag(tmp_path_factory.mktemp(kind) / 'bag', store, messages)

    return bag_of


@pytest.mark.parametrize(
    ('kind', 'children', 'topic', 'code', 'words'),
    [
        ('PoseStamped', (), '/pose', '', ()),
        ('PointStamped', (), '/pose', '', ()),
        ('TransformStamped', ('tcp',), '/pose', '', ()),
        ('TFMessage', ('tcp',), '/pose', '', ()),
        ('TFMessage', ('camera', 'tcp'), '/pose:tcp', '', ()),
        ('TFMessage', ('camera', 'tcp'), '/pose', 'ambiguous', ('camera', 'tcp', '--pose-topic')),
        ('TFMessage', ('tcp',), '/pose:tool', 'unknown-name', ('tcp in base',)),
        ('PoseStamped', (), '/pose:tool', 'wrong-type', ('geometry_msgs/msg/PoseStamped',)),
        ('PoseStamped', (), '/joint_states', 'wrong-type', ('/joint_states', 'on /pose')),
        ('PoseStamped', (), '/nothing', 'unknown-name', ('/nothing', 'on /pose')),
    ],
)
def test_each_type_of_pose(bag_of, kind, children, topic, code, words):
    bag = bag_of(kind, children)
    if code:
        refuse(bag, code, *words, robot='ur5e', pose_topic=topic)
        return
    with open_source(bag, Selection(UR, pose_topic=topic)) as source:
        list(source.blocks)
        track = source.poses()
    assert track.frame == 'base'
    assert track.stamps.tolist() == [one.stamp for one in SAMPLES]
    assert track.poses[:, :3, 3] == pytest.approx(T[:, :3, 3], abs=ROUND_OFF)
    turned = np.eye(3) if track.positions else T[:, :3, :3]
    assert track.positions == (kind == 'PointStamped')
    assert np.max(np.abs(track.poses[:, :3, :3] - turned)) < ROUND_OFF


def test_points_of_a_bag_calibrate_an_arm(bag_of, capsys):
    bag = bag_of('PointStamped', ())
    options = ('--robot', 'ur5e', '--fit', 'offsets,base,tool', '--json', '-')
    command = ['calibrate', str(bag), *options]
    assert main([*command, '--pose-topic', '/pose']) == 0
    document = json.loads(capsys.readouterr().out)
    assert document['positions_only']
    # Positions leave theta1 to the base, and theta6 to the tool.
    assert (document['known'], document['possible']) == (13, 13)
    assert main(command) == 1
    assert 'poses are on /pose' in capsys.readouterr().err


def test_tf_of_a_ros1_bag(tmp_path):
    rosbag1 = pytest.importorskip('rosbags.rosbag1', reason='needs rosbags')
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store, name = get_typestore(Stores.ROS1_NOETIC), 'tf2_msgs/msg/TFMessage'
    store.register(get_types_from_msg('geometry_msgs/TransformStamped[] transforms', name))
    types = store.types
    head = types['std_msgs/msg/Header'](0, types['builtin_interfaces/msg/Time'](5, 0), 'base')
    moved = types[f'{MESSAGES}Transform'](
        types[f'{MESSAGES}Vector3'](1.0, 2.0, 3.0), types[f'{MESSAGES}Quaternion'](0, 0, 0, 1)
    )
    transform = types[f'{MESSAGES}TransformStamped'](head, 'tool0_controller', moved)
    numbers = np.zeros(6), np.zeros(0), np.zeros(0)
    state = types['sensor_msgs/msg/JointState'](head, list(UR.joint_names), *numbers)
    with rosbag1.Writer(tmp_path / 'run.bag') as writer:
        for topic, kind, message in (
            ('/joint_states', 'sensor_msgs/msg/JointState', state),
            ('/tf', name, types[name]([transform])),
        ):
            connection = writer.add_connection(topic, kind, typestore=store)
            writer.write(connection, 5 * 10**9, store.serialize_ros1(message, kind))
    with open_source(tmp_path / 'run.bag', Selection(UR, pose_topic='/tf')) as source:
        list(source.blocks)
        assert source.poses().poses[0, :3, 3].tolist() == [1.0, 2.0, 3.0]
