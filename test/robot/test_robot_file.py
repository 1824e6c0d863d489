# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The robot-file reader: what a file says in SI units, and the place and code of each fault.
"""

import contextlib
import math
import os
import re
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusal import places

import kinematics_service as ks
from kinematics_service.errors import Fault, KinematicsError, RobotFileError
from kinematics_service.kinematics.forward import jacobian
from kinematics_service.robot.bundled import bundled_robots, find_robot_file
from kinematics_service.robot.file.parts.convention_table import CONVENTIONS
from kinematics_service.robot.file.parts.description import (
    DhRow,
    ElementaryMotion,
    KnownPose,
    RobotDescription,
    ShapeRow,
)
from kinematics_service.robot.file.reader import parse_robot, read_robot_file
from kinematics_service.robot.file.text.robot_document import read_document
from kinematics_service.robot.file.text.yaml_document import ScalarNode
from kinematics_service.robot.robot import build_robot

ROUND_OFF = 1e-15
# Of processor time, so that a busy machine changes little: the worst answer takes 0.6.
SECONDS = 2.0
BROKEN = Path(__file__).parent / 'broken_robots'

CRAIG = """\
robot: craig_3r
source: "001, table on page 1"
convention: modified
constants: {L1: 0.12, L2: 0.4, L3: 0.3}
joints:
  - {name: q1, type: revolute, limits: [-pi, pi], velocity: 2.0}
  - {name: arm-1/j.2, variable: q2, type: revolute, limits: [-pi/2, inf]}
  - {name: q3, type: revolute}
links:
  - {a: 0,  alpha: 0,     d: 0, theta: q1}
  - {a: L1, alpha: -pi/2, d: 0, theta: q2}
  - {a: L2, alpha: 0,     d: 0, theta: q3}
  - {a: L3, alpha: 0,     d: 0, theta: 0}
tool: {xyz: [0, 0, 0.1]}
known_poses:
  - {q: [0, 0, 0], xyz: [0.82, 0.1, 0], rpy: [-pi/2, 0, 0], tolerance: {rpy: 1e-3}}
"""


def minimal(joints: str, links: str, convention: str = 'standard', more: str = '') -> str:
    return (
        f'robot: minimal\nsource: a test\nconvention: {convention}\n{more}'
        f'joints:\n{joints}\nlinks:\n{links}\n'
    )


def parse(text: str) -> RobotDescription:
    return parse_robot(text, 'robot.yaml')


def refusal(text: str) -> RobotFileError:
    with pytest.raises(RobotFileError) as caught:
        parse(text)
    return caught.value


def faults(text: str) -> list[tuple[int, str, str]]:
    return places(refusal(text))


def test_craig_3r() -> None:
    robot = parse(CRAIG)
    assert (robot.name, robot.convention, robot.file) == ('craig_3r', 'modified', 'robot.yaml')
    assert [joint.name for joint in robot.joints] == ['q1', 'arm-1/j.2', 'q3']
    assert [joint.variable for joint in robot.joints] == ['q1', 'q2', 'q3']
    assert (robot.joints[0].lower, robot.joints[0].upper) == (-math.pi, math.pi)
    assert (robot.joints[1].lower, robot.joints[1].upper) == (-math.pi / 2, math.inf)
    assert (robot.joints[2].lower, robot.joints[2].upper) == (-math.inf, math.inf)
    assert [joint.velocity for joint in robot.joints] == [2.0, math.inf, math.inf]
    second = robot.links[1]
    assert isinstance(second, DhRow)
    assert (second['a'].text, second['a'].affine.constant) == ('L1', 0.12)
    assert second['alpha'].affine.constant == -math.pi / 2
    assert second['theta'].affine.coefficients == (('q2', 1.0),)
    assert (robot.base.frame, robot.tool.frame) == ('base_link', 'tool0')
    assert robot.tool.motion.texts == ('0', '0', '0.1', '0', '0', '0')
    assert robot.tool.motion.matrix[2, 3] == 0.1
    (pose,) = robot.known_poses
    assert isinstance(pose, KnownPose)
    assert pose.q == (0.0, 0.0, 0.0)
    assert (pose.tolerance_xyz, pose.tolerance_rpy) == (1e-6, 1e-3)
    assert robot.remarks == ('line 13: links[3]: no joint moves this row: it is fixed',)


def test_the_description_is_frozen_down_to_its_arrays() -> None:
    robot = parse(CRAIG)
    with pytest.raises(AttributeError):
        robot.name = 'other'  # type: ignore[misc]
    with pytest.raises(ValueError, match='read-only'):
        robot.tool.motion.matrix[0, 0] = 2.0


def test_the_same_text_gives_equal_descriptions() -> None:
    assert parse(CRAIG) == parse(CRAIG)
    assert parse(CRAIG) != parse(CRAIG.replace('0.1]', '0.2]'))
    assert hash(parse(CRAIG).tool) == hash(parse(CRAIG).tool)


@pytest.mark.parametrize(
    ('angle', 'length', 'quarter', 'third', 'metre'),
    [
        ('rad', 'm', 'pi/2', '0.3', '1'),
        ('deg', 'm', '90', '0.3', '1'),
        ('rad', 'mm', 'pi/2', '300', '1000'),
        ('deg', 'mm', '90', '300', '1000'),
    ],
)
def test_units_apply_to_every_number(
    angle: str, length: str, quarter: str, third: str, metre: str
) -> None:
    text = f"""\
robot: units
convention: standard
units: {{angle: {angle}, length: {length}}}
constants: {{L: {third}}}
joints:
  - {{name: q1, type: revolute, limits: [-{quarter}, {quarter}], velocity: 2*{quarter}}}
  - {{name: q2, type: prismatic, limits: [0, {metre}], velocity: {third}}}
  - {{name: q3, type: helical, limits: [-{quarter}, {quarter}]}}
links:
  - {{a: L, alpha: {quarter}, d: 0, theta: -2*q1 + {quarter}}}
  - {{a: 0, alpha: "atan2(1, 0)", d: q2 + L, theta: 0}}
  - {{a: L*sin({quarter}), alpha: 0, d: "{third}/({quarter})*q3", theta: q3}}
base: {{xyz: [L, 0, {metre}], rpy: [0, 0, {quarter}]}}
singularity: {{length: {third}, warn: {quarter}/2, stop: {quarter}/4}}
known_poses:
  - q: [{quarter}, {third}, {quarter}]
    xyz: [{metre}, 0, 0]
    rpy: [0, {quarter}, 0]
    tolerance: {{xyz: {third}, rpy: {quarter}}}
"""
    robot = parse(text)
    half_pi = math.pi / 2
    first, second, third_row = robot.links
    assert isinstance(first, DhRow)
    assert isinstance(second, DhRow)
    assert isinstance(third_row, DhRow)
    assert robot.joints[0].upper == pytest.approx(half_pi, abs=ROUND_OFF)
    assert robot.joints[0].velocity == pytest.approx(math.pi, abs=ROUND_OFF)
    assert (robot.joints[1].upper, robot.joints[1].velocity) == (1.0, 0.3)
    assert robot.joints[2].lower == pytest.approx(-half_pi, abs=ROUND_OFF)
    assert first['a'].affine.constant == 0.3
    assert first['alpha'].affine.constant == pytest.approx(half_pi, abs=ROUND_OFF)
    assert first['theta'].affine.constant == pytest.approx(half_pi, abs=ROUND_OFF)
    assert first['theta'].affine.coefficients == (('q1', -2.0),)
    assert second['alpha'].affine.constant == pytest.approx(half_pi, abs=ROUND_OFF)
    assert second['d'].affine.constant == 0.3
    assert second['d'].affine.coefficients == (('q2', 1.0),)
    assert third_row['a'].affine.constant == pytest.approx(0.3, abs=ROUND_OFF)
    assert third_row['theta'].affine.coefficients == (('q3', 1.0),)
    ((name, pitch),) = third_row['d'].affine.coefficients
    assert (name, pitch) == ('q3', pytest.approx(0.3 / half_pi, abs=ROUND_OFF))  # m per rad
    turned = [[0, -1, 0, 0.3], [1, 0, 0, 0], [0, 0, 1, 1], [0, 0, 0, 1]]
    assert robot.base.motion.matrix == pytest.approx(np.array(turned), abs=ROUND_OFF)
    assert robot.singularity.length == 0.3
    assert robot.singularity.warn == pytest.approx(half_pi / 2, abs=ROUND_OFF)
    assert robot.singularity.stop == pytest.approx(half_pi / 4, abs=ROUND_OFF)
    (pose,) = robot.known_poses
    assert pose.q == pytest.approx((half_pi, 0.3, half_pi), abs=ROUND_OFF)
    assert pose.motion.matrix[:3, 3].tolist() == [1.0, 0.0, 0.0]
    assert pose.motion.matrix[2, 0] == pytest.approx(-1.0, abs=ROUND_OFF)
    assert (pose.tolerance_xyz, pose.tolerance_rpy) == (0.3, pytest.approx(half_pi))


def test_a_constant_keeps_the_units_of_the_file() -> None:
    joints, links = '  - {name: q1, type: revolute}', '  - {a: L, alpha: 0, d: 0, theta: q1}'
    more = 'units: {length: mm}\nconstants: {K: 425, L: K + 1}\n'
    robot = parse(minimal(joints, links, more=more))
    assert [(c.name, c.text, c.value) for c in robot.constants] == [
        ('K', '425', 425.0),
        ('L', 'K + 1', 426.0),
    ]
    row = robot.links[0]
    assert isinstance(row, DhRow)
    assert row['a'].affine.constant == 0.426


@pytest.mark.parametrize('name', [name for name in CONVENTIONS if CONVENTIONS[name].product])
def test_a_product_fits_a_row(name: str) -> None:
    convention = CONVENTIONS[name]
    joint = convention.joint_motions
    assert joint
    assert set(joint) <= {('Rz', 'theta'), ('Tz', 'd')}
    # The factors that move are side by side, and each quantity occurs once.
    assert convention.before_joint + joint + convention.after_joint == convention.motions
    assert len(set(convention.quantities)) == len(convention.motions)


def test_rpy_is_yaw_times_pitch_times_roll() -> None:
    roll, pitch, yaw = 0.3, -0.7, 1.1
    text = CRAIG.replace('{xyz: [0, 0, 0.1]}', f'{{rpy: [{roll}, {pitch}, {yaw}]}}')

    def turn(angle: float, i: int, j: int) -> np.ndarray:
        R = np.eye(3)
        R[i, i] = R[j, j] = math.cos(angle)
        R[j, i], R[i, j] = math.sin(angle), -math.sin(angle)
        return R

    expected = turn(yaw, 0, 1) @ turn(pitch, 2, 0) @ turn(roll, 1, 2)
    R = parse(text).tool.motion.matrix[:3, :3]
    assert pytest.approx(expected, abs=ROUND_OFF) == R


def test_elementary_motions() -> None:
    text = minimal(
        '  - {name: theta1, type: revolute}\n  - {name: d3, type: prismatic}',
        '  [Rz(theta1), Tz(0.5), "Ry(atan2(1, 1))", Tx( d3 + 0.1 )]',
        'elementary',
    )
    links = parse(text).links
    assert [link.axis for link in links if isinstance(link, ElementaryMotion)] == [
        'Rz',
        'Tz',
        'Ry',
        'Tx',
    ]
    last = links[-1]
    assert isinstance(last, ElementaryMotion)
    assert (last.argument.text, last.argument.affine.constant) == ('d3 + 0.1', 0.1)


def test_a_helical_joint_is_two_elementary_motions() -> None:
    joints = '  - {name: q1, type: helical}'
    links = parse(minimal(joints, '  [Rz(q1), Tz(0.01*q1)]', 'elementary')).links
    last = links[1]
    assert isinstance(last, ElementaryMotion)
    assert last.argument.affine.coefficients == (('q1', 0.01),)


def test_coupled_joints_stand_in_several_rows() -> None:
    joints = '  - {name: q1, type: revolute}\n  - {name: q2, type: revolute}'
    rows = (
        '  - {a: 1, alpha: 0, d: 0, theta: q1}\n  - {a: 1, alpha: 0, d: 0, theta: pi - (q2 - q1)}'
    )
    row = parse(minimal(joints, rows)).links[1]
    assert isinstance(row, DhRow)
    assert row['theta'].affine.coefficients == (('q1', 1.0), ('q2', -1.0))


SHAPE_JOINT = '  - {name: q1, type: revolute}'


def test_shape_rows() -> None:
    rows = """\
  - in: [[1, 0, 0, 0.1], [0, 0, -1, 0], [0, 1, 0, 0]]
    joint: Rz(q1)
  - out: {xyz: [0, 0, 0.5]}
"""
    robot = parse(minimal(SHAPE_JOINT, rows, 'shape'))
    first, second = robot.links
    assert isinstance(first, ShapeRow)
    assert isinstance(second, ShapeRow)
    expected = [[1, 0, 0, 0.1], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]]
    assert first.inner.matrix.tolist() == expected
    assert len(first.inner.texts) == 16
    assert first.inner.texts[6] == '-1'
    assert first.outer.matrix.tolist() == np.eye(4).tolist()
    assert second.joint is None
    assert second.outer.matrix[2, 3] == 0.5


def test_a_printed_matrix_becomes_the_nearest_rotation_and_is_remarked_on() -> None:
    c = '0.7071068'  # seven printed digits of sqrt(2)/2
    rows = f'  - {{in: [[{c}, -{c}, 0, 0], [{c}, {c}, 0, 0], [0, 0, 1, 0]], joint: Rz(q1)}}'
    robot = parse(minimal(SHAPE_JOINT, rows, 'shape'))
    row = robot.links[0]
    assert isinstance(row, ShapeRow)
    R = row.inner.matrix[:3, :3]
    assert pytest.approx(np.eye(3), abs=4 * ROUND_OFF) == R.T @ R
    assert R[0, 0] == pytest.approx(math.sqrt(0.5), abs=ROUND_OFF)
    (remark,) = robot.remarks
    assert re.match(r'line 7: links\[0\]\.in: is 5\.3\d*e-08 from a rotation', remark)


def test_an_exact_matrix_is_kept_to_the_last_bit() -> None:
    rows = (
        '  - in: [[sqrt(2)/2, -sqrt(2)/2, 0, 0], [sqrt(2)/2, sqrt(2)/2, 0, 0], [0, 0, 1, 0]]\n'
        '    joint: Rz(q1)'
    )
    row = parse(minimal(SHAPE_JOINT, rows, 'shape')).links[0]
    assert isinstance(row, ShapeRow)
    assert row.inner.matrix[0, 0] == math.sqrt(2.0) / 2.0


def test_singularity_defaults() -> None:
    singularity = parse(CRAIG).singularity
    assert (singularity.task, singularity.length) == (None, None)
    assert (singularity.measure, singularity.warn, singularity.stop) == ('distance', 0.1, 0.03)
    condition = parse(CRAIG + 'singularity: {measure: condition_number}\n').singularity
    assert (condition.warn, condition.stop) == (17.0, 30.0)


def test_a_task_is_a_set_in_one_order() -> None:
    text = (
        CRAIG + 'singularity: {task: [rz, y, x], factors: [{name: elbow, expression: sin(q3)}, '
        '{name: tip, expression: L1 + q2*q3}]}\n'
    )
    singularity = parse(text).singularity
    assert singularity.task == ('x', 'y', 'rz')
    assert [(factor.name, factor.text) for factor in singularity.factors] == [
        ('elbow', 'sin(q3)'),
        ('tip', 'L1 + q2*q3'),
    ]


def test_numbers_are_those_of_yaml_1_2() -> None:
    row = parse(CRAIG.replace('a: L1', 'a: 017').replace('a: L2', 'a: 1e-3')).links
    assert isinstance(row[1], DhRow)
    assert isinstance(row[2], DhRow)
    assert (row[1]['a'].affine.constant, row[2]['a'].affine.constant) == (17.0, 1e-3)


@pytest.mark.parametrize('name', ['1', 'on', 'no', 'x-1', 'arm/left.j1', 'Gelenk_ä'])
def test_a_joint_name_is_any_text_with_a_variable(name: str) -> None:
    robot = parse(CRAIG.replace('name: q1,', f'name: {name}, variable: q1,'))
    assert robot.joints[0].name == name


REMARKABLE = """\
robot: remarkable
convention: standard
constants: {L1: 1, L2: 2}
joints:
  - {name: q1, type: revolute, limits: [-180, 180], velocity: 180}
  - {name: q2, type: prismatic, limits: [0, 500]}
  - {name: q3, type: revolute, limits: [-12, 12]}
links:
  - {a: L1, alpha: 90, d: 0, theta: q1}
  - {a: 0, alpha: 0, d: q2 - 21.5, theta: 0}
  - {a: 320, alpha: 0, d: 0, theta: q3 - 45}
tool: {xyz: [0, 0, -85], rpy: [0, 90, 0]}
known_poses:
  - {q: [200, 0, 0], xyz: [0, 0, 1500], rpy: [0, 0, 0]}
"""
DEGREES, RADIANS = 'angle: deg', 'angle: rad'
MILLIMETRES, METRES = 'length: mm', 'length: m}'


def warnings(text: str) -> list[tuple[int, str, str]]:
    return [(doubt.line, doubt.where, doubt.code) for doubt in parse(text).warnings]


def test_warnings_say_what_is_most_likely_a_mistake() -> None:
    assert warnings(REMARKABLE) == [
        (3, 'constants.L2', 'unused-constant'),
        (5, 'joints[0].limits', 'wrong-unit'),
        (5, 'joints[0].velocity', 'wrong-unit'),
        (6, 'joints[1].limits', 'wrong-unit'),
        (7, 'joints[2].limits', 'wrong-unit'),
        (9, 'links[0].alpha', 'wrong-unit'),
        (10, 'links[1].d', 'wrong-unit'),
        (11, 'links[2].a', 'wrong-unit'),
        (11, 'links[2].theta', 'wrong-unit'),
        (12, 'tool.xyz[2]', 'wrong-unit'),
        (12, 'tool.rpy[1]', 'wrong-unit'),
        (14, 'known_poses[0].xyz[2]', 'wrong-unit'),
    ]
    stated = [doubt.message for doubt in parse(REMARKABLE).warnings]
    numbers = ['28.6', '180', '500 m', '1.90', '90 rad', '-21.5', '320', '-45', '-85', '90 rad']
    for message, number in zip(stated[1:], [*numbers, '1500'], strict=True):
        assert number in message
    assert [DEGREES in message for message in stated] == [k in (1, 4, 5, 8, 10) for k in range(12)]
    assert [MILLIMETRES in message for message in stated] == [
        k in (3, 6, 7, 9, 11) for k in range(12)
    ]


def test_remarks_say_what_is_worth_knowing() -> None:
    source, row, position = parse(
        REMARKABLE.replace('theta: q3 - 45', 'theta: 0').replace(
            'type: revolute, limits: [-12, 12]', 'type: revolute, unused: true'
        )
    ).remarks
    assert source.startswith('line 1: source:')
    assert row.startswith('line 11: links[2]:')
    assert position.startswith('line 14: known_poses[0].q[0]: 200')
    assert "[-180, 180] of 'q1'" in position


ONE_JOINT = '  - {name: q1, type: revolute}'


@pytest.mark.parametrize(
    ('rows', 'convention', 'units', 'place', 'words'),
    [
        ('{a: 19, alpha: 0, d: 2, theta: q1}', 'standard', 'length: m',
         (7, 'links'), ('21 m', MILLIMETRES)),
        ('{a: 0.4, alpha: 0, d: 0, theta: q1}', 'modified', 'length: mm',
         (7, 'links'), ('0.4 mm', METRES)),
        ('Rz(q1)\n  - Rx(270)\n  - Tx(0.2)', 'elementary', 'angle: rad',
         (9, 'links[1]'), ('270 rad', DEGREES)),
        ('Rz(q1)\n  - Ty(66)', 'elementary', 'angle: deg',
         (9, 'links[1]'), ('66 m', MILLIMETRES)),
        ('{in: {xyz: [0, 45, 0]}, joint: Rz(q1)}', 'shape', 'angle: deg',
         (8, 'links[0].in.xyz[1]'), ('45 m', MILLIMETRES)),
        ('{joint: Rz(q1), out: [[1, 0, 0, 88], [0, 1, 0, 0], [0, 0, 1, 0]]}', 'shape',
         'angle: deg', (8, 'links[0].out[0][3]'), ('88 m', MILLIMETRES)),
        ('{a: 0.4, alpha: -1.5708, d: 0, theta: q1}', 'standard', 'angle: deg',
         (8, 'links[0].alpha'), ('-1.5708 deg', RADIANS)),
        ('{a: 0.4, alpha: 0, d: 0, theta: q1 + 3.14}', 'standard', 'angle: deg',
         (8, 'links[0].theta'), ('3.14 deg', RADIANS)),
    ],
)  # fmt: skip
def test_another_unit_is_asked_for_at_its_line(
    rows: str, convention: str, units: str, place: tuple[int, str], words: tuple[str, ...]
) -> None:
    text = minimal(ONE_JOINT, f'  - {rows}', convention, f'units: {{{units}}}\n')
    assert warnings(text) == [(*place, 'wrong-unit')]
    (doubt,) = parse(text).warnings
    assert all(word in doubt.message for word in words)


@pytest.mark.parametrize(
    ('limits', 'units'),
    [
        ('[-2*pi, 2*pi]', 'angle: rad'),
        ('[-6.981, 6.981]', 'angle: rad'),  # +-400 degrees: wrists of large arms
        ('[-4, 4]', 'angle: rad'),
        ('[-170, 170]', 'angle: deg'),
        ('[-inf, inf]', 'angle: rad'),
    ],
)
def test_limits_of_real_arms_are_not_doubted(limits: str, units: str) -> None:
    joints = f'  - {{name: q1, type: revolute, limits: {limits}}}'
    turn = '6.28' if 'rad' in units else '360'
    rows = f'  - {{a: 5, alpha: 0, d: 14.5, theta: q1 + {turn}}}'
    assert warnings(minimal(joints, rows, more=f'units: {{{units}}}\n')) == []


def test_radians_in_a_file_of_degrees_are_warned_of() -> None:
    joints = '  - {name: q1, type: revolute, limits: [-3.14, 3.14]}'
    rows = '  - {a: 1, alpha: 0, d: 0, theta: q1}'
    text = minimal(joints, rows, more='units: {angle: deg}\n')
    assert warnings(text) == [(6, 'joints[0].limits', 'wrong-unit')]
    (doubt,) = parse(text).warnings
    assert '3.14 deg' in doubt.message
    assert RADIANS in doubt.message


def test_an_unused_joint_keeps_its_place_and_moves_nothing() -> None:
    joints = (
        '  - {name: q1, type: revolute}\n  - {name: lift, type: prismatic, unused: true}\n'
        '  - {name: q3, type: revolute, unused: false}'
    )
    rows = '  - {a: 1, alpha: 0, d: 0, theta: q1}\n  - {a: 0.5, alpha: 0, d: 0, theta: q3}'
    robot = build_robot(parse(minimal(joints, rows)))
    assert robot.joint_names == ('q1', 'lift', 'q3')
    assert [joint.unused for joint in robot.description.joints] == [False, True, False]
    assert not robot.description.warnings
    J = jacobian(robot, [0.3, 7.0, -1.1])
    assert not J[:, 1].any()
    assert J[:, 0].any()
    assert J[:, 2].any()


def test_a_known_pose_without_rpy_is_known_in_position_alone() -> None:
    text = CRAIG.replace('rpy: [-pi/2, 0, 0], tolerance: {rpy: 1e-3}', 'tolerance: {xyz: 2e-4}')
    (pose,) = parse(text).known_poses
    assert pose.motion.matrix[:3, 3].tolist() == [0.82, 0.1, 0.0]
    assert (pose.tolerance_xyz, pose.tolerance_rpy) == (2e-4, math.inf)


def expected_faults() -> dict[str, list[str]]:
    lines = (BROKEN / 'expected.txt').read_text().splitlines()
    return {name: rest for name, *rest in (line.split(' | ') for line in lines)}


def test_each_broken_robot_has_one_fault_with_its_place_code_and_word() -> None:
    expected, found = expected_faults(), {}
    for path in sorted(BROKEN.glob('*.yaml')):
        with pytest.raises(RobotFileError) as caught:
            read_robot_file(path)
        (fault,) = caught.value.faults
        assert fault.file == str(path)
        line, where, code, *words = expected[path.name]
        said = [word for word in words if word in fault.message]
        found[path.name] = [str(fault.line), fault.where, fault.code, *said]
    assert found == expected


def test_the_messages_of_a_dozen_broken_robots() -> None:
    # For a person to read: change it with a message that becomes clearer.
    text = (BROKEN / 'golden.txt').read_text()
    for line in text.splitlines():
        name = line.partition(':')[0]
        with pytest.raises(RobotFileError) as caught:
            read_robot_file(BROKEN / name)
        assert str(caught.value).replace(f'{BROKEN}/', '') == line


def test_all_faults_at_once_in_the_order_of_the_file() -> None:
    text = (
        CRAIG.replace('name: q1,', 'name: "a,b", variable: q1,')
        .replace('alpha: -pi/2', 'alpha: p1')
        .replace('theta: q3', 'thata: q3')
        .replace('L2: 0.4', 'L2: 1/0')
        .replace('robot: craig_3r', 'robot: craig 3r')
    )
    assert faults(text) == [
        (1, 'robot', 'wrong-name'),
        (4, 'constants.L2', 'division-by-zero'),
        (6, 'joints[0].name', 'wrong-name'),
        (11, 'links[1].alpha', 'unknown-name'),
        (12, 'links[2].thata', 'unknown-key'),
    ]
    # A constant with a fault is not offered.
    assert '(known: pi, L1, L3)' in refusal(text).faults[3].message


def test_links_and_poses_are_judged_beside_broken_joints() -> None:
    text = (
        CRAIG.replace('convention: modified', 'convention: khalil')
        .replace('limits: [-pi, pi], velocity: 2.0', 'limits: [pi, -pi], offset: 3')
        .replace('type: revolute, limits: [-pi/2, inf]', 'type: ball')
        .replace('theta: q1}', 'theta: q1 +}')
        .replace('theta: q2', 'theta: 2q2')
        .replace('a: L3', 'a: L4')
        .replace('q: [0, 0, 0]', 'q: [0, 0, O]')
    )
    assert faults(text) == [
        (3, 'convention', 'unknown-name'),
        (6, 'joints[0].offset', 'unknown-key'),
        (6, 'joints[0].limits', 'wrong-order'),
        (7, 'joints[1].type', 'unknown-name'),
        (10, 'links[0].theta', 'syntax'),
        (11, 'links[1].theta', 'not-a-number'),
        (13, 'links[3].a', 'unknown-name'),
        (16, 'known_poses[0].q[2]', 'unknown-name'),
    ]


def test_a_key_that_hides_a_variable_is_one_fault() -> None:
    joints = ''.join(f'  - {{name: arm/{i}, var: q{i}, type: R}}\n' for i in range(1, 4))
    rows = ''.join(f'  - {{a: 0.2, alpha: 0, d: 0, theta: q{i}}}\n' for i in range(1, 4))
    told = [where for _, where, _ in faults(minimal(joints, rows))]
    assert told == [f'joints[{i}].{key}' for i in range(3) for key in ('type', 'var')]
    named_elsewhere = joints.replace('var: q', 'coordinate: q').replace('arm/', 'axis_')
    assert len(faults(minimal(named_elsewhere, rows))) == 6


def test_the_name_of_a_joint_is_not_its_variable() -> None:
    text = CRAIG.replace('name: q3,', 'name: wrist, variable: q3,').replace(
        'theta: q3', 'theta: wrist'
    )
    assert faults(text) == [(12, 'links[2].theta', 'unknown-name')]
    assert 'q1, q2, q3' in str(refusal(text))


def test_a_forgotten_row_is_told_beside_other_faults() -> None:
    text = CRAIG.replace('theta: q3}', 'theta: 0}').replace('a: L1, ', 'a: L1*, ')
    assert faults(text) == [(8, 'joints[2]', 'unused-joint'), (11, 'links[1].a', 'syntax')]
    misspelt = CRAIG.replace('theta: q3}', 'theta: q33}')
    assert faults(misspelt) == [(12, 'links[2].theta', 'unknown-name')]
    assert "'q3'?" in str(refusal(misspelt))


def test_one_wrong_definition_is_one_fault() -> None:
    assert len(faults(CRAIG.replace('L1: 0.12', 'L1: zero'))) == 1
    assert len(faults(CRAIG.replace('name: q3, type: revolute', 'name: q3, type: revolt'))) == 1
    assert len(faults(CRAIG.replace('name: q3, type: revolute', 'type: revolute'))) == 1
    assert len(faults(CRAIG.replace('variable: q2, ', ''))) == 1


def test_a_fault_knows_its_parts() -> None:
    error = refusal(CRAIG.replace('alpha: -pi/2', 'alpha: p1'))
    (fault,) = error.faults
    message = "unknown name 'p1' (known: pi, L1, L2, L3)"
    assert fault == Fault('robot.yaml', 11, 'links[1].alpha', message, 'unknown-name')
    assert str(fault) == f'robot.yaml:11: links[1].alpha: {message}'
    assert isinstance(error, KinematicsError)
    assert isinstance(error, ValueError)


def test_a_hundred_faults_are_enough() -> None:
    rows = '  - {a: x, alpha: 0, d: 0, theta: q1}\n' * 150
    lines = faults(minimal('  - {name: q1, type: revolute}', rows))
    assert len(lines) == 101
    assert lines[-1] == (0, '', 'too-many-faults')
    assert '50 more' in str(refusal(minimal('  - {name: q1, type: revolute}', rows)))


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    def code(path: str | os.PathLike[str], word: str = '') -> str:
        with pytest.raises(RobotFileError) as caught:
            read_robot_file(path)
        (fault,) = caught.value.faults
        assert (fault.file, fault.line) == (str(path), 0)
        assert word in fault.message
        return fault.code

    # Without another file the cure is a list of the bundled robots.
    assert code(tmp_path / 'nosuch.yaml', 'kinematics_service robots') == 'missing-file'
    assert code(tmp_path, 'a directory') == 'not-a-file'
    assert code('a\0b', 'null') == 'unreadable'
    for name, content, expected in (
        ('large', b'#' * 300_000, 'too-large'),
        ('binary', b'\xff' * 300_000, 'too-large'),
        ('nothing', b'', 'empty'),
    ):
        (tmp_path / f'{name}.yaml').write_bytes(content)
        assert code(tmp_path / f'{name}.yaml') == expected


@pytest.mark.parametrize('kind', ['a named pipe', 'a device', 'a socket'])
def test_what_is_no_file_is_refused_at_once(tmp_path: Path, kind: str) -> None:
    # Were it opened, the pipe would hold this test for ever: nobody writes into it.
    path = tmp_path / 'robot.yaml'
    with contextlib.ExitStack() as stack:
        if kind == 'a named pipe':
            os.mkfifo(path)
        elif kind == 'a socket':
            stack.enter_context(socket.socket(socket.AF_UNIX)).bind(str(path))
        else:
            path.symlink_to(os.devnull)
        with pytest.raises(RobotFileError) as caught:
            read_robot_file(path)
    (fault,) = caught.value.faults
    assert (fault.file, fault.code) == (str(path), 'not-a-file')
    assert kind in fault.message


def test_a_byte_order_mark_and_crlf_are_read(tmp_path: Path) -> None:
    path = tmp_path / 'windows.yaml'
    path.write_bytes(b'\xef\xbb\xbf' + CRAIG.replace('\n', '\r\n').encode())
    assert read_robot_file(path).name == 'craig_3r'


HEAD = 'robot: x\nconvention: standard\njoints: [{name: q1, type: revolute}]\nlinks: '
BOMBS = {
    'laughter': 'a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]\n',
    'items': f'{HEAD}[{"0," * 120_000}]',
    'opening_brackets': '[' * 200_000,
    'dashes': '- ' * 100_000,
    'questions': '? ' * 100_000,
    'comments': '#\n' * 130_000,
    'equal_keys': 'a: 1\n' * 40_000,
    'keys': ''.join(f'a{i}: 1\n' for i in range(5_000)),
    'one_long_text': 'a ' * 130_000,
    'parentheses': f'{HEAD}["{"(" * 200_000}"]',
    'open_pieces': f'{HEAD}[{"(," * 19_000}]',
    'constants': f'{HEAD}[]\nconstants: {{{", ".join(f"c{i}: c{i + 1}" for i in range(9_000))}}}',
    'constants_of_constants': HEAD
    + '[]\nconstants: {c0: 1e9, '
    + ', '.join(f'c{i}: c{i - 1}*c{i - 1}' for i in range(1, 200))
    + '}',
    'task': f'{HEAD}[]\nsingularity: {{task: [{"x," * 19_000}]}}',
    'digits': f'{HEAD}[{{a: {"9" * 200_000}, alpha: 0, d: 0, theta: q1}}]',
    'bangs': '!' * 200_000,
    'surrogate': 'robot: "\\ud800"',
    'surrogate_key': '"\\ud800": 1',
    'escape': 'robot: "\\UFFFFFFFF"',
    'lone_surrogate': 'robot: \ud800',
    'null_byte': '\0',
}


@pytest.mark.slow
@pytest.mark.parametrize('name', BOMBS)
def test_a_bomb_is_refused_in_time(name: str) -> None:
    start = time.thread_time()
    with pytest.raises(RobotFileError) as caught:
        parse(BOMBS[name])
    assert time.thread_time() - start < SECONDS
    assert len(str(caught.value)) < 50_000


@pytest.mark.parametrize('brackets', ['[' * 17, '[' * 1_001, '{a: ' * 40_000])
def test_brackets_of_any_depth_are_refused_alike(brackets: str) -> None:
    # libyaml refuses more than a thousand by itself, before it tells any.
    assert faults(f'{HEAD}{brackets}') == [(4, '', 'too-deep')]


FRAGMENTS = st.sampled_from(
    [
        '{',
        '}',
        '[',
        ']',
        ':',
        ': ',
        ',',
        '-',
        '- ',
        '(',
        ')',
        '"',
        "'",
        '\n',
        '\n  ',
        '#',
        '&a',
        '*a',
    ]
    + [
        '!!x',
        '|',
        '>',
        '%',
        '@',
        '`',
        'inf',
        '.nan',
        'true',
        'null',
        '~',
        'pi',
        'q1',
        'sin(',
        '1e999',
    ]
    + [
        '\t',
        '\0',
        'é',
        '\ud800',
        '? ',
        '<<: ',
        '---\n',
        '"\\x00"',
        '[[]]',
        '{}',
        'xyz: [0]',
        'in: x',
    ]
)


@pytest.mark.slow
@settings(max_examples=50, deadline=None)
@given(st.text(max_size=200))
def test_any_text_is_a_robot_or_a_robot_file_error(text: str) -> None:
    _only_robot_file_errors(text)


@settings(max_examples=50, deadline=None)
@given(st.binary(max_size=200))
def test_any_bytes_are_a_robot_or_a_robot_file_error(content: bytes) -> None:
    _only_robot_file_errors(content.decode('latin-1'))


def plain(node: Any) -> Any:
    if isinstance(node, ScalarNode):
        return node.text
    return (
        [plain(item) for item in node]
        if isinstance(node, list)
        else {key: plain(value) for key, value in node.items()}
    )


@pytest.mark.slow
def test_the_reader_agrees_with_another_one() -> None:
    yaml = pytest.importorskip('ruamel.yaml').YAML(typ='base', pure=True)
    paths = [
        *sorted(BROKEN.glob('*.yaml'))[::8],
        *map(find_robot_file, sorted(bundled_robots())[::8]),
    ]
    compared = 0
    for text in (path.read_bytes().decode('latin-1') for path in paths):
        try:
            document = read_document(text, 'robot.yaml')
        except RobotFileError:
            continue
        if not document.faults:
            assert plain(document.data) == yaml.load(text)
            compared += 1
    assert compared > 15


@pytest.mark.slow
@settings(max_examples=50, deadline=None)
@given(
    st.sampled_from(['craig', *sorted(expected_faults())]),
    st.lists(st.tuples(st.floats(0, 1), st.integers(0, 8), FRAGMENTS), max_size=5),
)
def test_any_damage_is_a_robot_or_a_robot_file_error(
    name: str, damage: list[tuple[float, int, str]]
) -> None:
    text = CRAIG if name == 'craig' else (BROKEN / name).read_bytes().decode('latin-1')[:2000]
    for position, removed, inserted in damage:
        at = int(position * len(text))
        text = text[:at] + inserted + text[at + removed :]
    _only_robot_file_errors(text)


def _only_robot_file_errors(text: str) -> None:
    start = time.thread_time()
    refusal = None
    try:
        parse(text)
    except RobotFileError as error:
        refusal = error
    assert time.thread_time() - start < SECONDS
    if refusal:
        assert refusal.faults
        assert len(str(refusal).splitlines()) == len(refusal.faults)
        assert not str(refusal).endswith(': is incomplete')


def test_reading_imports_neither_sympy_nor_ros() -> None:
    # Without the package's own __init__, which brings the kernel along.
    import kinematics_service.robot.file.reader as robot_file

    program = f"""
import sys, types
package = types.ModuleType('kinematics_service')
package.__path__ = [{str(Path(robot_file.__file__).parents[2])!r}]
sys.modules['kinematics_service'] = package
import kinematics_service.robot.file.reader
print(*sorted({{'sympy', 'rclpy', 'scipy', 'matplotlib'}} & sys.modules.keys()))
"""
    done = subprocess.run(
        [sys.executable, '-c', program], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.strip() == ''


def test_a_name_with_spaces_is_that_of_joint_states():
    (joint,) = parse_robot(
        'robot: arm\nconvention: standard\n'
        'joints: [{name: Revolute 2, variable: q2, type: revolute}]\n'
        'links: [{a: 1, alpha: 0, d: 0, theta: q2}]\n',
        'arm.yaml',
    ).joints
    assert (joint.name, joint.variable) == ('Revolute 2', 'q2')


def planar(links, alpha, task=''):
    """Return a planar arm whose axes are tilted by an angle (rad)."""
    joints = [f'{{name: j{k}, variable: q{k}, type: revolute}}' for k in range(1, links + 1)]
    rows = [f'{{theta: q{k}, d: 0, a: 0.4, alpha: {alpha}}}' for k in range(1, links + 1)]
    return ks.robot_from_text(
        f'robot: planar\nconvention: standard\nsource: a test\n{task}\n'
        f'joints: [{", ".join(joints)}]\nlinks: [{", ".join(rows)}]\n'
    )


@pytest.mark.parametrize('links', [2, 3])
@pytest.mark.parametrize('alpha', [1e-6, -5e-3])
def test_rows_that_count_by_a_tilt_of_axes_alone_are_named(links, alpha):
    rows = 'x, y' if links == 2 else 'x, y, rz'
    (doubt,) = planar(links, alpha).description.warnings
    assert doubt.where == 'singularity'
    assert doubt.code == 'barely-moved'
    assert f'task: [{rows}]' in doubt.message
    assert 'task: [x, y, z]' in doubt.message
    # Whichever is written, nothing is left to ask.
    for task in (rows, 'x, y, z'):
        robot = planar(links, alpha, f'singularity: {{task: [{task}]}}')
        assert robot.singularity.task.rows == tuple(task.split(', '))
        assert not robot.description.warnings


@pytest.mark.parametrize('alpha', [0.0, 0.3, -1.2])
def test_rows_that_joints_move_are_not_asked_about(alpha):
    assert not planar(2, alpha).description.warnings


@pytest.mark.parametrize(
    ('text', 'line', 'advice'),
    [
        ('robot: a\nlinks: [\n  {a: 1}\njoints: 3\n', 4, 'close the [ of line 2'),
        ('robot: {a: 1\n', 2, 'close the { of line 1'),
        ('robot: "a\nlinks: 1\n', 3, 'close the quotation mark of line 1'),
        ('robot: "\\q"\n', 1, 'write \\\\ for a backslash'),
        ('robot: a\n\tlinks: 3\n', 2, 'indent with spaces'),
        ('robot: @x\n', 1, 'put the text into quotation marks'),
        ('robot: a: b\n', 1, 'write one `key: value` a line'),
        ('robot: a\n- b\n', 2, 'begin the line at the same column'),
        ('robot: a\nlinks\nconvention: standard\n', 3, 'write line 2 as `key: value`'),
        ('robot: &x a\n', 1, 'delete it'),
    ],
)
def test_a_syntax_error_says_what_to_write(text, line, advice):
    with pytest.raises(RobotFileError) as error:
        read_document(text, 'a.yaml')
    (fault,) = error.value.faults
    assert fault.line == line
    assert f'; {advice}' in fault.message
