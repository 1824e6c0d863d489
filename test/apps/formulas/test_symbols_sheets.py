# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
A family of singular poses is one sheet, of arms whose lengths and angles coincide.

Poses of a family are found here by sign changes along random lines, and ranks from the library's
Jacobian: nothing of the derivation but its printed expressions is used.
"""

import functools

import numpy as np
import pytest
import sympy as sp

import kinematics_service as ks
from kinematics_service.apps.formulas.derive.file_factors import disagreement, factors_to_write
from kinematics_service.robot.file.writing.writer import with_factors

HEAD = """\
robot: {name}
convention: {convention}
constants: {{L: 0.29, M: 0.17, A: 0.7}}
joints:
  - {{name: q1, type: revolute}}
  - {{name: q2, type: revolute}}
  - {{name: q3, type: revolute}}
links:
{rows}
tool: {{xyz: [{tool}, 0, 0]}}
singularity: {{task: [x, y, z]}}
"""


def text_of_arm(name, convention, rows, tool):
    """Return a robot file of rows (a, alpha, d, what is added to the joint's angle)."""
    lines = '\n'.join(
        f'  - {{a: {a}, alpha: {alpha}, d: {d}, theta: q{k} + {offset}}}'
        for k, (a, alpha, d, offset) in enumerate(rows, 1)
    )
    return HEAD.format(name=name, convention=convention, rows=lines, tool=tool)


# The arm of the textbooks: its two links are of one length.
TEXTBOOK = text_of_arm(
    'textbook', 'modified', [(0, 0, 'M', 0), (0, 'pi/2', 0, 0), ('L', 0, 0, 0)], 'L'
)


@functools.cache
def arms(count, seed=20):
    """Return texts of arms of rank 3 with few lengths, and angles that are equal or opposite."""
    random = np.random.default_rng(seed)
    found = []
    while len(found) < count:
        lengths = ['L', 'L', '0'] if len(found) % 2 else ['L', 'L', 'M', '0']
        angles = ['0', '0', 'pi/2', '-pi/2', 'pi', 'A', '-A'][: 5 if len(found) % 3 else 7]
        rows = [
            (
                random.choice(lengths),
                random.choice(angles),
                random.choice(['0', '0', *lengths]),
                random.choice(['0', '0', 'pi/2', '-pi/2']),
            )
            for _ in range(3)
        ]
        convention = str(random.choice(['standard', 'modified']))
        text = text_of_arm(f'arm_{len(found)}', convention, rows, random.choice(lengths))
        try:
            robot = ks.robot_from_text(text)
        except ks.KinematicsError:
            continue
        if robot.singularity.task.generic_rank == 3:
            found.append(text)
    return found


@functools.cache
def derived_from(text):
    """Return the derivation of a robot file's text."""
    return ks.derive(ks.robot_from_text(text))


def function_of(expression, derivation):
    """Return an expression as a function of poses (N, n), with the lengths of the file."""
    values = expression.subs(dict(derivation.names.values))
    function = sp.lambdify(derivation.variables, values, 'numpy')
    return lambda q: np.broadcast_to(function(*np.asarray(q).T), (len(q),)).astype(float)


def poses_of(f, random, count=200):
    """Return poses at which a function changes its sign, bisected along random lines."""
    lines, brackets = [], []
    for _ in range(400):
        start, end = random.uniform(-6.0, 6.0, (2, 3))
        t = np.linspace(0.0, 1.0, 101)
        value = f(start + (end - start) * t[:, None])
        for k in np.flatnonzero(value[:-1] * value[1:] < 0):
            lines.append((start, end - start))
            brackets.append((t[k], t[k + 1], value[k]))
        if len(lines) >= count:
            break
    if not lines:
        return np.empty((0, 3))
    start, way = np.moveaxis(np.array(lines[:count]), 1, 0)
    low, high, sign = np.array(brackets[:count]).T
    for _ in range(55):
        middle = (low + high) / 2
        same = f(start + way * middle[:, None]) * sign > 0
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return start + way * low[:, None]


def sheets_of(expression, derivation):
    """
    Return the factors over the Gaussian integers in exp(i q / 2), of an arm of quarter turns.
    """
    letters = dict(zip(derivation.names.lengths, (2, 7)))
    halves = {v: sp.Symbol(f'w{v}') for v in derivation.variables}
    half_angle = sp.expand_trig(
        expression.subs(letters).subs({v: 2 * v for v in derivation.variables})
    )
    changed = {}
    for v, w in halves.items():
        changed[sp.cos(v)] = (w + 1 / w) / 2
        changed[sp.sin(v)] = (w - 1 / w) / (2 * sp.I)
    numerator = sp.numer(sp.together(sp.expand(half_angle.xreplace(changed))))
    # Whole angles where there are only such: what splits in half angles alone is one sheet.
    polynomial = sp.Poly(sp.expand(numerator), *halves.values(), domain=sp.QQ_I)
    lowest = [min(e[k] for e in polynomial.monoms()) for k in range(3)]
    even = [all((e[k] - lowest[k]) % 2 == 0 for e in polynomial.monoms()) for k in range(3)]
    terms = {
        tuple((x - low) // (2 if two else 1) for x, low, two in zip(e, lowest, even)): c
        for e, c in polynomial.terms()
    }
    reduced = sp.Poly.from_dict(terms, *halves.values(), domain=sp.QQ_I)
    return [(f, power) for f, power in reduced.factor_list()[1] if len(f.terms()) > 1]


def check_families(derivation, seed):
    """Assert that what is said of each family is true at 200 of its poses."""
    robot, variables = derivation.robot, derivation.variables
    random = np.random.default_rng(seed)
    determinant = function_of(derivation.determinant, derivation)
    q = random.uniform(-3.0, 3.0, (100, 3))
    right = np.abs(np.linalg.det(ks.jacobian(robot, q)[:, :3]))
    np.testing.assert_allclose(np.abs(determinant(q)), right, atol=1e-13)
    factors = derivation.singular_set.factors
    assert len({factor.name for factor in factors}) == len(factors)
    for factor in factors:
        f = function_of(factor.expression, derivation)
        poses = poses_of(f, random)
        if len(poses) < 100:  # it is 0 nowhere, or only touches 0
            continue
        J = ks.jacobian(robot, poses)[:, :3]
        sigma = np.linalg.svd(J, compute_uv=False)
        ranks = np.sum(sigma > 1e-6 * sigma[:, 0].max(), axis=1)
        assert np.mean(ranks == factor.rank) > 0.98, factor
        if factor.idle:
            words = factor.idle.replace(',', ' ').split()
            idle = [k for k, v in enumerate(variables) if v.name in words]
            part = np.linalg.svd(J[:, :, idle], compute_uv=False)[:, -1]
            assert np.mean(part < 1e-6) > 0.98, factor
        check_solutions(factor, f, poses, derivation, random)


def check_solutions(factor, f, poses, derivation, random):
    """Assert that each pose is one solution, listed once, where the condition says so."""
    family, variables = factor.family, derivation.variables
    if family.variable is None:
        return
    assert family.condition not in (True, sp.true)
    values = dict(derivation.names.values)
    j, k = variables.index(family.variable), sp.Symbol('k', integer=True)
    solutions = [
        sp.lambdify((*variables, k), solution.subs(values), 'numpy')
        for solution in family.solutions
    ]
    with np.errstate(all='ignore'):
        hit = np.array(
            [
                [np.abs(solve(*q, turn) - q[j]) < 1e-5 for q in poses for turn in range(-5, 6)]
                for solve in solutions
            ]
        ).reshape(len(solutions), len(poses), -1)
    listed = hit.any(axis=2)
    # Where all of `free` vanishes every value is one; a single sheet has hardly such poses.
    missed = poses[~listed.any(axis=0)]
    assert not (factor.irreducible and len(missed)), factor
    for part in family.free if len(missed) else ():
        assert np.all(np.abs(function_of(part, derivation)(missed)) < 1e-9), factor
    assert np.mean(np.sum(listed, axis=0) > 1) < 0.02, factor
    q = random.uniform(-3.0, 3.0, (200, 3))
    exists = np.ones(200, dtype=bool)
    if family.condition is not None:
        condition = sp.lambdify(variables, family.condition.subs(values), 'numpy')
        exists = np.broadcast_to(condition(*q.T), (200,))
    for solve in solutions:
        with np.errstate(all='ignore'):
            value = np.broadcast_to(solve(*q.T, 1), (200,)).astype(float)
        assert np.array_equal(np.isfinite(value), exists), factor
        there = q.copy()
        there[:, j] = value
        assert np.all(np.abs(f(there[exists])) < 1e-9), factor


def test_the_arm_of_the_textbooks():
    derivation = derived_from(TEXTBOOK)
    families = {f.name: f for f in derivation.singular_set.factors}
    assert {name: (str(f.expression), f.rank) for name, f in families.items()} == {
        'shoulder': ('cos(q2 + q3/2)', 2),
        'elbow': ('sin(q3/2)', 2),
        'elbow_2': ('cos(q3/2)', 1),
    }
    assert families['elbow'].idle.startswith('q2 and q3 work')
    assert families['shoulder'].idle == 'q1 moves nothing'
    assert all(f.irreducible for f in families.values())
    check_families(derivation, 1)


def test_factors_of_half_angles_are_written_into_the_file_and_are_complete():
    derivation = derived_from(TEXTBOOK)
    robot = ks.robot_from_text(with_factors(TEXTBOOK, factors_to_write(derivation)))
    assert robot.singularity.factors.complete
    assert disagreement(derivation, robot) < 1e-12
    assert derivation.singular_set.complete


# A double factor; a sheet with a condition, and one on which any value is a zero.
ARMS = [arms(5)[k] for k in (1, 4)]


@pytest.mark.slow
@pytest.mark.parametrize('text', ARMS, ids=lambda text: text.split()[1])
def test_a_family_is_one_sheet(text):
    check_families(derived_from(text), 7)


@pytest.mark.slow
@pytest.mark.parametrize('text', ARMS, ids=lambda text: text.split()[1])
def test_what_is_called_irreducible_has_one_sheet_up_to_half_a_turn(text):
    derivation = derived_from(text)
    for factor in derivation.singular_set.factors:
        sheets = sheets_of(factor.expression, derivation) if factor.irreducible else []
        assert sum(power for _, power in sheets) <= 2
        if len(sheets) == 2:  # as sin(q3), 0 where q3 is 0 and where it is half a turn
            one, other = (f.as_expr() for f, _ in sheets)
            turned = [one.subs(w, -w) for w in one.free_symbols]
            assert any((t / other).cancel().is_number for t in turned)


GEARED = """\
robot: geared
convention: standard
constants: {L1: 0.3, L2: 0.2}
joints:
  - {name: q1, type: revolute}
  - {name: q3, type: revolute}
links:
  - {a: L1, alpha: 0, d: 0, theta: q1}
  - {a: L2, alpha: 0, d: 0, theta: %s}
singularity: {task: [x, y]}
"""


@pytest.mark.parametrize(
    ('theta', 'solutions'),
    [
        ('q3/2 + pi/2', ['2*pi*k + pi']),
        # cos(2 q) has no factors with fractions as coefficients.
        ('2*q3 + pi/2', ['pi*k/2 + pi/4']),
        ('2*q3/3', ['3*pi*k', '3*pi*k + 3*pi/2']),
    ],
)
def test_a_joint_behind_a_gear_has_its_zeros_listed(theta, solutions):
    derivation = ks.derive(ks.robot_from_text(GEARED % theta))
    listed = [s for f in derivation.singular_set.factors for s in f.family.solutions]
    assert sorted(map(str, listed)) == sorted(solutions)
    k = sp.Symbol('k', integer=True)
    for q3 in (float(s.subs(k, turn)) for s in listed for turn in range(-3, 4)):
        assert ks.singularity(derivation.robot, [0.3, q3]).smallest_singular_value < 1e-12


PLANE = """\
robot: plane
convention: standard
constants: {L1: 0.05, L2: 0.04, L3: 0.03}
joints:
  - {name: q1, type: revolute}
  - {name: q2, type: revolute}
  - {name: q3, type: revolute}
links:
  - {a: L1, alpha: 0, d: 0, theta: q1}
  - {a: L2, alpha: 0, d: 0, theta: q2}
  - {a: L3, alpha: 0, d: 0, theta: q3}
singularity: {task: [x, y]}
"""


def test_minors_of_a_redundant_arm_are_written_as_products():
    derivation = derived_from(PLANE)
    written = derivation.determinant
    assert derivation.variables[0] not in written.free_symbols  # q1 stands for itself
    q = np.random.default_rng(3).uniform(-3.0, 3.0, (50, 3))
    J = ks.jacobian(derivation.robot, q)[:, :2]
    right = np.prod(np.linalg.svd(J, compute_uv=False), axis=1)
    np.testing.assert_allclose(function_of(written, derivation)(q), right, rtol=1e-10)
    # Each minor is a product, as L1^2 (L2 sin q2 + L3 sin(q2 + q3))^2.
    (total,) = written.args[:1]
    assert all(minor.is_Mul for minor in total.args)


def test_a_redundant_arm_has_factors_if_a_joint_is_locked():
    # The minors share none; with one joint locked there is a determinant.
    robot = derived_from(PLANE).robot
    assert not derived_from(PLANE).factors
    locked = ks.derive(robot, {'q1': '0'})
    assert locked.singular_set.determinant.square
    assert list(map(str, locked.factors.values())) == ['sin(q3)']
