# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The symbolic rows of the checklist of the documents, C01 to C35; inverses and plots are elsewhere.
"""

import json

import numpy as np
import pytest
import sympy
from derivations import DISTINCT, GOLDEN, derived, marked, poses_of, same, zero
from refusal import refused
from sympy import acos, cos, pi, sin

import kinematics_service as ks
from kinematics_service.apps.formulas.arm.numbers import Evaluation
from kinematics_service.apps.formulas.derive.closed_loops import loop_equations
from kinematics_service.apps.formulas.derive.path import along, parse_path
from kinematics_service.errors import DerivationError

k = sympy.Symbol('k', integer=True)
ROUND_OFF = 1e-12


def symbols(derivation):
    return {s.name: s for s in (*derivation.variables, *derivation.names.lengths)}


def rotation_z(angle):
    return sympy.Matrix([[cos(angle), -sin(angle), 0], [sin(angle), cos(angle), 0], [0, 0, 1]])


def rotation_x(angle):
    return sympy.Matrix([[1, 0, 0], [0, cos(angle), -sin(angle)], [0, sin(angle), cos(angle)]])


def factor_named(derivation, name):
    (found,) = [f for f in derivation.singular_set.factors if f.name == name]
    return found


def crossing(derivation, *names):
    wanted = set(names)
    (found,) = [c for c in derivation.singular_set.crossings if set(c.names) == wanted]
    return found


@pytest.mark.slow
def test_c01_standard_rows_with_revolute_prismatic_and_fixed_joints():
    d = derived('six_joint_dh_unit')
    s = symbols(d)
    # E4.1: the translation of a row is [a cos, a sin, d].
    assert same(
        d.row_transforms[3],
        sympy.Matrix(
            [
                [cos(s['theta4']), -sin(s['theta4']), 0, s['a4'] * cos(s['theta4'])],
                [sin(s['theta4']), cos(s['theta4']), 0, s['a4'] * sin(s['theta4'])],
                [0, 0, 1, s['d4']],
                [0, 0, 0, 1],
            ]
        ),
    )
    boom = derived('spherical_rrp').row_transforms[2]
    assert boom[2, 3] == symbols(derived('spherical_rrp'))['d3']
    assert derived('parallelogram_left').row_transforms[0].is_symbolic() is False


def test_c02_modified_rows_and_a_fixed_tool_row():
    d = derived('craig_3r')
    s = symbols(d)
    c, sine = cos(s['q2']), sin(s['q2'])
    T12 = sympy.Matrix([[c, -sine, 0, s['L1']], [0, 0, 1, 0], [-sine, -c, 0, 0], [0, 0, 0, 1]])
    assert same(d.row_transforms[1], T12)
    assert d.row_transforms[3][0, 3] == s['L3']


@pytest.mark.slow
def test_c03_elementary_motions():
    d = derived('rrp_elementary')
    s = symbols(d)
    R = s['a2'] + s['d3']
    assert zero(d.position[2] - (s['d1'] - sin(s['theta2']) * R))


@pytest.mark.slow
def test_c04_shape_matrices_with_a_joint_that_slides_along_x():
    rows, _ = poses_of('offset_stanford_shape')
    # E3.1: T34 with the inverse of its shape matrix.
    phi3 = sympy.Symbol('phi3', real=True)
    assert same(
        rows[2], sympy.Matrix([[0, 0, 1, phi3], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]])
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ('name', 'other'),
    [('offset_stanford_shape', 'offset_stanford_dh'), ('six_joint_dh', 'six_joint_dh_unit')],
)
def test_c05_the_repaired_table_equals_the_shape_matrices(name, other):
    assert same(poses_of(name)[1], derived(other).T)


@pytest.mark.slow
def test_c06_the_printed_table_is_another_arm():
    d = derived('offset_stanford_printed')
    s = symbols(d)
    # Axes 4 and 6 pass each other at the distance n.
    o4, o6, z4, z6 = d.o[3], d.o[5], d.z[3], d.z[5]
    normal = z4.cross(z6)
    distance = (o6 - o4).dot(normal)
    assert zero(distance**2 - s['n'] ** 2 * normal.dot(normal))
    assert not same(d.T, derived('offset_stanford_dh').T)


def test_c07_rotations_of_the_anthropomorphic_arm():
    d = derived('anthropomorphic_3r')
    s = symbols(d)
    R1 = rotation_z(s['theta1']) * rotation_x(pi / 2)
    assert same(d.frames[1][:3, :3], R1)
    assert same(d.frames[2][:3, :3], R1 * rotation_z(s['theta2']))
    assert same(d.rotation, R1 * rotation_z(s['theta2'] + s['theta3']))


@pytest.mark.parametrize(
    'name', marked(['anthropomorphic_3r', 'spherical_rrp', 'six_joint_dh_unit'])
)
def test_c08_screws_about_the_end_effector(name):
    assert derived(name).methods['screw'] == 0


@pytest.mark.slow
@pytest.mark.parametrize('name', marked(DISTINCT))
def test_c09_geometric_jacobian_of_every_convention(name):
    d = derived(name)
    assert d.methods['geometric'] == 0
    if d.coupling is None:
        for i, z in enumerate(d.z):
            angular = d.jacobian[3:, i]
            assert same(angular, z) or angular == sympy.zeros(3, 1)


@pytest.mark.slow
def test_c10_analytic_jacobian_by_hand():
    d = derived('craig_3r')
    for j, q in enumerate(d.variables):
        assert same(d.position.diff(q), d.jacobian[:3, j])
        turning = d.rotation.diff(q) * d.rotation.T
        vee = sympy.Matrix([turning[2, 1], turning[0, 2], turning[1, 0]])
        assert same(vee, d.jacobian[3:, j])


@pytest.mark.slow
@pytest.mark.parametrize('name', marked(DISTINCT))
def test_c11_numeric_jacobian(name):
    assert derived(name).central_difference < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize('name', marked(DISTINCT))
def test_c12_the_four_ways_differ_by_exactly_nothing(name):
    methods = derived(name).methods
    assert set(methods) == {'geometric', 'screw', 'analytic', 'rotation taken out'}
    assert set(methods.values()) == {0}


def test_c13_row_order():
    d = derived('rrp_elementary')
    swapped = d.jacobian_in('base', angular_first=True)
    assert swapped[:3, :] == d.jacobian[3:, :]
    assert swapped[3:, :] == d.jacobian[:3, :]


@pytest.mark.parametrize('name', marked(['spherical_rrp', 'rrp_elementary']))
def test_c14_a_prismatic_column_is_its_axis_and_nothing(name):
    d = derived(name)
    assert same(d.jacobian[:3, 2], d.z[2])
    assert d.jacobian[3:, 2] == sympy.zeros(3, 1)


def test_c15_parallelogram_right_loop():
    C = derived('parallelogram_right').coupling
    assert sympy.Matrix([[1, 0, 0], [0, 0, 1], [0, 1, -1]]) == C


def test_c16_parallelogram_left_loop():
    # E0.4: the third column of J is J3 - J4.
    C = derived('parallelogram_left').coupling
    assert sympy.Matrix([[1, 0, 0], [0, 1, 0], [0, -1, 1], [0, 1, -1]]) == C


GENERAL = """
robot: loop
convention: standard
constants: {L1: 0.4, L2: 0.15, L3: 0.41, L4: 0.16, L5: 0.35}
joints:
  - {name: theta1, type: revolute}
  - {name: theta2, type: revolute}
  - {name: theta3, type: revolute}
links:
  - {alpha: -pi/2, a: 0,       d: 0, theta: 0}
  - {alpha: pi/2,  a: 0,       d: 0, theta: theta1}
  - {alpha: 0,     a: L2,      d: 0, theta: theta2}
  - {alpha: 0,     a: L3,      d: 0, theta: theta3 - theta2}
  - {alpha: 0,     a: L4 + L5, d: 0, theta: pi - (theta3 - theta2)}
"""


@pytest.mark.slow
def test_c17_both_chains_agree_only_for_a_parallelogram():
    left, right = derived('parallelogram_left'), derived('parallelogram_right')
    assert same(left.jacobian, right.jacobian)
    assert same(left.T, right.T)
    general = ks.derive(ks.robot_from_text(GENERAL))
    s = {symbol.name: symbol for symbol in general.names.lengths}
    # The residual of the closure: (L2 - L4) u(theta2) + (L3 - L1) u(theta3).
    gap = general.position - right.position
    on_the_line = {general.variables[0]: 0}
    _, two, three = general.variables
    x = (s['L2'] - s['L4']) * cos(two) + (s['L3'] - s['L1']) * cos(three)
    assert zero(gap[0].subs(on_the_line) - x)
    assert all(zero(e.subs({s['L3']: s['L1'], s['L4']: s['L2']})) for e in gap)


@pytest.mark.slow
def test_c18_a_loop_that_is_no_parallelogram_by_implicit_differentiation():
    two, three, first, second = sympy.symbols('theta2 theta3 psi1 psi2', real=True)
    data = json.loads((GOLDEN / 's000b_x_general_loop.json').read_text())
    L = {n: sympy.Symbol(n) for n in ('L1', 'L2', 'L3', 'L4')}

    def u(angle):
        return sympy.Matrix([cos(angle), sin(angle)])

    gap = L['L2'] * u(two) + L['L3'] * u(two + first) - L['L1'] * u(three)
    gap += L['L4'] * u(two + first + second)
    found = loop_equations('parallelogram', gap, (two, three), (first, second))
    # Flat loop: it can change its branch there.
    assert zero(found.determinant - L['L3'] * L['L4'] * sin(second))
    lengths = {symbol: data['robot']['lengths'][n] for n, symbol in L.items()}
    rates = sympy.lambdify((two, three, first, second), found.coupling.subs(lengths), 'numpy')
    for config in data['configs']:
        if config['kind'] != 'random':
            continue
        psi = config['passive_psi1'], config['passive_psi2']
        C = np.array(rates(*config['q'][1:], *psi), dtype=float)
        # The tool turns by theta2 + psi1 + psi2 about the normal of the arm plane.
        turning = np.array([1.0, 0.0]) + C.sum(axis=0)
        c, s = np.cos(config['q'][0]), np.sin(config['q'][0])
        J = np.array(config['J'])[3:, 1:]
        np.testing.assert_allclose(np.outer([s, 0, c], turning), J, rtol=0, atol=1e-11)


def test_c19_a_fixed_row_puts_the_first_axis_along_y():
    assert list(derived('parallelogram_left').z[0]) == [0, 1, 0]


def test_c20_project_with_both_lengths_in_one_offset():
    d = derived('spherical_rrp')
    s = symbols(d)
    assert zero(d.position[2] - (s['L1'] + s['L3'] + s['d3'] * cos(s['theta2'])))
    assert not d.jacobian.has(s['L1'])


@pytest.mark.slow
def test_c21_determinant_factored():
    d = derived('craig_3r')
    s = symbols(d)
    shoulder = s['L1'] + s['L2'] * cos(s['q2']) + s['L3'] * cos(s['q2'] + s['q3'])
    assert d.determinant == s['L2'] * s['L3'] * sin(s['q3']) * shoulder
    assert zero(d.jacobian[:3, :].det() - d.determinant)
    assert d.factors == {'elbow': sin(s['q3']), 'shoulder': shoulder}


def test_c22_the_singular_set_of_document_001():
    d = derived('craig_3r')
    s = symbols(d)
    elbow, shoulder = factor_named(d, 'elbow'), factor_named(d, 'shoulder')
    assert elbow.family.solutions == (k * pi,)
    assert elbow.family.condition is None
    # E1.1: the family that the document missed.
    reach = s['L1'] + s['L2'] * cos(s['q2'])
    turns = 2 * pi * k - s['q2']
    one, two = shoulder.family.solutions
    assert zero(one - (turns + acos(sympy.factor_terms(-reach / s['L3']))))
    assert zero(two - (turns - acos(sympy.factor_terms(-reach / s['L3']))))
    assert shoulder.family.condition == sympy.Le(reach**2, s['L3'] ** 2)
    for solution in shoulder.family.solutions:
        assert zero(shoulder.expression.subs(s['q3'], solution))
    assert (elbow.rank, shoulder.rank) == (2, 2)
    assert crossing(d, 'elbow', 'shoulder').rank == 1
    assert shoulder.idle == 'q1 moves nothing'
    assert shoulder.lost.endswith('along y of frame 1')
    assert d.singular_set.complete


def test_c22_the_singular_set_of_document_002():
    d = derived('rrp_elementary')
    s = symbols(d)
    vertical, length = factor_named(d, 'boom_vertical'), factor_named(d, 'boom_length')
    # E2.7: two families, not four points.
    assert vertical.family.solutions == (pi / 2 + k * pi,)
    assert length.family.solutions == (-s['a2'],)
    assert length.power == 2
    assert (vertical.rank, length.rank) == (2, 1)
    assert crossing(d, 'boom_vertical', 'boom_length').rank == 1
    assert not length.within_limits
    # d3 = +a2 is regular.
    assert not zero(d.determinant.subs(s['d3'], s['a2']))


@pytest.mark.parametrize('name', marked(['parallelogram_left', 'parallelogram_right']))
def test_c22_the_singular_set_of_the_parallelogram(name):
    d = derived(name)
    _, two, three = d.variables
    assert factor_named(d, 'loop').family.solutions == (two + k * pi,)
    s = symbols(d)
    shoulder = factor_named(d, 'shoulder')
    for solution in shoulder.family.solutions:
        assert zero(shoulder.expression.subs(three, solution))
    assert shoulder.family.condition == sympy.Le(s['L5'] ** 2 * cos(two) ** 2, s['L1'] ** 2)


@pytest.mark.slow
def test_c22_the_singular_set_of_document_003():
    d = derived('offset_stanford_dh')
    assert set(d.factors) == {'boom_length', 'shoulder', 'wrist'}
    assert {f.rank for f in d.singular_set.factors} == {5}
    assert factor_named(d, 'wrist').idle.startswith('phi4 and phi6 work')


@pytest.mark.slow
def test_c22_the_printed_table_of_document_003_is_irreducible():
    d = derived('offset_stanford_printed')
    s = symbols(d)
    (factor,) = d.singular_set.factors
    assert factor.irreducible
    assert factor.family.variable == s['phi5']
    D = s['l'] + s['m'] + s['phi3']
    (solution,) = factor.family.solutions
    tangent = s['a'] * s['n'] * sin(s['phi4']) * cos(s['phi4'])
    tangent /= D * (s['a'] + D * sin(s['phi2']))
    assert zero(sympy.tan(solution.subs(k, 0)) - tangent)
    assert len(factor.family.free) == 2


@pytest.mark.slow
def test_c23_rank_on_families_and_where_they_meet():
    d = derived('puma560')
    assert {f.rank for f in d.singular_set.factors} == {5}
    assert set(d.factors) == {'elbow', 'shoulder', 'wrist'}
    assert crossing(d, 'elbow', 'shoulder').rank == 4


@pytest.mark.slow
def test_c24_structural_deficiency_is_told_apart():
    found = derived('six_joint_dh_unit').singular_set
    assert found.determinant.identically_zero
    assert found.dependent == ('theta1', 'theta2')
    assert found.generic_rank == 5
    assert found.determinant.columns == ('theta2', 'theta3', 'theta4', 'theta5', 'theta6')
    (elbow,) = found.factors
    assert (elbow.name, elbow.rank) == ('elbow', 4)
    assert not derived('puma560').singular_set.determinant.identically_zero


TRAJECTORY = json.loads((GOLDEN / 'traj_s002_tool_velocity.json').read_text())


def trajectory():
    d = derived('rrp_elementary')
    texts = zip(d.variables, TRAJECTORY['q_of_t'])
    path = ', '.join(f'{v} = {text}' for v, text in texts)
    return along(d, path, (0.0, 2 * np.pi))


def test_c30_velocity_along_the_path_of_document_002():
    path = trajectory()
    names = {'t': path.q.free_symbols.pop(), **symbols(path.derivation)}
    for entry, text in zip(path.v, TRAJECTORY['v_closed_form']):
        assert sympy.simplify(entry - sympy.sympify(text, locals=names)) == 0
    for entry, text in zip(path.qdot, TRAJECTORY['qdot_of_t']):
        assert entry == sympy.sympify(text, locals=names)


def test_c30_crossings_of_the_path_of_document_002():
    (case,) = [c for c in TRAJECTORY['cases'] if 'singular_times_0_to_2pi' in c]
    crossings = trajectory().crossings
    assert {c.name for c in crossings} == {'boom_length'}
    np.testing.assert_allclose(
        [c.time for c in crossings], case['singular_times_0_to_2pi'], rtol=0, atol=1e-12
    )


@pytest.mark.parametrize(
    ('q2', 'met'),
    [
        ('(t-1)*(t-1)', [(1.0, 1.0, True)]),
        ('(t-1)*(t-1) - 0.00000001', [(0.9999, 0.9999, False), (1.0001, 1.0001, False)]),
        ('(t-1)*(t-1) + 0.00000001', []),
        ('1 - cos(pi*t)', [(0.0, 0.0, False), (2.0, 2.0, False)]),
        ('0*t', [(0.0, 2.0, False)]),
        ('sin(t - 1)', [(1.0, 1.0, False)]),
    ],
)
def test_a_path_that_touches_is_told_from_one_that_crosses_twice_or_misses(q2, met):
    derivation = derived('planar_2r')
    path = along(derivation, f'q1=t, q2={q2}', (0.0, 2.0))
    found = [(c.time, c.until, c.touches) for c in path.crossings]
    assert [c[2] for c in found] == [c[2] for c in met]
    times, expected = ([c[:2] for c in every] for every in (found, met))
    assert np.allclose(times, expected, rtol=0, atol=1e-7)


def test_c30_samples_of_the_path_of_document_002():
    (case,) = [c for c in TRAJECTORY['cases'] if c['name'] == 'generic_m']
    path = trajectory()
    times = np.array([sample['t'] for sample in case['samples']])
    for key, vector in (('v', path.v), ('omega', path.omega), ('p', path.p)):
        found = np.column_stack([path.sampled(entry, times) for entry in vector])
        np.testing.assert_allclose(
            found, [sample[key] for sample in case['samples']], rtol=0, atol=ROUND_OFF
        )


@pytest.mark.slow
def test_c31_example_of_document_004_step_by_step():
    d = derived('six_joint_dh_unit')
    at = dict(zip(d.variables, [0, 0, pi / 2, 0, -pi / 2, 0])) | dict.fromkeys(d.names.lengths, 1)
    assert d.T.subs(at) == sympy.Matrix([[1, 0, 0, 0], [0, 0, -1, -2], [0, 1, 0, 4], [0, 0, 0, 1]])
    assert [list(o.subs(at)) for o in d.o] == [
        [0, 0, 0], [0, 0, 1], [0, 0, 1], [0, 0, 2], [0, -1, 3], [0, -2, 3],
    ]  # fmt: skip
    J = d.jacobian.subs(at)
    assert J.rank() == 3
    assert list(J[:, 2]) == [-3, 0, 0, 0, -1, 0]


@pytest.mark.slow
@pytest.mark.parametrize('name', marked(DISTINCT))
def test_c34_intermediate_frames(name):
    d = derived(name)
    robot = d.robot
    sampler = d.exact.sampler
    q = sampler.random(1)
    frames = ks.link_frames(robot, sampler.whole(q))
    values = {symbol: np.array([v]) for symbol, v in zip(d.variables, q[0])}
    values |= {symbol: np.array([v]) for symbol, v in d.names.values.items()}
    for T, expected in zip(d.frames, frames[0]):
        (found,) = Evaluation(values, 1).of_matrix(T)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_c35_twist_for_given_rates():
    path = trajectory()
    robot = path.derivation.robot
    times = np.array([0.5])
    q = [path.sampled(entry, times)[0] for entry in path.q]
    rates = [path.sampled(entry, times)[0] for entry in path.qdot]
    twist = [path.sampled(entry, times)[0] for entry in (*path.v, *path.omega)]
    np.testing.assert_allclose(twist, ks.twist(robot, q, rates), rtol=0, atol=ROUND_OFF)


@pytest.mark.parametrize(
    ('text', 'code', 'word'),
    [
        ('theta1=sin(t), theta2=t', 'missing-key', 'd3=f(t)'),
        ('theta1=sin(t), theta2=t, d3=u', 'unknown-name', "'u'"),
        ('theta1=sin(t), theta2=t, d4=t', 'unknown-name', "'d4'"),
        ('theta1=sin(t), theta2=t, d3', 'syntax', "'d3'"),
        ('theta1=1, theta1=t, d3=t', 'duplicate-name', 'theta1'),
    ],
)
def test_a_path_that_cannot_be_meant_is_refused(text, code, word):
    with refused(DerivationError, code, word):
        parse_path(text, derived('rrp_elementary'))


def test_a_path_is_read_as_it_is_pasted():
    derivation = derived('rrp_elementary')
    pasted = parse_path('θ₁=−sin(2·t), θ2=t⁄2, d3 = 1\u00a0–\u00a0t', derivation)
    assert pasted == parse_path('theta1=-sin(2*t), theta2=t/2, d3=1-t', derivation)


ODD = """
robot: odd
convention: standard
joints: [{name: q1, type: revolute}, {name: q2, type: revolute}, {name: q3, type: revolute}]
links:
  - {a: 0.1, alpha: 1.1, d: 0.3, theta: q1 + 0.2}
  - {a: 0.4, alpha: 0.3, d: 0, theta: q2 - 1.5707963267948966}
  - {a: 0.3, alpha: -0.7, d: 0.1, theta: q3}
"""


def test_a_pose_too_long_to_write_is_refused():
    long = ODD.replace(
        'q3, type: revolute}]',
        'q3, type: revolute}, '
        + ', '.join(f'{{name: p{k}, type: revolute}}' for k in range(3))
        + ']',
    )
    rows = ''.join(
        f'  - {{a: 0.{k + 2}, alpha: 0.{k + 1}3, d: 0.1, theta: p{k}}}\n' for k in range(3)
    )
    with refused(DerivationError, 'too-large', 'terms', 'lock joints'):
        ks.derive(ks.robot_from_text(long + rows))


def test_a_path_in_millimetres_with_a_locked_joint_is_a_motion_of_all_joints():
    robot = ks.robot_from_text(
        'robot: boom\nconvention: elementary\nunits: {length: mm, angle: deg}\n'
        'constants: {a: 400}\nlinks: [Rz(q1), Ry(q2), Tx(a), Tx(d3)]\n'
        'joints:\n  - {name: q1, type: revolute}\n  - {name: q2, type: revolute}\n'
        '  - {name: d3, type: prismatic, limits: [0, 900]}\n'
    )
    derivation = ks.derive(robot, {'q1': '30'})
    path = along(derivation, 'q2=2*t, d3=300*t*t')
    q, qdot = path.motion(np.array([0.0, 0.5]))
    np.testing.assert_allclose(q, [[np.pi / 6, 0.0, 0.0], [np.pi / 6, 1.0, 0.075]], atol=1e-15)
    np.testing.assert_allclose(qdot, [[0.0, 2.0, 0.0], [0.0, 2.0, 0.3]], atol=1e-15)
