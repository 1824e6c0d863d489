# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
One form of a rotation made into another, against scipy, exact numbers and the quaternion product.
"""

import math
import warnings

import mpmath
import numpy as np
import pytest

from kinematics_service.rigid_motion import (
    ANGLE_TOLERANCE,
    Z_INTO,
    roll_pitch_yaw,
    rotation_of_quaternion,
    rotation_of_roll_pitch_yaw,
    rotation_vector,
    screw_z,
)

# A rotation matrix from a dozen products of numbers up to 1.
ROUND_OFF = 2e-15


def hamilton(p, q):
    # The product of quaternions x y z w.
    v, w = p[..., :3], p[..., 3:]
    u, s = q[..., :3], q[..., 3:]
    return np.concatenate(
        [w * u + s * v + np.cross(v, u), w * s - np.sum(v * u, axis=-1, keepdims=True)], axis=-1
    )


def turned(quaternions, vectors):
    # q p q^-1 for any length of q.
    p = np.concatenate([vectors, np.zeros((*vectors.shape[:-1], 1))], axis=-1)
    conjugate = quaternions * [-1.0, -1.0, -1.0, 1.0]
    squares = np.sum(quaternions**2, axis=-1, keepdims=True)
    return (hamilton(hamilton(quaternions, p), conjugate) / squares)[..., :3]


def exact(axis, angle):
    # Rotation and rotation vector to 40 digits, rounded once.
    with mpmath.workdps(40):
        a = mpmath.matrix([mpmath.mpf(float(x)) for x in axis])
        a = a / mpmath.norm(a)
        K = mpmath.matrix([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
        R = mpmath.eye(3) + mpmath.sin(angle) * K + (1 - mpmath.cos(angle)) * K * K
        return np.array(R.tolist(), dtype=float), np.array([float(x * angle) for x in a])


@pytest.mark.parametrize('shape', [(), (1,), (7,), (0,), (3, 5), (2, 3, 4)])
def test_a_quaternion_turns_vectors_as_its_product_does(shape):
    random = np.random.default_rng(1)
    quaternions = random.normal(size=(*shape, 4)) * 10.0 ** random.uniform(-3, 3, (*shape, 1))
    vectors = random.normal(size=(*shape, 3))
    R = rotation_of_quaternion(quaternions)
    assert R.shape == (*shape, 3, 3)
    found = np.einsum('...ij,...j->...i', R, vectors)
    np.testing.assert_allclose(found, turned(quaternions, vectors), rtol=0, atol=1e-14)


@pytest.mark.peers
def test_a_quaternion_is_the_rotation_that_scipy_says():
    transform = pytest.importorskip('scipy.spatial.transform')
    random = np.random.default_rng(2)
    half_turns = np.column_stack([random.normal(size=(50, 3)), np.zeros(50)])
    next_to_them = half_turns + [0, 0, 0, 1e-9]
    small = np.column_stack([1e-9 * random.normal(size=(50, 3)), np.ones(50)])
    signed_axes = np.concatenate([np.eye(4), -np.eye(4)])
    quaternions = np.concatenate(
        [random.normal(size=(500, 4)), half_turns, next_to_them, small, signed_axes]
    )
    expected = transform.Rotation.from_quat(quaternions).as_matrix()
    for length in (1.0, 0.95, 1e-3, 1e3):
        found = rotation_of_quaternion(length * quaternions)
        np.testing.assert_allclose(found, expected, rtol=0, atol=ROUND_OFF)


@pytest.mark.parametrize('length', [1.0, -1.0, 3e-160, 2e-320, 1e200])
def test_half_and_quarter_turns_about_the_axes_are_exact_at_any_length(length):
    for k, name in enumerate('xyz'):
        half, quarter = np.zeros(4), np.zeros(4)
        half[k] = length
        quarter[k] = quarter[3] = length
        expected = -np.eye(3)
        expected[k, k] = 1.0
        np.testing.assert_array_equal(rotation_of_quaternion(half), expected)
        into = Z_INTO[name][:3, :3]
        about_z = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
        np.testing.assert_array_equal(rotation_of_quaternion(quarter), into @ about_z @ into.T)


def test_no_rotation_is_made_of_nothing():
    bad = np.array([[0.0] * 4, [0.0, math.nan, 0.0, 1.0], [0.0, 0.0, math.inf, 1.0]])
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        R = rotation_of_quaternion(np.concatenate([bad, [[0.0, 0.0, 0.0, 2.0]]]))
        assert np.all(np.isnan(R[:3]))
        assert np.all(np.isnan(roll_pitch_yaw(R[0])))
    np.testing.assert_array_equal(R[3], np.eye(3))


@pytest.mark.parametrize('away', [0.0, 1e-15, 1e-12, 1e-9, 1e-8, 1e-7, 1e-5, 1e-3, 0.3, 1.0])
def test_a_rotation_vector_is_exact_next_to_no_turn_and_to_half_a_turn(away):
    random = np.random.default_rng(3)
    axes = [*np.eye(3), *-np.eye(3), *random.normal(size=(20, 3))]
    with mpmath.workdps(40):
        half = mpmath.pi - away
    small = [exact(axis, mpmath.mpf(away)) for axis in axes]
    large = [exact(axis, half) for axis in axes]
    R, expected = (np.array(part) for part in zip(*small, *large))
    found = rotation_vector(R.reshape(2, -1, 3, 3)).reshape(-1, 3)
    if away < 1e-14:  # the matrix itself does not say any more which way round
        found *= np.where(np.sum(found * expected, axis=1) < 0.0, -1.0, 1.0)[:, None]
    np.testing.assert_allclose(found, expected, rtol=0, atol=ROUND_OFF)
    # The small ones to all their digits, not only to those next to 1.
    scale = max(away, 1e-300)
    few = len(small)
    np.testing.assert_allclose(found[:few] / scale, expected[:few] / scale, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(rotation_vector(R[0]), found[0])


def test_roll_pitch_yaw_multiply_out_to_the_rotation():
    random = np.random.default_rng(4)
    for away in (0.0, 1e-16, 1e-12, 1e-10, 2e-9, 1e-8, 1e-5, 1e-2, 1.0):
        for sign in (1.0, -1.0):
            roll, yaw = random.uniform(-math.pi, math.pi, 2)
            rpy = np.array([roll, sign * (math.pi / 2 - away), yaw])
            R = rotation_of_roll_pitch_yaw(rpy)
            about = [
                Z_INTO[name] @ screw_z(angle, 0.0) @ Z_INTO[name].T
                for name, angle in zip('zyx', rpy[::-1])
            ]
            np.testing.assert_allclose(R, (about[0] @ about[1] @ about[2])[:3, :3], atol=1e-15)
            found = roll_pitch_yaw(R)
            assert abs(found[1]) <= math.pi / 2
            if away < ANGLE_TOLERANCE:
                assert found[2] == 0.0
            again = rotation_of_roll_pitch_yaw(found)
            bound = ANGLE_TOLERANCE if away < ANGLE_TOLERANCE else ROUND_OFF
            np.testing.assert_allclose(again, R, rtol=0, atol=bound)
