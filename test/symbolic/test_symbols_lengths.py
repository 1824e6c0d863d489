"""Lengths that are decimals: what cancels is 0, what all but cancels is not."""

import pytest
import sympy

import kinematics_service as ks

BOOM = """
robot: boom
convention: elementary
joints:
  - {name: q1, type: revolute}
  - {name: q2, type: revolute}
  - {name: d3, type: prismatic, limits: [0, 1]}
links: [Rz(q1), Tx(0.1), Tx(0.2), Tx(%s), Ry(q2), Tz(d3)]
singularity: {task: [x, y, z]}
"""


def factors(text):
    """Return factors and their powers."""
    found = ks.derive(ks.robot_from_text(text)).singular_set.factors
    return {str(factor.expression): factor.power for factor in found}


def test_decimals_that_cancel_hide_no_factor():
    # In binary 0.1 + 0.2 - 0.3 is 5.6e-17; with it d3 sin(q2) would be irreducible.
    assert factors(BOOM % '-0.3') == {'sin(q2)': 1, 'd3': 2}


@pytest.mark.slow
def test_decimals_that_all_but_cancel_make_no_factor():
    found = factors(BOOM % '-0.3000000001')
    assert found.pop('d3') == 1
    ((text, power),) = found.items()
    d3, q2 = sympy.symbols('d3 q2')
    assert sympy.expand(sympy.sympify(text) - d3 * sympy.sin(q2)) == -sympy.Rational(1, 10**10)
    assert power == 1


@pytest.mark.slow
def test_a_determinant_of_numbers_keeps_its_letters():
    # With the Panda's lengths multiplied out some coefficients are neither real nor imaginary.
    locked = ks.derive(ks.load_robot('panda'), {'q5': '0'})
    assert len(locked.factors) == 3
