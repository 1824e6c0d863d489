# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Offsets of joint angles that are no quarter turns: derived in theta = q + offset, as exactly."""

import functools
import math
import re

import numpy as np
import pytest
import sympy
from derivations import derived, marked

import kinematics_service as ks
from kinematics_service.apps.formulas.arm.numbers import Evaluation
from kinematics_service.apps.formulas.derive.file_factors import (
    checked_text,
    disagreement,
    factors_to_write,
)
from kinematics_service.apps.formulas.derive.output.json_output import json_of
from kinematics_service.apps.formulas.derive.output.report import Equation, report_of
from kinematics_service.robot.bundled import find_robot_file
from kinematics_service.robot.file.writing.writer import with_factors

ARMS = ['anthropomorphic_3r', 'spherical_rrp', 'parallelogram_left']
OFFSETS = ['0.0173', '-1.2346', '0.37', 'pi/2 + 0.011', '-2.04', '0.9']
ROUND_OFF = 1e-12


def shifted_text(name):
    """Return the file of a bundled arm with offsets on its joints, without factors and poses."""
    head = re.split(r'\n(?:singularity|known_poses):', find_robot_file(name).read_text())[0]
    task = ks.load_robot(name).description.singularity.task
    given = iter(OFFSETS)
    lines = [
        re.sub(
            r'(theta: *)([^,}]*[a-zA-Z][^,}]*)', lambda m: f'{m[1]}{m[2]} + {next(given)}', line
        )
        for line in head.splitlines()
    ]
    rows = f'singularity:\n  task: [{", ".join(task)}]\n' if task else ''
    return '\n'.join(lines) + '\n' + rows


@functools.cache
def shifted(name):
    """Return the derivation of that arm."""
    return ks.derive(ks.robot_from_text(shifted_text(name)))


@pytest.mark.slow
@pytest.mark.parametrize('name', marked([name for name in ARMS if name != 'parallelogram_left']))
def test_offsets_leave_the_factors_as_they_are(name):
    plain, moved = derived(name), shifted(name)
    assert moved.angles
    back = {theta: next(iter(angle.free_symbols)) for theta, angle in moved.angles.items()}
    found = [moved.in_angles(f).xreplace(back) for f in moved.factors.values()]
    assert found == list(plain.factors.values())
    ours = [(f.rank, f.lost, f.idle, f.irreducible) for f in moved.singular_set.factors]
    theirs = [(f.rank, f.lost, f.idle, f.irreducible) for f in plain.singular_set.factors]
    assert ours == theirs


def test_an_offset_that_is_an_arc_tangent_goes_into_the_file():
    text = """
robot: bent
convention: standard
joints:
  - {name: q1, type: revolute}
  - {name: q2, type: revolute}
links:
  - {a: 0.3, alpha: 0, d: 0, theta: q1}
  - {a: 0.2, alpha: 0, d: 0, theta: "q2 + atan2(1, 3)"}
"""
    d = ks.derive(ks.robot_from_text(text))
    assert factors_to_write(d) == {'elbow': 'sin(q2 + atan2(1/3, 1))'}
    written = with_factors(text, factors_to_write(d))
    checked_text(d, written)
    straight = [0.4, -math.atan2(1, 3)]
    factors = ks.singularity(ks.robot_from_text(written), straight).factors
    assert factors.names == ('elbow',)
    assert factors.estimates[0] < ROUND_OFF


def test_a_calibrated_twist_is_taken_as_it_is():
    # Axes 2 and 3 of the nominal table are parallel; here they are 0.1 mrad off.
    nominal = re.split(
        r'\n(?:singularity|known_poses):', find_robot_file('anthropomorphic_3r').read_text()
    )[0]
    text = nominal.replace('alpha: 0,    a: L2', 'alpha: 0.0001, a: L2') + '\n'
    assert text != nominal + '\n'
    d = ks.derive(ks.robot_from_text(text))
    shoulder, elbow = d.factors.values()
    (theta3,) = elbow.free_symbols
    assert elbow == sympy.sin(theta3)
    assert shoulder.has(sympy.cos(sympy.Rational(1, 10000)))
    written = with_factors(text, factors_to_write(d))
    assert disagreement(d, ks.robot_from_text(written)) <= ROUND_OFF


@pytest.mark.slow
@pytest.mark.parametrize('name', marked(ARMS))
def test_the_jacobian_in_joint_variables_is_the_librarys(name):
    moved = shifted(name)
    assert not any(moved.methods.values())
    q = np.random.default_rng(3).uniform(-1.0, 1.0, len(moved.variables))
    values = dict(zip([*moved.variables, *moved.names.values], [*q, *moved.names.values.values()]))
    (J,) = Evaluation({s: np.array([v]) for s, v in values.items()}, 1).of_matrix(moved.jacobian)
    np.testing.assert_allclose(J, ks.jacobian(moved.robot, q), rtol=0, atol=ROUND_OFF)


@pytest.mark.slow
@pytest.mark.parametrize('name', marked(ARMS))
def test_factors_with_offsets_go_into_the_file(name):
    moved = shifted(name)
    text = with_factors(shifted_text(name), factors_to_write(moved))
    checked_text(moved, text)
    assert disagreement(moved, ks.robot_from_text(text)) < ROUND_OFF


def test_degrees_are_written_as_degrees():
    text = """
robot: arm
convention: standard
units: {angle: deg, length: m}
joints:
  - {name: j1, variable: q1, type: revolute}
  - {name: j2, variable: q2, type: revolute}
links:
  - {a: 0.5, alpha: 0, d: 0, theta: q1 - 4.5}
  - {a: 0.3, alpha: 0, d: 0, theta: q2 + 13.5}
"""
    derivation = ks.derive(ks.robot_from_text(text))
    assert factors_to_write(derivation) == {'elbow': 'sin(q2 + 13.5)'}
    checked_text(derivation, with_factors(text, factors_to_write(derivation)))


def test_solutions_are_given_in_both():
    moved = shifted('anthropomorphic_3r')
    elbow = next(f for f in moved.singular_set.factors if f.name == 'elbow')
    k = sympy.Symbol('k', integer=True)
    third = moved.variables[2]
    assert elbow.family.solutions == (sympy.pi * k - sympy.Rational(37, 100),)
    rights = [(b.left, b.right) for b in report_of(moved) if isinstance(b, Equation)]
    assert (sympy.latex(third), sympy.pi * k - sympy.Rational(37, 100)) in rights
    theta = next(t for t, angle in moved.angles.items() if third in angle.free_symbols)
    assert (sympy.latex(theta), sympy.pi * k) in rights
    assert '"angles": {' in json_of(moved)


def test_the_symbol_of_an_angle_is_no_joints_or_lengths():
    moved = shifted('anthropomorphic_3r')  # its joints are theta1, theta2, theta3
    assert not {t.name for t in moved.angles} & set(moved.names.meanings)


def test_a_joint_with_several_offsets_keeps_what_one_angle_cannot_take():
    text = """
robot: arm
convention: standard
joints:
  - {name: q1, type: revolute}
  - {name: q2, type: revolute}
links:
  - {a: 0.5, alpha: 0, d: 0, theta: q1 + 0.2}
  - {a: 0.3, alpha: 0, d: 0, theta: q2 - q1 + 0.5}
"""
    derivation = ks.derive(ks.robot_from_text(text))
    assert [str(angle) for angle in derivation.angles.values()] == ['q1 + 1/5', 'q2 + 7/10']
    assert not any(derivation.methods.values())
    (factor,) = derivation.factors.values()
    q1, q2 = derivation.variables
    assert factor.equals(sympy.sin(q1 - q2 - sympy.Rational(1, 2))) or factor.equals(
        sympy.sin(q2 - q1 + sympy.Rational(1, 2))
    )
