# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Closed forms prove that they have all solutions only where no step of them is singular.

Tables with rounded numbers, and lengths far apart, are nearly but not exactly what a closed form
takes them for: at singular poses the solution the target was made from may be missing, and then
nothing may be called proved.
"""

import math
import warnings

import numpy as np
import pytest
from arms import robot_of, seeded
from general_arms import apart, text_of

import kinematics_service as ks
from kinematics_service.rigid_motion import turn_about
from kinematics_service.robot.clearance_bounds import reach_of
from kinematics_service.robot.task import seeded_poses

H = math.pi / 2
# What a solution is known to at a pose that is singular but for the last digits.
SAME = 1e-6


def ur_like(h):
    """Return a UR-like arm whose right angles are written as h."""
    rows = [(0.0, h, 0.1519, 0.0), (-0.2437, 0.0, 0.0, 0.0), (-0.2132, 0.0, 0.0, 0.0)]
    rows += [(0.0, h, 0.1124, 0.0), (0.0, -h, 0.0854, 0.0), (0.0, 0.0, 0.0819, 0.0)]
    return rows, 'RRRRRR'


def puma_like(h):
    rows = [(0.0, -h, 0.61, 0.0), (0.43, 0.0, 0.14, 0.0), (-0.02, h, 0.0, 0.0)]
    rows += [(0.0, -h, 0.41, 0.0), (0.0, h, 0.0, 0.0), (0.0, 0.0, 0.07, 0.0)]
    return rows, 'RRRRRR'


def spherical_shoulder(h):
    rows = [(0.0, -h, 0.0, 0.0), (0.0, h, 0.0, 0.0), (0.02, -h, 0.45, 0.0)]
    rows += [(0.38, 0.0, 0.03, 0.0), (0.11, h, 0.0, 0.0), (0.0, 0.0, 0.09, 0.0)]
    return rows, 'RRRRRR'


def stanford_like(h):
    rows = [(0.0, -h, 0.35, 0.0), (0.0, h, 0.12, 0.0), (0.0, 0.0, 0.2, 0.0)]
    rows += [(0.0, -h, 0.0, 0.0), (0.0, h, 0.0, 0.0), (0.0, 0.0, 0.21, 0.0)]
    return rows, 'RRPRRR'


def elbow_arm(h):
    return [(0.1, h, 0.3, 0.0), (0.45, 0.0, 0.05, 0.0), (0.35, 0.0, 0.0, 0.0)], 'RRR'


def skew_three(h):
    return [(0.2, h, 0.1, 0.0), (0.3, -h, 0.0, 0.0), (0.25, 0.0, 0.15, 0.0)], 'RRR'


def polar_arm(h):
    return [(0.0, -h, 0.4, 0.0), (0.05, h, 0.1, 0.0), (0.0, 0.0, 0.3, 0.0)], 'RRP'


def five_joints(h):
    rows = [(0.0, h, 0.3, 0.0), (0.3, 0.0, 0.0, 0.0), (0.25, 0.0, 0.0, 0.0)]
    return [*rows, (0.0, h, 0.0, 0.0), (0.0, 0.0, 0.12, 0.0)], 'RRRRR'


def four_joints(h):
    rows = [(0.0, h, 0.2, 0.0), (0.3, 0.0, 0.0, 0.0), (0.2, 0.0, 0.0, 0.0)]
    return [*rows, (0.1, 0.0, 0.0, 0.0)], 'RRRR'


SHAPES = (
    ur_like, puma_like, spherical_shoulder, stanford_like, elbow_arm, skew_three, polar_arm,
    five_joints, four_joints,
)  # fmt: skip


def written(convention, rows, kinds):
    """Return the robot of a table written in any convention, the same motions in each."""
    if convention in ('standard', 'modified'):
        return ks.robot_from_text(text_of(convention, rows, kinds))
    text = text_of('standard', rows, kinds).replace('standard', convention)
    text = text[: text.index('links:')] + 'links:\n'
    for i, (a, alpha, d, theta) in enumerate(rows):
        if convention == 'elementary':
            turn, way = (f'q{i + 1} + ({theta!r})', repr(d))
            if kinds[i] == 'P':
                turn, way = repr(theta), f'q{i + 1} + ({d!r})'
            text += f'  - Rz({turn})\n  - Tz({way})\n  - Tx({a!r})\n  - Rx({alpha!r})\n'
            continue
        c, s, ct, st = math.cos(alpha), math.sin(alpha), math.cos(theta), math.sin(theta)
        R = np.array([[ct, -st * c, st * s], [st, ct * c, -ct * s], [0.0, s, c]])
        out = np.column_stack([R.T, -R.T @ [a * ct, a * st, d]])
        motion = 'Rz' if kinds[i] == 'R' else 'Tz'
        text += f'  - {{joint: {motion}(q{i + 1}), out: {out.tolist()!r}}}\n'
    return ks.robot_from_text(text)


def target_at(robot, q):
    T = ks.forward_kinematics(robot, q)
    return T[:3, 3] if robot.dof == 3 else T


def is_kept(robot, q):
    """Return whether q is among the solutions of its own pose, or no proof is claimed."""
    result = ks.inverse_kinematics(robot, target_at(robot, q))
    if result.complete != 'proved':
        return True
    one = any(apart(robot, solution.q, q) < SAME for solution in result)
    return one or any(family.distance(q) < SAME for family in result.families)


@pytest.mark.slow
@pytest.mark.parametrize(
    ('h', 'turned'), [(1.570796327, 0.0), (1.5707963, math.pi), (1.5708, math.pi)]
)
def test_rounded_right_angles_at_the_singular_wrist_of_parallel_axes(h, turned):
    robot = ks.robot_from_text(text_of('standard', *ur_like(h)))
    random = np.random.default_rng(31)
    for beside in (0.0, -3e-8, 1e-5):
        q = random.uniform(-3, 3, 6)
        q[4] = turned + beside
        assert is_kept(robot, q), q


@pytest.mark.slow
@pytest.mark.parametrize('error', [1e-12, 1e-10, 1e-8])
def test_small_errors_of_every_number_at_the_singular_wrist(error):
    random = np.random.default_rng(4)
    for _ in range(2):
        rows, kinds = ur_like(H)
        rows = np.array(rows) + error * random.normal(size=(6, 4))
        robot = ks.robot_from_text(text_of('standard', rows.tolist(), kinds))
        q = random.uniform(-3, 3, 6)
        for q[4] in (0.0, math.pi):
            assert is_kept(robot, q), q


@pytest.mark.parametrize('beside', [0.0, 1e-10, 1e-5])
def test_lengths_far_apart_at_a_singular_shoulder(beside):
    rows = [(0.0, -H, 0.0, 0.0), (0.0, H, 0.0, 0.0), (0.0, H, -47.3, 0.0)]
    rows += [(0.0031, 0.0, 0.0017, 0.0), (0.009, -H, 0.0, 0.0), (0.0, 0.0, 0.0024, 0.0)]
    robot = ks.robot_from_text(text_of('standard', rows))
    random = np.random.default_rng(8)
    for k in range(16):
        q = random.uniform(-3, 3, 6)
        q[[1, 2, 3, 4][k % 4]] = 0.0
        q[1] = [0.0, H, 0.4, math.pi][k // 4]
        assert is_kept(robot, q + beside * random.normal(size=6)), q


@pytest.mark.slow
@pytest.mark.parametrize('shape', SHAPES)
def test_no_proof_misses_the_positions_the_target_was_made_from(shape):
    # Every number of the table off by 1e-16 to 1e-3, or rounded, or lengths of six decades; poses
    # on a grid that meets every singular set of such arms, and next to it.
    random = np.random.default_rng([5, *shape.__name__.encode()])
    for k in range(4):
        rows, kinds = shape(H)
        rows = np.array(rows)
        if k % 4 == 0:
            rows[:, [0, 2]] *= 10.0 ** random.uniform(-3, 2, (len(rows), 2))
        if k % 3 == 0:
            rows = np.round(rows, 4 + k)
        else:
            rows = rows + 10.0 ** random.uniform(-16, -3) * random.normal(size=rows.shape)
        convention = ('standard', 'modified', 'elementary', 'shape')[k % 4]
        robot = written(convention, rows.tolist(), kinds)
        for way in range(2):
            grid = random.integers(-2, 3, len(kinds)) * H
            q = np.where(random.random(len(kinds)) < 0.6, grid, random.uniform(-3, 3, len(kinds)))
            if way:
                q = q + 10.0 ** random.uniform(-12, -2) * random.normal(size=len(q))
            assert is_kept(robot, q), (k, q)


@pytest.mark.parametrize(
    'name', ['ur5e', 'puma560', 'offset_stanford_dh', 'craig_3r', 'rrp_elementary']
)
def test_random_poses_stay_proved_in_closed_form(name):
    robot = robot_of(name)
    slides = [kind == 'prismatic' for kind in robot.joint_types]
    results = [
        ks.inverse_kinematics(robot, target_at(robot, q))
        for q in seeded_poses(robot.limits, slides)[:150]
    ]
    proved = [r.complete == 'proved' and r.method == 'closed form' for r in results]
    assert np.mean(proved) >= 0.99


@pytest.mark.parametrize('angle', [1e-9, 8e-9, -2e-9])
@pytest.mark.parametrize('convention', ['standard', 'modified', 'elementary', 'shape'])
def test_first_axes_that_are_next_to_parallel(angle, convention):
    three = [(0.27, angle, 0.19, 0.0), (0.33, H, 0.08, 0.0), (0.21, 0.0, 0.0, 0.0)]
    wrist = [(0.0, H, 0.0, 0.0), (0.0, -H, 0.0, 0.0), (0.0, 0.0, 0.06, 0.0)]
    q = np.array([0.4, -0.9, 0.7, 0.3, 0.8, -0.5])
    tables = [three, three + wrist]
    if convention == 'modified':
        # Each row has the a and alpha of the one before.
        ends = [(0.0, 0.0), *((a, alpha) for a, alpha, _, _ in three + wrist)]
        tables = [[(*end, d, theta) for end, (_, _, d, theta) in zip(ends, three + wrist)]]
    for rows in tables:
        robot = written(convention, rows, 'R' * len(rows))
        assert is_kept(robot, q[: len(rows)])
        assert ks.inverse_kinematics(robot, target_at(robot, q[: len(rows)])).status == 'solved'


@pytest.mark.slow
@pytest.mark.parametrize('joints', [1, 3, 4, 6, 7, 8])
def test_no_numbers_of_a_table_or_a_target_raise_what_is_not_said(joints):
    random = np.random.default_rng([joints, 12])
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        # All curves of seven joints take a second.
        for k in range(4 if joints != 7 else 1):
            size = 10.0 ** random.uniform(-16, 6, (joints, 4))
            odd = random.random((joints, 4)) < 0.3
            rows = random.choice([0.0, 0.3], (joints, 4)) + np.where(odd, size, 0.0)
            rows[:, 1] = random.choice([0.0, H, -H], joints) + np.where(odd[:, 1], size[:, 1], 0.0)
            kinds = ''.join(random.choice(['R', 'P'], joints, p=[0.8, 0.2]))
            convention = ('standard', 'modified', 'elementary', 'shape')[k % 4]
            try:
                robot = written(convention, rows.tolist(), kinds)
            except ks.KinematicsError:
                continue
            T = ks.forward_kinematics(robot, random.uniform(-3, 3, joints))
            broken = T[:3, 3].copy()
            broken[k % 3] = (math.nan, math.inf, 1e300, 1e-300)[k % 4]
            for target in (T, T[:3, 3], broken):
                try:
                    result = ks.inverse_kinematics(robot, target)
                except ks.KinematicsError:
                    continue
                assert result.reason


def test_solutions_of_more_joints_than_rows_have_no_multiplicity():
    rows = [(1.5521452659205367e-16, -1.5707967925343298, 1.0597013710023509e-11, 0.0)]
    rows += [(1.5895520565035263e-11, 3.1415926535912155, 0.0, -4.2895512721216966e-16)]
    rows += [(-1.9819653664229508e-22, 3.141592653590406, 1.0597013710023523e-11, -8.715e-07)]
    rows += [(1.585913138839139e-11, 1.4498220293e-15, 1.5093702231593738e-15, 671.2033370970939)]
    point = [-1.0392239331510708e-11, 7.0216822378318045e-12, 2.99745000251939e-11]
    assert ks.inverse_kinematics(written('elementary', rows, 'RRRR'), point).status


@pytest.mark.parametrize('height', [0.0, 0.25, 800.0])
def test_joints_that_never_move_the_point_leave_a_family(height):
    rows = [(0.0, H, height, 0.0), (0.0, -H, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)]
    robot = ks.robot_from_text(text_of('standard', rows, 'RRR'))
    q = np.array([0.6, -1.1, 2.0])
    point = ks.forward_kinematics(robot, q)[:3, 3]
    result = ks.inverse_kinematics(robot, point)
    assert (result.status, result.complete, len(result)) == ('family', 'found', 0)
    (family,) = result.families
    assert family.joints == ('j1', 'j2', 'j3')
    assert family.straight
    for other in np.random.default_rng(2).uniform(-3, 3, (5, 3)):
        assert family.contains(other)
    away = ks.inverse_kinematics(robot, point + [0.0, 0.02, 0.0])
    assert (away.status, away.complete) == ('unreachable', 'proved')
    assert away.nearest.position_error == pytest.approx(0.02)


@pytest.mark.parametrize('size', [1e-12, 1e-7, 1e6])
@pytest.mark.parametrize('shape', [ur_like, puma_like, elbow_arm, five_joints])
def test_an_arm_of_any_size_is_the_same_arm(shape, size):
    rows, kinds = shape(H)
    robot = ks.robot_from_text(text_of('standard', rows, kinds))
    table = np.array(rows) * [size, 1.0, size, 1.0]
    other = ks.robot_from_text(text_of('standard', table.tolist(), kinds))
    assert other.singularity.task.rows == robot.singularity.task.rows
    assert other.singularity.task.generic_rank == robot.singularity.task.generic_rank
    assert other.singularity.task.length == pytest.approx(
        size * robot.singularity.task.length, rel=1e-9
    )
    q = np.array([0.3, -0.8, 1.1, 0.5, 0.7, -0.4])[: len(kinds)]
    assert ks.singularity(other, q).distance == pytest.approx(
        ks.singularity(robot, q).distance, rel=1e-6
    )
    target = target_at(other, q)
    # A tolerance as large as the arm would leave more solutions.
    ours, theirs = (
        ks.inverse_kinematics(robot, target_at(robot, q)),
        ks.inverse_kinematics(other, target, tolerance=1e-6 * min(size, 1.0)),
    )
    assert (theirs.status, theirs.method, theirs.complete) == (
        ours.status, ours.method, ours.complete
    )  # fmt: skip
    assert len(theirs) == len(ours)
    assert all(solution.exact for solution in theirs)
    assert min(apart(other, solution.q, q) for solution in theirs) < 1e-9
    # A tenth of the arm off is no solution, however small that is.
    if robot.dof == 3:
        off = ks.inverse_kinematics(other, target * 100.0, tolerance=0.0)
        assert (off.status, off.complete) == ('unreachable', 'proved')


REACHING = ('planar_3r', 'craig_3r', 'puma560', 'panda', 'so101')


@pytest.mark.parametrize('name', [*REACHING, 'scara_hsr065', 'five_bar'])
def test_what_is_beyond_the_lengths_is_proved_to_be(name):
    robot = robot_of(name)
    reach = reach_of(robot.chain, np.array(robot.limits))
    q = seeded(robot, 1000)
    away = ks.forward_kinematics(robot, q)[:, :3, 3] - reach.centre
    assert np.max(np.linalg.norm(away, axis=1)) <= reach.radius
    result = ks.inverse_kinematics(robot, [3.9, -0.3, 0.1])
    assert (result.status, result.complete) == ('unreachable', 'proved')
    assert f'the arm is {reach.radius:.4g} m' in result.reason
    assert result.nearest.position_error > 0.3


def test_the_reach_of_a_slide_without_limits_proves_nothing():
    robot = ks.robot_from_text(text_of('standard', *polar_arm(H)))
    assert math.isinf(reach_of(robot.chain, np.array(robot.limits)).radius)
    assert ks.inverse_kinematics(robot, [40.0, 3.0, 1.0]).status == 'solved'


# Arms of five joints (a, alpha, d, theta): the Mitsubishi RV-M1 by its textbook table; wrists of
# two axes; a rail along the parallel axes; parallel axes first; no axes that meet or are parallel.
FIVE_JOINTS = {
    'rv_m1': ('standard', 'RRRRR', 4, 'closed form', [
        (0, H, 0.3, 0), (0.25, 0, 0, 0), (0.16, 0, 0, 0), (0, H, 0, 0), (0, 0, 0.072, 0)]),
    'rv_m1_modified': ('modified', 'RRRRR', 4, 'closed form', [
        (0, 0, 0.3, 0), (0, H, 0, 0), (0.25, 0, 0, 0), (0.16, 0, 0, 0), (0, H, 0.072, 0)]),
    'offsets': ('standard', 'RRRRR', 2, 'closed form', [
        (0.05, H, 0.3, 0), (0.25, 0, 0.03, 0), (0.16, 0, -0.01, 0), (0.02, H, 0.04, 0),
        (0.03, 0.35, 0.072, 0)]),
    'two_parallel': ('standard', 'RRRRR', 1, 'closed form', [
        (0.05, H, 0.3, 0), (0.25, 0, 0.03, 0), (0, H, 0, 0), (0, -H, 0.3, 0), (0.03, 0, 0, 0)]),
    'parallel_first': ('standard', 'RRRRR', 2, 'algebraic', [
        (0.3, 0, 0.1, 0), (0.2, 0, 0, 0), (0.1, H, 0, 0), (0, H, 0, 0), (0.1, 0, 0.1, 0)]),
    'rail': ('standard', 'PRRRR', 2, 'algebraic', [
        (0, 0, 0, 0), (0.25, 0, 0, 0), (0.16, 0, 0, 0), (0.05, H, 0, 0), (0, 0, 0.072, 0)]),
    'skew': ('standard', 'RRRRR', 1, 'algebraic', [
        (0.1, 0.7, 0.1, 0), (0.2, 0.5, 0.1, 0), (0.15, 1.2, 0.3, 0), (0.1, 0.9, 0.1, 0),
        (0, 0, 0.1, 0)]),
}  # fmt: skip


@pytest.mark.parametrize('name', FIVE_JOINTS)
def test_solutions_of_five_joints_are_proved_to_be_all(name):
    convention, kinds, count, method, rows = FIVE_JOINTS[name]
    robot = ks.robot_from_text(text_of(convention, rows, kinds))
    q = np.array([0.31, -0.83, 1.17, 0.52, 0.74])
    exact = ks.forward_kinematics(robot, q)
    for target in (exact, np.round(exact, 7)):
        result = ks.inverse_kinematics(robot, target)
        assert (result.method, result.complete, len(result)) == (method, 'proved', count)
        assert min(apart(robot, one.q, q) for one in result) < 1e-5
    # Five joints leave one condition, which a turned target does not meet.
    exact[:3, :3] = turn_about(np.array([0.6, 0.0, 0.8]), 0.2) @ exact[:3, :3]
    away = ks.inverse_kinematics(robot, exact)
    assert (away.status, away.complete) == ('unreachable', 'proved')
    assert away.nearest.residual > 1e-4


def test_five_joints_prove_nothing_where_a_rounded_target_meets_a_border():
    # The elbow is stretched in one of two branches, the target rounded beyond it: that branch has
    # two solutions within the tolerance, or none.
    convention, kinds, _, _, rows = FIVE_JOINTS['offsets']
    robot = ks.robot_from_text(text_of(convention, rows, kinds))
    q = np.array([0.0, H, -math.pi, -H, math.pi])
    target = np.round(ks.forward_kinematics(robot, q), 7)
    result = ks.inverse_kinematics(robot, target)
    assert result.complete == 'found'
    assert min(apart(robot, one.q, q) for one in result) < 1e-6
    # A tolerance as large as this leaves more than branches.
    assert ks.inverse_kinematics(robot, target, tolerance=1e-2).complete == 'found'
