# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Lengths that are decimals: what cancels is 0, what all but cancels is not."""

import functools

import numpy as np
import pytest
import sympy
from refusal import refused

import kinematics_service as ks
from kinematics_service.apps.formulas.compare.comparison import compare
from kinematics_service.apps.formulas.derive.path import parse_path

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


SCREW = """
robot: screw
convention: modified
units: {length: mm, angle: deg}
constants: {tilt: 25, reach: 350}
base: {frame: base_link, xyz: [0, reach/7, 0], rpy: [tilt, 0, 0]}
joints:
  - {name: q1, type: revolute}
  - {name: q2, type: helical}
links:
  - {a: 0,     alpha: 0,  d: 40,           theta: q1 + 15}
  - {a: reach, alpha: 90, d: 0.3*q2 + 20,  theta: q2}
"""


@functools.cache
def screw():
    return ks.derive(ks.robot_from_text(SCREW))


def test_a_screw_in_degrees_and_millimetres_moves_as_the_library_says():
    derivation = screw()
    robot = derivation.robot
    q = [0.4, -1.1]
    values = {**dict(zip(derivation.variables, q)), **derivation.names.values}
    scale = np.array([[1e-3]] * 3 + [[1.0]] * 3)
    J = np.array(derivation.jacobian.subs(values).evalf(), dtype=float) * scale
    np.testing.assert_allclose(J, ks.jacobian(robot, q), rtol=0, atol=1e-15)
    p = np.array(derivation.position.subs(values).evalf(), dtype=float)[:, 0] * 1e-3
    np.testing.assert_allclose(p, ks.forward_kinematics(robot, q)[:3, 3], rtol=0, atol=1e-15)


TURNED = """
robot: turned
convention: shape
joints:
  - {name: q1, type: revolute}
links:
  - joint: Rz(q1)
    in: [[1/2, -sqrt(3)/2, 0, 0.1], [sqrt(3)/2, 1/2, 0, 0.2], [0, 0, 1, 0], [0, 0, 0, 1]]
    out: [%s, [0, 0, 0, 1]]
"""


def test_a_matrix_of_exact_entries_turns_as_the_library_says():
    # Pitched by 90 degrees, where roll and yaw are one turn.
    out = '[0, 1/2, sqrt(3)/2, 0.3], [0, sqrt(3)/2, -1/2, 0], [-1, 0, 0, 0.1]'
    robot = ks.robot_from_text(TURNED % out)
    derivation = ks.derive(robot)
    p = derivation.position.subs(derivation.variables[0], 0.4).evalf()
    there = ks.forward_kinematics(robot, [0.4])[:3, 3]
    np.testing.assert_allclose(np.array(p, dtype=float)[:, 0], there, rtol=0, atol=1e-15)


def test_an_angle_of_the_base_alone_is_in_the_units_of_the_formulas():
    text = 'R_0 = [1 0 0; 0 cos(tilt) -sin(tilt); 0 sin(tilt) cos(tilt)]\n'
    found = compare(ks.robot_from_text(SCREW), text + 'o_0 = [0; reach/7; 0]\n')
    assert not found.faults
    assert found.agrees
    assert found.randomised == ('tilt', 'reach')


def test_a_path_is_of_time_and_lengths_alone():
    derivation = screw()
    with refused(ks.DerivationError, 'unknown-name', 'q1', "'q2'"):
        parse_path('q1=q2, q2=t', derivation)
