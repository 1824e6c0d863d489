# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Arms with closed loops in symbols, against the golden numbers and the library."""

import functools
import json

import numpy as np
import pytest
import sympy
from folders import GOLDEN, ROOT
from refusal import refused

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.formulas.arm.numbers import Evaluation
from kinematics_service.apps.formulas.derive.closed_loops import loops_of
from kinematics_service.apps.formulas.derive.derivation import exact_of
from kinematics_service.apps.formulas.derive.output.documents import document_of
from kinematics_service.apps.formulas.derive.output.report import report_of
from kinematics_service.apps.formulas.derive.output.text import text_of
from kinematics_service.robot.loops import opened

# Products of a dozen rounded sines.
EVALUATED = 1e-11


# Several tests look at one derivation.
derived = functools.cache(ks.derive)


def evaluation(derivation, at):
    """Return the evaluation of expressions at rows of q and psi, with the file's constants."""
    description = derivation.robot.description
    symbols = [*derivation.variables]
    symbols += [symbol for loop in derivation.loops for symbol in loop.passive]
    values = dict(zip(symbols, np.transpose(at)))
    constants = {c.name: c.value for c in description.constants}
    values |= {sympy.Symbol(n, real=True): np.full(len(at), v) for n, v in constants.items()}
    return Evaluation(values, len(at))


@pytest.mark.slow
def test_the_general_loop_of_the_source_document():
    derivation = derived('four_bar_arm')
    (loop,) = derivation.loops
    L3, L4 = sympy.symbols('L3 L4', real=True)
    assert loop.determinant == L3 * L4 * sympy.sin(loop.passive[1])
    # Sines of sums of angles, in which what cancels is seen.
    assert str(loop.coupling[0, 1]) == '-(L2*sin(psi1 + psi2) + L3*sin(psi2))/(L3*sin(psi2))'
    assert str(loop.coupling[1, 2]) == (
        '-L1*(L3*sin(psi1 + theta2 - theta3) + L4*sin(psi1 + psi2 + theta2 - theta3))'
        '/(L3*L4*sin(psi2))'
    )
    configs = json.loads((GOLDEN / 's000b_x_general_loop.json').read_text())['configs']
    assert {config['branch'] for config in configs} == {1, -1}
    at = [[*config['q'], config['passive_psi1'], config['passive_psi2']] for config in configs]
    numbers = evaluation(derivation, at)
    for matrix, expected in (
        (sympy.ImmutableMatrix(loop.equations), 0.0),
        (derivation.T, [config['T'] for config in configs]),
        (derivation.jacobian, [config['J'] for config in configs]),
    ):
        np.testing.assert_allclose(numbers.of_matrix(matrix), expected, rtol=0, atol=EVALUATED)
    determinants = [config['task_det'] for config in configs]
    assert numbers.of(derivation.determinant) == pytest.approx(determinants, abs=EVALUATED)


@pytest.mark.slow
@pytest.mark.parametrize('name', ['five_bar', 'crank_slider'])
def test_symbols_and_library_agree(name):
    derivation = derived(name)
    robot = derivation.robot
    for pose in robot.description.known_poses[:3]:
        state, found = ks.evaluate(robot, pose.q), ks.singularity(robot, pose.q)
        numbers = evaluation(derivation, [[*pose.q, *state.closure.passive]])
        (coupling,) = numbers.of_matrix(derivation.loop_coupling)
        np.testing.assert_allclose(
            coupling[robot.dof :], state.closure.coupling, rtol=0, atol=EVALUATED
        )
        (closing,) = numbers.of(derivation.loops[0].determinant)
        assert closing == pytest.approx(state.closure.determinants[0], abs=EVALUATED)
        (determinant,) = numbers.of(derivation.determinant)
        assert determinant == pytest.approx(found.determinant, abs=EVALUATED)


@pytest.mark.slow
def test_what_is_too_long_to_simplify_or_to_multiply_out_stays_as_it_is():
    page = (ROOT / 'docs' / 'tutorials' / 'palletizer.md').read_text(encoding='utf-8')
    text = page.split(':caption: palletizer.yaml\n')[1].split('```')[0]
    # Without its first loop: the last one follows the second, by products that are too long.
    table, rest = text.split('  - name: crank_loop\n')
    text = table + '  - name: lower_rods\n' + rest.split('  - name: lower_rods\n')[1]
    for old, new in (
        ('-elbow', '-q3'),
        # As the crank: the upper rods are never flat.
        ('[pi/4, 3*pi/4]', '[3*pi/8, 5*pi/8]'),
        ('[3*pi/4, 5*pi/4]', '[-5*pi/8, -3*pi/8]'),
        ('pi/2, pi, 0]', 'pi/2, -pi/2, 0]'),
    ):
        assert old in text
        text = text.replace(old, new)
    robot = ks.robot_from_text(text)
    derivation = ks.derive(robot)
    assert derivation.determinant is None
    said = text_of(report_of(derivation))
    assert 'It is not multiplied out' in said
    assert 'Here are 8.' in said
    for q in ([0.3, 1.9, -1.2, 0.5], [-1.0, 1.2, -1.9, 2.0]):
        state = ks.evaluate(robot, q)
        numbers = evaluation(derivation, [[*q, *state.closure.passive]])
        (coupling,) = numbers.of_matrix(derivation.loop_coupling)
        np.testing.assert_allclose(coupling[4:], state.closure.coupling, rtol=0, atol=EVALUATED)
        (J,) = numbers.of_matrix(derivation.jacobian)
        np.testing.assert_allclose(J, state.jacobian, rtol=0, atol=EVALUATED)


@pytest.mark.slow
def test_derive_writes_the_equations(capsys):
    assert main(['derive', 'crank_slider']) == 0
    text = capsys.readouterr().out
    assert '  0 = crank*sin(q) + rod*sin(psi + q)\n' in text
    assert '  D = rod*cos(psi + q)\n' in text
    assert '  det J = crank*sin(psi)/cos(psi + q)\n' in text
    assert main(['derive', 'crank_slider', '--lock', 'q=0']) == 2
    said = capsys.readouterr().err
    assert all(word in said for word in ('crank_slider', '--lock', '--path'))


@pytest.mark.slow
def test_every_format_has_the_loops():
    for format in ('latex', 'markdown', 'html'):
        document = document_of(derived('crank_slider'), format)
        assert 'slider_crank' in document.replace('\\', '')
    document = json.loads(document_of(derived('crank_slider'), 'json'))
    (loop,) = document['loops']
    assert loop['passive'] == ['psi', 'slider']
    assert loop['determinant'] == 'rod*cos(psi + q)'
    assert document['determinant'] == 'crank*sin(psi)/cos(psi + q)'
    assert document['factors'] == []
    assert document['complete'] is False


def test_joints_of_an_arm_with_loops_are_not_locked():
    with refused(ks.DerivationError, 'unsupported', 'crank_slider'):
        ks.derive('crank_slider', locked={'q': '0'})


def test_loops_that_need_each_other_are_not_derived():
    with refused(ks.DerivationError, 'unsupported', "'arm1', 'arm2', 'arm3'"):
        ks.derive('flexpicker')


@pytest.mark.slow
def test_the_jacobian_in_tool_axes_is_by_the_joints():
    derivation = derived('five_bar')
    robot = derivation.robot
    pose = robot.description.known_poses[0]
    at = [[*pose.q, *ks.evaluate(robot, pose.q).closure.passive]]
    (J,) = evaluation(derivation, at).of_matrix(derivation.jacobian_in('tool'))
    expected = ks.jacobian(robot, pose.q, axes='tool')
    np.testing.assert_allclose(J, expected, rtol=0, atol=EVALUATED)
    assert [str(v) for v in derivation.variables] == ['q1', 'q2']


ROTATED = """
robot: rotated
convention: standard
constants: {D: 0.3, rod: 0.3}
joints:
  - {name: q1, type: revolute}
links:
  - {alpha: 0, a: rod, d: 0, theta: q1}
  - {alpha: 0, a: D, d: 0, theta: psi1}
loops:
  - name: rods
    passive: [psi1, psi2, psi3]
    from: {row: 0, xyz: [D, 0, 0]}
    links:
      - {alpha: 0, a: rod, d: 0, theta: psi2}
      - {alpha: 0, a: 0, d: 0, theta: psi3}
    meets: {row: 2}
    rows: [x, y, rz]
    assembled: {q: [1.2], psi1: -1.2, psi2: 1.2, psi3: -1.2}
"""


def test_a_loop_that_holds_a_rotation_has_the_kernels_determinant():
    robot = ks.robot_from_text(ROTATED)
    arithmetic = exact_of(robot).arithmetic
    (loop,) = loops_of(robot, opened(robot.description), arithmetic, lambda _: None)
    state = ks.evaluate(robot, [0.8])
    values = dict(zip(arithmetic.names.variables, [0.8, *state.closure.passive]))
    values |= arithmetic.names.values
    found = loop.determinant.subs(values)
    assert float(found) == pytest.approx(state.closure.determinants[0], abs=EVALUATED)
