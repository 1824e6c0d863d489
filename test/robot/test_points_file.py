# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Points in a robot file: what is read, what is refused, what `check` and a URDF say of them."""

from xml.etree import ElementTree

import numpy as np
import pytest
from refusal import places

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.robot.file.parts.parameters import SIX, end_parameters
from kinematics_service.robot.robot import with_tool

# Of millimetres and metres.
ROUND_OFF = 1e-12

ARM = """\
robot: seen
source: made up to have points
convention: standard
units: {angle: deg, length: mm}
constants: {L1: 400, L2: 300}
joints:
  - {name: q1, type: revolute, limits: [-180, 180]}
  - {name: q2, type: revolute, limits: [-120, 120]}
  - {name: q3, type: revolute, limits: [-120, 120]}
links:
  - {a: 0, alpha: 90, d: L1, theta: q1}
  - {a: L2, alpha: 0, d: 0, theta: q2}
  - {a: L2, alpha: 0, d: 0, theta: q3}
tool: {xyz: [0, 0, 100]}
points:
  elbow: {row: 2}
  camera: {row: 3, xyz: [0, L1/8, 100], rpy: [0, -90, 0]}
  plate: {row: 0, xyz: [0, 0, L1/2]}
"""


def test_points_are_read_in_the_units_of_the_file():
    points = ks.robot_from_text(ARM).description.points
    assert [(point.name, point.row) for point in points] == [
        ('elbow', 2),
        ('camera', 3),
        ('plate', 0),
    ]
    camera = points[1].motion
    assert camera.matrix[:3, 3].tolist() == [0.0, 0.05, 0.1]
    np.testing.assert_allclose(
        camera.matrix[:3, :3], [[0, 0, -1], [0, 1, 0], [1, 0, 0]], rtol=0, atol=1e-15
    )
    assert camera.texts == ('0', 'L1/8', '100', '0', '-90', '0')
    assert not camera.matrix.flags.writeable


def test_the_tool_is_a_point_of_every_arm():
    assert ks.robot_from_text(ARM).points == ('tool', 'elbow', 'camera', 'plate')
    assert ks.load_robot('puma560').points == ('tool',)


def test_known_poses_are_of_the_tool_of_the_file():
    robot = ks.load_robot('puma560')
    assert robot.description.known_poses
    assert with_tool(robot, (0.0, 0.0, 0.1)).description.known_poses == ()


REFUSED = {
    'elbow: {row: 4}': ('points.elbow.row', 'out-of-range', '4'),
    'elbow: {row: 1.5}': ('points.elbow.row', 'not-a-number', "'1.5'"),
    'elbow: {row: -1}': ('points.elbow.row', 'not-a-number', "'-1'"),
    'elbow: {row: q2}': ('points.elbow.row', 'not-a-number', "'q2'"),
    'elbow: {}': ('points.elbow', 'missing-key', "'row'"),
    'elbow: 2': ('points.elbow', 'wrong-type', "'2'"),
    'elbow: {row: 2, xyz: [0, 1]}': ('points.elbow.xyz', 'wrong-length', '2'),
    'elbow: {row: 2, xyz: [0, q1, 0]}': ('points.elbow.xyz[1]', 'not-constant', "'q1'"),
    'elbow: {row: 2, position: [0, 0, 1]}': ('points.elbow.position', 'unknown-key', "'xyz'?"),
    'tool: {row: 2}': ('points.tool', 'reserved-name', "'tool'"),
    'base: {row: 2}': ('points.base', 'reserved-name', "'base'"),
    'tool0: {row: 2}': ('points.tool0', 'duplicate-name', "'tool0'"),
    '2nd: {row: 2}': ("points['2nd']", 'wrong-name', "'2nd'"),
    'fore__arm: {row: 2}': ('points.fore__arm', 'wrong-name', "'fore__arm'"),
    'fore-arm: {row: 2}': ("points['fore-arm']", 'wrong-name', "'fore-arm'"),
}


@pytest.mark.parametrize('entry', REFUSED)
def test_a_point_that_cannot_be_is_a_fault(entry):
    where, code, word = REFUSED[entry]
    with pytest.raises(ks.RobotFileError) as refusal:
        ks.robot_from_text(ARM.replace('elbow: {row: 2}', entry))
    assert places(refusal.value) == [(16, where, code)]
    assert word in str(refusal.value)


def test_points_that_are_no_mapping_are_a_fault():
    text = ARM[: ARM.index('points:')] + 'points: [elbow]\n'
    with pytest.raises(ks.RobotFileError) as refusal:
        ks.robot_from_text(text)
    assert places(refusal.value) == [(15, 'points', 'wrong-type')]


def test_the_rows_of_points_are_judged_beside_a_broken_row():
    with pytest.raises(ks.RobotFileError) as refusal:
        ks.robot_from_text(ARM.replace('theta: q3', 'theta: q4').replace('row: 2', 'row: 9'))
    places = [fault.where for fault in refusal.value.faults]
    assert 'links[2].theta' in places
    assert sum(place.startswith('points') for place in places) == 1


def test_a_constant_of_a_point_is_used():
    text = ARM.replace('L1: 400', 'L1: 400, bracket: 20').replace(
        '[0, 0, L1/2]', '[0, 0, bracket]'
    )
    assert ks.robot_from_text(text).description.warnings == ()
    assert ks.robot_from_text(ARM.replace('L1: 400', 'L1: 400, no: 1')).description.warnings


def test_check_prints_the_points(tmp_path, capsys):
    file = tmp_path / 'seen.yaml'
    file.write_text(ARM)
    assert main(['check', str(file)]) == 0
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]
    at = lines.index('points       elbow, at the frame after row 2')
    assert lines[at + 1 : at + 3] == [
        'camera, at the frame after row 3, xyz (0, L1/8, 100) rpy (0, -90, 0)',
        "plate, at the table's frame 0, xyz (0, 0, L1/2)",
    ]


def test_a_point_is_a_leaf_of_the_urdf_and_the_tool_is_the_last_one():
    root = ElementTree.fromstring(ks.export_urdf(ks.robot_from_text(ARM)))
    joints = {joint.find('child').get('link'): joint for joint in root.iter('joint')}
    parents = {joints[name].find('parent').get('link') for name in ('camera', 'tool0')}
    assert parents == {'seen_frame_3'}
    assert joints['elbow'].find('parent').get('link') == 'seen_frame_2'
    assert joints['camera'].find('origin').get('xyz') == '0 0.05 0.1'
    assert list(joints)[-1] == 'tool0'


def test_a_chain_is_imported_back_to_its_tool_and_to_a_point():
    robot = ks.robot_from_text(ARM)
    text, q = ks.export_urdf(robot), [0.3, -0.5, 0.9]
    for tip, of in (('tool0', 'tool'), ('camera', 'camera')):
        again = ks.import_urdf(text, 'base_link', tip).robot
        np.testing.assert_allclose(
            ks.forward_kinematics(again, q),
            ks.forward_kinematics(robot, q, of=of),
            rtol=0,
            atol=1e-12,
        )
        assert again.points == ('tool',)


@pytest.mark.parametrize(
    ('of', 'place', 'texts'),
    [
        ('camera', [0.1, -0.02, 0.003], ('-3.0', '30.0', '200.0', '0', '-90', '0')),
        ('tool', [0.1, -0.02, 0.003], ('100.0', '-20.0', '103.0', '0', '0', '0')),
    ],
)
def test_an_arm_that_ends_at_a_place_has_it_in_the_units_of_its_file(of, place, texts):
    # The exact derivation reads the texts, the kernel the matrix.
    robot = ks.robot_from_text(ARM)
    moved = robot.ending_at(of, place)
    assert [float(one) for one in moved.description.tool.motion.texts] == pytest.approx(
        [float(one) for one in texts], abs=ROUND_OFF
    )
    before = robot.ending_at(of)
    q = [0.3, -0.4, 1.2]
    expected = ks.forward_kinematics(before, q) @ [*place, 1.0]
    found = ks.forward_kinematics(moved, q)
    np.testing.assert_allclose(found[:3, 3], expected[:3], rtol=0, atol=ROUND_OFF)
    np.testing.assert_allclose(
        found[:3, :3], ks.forward_kinematics(before, q)[:3, :3], rtol=0, atol=ROUND_OFF
    )


def test_base_and_tool_have_three_lengths_and_three_angles_each():
    first, second = end_parameters('tool', 0), end_parameters('tool', 1)
    assert [one.name for one in first] == [f'tool.{name}' for name in SIX]
    assert [one.name for one in second] == [f'tool2.{name}' for name in SIX]
    assert [one.place for one in second] == list(SIX)
    assert [one.angle for one in first] == 3 * [False] + 3 * [True]
