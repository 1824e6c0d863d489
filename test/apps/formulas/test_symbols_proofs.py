# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""What is said of a family is proved for all of it and for all lengths, or marked as sampled."""

import dataclasses

import numpy as np
import pytest
import sympy
from derivations import derived, marked

from kinematics_service.apps.formulas.derive.family_proofs import CommonZeros, proves_lost
from kinematics_service.apps.formulas.derive.minors import minors_of, product_of, simplest_view
from kinematics_service.apps.formulas.derive.output.json_output import json_of
from kinematics_service.apps.formulas.derive.output.report import Sentence, report_of
from kinematics_service.apps.formulas.derive.singular_geometry import Lost

PROVED = ['anthropomorphic_3r', 'spherical_rrp', 'scara_hsr065', 'parallelogram_right', 'ur5e']


def families(name):
    """Return the Jacobian that is factored, and a function that makes families of some factors."""
    exact = derived(name).exact
    n = len(exact.sampler.moving)
    rows = exact.sampler.rows
    view = simplest_view(exact.J, exact.frames, rows, range(n), n == 6)
    product, _ = product_of(minors_of(view, rows, range(n), n), exact.arithmetic)
    names = [factor.name for factor in derived(name).singular_set.factors]
    values = dict(zip(names, (factor.value for factor in product.factors)))
    J = tuple(view.J[i] for i in exact.sampler.rows)
    return lambda *which: CommonZeros(J, n, tuple(values[w] for w in which), exact.arithmetic)


@pytest.mark.parametrize('name', marked(PROVED))
def test_everything_that_is_said_of_these_arms_is_proved(name):
    found = derived(name).singular_set
    assert not any(factor.sampled for factor in found.factors)
    assert not any(crossing.sampled for crossing in found.crossings)


@pytest.mark.slow
@pytest.mark.parametrize('name', marked(PROVED))
def test_proved_ranks_hold_with_other_lengths(name):
    derivation = derived(name)
    random = np.random.default_rng(4)
    rows = list(derivation.exact.sampler.rows)
    symbols = [*derivation.variables, *derivation.names.lengths]
    jacobian = sympy.lambdify(symbols, derivation.jacobian, 'numpy')
    checked = 0
    for factor in derivation.singular_set.factors:
        for _ in range(8):
            values = {s: random.uniform(0.2, 1.0) for s in derivation.names.lengths}
            values |= {v: random.uniform(-3, 3) for v in derivation.variables}
            del values[factor.family.variable]
            k = sympy.Symbol('k', integer=True)
            root = complex(factor.family.solutions[0].subs(values).subs(k, 0).evalf())
            if abs(root.imag) > 1e-12:
                continue
            values[factor.family.variable] = root.real
            J = jacobian(*(values[symbol] for symbol in symbols))[rows]
            sigma = np.linalg.svd(J, compute_uv=False)
            assert np.sum(sigma > 1e-9 * sigma[0]) == factor.rank
            checked += 1
    assert checked >= 4


def test_what_is_false_is_not_proved():
    of = families('anthropomorphic_3r')
    assert of('shoulder').depend([0])
    assert not of('shoulder').depend([1, 2])
    assert not of('shoulder').vanish(range(3), range(3), 2)
    assert of('elbow').depend([1, 2])
    assert not of('elbow').depend([0])
    assert of('shoulder', 'elbow').has_rank_at_most(1)
    assert not of('shoulder', 'elbow').has_rank_at_most(0)


@pytest.mark.slow
def test_a_motion_that_is_not_lost_is_not_proved_to_be():
    exact = derived('ur5e').exact
    elbow = families('ur5e')('elbow')
    true = Lost('', axis=0, frame=5, angular=True, point=5, held=True)
    assert proves_lost(true, elbow, exact.frames)
    for wrong in ({'axis': 1}, {'frame': 3}, {'point': 6}, {'held': False}):
        assert not proves_lost(dataclasses.replace(true, **wrong), elbow, exact.frames)


def test_a_crossing_is_proved_on_every_branch():
    # theta3 = 0 and theta3 = pi are two branches of the elbow.
    of = families('anthropomorphic_3r')
    arithmetic = derived('anthropomorphic_3r').exact.arithmetic
    z = arithmetic.ring.power(arithmetic.angle_index(derived('anthropomorphic_3r').variables[2]))
    one = arithmetic.ring.number(1)
    assert not of('elbow', 'shoulder').are_zero([z - one])
    assert not of('elbow', 'shoulder').are_zero([z + one])
    assert of('elbow', 'shoulder').are_zero([z * z - one])


@pytest.mark.slow
def test_what_is_sampled_is_marked():
    found = derived('puma560').singular_set
    elbow = next(f for f in found.factors if f.name == 'elbow')
    assert elbow.sampled == ('lost',)
    assert {c.names: c.sampled for c in found.crossings}[('elbow', 'shoulder')]
    said = [b.parts[0] for b in report_of(derived('puma560')) if isinstance(b, Sentence)]
    assert 'elbow and shoulder: rank 4 (at sampled poses)' in said
    assert 'shoulder and wrist: rank 5' in said
    assert any(s.startswith('Lost:') and s.endswith('(at sampled poses).') for s in said)
    assert '"sampled": [\n    "lost"\n   ]' in json_of(derived('puma560'))
