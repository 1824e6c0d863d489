# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
General arms of six joints: all solutions with a count as the proof, and what must not fake it.
"""

import math

import general_arms
import numpy as np
import pytest
from arms import robot_of, without_known_poses

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.kinematics.inverse import elimination
from kinematics_service.kinematics.inverse.problem.plan import plan_for
from kinematics_service.kinematics.inverse.problem.screws import screws_of
from kinematics_service.kinematics.inverse.problem.six_joints import six_joints_of
from kinematics_service.kinematics.inverse.problem.target import ik_target_of
from kinematics_service.rigid_motion import inverse, rotation_vector
from kinematics_service.robot.task import ROW_NAMES

H = general_arms.H

POSES, STARTS = 2, 60
# The joint positions a pose was made from: its pose is known to 1e-16.
SAME = 1e-7


def complex_solutions(robot, target):
    """Return what elimination alone finds, complex positions (m, 6), and whether that is all."""
    screws = screws_of(robot.chain)
    form = plan_for(robot, ROW_NAMES).six_joints
    psi, said = np.zeros((kernel.MAX_CANDIDATES, 6, 2)), np.zeros(3)
    count = kernel.complex_solutions(form, target @ inverse(screws.home), psi, said)
    return psi[:count, :, 0] + 1j * psi[:count, :, 1], bool(said[2])


@pytest.mark.slow
@pytest.mark.parametrize('name', general_arms.GENERAL + general_arms.THREE_SLIDE)
def test_no_solution_is_missing_and_none_is_there_twice(name):
    robot = general_arms.general_arm(name)
    for q in general_arms.general_poses(name, POSES):
        target = ks.forward_kinematics(robot, q)
        result = ks.inverse_kinematics(robot, target, respect_limits=False)
        given = np.array([one.q for one in result])
        assert np.any(general_arms.apart(robot, given, q) < SAME)
        for one in general_arms.met_by_starts(robot, target, STARTS):
            assert np.any(general_arms.apart(robot, given, one) < 1e-5)
        for k, one in enumerate(given):
            assert not np.any(general_arms.apart(robot, given[:k], one) < 1e-6)


@pytest.mark.slow
@pytest.mark.parametrize('name', general_arms.GENERAL)
def test_a_general_arm_is_solved_by_elimination(name):
    robot = general_arms.general_arm(name)
    q = general_arms.general_poses(name, 1)[0]
    assert ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q)).method == 'algebraic'


@pytest.mark.parametrize('name', general_arms.TWO_SLIDE)
def test_two_joints_that_slide_wherever_they_are_leave_eight_solutions(name):
    robot = general_arms.general_arm(name)
    for q in general_arms.general_poses(name, POSES):
        target = ks.forward_kinematics(robot, q)
        result = ks.inverse_kinematics(robot, target, respect_limits=False)
        assert (result.method, result.complete, result.roots) == ('algebraic', 'proved', (8, 8))
        given = np.array([one.q for one in result])
        for one in [q, *general_arms.met_by_starts(robot, target, STARTS)]:
            assert np.any(general_arms.apart(robot, given, one) < 1e-5)


def test_slides_across_the_joint_between_them_have_half_as_many_solutions():
    # Their directions span one plane at every angle but two, where they are parallel: no solution
    # is there, and nothing is taken from the proof.
    rows = [(0.3, H, 0.0, 0.2), (0.2, H, 0.1, 0.0), (0.25, 0.7, 0.0, 0.4)]
    rows += [(0.1, 1.1, 0.2, 0.0), (0.3, -0.8, -0.1, 0.0), (0.2, 0.5, 0.3, 0.0)]
    robot = ks.robot_from_text(general_arms.text_of('standard', rows, 'PRPRRR'))
    for q in general_arms.general_poses('PRPRRR-0', 3):
        target = ks.forward_kinematics(robot, q)
        result = ks.inverse_kinematics(robot, target, respect_limits=False)
        assert (result.method, result.complete, result.roots) == ('algebraic', 'proved', (4, 8))
        given = np.array([one.q for one in result])
        for one in [q, *general_arms.met_by_starts(robot, target, STARTS)]:
            assert np.any(general_arms.apart(robot, given, one) < 1e-5)


def test_the_published_target_with_sixteen_real_solutions():
    # Manseur and Doty (1989), as Raghavan and Roth (1993) print it.
    target = np.array(
        [
            [-0.760117, -0.641689, 0.102262, -1.140175],
            [0.133333, 0.0, 0.991071, 0.0],
            [-0.635959, 0.766965, 0.085558, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
    result = ks.inverse_kinematics(general_arms.general_arm('manseur'), target)
    assert len(result) == 16
    assert result.method == 'algebraic'


@pytest.mark.parametrize(
    ('name', 'least'),
    [('xarm6', 16), ('random-0', 16), ('RPRRRR-0', 10), ('RPRPRR-0', 8), ('PRRPRR-0', 8)]
    + [('PPRRRR-0', 8), ('PRPRPR-0', 2)],
)
def test_complex_solutions_are_solutions(name, least):
    # By matrices of complex numbers, multiplied out.
    robot = general_arms.general_arm(name)
    screws = screws_of(robot.chain)
    target = ks.forward_kinematics(robot, general_arms.general_poses(name, 1)[0])
    found, proved = complex_solutions(robot, target)
    assert proved
    assert len(found) >= least
    for psi in found:
        T = np.eye(4, dtype=complex)
        for axis, point, slides, value in zip(screws.axes, screws.points, screws.slides, psi):
            step = np.eye(4, dtype=complex)
            if slides:
                step[:3, 3] = value * axis
            else:
                K = np.cross(np.eye(3), axis)
                step[:3, :3] += np.sin(value) * K + (1 - np.cos(value)) * K @ K
                step[:3, 3] = point - step[:3, :3] @ point
            T = T @ step
        size = np.max(np.abs(np.cosh(psi.imag)))
        np.testing.assert_allclose(T @ screws.home, target, rtol=0, atol=1e-12 * size**2)


def zero_of(value, low, high):
    # Between joint positions at which the value has different signs, by bisection.
    sign = np.sign(value(low))
    for _ in range(200):
        middle = 0.5 * (low + high)
        if np.sign(value(middle)) == sign:
            low = middle
        else:
            high = middle
    return low


def folded(name):
    """Return joint positions at which two solutions meet, and the motion that is lost there."""
    robot = general_arms.general_arm(name)
    q = general_arms.general_poses(name, 40)
    determinants = np.linalg.det(ks.jacobian(robot, q))
    low, high = q[np.argmin(determinants)], q[np.argmax(determinants)]
    q = zero_of(lambda q: np.linalg.det(ks.jacobian(robot, q)), low, high)
    return q, np.linalg.svd(ks.jacobian(robot, q))[2][-1]


@pytest.mark.parametrize('name', ['random-0', 'xarm6', 'gen3_lite', 'RPRPRR-0', 'PRRPRR-0'])
def test_a_double_solution_is_not_counted_as_two(name):
    # Two copies of it, 1e-8 apart, would make the count complete.
    robot = general_arms.general_arm(name)
    q, _ = folded(name)
    found, _ = complex_solutions(robot, ks.forward_kinematics(robot, q))
    psi = screws_of(robot.chain).coupling @ q
    away = found - psi
    away = (away.real + math.pi) % (2 * math.pi) - math.pi + 1j * away.imag
    assert len(found) <= plan_for(robot, ROW_NAMES).six_joints.bound - 2
    assert np.all(np.max(np.abs(away), axis=1) > 1e-5)


@pytest.mark.parametrize('beside', [1e-2, 1e-4, 1e-5])
@pytest.mark.parametrize('name', ['random-0', 'gen3_lite', 'RPRPRR-0'])
def test_both_solutions_beside_a_fold_are_found(name, beside):
    robot = general_arms.general_arm(name)
    q, lost = folded(name)
    target = ks.forward_kinematics(robot, q + beside * lost)
    result = ks.inverse_kinematics(robot, target, respect_limits=False)
    given = np.array([one.q for one in result])
    assert np.any(general_arms.apart(robot, given, q + beside * lost) < 0.1 * beside)
    assert np.any(general_arms.apart(robot, given, q - beside * lost) < 0.5 * beside)


def test_a_target_at_which_every_determinant_vanishes_is_known_and_solved_from_beside_it():
    robot = general_arms.general_arm('crx10')
    q = np.array([-3, 2, 4, 3, 0, -1]) * math.pi / 4
    target = ks.forward_kinematics(robot, q)
    found, proved = complex_solutions(robot, target)
    assert not proved
    assert not len(found)
    result = ks.inverse_kinematics(robot, target, respect_limits=False)
    assert (result.complete, result.roots, len(result)) == ('proved', (16, 16), 12)
    assert any(general_arms.apart(robot, one.q, q) < 1e-12 for one in result)


def test_lengths_of_four_decades_are_solved():
    for name in general_arms.MIXED:
        robot = general_arms.general_arm(name)
        for q in general_arms.general_poses(name, 10):
            result = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q))
            assert result.method == 'algebraic'
            assert np.any(general_arms.apart(robot, [one.q for one in result], q) < 1e-6)


def test_a_target_out_of_reach_is_proved_to_be():
    robot = general_arms.general_arm('random-0')
    T = ks.forward_kinematics(robot, np.zeros(6))
    T[:3, 3] *= 5.0
    result = ks.inverse_kinematics(robot, T)
    assert result.status == 'unreachable'
    assert result.method == 'algebraic'
    assert 'proves nothing' not in result.reason


def test_a_solution_without_imaginary_parts_is_real():
    # A solution without imaginary parts, one with round-off, and a pair of conjugates.
    psi = np.ones((4, 6, 2))
    psi[:, :, 1] = np.array([0.0, 1e-17, 0.5, -0.5])[:, None]
    psi[:, :, 0] += np.array([0, 1, 2, 2])[:, None]
    np.testing.assert_array_equal(elimination._real_solutions(psi), psi[:2, :, 0])


def test_elimination_finds_what_the_closed_form_finds():
    # Of an arm that has one, by another road.
    robot = robot_of('ur5e')
    screws = screws_of(robot.chain)
    random = np.random.default_rng(3)
    targets = ks.forward_kinematics(robot, random.uniform(-3, 3, (5, 6)))
    form = six_joints_of(screws, targets)
    psi, said = np.zeros((kernel.MAX_CANDIDATES, 6, 2)), np.zeros(3)
    for target in targets:
        count = kernel.complex_solutions(form, target @ inverse(screws.home), psi, said)
        real = psi[:count][np.max(np.abs(psi[:count, :, 1]), axis=1) < 1e-9, :, 0]
        closed = ks.inverse_kinematics(robot, target, respect_limits=False)
        assert closed.method == 'closed form'
        assert len(real) == len(closed)
        for one in closed:
            assert np.any(general_arms.apart(robot, real, one.q) < 1e-8)


def test_options_that_are_none_are_refused():
    table, eye = np.zeros((6, 7)), np.eye(4)
    for options, bound in (([[6, 0, 0]], 16), ([[0, 2, 0]], 16), ([[0, 0, 0]], 17)):
        with pytest.raises(TypeError):
            kernel.SixJoints(table, eye, np.eye(6), np.array(options), bound)


def test_what_is_known_of_other_solutions_is_said():
    robot = general_arms.general_arm('random-0')
    q = general_arms.general_poses('random-0', 1)[0]
    target = ks.forward_kinematics(robot, q)
    every = ks.inverse_kinematics(robot, target)
    assert (every.complete, every.roots) == ('proved', (16, 16))
    one = ks.inverse_kinematics(robot, target, near=q, all_solutions=False)
    assert (one.complete, one.roots) == ('partial', None)
    closed = robot_of('ur5e')
    result = ks.inverse_kinematics(closed, ks.forward_kinematics(closed, q))
    assert (result.complete, result.roots) == ('proved', None)
    searched = robot_of('planar_3r')
    result = ks.inverse_kinematics(searched, ks.forward_kinematics(searched, [0.3, 0.4, 0.5]))
    assert result.complete == 'found'
    redundant = robot_of('panda')
    target = ks.forward_kinematics(redundant, [0.1] * 7)
    assert ks.inverse_kinematics(redundant, target, curves=False).complete == 'partial'
    assert all(one.multiplicity == 1 for one in every)


def test_infinitely_far_complex_solutions_take_nothing_from_the_proof():
    robot = general_arms.general_arm('RPRRRR-0')
    for q in general_arms.general_poses('RPRRRR-0', 5):
        result = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q))
        assert result.complete == 'proved'
        assert result.roots[0] < result.roots[1] == 16


# Poses of the CRX where the determinants lead to so many of 16 solutions.
LEFT_OUT = (
    (14, [2.8227, -2.8697, 2.186, 2.1944, -1.7642, 3.0047]),
    (15, [-1.0509, 3.086, 1.4266, -0.4541, -1.8878, -2.3779]),
)


def left_out(q):
    robot = robot_of('crx10ia_l')
    target = ks.forward_kinematics(robot, q)
    return robot, target, ks.inverse_kinematics(robot, target, respect_limits=False)


@pytest.mark.parametrize(('count', 'q'), LEFT_OUT)
def test_solutions_that_elimination_leaves_out_complete_the_count(count, q):
    robot, target, result = left_out(q)
    found, proved = complex_solutions(robot, target)
    assert (len(found), proved) == (count, False)
    assert (result.complete, result.roots) == ('proved', (16, 16))
    given = np.array([one.q for one in result])
    assert len(given) == 8
    for one in general_arms.met_by_starts(robot, target, 200):
        assert np.any(general_arms.apart(robot, given, one) < 1e-5)


@pytest.mark.parametrize(('count', 'q'), LEFT_OUT)
def test_a_solution_that_no_start_leads_to_leaves_no_proof(count, q, monkeypatch):
    refined = elimination.refined

    def without_one(target, plan, starts, far=False):
        # What leads to the pose itself, and to its mirror image, ends at the first one.
        arrived = refined(target, plan, starts, far=far)
        lost = np.abs(np.abs(arrived.q[:, 1]) - abs(q[1])) < 1e-3
        others = int(np.flatnonzero(~lost)[0])
        kept = np.where(lost, others, np.arange(len(lost)))
        return elimination.DistinctSolutions(arrived.q[kept], arrived.errors[kept])

    monkeypatch.setattr(elimination, 'refined', without_one)
    assert left_out(q)[2].complete == 'found'


def test_families_are_no_proof():
    robot = robot_of('spherical_rrp')
    result = ks.inverse_kinematics(robot, [0.0, 0.0, 0.9])
    assert result.status == 'family'
    assert result.complete == 'found'


@pytest.mark.parametrize(
    ('name', 'roots'), [('random-0', 16), ('gen3_lite', 16), ('RPRPRR-0', 8), ('PRRPRR-0', 8)]
)
def test_a_double_solution_is_one_of_multiplicity_two_and_the_count_is_complete(name, roots):
    robot = general_arms.general_arm(name)
    q, _ = folded(name)
    result = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q), respect_limits=False)
    assert (result.complete, result.method, result.roots) == (
        'proved',
        'algebraic',
        (roots, roots),
    )
    [double] = [one for one in result if one.multiplicity == 2]
    # Refinement alone ends 1e-8 beside it.
    assert general_arms.apart(robot, double.q, q) < 1e-11
    assert sum(one.multiplicity for one in result) == len(result) + 1


@pytest.mark.parametrize('name', ['random-0', 'gen3_lite'])
def test_two_solutions_a_millionth_apart_are_two(name):
    robot = general_arms.general_arm(name)
    q, lost = folded(name)
    target = ks.forward_kinematics(robot, q + 1e-6 * lost)
    result = ks.inverse_kinematics(robot, target, respect_limits=False)
    near = [one for one in result if general_arms.apart(robot, one.q, q) < 1e-5]
    assert [one.multiplicity for one in near] == [1, 1]


def test_the_zero_pose_of_the_xarm6_has_eight_solutions_one_of_them_three_in_one():
    robot = general_arms.general_arm('xarm6')
    target = ks.forward_kinematics(robot, np.zeros(6))
    result = ks.inverse_kinematics(robot, target, respect_limits=False)
    assert sorted(one.multiplicity for one in result) == [1] * 7 + [3]
    [triple] = [one for one in result if one.multiplicity == 3]
    assert general_arms.apart(robot, triple.q, np.zeros(6)) < 1e-9
    assert all(one.residual < 1e-14 for one in result)
    assert not result.families


@pytest.mark.slow
@pytest.mark.parametrize('name', ['planar_2r', 'anthropomorphic_3r', 'craig_3r'])
def test_a_stretched_elbow_is_one_solution_where_two_have_met(name):
    robot = robot_of(name)
    for q in np.random.default_rng(5).uniform(-1.2, 1.2, (4, robot.dof)):
        q[-1] = 0.0
        target = ks.forward_kinematics(robot, q)[:3, 3]
        result = ks.inverse_kinematics(robot, target, respect_limits=False)
        stretched = [one for one in result if general_arms.apart(robot, one.q, q) < 1e-3]
        assert [one.multiplicity for one in stretched] == [2]
        assert general_arms.apart(robot, stretched[0].q, q) < 1e-10


@pytest.mark.parametrize('size', [1e-2, 1e2])
def test_a_double_solution_is_one_whatever_the_size_of_the_arm(size):
    rows = np.array([(0.1, H, 0.3, 0.0), (0.45, 0.0, 0.05, 0.0), (0.35, 0.0, 0.0, 0.0)])
    rows *= [size, 1.0, size, 1.0]
    robot = ks.robot_from_text(general_arms.text_of('standard', rows.tolist(), 'RRR'))
    q = np.array([0.4, -0.7, 0.0])
    target = ks.forward_kinematics(robot, q)[:3, 3]
    (double,) = ks.inverse_kinematics(robot, target, tolerance=1e-6 * size)
    assert double.multiplicity == 2
    assert general_arms.apart(robot, double.q, q) < 1e-11


PUMA = [(0.0, math.pi / 2, 0.0, 0.0), (0.4318, 0.0, 0.0, 0.0), (0.0203, -math.pi / 2, 0.15, 0.0)]
PUMA += [(0.0, math.pi / 2, 0.4318, 0.0), (0.0, -math.pi / 2, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)]
# Found in closed form, by elimination, and by search.
GEARED = {
    'closed form': ('standard', PUMA),
    'algebraic': general_arms.TABLES['xarm6'],
    'search': ('standard', [(0.4, 0.0, 0.0, 0.0), (0.3, 0.0, 0.0, 0.0)]),
}


@pytest.mark.slow
@pytest.mark.parametrize('gear', [0.5, 0.01, -3.0])
@pytest.mark.parametrize('method', GEARED)
def test_an_unlimited_joint_behind_a_gear_has_one_solution_a_period(method, gear):
    convention, rows = GEARED[method]
    kinds, gears = 'R' * len(rows), [1.0, gear, *[1.0] * (len(rows) - 2)]
    plain = ks.robot_from_text(general_arms.text_of(convention, rows, kinds))
    geared = ks.robot_from_text(general_arms.text_of(convention, rows, kinds, gears=gears))
    theta = np.array([0.3, 0.4, 0.5, 0.6, 0.7, 0.8])[: len(rows)]
    target = ks.forward_kinematics(plain, theta)
    target = target if len(rows) == 6 else target[:3, 3]
    expected = ks.inverse_kinematics(plain, target)
    result = ks.inverse_kinematics(geared, target)
    assert result.method == expected.method == method
    assert len(result) == len(expected)
    for one in expected:
        assert min(general_arms.apart(plain, other.q * gears, one.q) for other in result) < 1e-9
    period = 2 * math.pi / abs(gear)
    assert all(-period / 2 < one.q[1] <= period / 2 + 1e-12 for one in result)


def test_a_joint_that_turns_two_axes_is_back_when_both_are():
    # One turn of q2 turns axis 2 by half a turn and axis 3 by a third: six turns bring both back.
    text = general_arms.text_of('standard', [(0.4, 0.0, 0.0, 0.0)] * 3, 'RRR')
    text = text.replace('theta: q2 + (0.0)', 'theta: q2/2')
    robot = ks.robot_from_text(text.replace('theta: q3 + (0.0)', 'theta: q3 + q2/3'))
    assert plan_for(robot, ('x', 'y', 'rz')).periods[1] == pytest.approx(12 * math.pi)


@pytest.mark.parametrize(('name', 'count'), [('craig_3r', 2), ('six_joint_dh_unit', 4)])
def test_the_held_joints_determine_coupled_motions_that_turn_nothing(name, count):
    # Each motion alone moves the same joint most: two motions must not hold one joint.
    plan = plan_for(ks.load_robot(name), ('rz',))
    held = plan.held == 0
    assert len(plan.idle) == np.sum(held) == count
    assert abs(np.linalg.det(plan.idle[:, held])) > 0.1


@pytest.mark.parametrize('name', general_arms.THREE_SLIDE)
def test_three_joints_that_slide_have_a_closed_form(name):
    robot = general_arms.general_arm(name)
    for q in general_arms.general_poses(name, 8):
        result = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q))
        assert (result.method, result.complete, len(result)) == ('closed form', 'proved', 2)
        assert result.roots == (2, 2)
        assert any(general_arms.apart(robot, one.q, q) < 1e-9 for one in result)


def test_a_border_of_the_directions_that_three_sliding_joints_reach_is_one_double_solution():
    robot = general_arms.general_arm('PRPRPR-0')
    high = general_arms.general_poses('PRPRPR-0', 1)[0]
    low = high + [0.0, 0.0, 0.0, math.pi, 0.0, 0.0]
    # The axes of the joints that turn are in one plane.
    q = zero_of(lambda q: np.linalg.det(ks.jacobian(robot, q)[3:, 1::2]), low, high)
    result = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q))
    assert (result.complete, result.method, result.roots) == ('proved', 'closed form', (2, 2))
    assert [one.multiplicity for one in result] == [2]
    assert general_arms.apart(robot, result[0].q, q) < 1e-11


def test_directions_that_three_sliding_joints_cannot_reach_are_unreachable():
    robot = general_arms.general_arm('PRPRPR-0')
    random = np.random.default_rng(2)
    targets = ks.forward_kinematics(robot_of('ur5e'), random.uniform(-3, 3, (20, 6)))
    results = [ks.inverse_kinematics(robot, target) for target in targets]
    assert {result.status for result in results} == {'solved', 'unreachable'}
    for result in results:
        assert result.complete == 'proved'
        if result.status == 'unreachable':
            assert result.nearest.residual > 1e-6


@pytest.mark.parametrize('axis', ['', 'y'])
def test_the_errors_of_a_target_and_their_jacobian_are_those_of_the_poses(axis):
    robot, random = robot_of('ur5e'), np.random.default_rng(3)
    q, near = random.uniform(-2, 2, 6), random.uniform(-0.1, 0.1, 6)
    target = ik_target_of(robot, ks.forward_kinematics(robot, q + near), axis=axis or None)
    plan = plan_for(robot, target.rows, axis)

    def at(q):
        error, columns = np.empty(6), np.empty((6, 6))
        kernel.linearise(target.residual, plan.scales, q, error, columns)
        return error, columns.T

    T, R, length = (
        ks.forward_kinematics(robot, q),
        robot.singularity.task.rotation,
        robot.singularity.task.length,
    )
    turn = rotation_vector(target.pose[:3, :3] @ T[:3, :3].T)
    if axis:
        a, b = T[:3, 1], target.pose[:3, 1]
        turn = np.cross(a, b) / np.linalg.norm(np.cross(a, b)) * math.acos(a @ b)
    error, J = at(q)
    there = np.concatenate([R.T @ (target.pose[:3, 3] - T[:3, 3]), length * R.T @ turn])
    np.testing.assert_allclose(error, there, rtol=0, atol=1e-12)
    # Next to the target, where the errors are the differences of what is reached.
    error, J = at(q + near)
    steps = 1e-6 * plan.scales * np.eye(6)
    differences = [(at(q + near - s)[0] - at(q + near + s)[0]) / 2e-6 for s in steps]
    np.testing.assert_allclose(J, np.transpose(differences), rtol=0, atol=1e-9)


def test_where_a_loop_does_not_close_the_errors_of_a_target_are_infinite():
    text = without_known_poses('five_bar').replace('distal: 0.4', 'distal: 0.3')
    text = text.replace('[0, 2*pi/3]', '[0, pi]').replace('[pi/3, pi]', '[0, pi]')
    robot = ks.robot_from_text(text.replace('psi1: -1.27, psi2: 1.27', 'psi1: -1.51, psi2: 1.51'))
    q = np.array([math.pi, 0.1])
    with pytest.raises(ks.LoopError):
        ks.forward_kinematics(robot, q)
    target = ik_target_of(robot, [0.1, 0.2, 0.0], rows=('x', 'y'))
    error = np.zeros(6)
    kernel.linearise(target.residual, np.ones(2), q, error, np.zeros((2, 6)))
    assert np.all(np.isinf(error))
