# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""A robot's URDF against readers that nobody here wrote: Pinocchio and yourdfpy."""

import io
import logging
import math
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from arms import BUNDLED, DISTINCT_BUNDLED, RANDOM, poses, robot_of
from tolerances import ROUND_OFF

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.rigid_motion import exact_rpy, pose_of
from kinematics_service.robot.urdf.elements import FrameNames

HELICAL = """\
robot: screws
convention: standard
joints:
  - {name: turn/1, variable: q1, type: revolute, limits: [-1, 2], velocity: 3}
  - {name: q2, type: helical}
  - {name: q3, type: helical, limits: [-2, 2]}
links:
  - {a: 0.3, alpha: pi/3, d: 0.1, theta: 0.5*q1 + 0.2}
  - {a: 0.2, alpha: 1, d: 0.05*q2, theta: 1 - q2}
  - {a: 0, alpha: 0, d: 0.01*q3 - 0.02*q2, theta: q3/3}
"""


def positions(robot, count=4):
    """
    Return positions of every kind, those of joints without limits short of half a turn.

    Pinocchio keeps a joint without limits as (cos, sin), so a joint that follows it by half its
    angle loses whole turns.
    """
    q = poses(robot, count)
    return q[np.abs(q).max(axis=1) < 3.1]


def uniform(robot, count):
    """Return positions drawn inside the limits."""
    low, high = np.clip(robot.limits, -np.pi, np.pi).T
    return np.random.default_rng(1).uniform(low, high, (count, robot.dof))


def in_pinocchio(text):
    pinocchio = pytest.importorskip('pinocchio')
    model = pinocchio.buildModelFromXML(text, True)
    data = model.createData()

    def frame_poses(robot, q, frames):
        whole = pinocchio.neutral(model)
        for name, value in zip(robot.joint_names, q):
            joint = model.joints[model.getJointId(name)]
            values = [np.cos(value), np.sin(value)] if joint.nq == 2 else value
            whole[joint.idx_q : joint.idx_q + joint.nq] = values
        pinocchio.framesForwardKinematics(model, data, whole)
        base = data.oMf[model.getFrameId(robot.base_frame)].homogeneous
        assert np.array_equal(base, np.eye(4))
        return np.array([data.oMf[model.getFrameId(name)].homogeneous for name in frames])

    return frame_poses


def in_yourdfpy(text):
    yourdfpy = pytest.importorskip('yourdfpy')
    logging.getLogger('yourdfpy').setLevel(logging.ERROR)
    model = yourdfpy.URDF.load(io.StringIO(text), load_meshes=False)

    def frame_poses(robot, q, frames):
        model.update_cfg({name: np.array([x]) for name, x in zip(robot.joint_names, q)})
        return np.array([model.get_transform(name, robot.base_frame) for name in frames])

    return frame_poses


READERS = {'pinocchio': in_pinocchio, 'yourdfpy': in_yourdfpy}


def compare(robot, reader, count=2):
    frame_poses = READERS[reader](ks.export_urdf(robot))
    frames = [f'{robot.name}_frame_{i}' for i in range(robot.rows + 1)]
    # trimesh, below yourdfpy, takes what is 1e-8 from the identity for it: no poses near zero.
    for q in positions(robot, count) if reader == 'pinocchio' else uniform(robot, count):
        found = frame_poses(robot, q, [*frames, robot.tool_frame])
        expected = np.concatenate([ks.link_frames(robot, q), [ks.forward_kinematics(robot, q)]])
        np.testing.assert_allclose(found, expected, rtol=0, atol=ROUND_OFF)


@pytest.mark.slow
@pytest.mark.peers
@pytest.mark.parametrize('name', DISTINCT_BUNDLED)
def test_bundled_robots_are_the_same_to_another_reader(name):
    compare(robot_of(name), 'pinocchio')


@pytest.mark.slow
@pytest.mark.peers
@pytest.mark.parametrize('name', ['parallelogram_left'])
def test_bundled_robots_are_the_same_to_a_third_reader(name):
    compare(robot_of(name), 'yourdfpy', count=1)


@pytest.mark.slow
@pytest.mark.peers
@pytest.mark.parametrize('name', RANDOM[::13])
def test_random_arms_are_the_same_to_other_readers(name):
    compare(robot_of(name), 'yourdfpy', count=1)


@pytest.mark.slow
@pytest.mark.peers
@pytest.mark.parametrize('reader', READERS)
def test_gears_and_screws_are_joints_that_mimic(reader):
    robot = ks.robot_from_text(HELICAL)
    compare(robot, reader)


def test_a_gear_a_screw_and_a_coupled_row_each_have_one_joint_of_the_arm():
    root = ElementTree.fromstring(ks.export_urdf(ks.robot_from_text(HELICAL)))
    joints = {joint.get('name'): joint for joint in root.iter('joint')}
    actuated = [
        name
        for name, joint in joints.items()
        if joint.get('type') != 'fixed' and joint.find('mimic') is None
    ]
    assert actuated == ['turn/1', 'q2', 'q3']
    mimics = {name: joint.find('mimic') for name, joint in joints.items()}
    told = [
        (name, joints[name].get('type'), mimic.get('joint'), float(mimic.get('multiplier')))
        for name, mimic in mimics.items()
        if mimic is not None
    ]
    assert told == [
        ('turn/1_in_row_1', 'revolute', 'turn/1', -0.5),
        ('q2_in_row_2', 'prismatic', 'q2', 0.05),
        ('q3_in_row_3', 'revolute', 'q3', 1 / 3 - 1),
        ('q2_in_row_3', 'prismatic', 'q2', -0.02),
        ('q3_in_row_3_', 'prismatic', 'q3', 0.01),
    ]
    limit = joints['turn/1'].find('limit').attrib
    assert limit == {'lower': '-1', 'upper': '2', 'effort': '1000000', 'velocity': '3'}


def test_frames_and_joints_take_other_names_and_prefixes():
    names = FrameNames(base='world', frame_prefix='left/')
    robot = replace(robot_of('planar_2r'), joint_names=('left_q1', 'left_q2'))
    root = ElementTree.fromstring(ks.export_urdf(robot, names))
    links = [link.get('name') for link in root.iter('link')]
    assert links[0] == 'left/world'
    assert links[-1] == 'left/tool0'
    assert all(link.startswith('left/') for link in links)
    assert {'left_q1', 'left_q2'} <= {joint.get('name') for joint in root.iter('joint')}


def test_names_and_sources_that_xml_would_misread_are_kept():
    text = """\
robot: odd
source: "a -- b --- <c> & 'd'-"
convention: standard
joints: [{name: 'j<&>"1', variable: q, type: revolute}]
links: [{a: 1, alpha: 0, d: 0, theta: q}]
base: {frame: odd_frame_0}
tool: {frame: odd_frame_1}
"""
    robot = ks.robot_from_text(text)
    root = ElementTree.fromstring(ks.export_urdf(robot))
    links = [link.get('name') for link in root.iter('link')]
    assert len(set(links)) == len(links)
    assert 'j<&>"1' in [joint.get('name') for joint in root.iter('joint')]
    compare(robot, 'pinocchio')


def test_every_link_but_the_frames_has_something_to_see_and_nothing_invented():
    for name in BUNDLED:
        root = ElementTree.fromstring(ks.export_urdf(robot_of(name)))
        assert len(list(root.iter('visual'))) > robot_of(name).dof
        assert root.find('.//inertial') is None
        assert root.find('.//collision') is None
        for shape in (*root.iter('cylinder'), *root.iter('sphere')):
            assert all(0.0 < float(size) < 10.0 for size in shape.attrib.values())


def test_roll_pitch_yaw_lose_nothing_near_a_right_angle_of_pitch():
    random = np.random.default_rng(3)
    for away in (0.0, 1e-17, 1e-16, 1e-15, 1e-12, 1e-9, 1e-8, 1e-3, 1.0):
        for sign in (1.0, -1.0):
            roll, yaw = random.uniform(-math.pi, math.pi, 2)
            R = pose_of([0, 0, 0], (roll, sign * (math.pi / 2 - away), yaw))[:3, :3]
            again = pose_of([0, 0, 0], exact_rpy(R))[:3, :3]
            np.testing.assert_allclose(again, R, rtol=0, atol=1e-15)


@pytest.mark.slow
def test_the_command_writes_a_file_or_the_screen(capsys, tmp_path):
    path = tmp_path / 'arm.urdf'
    assert main(['export', 'planar_2r', '--urdf', str(path)]) == 0
    assert capsys.readouterr().out == f'wrote {path}: planar_2r, 7 links, 6 joints\n'
    assert main(['export', 'planar_2r', '--urdf', '-']) == 0
    assert capsys.readouterr().out == path.read_text() == ks.export_urdf(robot_of('planar_2r'))
    assert main(['export', 'planar_2r', '--urdf', '/no/folder/arm.urdf']) == 1
    assert capsys.readouterr().err == (
        '/no/folder/arm.urdf: cannot be written: No such file or directory\n'
    )
    assert main(['export', 'nobody', '--urdf', '-']) == 2
