# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The covariance of the tool's pose, beside draws of random joints and of random tables."""

import numpy as np
import pytest
from arms import LOOPED, calm_poses, robot_of
from calibrated_arms import measured_arm
from refusal import refused
from tolerances import DIFFERENCE, DIFFERENCE_STEP

import kinematics_service as ks
from kinematics_service.apps.calibration import pose_covariance
from kinematics_service.apps.calibration.robot_text import CalibrationOrigin, calibrated_text
from kinematics_service.errors import CalibrationError
from kinematics_service.rigid_motion import rotation_vector

DRAWS = 20_000
# A sampled variance of so many draws is off by one part in a hundred (sqrt(2 / DRAWS)): the
# largest of 21 numbers by less than four and a half of these.
MONTE_CARLO = 4.5 * np.sqrt(2.0 / DRAWS)
# Of first order a covariance is round-off against another road to the same (m, rad).
ROUND_OFF = 1e-12
Q = {'panda': (0.4, -0.3, 0.7, -1.9, 0.2, 1.6, 0.5), 'scara_hsr065': (0.5, 0.9, 0.05, -0.4)}


def sampled(poses, middle):
    """Return the covariance of poses about a pose: x y z, rotations about fixed axes."""
    turned = rotation_vector(poses[:, :3, :3] @ middle[:3, :3].T)
    six = np.concatenate([poses[:, :3, 3] - middle[:3, 3], turned], axis=1)
    return np.cov(six.T)


def test_encoder_noise_moves_the_tool_as_random_joints_do():
    for name, q in Q.items():
        robot = robot_of(name)
        deviations = 1e-4 * (1.0 + np.arange(robot.dof))
        found = ks.pose_covariance(robot, q, joints=deviations)
        random = np.random.default_rng(1)
        drawn = np.array(q) + deviations * random.normal(size=(DRAWS, robot.dof))
        middle = ks.forward_kinematics(robot, q)
        expected = sampled(ks.forward_kinematics(robot, drawn), middle)
        assert close(found, expected)


def close(found, expected):
    """Return whether each number is within MONTE_CARLO of its two deviations' product."""
    sizes = np.sqrt(np.diag(found))
    least = 1e-9 * sizes.max()  # nothing moves there
    return np.all(np.abs(found - expected) <= MONTE_CARLO * np.outer(sizes, sizes) + least**2)


def rows_product(robot, q, drawn):
    """Return the poses (N, 4, 4) of a modified table with random numbers added to each cell."""
    T = np.tile(np.eye(4), (len(drawn[0]), 1, 1))
    for k, link in enumerate(robot.description.links):
        theta, d, a, alpha = (
            link[name].affine.constant + drawn[4 * k + place]
            for name, place in (('theta', 2), ('d', 3), ('a', 1), ('alpha', 0))
        )
        if k < len(q):
            theta = theta + q[k]
        c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        zero, one = np.zeros_like(c), np.ones_like(c)
        # Craig, Introduction to Robotics, equation 3.6.
        row = [
            [c, -s, zero, a],
            [s * ca, c * ca, -sa, -sa * d],
            [s * sa, c * sa, ca, ca * d],
            [zero, zero, zero, one],
        ]
        T = T @ np.moveaxis(np.array(row), 2, 0)
    return robot.description.base.motion.matrix @ T @ robot.description.tool.motion.matrix


@pytest.mark.slow
def test_what_a_calibration_left_open_moves_the_tool_as_random_tables_do():
    arm = measured_arm('panda', 30, 5e-5)
    found = ks.calibrate(arm.robot, arm.q, arm.poses, check=False)
    table = [one for one in found.parameters if one.group not in ('base', 'tool')]
    assert [one.name for one in table][:4] == ['alpha1', 'a1', 'theta1', 'd1']
    count = len(table)
    random = np.random.default_rng(2)
    drawn = random.multivariate_normal(np.zeros(count), found.covariance[:count, :count], DRAWS)
    q = Q['panda']
    poses = rows_product(found.calibrated, q, drawn.T)
    middle = ks.forward_kinematics(found.calibrated, q)
    covariance = ks.pose_covariance(found.calibrated, q, calibration=found)
    assert close(covariance, sampled(poses, middle))
    # Both are independent.
    both = ks.pose_covariance(found.calibrated, q, joints=1e-4, calibration=found)
    alone = ks.pose_covariance(found.calibrated, q, joints=1e-4)
    assert np.abs(both - covariance - alone).max() < ROUND_OFF


@pytest.mark.slow
def test_many_poses_have_a_covariance_each():
    arm = measured_arm('ur5e', 30, 5e-5)
    found = ks.calibrate(arm.robot, arm.q, arm.poses, check=False)
    many = ks.pose_covariance(
        found.calibrated, arm.q.reshape(5, 6, 6), joints=1e-4, calibration=found
    )
    assert many.shape == (5, 6, 6, 6)
    one = ks.pose_covariance(found.calibrated, arm.q[7], joints=[1e-4] * 6, calibration=found)
    assert np.abs(many[1, 1] - one).max() < ROUND_OFF
    # The same of the robot file that is written, of its own base and tool or of measured ones.
    text = ks.bundled_robots()['ur5e'].read_text()
    origin = CalibrationOrigin('made up', '2026-01-01')
    for frames in ('robot', 'measured'):
        made = calibrated_text(found, text, arm.q, arm.poses, origin, frames)
        written = ks.pose_covariance(ks.robot_from_text(made), arm.q[7], calibration=found)
        expected = ks.pose_covariance(found.calibrated, arm.q[7], calibration=found)
        if frames == 'robot':
            assert np.abs(written - expected).max() < ROUND_OFF
        assert np.all(np.linalg.eigvalsh(written) > 0.0)


def test_a_planar_arm_by_hand():
    # Stretched along x: y moves by both links and by the second one, the turn by 1 and 1.
    robot = robot_of('planar_2r')
    a1, a2 = (link['a'].affine.constant for link in robot.description.links[:2])
    found = ks.pose_covariance(robot, [0.0, 0.0], joints=[1e-3, 2e-3])
    expected = np.zeros((6, 6))
    J = np.array([[a1 + a2, a2], [1.0, 1.0]])
    expected[np.ix_([1, 5], [1, 5])] = J @ np.diag([1e-6, 4e-6]) @ J.T
    assert np.abs(found - expected).max() < ROUND_OFF


def test_what_does_not_fit_is_refused():
    arm = measured_arm('ur5e', 30, 5e-5)
    found = ks.calibrate(arm.robot, arm.q, arm.poses, check=False)
    for robot, q, options, code, word in (
        (arm.robot, arm.q, {'calibration': found}, 'mismatch', 'ur5e'),
        (robot_of('panda'), Q['panda'], {'calibration': found}, 'mismatch', 'not to panda'),
        (arm.robot, arm.q, {'calibration': 3}, 'wrong-type', '3'),
        (arm.robot, arm.q, {}, 'missing-uncertainty', 'ur5e'),
        (arm.robot, arm.q, {'joints': -1.0}, 'out-of-range', 'joints'),
        (arm.robot, arm.q, {'joints': np.inf}, 'out-of-range', 'joints'),
        (arm.robot, arm.q, {'joints': [1.0, 2.0]}, 'out-of-range', 'or 6'),
    ):
        with refused(CalibrationError, code, word):
            ks.pose_covariance(robot, q, **options)


@pytest.mark.parametrize('axes', ['base', 'tool'])
@pytest.mark.parametrize('name', LOOPED)
def test_noise_of_joints_moves_pose_and_twist_through_loops(name, axes):
    robot = robot_of(name)
    q = calm_poses(robot, 3)
    random = np.random.default_rng(3)
    qdot = random.uniform(-1.0, 1.0, q.shape)
    joints, velocities = random.uniform(1.0, 2.0, (2, robot.dof))
    J = ks.jacobian(robot, q)
    expected = J @ np.diag(joints**2) @ np.swapaxes(J, 1, 2)
    found = ks.pose_covariance(robot, q, joints=joints)
    np.testing.assert_allclose(found, expected, rtol=0, atol=ROUND_OFF * np.max(expected))
    by_q = np.empty((len(q), 6, robot.dof))
    for j, step in enumerate(DIFFERENCE_STEP * np.eye(robot.dof)):
        ahead, behind = (ks.twist(robot, q + sign * step, qdot, axes) for sign in (1, -1))
        by_q[..., j] = (ahead - behind) / (2 * DIFFERENCE_STEP)
    moved = np.concatenate([by_q * joints, ks.jacobian(robot, q, axes) * velocities], axis=-1)
    expected = moved @ np.swapaxes(moved, 1, 2)
    found = ks.twist_covariance(robot, q, qdot, axes, joints=joints, velocities=velocities)
    np.testing.assert_allclose(found, expected, rtol=0, atol=10 * DIFFERENCE * np.max(expected))


@pytest.mark.parametrize('axes', ['base', 'tool'])
def test_the_road_through_loops_is_that_of_open_arms(axes):
    robot, q = robot_of('panda'), np.array(Q['panda'])
    qdot = np.linspace(-1.0, 1.0, 7)
    given = {'joints': 1e-3, 'velocities': 1e-2}
    expected = ks.twist_covariance(robot, q, qdot, axes, **given)
    by_q, by_qdot = pose_covariance._twist_derivatives(robot, ks.evaluate(robot, q, qdot), axes)
    moved = np.concatenate([1e-3 * by_q, 1e-2 * by_qdot], axis=1)
    np.testing.assert_allclose(moved @ moved.T, expected, rtol=0, atol=1e-3 * ROUND_OFF)


def test_no_number_of_a_table_is_carried_through_loops():
    robot = robot_of('five_bar')
    for given in ({}, {'joints': 1e-3, 'calibration': object()}):
        with refused(CalibrationError, 'closed-loop', 'five_bar'):
            ks.pose_covariance(robot, [2.0, 1.0], **given)
