# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Positions counted on from messages that have velocities alone."""

import math

import numpy as np
import pytest

import kinematics_service as ks
from kinematics_service.estimation import outcomes
from kinematics_service.estimation.estimator import (
    Estimator,
    EstimatorOutput,
    EstimatorSettings,
    RefusedMessage,
)
from kinematics_service.estimation.joint_sample import JointSample

SECOND = 1_000_000_000
START = 100 * SECOND
STEP = 10_000_000
NAMES = ('q1', 'q2', 'q3')
Q = np.array([0.3, -0.4, 1.2])
# The rule of trapezoids is off by h^2/12 times the change of the acceleration.
TRAPEZOIDS = 1e-5
WITH_NOISE = """
robot: noisy
convention: standard
joints: [{name: q1, type: revolute}, {name: q2, type: prismatic}]
links:
  - {a: 1, alpha: pi/2, d: 0, theta: q1}
  - {a: 0, alpha: 0, d: q2, theta: 0}
uncertainty: {velocity_noise: [0.02, 0.01]}
"""


def estimator(robot='craig_3r', **settings):
    settings = {'integrate_velocities': True, **settings}
    return Estimator(ks.load_robot(robot), EstimatorSettings(**settings))


def sample(positions, velocities, at, names=NAMES):
    return JointSample(names, positions, velocities, at, at, at)


def motion(t):
    """Return positions and velocities at a time, s."""
    rates = np.array([1.0, 0.7, 1.3])
    return Q + 0.5 * np.sin(rates * t), 0.5 * rates * np.cos(rates * t)


def counted_on(one, steps, every=10**9):
    for k in range(1, steps + 1):
        q, qdot = motion(k * STEP * 1e-9)
        found = one.take(sample(q if k % every == 0 else (), qdot, START + k * STEP))
        assert isinstance(found, EstimatorOutput)
    return found, q


def test_positions_follow_the_velocities_from_the_last_reported_ones():
    one = estimator()
    one.take(sample(*motion(0.0), START))
    found, q = counted_on(one, 300)
    np.testing.assert_allclose(found.state.q, q, atol=TRAPEZOIDS)
    assert found.velocity_source == 'message'
    assert one.integration.seconds == pytest.approx(3.0)
    # A position that is reported ends it.
    one.take(sample(*motion(3.01), START + 301 * STEP))
    assert one.integration.seconds == 0.0


def test_a_constant_velocity_is_counted_exactly_and_joints_apart():
    one = estimator()
    one.take(sample(Q, (0.5, 0.0, -0.25), START))
    found = one.take(sample((), (0.5,), START + 2 * STEP, ('q1',)))
    np.testing.assert_allclose(found.state.q, Q + [0.01, 0, 0], atol=1e-12)
    found = one.take(sample((), (9.0, -0.25), START + 4 * STEP, ('other', 'q3')))
    np.testing.assert_allclose(found.state.q, Q + [0.01, 0, -0.01], atol=1e-12)
    assert one.integration.seconds == pytest.approx(0.04)


def test_as_before_where_nobody_asks_for_it():
    one = estimator(integrate_velocities=False)
    one.take(sample(Q, (0.0,) * 3, START))
    refused = one.take(sample((), (1.0,) * 3, START + STEP))
    assert isinstance(refused, RefusedMessage)
    assert refused.reason == outcomes.NO_POSITION


@pytest.mark.parametrize(
    ('velocities', 'later'),
    [
        ((1.0, 2.0), STEP),
        ((), STEP),
        ((math.nan, 0.0, 0.0), STEP),
        ((0.1, 0.1, 0.1), 2 * SECOND),  # longer than the timeout: where it went is not known
        ((0.1, 0.1, 0.1), 0),
        ((0.1, 0.1, 0.1), -STEP),
    ],
)
def test_what_cannot_be_counted_on_is_no_position(velocities, later):
    one = estimator()
    one.take(sample(Q, (0.0,) * 3, START))
    refused = one.take(sample((), velocities, START + later))
    assert isinstance(refused, RefusedMessage)
    assert refused.reason == outcomes.NO_POSITION
    assert one.integration.seconds == 0.0


@pytest.mark.parametrize('speed', [2.3, -1e12, 1e308, -math.inf])
@pytest.mark.filterwarnings('error')
def test_a_velocity_beyond_the_limit_of_its_joint_is_refused_with_its_name(tmp_path, speed):
    file = tmp_path / 'limited.yaml'
    file.write_text(WITH_NOISE.replace('q1, type: revolute', 'q1, type: revolute, velocity: 2'))
    one = estimator(file)
    one.take(sample((0.1, 0.2), (0.0, 0.0), START, ('q1', 'q2')))
    refused = one.take(sample((), (speed, 0.0), START + STEP, ('q1', 'q2')))
    assert refused.reason == outcomes.TOO_FAST
    for word in ("'q1'", f'{speed:g}', 'at most 2.2'):
        assert word in refused.sentence
    assert one.counts[outcomes.TOO_FAST] == 1
    # The next good message is integrated from the last good one; noise at the limit is no fault.
    found = one.take(sample((), (2.05, 0.0), START + 2 * STEP, ('q1', 'q2')))
    np.testing.assert_allclose(found.state.q, [0.1 + 0.5 * 2.05 * 0.02, 0.2], atol=1e-12)


def test_a_joint_without_a_limit_has_the_bound_of_robot_files():
    one = estimator()
    one.take(sample(Q, (0.0,) * 3, START))
    assert one.take(sample((), (101.0, 0.0, 0.0), START + STEP)).reason == outcomes.TOO_FAST
    assert isinstance(one.take(sample((), (0.0, 99.0, 0.0), START + STEP)), EstimatorOutput)


def test_a_velocity_beyond_the_limit_beside_positions_is_not_integrated_later():
    one = estimator()
    one.take(sample(Q, (1e12, 0.0, 0.0), START))
    found = one.take(sample((), (1.0, 0.0, 0.0), START + STEP))
    np.testing.assert_allclose(found.state.q, Q + [0.01, 0.0, 0.0], atol=1e-12)


def test_without_a_known_start_there_is_no_position():
    one = estimator()
    assert one.take(sample((), (0.1,) * 3, START)).reason == outcomes.NO_POSITION
    one.take(sample(Q[:2], (), START, NAMES[:2]))
    assert one.take(sample((), (0.1,) * 3, START + STEP)).reason == outcomes.NO_POSITION
    # Nor after time stepped back.
    one.take(sample(Q, (0.1,) * 3, START + STEP))
    one.take(sample((), (0.1,) * 3, START + 2 * STEP))
    assert one.integration.seconds
    one.reset()
    assert one.integration.seconds == 0.0
    assert one.take(sample((), (0.1,) * 3, START + 3 * STEP)).reason == outcomes.NO_POSITION


def test_what_the_noise_of_velocities_makes_of_it_is_what_a_simulation_shows(tmp_path):
    file = tmp_path / 'noisy.yaml'
    file.write_text(WITH_NOISE)
    random = np.random.default_rng(7)
    robot, settings = ks.load_robot(file), EstimatorSettings(integrate_velocities=True)
    ends = []
    for _ in range(100):
        one = Estimator(robot, settings)
        names = ('q1', 'q2')
        one.take(sample((0.1, 0.2), (0.0, 0.0), START, names))
        for k in range(1, 101):
            noisy = random.normal(size=2) * (0.02, 0.01)
            found = one.take(sample((), noisy, START + k * STEP, names))
        ends.append(found.state.q)
    scatter = np.std(ends, axis=0)
    # 100 draws tell a deviation to 7 %, twice that here; a wrong root of two would be 41 %.
    assert one.integration.deviation(one.robot) == pytest.approx(scatter[0], rel=0.15)
    assert scatter[1] == pytest.approx(scatter[0] / 2, rel=0.3)
    silent = estimator()
    assert silent.integration.deviation(silent.robot) is None
