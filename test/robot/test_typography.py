# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Signs of PDF files and word processors in robot files, and what is told of homework's slips."""

import math

import pytest

from kinematics_service.errors import RobotFileError
from kinematics_service.robot.file.reader import parse_robot
from kinematics_service.typography import GREEK, plain_names, plain_signs

FILE = """\
robot: paper
source: a lecture's slides
convention: standard
units: {{angle: {unit}, length: m}}
constants: {{L1: 0.4, L_2: 0.3, tilt: {tilt}}}
joints:
  - {{name: a, variable: {first}, type: revolute, limits: {limits}}}
  - {{name: b, variable: q2, type: revolute}}
links:
  - {{a: {a}, alpha: {alpha}, d: 0.1, theta: {theta}}}
  - {{a: L_2, alpha: tilt, d: 0, theta: q2}}
{more}
"""
USUAL = {
    'unit': 'rad', 'tilt': '0', 'first': 'q1', 'limits': '[-3, 3]', 'a': 'L1', 'alpha': '0',
    'theta': 'q1', 'more': '',
}  # fmt: skip


def arm(**changed):
    return parse_robot(FILE.format(**{**USUAL, **changed}), 'paper.yaml')


def faults(**changed):
    with pytest.raises(RobotFileError) as caught:
        arm(**changed)
    return caught.value.faults


def row(description, index=0):
    link = description.links[index]
    return dict(zip(link.names, (motion.argument for motion in link.motions), strict=True))


@pytest.mark.parametrize('minus', '−‐‑‒–﹣－')
def test_a_typographic_minus_is_a_minus(minus):
    for space in ('', '\u00a0', '\u2009', '\u202f', '\u200b'):
        alpha = row(arm(alpha=f'"{space}{minus}{space}0.5"'))['alpha']
        assert alpha.affine.constant == -0.5
        assert alpha.text.isascii()


@pytest.mark.parametrize(
    ('written', 'plain'),
    [
        ('L1·2', 'L1*2'),
        ('2×L1', '2*L1'),
        ('2⋅L1', '2*L1'),
        ('2∗L1', '2*L1'),
        ('L1⁄2', 'L1/2'),
        ('L1∕2', 'L1/2'),
        ('L1÷2', 'L1/2'),
        ('L₁', 'L1'),
        ('L_1', 'L1'),
        ('L2 + L₂', 'L_2 + L_2'),
        ('𝐿1', 'L1'),
    ],
)
def test_typographic_lengths(written, plain):
    assert row(arm(a=written))['a'] == row(arm(a=plain))['a']


@pytest.mark.parametrize('name', ['θ1', 'θ_1', 'θ₁', 'ϑ1', '𝜃1', 'theta_1', 'theta1'])
@pytest.mark.parametrize('known', ['theta1', 'theta_1'])
def test_a_greek_variable_has_one_name(name, known):
    theta = row(arm(first=known, theta=f'{name} − π/2'))['theta']
    assert theta.text == f'{known} - pi/2'
    assert theta.affine.coefficients == ((known, 1.0),)


def test_names_that_differ_by_an_underscore_are_two_where_both_are_known():
    description = parse_robot(
        FILE.format(**{**USUAL, 'a': 'L_1'}).replace('L1: 0.4', 'L1: 0.4, L_1: 0.9'), 'paper.yaml'
    )
    assert row(description)['a'].affine.constant == 0.9


def test_exponents_are_no_names():
    text = FILE.format(**{**USUAL, 'a': '1e2/1e3'}).replace('L1: 0.4', 'L1: 0.4, e_2: 7')
    assert row(parse_robot(text, 'paper.yaml'))['a'].affine.constant == 0.1


@pytest.mark.parametrize('unit', ['rad', 'deg'])
def test_a_degree_sign_means_degrees_in_either_unit(unit):
    for degrees in ('90', '0', '-90', '45', '30', '360', '22.5', '37.3', '.5', '1080'):
        description = arm(unit=unit, alpha=f'{degrees}°', tilt=f'{degrees} º')
        for index in (0, 1):
            value = row(description, index)['alpha'].affine.constant
            assert value == pytest.approx(math.radians(float(degrees)), rel=4e-16, abs=0)


@pytest.mark.parametrize(
    ('text', 'value'),
    [
        ('1/90°', 2 / math.pi),
        ('1/-90°', -2 / math.pi),
        ('90°/2', math.pi / 4),
        ('2*120°', 4 * math.pi / 3),
        ('90° - 30°', math.pi / 3),
        ('-(45° + 45°)', -math.pi / 2),
        ('sin(30°)', 0.5),
    ],
)
def test_degrees_inside_expressions(text, value):
    assert row(arm(alpha=f'"{text}"'))['alpha'].affine.constant == pytest.approx(value, rel=1e-15)


def test_degrees_stay_exact_for_the_derivation():
    # The derivation reads the text.
    with_sign = row(arm(theta='q1 + 90°', alpha='−60°'))
    assert [with_sign[name].text for name in ('theta', 'alpha')] == ['q1 + pi/2', '-pi/3']


def test_degrees_in_limits_poses_tool_and_factors():
    description = arm(
        limits='[−170°, 170°]',
        more='tool: {xyz: [0, 0, −0.1], rpy: [180°, 0, −90°]}\n'
        'known_poses: [{q: [90°, 0], xyz: [0, 0, 1]}]\n'
        'singularity: {factors: [{name: f, expression: "sin(q_2 − 90°)"}]}',
    )
    assert description.joints[0].lower == pytest.approx(math.radians(-170), rel=4e-16)
    assert description.known_poses[0].q[0] == math.pi / 2
    assert description.singularity.factors[0].text == 'sin(q2 - pi/2)'
    assert description.tool.motion.matrix[2, 3] == -0.1


@pytest.mark.parametrize('length', ['90°', 'L1 + 90°', '2*(L1 - 90°)', 'sqrt(90°)', '0.01*90°'])
def test_degrees_are_refused_where_a_length_is_expected(length):
    (fault,) = faults(a=length)
    assert (fault.where, fault.code) == ('links[0].a', 'wrong-unit')
    assert "'90°'" in fault.message


def test_degrees_inside_a_sine_make_a_length():
    value = row(arm(a='L1*cos((30° + 30°))'))['a'].affine.constant
    assert value == pytest.approx(0.2, rel=1e-15)


@pytest.mark.parametrize(
    ('place', 'text', 'code', 'word'),
    [
        ('a', '"0,4"', 'decimal-comma', 'write 0.4'),
        ('theta', '"q1 + 1,57"', 'decimal-comma', 'write 1.57'),
        ('theta', 'q1*', 'syntax', 'write q1'),
        ('theta', 'q1 + -', 'syntax', 'write q1'),
        ('theta', 'theta1', 'unknown-name', "'q1'?"),
        ('theta', 'θ₁', 'unknown-name', "'q1'?"),
        ('theta', 'T1', 'unknown-name', "'q1'?"),
        ('a', 'l_1', 'unknown-name', "'L1'?"),
        ('theta', '2q1', 'not-a-number', 'write 2*q1'),
        ('theta', 'sin q1', 'syntax', 'write sin(q1)'),
        ('theta', 'sinq1', 'unknown-name', "'sin(q1)'?"),
        ('alpha', 'pi2', 'unknown-name', "'pi/2'?"),
        ('alpha', '90 deg', 'unit-in-number', 'write 90°'),
        ('alpha', '90deg', 'unit-in-number', 'write 90°'),
        ('a', '400 mm', 'unit-in-number', 'write 400'),
        ('a', 'L1²', 'syntax', 'write x*x'),
        ('alpha', '(1 + 2)°', 'syntax', 'write 90°'),
        ('alpha', '1e999999999°', 'not-finite', '1e999999999'),
        ('theta', '°', 'syntax', 'write 90°'),
    ],
)
def test_slips_of_homework_are_told_what_to_write(place, text, code, word):
    (fault,) = [one for one in faults(**{place: text}) if one.code != 'unused-joint']
    assert (fault.where, fault.code) == (f'links[0].{place}', code)
    assert word in fault.message


def test_a_row_without_names_is_told_with_them():
    text = FILE.format(**USUAL).replace('{a: L_2, alpha: tilt, d: 0, theta: q2}', '[1, 0, 0, q2]')
    with pytest.raises(RobotFileError) as caught:
        parse_robot(text, 'paper.yaml')
    assert caught.value.faults[0].code == 'wrong-type'
    assert '{a: 1, alpha: 0, d: 0, theta: q2}' in caught.value.faults[0].message


def test_decimal_commas_in_braces_are_asked_about():
    (fault,) = faults(a='0,4')
    assert (fault.where, fault.code) == ("links[0]['4']", 'decimal-comma')


def test_decimal_commas_in_a_list_are_asked_about():
    (fault,) = faults(more='tool: {xyz: [0,4, 0,2, 0,1]}')
    assert (fault.where, fault.code) == ('tool.xyz', 'wrong-length')
    assert 'point: 0.4' in fault.message


def test_elementary_motions_and_loops_are_read_in_the_same_way():
    for name, written in (('q_1', 'q1'), ('q1', 'q_1')):
        text = (
            'robot: e\nsource: x\nconvention: elementary\n'
            f'joints: [{{name: {name}, type: revolute}}]\n'
            f'links: [Rz({written}\u00a0−\u00a090°), Tx(1⁄2)]\n'
        )
        description = parse_robot(text, 'e.yaml')
        assert [motion.argument.text for motion in description.links] == [f'{name} - pi/2', '1/2']


def test_plain_text_is_plain():
    assert plain_signs('θ₁ − 90º') == 'θ₁ - 90°'
    assert plain_names('Σ⁄θ₁₂') == 'Sigma/theta12'
    assert all(name.isascii() and len(letter) == 1 for letter, name in GREEK.items())
