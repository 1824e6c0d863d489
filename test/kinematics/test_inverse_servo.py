# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The servo: exact away from singular poses, bounded through them, never beyond a limit."""

import math

import numpy as np
import pytest
from arms import DISTINCT, RANDOM, poses, robot_of, sliding
from refusal import refused

import kinematics_service as ks
from kinematics_service import ServoSettings, TwistError, joint_velocity
from kinematics_service.errors import ArgumentError, ServoSettingsError
from kinematics_service.kinematics.inverse.servo import DEFAULTS
from kinematics_service.robot.task import ROW_NAMES

EXACT = 1e-9  # the contract: away from singular poses nothing is damped
ROUND_OFF = 1e-12
RATES = (200.0, 1000.0)


def velocity_limits(robot):
    otherwise = np.where(sliding(robot), DEFAULTS.default_speed, DEFAULTS.default_rate)
    return np.where(np.isfinite(robot.velocity_limits), robot.velocity_limits, otherwise)


def task_rows(robot, J):
    # By a road of its own: in the axes of frame 0, metres and radians made to compare.
    R = ks.link_frames(robot, np.zeros(robot.dof))[0, :3, :3]
    J = np.concatenate([R.T @ J[:3], R.T @ J[3:]])
    rows = [ROW_NAMES.index(name) for name in robot.singularity.task.rows]
    weights = np.where(np.array(rows) < 3, 1.0, robot.singularity.task.length)
    return J[rows] * (weights if J.ndim == 1 else weights[:, None])


def least_squares(robot, q, twist):
    S = np.where(sliding(robot), robot.singularity.task.length, 1.0)
    J = task_rows(robot, ks.jacobian(robot, q)) * S
    return S * np.linalg.lstsq(J, task_rows(robot, np.asarray(twist)), rcond=1e-10)[0]


def drive(robot, q, twist, rate, seconds, settings=DEFAULTS):
    # Positions and steps of a constant twist, integrated as a controller would.
    q, steps, way = np.array(q, dtype=float), [], []
    for _ in range(int(seconds * rate)):
        step = joint_velocity(robot, q, twist, settings)
        q = q + step.qdot / rate
        steps.append(step)
        way.append(q)
    return np.array(way), steps


@pytest.mark.slow
@pytest.mark.parametrize('name', DISTINCT)
def test_away_from_singular_poses_it_is_least_squares(name):
    robot = robot_of(name)
    random = np.random.default_rng(3)
    compared = 0
    for q in np.clip(poses(robot, 30), *robot.limits.T):
        twist = random.normal(size=6) * 1e-3
        step = joint_velocity(robot, q, twist)
        if not step.limited_by:
            expected = least_squares(robot, q, twist)
            np.testing.assert_allclose(step.qdot, expected, rtol=0, atol=EXACT)
            compared += 1
        np.testing.assert_allclose(step.twist, ks.twist(robot, q, step.qdot), atol=ROUND_OFF)
    assert compared or name in RANDOM


@pytest.mark.slow
@pytest.mark.parametrize('name', DISTINCT)
@pytest.mark.parametrize('size', [5e-324, 1e-3, 1.0, 1e308])
def test_bounded_for_every_finite_input(name, size):
    robot = robot_of(name)
    random = np.random.default_rng(4)
    fastest = velocity_limits(robot)
    for q in [*poses(robot, 3), 1e6 * random.normal(size=robot.dof)]:
        twist = random.uniform(-1.0, 1.0, 6) * size
        step = joint_velocity(robot, q, twist)
        assert np.all(np.abs(step.qdot) <= fastest * (1 + ROUND_OFF))
        beyond = (step.qdot > 0) & (q >= robot.limits[:, 1])
        assert not np.any(beyond | ((step.qdot < 0) & (q <= robot.limits[:, 0])))
        assert np.all(np.isfinite(step.twist))
        assert 0.0 < step.scale <= 1.0
        assert 0.0 <= step.damping <= 1.0


# The joint that leads into each singular pose of an arm with six joints.
INTO = {'shoulder': 1, 'elbow': 2, 'wrist': 4}
INSIDE = np.array([0.4, -0.6, 0.7, -0.6, 0.9, 0.3])


def singular(robot, joint):
    # The pose near INSIDE where det J changes its sign along one joint.
    def turned(angle):
        q = INSIDE.copy()
        q[joint] = angle
        return q

    def determinant(angle):
        return np.linalg.det(ks.jacobian(robot, turned(angle)))

    angles = np.clip(np.linspace(-3.1, 3.1, 200), *robot.limits[joint])
    signs = np.sign([determinant(angle) for angle in angles])
    k = int(np.flatnonzero(np.diff(signs))[0])
    low, high = angles[k], angles[k + 1]
    while high - low > 1e-14:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if determinant(middle) * signs[k] > 0 else (low, middle)
        if middle in (low, high) and high - low < 1e-13:
            break
    return turned(low)


@pytest.mark.slow
@pytest.mark.parametrize('kind', INTO)
@pytest.mark.parametrize('name', ['ur5e', 'puma560'])
@pytest.mark.parametrize('rate', RATES)
def test_bounded_through_wrist_elbow_and_shoulder_singularities(name, kind, rate):
    robot = robot_of(name)
    q = singular(robot, INTO[kind])
    least = []
    for seed in range(2):
        away = np.zeros(6)
        away[INTO[kind]] = 0.15
        random = np.random.default_rng(seed)
        # Towards the singular pose and beyond, as the joint that leads into it would; and some.
        twist = ks.twist(robot, q + away, -away) + 0.01 * random.normal(size=6)
        way, steps = drive(robot, q + away, twist, rate, 1.5)
        qdot = np.array([step.qdot for step in steps])
        assert np.all(np.abs(qdot) <= velocity_limits(robot) * (1 + ROUND_OFF))
        # The gain of each direction is at most 1.16 / damped_below, whatever the pose.
        size = np.linalg.norm(twist * ([1 / robot.singularity.task.length] * 3 + [1] * 3))
        free = [np.linalg.norm(step.qdot) for step in steps if not step.held]
        assert max(free) <= 1.16 / DEFAULTS.damped_below * size
        assert np.all((way >= robot.limits[:, 0]) & (way <= robot.limits[:, 1]))
        least.append(min(step.smallest_singular_value for step in steps))
    assert min(least) < 0.5 * DEFAULTS.damped_below  # it was there


def test_what_is_not_lost_is_followed_exactly_at_a_wrist_singularity():
    robot = robot_of('ur5e')
    q = singular(robot, INTO['wrist'])
    weights = np.array([1] * 3 + [robot.singularity.task.length] * 3)
    lost = np.linalg.svd(weights[:, None] * ks.jacobian(robot, q))[0][:, -1]
    twist = np.array([0.03, -0.02, 0.01, 0.05, -0.1, 0.02])
    step = joint_velocity(robot, q, twist)
    assert step.damping == pytest.approx(1.0)
    assert step.limited_by == ('singularity',)
    scaled = (step.twist - twist) * weights
    np.testing.assert_allclose(scaled - lost * (lost @ scaled), 0.0, atol=1e-9)
    assert np.linalg.norm(step.qdot) < 1.0


def lost_twist(robot, q):
    # The direction of the tool that no joint motion gives, in base axes and units of its own.
    weights = np.array([1] * 3 + [robot.singularity.task.length] * 3)
    return np.linalg.svd(weights[:, None] * ks.jacobian(robot, q))[0][:, -1] / weights


@pytest.mark.parametrize('kind', INTO)
@pytest.mark.parametrize('name', ['ur5e', 'puma560'])
def test_a_twist_that_is_lost_moves_nothing_until_the_way_out_is_taken(name, kind):
    robot = robot_of(name)
    q = singular(robot, INTO[kind])
    twist = 0.05 * lost_twist(robot, q)
    step = joint_velocity(robot, q, twist)
    assert step.lost
    assert step.followed < 1e-6
    assert np.max(np.abs(step.qdot)) < 1e-3
    after = joint_velocity(robot, q + 0.4 * ks.singularity(robot, q).way_out, twist)
    assert after.damping == 0.0
    assert after.followed == pytest.approx(1.0)
    assert not after.lost
    assert np.linalg.norm(after.twist - after.scale * twist) < EXACT or after.held


def test_the_share_that_is_followed_is_that_of_the_twist_along_itself():
    robot = robot_of('ur5e')
    q = singular(robot, INTO['wrist'])
    q[4] += 0.01
    weights = np.array([1] * 3 + [robot.singularity.task.length] * 3)
    lost = lost_twist(robot, q)
    kept = ks.jacobian(robot, q)[:, 1]
    for twist in (kept, lost, kept + lost, 1e-3 * kept - lost):
        step = joint_velocity(robot, q, 1e-3 * twist)
        assert step.limited_by == ('singularity',)
        wanted, made = 1e-3 * twist * weights, step.twist * weights
        assert step.followed == pytest.approx(wanted @ made / (wanted @ wanted), abs=1e-9)
        assert not step.lost or abs(twist @ kept) < 0.05
    assert joint_velocity(robot, INSIDE, kept).followed == pytest.approx(1.0, abs=1e-12)
    assert joint_velocity(robot, q, np.zeros(6)).followed == 1.0


def test_what_an_arm_can_make_at_no_pose_is_said_away_from_singular_poses_too():
    robot = robot_of('scara_hsr065')
    q = np.array([0.4, 0.9, 0.1, 0.2])
    everything = ServoSettings(rows=ROW_NAMES)
    step = joint_velocity(robot, q, [0, 0, 0.01, 0.02, 0, 0], everything)
    tilt = (0.02 * robot.singularity.task.length) ** 2
    assert step.followed == pytest.approx(0.01**2 / (0.01**2 + tilt))
    assert step.damping == 0.0
    assert not step.lost
    assert joint_velocity(robot, q, [0, 0, 0.01, 0.02, 0, 0]).followed == pytest.approx(1.0)


def test_damping_and_velocity_grow_smoothly_towards_a_singularity():
    robot = robot_of('puma560')
    q = np.tile(INSIDE, (4001, 1))
    q[:, 4] = np.linspace(-0.4, 0.4, len(q))
    steps = [joint_velocity(robot, one, [0.02, 0.01, 0.03, 0.02, 0.05, -0.03]) for one in q]
    assert steps[0].damping == 0.0 == steps[-1].damping
    assert max(step.damping for step in steps) == pytest.approx(1.0)
    jumps = np.abs(np.diff([step.qdot for step in steps], axis=0))
    assert np.max(jumps) < 0.01


@pytest.mark.parametrize('angle', [0.005, 0.01, 0.03, 0.045])
def test_near_a_singular_pose_it_is_least_squares_damped_by_direction(angle):
    # Each singular value s below a bound b has the damping d^2 (1 - (s / b)^2).
    robot = robot_of('ur5e')
    q = np.array([0.3, -1.0, 1.0, 0.2, angle, 1.0])
    twist = 1e-3 * np.array([0.4, -0.3, 0.5, 0.2, -0.6, 0.3])
    step = joint_velocity(robot, q, twist)
    U, sigma, Vt = np.linalg.svd(task_rows(robot, ks.jacobian(robot, q)))
    share = sigma / (DEFAULTS.damped_below * robot.singularity.task.length)
    assert share[-1] < 1.0 < share[-2]
    damping = np.sqrt(np.maximum(0.0, 1.0 - share**2))
    squares = (DEFAULTS.damping * robot.singularity.task.length * damping) ** 2
    expected = Vt.T @ (sigma / (sigma**2 + squares) * (U.T @ task_rows(robot, twist)))
    np.testing.assert_allclose(step.qdot, expected, rtol=0, atol=EXACT)
    assert step.damping == pytest.approx(damping[-1], abs=EXACT)


@pytest.mark.slow
@pytest.mark.parametrize('name', DISTINCT)
@pytest.mark.parametrize('rate', RATES)
def test_no_position_limit_is_ever_crossed(name, rate):
    robot = robot_of(name)
    random = np.random.default_rng(6)
    low, high = np.array(robot.limits.T)
    q = np.clip(random.uniform(-1, 1, robot.dof), low, high)
    for _ in range(3):
        way, steps = drive(robot, q, random.normal(size=6), rate, 40 / rate)
        # From next to a limit, where a step at full speed would lead beyond it.
        q = np.clip(np.where(random.random(robot.dof) < 0.5, low + 1e-4, high - 1e-4), low, high)
        q = np.where(np.isfinite(q), q, 0.3)
        assert np.all((way >= low) & (way <= high))
        for step in steps:
            assert np.all(np.abs(step.qdot) <= velocity_limits(robot) * (1 + ROUND_OFF))


@pytest.mark.parametrize('left', [0.0, 0.002])
def test_joints_that_are_free_make_up_for_one_at_its_limit(left):
    robot = robot_of('panda')
    q = np.array([robot.limits[0, 1] - left, 0.3, -0.4, -1.8, 0.3, 1.9, 0.5])
    twist = np.array([0.05, -0.04, 0.06, 0.05, 0.1, 0.1])
    twist *= np.sign(least_squares(robot, q, twist)[0])
    held = joint_velocity(robot, q, twist)
    assert held.held == ('panda_joint1',)
    assert held.qdot[0] == pytest.approx(left / DEFAULTS.horizon)
    assert held.limited_by == ('position',)
    np.testing.assert_allclose(held.twist, twist, atol=EXACT)


def test_beyond_a_limit_only_the_way_back_is_open():
    robot = robot_of('rrp_elementary')
    q = np.array([0.1, 0.2, robot.limits[2, 0] - 0.05])
    J = ks.jacobian(robot, q)
    assert joint_velocity(robot, q, -J[:, 2]).qdot[2] == 0.0
    assert joint_velocity(robot, q, J[:, 2]).qdot[2] > 0.5


def test_the_tool_keeps_its_direction_at_a_velocity_limit():
    robot = robot_of('ur5e')
    q = [0.3, -1.0, 1.0, 0.2, 0.7, 1.0]
    twist = np.array([3.0, -2.0, 1.0, 2.0, 1.0, -4.0])
    step = joint_velocity(robot, q, twist)
    assert step.limited_by == ('velocity',)
    assert step.slowest in robot.joint_names
    assert 0.0 < step.scale < 1.0
    np.testing.assert_allclose(step.twist, step.scale * twist, atol=EXACT)
    ratios = np.abs(step.qdot) / velocity_limits(robot)
    assert np.max(ratios) == pytest.approx(1.0)
    assert robot.joint_names[int(np.argmax(ratios))] == step.slowest


def test_tool_axes_and_rows():
    robot = robot_of('ur5e')
    q = [0.3, -1.0, 1.0, 0.2, 0.7, 1.0]
    R = ks.forward_kinematics(robot, q)[:3, :3]
    twist = np.array([0.1, 0.02, 0.03, 0.1, 0.2, 0.3])
    in_tool = np.concatenate([R.T @ twist[:3], R.T @ twist[3:]])
    np.testing.assert_allclose(
        joint_velocity(robot, q, in_tool, axes='tool').qdot,
        joint_velocity(robot, ks.evaluate(robot, q), twist).qdot,
        atol=ROUND_OFF,
    )
    position = joint_velocity(robot, q, twist, ServoSettings(rows=('x', 'y', 'z')))
    np.testing.assert_allclose(position.twist[:3], twist[:3], atol=EXACT)
    # Three rows for six joints: of all joint velocities the smallest.
    assert np.linalg.norm(position.qdot) < np.linalg.norm(joint_velocity(robot, q, twist).qdot)


def test_two_joints_on_one_axis_share_and_are_not_called_singular():
    robot = robot_of('six_joint_dh')
    for q in np.random.default_rng(0).uniform(-1, 1, (20, 6)):
        wanted = ks.jacobian(robot, q) @ np.random.default_rng(1).normal(size=6) * 0.1
        step = joint_velocity(robot, q, wanted)
        if not step.limited_by:
            np.testing.assert_allclose(step.twist, wanted, atol=EXACT)
            return
    pytest.fail('each pose was called singular')


@pytest.mark.parametrize(
    ('twist', 'code'),
    [
        ([0.0] * 5, 'wrong-shape'),
        ([[0.0] * 6], 'wrong-shape'),
        ([0.0] * 5 + [math.nan], 'not-finite'),
        ([math.inf] + [0.0] * 5, 'not-finite'),
        ('up', 'not-a-number'),
    ],
)
def test_what_is_no_twist_is_refused(twist, code):
    with refused(TwistError, code, 'twist'):
        joint_velocity(robot_of('ur5e'), [0.0] * 6, twist)


def test_positions_axes_and_settings_are_checked():
    robot, rest = robot_of('ur5e'), [0.0] * 6
    with refused(ks.JointVectorError, 'not-finite', 'q must', 'nan'):
        joint_velocity(robot, [math.nan] * 6, rest)
    with refused(ks.JointVectorError, 'wrong-shape', 'q has', '(5,)'):
        joint_velocity(robot, [0.0] * 5, rest)
    with refused(TwistError, 'wrong-shape', 'state', '(2,)'):
        joint_velocity(robot, np.zeros((2, 6)), rest)
    with refused(TwistError, 'unknown-name', 'axes', "'world'"):
        joint_velocity(robot, rest, rest, axes='world')
    with refused(ServoSettingsError, 'wrong-type', 'settings', 'ServoSettings', "'fast'"):
        joint_velocity(robot, rest, rest, 'fast')
    for wrong in ({'damping': 0.0}, {'horizon': math.nan}, {'damped_below': -1.0}):
        with refused(ServoSettingsError, 'out-of-range', *wrong):
            ServoSettings(**wrong)
    with refused(ServoSettingsError, 'unknown-name', 'rows', "'x roll'"):
        ServoSettings(rows=('x', 'roll'))
    with refused(ks.JointVectorError, 'missing-argument', 'qdot', 'None'):
        ks.scale(robot, rest, None)
    with refused(ArgumentError, 'out-of-range', 'depth', '9'):
        ks.evaluate(robot, rest, depth=9)


def test_the_arrays_of_a_step_are_read_only():
    step = joint_velocity(robot_of('ur5e'), [0.3] * 6, [0.1] * 6)
    for array in (step.qdot, step.twist):
        with pytest.raises(ValueError, match='read-only'):
            array[0] = 0.0
