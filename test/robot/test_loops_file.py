# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Loops in a robot file: what is read, what is refused, what `check` and a URDF say of them."""

from xml.etree import ElementTree

import numpy as np
import pytest

import kinematics_service as ks
from kinematics_service.__main__ import main

ARM = """\
robot: five_bar
source: made up to have a loop
convention: standard
constants: {D: 0.3, near: 0.25, far: 0.4}
joints:
  - {name: left,  variable: q1, type: revolute}
  - {name: right, variable: q2, type: revolute}
links:
  - {alpha: 0, a: near, d: 0, theta: q1}
  - {alpha: 0, a: far,  d: 0, theta: psi1}
loops:
  - name: rods
    passive: [psi1, psi2]
    from: {row: 0, xyz: [D, 0, 0]}
    links:
      - {alpha: 0, a: near, d: 0, theta: q2}
      - {alpha: 0, a: far,  d: 0, theta: psi2}
    meets: {row: 2}
    rows: [x, y]
    assembled: {q: [2*pi/3, pi/3], psi1: -1.27, psi2: 1.27}
"""

SECOND = """\
  - name: again
    passive: [{names}]
    links: [{{alpha: 0, a: far, d: 0, theta: {theta}}}]
    meets: {{row: 1}}
    rows: [x, y]
    assembled: {{q: [2*pi/3, pi/3], {values}}}
"""

# One slip each: the text, what is written instead, and the key, code and word of the fault.
REFUSED = [
    (
        'psi1: -1.27, psi2: 1.27}',
        'psi1: 0.3, psi2: 1.27}',
        'loops[0].assembled',
        'open-loop',
        '0.572',
    ),
    (
        'passive: [psi1, psi2]',
        'passive: [psi1, psi2, psi3]',
        'loops[0].passive',
        'wrong-length',
        '3',
    ),
    ('rows: [x, y]', 'rows: [x, y, rz]', 'loops[0].passive', 'wrong-length', '2'),
    ('rows: [x, y]', 'rows: [x, yaw]', 'loops[0].rows[1]', 'unknown-name', "'yaw'"),
    ('meets: {row: 2}', 'meets: {row: 3}', 'loops[0].meets.row', 'out-of-range', '3'),
    (
        'meets: {row: 2}',
        'meets: {point: wrist}',
        'loops[0].meets.point',
        'unknown-name',
        "'wrist'",
    ),
    ('meets: {row: 2}', 'meets: {xyz: [0, 0, 0]}', 'loops[0].meets', 'missing-key', ''),
    (
        'from: {row: 0, xyz: [D, 0, 0]}',
        'from: {row: 2, xyz: [D, 0, 0]}',
        'loops[0].passive',
        'no-effect',
        "'psi1'",
    ),
    (
        'assembled: {q: [2*pi/3, pi/3]',
        'assembled: {q: [2*pi/3]',
        'loops[0].assembled.q',
        'wrong-length',
        '1',
    ),
    (
        'assembled: {q: [2*pi/3, pi/3], psi1: -1.27, ',
        'assembled: {q: [2*pi/3, pi/3], ',
        'loops[0].assembled',
        'missing-key',
        "'psi1'",
    ),
    (
        'passive: [psi1, psi2]',
        'passive: [psi1, q1]',
        'loops[0].passive[1]',
        'duplicate-name',
        "'q1'",
    ),
    ('theta: psi1}', 'theta: 0}', 'loops[0].passive', 'no-effect', "'psi1'"),
    ('loops:\n', 'uncertainty: {encoder_noise: 1e-4}\nloops:\n', 'uncertainty', 'unsupported', ''),
]


def faults(text):
    with pytest.raises(ks.RobotFileError) as caught:
        ks.robot_from_text(text, 'arm.yaml')
    return caught.value.faults


def fault(text, *place):
    """Return the message of the fault with a line, key and code."""
    (message,) = (one.message for one in faults(text) if (one.line, one.where, one.code) == place)
    return message


@pytest.mark.parametrize(('there', 'instead', 'where', 'code', 'word'), REFUSED)
def test_one_slip_is_said_with_its_place(there, instead, where, code, word):
    assert ARM.count(there) == 1
    found = faults(ARM.replace(there, instead))
    assert any((one.where, one.code) == (where, code) and word in one.message for one in found), (
        found
    )
    assert found[0].line > 10


@pytest.mark.parametrize('name', ['checks', 'noun'])
def test_a_passive_joint_may_have_any_name(name):
    (loop,) = ks.robot_from_text(ARM.replace('psi1', name)).description.loops
    assert loop.passive[0].name == name
    assert loop.assembled == (-1.27, 1.27)


def test_two_loops_over_one_joint():
    text = ARM + SECOND.format(names='psi2, psi4', theta='psi4', values='psi2: 1, psi4: 1')
    message = fault(text, 22, 'loops[1].passive[0]', 'duplicate-name')
    assert "'psi2'" in message
    assert 'loops[0]' in message


def test_a_loop_may_not_use_the_joints_of_a_later_one():
    text = ARM.replace('theta: psi2', 'theta: psi2 + psi3')
    text += SECOND.format(names='psi3, psi4', theta='psi3 + psi4', values='psi3: 1, psi4: 1')
    message = fault(text, 15, 'loops[0].links', 'wrong-order')
    assert "'psi3'" in message
    assert 'loops[1]' in message


def test_a_loop_that_moves_nothing_is_refused():
    text = ARM + SECOND.format(names='psi3, psi4', theta='psi3 + psi4', values='psi3: 1, psi4: 1')
    assert "'psi3' or 'psi4'" in fault(text, 22, 'loops[1].passive', 'no-effect')


def test_a_flat_loop_is_refused():
    # The rods in one line: the elbows are as far apart as both are long.
    text = ARM.replace('far: 0.4', 'far: 0.15').replace('near: 0.25', 'near: 0.25')
    text = text.replace(
        'q: [2*pi/3, pi/3], psi1: -1.27, psi2: 1.27', 'q: [pi/2, pi/2], psi1: -pi/2, psi2: pi/2'
    )
    assert 'psi1, psi2 is 0' in fault(text, 20, 'loops[0].assembled', 'flat-loop')


def test_rows_of_another_plane_are_refused():
    text = ARM.replace('rows: [x, y]', 'rows: [x, z]')
    assert 'moves z;' in fault(text, 20, 'loops[0].rows', 'no-effect')


def test_rotations_that_are_named_in_part_must_be_parallel():
    text = """\
robot: skew
convention: elementary
joints:
  - {name: q, type: revolute}
links: [Rz(q), Tx(1), Rz(psi)]
loops:
  - name: skew
    passive: [psi]
    links: [Rz(2*q), Rx(0.3)]
    meets: {row: 3}
    rows: [rz]
    assembled: {q: [0], psi: 0}
"""
    message = fault(text, 12, 'loops[0].rows', 'missing-rows')
    assert 'about rx' in message
    assert 'only rz' in message


def test_a_loop_through_rotations_alone():
    # psi + q = 2 q where both ends are to be parallel.
    text = """\
robot: gear
convention: elementary
joints:
  - {name: q, type: revolute}
links: [Rz(q), Tx(1), Rz(psi), Tx(1)]
loops:
  - name: gear
    passive: [psi]
    links: [Rz(2*q)]
    meets: {row: 3}
    rows: [rz]
    assembled: {q: [0], psi: 0}
"""
    robot = ks.robot_from_text(text)
    assert ks.evaluate(robot, [0.4]).closure.passive == pytest.approx([0.4], abs=1e-12)


def test_factors_do_not_know_passive_joints():
    text = ARM + 'singularity: {factors: [{name: elbow, expression: sin(psi1)}]}\n'
    place = (21, 'singularity.factors[0].expression', 'unknown-name')
    assert "'psi1'" in fault(text, *place)


def test_check_tells_how_a_loop_closes(capsys):
    assert main(['check', 'five_bar']) == 0
    text = capsys.readouterr().out
    assert 'rods moves psi1 = -1.2' in text
    assert '2 rows, 2 passive joints' in text
    assert 'other branches there: psi1 = -2.' in text
    assert '2 degrees of freedom' in text


def test_a_urdf_says_that_it_has_no_loops(capsys, tmp_path):
    file = tmp_path / 'arm.urdf'
    assert main(['export', 'four_bar_arm', '--urdf', str(file)]) == 0
    said = capsys.readouterr().err
    assert "'four_bar'" in said
    assert 'psi1' in said
    root = ElementTree.parse(file).getroot()
    joints = {joint.get('name'): joint.get('type') for joint in root.iter('joint')}
    assert joints['psi1'] == 'revolute' or joints['psi1'] == 'continuous'
    assert said.strip() in file.read_text(encoding='utf-8')


@pytest.mark.slow
@pytest.mark.parametrize('name', ['five_bar', 'four_bar_arm', 'crank_slider'])
def test_inverse_kinematics_goes_through_the_loop(name):
    robot = ks.load_robot(name)
    for pose in robot.description.known_poses[:1]:
        place = pose.motion.matrix[:3, 3]
        result = ks.inverse_kinematics(robot, place, rows=robot.singularity.task.rows)
        assert result.solutions
        for solution in result.solutions:
            found = ks.forward_kinematics(robot, solution.q)[:3, 3]
            np.testing.assert_allclose(found, place, rtol=0, atol=1e-6)
        away = [
            np.max(np.abs(np.sin(0.5 * (one.q - np.array(pose.q))))) for one in result.solutions
        ]
        assert min(away) < 1e-5
