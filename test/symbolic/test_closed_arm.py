"""Arms with closed loops in symbols, against the golden numbers and the library."""

import json

import numpy as np
import pytest
import sympy
from folders import GOLDEN, ROOT

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.symbolic.closed_arm import derive_closed
from kinematics_service.symbolic.output.closed_text import closed_text

# Products of a dozen rounded sines.
EVALUATED = 1e-11


def numbers_of(derivation, expression):
    """Return a function of q and psi that evaluates an expression with the file's constants."""
    description = derivation.robot.description
    values = {sympy.Symbol(c.name, real=True): c.value for c in description.constants}
    symbols = [*derivation.variables]
    symbols += [symbol for loop in derivation.loops for symbol in loop.passive]
    return sympy.lambdify(symbols, expression.subs(values), 'numpy')


@pytest.mark.slow
def test_the_general_loop_of_the_source_document():
    derivation = derive_closed(ks.load_robot('four_bar_arm'))
    (loop,) = derivation.loops
    L3, L4 = sympy.symbols('L3 L4', real=True)
    assert sympy.simplify(loop.determinant - L3 * L4 * sympy.sin(loop.passive[1])) == 0
    T, J, det = (
        numbers_of(derivation, expression)
        for expression in (derivation.T, derivation.jacobian, derivation.determinant)
    )
    gap = numbers_of(derivation, sympy.Matrix(loop.equations))
    configs = json.loads((GOLDEN / 's000b_x_general_loop.json').read_text())['configs']
    assert {config['branch'] for config in configs} == {1, -1}
    for config in configs:
        at = [*config['q'], config['passive_psi1'], config['passive_psi2']]
        np.testing.assert_allclose(gap(*at), 0.0, rtol=0, atol=EVALUATED)
        np.testing.assert_allclose(T(*at), config['T'], rtol=0, atol=EVALUATED)
        np.testing.assert_allclose(J(*at), config['J'], rtol=0, atol=EVALUATED)
        assert det(*at) == pytest.approx(config['task_det'], abs=EVALUATED)


@pytest.mark.slow
@pytest.mark.parametrize('name', ['five_bar', 'crank_slider'])
def test_symbols_and_library_agree(name):
    robot = ks.load_robot(name)
    derivation = derive_closed(robot)
    coupling, det, closing = (
        numbers_of(derivation, expression)
        for expression in (
            derivation.coupling,
            derivation.determinant,
            derivation.loops[0].determinant,
        )
    )
    for pose in robot.description.known_poses[:3]:
        state, found = ks.evaluate(robot, pose.q), ks.singularity(robot, pose.q)
        at = [*pose.q, *state.closure.passive]
        n = robot.dof
        np.testing.assert_allclose(
            coupling(*at)[n:], state.closure.coupling, rtol=0, atol=EVALUATED
        )
        assert det(*at) == pytest.approx(found.determinant, abs=EVALUATED)
        assert closing(*at) == pytest.approx(state.closure.determinants[0], abs=EVALUATED)


@pytest.mark.slow
def test_what_is_too_long_to_simplify_or_to_multiply_out_stays_as_it_is():
    page = (ROOT / 'docs' / 'tutorials' / 'palletizer.md').read_text(encoding='utf-8')
    text = page.split(':caption: palletizer.yaml\n')[1].split('```')[0]
    robot = ks.robot_from_text(text)
    derivation = derive_closed(robot)
    assert derivation.determinant is None
    said = closed_text(derivation)
    assert (
        'The determinant of the arm, rows x y z rz, is that of these rows of J. It is not\n'
        'multiplied out: that is done of 6 joints and passive ones at most.\n'
        'Here are 10.\n'
    ) in said
    coupling, J = (numbers_of(derivation, m) for m in (derivation.coupling, derivation.jacobian))
    for q in ([0.3, 1.9, 2.9, 0.5], [-1.0, 1.2, 3.3, 2.0]):
        state = ks.evaluate(robot, q)
        at = [*q, *state.closure.passive]
        np.testing.assert_allclose(
            coupling(*at)[4:], state.closure.coupling, rtol=0, atol=EVALUATED
        )
        np.testing.assert_allclose(J(*at), state.jacobian, rtol=0, atol=EVALUATED)


@pytest.mark.slow
def test_derive_writes_the_equations(capsys):
    assert main(['derive', 'crank_slider']) == 0
    text = capsys.readouterr().out
    assert '  0 = crank*sin(q) + rod*sin(psi + q)\n' in text
    assert '  rod*cos(psi + q)\n' in text
    assert main(['derive', 'crank_slider', '--format', 'json']) == 2
    assert 'an arm with closed loops is derived as text' in capsys.readouterr().err
