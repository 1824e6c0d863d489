# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Every string of the golden data, reproduced: the difference simplifies to zero."""

import pytest
import sympy
from derivations import SYMBOLIC, SYSTEMS, derived, golden, marked, same, zero

PAIRS = [(system, name) for system, names in SYSTEMS.items() for name in names]
WITH_POSE = [(s, n) for s, n in PAIRS if 'T' in SYMBOLIC[s]]
PRINTED = [
    (s, n)
    for s, n in PAIRS
    if 'J' in SYMBOLIC[s].get('printed_in_document', {}) and not s.startswith('s004')
]


def matrix(system, name, rows):
    return sympy.Matrix([[golden(system, name, entry) for entry in row] for row in rows])


@pytest.mark.parametrize(('system', 'name'), marked(WITH_POSE))
def test_pose_and_jacobian(system, name):
    entry, derivation = SYMBOLIC[system], derived(name)
    assert same(derivation.T, matrix(system, name, entry['T']))
    assert same(derivation.jacobian, matrix(system, name, entry['J']))
    p = sympy.Matrix([golden(system, name, text) for text in entry['p']])
    assert same(derivation.position, p)


@pytest.mark.parametrize(('system', 'name'), marked(PAIRS))
def test_task_determinant(system, name):
    found = derived(name).singular_set.determinant
    if found.identically_zero:
        assert SYMBOLIC[system]['task_det'] == '0'
    else:
        assert zero(found.expression - golden(system, name, SYMBOLIC[system]['task_det']))


@pytest.mark.slow
@pytest.mark.parametrize(('system', 'name'), marked(PAIRS))
def test_singular_factors(system, name):
    listed = SYMBOLIC[system].get('singular_factors', [])
    derivation = derived(name)
    if not listed:
        assert derivation.singular_set.determinant.identically_zero
        return
    if listed == ['does not factor for a*n != 0']:
        (factor,) = derivation.singular_set.factors
        assert factor.irreducible
        return
    found = list(derivation.factors.values())
    assert len(found) == len(listed)
    for text in listed:
        wanted = golden(system, name, text)
        assert any(zero(wanted - f) or zero(wanted + f) for f in found), text


@pytest.mark.parametrize(('system', 'name'), marked(PRINTED))
def test_jacobian_as_printed(system, name):
    printed = SYMBOLIC[system]['printed_in_document']
    J = matrix(system, name, printed['J'])
    derivation = derived(name)
    if printed['row_order'] == 'angular first':
        assert same(derivation.jacobian_in('base', angular_first=True), J)
    else:
        assert same(derivation.jacobian[:3, :], J)


def test_the_determinant_printed_in_document_001():
    printed = SYMBOLIC['s001_craig_3r_mdh']['printed_in_document']['det']
    assert zero(derived('craig_3r').determinant - golden('s001_craig_3r_mdh', 'craig_3r', printed))


@pytest.mark.slow
@pytest.mark.parametrize(
    ('system', 'name', 'key'),
    [
        ('s003a_sheth_uicker_6dof', 'offset_stanford_dh', 'R_C_no_base'),
        ('s003b_dh_as_printed_6dof', 'offset_stanford_printed', 'R_C'),
        ('s003c_dh_matched_6dof', 'offset_stanford_dh', 'R_C_no_base'),
    ],
)
def test_point_c_of_document_003(system, name, key):
    # C is where the boom ends: the origin of the frame after the third row.
    derivation = derived(name)
    base = derivation.frames[0][:3, 3]
    C = derivation.frames[3][:3, 3] - base
    assert same(C, sympy.Matrix([golden(system, name, text) for text in SYMBOLIC[system][key]]))


@pytest.mark.slow
@pytest.mark.parametrize(
    ('system', 'name'), [pair for pair in PAIRS if pair[0].startswith('s004')]
)
def test_what_is_left_of_the_determinant_of_document_004(system, name):
    text = SYMBOLIC[system]['reduced_manip']
    wanted = golden(system, name, text)
    assert zero(derived(name).determinant ** 2 - wanted**2)
