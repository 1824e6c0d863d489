# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""MoveIt Servo's rule as a choice of `ks.scale`, against its own steps written down again."""

import dataclasses
import math

import numpy as np
import pytest
from arms import calm_poses, robot_of
from refusal import refused

import kinematics_service as ks
from kinematics_service.kinematics.scale import LEAVING, SINGULARITY

# Of singular values, which differ by round-off times the condition number.
ROUND_OFF = 1e-12
NO_WARNING, APPROACHING, HALT, MOVING_OFF = range(4)


def as_servo_does(robot, q, delta, lower=17.0, hard_stop=30.0, multiplier=2.0, step=0.01):
    """
    Return velocity_scale and status as velocityScalingFactorForSingularity computes them.

    Line by line as in moveit_servo/src/utils/common.cpp, with a whole pseudo-inverse, and one of
    the n singular values for the last one.
    """
    U, sigma, Vt = np.linalg.svd(ks.jacobian(robot, q), full_matrices=False)
    pseudo_inverse = Vt.T @ np.linalg.inv(np.diag(sigma)) @ U.T
    last = len(sigma) - 1
    towards_singularity = U[:, last]
    condition = sigma[0] / sigma[last]
    ahead = np.linalg.svd(
        ks.jacobian(robot, q + pseudo_inverse @ (towards_singularity * step)), compute_uv=False
    )
    if ahead[0] / ahead[last] <= condition:
        towards_singularity = -towards_singularity
    moving_towards = towards_singularity @ delta > 0
    upper = hard_stop if moving_towards else lower + (hard_stop - lower) * multiplier
    scale, status = 1.0, NO_WARNING
    if lower < condition < hard_stop:
        scale -= (condition - lower) / (upper - lower)
        status = APPROACHING if moving_towards else MOVING_OFF
    elif condition >= hard_stop:
        scale, status = 0.0, HALT
    return scale, status


def status_of(found):
    """Return the status that is named, and the share that the rule alone gives."""
    causes = [one.cause for one in found.constraints]
    towards, away = (found.values[..., causes.index(cause)] for cause in (SINGULARITY, LEAVING))
    if towards == 0.0:
        return 0.0, HALT
    if towards < 1.0:
        return float(towards), APPROACHING
    return float(away), MOVING_OFF if away < 1.0 else NO_WARNING


OTHER_THRESHOLDS = {'lower_singularity_threshold': 14.0, 'hard_stop_singularity_threshold': 200.0}
ALL_OTHERS = {
    'lower_singularity_threshold': 11.0,
    'hard_stop_singularity_threshold': 90.0,
    'leaving_singularity_threshold_multiplier': 5.5,
    'singularity_step_scale': 0.002,
}


@pytest.mark.parametrize(
    ('name', 'settings'),
    [
        *(('ur5e', settings) for settings in ({}, OTHER_THRESHOLDS, ALL_OTHERS)),
        *(('panda', ALL_OTHERS), ('scara_hsr065', OTHER_THRESHOLDS), ('craig_3r', {})),
    ],
)
def test_the_share_and_the_status_are_those_of_moveit_servo(name, settings):
    robot, random = robot_of(name), np.random.default_rng(31)
    rule, seen = ks.ServoRule(**settings), set()
    poses = random.uniform(-2.5, 2.5, (80, robot.dof))
    motions = random.normal(size=poses.shape)
    together = ks.scale(robot, poses, motions, rule=rule)
    for k, (q, qdot) in enumerate(zip(poses, motions)):
        found = ks.scale(robot, q, qdot, rule=rule)
        expected, status = as_servo_does(
            robot, q, ks.twist(robot, q, qdot), *dataclasses.astuple(rule)
        )
        assert status_of(found) == (pytest.approx(expected, abs=1e3 * ROUND_OFF), status)
        np.testing.assert_allclose(found.values, together.values[k], rtol=0, atol=1e3 * ROUND_OFF)
        seen.add(status)
    if name in ('ur5e', 'panda') and settings:
        assert seen == {NO_WARNING, APPROACHING, HALT, MOVING_OFF}


def test_an_arm_of_few_joints_is_not_halted_for_a_singular_value_that_it_has_not():
    robot = robot_of('scara_hsr065')
    J = ks.jacobian(robot, calm_poses(robot, 1)[0])
    assert np.linalg.matrix_rank(J) == 4  # a fifth and a sixth, as if 6 x 6, would be 0
    found = ks.scale(robot, calm_poses(robot, 1)[0], np.zeros(4), rule=ks.ServoRule())
    assert found.value == 1.0


def test_it_stops_where_there_is_no_way_on_and_names_the_condition_number():
    # The wrist of a ur5e is stretched: J has rank 5.
    q = np.array([0.3, -1.0, 1.2, -0.4, 0.0, 0.3])
    found = ks.scale('ur5e', q, np.ones(6) * 0.1, rule=ks.ServoRule())
    assert (found.value, found.cause, found.margin) == (0.0, 'singularity', 0.0)
    assert np.isfinite(found.margins).all()
    beside = ks.scale('ur5e', q + [0, 0, 0, 0, 0.5, 0], np.ones(6) * 0.1, rule=ks.ServoRule())
    J = ks.jacobian('ur5e', q + [0, 0, 0, 0, 0.5, 0])
    unit = beside.constraints[0].unit
    assert unit == 'of the condition number'
    assert beside.margins[0] == pytest.approx(30.0 - np.linalg.cond(J), rel=1e-9)


def test_the_time_left_is_that_of_the_condition_number_s_own_rate():
    q, qdot, step = np.array([0.3, -1.0, 1.2, -0.4, 0.6, 0.3]), np.full(6, -0.2), 1e-6
    found = ks.scale('ur5e', q, qdot, rule=ks.ServoRule())
    conditions = [
        np.linalg.cond(ks.jacobian('ur5e', q + sign * step * qdot)) for sign in (-1, 0, 1)
    ]
    rate = (conditions[2] - conditions[0]) / (2 * step)
    assert rate > 0.0
    assert found.times[0] == pytest.approx((30.0 - conditions[1]) / rate, rel=1e-6)
    back = ks.scale('ur5e', q, -qdot, rule=ks.ServoRule())
    assert back.times[0] == math.inf


@pytest.mark.parametrize(
    ('settings', 'code', 'word'),
    [
        ({'lower_singularity_threshold': 0.0}, 'out-of-range', '0.0'),
        ({'singularity_step_scale': math.nan}, 'out-of-range', 'nan'),
        ({'hard_stop_singularity_threshold': 17.0}, 'wrong-order', 'lower_singularity_threshold'),
    ],
)
def test_settings_that_mean_nothing_are_refused(settings, code, word):
    with refused(ks.ServoSettingsError, code, *settings, word):
        ks.ServoRule(**settings)


@pytest.mark.parametrize('name', ['standard-1-0', 'rrp_elementary', 'modified-12-0', 'puma560'])
@pytest.mark.parametrize('rule', [ks.ServoRule(), ks.ServoRule(1.0001, 1e6, 0.01, 1.0)])
def test_any_arm_pose_and_speed_has_a_share(name, rule):
    robot = robot_of(name)
    for q in (np.zeros(robot.dof), calm_poses(robot, 1)[0], np.full(robot.dof, 1e3)):
        for size in (0.0, 1e-300, 1.0, 1e200):
            rates = np.full((2, 3, robot.dof), size)
            found = ks.scale(robot, q, rates, rule=rule)
            assert found.values.shape == (2, 3, len(found.constraints))
            assert np.all((found.values >= 0.0) & (found.values <= 1.0))
            assert not np.isnan(found.times).any()


def test_closed_loops_are_refused():
    with refused(ks.ServoSettingsError, 'unsupported', 'excavator', 'closed loops', 'distance'):
        ks.scale('excavator', np.zeros(4), np.zeros(4), rule=ks.ServoRule())
