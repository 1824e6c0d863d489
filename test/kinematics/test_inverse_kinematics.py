# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Inverse kinematics on every arm: round trips, limits, families, and targets that cannot be reached.
"""

import math
import pickle
from dataclasses import fields

import numpy as np
import pytest
from arms import BUNDLED, CONVENTIONS, RANDOM, random_poses, robot_of
from refusal import refused

import kinematics_service as ks
from kinematics_service.kinematics.inverse.problem.plan import plan_for
from kinematics_service.robot.task import ROW_NAMES

PROVED = 1e-10  # the contract: forward kinematics misses the target by less
# The originating q: its pose is known to 1e-16, and random poses are rarely worse than 1e-9 apart.
SAME = 1e-7
POSES = 100

THREE = (
    'anthropomorphic_3r', 'craig_3r', 'parallelogram_left', 'parallelogram_right',
    'rrp_elementary', 'spherical_rrp',
)  # fmt: skip
CLOSED = (
    'puma560', 'offset_stanford_dh', 'offset_stanford_shape', 'ur3e', 'ur5e', 'ur10e',
)  # fmt: skip
SEARCHED = ('offset_stanford_printed', 'planar_2r', 'planar_3r', 'scara_hsr065')
ON_ONE_AXIS = ('six_joint_dh', 'six_joint_dh_unit')
REDUNDANT = ('panda', 'kuka_iiwa14', 'kinova_gen3')


def inside_limits(robot, count, seed=0):
    low, high = np.array(robot.limits.T)
    for j, kind in enumerate(robot.joint_types):
        span = 1.0 if kind == 'prismatic' else 2 * math.pi
        if np.isinf(low[j]) and np.isinf(high[j]):
            low[j] = -span / 2
        if np.isinf(high[j]):
            high[j] = low[j] + span
    return np.random.default_rng(seed).uniform(low, high, (count, robot.dof))


def target_of(robot, q):
    T = ks.forward_kinematics(robot, q)
    return T[:3, 3] if robot.singularity.task.rows == ('x', 'y', 'z') else T


def away(robot, a, b):
    periods = plan_for(robot, ROW_NAMES).periods
    difference = np.asarray(a) - np.asarray(b)
    turns = np.where(np.isfinite(periods), np.round(difference / periods), 0.0)
    return np.max(np.abs(difference - turns * np.where(np.isfinite(periods), periods, 0.0)))


def contains(robot, result, q, same=SAME):
    return any(away(robot, one.q, q) < same for one in result) or any(
        family.distance(q) < same for family in result.families
    )


def assert_honest(robot, target, result):
    """Whatever the answer is, it is true."""
    aim = np.asarray(target)
    for one in [*result, *result.families]:
        T = ks.forward_kinematics(robot, one.q)
        miss = np.linalg.norm(aim[..., -1][:3] - T[:3, 3] if aim.ndim == 2 else aim - T[:3, 3])
        if aim.ndim == 2:
            miss += robot.singularity.task.length * np.linalg.norm(aim[:3, :3] - T[:3, :3])
        assert miss < 2 * PROVED
        assert one.residual < PROVED
        assert one.feasible == (not one.beyond)
        slack = 1e-8
        inside = np.all(
            (one.q >= robot.limits[:, 0] - slack) & (one.q <= robot.limits[:, 1] + slack)
        )
        assert inside or not one.feasible
        assert not one.q.flags.writeable
    assert result.reason
    assert (result.nearest is None) == (result.status == 'solved')
    if result.nearest is not None:
        nearest = result.nearest
        assert np.all(np.isfinite(nearest.q))
        assert np.all(nearest.q >= robot.limits[:, 0] - 1e-8)
        assert np.all(nearest.q <= robot.limits[:, 1] + 1e-8)
        assert math.isfinite(nearest.residual)
    if result.status in ('unreachable', 'outside_limits'):
        assert nearest.residual >= PROVED


@pytest.mark.slow
@pytest.mark.parametrize('name', THREE + CLOSED + SEARCHED)
def test_the_originating_positions_are_among_the_solutions(name):
    robot = robot_of(name)
    for q in inside_limits(robot, POSES if name in THREE + CLOSED else 30):
        target = target_of(robot, q)
        result = ks.inverse_kinematics(robot, target)
        assert result.status == 'solved'
        assert contains(robot, result, q), q
        assert all(one.residual < PROVED and one.feasible for one in result)


@pytest.mark.slow
@pytest.mark.parametrize('name', BUNDLED)
def test_one_solution_is_one_of_all(name):
    robot = robot_of(name)
    for k, q in enumerate(inside_limits(robot, 30, 4)):
        target = target_of(robot, q)
        near = inside_limits(robot, 1, k)[0] if k % 3 else None
        one = ks.inverse_kinematics(robot, target, near=near, all_solutions=False)
        assert_honest(robot, target, one)
        assert one.status in ('solved', 'family')
        assert len(one) + len(one.families) == 1
        if name in THREE + CLOSED:
            every = ks.inverse_kinematics(robot, target, near=near)
            middle = plan_for(robot, ROW_NAMES).middle if near is None else near
            distances = [
                np.linalg.norm((s.q - middle) / robot.singularity.task.column_scales)
                for s in every
            ]
            assert distances == sorted(distances)
            same = [s for s in every if np.max(np.abs(s.q - one[0].q)) < 1e-9]
            assert [s.posture for s in same] == [one[0].posture]
            # Of solutions equally near, as mirrored ones to the middle, it may be any.
            chosen = np.linalg.norm((one[0].q - middle) / robot.singularity.task.column_scales)
            assert chosen <= distances[0] + 1e-9
        elif name in ON_ONE_AXIS and k < 5:
            every = ks.inverse_kinematics(robot, target, near=near)
            assert any(family.contains(one.families[0].q) for family in every.families)
        elif name in SEARCHED and k < 5:
            assert contains(robot, ks.inverse_kinematics(robot, target), one[0].q)


@pytest.mark.parametrize('name', BUNDLED)
def test_one_solution_where_the_arm_is_already(name):
    robot = robot_of(name)
    for q in inside_limits(robot, 20, 8):
        one = ks.inverse_kinematics(robot, target_of(robot, q), near=q, all_solutions=False)
        found = one[0] if len(one) else one.families[0]
        assert np.max(np.abs(found.q - q)) < SAME


def test_one_solution_of_what_has_none_inside_is_answered_as_for_all():
    robot = robot_of('rrp_elementary')
    for respect in (True, False):
        one = ks.inverse_kinematics(
            robot, [0.2, 0.1, 0.5], respect_limits=respect, all_solutions=False
        )
        assert one.status == 'outside_limits'
        assert len(one) == (0 if respect else 1)
        assert one.nearest.residual > 0.1
    far = ks.inverse_kinematics(robot_of('craig_3r'), [9.0, 0, 0], all_solutions=False)
    assert far.status == 'unreachable'
    above = ks.inverse_kinematics(robot_of('spherical_rrp'), [0, 0, 0.9], all_solutions=False)
    assert above.status == 'family'
    assert above.families[0].joints == ('theta1',)


# Targets only a corner of the limits leads to: no joint can give way.
@pytest.mark.parametrize(
    'name', [f'{convention}-{dof}-1' for convention in CONVENTIONS for dof in (7, 9)]
)
def test_redundant_arms_reach_what_the_corners_of_their_limits_reach(name):
    robot = robot_of(name)
    random = np.random.default_rng(2)
    for _ in range(3):
        q = robot.limits[np.arange(robot.dof), random.integers(0, 2, robot.dof)]
        q = np.where(np.isfinite(q), q, random.uniform(-1, 1, robot.dof))
        target = ks.forward_kinematics(robot, q)
        for result in (
            ks.inverse_kinematics(robot, target),
            ks.inverse_kinematics(robot, target, near=q),
            ks.inverse_kinematics(robot, target, all_solutions=False),
        ):
            assert result.status == 'family'
            assert_honest(robot, target, result)


@pytest.mark.parametrize('name', THREE + CLOSED)
def test_a_closed_form_is_found_from_the_chain(name):
    robot = robot_of(name)
    result = ks.inverse_kinematics(robot, target_of(robot, inside_limits(robot, 1, 5)[0]))
    assert result.method == 'closed form'


@pytest.mark.parametrize('name', ON_ONE_AXIS)
def test_two_joints_on_one_axis_make_families_that_contain_the_origin(name):
    robot = robot_of(name)
    for q in inside_limits(robot, 15):
        result = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q))
        assert result.status == 'family'
        assert not len(result)
        assert any(family.contains(q) for family in result.families)
        for family in result.families:
            assert family.straight
            assert family.joints == ('theta1', 'theta2')
            along = family.q + 1.3 * family.motions[0]
            T = ks.forward_kinematics(robot, along)
            np.testing.assert_allclose(T, ks.forward_kinematics(robot, q), rtol=0, atol=1e-9)


@pytest.mark.parametrize('name', REDUNDANT)
def test_a_redundant_arm_answers_with_a_pose_of_its_family(name):
    robot = robot_of(name)
    for q in inside_limits(robot, 15):
        target = ks.forward_kinematics(robot, q)
        result = ks.inverse_kinematics(robot, target, near=q, curves=False)
        assert result.status == 'family'
        assert_honest(robot, target, result)
        assert result.families[0].feasible
        assert away(robot, result.families[0].q, q) < SAME
        assert_honest(robot, target, ks.inverse_kinematics(robot, target, curves=False))


@pytest.mark.slow
@pytest.mark.parametrize(
    'name', RANDOM[:6:2] + RANDOM[13:18:2] + RANDOM[24:30:2] + RANDOM[37:42:2]
)
def test_random_arms_find_the_originating_positions(name):
    robot = robot_of(name)
    for q in inside_limits(robot, 3, 1):
        target = ks.forward_kinematics(robot, q)
        result = ks.inverse_kinematics(robot, target)
        assert_honest(robot, target, result)
        assert contains(robot, result, q, 1e-5)


# One of each way to solve an arm, and of each kind of joint.
HARD = (
    *('craig_3r', 'rrp_elementary', 'parallelogram_left', 'scara_hsr065', 'so101', 'puma560'),
    *('ur5e', 'six_joint_dh', 'offset_stanford_printed', 'panda'),
)


@pytest.mark.slow
@pytest.mark.parametrize('name', HARD)
def test_hard_targets_get_an_honest_answer(name):
    robot = robot_of(name)
    within = np.where(np.isfinite(robot.limits), robot.limits, [-2.0, 2.0])
    random = np.random.default_rng(7)
    found = ks.singularity(robot, random.uniform(*within.T, (40, robot.dof))).nearest_singular
    inside = np.all((found >= within[:, 0]) & (found <= within[:, 1]), axis=1)
    singular = found[inside][:3]
    assert len(singular) == 3
    near = [s + e * random.uniform(-1, 1, robot.dof) for s, e in zip(singular, (1e-4, 1e-9, 1e-6))]
    hard = [np.clip(np.zeros(robot.dof), *robot.limits.T), *within.T, *singular, *near]
    # The middle, a corner, singular ones and those beside; without the corner where families and
    # curves take long.
    for q in hard[::3] if name in ('parallelogram_left', 'panda') else hard[::2]:
        q = np.clip(q, *robot.limits.T)
        target = target_of(robot, q)
        result = ks.inverse_kinematics(robot, target, near=q)
        assert result.status in ('solved', 'family'), q
        assert_honest(robot, target, result)
        assert_honest(robot, target, ks.inverse_kinematics(robot, target, respect_limits=False))
    far = np.array(target)
    far[(slice(3), 3) if far.ndim == 2 else ...] += 1e3
    assert_honest(robot, far, ks.inverse_kinematics(robot, far))


@pytest.mark.parametrize('beyond', [1e-3, 1e-6, 2e-9])
@pytest.mark.parametrize('name', ['anthropomorphic_3r', 'craig_3r', 'parallelogram_left'])
def test_just_beyond_the_reach_is_unreachable_and_just_inside_is_not(name, beyond):
    robot = robot_of(name)
    lengths = {
        'anthropomorphic_3r': (0.0, 0.7), 'craig_3r': (0.12, 0.82), 'parallelogram_left': (0, 0.75)
    }  # fmt: skip
    shoulder, reach = lengths[name]
    if name == 'anthropomorphic_3r':
        reach = float(np.linalg.norm(ks.forward_kinematics(robot, [0, 0, 0])[:3, 3]))
    outside = ks.inverse_kinematics(robot, [reach + beyond, 0.0, 0.0], tolerance=0.0)
    assert outside.status == 'unreachable'
    assert outside.nearest.residual == pytest.approx(beyond, rel=1e-3)
    # What is beyond by less than the tolerance is reached, and never said to be exact.
    result = ks.inverse_kinematics(robot, [reach + beyond, 0.0, 0.0], tolerance=3e-9)
    assert result.status == ('solved' if beyond < 3e-9 else 'unreachable')
    for one in result:
        assert one.residual == pytest.approx(beyond, rel=1e-3)
        assert not one.exact
    inside = ks.inverse_kinematics(robot, [reach - beyond, 0.0, 0.0])
    assert inside.status == 'solved'
    assert len(inside) >= 2
    border = ks.inverse_kinematics(robot, [reach, 0.0, 0.0])
    assert border.status == 'solved'


def test_solutions_are_the_representatives_nearest_to_near():
    robot = robot_of('ur5e')
    q = np.array([5.0, -5.5, 1.1, -4.0, 0.4, 6.0])
    result = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q), near=q)
    np.testing.assert_allclose(result[0].q, q, atol=1e-9)
    assert len(ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q))) == len(result)


def test_solutions_outside_the_limits_name_the_limit():
    robot = robot_of('rrp_elementary')
    result = ks.inverse_kinematics(robot, [0.2, 0.1, 0.5])
    assert result.status == 'outside_limits'
    assert 'd3' in result.reason
    assert not len(result)
    assert 0.0 < result.nearest.residual == pytest.approx(0.4 - math.hypot(0.2, 0.1), abs=1e-6)
    everything = ks.inverse_kinematics(robot, [0.2, 0.1, 0.5], respect_limits=False)
    assert [one.beyond for one in everything] == [('d3',)] * 4
    assert all(one.margin < 0.0 and not one.feasible for one in everything)


@pytest.mark.parametrize('respect_limits', [True, False])
def test_results_that_the_kernel_fills_in_are_those_of_the_constructor(respect_limits):
    robot = robot_of('puma560')
    target = ks.forward_kinematics(robot, [0.3, -0.2, 0.4, 0.5, -0.6, 0.7])
    result = ks.inverse_kinematics(robot, target, respect_limits=respect_limits)
    for one in (result, *result):
        assert [*vars(one)] == [field.name for field in fields(one)]
    assert result.roots is None
    assert result.families == ()
    for one in result:
        same = pickle.loads(pickle.dumps(one))
        assert repr(same) == repr(one)
        room = np.minimum(one.q - robot.limits[:, 0], robot.limits[:, 1] - one.q)
        assert one.margin == np.min(room)
        assert one.feasible == (np.min(room) >= 0.0)
        names = tuple(name for name, left in zip(robot.joint_names, room) if left < 0.0)
        assert one.beyond == names
    assert all(one.feasible for one in result) == respect_limits


def test_without_limits_angles_are_in_the_half_open_turn():
    robot = robot_of('craig_3r')
    for q in inside_limits(robot, 50, 3):
        for one in ks.inverse_kinematics(robot, target_of(robot, q)):
            assert np.all((one.q > -math.pi) & (one.q <= math.pi))


def test_postures_tell_the_solutions_apart():
    robot = robot_of('ur5e')
    result = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, [0.3, -1, 1, 0.2, 0.7, 1]))
    assert len(result) == 8
    assert len({one.posture for one in result}) == 8
    assert str(result[0].posture).startswith('shoulder ')


def side_of_the_elbow(frames):
    """Return the height of a Puma's elbow above the line from its second axis to its wrist."""
    z, o = frames[:, :3, 2], frames[:, :3, 3]
    across = np.eye(3) - np.outer(z[1], z[1])
    chord, upper = across @ (o[4] - o[1]), across @ (o[2] - o[1])
    return (upper - (upper @ chord) / (chord @ chord) * chord) @ z[0]


def test_postures_are_the_sides_that_the_frames_show():
    # The frame of row i has the axis of joint i + 1; that of row 4 stands in the wrist.
    robot = robot_of('puma560')
    seen = set()
    for q in inside_limits(robot, 30, 6):
        for one in ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q)):
            frames = ks.link_frames(robot, one.q)
            z, o = frames[:, :3, 2], frames[:, :3, 3]
            posture = one.posture
            seen.add((posture.shoulder, posture.elbow, posture.wrist))
            right = np.cross(z[1], z[0]) @ (o[4] - o[0]) > 0.0
            assert posture.shoulder == ('right' if right else 'left')
            assert posture.elbow == ('up' if side_of_the_elbow(frames) > 0.0 else 'down')
            unturned = np.cross(z[3], z[4]) @ z[5] > 0.0
            assert posture.wrist == ('no_flip' if unturned else 'flip')
    assert len(seen) == 8


def test_rows_may_be_chosen():
    robot = robot_of('scara_hsr065')
    q = np.array([0.3, 0.8, 0.1, -0.5])
    T = ks.forward_kinematics(robot, q)
    T[:3, :3] = T[:3, :3] @ [
        [1, 0, 0],
        [0, np.cos(0.2), -np.sin(0.2)],
        [0, np.sin(0.2), np.cos(0.2)],
    ]
    assert ks.inverse_kinematics(robot, T).status == 'unreachable'
    free = ks.inverse_kinematics(robot, T, rows=['x', 'y', 'z'])
    assert free.status == 'family'
    assert {name for family in free.families for name in family.joints} == {'joint_4'}


def test_the_same_seed_gives_the_same_answer():
    robot = robot_of('offset_stanford_printed')
    T = ks.forward_kinematics(robot, inside_limits(robot, 1)[0])
    first, second = ks.inverse_kinematics(robot, T), ks.inverse_kinematics(robot, T)
    assert [one.q.tolist() for one in first] == [one.q.tolist() for one in second]
    other = ks.inverse_kinematics(robot, T, seed=5)
    assert len(other) == len(first)


@pytest.mark.parametrize(
    ('target', 'code', 'word'),
    [
        ([1.0, 2.0], 'wrong-shape', '(2,)'),
        (np.full((4, 4), np.nan), 'not-finite', 'nan'),
        ([np.inf, 0, 0], 'not-finite', 'inf'),
        (np.diag([1.0, 1, -1, 1]), 'not-rigid', 'mirror'),
        (np.diag([2.0, 1, 1, 1]), 'not-rigid', 'orthogonal'),
        ('somewhere', 'not-a-number', '(4, 4)'),
    ],
)
def test_what_is_no_target_is_refused(target, code, word):
    with refused(ks.TargetError, code, 'target', word):
        ks.inverse_kinematics(robot_of('puma560'), target)


def test_near_must_be_joint_positions():
    robot = robot_of('craig_3r')
    for near, code in (
        ([0.0], 'wrong-shape'),
        ([0, 0, np.nan], 'not-finite'),
        ('here', 'not-a-number'),
    ):
        with refused(ks.JointVectorError, code, 'near'):
            ks.inverse_kinematics(robot, [0.3, 0, 0], near=near)
    with refused(ks.TargetError, 'unknown-name', 'rows', "'x rz'"):
        ks.inverse_kinematics(robot, [0.3, 0, 0], rows=['x', 'rz'])


POLAR = """\
robot: polar
convention: standard
joints:
  - {name: turn, type: revolute}
  - {name: slide, type: prismatic}
links:
  - {a: 0, alpha: pi/2, d: 0, theta: turn + pi/2}
  - {a: 0, alpha: 0, d: slide, theta: 0}
singularity: {task: [x, y], length: 5}
"""


def test_the_nearest_solution_counts_metres_by_the_characteristic_length(tmp_path):
    path = tmp_path / 'polar.yaml'
    path.write_text(POLAR)
    robot = ks.load_robot(path)
    q = np.array([0.4, 3.0])
    # The other solution is half a turn away, with the boom drawn through the centre. In rad and
    # lengths of 5 m it is sqrt(0.2^2 + (6 / 5)^2) from here, and q is pi - 0.2.
    near = np.array([0.4 + math.pi - 0.2, 3.0])
    position = ks.forward_kinematics(robot, q)[:3, 3]
    result = ks.inverse_kinematics(robot, position, near=near)
    assert [away(robot, one.q, q) < SAME for one in result] == [False, True]
    np.testing.assert_allclose(result[0].q, [0.4 + math.pi, -3.0], rtol=0, atol=SAME)


def test_a_family_beyond_the_limits_is_given_where_it_is_nearest(tmp_path):
    text = (ks.bundled_robots()['six_joint_dh_unit']).read_text()
    path = tmp_path / 'narrow.yaml'
    path.write_text(
        text.replace(
            'name: theta3, type: revolute', 'name: theta3, type: revolute, limits: [0, 5]'
        )
    )
    robot = ks.load_robot(path)
    q = np.radians([20.0, 35.0, 70.0, 50.0, -60.0, 15.0])  # theta3 is beyond its limit of 5
    near = np.array([1.1, -0.2, 0.3, -0.4, 0.5, -0.6])
    target = ks.forward_kinematics(robot, q)
    result = ks.inverse_kinematics(robot, target, near=near, respect_limits=False)
    beyond = [family for family in result.families if not family.feasible]
    assert any(family.contains(q) for family in beyond)
    for family in beyond:
        assert 'theta3' in family.beyond
        T = ks.forward_kinematics(robot, family.q)
        np.testing.assert_allclose(T, target, rtol=0, atol=1e-9)
        # Nearest: no step along the family leads nearer. The steps end at 1e-4.
        along = family.motions @ ((near - family.q) / family.scales)
        assert np.max(np.abs(along)) < 1e-4


@pytest.mark.parametrize('name', ['puma560', 'xarm6', 'panda'])
@pytest.mark.parametrize('respect_limits', [True, False])
def test_many_poses_are_answered_as_each_of_them(name, respect_limits):
    robot = robot_of(name)
    poses = ks.forward_kinematics(robot, random_poses(robot, 4, 3))
    # One is beyond reach, and one is singular.
    poses[1, :3, 3] += 5.0
    poses[2] = ks.forward_kinematics(robot, np.zeros(robot.dof))
    results = ks.inverse_kinematics_of_each(robot, poses, respect_limits=respect_limits)
    assert len(results) == len(poses)
    for pose, result in zip(poses, results):
        one = ks.inverse_kinematics(robot, pose, respect_limits=respect_limits)
        assert (result.status, result.complete, result.reason) == (
            one.status,
            one.complete,
            one.reason,
        )
        assert len(result) == len(one)
        for a, b in zip(result, one):
            assert np.array_equal(a.q, b.q)
            assert (a.residual, a.margin, a.posture, a.beyond) == (
                b.residual,
                b.margin,
                b.posture,
                b.beyond,
            )
            assert not a.q.flags.writeable


def test_poses_that_are_none_are_refused():
    for targets, code in (
        (np.eye(4), 'wrong-shape'),
        (np.zeros((2, 3)), 'wrong-shape'),
        ([[1.0], 'x'], 'not-a-number'),
        (np.full((1, 4, 4), np.nan), 'not-finite'),
    ):
        with refused(ks.TargetError, code, 'target'):
            ks.inverse_kinematics_of_each('ur5e', targets)
    assert ks.inverse_kinematics_of_each('ur5e', np.empty((0, 4, 4))) == ()


def test_solutions_inside_the_limits_are_those_of_all_that_are():
    robot = robot_of('puma560')
    for pose in ks.forward_kinematics(robot, random_poses(robot, 20, 5)):
        inside = ks.inverse_kinematics(robot, pose)
        every = ks.inverse_kinematics(robot, pose, respect_limits=False)
        feasible = [one for one in every if one.feasible]
        assert len(inside) == len(feasible)
        for a, b in zip(inside, feasible):
            # Refined from a full turn away: round-off.
            assert np.max(np.abs(a.q - b.q)) < 1e-13
