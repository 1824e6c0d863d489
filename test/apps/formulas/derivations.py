# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Derivations the tests share: each arm is derived once."""

import functools
import json

import pytest
import sympy
from folders import GOLDEN

import kinematics_service as ks
from kinematics_service.apps.formulas.derive.derivation import exact_of

SYMBOLIC = json.loads((GOLDEN / 'symbolic.json').read_text())

# Golden system: bundled robots that are the same arm. So are offset_stanford_shape and
# six_joint_dh, whose poses are compared with these alone.
SYSTEMS = {
    's000a_anthropomorphic_dh': ('anthropomorphic_3r',),
    's000b_parallelogram_closed_loop': ('parallelogram_left', 'parallelogram_right'),
    's000c_spherical_rrp_dh': ('spherical_rrp',),
    's001_craig_3r_mdh': ('craig_3r',),
    's002_rrp_ets': ('rrp_elementary',),
    's003a_sheth_uicker_6dof': ('offset_stanford_dh',),
    's003b_dh_as_printed_6dof': ('offset_stanford_printed',),
    's003c_dh_matched_6dof': ('offset_stanford_dh',),
    's004a_six_joint_dh_generic': ('six_joint_dh_unit',),
    's004b_six_joint_dh_unit': ('six_joint_dh_unit',),
}


# One of each convention, and of coupled and sliding joints.
DISTINCT = ('craig_3r', 'parallelogram_left', 'rrp_elementary', 'scara_hsr065', 'shape')
# The first three rows of offset_stanford_shape.
SHAPE = """
robot: shape
convention: shape
constants: {h: 0.4, a: 0.15, l: 0.2}
joints:
  - {name: phi1, type: revolute}
  - {name: phi2, type: revolute}
  - {name: phi3, type: prismatic}
links:
  - {joint: Rz(phi1), out: [[1, 0, 0, -a], [0, 0, 1, -h], [0, -1, 0, 0], [0, 0, 0, 1]]}
  - {joint: Rz(phi2), out: [[1, 0, 0, -l], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]]}
  - {joint: Tx(phi3), out: [[0, 0, -1, 0], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]]}
"""


# Their derivations take less than a second.
SHORT = (
    *('anthropomorphic_3r', 'craig_3r', 'planar_2r', 'planar_3r', 'rrp_elementary'),
    *('parallelogram_left', 'parallelogram_right', 'scara_hsr065', 'spherical_rrp', 'shape'),
)


def marked(cases):
    """
    Return cases, each an arm or a tuple with one, and those of longer derivations slow.

    Which test is the first to derive an arm depends on what is selected.
    """
    rows = [(case,) if isinstance(case, str) else case for case in cases]
    slow = pytest.mark.slow
    return [pytest.param(*row, marks=() if set(row) & set(SHORT) else slow) for row in rows]


@functools.cache
def derived(name, *locked):
    """Return the derivation of a bundled robot or of 'shape', joints locked as in `q3=0`."""
    robot = ks.robot_from_text(SHAPE) if name == 'shape' else ks.load_robot(name)
    return ks.derive(robot, dict(text.split('=') for text in locked))


@functools.cache
def poses_of(name):
    """Return the matrix of each row of a bundled robot, and the pose of its tool."""
    exact = exact_of(ks.load_robot(name))
    write, frames = exact.writer.matrix, exact.frames
    return [write(T) for T in frames.row_transforms], write(frames.T_base_tool)


def golden(system, name, text):
    """Return a golden string as a sympy expression in the symbols of a bundled robot."""
    derivation = derived(name)
    entry = SYMBOLIC[system]
    joints = dict(zip(entry['vars'], derivation.variables))
    lengths = {n: derivation.names.meanings.get(n, sympy.Symbol(n)) for n in entry['lengths']}
    return sympy.sympify(str(text), locals={**lengths, **joints})


def zero(expression):
    """
    Return whether an expression is zero.

    Of polynomials in sines and cosines that is decided without `simplify`, which takes seconds.
    """
    expression = sympy.expand(sympy.expand_trig(expression))
    expression = sympy.expand(expression.replace(_is_power_of_a_sine, _without_squares))
    return expression == 0 or (_may_be_zero(expression) and sympy.simplify(expression) == 0)


def _is_power_of_a_sine(e):
    return e.is_Pow and isinstance(e.base, sympy.sin) and e.exp.is_Integer and e.exp >= 2


def _without_squares(power):
    # sin^2 = 1 - cos^2
    (angle,) = power.base.args
    return (1 - sympy.cos(angle) ** 2) ** (power.exp // 2) * power.base ** (power.exp % 2)


def _may_be_zero(expression):
    # At one point, to thirty digits: what is not zero there is not zero.
    point = {s: sympy.Rational(k + 2, 7) for k, s in enumerate(_symbols_of(expression))}
    value = expression.subs(point).evalf(30)
    return not value.is_number or not value.is_finite or abs(value) < sympy.Float('1e-20')


def _symbols_of(expression):
    return sorted((s for s in expression.free_symbols if not s.is_integer), key=str)


def same(one, other):
    """Return whether two matrices are equal, entry by entry."""
    assert one.shape == other.shape
    return all(zero(a - b) for a, b in zip(one, other))
