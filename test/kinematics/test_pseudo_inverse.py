# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The pseudo-inverse: Penrose's conditions, the servo's numbers, and the damping that is told."""

import numpy as np
import pytest
from arms import DISTINCT, LOOPED, calm_poses, robot_of
from refusal import refused
from tolerances import ROUND_OFF

import kinematics_service as ks

SOME_ARMS = (*DISTINCT, *LOOPED)
some_arms = pytest.mark.parametrize('name', SOME_ARMS)
# Of matrices whose condition reaches 1e4.
SOLVED = 1e-9


def scaled(robot, q, found):
    """Return J_t and its inverse in comparable units, J_t by the definition of the task."""
    task, J = robot.singularity.task, ks.jacobian(robot, q)
    turned = np.concatenate([task.rotation.T @ J[:3], task.rotation.T @ J[3:]])[task.axes]
    J_t = task.row_scales[:, None] * turned * task.column_scales
    return J_t, found / task.column_scales[:, None] / task.row_scales


@some_arms
def test_it_is_the_inverse_of_moore_and_penrose(name):
    robot = robot_of(name)
    q = calm_poses(robot, 6)
    whole = ks.pseudo_inverse(robot, q)
    assert whole.rows == robot.singularity.task.rows
    np.testing.assert_array_equal(whole.damping, 0.0)
    for k, one in enumerate(q):
        alone = ks.pseudo_inverse(robot, one)
        np.testing.assert_array_equal(alone.matrix, whole.matrix[k])
        J, inverse = scaled(robot, one, alone.matrix)
        size = np.max(np.abs(J)) * np.max(np.abs(inverse))
        kept = {'rtol': 0, 'atol': SOLVED * size * np.max(np.abs(J))}
        np.testing.assert_allclose(J @ inverse @ J, J, **kept)
        kept['atol'] = SOLVED * size * np.max(np.abs(inverse))
        np.testing.assert_allclose(inverse @ J @ inverse, inverse, **kept)
        for product in (J @ inverse, inverse @ J):
            np.testing.assert_allclose(product, product.T, rtol=0, atol=SOLVED * size)
        assert alone.rank == np.linalg.matrix_rank(J, 1e-9 * np.linalg.norm(J, 2))


@pytest.mark.parametrize('damping', [0.025, 0.2])
@pytest.mark.parametrize('name', ['planar_2r', 'puma560', 'panda', 'scara_hsr065', 'so101'])
def test_damped_it_makes_the_velocities_of_the_servo(name, damping):
    robot, random = robot_of(name), np.random.default_rng(6)
    settings = ks.ServoSettings(damping=damping, default_rate=1e5, default_speed=1e5)
    damped = 0
    near = np.zeros(robot.dof)
    for q in [*calm_poses(robot, 6), near, near + 1e-3, near + 1e-2]:
        twist = 1e-3 * random.normal(size=6)
        step = ks.joint_velocity(robot, q, twist, settings)
        if step.held or step.slowest:
            continue
        found = ks.pseudo_inverse(robot, q, damping=damping)
        wanted = np.concatenate(
            [robot.singularity.task.rotation.T @ half for half in twist.reshape(2, 3)]
        )
        np.testing.assert_allclose(
            found.matrix @ wanted[robot.singularity.task.axes], step.qdot, rtol=1e-7, atol=1e-10
        )
        if found.rank >= robot.singularity.task.generic_rank:
            assert found.damping / damping == pytest.approx(step.damping, abs=1e-9)
        damped += found.damping > 0
    assert damped


def test_a_damped_inverse_is_bounded_where_the_plain_one_is_not():
    robot = ks.load_robot('planar_2r')
    sizes = [
        [
            np.max(np.abs(ks.pseudo_inverse(robot, [0.1, bend], damping=damping).matrix))
            for bend in (1.0, 1e-3, 1e-6, 0.0)
        ]
        for damping in (0.0, 0.025)
    ]
    assert sizes[0][2] > 1e5
    assert max(sizes[1]) < 1.2 / 0.05
    assert sizes[0][0] == sizes[1][0]  # away from the singular pose it is the same number
    assert ks.pseudo_inverse(robot, [0.1, 0.0]).rank == 1


def test_damping_that_is_none_is_refused():
    for damping in (-0.1, np.nan, np.inf):
        with refused(ks.ServoSettingsError, 'out-of-range', 'damping must', str(damping)):
            ks.pseudo_inverse('planar_2r', [0, 0], damping=damping)
    with refused(ks.ServoSettingsError, 'out-of-range', 'damped_below must', '0.0'):
        ks.wrench_from_torques('planar_2r', [0, 0], [1, 2], damping=0.1, damped_below=0.0)


@some_arms
def test_undamped_wrenches_are_those_of_the_transposed_inverse(name):
    robot = robot_of(name)
    q = calm_poses(robot, 3)
    tau = np.random.default_rng(3).normal(size=q.shape)
    scales = np.repeat([1.0, robot.singularity.task.length], 3)
    for one, torques in zip(q, tau):
        J = scales[:, None] * ks.jacobian(robot, one) * robot.singularity.task.column_scales
        expected = (
            np.linalg.pinv(J, 1e-10).T @ (torques * robot.singularity.task.column_scales) * scales
        )
        found = ks.wrench_from_torques(robot, one, torques)
        size = np.max(np.abs(expected))
        np.testing.assert_allclose(found.wrench, expected, rtol=0, atol=SOLVED * size)
        assert found.damping == 0.0


def test_damped_a_stretched_arm_does_not_take_friction_for_a_large_force():
    robot = ks.load_robot('planar_2r')
    q, friction = [0.0, 1e-4], [0.0, 0.05]
    plain = ks.wrench_from_torques(robot, q, friction)
    damped = ks.wrench_from_torques(robot, q, friction, damping=0.025)
    assert np.linalg.norm(damped.wrench) <= np.linalg.norm(plain.wrench) + ROUND_OFF
    assert damped.damping == pytest.approx(0.025, rel=1e-4) or damped.damping == 0.0
