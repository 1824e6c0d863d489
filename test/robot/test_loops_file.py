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

# One slip each: what stands there, what is written instead, and what is said.
REFUSED = [
    (
        'psi1: -1.27, psi2: 1.27}',
        'psi1: 0.3, psi2: 1.27}',
        'loops[0].assembled: the loop does not close here: its ends are apart by x 0.572, y '
        "0.0218 (m, rad), and Newton's method finds no closed position nearby",
    ),
    (
        'passive: [psi1, psi2]',
        'passive: [psi1, psi2, psi3]',
        'loops[0].passive: 3 passive joints (psi1, psi2, psi3) for 2 rows that coincide (x y): a '
        'loop moves as many joints as it has rows',
    ),
    (
        'rows: [x, y]',
        'rows: [x, y, rz]',
        'loops[0].passive: 2 passive joints (psi1, psi2) for 3 rows that coincide (x y rz): a '
        'loop moves as many joints as it has rows',
    ),
    (
        'rows: [x, y]',
        'rows: [x, yaw]',
        "loops[0].rows[1]: unknown row 'yaw' (accepted: x, y, z, rx, ry, rz)",
    ),
    (
        'meets: {row: 2}',
        'meets: {row: 3}',
        'loops[0].meets.row: there is no row 3: 0 is the frame before the table, 2 the frame '
        'after its last row',
    ),
    (
        'meets: {row: 2}',
        'meets: {point: wrist}',
        "loops[0].meets.point: unknown point 'wrist' (known: none)",
    ),
    (
        'meets: {row: 2}',
        'meets: {xyz: [0, 0, 0]}',
        'loops[0].meets: needs a row of the table, or a point',
    ),
    (
        'from: {row: 0, xyz: [D, 0, 0]}',
        'from: {row: 2, xyz: [D, 0, 0]}',
        "loops[0].passive: 'psi1' moves no row of this loop: neither one of links, nor one of the "
        'table between row 2 and row 2',
    ),
    (
        'assembled: {q: [2*pi/3, pi/3]',
        'assembled: {q: [2*pi/3]',
        'loops[0].assembled.q: 1 values for 2 joints',
    ),
    (
        'assembled: {q: [2*pi/3, pi/3], psi1: -1.27, ',
        'assembled: {q: [2*pi/3, pi/3], ',
        "loops[0].assembled: the key 'psi1' is missing (an assembly needs: q, psi1, psi2)",
    ),
    (
        'passive: [psi1, psi2]',
        'passive: [psi1, q1]',
        "loops[0].passive[1]: 'q1' is also the name of a constant or of a joint with a motor: a "
        'passive joint has a name of its own',
    ),
    (
        'theta: psi1}',
        'theta: 0}',
        "loops[0].passive: 'psi1' moves no row of this loop: neither one of links, nor one of the "
        'table between row 0 and row 2',
    ),
    (
        'loops:\n',
        'uncertainty: {encoder_noise: 1e-4}\nloops:\n',
        'uncertainty: is not carried through closed loops: leave it out',
    ),
]


@pytest.mark.parametrize(('there', 'instead', 'said'), REFUSED)
def test_one_slip_is_said_with_its_place(there, instead, said):
    assert ARM.count(there) == 1
    with pytest.raises(ks.RobotFileError) as caught:
        ks.robot_from_text(ARM.replace(there, instead), 'arm.yaml')
    found = [f'{fault.where}: {fault.message}' for fault in caught.value.faults]
    assert said in found, found
    assert caught.value.faults[0].line > 10


@pytest.mark.parametrize('name', ['keys', 'checks', 'noun', 'required', 'also'])
def test_a_passive_joint_may_have_any_name(name):
    (loop,) = ks.robot_from_text(ARM.replace('psi1', name)).description.loops
    assert loop.passive[0].name == name
    assert loop.assembled == (-1.27, 1.27)


def test_two_loops_over_one_joint():
    text = ARM + SECOND.format(names='psi2, psi4', theta='psi4', values='psi2: 1, psi4: 1')
    with pytest.raises(ks.RobotFileError) as caught:
        ks.robot_from_text(text)
    assert str(caught.value).splitlines()[0] == (
        "<text>:22: loops[1].passive[0]: 'psi2' is moved by loops[0] already: a passive joint "
        'belongs to one loop'
    )


def test_a_loop_may_not_use_the_joints_of_a_later_one():
    text = ARM.replace('theta: psi2', 'theta: psi2 + psi3')
    text += SECOND.format(names='psi3, psi4', theta='psi3 + psi4', values='psi3: 1, psi4: 1')
    with pytest.raises(ks.RobotFileError) as caught:
        ks.robot_from_text(text)
    assert (
        "<text>:15: loops[0].links: 'psi3' is moved by loops[1], which comes later: a loop may "
        'use the passive joints of those before it'
    ) in str(caught.value)


def test_a_loop_that_moves_nothing_is_refused():
    text = ARM + SECOND.format(names='psi3, psi4', theta='psi3 + psi4', values='psi3: 1, psi4: 1')
    with pytest.raises(ks.RobotFileError) as caught:
        ks.robot_from_text(text)
    assert (
        "loops[1].passive: no row of the table and no later loop moves with 'psi3' or 'psi4': the "
        'loop would move nothing'
    ) in str(caught.value)


def test_a_flat_loop_is_refused():
    # The rods in one line: the elbows are as far apart as both are long.
    text = ARM.replace('far: 0.4', 'far: 0.15').replace('near: 0.25', 'near: 0.25')
    text = text.replace(
        'q: [2*pi/3, pi/3], psi1: -1.27, psi2: 1.27', 'q: [pi/2, pi/2], psi1: -pi/2, psi2: pi/2'
    )
    with pytest.raises(ks.RobotFileError) as caught:
        ks.robot_from_text(text)
    assert str(caught.value) == (
        '<text>:20: loops[0].assembled: the loop is flat at this position: det of its closure by '
        'psi1, psi2 is 0, and two of its branches meet; give a position on one branch'
    )


def test_rows_of_another_plane_are_refused():
    with pytest.raises(ks.RobotFileError) as caught:
        ks.robot_from_text(ARM.replace('rows: [x, y]', 'rows: [x, z]'))
    assert str(caught.value) == (
        '<text>:20: loops[0].rows: no passive joint of the loop moves z: name the rows of the '
        'plane in which it moves'
    )


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
    with pytest.raises(ks.RobotFileError) as caught:
        ks.robot_from_text(text)
    assert (
        'loops[0].rows: the ends are turned against each other about rx at the assembled '
        'position, and only rz is among the rows: name rx, ry and rz, or none'
    ) in str(caught.value)


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
    with pytest.raises(ks.RobotFileError) as caught:
        ks.robot_from_text(text)
    assert "unknown name 'psi1'" in str(caught.value)


def test_check_tells_how_a_loop_closes(capsys):
    assert main(['check', 'five_bar']) == 0
    text = capsys.readouterr().out
    assert 'rods moves psi1 = -1.2' in text
    assert '2 rows, 2 passive joints' in text
    assert 'other branches there: psi1 = -2.' in text
    assert '2 degrees of freedom, those of the joints' in text


def test_a_urdf_says_that_it_has_no_loops(capsys, tmp_path):
    file = tmp_path / 'arm.urdf'
    assert main(['export', 'four_bar_arm', '--urdf', str(file)]) == 0
    said = capsys.readouterr().err
    assert said.startswith("URDF has no closed loops: what closes 'four_bar' is left out.")
    root = ElementTree.parse(file).getroot()
    joints = {joint.get('name'): joint.get('type') for joint in root.iter('joint')}
    assert joints['psi1'] == 'revolute' or joints['psi1'] == 'continuous'
    assert said.strip() in file.read_text(encoding='utf-8')


@pytest.mark.slow
@pytest.mark.parametrize('name', ['five_bar', 'four_bar_arm', 'crank_slider'])
def test_inverse_kinematics_goes_through_the_loop(name):
    robot = ks.load_robot(name)
    for pose in robot.description.known_poses[:3]:
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
