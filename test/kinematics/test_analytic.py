# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Rates of coordinates of the orientation: against their differences, and where they fail."""

import numpy as np
import pytest
from arms import DISTINCT_BUNDLED, LOOPED, calm_poses, poses, robot_of
from refusal import refused
from tolerances import DIFFERENCE, DIFFERENCE_STEP, ROUND_OFF

import kinematics_service as ks
from kinematics_service.rigid_motion import exponential, rotation_of_quaternion

TURNS = """\
robot: turns
convention: elementary
joints:
  - {name: yaw, type: revolute}
  - {name: pitch, type: revolute}
  - {name: roll, type: revolute}
links: [Rz(yaw), Ry(pitch), Rx(roll)]
tool: {xyz: [0.3, 0.2, 0.1]}
"""
KINDS = ('rpy', 'quaternion', 'rotation_vector')


@pytest.fixture(scope='module')
def turns():
    return ks.robot_from_text(TURNS)


@pytest.mark.slow
@pytest.mark.parametrize('rates', KINDS)
@pytest.mark.parametrize('name', [*DISTINCT_BUNDLED, *LOOPED[:2]])
def test_the_rows_are_the_differences_of_the_coordinates(name, rates):
    robot = robot_of(name)
    low, high = np.clip(robot.limits, -np.pi, np.pi).T
    q = np.random.default_rng(3).uniform(low, high, (12, robot.dof))
    if name in LOOPED:
        q = calm_poses(robot, 12)
    found = ks.analytic_jacobian(robot, q, rates)
    # Away from where the coordinates fail or change their sign: there, differences do not exist.
    calm = (found.amplification < 5.0) & ~found.singular
    if rates == 'quaternion':
        calm &= found.coordinates[:, 3] > 0.01
    elif rates == 'rotation_vector':
        calm &= np.linalg.norm(found.coordinates, axis=1) < 3.1
    else:
        calm &= np.abs(np.abs(found.coordinates).max(axis=1) - np.pi) > 0.01
    assert found.jacobian.shape == (12, len(found.rows), robot.dof)
    for j, step in enumerate(DIFFERENCE_STEP * np.eye(robot.dof)):
        ahead, behind = (ks.analytic_jacobian(robot, q + sign * step, rates) for sign in (1, -1))
        expected = (ahead.coordinates - behind.coordinates) / (2 * DIFFERENCE_STEP)
        np.testing.assert_allclose(
            found.jacobian[calm][:, 3:, j], expected[calm], rtol=0, atol=5 * DIFFERENCE
        )
    np.testing.assert_array_equal(found.jacobian[:, :3], ks.jacobian(robot, q)[:, :3])


def test_coordinates_are_those_of_the_orientation(turns):
    q = poses(turns, 20)
    R = ks.forward_kinematics(turns, q)[:, :3, :3]
    of_vector = exponential(ks.analytic_jacobian(turns, q, 'rotation_vector').coordinates)
    of_quaternion = rotation_of_quaternion(
        ks.analytic_jacobian(turns, q, 'quaternion').coordinates
    )
    for found in (of_vector, of_quaternion):
        np.testing.assert_allclose(found, R, rtol=0, atol=1e-9)
    rpy = ks.analytic_jacobian(turns, [0.4, -0.5, 0.6]).coordinates
    np.testing.assert_allclose(rpy, [0.6, -0.5, 0.4], rtol=0, atol=ROUND_OFF)


def test_three_turns_about_the_axes_have_rates_of_one_each(turns):
    found = ks.analytic_jacobian(turns, [0.4, -0.5, 0.6])
    assert found.rows == ('x', 'y', 'z', 'roll', 'pitch', 'yaw')
    np.testing.assert_allclose(found.jacobian[3:], np.eye(3)[::-1], rtol=0, atol=ROUND_OFF)


@pytest.mark.parametrize('sign', [1, -1])
def test_roll_pitch_yaw_tell_of_their_singular_pose_at_a_quarter_turn(turns, sign):
    for away in (1e-2, 1e-4, 1e-6):
        found = ks.analytic_jacobian(turns, [0.4, sign * (np.pi / 2 - away), 0.6])
        assert not found.singular
        assert np.isfinite(found.jacobian).all()
        # The norm of the map, by its singular values.
        J = found.jacobian[3:] @ np.linalg.inv(
            ks.jacobian(turns, [0.4, sign * (np.pi / 2 - away), 0.6])[3:]
        )
        norm = np.linalg.svd(J, compute_uv=False)[0]
        assert found.amplification == pytest.approx(norm, rel=1e-6)
        assert found.amplification == pytest.approx(np.sqrt(2) / np.sin(away), rel=1e-4)
    found = ks.analytic_jacobian(turns, [[0.4, sign * np.pi / 2, 0.6], [0.1, 0.2, 0.3]])
    assert found.singular.tolist() == [True, False]
    assert np.isinf(found.amplification).tolist() == [True, False]
    assert np.isnan(found.jacobian[0, 3:]).all()
    assert np.isfinite(found.jacobian[0, :3]).all()
    assert np.isfinite(found.jacobian[1]).all()


def test_a_rotation_vector_tells_of_half_a_turn(turns):
    found = ks.analytic_jacobian(turns, [[np.pi, 0, 0], [3.0, 0, 0], [0, 0, 0]], 'rotation_vector')
    assert found.singular.tolist() == [True, False, False]
    np.testing.assert_allclose(
        found.amplification, [np.pi / 2, 1.5 / np.sin(1.5), 1.0], rtol=0, atol=ROUND_OFF
    )
    np.testing.assert_allclose(found.jacobian[2, 3:], np.eye(3)[::-1], rtol=0, atol=ROUND_OFF)


def test_the_series_near_no_turn_joins_the_formula(turns):
    for angle in (0.9999e-3, 1.0001e-3):
        q = [angle, 0.0, 0.0]
        found = ks.analytic_jacobian(turns, q, 'rotation_vector').jacobian[3:]
        half = 0.5 * angle
        expected = half / np.tan(half)  # across the axis, of a turn about it
        J = ks.jacobian(turns, q)[3:]
        by_turn = found @ np.linalg.inv(J)
        assert by_turn[0, 0] == pytest.approx(expected, abs=1e-10)
        assert by_turn[2, 2] == pytest.approx(1.0, abs=ROUND_OFF)


def test_quaternions_have_no_singular_pose(turns):
    found = ks.analytic_jacobian(turns, poses(turns), 'quaternion')
    assert not found.singular.any()
    assert (found.amplification == 0.5).all()
    # The length of a quaternion does not change.
    along = np.einsum('...i,...ij->...j', found.coordinates, found.jacobian[:, 3:])
    np.testing.assert_allclose(along, 0.0, rtol=0, atol=ROUND_OFF)


def test_of_a_point_and_at_a_place(turns):
    q = [0.4, -0.5, 0.6]
    found = ks.analytic_jacobian(turns, q, 'quaternion', of=2, at=(0.1, 0.2, 0.3))
    np.testing.assert_array_equal(
        found.jacobian[:3], ks.jacobian(turns, q, of=2, at=(0.1, 0.2, 0.3))[:3]
    )
    assert not found.jacobian[:, 2].any()


def test_other_coordinates_are_refused_and_results_are_frozen(turns):
    with refused(ks.PointError, 'unknown-name', 'rates', *KINDS, "'euler'"):
        ks.analytic_jacobian(turns, [0, 0, 0], 'euler')
    for rates in KINDS:
        found = ks.analytic_jacobian(turns, [0, 0.1, 0], rates)
        for name in ('jacobian', 'coordinates', 'amplification', 'singular'):
            assert not getattr(found, name).flags.writeable
