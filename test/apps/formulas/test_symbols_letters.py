# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Ranks, families and splits are those of letters; what the numbers of a file add is said."""

import functools

import pytest

import kinematics_service as ks
from kinematics_service.apps.formulas.derive.output.report import report_of
from kinematics_service.apps.formulas.derive.output.text import text_of

HEAD = 'robot: arm\nconvention: standard\n'


def arm(constants, *rows):
    """Return a robot file of rows `a alpha d theta`; a joint is q..., or d... where it slides."""
    cells = [row.split() for row in rows]
    joints = [next(c for c in row[::-1] if c[0] in 'qd' and c[1:].isdigit()) for row in cells]
    kinds = {'q': 'revolute', 'd': 'prismatic'}
    lines = [f'  - {{name: {j}, type: {kinds[j[0]]}}}' for j in joints]
    links = ['  - {{a: {}, alpha: {}, d: {}, theta: {}}}'.format(*row) for row in cells]
    return '\n'.join([f'{HEAD}constants: {constants}\njoints:', *lines, 'links:', *links])


THREE = ('0 pi/2 L1 q1', 'L2 0 0 q2', 'L3 0 0 q3')
SIX = ('0 pi/2 0 q1', 'a2 0 0 q2', '0 pi/2 0 q3', '0 -pi/2 d4 q4', '0 pi/2 0 q5', '0 0 0 q6')
RPRR = ('0 pi/2 L1 q1', '0 -pi/2 d2 0', 'L3 0 0 q3', 'L4 0 0 q4')


@functools.cache
def derived(constants, *rows):
    return ks.derive(ks.robot_from_text(arm(constants, *rows)))


EQUAL, UNLIKE = '{L1: 1,L2: 1,L3: 1}', '{L1: 0.4,L2: 0.3,L3: 0.2}'


@pytest.mark.parametrize(
    ('constants', 'rows', 'ranks', 'letters', 'rank'),
    [
        (EQUAL, THREE, [2, 2], 'L1 = L2 = L3', 1),
        ('{L1: 2,L2: -1,L3: 1}', THREE, [2, 2], '-L2 = L3', 1),
        (UNLIKE, THREE, [2, 2], None, 0),
        ('{a2: 1, d4: 1}', SIX, [5, 5, 5], 'a2 = d4', 4),
        ('{L1: 1, L2: 1}', ('L1 0 0 q1', 'L2 0 0 q2'), [1], None, 0),
    ],
)
def test_ranks_are_those_of_letters(constants, rows, ranks, letters, rank):
    found = derived(constants, *rows).singular_set
    assert [factor.rank for factor in found.factors] == ranks
    said = [factor.special for factor in found.factors if factor.special]
    assert bool(said) == bool(letters)
    assert all(one.startswith(f'with {letters} of this file: rank {rank}') for one in said)


def test_names_of_factors_are_those_of_the_geometry():
    assert list(derived('{a2: 1, d4: 1}', *SIX).factors) == ['shoulder', 'elbow', 'wrist']


def test_equal_letters_split_no_sine():
    equal, others = (derived(constants, *THREE) for constants in (EQUAL, UNLIKE))
    assert equal.determinant == others.determinant
    said = text_of(report_of(equal)).partition('With L1 = L2 = L3')[2]
    assert said.partition('\n')[0].startswith(' of this file: rank 1')
    assert 'With ' not in text_of(report_of(others))


@pytest.mark.parametrize(
    ('constants', 'rows', 'zeros'),
    [
        ('{L1: 0.4,L3: 0.5,L4: 0.3}', RPRR, [{'d2', 'sin(q3)'}]),
        ('{L1: 0.4, L2: 0.3}', ('0 pi/2 L1 q1', 'L2 0 0 q2'), []),
        ('{L: 1}', ('L 0 0 q1',), []),
    ],
)
def test_zeros_of_what_is_left_of_the_minors_are_solved(constants, rows, zeros):
    derivation = derived(constants, *rows)
    assert [set(one.names) for one in derivation.singular_set.remainder_zeros] == zeros
    text = text_of(report_of(derivation))
    assert 'vanishes as a whole' not in text
    assert ('where d2 = 0 and sin(q3)' in text) == bool(zeros)
    assert derivation.singular_set.complete == (not zeros)


def test_a_length_that_divides_one_minor_only_is_no_common_factor():
    # d2 = 0 alone is not singular.
    derivation = derived('{L1: 0.4,L3: 0.5,L4: 0.3}', *RPRR)
    assert ks.singularity(derivation.robot, [0.4, 0.0, 0.7, 1.1]).rank == 3
    assert not derivation.factors


def test_a_factor_that_all_minors_share_is_a_factor_of_the_set():
    derivation = derived('{L1: 0.4, L2: 0.3}', '0 pi/2 L1 q1', 'L2 0 0 q2')
    assert derivation.singular_set.determinant.minors == 3
    assert [str(factor) for factor in derivation.factors.values()] == ['cos(q2)']


def test_a_letter_that_is_not_declared_is_told_where():
    with pytest.raises(ks.RobotFileError) as raised:
        derived('{}', *THREE)
    assert all('constants' in fault.message for fault in raised.value.faults)


def test_a_rank_that_the_numbers_of_a_file_lower_everywhere_is_said():
    # A link of length L3 - L4, which the file's numbers make 0.
    rows = ('0 pi/2 0 q1', 'L2 0 0 q2', 'L3-L4 0 0 q3')
    text = arm('{L2: 0.4,L3: 0.3,L4: 0.3}', *rows) + '\nsingularity: {task: [x, y, z]}'
    found = ks.derive(ks.robot_from_text(text)).singular_set
    assert found.generic_rank == 3
    assert found.special.startswith('with L3 = L4')
    assert 'rank 2' in found.special


def test_a_number_that_divides_a_factor_stands_in_front():
    rows = ('0 pi/2 0 q1', '2 0 0 q2', '4 0 0 q3')
    shoulder, elbow = derived('{}', *rows).factors.values()
    assert str(shoulder) == 'cos(q2) + 2*cos(q2 + q3)'
    assert str(elbow) == 'sin(q3)'
    # 2 and 4 are the lengths, and 2 divides the sum.
    determinant = derived('{}', *rows).determinant
    assert abs((determinant / shoulder / elbow).cancel()) == 2 * 4 * 2
