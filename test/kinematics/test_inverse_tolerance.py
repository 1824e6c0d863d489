# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Targets as people type them: reached within a tolerance, by direction of a tool axis."""

import itertools
import math

import numpy as np
import pytest
from arms import robot_of
from general_arms import text_of
from refusal import refused

import kinematics_service as ks
from kinematics_service.errors import ArgumentError
from kinematics_service.rigid_motion import roll_pitch_yaw, rotation_of_roll_pitch_yaw, turn_about

PROVED = 1e-10
DIGITS = 7
ROUNDED = 5e-7  # the contract: what seven digits after the point leave, in m and rad, with room
H = math.pi / 2

# A small arm: shoulder pan and lift, elbow, wrist bend, wrist roll. The tool's z axis rolls.
FIVE = [(0.0, H, 0.06, 0.0), (0.116, 0.0, 0.0, 0.0), (0.135, 0.0, 0.0, 0.0)]
FIVE += [(0.0, H, 0.0, H), (0.0, 0.0, 0.16, 0.0)]
FOUR = [
    (0.0, H, 0.077, 0.0),
    (0.13, 0.0, 0.0, 0.0),
    (0.124, 0.0, 0.0, 0.0),
    (0.126, 0.0, 0.0, 0.0),
]
SCARA = 'scara_hsr065'
TABLES = {'five': FIVE, 'four': FOUR}


@pytest.fixture(scope='module')
def arms(tmp_path_factory):
    folder = tmp_path_factory.mktemp('arms')
    for name, rows in TABLES.items():
        limits = [(-2.5, 2.5)] * len(rows)
        (folder / f'{name}.yaml').write_text(text_of('standard', rows, 'R' * len(rows), limits))
    loaded = {name: ks.load_robot(folder / f'{name}.yaml') for name in TABLES}
    return {**loaded, SCARA: ks.load_robot(SCARA)}


def typed(T):
    """Return a pose as a person types its position and its roll, pitch and yaw."""
    pose = np.eye(4)
    pose[:3, 3] = np.round(T[:3, 3], DIGITS)
    pose[:3, :3] = rotation_of_roll_pitch_yaw(np.round(roll_pitch_yaw(T[:3, :3]), DIGITS))
    return pose


def positions(robot, count, seed=1):
    low, high = robot.limits.T
    return np.random.default_rng(seed).uniform(low, high, (count, robot.dof))


def off(robot, q, target):
    """Return by how much the tool is off, m and rad, by forward kinematics."""
    T = ks.forward_kinematics(robot, q)
    turn = T[:3, :3].T @ target[:3, :3]
    skew = (turn - turn.T)[[2, 0, 1], [1, 2, 0]] / 2
    return np.linalg.norm(T[:3, 3] - target[:3, 3]), np.linalg.norm(skew)


@pytest.mark.parametrize('name', ['five', 'four', SCARA])
def test_what_a_person_types_is_reached_and_the_residual_is_told(arms, name):
    robot = arms[name]
    inexact = 0
    for q in positions(robot, 12):
        target = typed(ks.forward_kinematics(robot, q))
        result = ks.inverse_kinematics(robot, target, near=q)
        assert result.status == 'solved'
        assert min(np.max(np.abs(one.q - q)) for one in result) < 1e-4
        for one in result:
            linear, angular = off(robot, one.q, target)
            assert max(linear, angular) <= ROUNDED
            weighed = math.hypot(linear, robot.singularity.task.length * angular)
            assert one.residual == pytest.approx(weighed, abs=1e-12)
            assert one.exact == (one.residual < PROVED)
        assert not (set(itertools.combinations(result, 2)) & set(alike(result)))
        inexact += not result[0].exact
        assert ('within the tolerance' in result.reason) == any(not one.exact for one in result)
        one = ks.inverse_kinematics(robot, target, near=q, all_solutions=False)
        assert one.status == 'solved'
        assert np.max(np.abs(one[0].q - q)) < 1e-4
        exact = ks.inverse_kinematics(robot, target, tolerance=0.0)
        assert (exact.status == 'solved') == any(one.exact for one in result)
    # The SCARA's roll and pitch are 0, so what is typed is what it reaches.
    assert inexact > 10 or name == SCARA


def alike(result):
    return [
        (a, b) for a, b in itertools.combinations(result, 2) if np.max(np.abs(a.q - b.q)) < 1e-3
    ]


@pytest.mark.parametrize('name', ['five', 'four', SCARA])
def test_a_solution_within_the_tolerance_is_where_the_residual_is_least(arms, name):
    robot = arms[name]
    random = np.random.default_rng(3)
    for q in positions(robot, 4, 2):
        target = ks.forward_kinematics(robot, q)
        target[:3, :3] = turn_about(np.array([1.0, 0.0, 0.0]), 4e-7) @ target[:3, :3]
        for one in ks.inverse_kinematics(robot, target, near=q):
            for _ in range(20):
                linear, angular = off(robot, one.q + 1e-7 * random.normal(size=robot.dof), target)
                assert math.hypot(linear, robot.singularity.task.length * angular) >= one.residual


def test_the_tolerance_is_in_metres_and_radians(arms):
    robot = arms[SCARA]
    q = positions(robot, 1)[0]
    for tilt, reached in ((0.9e-6, True), (1.1e-6, False)):
        target = ks.forward_kinematics(robot, q)
        target[:3, :3] = turn_about(np.array([1.0, 0.0, 0.0]), tilt) @ target[:3, :3]
        result = ks.inverse_kinematics(robot, target)
        assert (result.status == 'solved') == reached
        assert (result.nearest is None) == reached
        wider = ks.inverse_kinematics(robot, target, tolerance=1e-5)
        assert wider.status == 'solved'
        assert wider[0].residual == pytest.approx(tilt * robot.singularity.task.length, rel=1e-3)


def test_exact_solutions_come_first_where_the_arm_can_be_exact():
    robot = robot_of('ur5e')
    target = ks.forward_kinematics(robot, [0.3, -1.0, 1.0, 0.2, 0.7, 1.0])
    loose = ks.inverse_kinematics(robot, target, tolerance=1e-2)
    strict = ks.inverse_kinematics(robot, target, tolerance=0.0)
    assert loose.complete == 'proved'
    assert [one.q.tolist() for one in loose] == [one.q.tolist() for one in strict]


def test_next_to_its_limits_an_arm_reaches_within_the_tolerance():
    # Its boom is 0.4 m long at the least.
    robot = robot_of('rrp_elementary')
    target = [0.4 - 5e-7, 0.0, 0.5]
    assert ks.inverse_kinematics(robot, target, tolerance=0.0).status == 'outside_limits'
    result = ks.inverse_kinematics(robot, target)
    assert result.status == 'solved'
    assert all(one.q[2] >= -1e-8 for one in result)
    assert result[0].residual == pytest.approx(5e-7, rel=1e-3)


def test_a_redundant_arm_just_beyond_its_reach():
    robot = robot_of('kuka_iiwa14')
    target = ks.forward_kinematics(robot, np.zeros(7))
    target[2, 3] += 5e-7
    assert ks.inverse_kinematics(robot, target, tolerance=0.0).status == 'unreachable'
    result = ks.inverse_kinematics(robot, target)
    assert result.status == 'family'
    assert 'within the tolerance' in result.reason
    assert result.families[0].residual == pytest.approx(5e-7, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize('axis', ['x', 'y', 'z'])
@pytest.mark.parametrize('name', ['five', 'ur5e', 'panda', 'six_joint_dh'])
def test_the_direction_of_a_tool_axis_is_reached_and_the_turn_about_it_is_free(arms, name, axis):
    robot = arms[name] if name in arms else robot_of(name)
    k = 'xyz'.index(axis)
    low, high = np.clip(robot.limits.T, -2.5, 2.5)
    for seed in range(1):
        q = np.random.default_rng(seed).uniform(low, high)
        reached = ks.forward_kinematics(robot, q)
        target = reached.copy()
        target[:3, :3] = turn_about(reached[:3, k], 1.3) @ reached[:3, :3]
        result = ks.inverse_kinematics(robot, target, axis=axis)
        assert result.status in ('solved', 'family')
        # A seven-joint arm has two dimensions, six joints have one, five have points; of joints
        # that never turn the axis each adds one.
        for one in [*result, *result.families]:
            T = ks.forward_kinematics(robot, one.q)
            np.testing.assert_allclose(T[:3, 3], target[:3, 3], rtol=0, atol=1e-9)
            np.testing.assert_allclose(T[:3, k], target[:3, k], rtol=0, atol=1e-9)
        for family in result.families:
            assert len(family.motions) >= max(robot.dof - 5, 1)
            step = family.q + 1e-5 * family.motions[0] * family.scales
            T = ks.forward_kinematics(robot, step)
            np.testing.assert_allclose(T[:3, 3], target[:3, 3], rtol=0, atol=1e-8)
            np.testing.assert_allclose(T[:3, k], target[:3, k], rtol=0, atol=1e-8)
        near = ks.inverse_kinematics(robot, target, near=q, axis=axis, all_solutions=False)
        found = near[0] if len(near) else near.families[0]
        np.testing.assert_allclose(found.q, q, rtol=0, atol=1e-6)


def test_five_joints_have_isolated_solutions_for_a_direction_they_can_point(arms):
    # The roll about z is free: what is left are four joints for position and direction.
    robot = arms['five']
    q = positions(robot, 1, 5)[0]
    target = ks.forward_kinematics(robot, q)
    by_z = ks.inverse_kinematics(robot, target, axis='z')
    assert by_z.status == 'family'
    assert {name for family in by_z.families for name in family.joints} == {'j5'}
    # Of x, too, the roll counts: two turns about the wrist's axis at most reach it.
    by_x = ks.inverse_kinematics(robot, target, axis='x')
    assert by_x.status == 'solved'
    assert not by_x.families
    assert min(np.max(np.abs(one.q - q)) for one in by_x) < 1e-6
    # The arm's plane holds the tool axis, so a direction out of that plane is not reached.
    aside = target.copy()
    aside[:3, :3] = turn_about(np.array([0.0, 0.0, 1.0]), 0.3) @ aside[:3, :3]
    assert ks.inverse_kinematics(robot, aside, axis='z').status == 'unreachable'


def test_from_half_a_turn_away_a_direction_is_reached():
    # Where the tool points the other way no turn to the target is the shortest.
    robot = robot_of('ur5e')
    q = np.array([0.3, -1.0, 1.0, 0.2, 0.7, 1.0])
    target = ks.forward_kinematics(robot, q)
    target[:3, :3] = target[:3, :3] @ np.diag([-1.0, 1.0, -1.0])
    result = ks.inverse_kinematics(robot, target, near=q, axis='x', all_solutions=False)
    assert result.status == 'family'
    assert result.families[0].residual < PROVED


@pytest.mark.parametrize(
    ('asked', 'code', 'words'),
    [
        ({'axis': 'w'}, 'unknown-name', ['axis', 'x, y, z', "'w'"]),
        ({'axis': 'z', 'rows': ['rx']}, 'unknown-name', ['rows', "'rx'"]),
        ({'axis': 'z', 'target': [0.3, 0.2, 0.4]}, 'conflict', ['axis z', '(4, 4)']),
        ({'tolerance': -1.0}, 'out-of-range', ['tolerance', '-1.0']),
        ({'tolerance': math.nan}, 'out-of-range', ['tolerance', 'nan']),
        ({'seed': -1}, 'out-of-range', ['seed', '-1']),
        ({'seed': 0.5}, 'wrong-type', ['seed', '0.5']),
    ],
)
def test_what_cannot_be_asked_is_refused(asked, code, words):
    with refused(ArgumentError, code, *words):
        ks.inverse_kinematics(robot_of('ur5e'), **{'target': np.eye(4), **asked})
