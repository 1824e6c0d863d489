"""Joint paths through targets of redundant arms are right, and found if there is one."""

import math

import general_arms
import numpy as np
import pytest
from redundant_arms import random_arm, redundant_arm

import kinematics_service as ks

STEP = 0.2
N = 4


def position_arm():
    return random_arm('RRRR', 3)


def joint_paths(robot, count, seed=0, count_of_targets=N, step=0.19):
    """Return straight joint paths inside the limits that keep away from singular poses."""
    random, (low, high) = np.random.default_rng(seed), robot.limits.T
    scales = np.array(robot.singularity.task.column_scales)
    paths = []
    while len(paths) < count:
        way = random.uniform(-step, step, robot.dof) * scales
        q = random.uniform(low, high) + np.arange(count_of_targets)[:, None] * way
        inside = not np.any((q < low) | (q > high))
        if inside and kept(robot, q, 0.03):
            paths.append(q)
    return paths


def kept(robot, q, distance):
    check = ks.check_plan(robot, np.arange(len(q)), q, distance=distance)
    return check.singularity.verdict == 'proved'


def positions(robot, q):
    return ks.forward_kinematics(robot, q)[:, :3, 3]


def assert_it_follows(robot, targets, result, distance=0.03, step=STEP):
    assert result.verdict == 'yes', result
    q = result.path.q
    low, high = robot.limits.T
    assert np.all((q > low - 1e-6) & (q < high + 1e-6))
    steps = np.abs(np.diff(q, axis=0)) / robot.singularity.task.column_scales
    assert steps.max(initial=0.0) <= step
    T = ks.forward_kinematics(robot, q)
    at = T if targets.ndim == 3 else T[:, :3, 3]
    assert np.max(np.abs(at - targets)) < 1e-9
    assert kept(robot, q, distance)
    for one, arc, arcs in zip(q, result.path.arcs, result.arcs):
        away = (one - arcs[arc].q) / (2.0 * math.pi)
        away -= np.where(robot.prismatic, 0.0, np.round(away))
        assert np.min(np.max(np.abs(away), axis=1)) < 0.1


@pytest.mark.parametrize('seed', range(3))
def test_a_path_that_a_joint_path_made_is_followed(seed):
    robot = position_arm()
    for q in joint_paths(robot, 2, seed):
        targets = positions(robot, q)
        assert_it_follows(robot, targets, ks.follow_family(robot, targets))
        from_there = ks.follow_family(robot, targets, start=q[0])
        assert_it_follows(robot, targets, from_there)
        assert np.array_equal(from_there.path.q[0], q[0])


@pytest.mark.parametrize(
    'name',
    [
        'kuka_iiwa14',
        *(pytest.param(one, marks=pytest.mark.slow) for one in ('panda', 'RRPRRRR-0')),
    ],
)
def test_seven_joints_follow_a_path_of_poses(name):
    robot = redundant_arm(name)
    (q,) = joint_paths(robot, 1, 4, 3)
    targets = ks.forward_kinematics(robot, q)
    result = ks.follow_family(robot, targets, start=q[0])
    assert_it_follows(robot, targets, result)
    assert result.path.rotation_deviation < 0.1


@pytest.mark.parametrize('side', [0, 1])
def test_a_joint_that_follows_along_its_limit_is_inside(side):
    robot = position_arm()
    for q in joint_paths(robot, 20, 9):
        q[:, 1] = robot.limits[1, side]
        if kept(robot, q, 0.03):
            assert_it_follows(
                robot, positions(robot, q), ks.follow_family(robot, positions(robot, q))
            )
            return
    raise AssertionError('no such path')


def test_a_target_out_of_reach_is_named():
    robot = position_arm()
    targets = positions(robot, joint_paths(robot, 1)[0])
    targets[2] += 9.0
    result = ks.follow_family(robot, targets)
    assert (result.verdict, result.path) == ('not found', None)
    assert 'target 2' in result.reason
    assert 'm long' in result.reason


def test_short_steps_lead_to_paths_that_are_right_or_to_none():
    robot, verdicts = position_arm(), []
    random = np.random.default_rng(7)
    for q in joint_paths(robot, 7, 11, 3):
        # Steps that are too short for some of them.
        step = float(random.uniform(0.04, 0.15))
        targets = positions(robot, q)
        result = ks.follow_family(robot, targets, max_step=step, distance=1e-3)
        verdicts.append(result.verdict)
        if result.verdict == 'yes':
            assert_it_follows(robot, targets, result, 1e-3, step)
        else:
            # The joint path that made the targets has longer steps.
            assert np.abs(np.diff(q, axis=0)).max() > 0.5 * step
    assert verdicts.count('not found') > 1
    assert verdicts.count('yes') > 1


def test_postures_all_near_singular_are_refused_by_their_distance():
    robot = position_arm()
    targets = positions(robot, joint_paths(robot, 1)[0])
    result = ks.follow_family(robot, targets, distance=1.0)
    assert result.verdict == 'not found'


def test_an_arm_whose_arcs_are_not_known_has_no_path():
    planar = ks.robot_from_text(
        general_arms.text_of('standard', [(0.4, 0.0, 0.0, 0.0)] * 4, 'RRRR', [(-2.5, 2.5)] * 4)
    )
    flat = ks.forward_kinematics(planar, [[0.3, 0.5, 0.4, 0.2], [0.4, 0.5, 0.4, 0.2]])
    result = ks.follow_family(planar, flat, rows=('x', 'y', 'rz'))
    assert (result.verdict, result.path) == ('not found', None)
    assert 'target 0' in result.reason


def test_what_means_nothing_is_refused():
    robot = position_arm()
    targets = positions(robot, joint_paths(robot, 1)[0])
    for wrong in (np.empty((0, 3)), 'x', 3.0, [[1.0, 2.0]], [[[np.nan] * 4] * 4]):
        with pytest.raises(ks.TargetError):
            ks.follow_family(robot, wrong)
    for asked in ({'max_step': 0.0}, {'max_step': 2.0}, {'distance': -1.0}):
        with pytest.raises(ks.PlanError):
            ks.follow_family(robot, targets, **asked)
    for start in ([0.0], [9.0] * 4, [np.nan] * 4, robot.limits.mean(axis=1)):
        with pytest.raises(ks.JointVectorError):
            ks.follow_family(robot, targets, start=start)
