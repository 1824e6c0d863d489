# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Joint accelerations from reported velocities: exact where they can be, and none where not."""

import math

import numpy as np
import pytest

import kinematics_service as ks
from kinematics_service.estimation.estimator import Estimator, EstimatorSettings
from kinematics_service.estimation.joint_accelerations import SAMPLE_COUNT, JointAccelerations
from kinematics_service.estimation.joint_sample import JointSample

SECOND, MILLISECOND = 1_000_000_000, 1_000_000
START = 1_700_000_000 * SECOND + 7
# Velocities near 1 rad/s carry 1e-16 of it, over windows of some 10 ms.
SLOPE = 1e-11
RATES = np.array([2.0, -0.7, 0.0])
JERKS = np.array([-9.0, 4.0, 25.0])


def velocity(t):
    return np.array([0.3, -1.0, 0.5]) + RATES * t + 0.5 * JERKS * t * t


def accelerations(window):
    settings = EstimatorSettings(timeout=SECOND, acceleration_window=window)
    return JointAccelerations(ks.load_robot('craig_3r'), settings)


def fed(one, times):
    """Return what is said of messages of all joints at times (s)."""
    return [
        one.slope(np.full(3, START + round(t * SECOND)), velocity(t)) for t in np.asarray(times)
    ]


@pytest.mark.parametrize('window', [0, 10 * MILLISECOND, 50 * MILLISECOND])
def test_a_growing_acceleration_is_that_of_the_delay_ago(window):
    one = accelerations(window)
    times = 0.002 * np.arange(120)
    for t, found in zip(times[40:], fed(one, times)[40:]):
        assert one.delay == pytest.approx(max(window * 1e-9, 0.002) / 2, abs=1e-9)
        np.testing.assert_allclose(found, RATES + JERKS * (t - one.delay), rtol=0, atol=SLOPE)


def test_a_steady_acceleration_is_exact_at_any_stamps():
    one = accelerations(30 * MILLISECOND)
    random = np.random.default_rng(3)
    at = START
    for k in range(200):
        at += int(random.uniform(0.1, 9.0) * MILLISECOND)
        found = one.slope(np.full(3, at), 5.0 + RATES * (at - START) * 1e-9)
        if k:
            np.testing.assert_allclose(found, RATES, rtol=0, atol=1e-9)


def test_noise_leaves_what_the_documentation_says():
    random, noise, window = np.random.default_rng(4), 1e-3, 0.05
    one = accelerations(50 * MILLISECOND)
    found = [
        one.slope(np.full(3, START + k * MILLISECOND), noise * random.normal(size=3))
        for k in range(2000)
    ]
    expected = math.sqrt(12.0) * noise / (window * math.sqrt(51))
    assert np.std(found[100:]) == pytest.approx(expected, rel=0.1)


def test_there_is_none_at_first_nor_after_a_gap_or_a_step_back():
    one = accelerations(50 * MILLISECOND)
    assert [found is None for found in fed(one, [0, 0.01, 0.02])] == [True, False, False]
    assert [found is None for found in fed(one, [1.03, 1.04])] == [True, False]
    assert [found is None for found in fed(one, [0.5, 0.51])] == [True, False]
    assert fed(one, [0.51])[0] is not None  # nothing new, and the same as before


def test_a_slow_joint_has_the_slope_of_its_last_two_velocities():
    one = accelerations(50 * MILLISECOND)
    *_, found = fed(one, [0, 0.2, 0.4])
    np.testing.assert_allclose(found, RATES + JERKS * 0.3, rtol=0, atol=SLOPE)
    assert one.delay == pytest.approx(0.1)


def test_joints_of_two_drivers_have_their_own_stamps():
    one = accelerations(20 * MILLISECOND)
    stamps, rates = np.zeros(3, dtype=np.int64), np.zeros(3)
    for k in range(200):
        at = START + k * MILLISECOND + (k % 3) * 100_000
        joints = [0, 2] if k % 2 else [1]
        stamps[joints] = at
        rates[joints] = (5.0 + RATES * (at - START) * 1e-9)[joints]
        found = one.slope(stamps, rates)
        if k > 3:
            np.testing.assert_allclose(found, RATES, rtol=0, atol=1e-9)


def test_it_keeps_a_bounded_number_of_velocities():
    one = accelerations(10 * SECOND)
    fed(one, 0.001 * np.arange(5 * SAMPLE_COUNT))
    assert one.delay == pytest.approx(0.0005 * (SAMPLE_COUNT - 1), abs=1e-9)


@pytest.mark.parametrize('huge', [1e15, 1e300, math.inf, math.nan])
def test_what_is_no_number_is_not_said(huge):
    one = accelerations(50 * MILLISECOND)
    one.slope(np.full(3, START), np.zeros(3))
    found = one.slope(np.full(3, START + 1), np.array([0.0, huge, 0.0]))
    assert found is None or np.isfinite(found).all()


def messages(robot, source, count=3):
    """Yield the joint accelerations of a steady motion, message by message."""
    one = Estimator(robot, EstimatorSettings(velocity_source=source))
    for k in range(count):
        at = START + 10 * MILLISECOND * k
        moved = 0.1 * k * 0.01
        sample = JointSample(
            robot.joint_names, [0.3 + moved] * 3, [0.1 + 0.02 * k] * 3, at, at, at
        )
        answer = one.take(sample, quantities=[JointAccelerations])
        yield answer.quantities[JointAccelerations]


def test_differences_of_positions_have_no_accelerations():
    robot = ks.load_robot('craig_3r')
    assert [*messages(robot, 'difference')] == [None] * 3
    first, *others = messages(robot, 'auto')
    assert first is None
    for found in others:
        np.testing.assert_allclose(found, [2.0] * 3, rtol=0, atol=SLOPE)
