# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The checker of formulas: right ones pass, and each erratum of the source documents is found.

Files in `formulas` are the documents' formulas as a person types them; `right_...` hold what is
right in them or was put right, the others one erratum each, named as in the checklist (E3.1).
"""

import functools
import inspect
import io
import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from folders import GOLDEN

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.formulas.arm.numbers import Evaluation
from kinematics_service.apps.formulas.arm.table import table_of
from kinematics_service.apps.formulas.arm.world import World
from kinematics_service.apps.formulas.compare.arm.symbols import SymbolicArm
from kinematics_service.apps.formulas.compare.comparison import compare
from kinematics_service.apps.formulas.compare.report import report

HERE = Path(__file__).parent
FORMULAS = HERE / 'formulas'
SOURCES = sorted((Path(ks.__file__).parent / 'apps' / 'formulas' / 'compare').rglob('*.py'))
ROUND_OFF = 1e-12  # products of at most nine matrices with entries of order 1

RIGHT = {
    'right_000a': 'anthropomorphic_3r',
    'right_000b': 'parallelogram_left',
    'right_000c': 'spherical_rrp',
    'right_001': 'craig_3r',
    'right_002': 'rrp_elementary',
    'right_003': 'offset_stanford_shape',
    'right_003_printed': 'offset_stanford_printed',
    'right_004': 'six_joint_dh_unit',
}

INDEX = 'index of a joint or a length'
ATAN2 = 'arguments of atan2 and its kin'
# File, robot, then for each wrong formula: its name, and for each cause: name, words of the
# sentence, entries it explains (from 1).  No cause: located only.
ERRATA = [
    ('e0_1', 'anthropomorphic_3r', {'J_w': [
        ('index of the axis', 'z_i stands where z_i-1 belongs', '11 21 31')]}),
    ('e0_2', 'anthropomorphic_3r', {'z_3': [
        ('axes of the frame itself', 'turned into base axes', '11 21 31')]}),
    ('e0_3', 'parallelogram_left', {
        'A_3': [('column of the table', 'slipped up by one row',
                 '11 12 14 21 22 24')],
        'R': [('column of the table', 'from row 3 on', '11 12 21 22 31 32')]}),
    ('e0_4', 'parallelogram_left', {
        'J_w': [('sum of columns', 'J_3 is c_4 - c_5, ', '13 33')],
        'J_v': [('sum of columns', 'it is c_4 + c_5', '13 23 33')]}),
    ('e0_10', 'spherical_rrp', {'s_o1': [
        ('entry of the table', 'd of row 1 (L1', '31')]}),
    ('e1_2', 'craig_3r', {'v3': [
        ('lost bracket', 'cos(q1) multiplies (L1 + L2*cos(q2))*cos(q1)', '31')]}),
    ('e2_1', 'rrp_elementary', {r'\theta_2': [
        (ATAN2, 'first argument of atan2', '11')]}),
    ('e2_2', 'rrp_elementary', {
        'J_1': [('point of the Jacobian', 'o_4 stands where o_n belongs', '11 21')],
        'J_2': [('point of the Jacobian', 'o_4 stands where o_n belongs', '11 21 31')]}),
    ('e2_4', 'rrp_elementary', {'D_1': [
        ('derivative of a pose', 'derivative of the constant 1', '44')]}),
    ('e3_1', 'offset_stanford_shape', {'T_{34}': [
        ('matrix not inverted', 'output matrix of row 3', '13 31')]}),
    ('e3_5', 'offset_stanford_printed', {'T_6': [
        ('sign', 'column 2: the sign', '12 22')]}),
    ('e3_6', 'offset_stanford_printed', {
        r'tan(\phi_2)': [(ATAN2, 'it is the reciprocal', '11')],
        r'\phi_2': [(ATAN2, 'of atan is the reciprocal', '11')]}),
    ('e3_7', 'offset_stanford_printed', {
        r'l + \phi_3': [('lost plus', 'between (h - z)*cos(phi2) and', '11')],
        r'\phi_3': [('lost plus', 'a plus sign is lost', '11')]}),
    ('e3_8', 'offset_stanford_shape', {'R_C': [
        ('zero of a joint', 'phi2 - 90 deg', '11 21 31')]}),
    ('e3_9', 'offset_stanford_dh', {
        'T_5': [('zero of a joint', 'phi5 + 180 deg', '11 13 21 23'),
                ('extra term or factor', 'n does not belong here', '34')],
        'T_6': [('zero of a joint', 'phi6 - 90 deg', '11 12 21 22'),
                ('dropped term or factor', 'the term is dropped: n', '34')]}),
    ('e4_1', 'six_joint_dh_unit', {'T_i': [
        ('missing length', 'd_i is missing', '34'),
        (INDEX, 'alpha_i stands where theta_i belongs', '14 24')]}),
    ('e4_2', 'six_joint_dh_unit', {'T_1': [('missing length', 'd1 is missing', '34')]}),
    ('e4_3', 'six_joint_dh_unit', {'T_4': [
        ('dropped term or factor', '0 stands where 1 belongs', '33')]}),
    ('e4_4', 'six_joint_dh_unit', {'T_6': [
        ('values of the joints', 'not for theta6 = 90',
         '11 13 21 23')]}),
    ('e4_5', 'six_joint_dh_unit', {'T_06': []}),
    ('e4_8', 'six_joint_dh_unit', {
        'J_{v,1}': [('cross product', 'cross product is left out', '11 21 31')],
        'J_1': [('cross product', 'cross product is left out', '11 21 31')]}),
    ('e4_9', 'six_joint_dh_unit', {
        'J_w1': [('another quantity', 'it is J_v1', '11 31')],
        'J_1': [('dropped term or factor', '0 stands where 1 belongs', '61')]}),
    ('e4_11', 'six_joint_dh_unit', {
        'z_2': [('sign', 'the sign is wrong', '21')], 'o_6': [], 'J_v3': []}),
    ('e4_12', 'six_joint_dh_unit', {'J_3': [('another quantity', 'it is J_6', '11 51 61')]}),
]  # fmt: skip


bundled = functools.cache(ks.load_robot)


@functools.cache
def compared(robot, text):
    return compare(bundled(robot), text)


def verdicts(robot, text):
    comparison = compared(robot, text)
    assert not comparison.faults, [(f.line, f.column, f.message) for f in comparison.faults]
    return comparison.verdicts


def read(name):
    return (FORMULAS / f'{name}.txt').read_text(encoding='utf-8')


def entries_of(cause):
    return ' '.join(f'{i + 1}{j + 1}' for i, j in cause.entries)


def why(robot, text):
    (verdict,) = verdicts(robot, text)
    return [cause.cause for cause in verdict.causes], verdict


@pytest.mark.slow
@pytest.mark.parametrize('name', RIGHT)
def test_right_formulas_of_the_documents_agree(name):
    for verdict in verdicts(RIGHT[name], read(name)):
        assert verdict.status == 'agrees', (verdict.name, verdict.causes)


@pytest.mark.slow
@pytest.mark.parametrize(('name', 'robot', 'expected'), ERRATA, ids=[row[0] for row in ERRATA])
def test_c32_c33_an_erratum_is_found_with_its_cause(name, robot, expected):
    wrong = {v.name: v for v in verdicts(robot, read(name)) if v.status == 'differs'}
    assert list(wrong) == list(expected)
    for formula, causes in expected.items():
        found = wrong[formula].causes
        assert len(found) == len(causes), found
        for cause, (kind, words, entries) in zip(found, causes):
            assert cause.cause == kind
            assert words in cause.sentence
            assert entries_of(cause) == entries
            assert cause.cause in wrong[formula].tried
        assert wrong[formula].unexplained == (0 if causes else len(wrong[formula].entries))


def test_e0_5_a_matrix_for_its_third_column():
    (verdict,) = verdicts('anthropomorphic_3r', read('e0_5'))
    assert verdict.remarks[0].endswith('3 x 1, not 3 x 3')
    assert verdict.remarks[1:] == ('its column 3 is right', 'it is R_1')


def test_e1_1_the_second_family_is_missed():
    family, whole = verdicts('craig_3r', read('e1_1'))
    assert (family.status, whole.status) == ('agrees', 'differs')
    pose = dict(re.findall(r'(q\d) = (-?[\d.]+)', whole.remarks[0]))
    q = [float(pose[f'q{i}']) for i in (1, 2, 3)]
    arm = ks.load_robot('craig_3r')
    assert ks.singularity(arm, q).smallest_singular_value < 1e-3
    assert abs(0.12 + 0.4 * np.cos(q[1]) + 0.3 * np.cos(q[1] + q[2])) < 1e-3


def test_e2_3_the_column_of_the_prismatic_joint():
    jacobian, column = verdicts('rrp_elementary', read('e2_3'))
    assert jacobian.remarks[0].endswith('6 x 3, not 6 x 2')
    assert jacobian.remarks[1].endswith('those of d3')
    assert column.causes[0].cause == 'kind of joint'


def test_e2_7_four_points_are_not_the_singular_set():
    *points, whole = verdicts('rrp_elementary', read('e2_7'))
    assert [point.status for point in points] == ['agrees'] * 4
    assert whole.status == 'differs'
    assert whole.remarks[0].startswith('not complete: ')


# Right lines that leave out a part of the singular set: an isolated zero on a grid of any step, a
# double zero, a factor, a branch of an equation, a slide beyond 2 m.
INCOMPLETE = [
    ('planar_2r', ['q2 = 0']),
    ('planar_2r', ['q2 = pi', 'cos(q2)=-1']),
    ('scara_hsr065', ['q2 = 0']),
    ('spherical_rrp', ['d3 = 0']),
    ('spherical_rrp', ['sin(theta2) = 0']),
    ('craig_3r', ['L1+L2*c2+L3*c23 = 0', 'q3 = 0']),
    ('craig_3r', ['q3 = k*pi', 'q3 = -q2+acos(-(L1+L2*c2)/L3)']),
]
COMPLETE = [
    ('planar_2r', ['tan(q2/2)*cos(q2/2)^2 = 0']),
    ('planar_3r', ['q2 = 0', 'q2 = pi']),
    ('spherical_rrp', ['d3 = 0', 'theta2 = k*pi']),
    ('craig_3r', ['q3 = k*pi', 'L1+L2*c2+L3*c23 = 0']),
    ('anthropomorphic_3r', ['sin(theta3)*(L2*c2+L3*c23) = 0']),
]


def claimed(name, lines):
    return verdicts(name, '\n'.join(f'singular: {line}' for line in lines))


@pytest.mark.parametrize(('name', 'lines'), INCOMPLETE)
def test_an_incomplete_singular_set_is_named_with_a_pose(name, lines):
    *each, whole = claimed(name, lines)
    assert [one.status for one in each] == ['agrees'] * len(lines)
    assert whole.status == 'differs'
    assert whole.remarks[0].startswith('not complete: ')


@pytest.mark.parametrize(('name', 'lines'), COMPLETE)
def test_a_complete_singular_set_agrees(name, lines):
    assert {one.status for one in claimed(name, lines)} == {'agrees'}


def test_an_equation_that_is_not_singular_differs():
    lines = ['sin(q1) = 0', 'q1 + q2 = k*pi', 'sin(q2) = 0.1', 'cos(q2) = 2']
    *singular, without, _ = claimed('planar_2r', lines)
    assert [one.remarks[0][:12] for one in singular] == ['not singular'] * 3
    assert without.remarks[0].startswith('no pose of this family')
    assert {one.status for one in (*singular, without)} == {'differs'}


# Right for L2 = L3 alone, as in the file: an equation without its letters, and a set whose folded
# elbow has the tool on axis 1; then right for all letters.
EQUAL_LETTERS = [
    (['q3 = k*pi', 'cos(q2)+cos(q2+q3) = 0'], ['agrees', 'differs', 'differs']),
    (['q3 = 0', 'L2*c2 + L3*c23 = 0'], ['agrees', 'agrees', 'differs']),
]
ARM = """
robot: arm
convention: standard
constants: {L1: 1, L2: 1, L3: 1}
joints:
  - {name: q1, type: revolute}
  - {name: q2, type: revolute}
  - {name: q3, type: revolute}
links:
  - {a: 0, alpha: pi/2, d: L1, theta: q1}
  - {a: L2, alpha: 0, d: 0, theta: q2}
  - {a: L3, alpha: 0, d: 0, theta: q3}
"""


@pytest.mark.parametrize(('lines', 'wanted'), EQUAL_LETTERS)
def test_singular_sets_are_judged_at_random_letters(tmp_path, lines, wanted):
    arm = tmp_path / 'arm.yaml'
    arm.write_text(ARM)
    found = claimed(arm, lines)
    assert [one.status for one in found] == wanted
    special = ['L1 = L2 = L3' in one.remarks[-1] for one in found]
    assert special == [status == 'differs' for status in wanted]


def test_each_factor_of_a_six_joint_arm_is_needed():
    *claims, whole = claimed('ur5e', ['q3 = k*pi', 'q5 = k*pi'])
    assert [one.status for one in claims] == ['agrees', 'agrees']
    assert whole.status == 'differs'
    # The shoulder: a2 c2 + a3 c23 + d5 sin(q2 + q3 + q4).
    assert 'd5*sin(q2 + q3 + q4)' in whole.remarks[0]


@pytest.mark.slow
def test_what_is_no_rotation_is_said():
    (mirror,) = verdicts('offset_stanford_printed', read('e3_5'))
    (remark,) = mirror.remarks
    assert remark.startswith('not a rotation')
    assert 'determinant is -1' in remark
    (flat,) = verdicts('six_joint_dh_unit', read('e4_3'))
    assert 'not a rotation' in flat.remarks[0]


def test_e4_13_a_structural_zero_is_told_from_a_singular_pose():
    (det,) = (v for v in verdicts('six_joint_dh_unit', read('right_004')) if v.name == 'det')
    assert '0 at every pose' in det.remarks[0]
    assert 'theta1, theta2' in det.remarks[0]


PRINTED = [
    ('s000a_anthropomorphic_dh', 'anthropomorphic_3r'),
    ('s000b_parallelogram_closed_loop', 'parallelogram_right'),
    ('s000c_spherical_rrp_dh', 'spherical_rrp'),
    ('s001_craig_3r_mdh', 'craig_3r'),
    ('s002_rrp_ets', 'rrp_elementary'),
]


@pytest.mark.parametrize(('system', 'robot'), PRINTED)
def test_golden_strings_agree(system, robot):
    golden = json.loads((GOLDEN / 'symbolic.json').read_text())[system]
    printed = golden.get('printed_in_document', {})
    lines = [f'T = {nested(golden["T"])}', f'J = {nested(golden["J"])}']
    lines += [f'det = {golden["task_det"]}', f'p = [{", ".join(golden["p"])}]']
    if 'J' in printed:
        lines += [
            f'rows: {printed["row_order"].split(" (")[0]}' * ('first' in printed['row_order'])
        ]
        lines += [f'Jacobian = {nested(printed["J"])}']
    if 'det' in printed:
        lines.append(f'JacDet = {printed["det"]}')
    found = verdicts(robot, '\n'.join(lines))
    assert {v.status for v in found} == {'agrees'}, [v for v in found if v.status != 'agrees']


def nested(matrix):
    return '[' + ', '.join('[' + ', '.join(row) + ']' for row in matrix) + ']'


SAME_MATRIX = {
    'plain': 'T12 =\n  c2 -s2 0 L1\n  0 0 1 0\n  -s2 -c2 0 0\n  0 0 0 1\n',
    'matlab': 'T_12 = [cos(q2), -sin(q2), 0, L1; 0 0 1 0; ...\n  -sin(q2) -cos(q2) 0 0; 0 0 0 1];',
    'sympy': 'T_12 = sp.Matrix([[sp.cos(q2), -sp.sin(q2), 0, L1], [0, 0, 1, 0],\n'
             '  [-sp.sin(q2), -sp.cos(q2), 0, 0], [0, 0, 0, 1]])',
    'latex': r'$$T_{12} = \begin{bmatrix} \cos q_2 & -\sin q_2 & 0 & L_1 \\ 0 & 0 & 1 & 0 \\'
             '\n' r' -\sin q_{2} & -\cos(q_2) & 0 & 0 \\ 0 & 0 & 0 & 1 \end{bmatrix}$$',
    'array': r'T_{12} = \left[\begin{array}{cccc} \cos q_2 & -\sin q_2 & 0 & L_1 \\ 0&0&1&0 \\'
             r' -\sin q_2 & -\cos q_2 & 0 & 0 \\ 0&0&0&1 \end{array}\right]',
    'unicode': 'T₁₂ = [cos(θ₂) −sin(θ₂) 0 L₁; 0 0 1 0; −sin(θ2) −cos(θ2) 0 0; 0 0 0 1]',
    'product': 'T_12 = inv(T_01)*T_02',
    'degrees': 'T_12 = [sin(q2 + 90 deg) cos(q2 + 90°) 0 L1; 0 0 1 0; -s2 -c2 0 0; 0 0 0 1]',
    'decimals': 'T_12 = [sin(q2 + 1.5708) -s2 0 L1; 0 0 1 0; -s2 sin(q2 - 1.570796) 0 0; 0 0 0 1]',
}  # fmt: skip


@pytest.mark.parametrize('syntax', SAME_MATRIX)
def test_syntaxes_say_the_same(syntax):
    (verdict,) = verdicts('craig_3r', SAME_MATRIX[syntax])
    assert verdict.status == 'agrees', verdict.causes


def printed(matrix, name):
    return f'{name} = {nested([[str(e) for e in matrix.row(i)] for i in range(matrix.rows)])}'


@pytest.fixture(scope='module')
def craig():
    return SymbolicArm(table_of(ks.load_robot('craig_3r').description))


@pytest.fixture(scope='module')
def anthropomorphic():
    return SymbolicArm(table_of(ks.load_robot('anthropomorphic_3r').description))


@pytest.mark.slow
def test_rows_in_the_other_order(craig):
    J = craig.jacobian
    causes, verdict = why('craig_3r', printed(J[3:, :].col_join(J[:3, :]), 'J'))
    assert causes == ['order of the rows']
    assert 'rows: angular first' in verdict.causes[0].sentence


def test_tool_axes_instead_of_base_axes(craig):
    R = craig.frames[-1][:3, :3].T
    J = (R * craig.jacobian[:3, :]).col_join(R * craig.jacobian[3:, :])
    causes, _ = why('craig_3r', printed(J, 'J'))
    assert causes == ['tool axes']
    (verdict,) = verdicts('craig_3r', 'frame: tool\n' + printed(J, 'J'))
    assert verdict.status == 'agrees'


@pytest.mark.slow
@pytest.mark.parametrize(
    ('robot', 'other'), [('craig_3r', 'standard'), ('anthropomorphic_3r', 'modified')]
)
def test_other_dh_convention(robot, other):
    from dataclasses import replace

    table = table_of(ks.load_robot(robot).description)
    rows = tuple(replace(row, convention=other) for row in table.rows)
    T = SymbolicArm(replace(table, rows=rows)).frames[-1]
    causes, verdict = why(robot, printed(T, 'T'))
    assert causes == ['standard or modified DH']
    assert other in verdict.causes[0].sentence


@pytest.mark.slow
def test_transposed_and_uninverted_matrices(craig):
    T = craig.frames[-1]
    assert why('craig_3r', printed(T.T, 'T'))[0] == ['transpose or inverse']
    assert why('craig_3r', printed(T[:3, :3].T, 'R'))[0] == ['transpose or inverse']
    assert why('craig_3r', 'T = inv(T_03*A_4)')[0] == ['transpose or inverse']


def test_degrees_in_a_formula():
    text = 'T_12 = [sin(q2 + 90) -s2 0 L1; 0 0 1 0; -s2 -c2 0 0; 0 0 0 1]'
    assert why('craig_3r', text)[0][0].startswith('degrees and millimetres')
    (verdict,) = verdicts('craig_3r', 'units: deg\n' + text)
    assert verdict.status == 'agrees'


def test_degrees_in_the_configuration():
    text = 'at: theta1=20, theta2=30, theta3=40\np = [0.4219; 0.1536; 0.4819]'
    causes, verdict = why('anthropomorphic_3r', text)
    assert causes == ['values of the joints']
    assert 'in degrees, not in radians' in verdict.causes[0].sentence
    (verdict,) = verdicts('anthropomorphic_3r', 'units: deg\n' + text)
    assert verdict.status == 'agrees'
    assert verdict.remarks[0].startswith('to the 4 decimals given')


def test_inverse_kinematics_in_degrees():
    lines = ['theta1 = atan2(y, x)', 'theta2 = atan2(d1 - z, r)', 'r = sqrt(x^2 + y^2)']
    text = '\n'.join(lines)
    for units in ('units: deg\n', ''):
        assert {v.status for v in verdicts('rrp_elementary', units + text)} == {'agrees'}
    in_degrees = text.replace('atan2(y, x)', '180/pi*atan2(y, x)')
    wrong = [v for v in verdicts('rrp_elementary', in_degrees) if v.status == 'differs']
    assert [v.causes[0].sentence for v in wrong] == ['the result is in degrees']


def test_wrist_angles_from_the_rotation():
    # 003: phi5 from the matrix Q = R04^T R of the wrist; here R is the whole rotation of a wrist.
    text = """
    robot: wrist
    convention: standard
    joints:
      - {name: a1, type: revolute}
      - {name: a2, type: revolute}
      - {name: a3, type: revolute}
    links:
      - {a: 0, alpha: pi/2, d: 0, theta: a1}
      - {a: 0, alpha: -pi/2, d: 0, theta: a2}
      - {a: 0, alpha: 0, d: 0.1, theta: a3}
    """
    arm = ks.robot_from_text('\n'.join(line[4:] for line in text.splitlines()))
    found = compare(arm, 'a2 = acos(r33)\na1 = atan2(-r23, -r13)').verdicts
    assert [v.status for v in found] == ['agrees', 'agrees']
    # With a2 in [0, pi] the other a1 leads to the rotation at no pose.
    apart = compare(arm, 'a2 = acos(r33)\na1 = atan2(r23, r13)').verdicts
    assert [v.status for v in apart] == ['differs', 'differs']
    (alone,) = compare(arm, 'a1 = atan2(r23, r13)').verdicts
    assert alone.status == 'agrees'
    (wrong,) = compare(arm, 'a1 = atan2(r13, r23)').verdicts
    assert 'exchanged' in wrong.causes[0].sentence


def test_a_jacobian_per_degree(craig):
    import sympy as sp

    assert why('craig_3r', printed(craig.jacobian * sp.pi / 180, 'J'))[0] == ['degrees']


def test_millimetres(craig):
    T = craig.frames[-1].as_mutable()
    T[:3, 3] *= 1000
    assert why('craig_3r', printed(T, 'T'))[0] == ['millimetres']


def test_exchanged_joints_and_lengths(anthropomorphic):
    T = printed(anthropomorphic.frames[-1], 'T')
    swapped = T.replace('theta2', 'x2').replace('theta3', 'theta2').replace('x2', 'theta3')
    assert why('anthropomorphic_3r', swapped)[0] == ['exchanged joints']
    swapped = T.replace('L2', 'x2').replace('L3', 'L2').replace('x2', 'L3')
    assert why('anthropomorphic_3r', swapped)[0] == ['exchanged lengths']


@pytest.mark.slow
def test_exchanged_columns(craig):
    J = craig.jacobian
    assert why('craig_3r', printed(J[:, [1, 0, 2]], 'J'))[0] == ['order of the columns']


@pytest.mark.slow
def test_two_mistakes_at_once(craig):
    J = craig.jacobian.as_mutable()
    J[0, 1] = -J[0, 1]
    causes, verdict = why('craig_3r', printed(J[3:, :].col_join(J[:3, :]), 'J'))
    assert causes[0] == 'order of the rows'
    assert verdict.unexplained == 0
    assert verdict.causes[1].entries == ((3, 1),)


LINEAR = 'L1*s1+L2*s12, L2*s12; -L1*c1-L2*c12, -L2*c12; 0, 0'
ANGULAR = '0, 0; 0, 0; 1, 1'


@pytest.mark.parametrize(
    'text', [f'J = [{LINEAR}; {ANGULAR}]', f'rows: angular first\nJ = [{ANGULAR}; {LINEAR}]']
)
def test_wrong_rows_of_a_jacobian_have_their_name_in_either_order(text):
    _, verdict = why('planar_2r', text)
    said = {sentence for cause in verdict.causes for sentence in (cause.sentence, *cause.also)}
    assert 'linear rows: the sign is wrong' in said


@pytest.mark.slow
@pytest.mark.parametrize(
    ('right', 'mistake', 'cause'),
    [
        ('L1 + L2*cos(q2)', 'L1 - L2*cos(q2)', 'sign of a term'),
        ('L1 + L2*cos(q2)', 'L2*cos(q2)', 'missing length'),
        ('L2*cos(q2)', 'L2*sin(q2)', 'sine for cosine'),
        ('L2*cos(q2)', 'L2*cos(q3)', INDEX),
        ('L3*cos(q2 + q3)', 'L3*cos(q3)', 'angle of a function'),
    ],
)
def test_slips_in_one_entry(right, mistake, cause):
    x = 'cos(q1)*(L1 + L2*cos(q2) + L3*cos(q2 + q3))'
    text = f'p = [{x}, {x.replace("cos(q1)", "sin(q1)")}, -L2*s2 - L3*s23]'
    assert verdicts('craig_3r', text)[0].status == 'agrees'
    causes, verdict = why('craig_3r', text.replace(right, mistake, 1))
    assert causes[0] == cause
    assert (verdict.entries[0].row, verdict.unexplained) == (0, 0)


@pytest.mark.parametrize(
    ('mistake', 'extra'),
    [
        ('1', None),
        ('-2.5', None),
        ('L1', 'L1'),
        ('L1*s1', 'L1*sin(q1)'),
        ('sin(q1 - q2)', 'sin(q1 - q2)'),
    ],
)
def test_where_0_belongs_no_factor_that_vanishes_is_a_cause(mistake, extra):
    text = f'T_12 = [c2, -s2, {mistake}, L1; 0, 0, 1, 0; -s2, -c2, 0, 0; 0, 0, 0, 1]'
    (verdict,) = verdicts('craig_3r', text)
    assert [(entry.row, entry.column) for entry in verdict.entries] == [(0, 2)]
    said = [cause.sentence.partition(' does not belong here')[0] for cause in verdict.causes]
    assert said == ([extra] if extra else [])
    assert [cause.also for cause in verdict.causes] == ([()] if extra else [])


def test_a_coincidence_of_lengths_does_not_pass():
    # L1 = L2 = 1 in the robot file: with random lengths the exchanged ones differ.
    (verdict,) = verdicts('planar_2r', 'p = [L2*c1 + L1*c12, L2*s1 + L1*s12, 0]')
    assert verdict.causes[0].cause == 'exchanged lengths'


# One of each convention, and of coupled and sliding joints and odd angles.
REFERENCE = ['craig_3r', 'parallelogram_left', 'rrp_elementary', 'offset_stanford_shape', 'so101']


@pytest.mark.slow
@pytest.mark.parametrize('robot', REFERENCE)
def test_reference_equals_the_kernel(robot):
    arm = ks.load_robot(robot)
    table = table_of(arm.description)
    q = np.random.default_rng(1).uniform(-2.0, 2.0, (5, arm.dof))
    values = {symbol: np.full(5, value) for symbol, value in table.given.items()}
    for symbol, expression in table.derived.items():
        values[symbol] = Evaluation(values, 5).of(expression)
    values |= {symbol: q[:, k] for k, symbol in enumerate(table.variables)}
    world = World(table, values, 5)
    symbols = SymbolicArm(table)
    evaluation = Evaluation(values, 5)
    for T in (world.pose, evaluation.of_matrix(symbols.frames[-1])):
        np.testing.assert_allclose(T, ks.forward_kinematics(arm, q), atol=ROUND_OFF)
    for J in (world.jacobian, evaluation.of_matrix(symbols.jacobian)):
        np.testing.assert_allclose(J, ks.jacobian(arm, q), atol=ROUND_OFF)
    frames = np.stack(world.frames[:-1], axis=1)
    np.testing.assert_allclose(frames, ks.link_frames(arm, q), atol=ROUND_OFF)


LONG = '\n'.join(['a0 = x', *(f'a{k + 1} = a{k}*2' for k in range(50)), 'q1 = a50'])
# Line and column, code, and what the sentence names or advises.
FAULTS = {
    'J = [1 2': ('1:8', 'syntax', "write ']'"),
    'T = [1 2; 3]': ('1:5', 'wrong-shape', '2, 1 entries'),
    'q1 = sin(bar)': ('1:10', 'unknown-name', "'bar'"),
    'q1 = sin(x, y)': ('1:6', 'wrong-length', 'takes 1 argument, not 2'),
    'q1 = tan(x, y)': ('1:6', 'wrong-length', 'atan2(y, x)'),
    'q1 = sin': ('1:6', 'wrong-length', 'sin(...)'),
    'rows: sideways': ('1:7', 'unknown-name', "'linear first' or 'angular first'"),
    'first frame: 2': ('1:14', 'unknown-name', "'0' or '1'"),
    'foo = 3': ('1:1', 'unused', 'T_03 or A_03'),
    'hello': ('1:1', 'syntax', 'NAME = ...'),
    'x = 1,5*q1': ('1:7', 'syntax', '0.5'),
    'q1 =': ('1:1', 'empty', 'NAME = ...'),
    '|J| = L1': ('1:1', 'syntax', 'det(J)'),
    'q1 = x \\': ('1:8', 'syntax', 'backslash'),
    'T_0^2 = [1]': ('1:1', 'out-of-range', 'write T_02'),
    'T_09 = [1]': ('1:1', 'out-of-range', '0 to 4'),
    'J_7 = [1;2;3;4;5;6]': ('1:1', 'out-of-range', 'joint 7'),
    's_o9 = [1;2;3]': ('1:1', 'out-of-range', 'row 9'),
    'q1 = c15': ('1:6', 'out-of-range', '3 joints'),
    'x = l1cos(q1)': ('1:5', 'unknown-name', "'L1*cos(...)'"),
    'singular q2 = 0': ('1:1', 'unknown-name', "'singular:'"),
    '# nothing': ('1:1', 'empty', 'no formula'),
    'q1 = a\na = b\nb = a': ('3:5', 'circular', "'a'"),
    'a = 1\na = 2\nq1 = a*x': ('2:1', 'duplicate-name', 'line 1'),
    LONG: ('12:7', 'too-deep', 'more than 40'),
    'at: q9=1\nT=[1]': ('1:5', 'unknown-name', "'q9'"),
    'at: q1 = x\nT = [1]': ('1:5', 'not-a-number', 'q1'),
    'point: T\nq1 = x': ('2:1', 'unknown-name', "'T'"),
    'point: o_9\nq1 = x': ('2:1', 'out-of-range', '0 to 4'),
    'point: a b\nq1 = x': ('1:8', 'syntax', "'a b'"),
    'meaning: a = 3\nq1 = x': ('1:10', 'syntax', "'a = 3'"),
    'singular: foo = 1': ('1:11', 'unknown-name', "'foo'"),
    'singular: L1 = 1': ('1:11', 'unsupported', 'q3 = k*pi'),
    'singular: q1 = x': ('1:11', 'unsupported', 'q3 = k*pi'),
    'singular:': ('1:10', 'empty', 'q3 = k*pi'),
    'singular: J = 0': ('1:11', 'wrong-shape', "'J'"),
    'L1 = x\nq1 = L1': ('1:1', 'not-a-number', 'L1'),
    'x = phi': ('1:1', 'unknown-name', 'phi'),
    'det = R_1': ('1:1', 'wrong-shape', "'det'"),
    'q1 = R_1': ('1:1', 'wrong-shape', "'q1'"),
    'q1 = 9^99': ('1:7', 'out-of-range', 'at most 24'),
    'q1 = 9^9^9': ('1:9', 'ambiguous', '(a^b)^c'),
    'q1 = 2^(1/3) ? 4': ('1:14', 'syntax', "'?'"),
    'q1 = x^2 2^': ('1:11', 'syntax', 'too early'),
    'q1 = x)': ('1:7', 'syntax', "')'"),
    'q1 = (x': ('1:7', 'syntax', "write ')'"),
    r'q1 = \frac+': ('1:11', 'syntax', "'+'"),
    r'T = \begin{bmatrix} 1': ('1:21', 'syntax', r'write its \end'),
    'q1 = Matrix(1, 2)': ('1:6', 'wrong-shape', 'a list of rows'),
    'T = []': ('1:5', 'empty', '[a, b; c, d]'),
    'p = [R_1, T; 1]': ('1:5', 'wrong-shape', '3, 4 rows'),
    'p = R_1 + 1': ('1:9', 'wrong-shape', "'+'"),
    'p = R_1 + T': ('1:9', 'wrong-shape', '3 x 3 and 4 x 4'),
    'p = R_1 * T': ('1:9', 'wrong-shape', '3 x 3 and 4 x 4'),
    'p = cross(p, R_1)': ('1:5', 'wrong-shape', '3 x 1 and 3 x 3'),
    'q1 = cross(x, y)': ('1:6', 'wrong-shape', 'two vectors'),
    'p = inv(z_1)': ('1:5', 'wrong-shape', '3 x 1'),
    'p = inv([0 0; 0 0])': ('1:5', 'division-by-zero', 'determinant 0'),
    'q1 = x/0': ('1:7', 'division-by-zero', 'zero'),
    'q1 = 0^-1': ('1:7', 'division-by-zero', 'zero'),
    'q1 = x/R_1': ('1:7', 'unsupported', 'inv(B)'),
    'q1 = R_1^2': ('1:9', 'unsupported', 'T_23'),
    'q1 = sin(R_1)': ('1:6', 'wrong-shape', 'sin'),
    'q1 = tan(pi/2)': ('1:6', 'not-finite', 'tan'),
    'q1 = ' + '1' * 50: ('1:6', 'too-large', '40 digits'),
    'q1 = ' + '(' * 500: ('1:66', 'too-deep', '60 deep'),
    'q1 = ' + '-' * 500 + '1': ('1:66', 'too-deep', '60 deep'),
    'q1 = __import__("os").system("true")': ('1:6', 'syntax', "'_'"),
}  # fmt: skip


@pytest.mark.parametrize('text', FAULTS)
def test_a_fault_has_its_place_and_code(text):
    place, code, word = FAULTS[text]
    fault = compare(bundled('craig_3r'), text).faults[0]
    assert (f'{fault.line}:{fault.column}', fault.code) == (place, code), fault.message
    assert word in fault.message


@pytest.mark.slow
def test_all_faults_of_a_file_at_once():
    comparison = compare(ks.load_robot('craig_3r'), 'q1 = foo\nq2 = bar\nq3 = atan2(y, x)\n')
    assert [(f.line, f.code) for f in comparison.faults] == [(k, 'unknown-name') for k in (1, 2)]


def test_growing_definitions_are_refused():
    lines = ['a0 = x'] + [f'a{i + 1} = (a{i}+q1)*(a{i}+q2) + a{i}' for i in range(30)]
    comparison = compare(ks.load_robot('craig_3r'), '\n'.join(lines) + '\nq1 = a30\n')
    assert {fault.code for fault in comparison.faults} == {'too-large'}


@pytest.mark.slow
def test_damaged_files_never_raise():
    rng = np.random.default_rng(7)
    texts = [read(path.stem) for path in sorted(FORMULAS.glob('*.txt'))]
    arm = ks.load_robot('craig_3r')
    letters = '()[]{}&=+-*/^_,;\\ \n1aqT%$'
    for _ in range(25):
        # A few lines of a file: what is still a formula is compared, which takes its time.
        lines = texts[rng.integers(len(texts))].splitlines(keepends=True)
        first = int(rng.integers(len(lines)))
        text = list(''.join(lines[first : first + 2]))
        for _ in range(rng.integers(1, 6)):
            at = int(rng.integers(len(text)))
            text[at : at + int(rng.integers(0, 4))] = letters[rng.integers(len(letters))]
        for fault in compare(arm, ''.join(text)).faults:
            assert fault.line >= 1
            assert fault.message
            assert fault.code != 'formula'


def test_user_text_is_never_evaluated():
    assert len(SOURCES) > 20
    for path in SOURCES:
        source = path.read_text()
        assert not re.search(r'\b(eval|exec|sympify|parse_expr|lambdify|S)\(', source), path


GOLDEN_REPORT = """\
e0_1.txt against anthropomorphic_3r: 1 of 1 formula differs
Compared as numbers at random poses; each cause below was tested there.

J_w (line 2) differs in 3 of 9 entries
  (1,1), wx: yours is sin(theta1), right is 0
  (2,1), wy: yours is -cos(theta1), right is 0
  (3,1), wz: yours is 0, right is 1
  cause: z_i stands where z_i-1 belongs (the axis of joint i)
"""


@pytest.mark.slow
def test_the_report_of_an_erratum_is_this():
    comparison = compared('anthropomorphic_3r', read('e0_1'))
    assert '\n'.join(report(comparison, 'e0_1.txt')) + '\n' == GOLDEN_REPORT


@pytest.mark.slow
def test_tested_causes_are_listed_with_verbose():
    comparison = compared('six_joint_dh_unit', read('e4_5'))
    (*_, last), verbose = report(comparison, 'e4_5.txt'), report(comparison, 'e4_5.txt', True)
    assert last.endswith('(--verbose: which were tested)')
    assert list(verbose)[-1].startswith('  tested: standard or modified DH, ')


@pytest.mark.slow
def test_exit_codes_and_output(capsys, tmp_path):
    broken = tmp_path / 'broken.txt'
    broken.write_text('x = L1*c1 + L2*c12\ny = L1*s1 + L2*s12\n')
    assert main(['compare', 'planar_2r', str(broken)]) == 0
    assert 'all 2 formulas agree' in capsys.readouterr().out
    broken.write_text('J = [1 2\n')
    assert main(['compare', 'craig_3r', str(broken)]) == 2
    assert capsys.readouterr().err.startswith(f'{broken}:1:8: ')
    assert main(['compare', 'craig_3r', str(tmp_path / 'none.txt')]) == 2
    assert 'none.txt: cannot be read' in capsys.readouterr().err
    assert main(['compare', 'nobody', str(broken)]) == 2
    assert "no robot 'nobody'" in capsys.readouterr().err
    broken.write_bytes(b'T = \xff')
    assert main(['compare', 'craig_3r', str(broken)]) == 2
    assert 'broken.txt:1: not UTF-8' in capsys.readouterr().err
    # As Windows' Notepad and spreadsheets save Unicode text.
    for encoding in ('utf-16', 'utf-8-sig'):
        broken.write_bytes('J = [1 2\n'.encode(encoding))
        assert main(['compare', 'craig_3r', str(broken)]) == 2
        assert 'broken.txt:1:8: ' in capsys.readouterr().err


@pytest.mark.parametrize('left', ['det(J)', 'det J', r'\det(J_v)', r'\det\left(J\right)', 'det'])
def test_a_determinant_is_named_as_people_write_it(left):
    (right,) = verdicts('craig_3r', f'{left} = L2 L3 s3 (L1+L2 c2+L3 c23)')
    assert right.status == 'agrees'
    assert right.name.startswith(('det', r'\det'))


def test_a_wrong_determinant_differs():
    (wrong,) = verdicts('craig_3r', 'det(J) = L2 L3 s3 (L1+L2 c2-L3 c23)')
    assert (wrong.name, wrong.status) == ('det(J)', 'differs')


@pytest.mark.parametrize('left', ['det(T)', 'det(J_2)', "det(J J')"])
def test_another_determinant_is_refused_with_the_one_that_is_known(left):
    (fault,) = compare(ks.load_robot('craig_3r'), f'{left} = 1').faults
    assert fault.code == 'unsupported'
    assert 'det(J)' in fault.message


def test_json(capsys):
    assert main(['compare', 'anthropomorphic_3r', str(FORMULAS / 'e0_2.txt'), '--json']) == 1
    found = json.loads(capsys.readouterr().out)
    assert (found['robot'], found['agrees']) == ('anthropomorphic_3r', False)
    assert (found['passed_over'], found['random_constants']) == ([], [])
    (formula,) = [f for f in found['formulas'] if f['status'] == 'differs']
    assert [(e['row'], e['column']) for e in formula['entries']] == [(1, 1), (2, 1), (3, 1)]
    assert formula['causes'][0]['entries'] == [[1, 1], [2, 1], [3, 1]]


def test_json_has_the_codes_of_faults(capsys, tmp_path):
    file = tmp_path / 'formulas.txt'
    file.write_text('J = [1 2\n')
    assert main(['compare', 'craig_3r', str(file), '--json']) == 2
    out, err = capsys.readouterr()
    error = json.loads(out)['error']
    assert (error['code'], error['message']) == ('formula', err.rstrip('\n'))
    (fault,) = error['faults']
    assert fault.pop('message') in err
    assert fault == {'file': str(file), 'line': 1, 'column': 8, 'code': 'syntax'}
    file.write_text('a = 2\nx = L1*c1 + L2*c12')
    assert main(['compare', 'planar_2r', str(file), '--json']) == 0
    (unused,) = json.loads(capsys.readouterr().out)['passed_over']
    assert (unused['line'], unused['code']) == (1, 'unused')


def test_the_example_of_the_help_agrees_with_its_robot():
    from kinematics_service.apps.formulas.commands.compare import compare

    lines = (
        inspect.cleandoc(compare.__doc__)
        .split('mixed as you like:\n')[1]
        .split('\b')[0]
        .splitlines()
    )
    text = '\n'.join(line for line in lines if 'T_{12}' not in line)
    found = verdicts('craig_3r', text)
    assert [v.name for v in found if v.status == 'differs'] == ['the singular set']


def test_formulas_from_a_pipe(monkeypatch, capsys):
    piped = io.BytesIO(b'p = [L1*c1 + L2*c12; L1*s1 + L2*s12; 0]')
    monkeypatch.setattr(sys, 'stdin', io.TextIOWrapper(piped))
    assert main(['compare', 'planar_2r', '-']) == 0
    out, err = capsys.readouterr()
    assert out.startswith('<stdin> against planar_2r: ')
    assert not err


@pytest.mark.parametrize(
    'formula',
    [
        r'{}^{0}T_{2} = A_1 A_2',
        '{}^1 T_2 = A_2',
        '$^0T_2 = {}^0T_1 {}^{1}T_{2}$',
        '{}^{0}_{2}T = A_1 A_2',
        '{}^0A_2 = A_1 {}^1A_2',
        'J(q) = [-L1 s1 - L2 s12, -L2 s12; L1 c1 + L2 c12, L2 c12]',
        r'T(\theta_1, \theta_2) &= A_1 A_2',
    ],
)
def test_frames_and_functions_are_written_as_in_papers(formula):
    (verdict,) = verdicts('planar_2r', formula)
    assert verdict.name in formula
    assert verdict.status == 'agrees'


def test_a_power_of_a_frame_is_no_index_before_it():
    (verdict,) = verdicts('planar_2r', 'x = L1 c1^2/c1+L2 c12 ^2/c12')
    assert verdict.status == 'agrees'
    (wrong,) = verdicts('planar_2r', '{}^0T_2 = A_1')
    assert wrong.status == 'differs'


def test_a_function_written_onto_its_joint_is_said():
    (fault,) = compare(ks.load_robot('planar_2r'), 'x = L1 cosq1+L2 c12').faults
    assert (fault.line, fault.column, fault.code) == (1, 8, 'unknown-name')
    assert "'cos(q1)'" in fault.message
