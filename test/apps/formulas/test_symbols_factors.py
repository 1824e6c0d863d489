# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Factors in robot files: the product is the determinant, and `--write` keeps what the user wrote.
"""

import functools
import math
import re
from types import SimpleNamespace

import numpy as np
import pytest
import sympy
from arms import robot_of
from derivations import derived, marked
from refusal import refused
from sympy.polys.domains import ZZ, ZZ_I
from sympy.polys.rings import ring as polynomial_ring

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.formulas.arm.numbers import Evaluation
from kinematics_service.apps.formulas.derive import trigonometry
from kinematics_service.apps.formulas.derive.algebra import factors
from kinematics_service.apps.formulas.derive.algebra.arithmetic import arithmetic_of
from kinematics_service.apps.formulas.derive.algebra.quotient import divided
from kinematics_service.apps.formulas.derive.family import K, family_of
from kinematics_service.apps.formulas.derive.file_factors import (
    checked_text,
    disagreement,
    factors_to_write,
    file_text,
)
from kinematics_service.apps.formulas.derive.minors import minors_of, simplest_view
from kinematics_service.apps.formulas.derive.output.report import report_of
from kinematics_service.apps.formulas.derive.output.text import text_of
from kinematics_service.apps.formulas.derive.sampled_poses import sampler_of
from kinematics_service.apps.formulas.derive.singular_set import (
    FamilySearch,
    crossings_of,
    families_of,
)
from kinematics_service.errors import DerivationError
from kinematics_service.robot.file.writing.writer import with_factors

# The same arms as others, but for their lengths; and long ones.
LEFT_OUT = ('ur3e', 'ur10e', 'so101', 'kuka_iiwa14', 'offset_stanford_shape', 'six_joint_dh')
# By their text: each process of the tests would read all robots to collect the cases.
LISTED = [
    name
    for name, file in ks.bundled_robots().items()
    if '\n  factors:' in file.read_text(encoding='utf-8') and name not in LEFT_OUT
]
PRODUCT = 1e-12
# Metres and degrees, a slide, a coupling, and one long factor.
WRITTEN = ['craig_3r', 'puma560', 'spherical_rrp', 'parallelogram_left', 'offset_stanford_printed']


@pytest.mark.slow
@pytest.mark.parametrize('name', marked(LISTED))
def test_the_product_of_the_files_factors_is_the_determinant(name):
    assert disagreement(derived(name), robot_of(name)) <= PRODUCT


@pytest.mark.parametrize('name', marked(LISTED))
def test_the_file_lists_every_factor_by_its_name(name):
    listed = [factor.name for factor in robot_of(name).description.singularity.factors]
    assert sorted(derived(name).factors) == sorted(listed)


def test_factors_that_the_file_lists_times_small_numbers_keep_their_names():
    text = ks.bundled_robots()['anthropomorphic_3r'].read_text()
    small = re.sub(r'expression: ([^}]+)}', r'expression: 1e-6*(\1)}', text)
    assert small.count('1e-6*') == 2
    found = ks.derive(ks.robot_from_text(small)).factors
    assert found == derived('anthropomorphic_3r').factors


@pytest.mark.slow
@pytest.mark.parametrize(
    'name',
    ['craig_3r', 'scara_hsr065'],
)
def test_default_names_are_those_of_the_geometry(name):
    # Without the file's own names the geometry gives the same ones.
    head, _, tail = bundled_text(name).partition('singularity:')
    bare = ks.robot_from_text(head + tail[tail.index('known_poses:') :])
    assert sorted(ks.derive(bare).factors) == sorted(derived(name).factors)


def bundled_text(name):
    from kinematics_service.robot.bundled import find_robot_file

    return find_robot_file(name).read_text()


@pytest.mark.slow
@pytest.mark.parametrize('name', WRITTEN)
def test_writing_changes_nothing_but_the_factors(name):
    text = bundled_text(name)
    changed = with_factors(text, factors_to_write(derived(name)))
    checked_text(derived(name), changed)
    ours = [line for line in text.splitlines() if 'expression:' not in line]
    theirs = [line for line in changed.splitlines() if 'expression:' not in line]
    kept = [line for line in ours if line in theirs]
    assert len(ours) - len(kept) <= 2
    assert with_factors(changed, factors_to_write(derived(name))) == changed


BARE = """\
robot: arm            # mine
convention: standard
joints:
  - {name: q1, type: revolute}   # waist
  - {name: q2, type: revolute}
links:
  - {a: 1, alpha: 0, d: 0, theta: q1}
  - {a: 1, alpha: 0, d: 0, theta: q2}
%s
# the end
"""
FACTORS = {'elbow': 'sin(q2)'}


@pytest.mark.parametrize(
    ('section', 'expected'),
    [
        ('', 'singularity:\n  factors:\n    - {name: elbow, expression: sin(q2)}\n'),
        (
            'singularity: {task: [x, y]}   # plane',
            'singularity: {factors: [\n'
            '    {name: elbow, expression: sin(q2)}], task: [x, y]}   # plane\n',
        ),
        (
            'singularity: {factors: [{name: elbow, expression: sin(-q2)}], task: [x,\n  y]}',
            'singularity: {factors: [\n    {name: elbow, expression: sin(q2)}], task: [x,\n  y]}',
        ),
        (
            'singularity: {task: [x,\n  y],  # plane\n  }',
            '    {name: elbow, expression: sin(q2)}], task: [x,\n  y],  # plane\n  }\n',
        ),
        (
            'singularity:\n    warn: 0.2   # careful\n    stop: 0.1',
            'singularity:\n    warn: 0.2   # careful\n    stop: 0.1\n    factors:\n'
            '      - {name: elbow, expression: sin(q2)}\n',
        ),
        (
            'singularity:\n  factors:   # two\n    - {name: elbow, expression: sin(-q2)}  # bent',
            'singularity:\n  factors:   # two\n    - {name: elbow, expression: sin(q2)}  # bent\n',
        ),
    ],
)
def test_factors_go_where_the_user_would_write_them(section, expected):
    changed = with_factors(BARE % section, FACTORS)
    assert expected in changed
    assert '# mine' in changed
    assert '# waist' in changed
    assert changed.count('# the end') == 1
    robot = ks.robot_from_text(changed)
    assert robot.description.singularity.factors[0].text == 'sin(q2)'


def test_a_file_whose_factors_are_not_the_determinants_is_left_alone(tmp_path):
    with refused(DerivationError, 'mismatch', 'determinant'):
        checked_text(
            derived('planar_2r'),
            with_factors(bundled_text('planar_2r'), {'elbow': 'sin(q2)*(2 + cos(q2))'}),
        )


def test_a_byte_order_mark_stays_where_it_is():
    text = BARE % 'singularity: {task: [x, y]}'
    assert with_factors('\ufeff' + text, FACTORS) == '\ufeff' + with_factors(text, FACTORS)


def test_write_from_the_command_line(tmp_path, capsys):
    file = tmp_path / 'arm.yaml'
    file.write_text(BARE % '')
    file.chmod(0o640)
    assert main(['derive', str(file), '--write']) == 0
    assert 'elbow' in capsys.readouterr().out
    assert ks.load_robot(file).description.singularity.factors[0].name == 'elbow'
    assert file.stat().st_mode & 0o777 == 0o640
    assert [path.name for path in tmp_path.iterdir()] == ['arm.yaml']


def test_expressions_of_a_file_have_no_powers():
    derivation = derived('craig_3r')
    q2 = derivation.variables[1]
    assert file_text(q2**2 / 4, degrees=False) in ('q2*q2/4', '0.25*q2*q2')


PLANAR = """\
robot: planar
convention: standard
constants: {L1: 0.3, L2: 0.2}
joints:
  - {name: j1, variable: q1, type: revolute}
  - {name: j2, variable: q2, type: revolute}
links:
  - {a: L1, alpha: 0, d: 0, theta: q1}
  - {a: L2, alpha: 0, d: 0, theta: q2}
singularity: {task: [x, y]}
"""


def test_a_factor_that_splits_into_sums_of_sine_and_cosine_is_not_called_irreducible():
    # cos 2q = (cos q + sin q)(cos q - sin q), whose factors have complex numbers in exp(i q).
    text = PLANAR.replace('theta: q2', 'theta: 2*q2 + pi/2')
    (doubled,) = ks.derive(ks.robot_from_text(text)).singular_set.factors
    assert not doubled.irreducible
    (elbow,) = ks.derive(ks.robot_from_text(PLANAR)).singular_set.factors
    assert elbow.irreducible


@pytest.mark.slow
@pytest.mark.parametrize('most', [6000, 0])
def test_that_the_minors_share_no_factor_is_said_only_where_it_is_proved(monkeypatch, most):
    monkeypatch.setattr(factors, 'MAX_TERMS', most)
    text = PLANAR.partition('singularity')[0].replace('{a: L2, alpha: 0', '{a: 0, alpha: pi/2')
    derivation = ks.derive(ks.robot_from_text(text))
    assert derivation.singular_set.determinant.minors == 3
    said = text_of(report_of(derivation))
    assert ('the minors have no common factor.' in said) == (most > 0)
    assert ('that there is none is not proved' in said) == (most == 0)


# Axis 3 slides through axis 2; letters make the rest of the determinant long.
SLIDING = """
robot: sliding
convention: standard
constants: {L1: 0.31, L2: 0.123, D2: 0.07, D3: 0.11}
joints:
  - {name: q1, type: revolute}
  - {name: q2, type: revolute}
  - {name: q3, type: prismatic}
links:
  - {a: L1, alpha: 0.5, d: 0, theta: q1}
  - {a: L2, alpha: 0.9, d: D2, theta: 0.3}
  - {a: 0, alpha: pi/2, d: D3, theta: q2}
  - {a: 0, alpha: 0, d: q3, theta: 0}
singularity: {task: [x, y, z]}
"""


@functools.cache
def sliding():
    """Return the derivation of that arm."""
    return ks.derive(ks.robot_from_text(SLIDING))


@pytest.mark.slow
def test_a_length_that_divides_a_long_determinant_is_a_factor_of_it():
    whole, length = sliding().singular_set.factors
    assert str(length.expression) == 'q3'
    assert length.irreducible
    assert whole.irreducible
    assert not whole.expression.subs(length.expression, 0).free_symbols & set(sliding().variables)


def test_angles_that_are_no_quarter_turns_are_exact_too():
    derivation = sliding()
    assert set(derivation.methods.values()) == {0}
    q = derivation.exact.sampler.random(5)
    values = dict(zip(derivation.variables, q.T))
    values |= {s: np.full(5, value) for s, value in derivation.names.values.items()}
    found = Evaluation(values, 5).of_matrix(derivation.jacobian)
    np.testing.assert_allclose(found, ks.jacobian(derivation.robot, q), rtol=0, atol=PRODUCT)


def test_a_length_that_vanishes_divides_no_polynomial_without_it():
    arithmetic = sliding().exact.arithmetic
    (q1, _, q3), ring = sliding().variables, arithmetic.ring
    length, one = ring.length(q3), ring.number(1)
    assert divided(one, length) is None
    assert divided(length * length, length) is not None
    turn = ring.power(arithmetic.angle_index(q1))
    assert divided(one, turn) is not None


def test_factors_of_large_and_small_numbers_are_seen_to_meet():
    # Fractions for odd angles have a dozen digits: one factor is 1e11 times the other.
    exact = sliding().exact
    arithmetic, three = exact.arithmetic, (0, 1, 2)
    view = simplest_view(exact.J, exact.frames, three, three, any_point=False)
    (minor,) = minors_of(view, three, three, 3).values
    q1 = sliding().variables[0]
    sine = arithmetic.exponential((0, {q1: 1})) - arithmetic.exponential((0, {q1: -1}))
    values = [factors.factored(minor, arithmetic).factors[0].value, sine.times_i(3).scaled(1, 2)]
    assert max(abs(a) for a, _ in values[0].terms().values()) > 1e10
    product = factors.Factored(minor, tuple(factors.RealFactor(v, 1) for v in values), True)
    named = [SimpleNamespace(name='shoulder'), SimpleNamespace(name='sin(q1)')]
    search = FamilySearch(exact.sampler, (exact.sampler,))
    (crossing,) = crossings_of(product, named, search, view.J[:3])
    assert crossing.within_limits
    q = np.array(crossing.pose)
    assert abs(math.sin(q[0])) < 1e-9
    assert ks.singularity(sliding().robot, q).smallest_singular_value < 1e-9


@pytest.mark.parametrize(('turns', 'whole'), [(1, True), (2, False)])
def test_a_short_factor_is_judged_alone(turns, whole):
    # Of sin(2 q2) = 2 sin(q2) cos(q2) nothing is whole.
    derivation = ks.derive(ks.robot_from_text(PLANAR))
    arithmetic, (_, q2) = derivation.exact.arithmetic, derivation.variables
    sine = arithmetic.exponential((0, {q2: turns})) - arithmetic.exponential((0, {q2: -turns}))
    assert factors.stays_whole(sine.times_i(3), arithmetic) == whole


# A carriage that turns and slides along its axis, and a link that swings up and down; folded back
# it brings the tool onto the axis.
LIFT = """
robot: lift
source: a test
convention: standard
constants: {L: 1}
joints: [{name: q1, type: revolute}, {name: q2, type: prismatic}, {name: q3, type: revolute}]
links:
  - {a: 0, alpha: 0, d: 0, theta: q1}
  - {a: L, alpha: pi/2, d: q2, theta: 0}
  - {a: L, alpha: 0, d: 0, theta: q3}
"""


def sine_and_cosine(arithmetic, variable, share=1):
    """Return sine and cosine of a share of a joint's variable."""
    ahead, back = (arithmetic.exponential((0, {variable: turn})) for turn in (share, -share))
    return (ahead - back).times_i(3).scaled(1, 2), (ahead + back).scaled(1, 2)


@pytest.mark.parametrize(('text', 'ranks'), [(LIFT, [2, 1]), (PLANAR, [1])])
def test_halves_of_a_factor_are_one_family_where_their_rank_is_the_same(text, ranks):
    # sin q = 2 sin q/2 cos q/2: stretched the lift has lost one motion, folded back two.
    robot = ks.robot_from_text(text)
    derivation = ks.derive(robot)
    names, last = derivation.exact.arithmetic.names, derivation.variables[-1]
    arithmetic = arithmetic_of(robot.description, names, parts=2)
    whole = sine_and_cosine(arithmetic, last)[0]
    halves = sine_and_cosine(arithmetic, last, sympy.Rational(1, 2))
    factor = factors.RealFactor(whole, 1, halves)
    sampler = sampler_of(robot, arithmetic)
    search = FamilySearch(sampler, (sampler,))
    product = factors.Factored(arithmetic.ring.number(1), (factor,), True)
    found = families_of(product, search)
    assert [search.meaning(one.value).rank for one in found.factors] == ranks
    assert not math.prod((one.value for one in found.factors), start=found.constant) - whole


def test_an_arc_cosine_of_one_or_minus_one_is_one_solution():
    derivation = ks.derive(ks.robot_from_text(LIFT))
    exact, q3 = derivation.exact, derivation.variables[2]
    arithmetic, length = exact.arithmetic, exact.arithmetic.ring.length(sympy.Symbol('L'))
    cosine = length * sine_and_cosine(arithmetic, q3)[1]
    for sign, angle in ((1, sympy.pi), (-1, 0)):
        found = family_of(cosine + length.scaled(sign, 1), arithmetic, exact.writer)
        assert found.solutions == (angle + 2 * sympy.pi * K,)
    found = family_of(cosine + length.scaled(1, 2), arithmetic, exact.writer)
    assert len(found.solutions) == 2


def test_what_stays_whole_beside_i_is_what_the_gaussian_factoring_says():
    ring, t = polynomial_ring('t', ZZ)
    gaussian, _ = polynomial_ring('t', ZZ_I)
    random, found = np.random.default_rng(9), []
    for k in range(24):
        degree, lead = int(random.choice([2, 2, 3, 4, 6])), int(random.choice([1, 2, 3, 77]))
        a, b = random.integers(-9, 10, (2, degree)).tolist()
        polynomial = lead * t**degree + sum((x * t**j for j, x in enumerate(a)), ring.zero)
        if k % 3 == 0:
            # c g conj(g): its real part squared, and the imaginary one's.
            polynomial = polynomial**2 + sum((x * t**j for j, x in enumerate(b)), ring.zero) ** 2
        polynomial = polynomial.primitive()[1]
        found.append(factors.stays_whole_beside_i(polynomial))
        assert found[-1] == polynomial.set_ring(gaussian).is_irreducible, polynomial
    assert 8 < sum(found) < 20
    # Irreducible over the integers, and (t + i)(t - i); its squares modulo 7 are no factors.
    assert not factors.stays_whole_beside_i(t**2 + 1)
    assert not factors.stays_whole_beside_i((t + 7) ** 2 + 49)


@pytest.mark.parametrize(
    'terms',
    [
        'a*b + c*d',
        'a + 2*b*cos(q)',
        '2*(a + b) + c',
        '4*a + 6*b',
        'a*b + a*c',
        '-a*b - c',
        'a/b + c',
    ],
)
def test_a_sum_without_a_shared_factor_is_written_as_sympy_does(terms):
    summands = sympy.Add.make_args(sympy.sympify(terms, evaluate='(' not in terms))
    found = trigonometry._nothing_shared(summands)
    expected = sympy.gcd_terms(sympy.Add._from_args(summands), isprimitive=True, clear=False)
    shares = terms in ('4*a + 6*b', 'a*b + a*c', 'a/b + c')
    assert found is None if shares else found == expected
