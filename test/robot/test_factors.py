# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Named singular factors: evaluated live, checked against the arm, and told in the warning."""

import dataclasses
import math

import numpy as np
import pytest
from arms import BUNDLED, LOOPED, robot_of
from refusal import places
from tolerances import DIFFERENCE, DIFFERENCE_STEP

import kinematics_service as ks
from kinematics_service.estimation.estimator import Estimator, EstimatorSettings
from kinematics_service.estimation.joint_sample import JointSample
from kinematics_service.estimation.status_text import singularity_status
from kinematics_service.kinematics.singularity import flat_loop
from kinematics_service.robot.factors import APPROXIMATE_ZERO_DISTANCE, _product_is_the_determinant
from kinematics_service.robot.task import seeded_poses

FACTORED = [name for name in BUNDLED if robot_of(name).singularity.factors]
# The others list what all minors share: no product of factors is their determinant.
SQUARE = [
    name
    for name in FACTORED
    if robot_of(name).singularity.task.square
    and not robot_of(name).singularity.task.structurally_deficient
]
MILLISECOND = 1_000_000

ARM = """
robot: arm
convention: standard
units: {{angle: {angle}, length: {length}}}
constants: {{L1: {L1}, L2: {L2}}}
joints:
  - {{name: q1, type: revolute}}
  - {{name: q2, type: revolute}}
links:
  - {{a: L1, alpha: 0, d: 0, theta: q1}}
  - {{a: L2, alpha: 0, d: 0, theta: q2}}
singularity:
  factors:
    - {{name: {name}, expression: "{expression}"}}
"""


def arm(expression, name='elbow', angle='rad', length='m'):
    L1, L2 = (0.5, 0.4) if length == 'm' else (500, 400)
    return ks.robot_from_text(
        ARM.format(angle=angle, length=length, L1=L1, L2=L2, name=name, expression=expression),
        'arm.yaml',
    )


def poses(robot, count=1000):
    sliding = [kind == 'prismatic' for kind in robot.joint_types]
    return seeded_poses(robot.limits, sliding)[:count]


@pytest.mark.parametrize('name', SQUARE)
def test_the_factors_of_a_bundled_robot_are_its_determinant(name):
    robot = robot_of(name)
    assert robot.singularity.factors.complete
    q = poses(robot)
    values = np.abs(robot.singularity.factors.evaluate(q)[..., 0])
    determinants = np.abs(ks.singularity(robot, q).determinant)
    powers = np.array(
        [2.0 if factor == 'boom_length' else 1.0 for factor in robot.singularity.factors.names]
    )
    if robot.name.startswith('offset_stanford'):
        powers[:] = 1.0
    product = np.prod(values**powers, axis=1)
    constant = np.median(determinants / product)
    np.testing.assert_allclose(constant * product, determinants, rtol=1e-12, atol=1e-12 * constant)


@pytest.mark.parametrize('name', FACTORED)
def test_gradients_are_central_differences(name):
    robot = robot_of(name)
    q = poses(robot, 50)
    gradients = robot.singularity.factors.evaluate(q)[..., 1:]
    for j in range(robot.dof):
        step = np.zeros(robot.dof)
        step[j] = DIFFERENCE_STEP
        ahead, behind = (robot.singularity.factors.evaluate(q + s * step)[..., 0] for s in (1, -1))
        difference = (ahead - behind) / (2 * DIFFERENCE_STEP)
        np.testing.assert_allclose(gradients[..., j], difference, atol=DIFFERENCE)


def test_every_operation_has_its_derivative():
    # The bracket has no zeros, so the product is singular where the sine is.
    text = 'sin(q2)*(2 + cos(q1)/3 - sqrt(4 + sin(q1)) + atan2(sin(q1), 2 + cos(q2)) - -1)/(+2)'
    robot = arm(text)
    q = poses(robot, 20)
    results = robot.singularity.factors.evaluate(q)
    q1, q2 = q.T
    value = (
        np.sin(q2)
        * (
            2
            + np.cos(q1) / 3
            - np.sqrt(4 + np.sin(q1))
            + np.arctan2(np.sin(q1), 2 + np.cos(q2))
            + 1
        )
        / 2
    )
    np.testing.assert_allclose(results[:, 0, 0], value, atol=1e-14)
    for j in range(2):
        step = np.zeros(2)
        step[j] = DIFFERENCE_STEP
        ahead, behind = (
            robot.singularity.factors.evaluate(q + s * step)[:, 0, 0] for s in (1, -1)
        )
        difference = (ahead - behind) / (2 * DIFFERENCE_STEP)
        np.testing.assert_allclose(results[:, 0, 1 + j], difference, atol=DIFFERENCE)


def test_a_factor_of_a_file_in_degrees_and_millimetres_is_the_same():
    radians, degrees = arm('sin(q2)'), arm('sin(q2)', angle='deg', length='mm')
    q = poses(radians, 20)
    np.testing.assert_allclose(
        radians.singularity.factors.evaluate(q),
        degrees.singularity.factors.evaluate(q),
        atol=1e-14,
    )


def test_the_distance_of_a_single_factor_is_the_angle_to_its_zero():
    robot = arm('sin(q2)')
    found = ks.singularity(robot, [0.3, 0.02])
    assert found.distance == pytest.approx(0.02, abs=1e-12)
    assert found.factors.estimates == pytest.approx(math.tan(0.02))
    assert found.factors.names == ('elbow',)
    np.testing.assert_allclose(found.factors.motions, [[0.0, -math.tan(0.02)]])
    assert ks.singularity(robot, [0.3, 0.0]).distance == 0.0


def test_between_two_singular_families_the_factors_do_not_overestimate():
    # Craig's arm where the gradients of ln w cancel: the factors know both distances.
    robot = ks.load_robot('craig_3r')
    q = poses(robot)
    found = ks.singularity(robot, q)
    elbow = np.abs(q[:, 2])
    elbow = np.minimum(elbow, math.pi - elbow)
    close = elbow < 0.05
    assert np.sum(close) > 10
    assert np.all(found.distance[close] <= np.tan(elbow[close]) + 1e-12)


def test_a_factor_whose_zeros_are_no_singular_poses_is_refused():
    with pytest.raises(ks.RobotFileError) as refusal:
        arm('cos(q2)')
    assert places(refusal.value) == [(1, 'singularity', 'wrong-factor')]
    assert "'elbow' (cos(q2)) is zero at q = [" in str(refusal.value)


def test_an_incomplete_list_keeps_the_estimate_of_the_rest():
    text = ks.load_robot('craig_3r')
    from kinematics_service.robot.robot import build_robot

    judged = dataclasses.replace(
        text.description.singularity, factors=text.description.singularity.factors[:1]
    )
    robot = build_robot(dataclasses.replace(text.description, singularity=judged))
    assert not robot.singularity.factors.complete
    on_axis = [0.0, math.pi / 2, -math.pi / 2 - math.acos(-0.12 / 0.3)]
    assert ks.singularity(robot, on_axis).distance == pytest.approx(0.0, abs=1e-9)


def test_the_warning_names_the_nearest_factor_and_the_motion_to_its_zero():
    robot = ks.load_robot('ur5e')
    found = ks.singularity(robot, [0.3, -1.2, 0.02, -0.5, 1.0, 0.0], np.zeros(6))
    status_text = singularity_status(robot, found, ks.Level.ERROR, 'base')
    assert status_text.sentence.startswith(
        'at a singularity: elbow: sin(q3) = 0.02, distance 0.02 rad'
    )
    values = dict(status_text.values)
    assert values['factor'] == 'elbow'
    assert values['joint_motion_to_its_zero'] == 'elbow_joint=-0.0200'


def test_a_distance_that_was_not_found_is_said_to_be_none():
    robot = ks.load_robot('planar_2r')
    found = ks.singularity(robot, [0.0, 1.4])
    status_text = singularity_status(robot, found, ks.Level.OK, 'base')
    begins = 'not near a singularity: none found within 1 rad (57 deg), det(J) = 0.985'
    assert status_text.sentence == begins
    assert dict(status_text.values)['distance'] == '1'


def test_of_many_poses_each_has_its_nearest_factor():
    robot = ks.load_robot('ur5e')
    elbow, wrist = [0.3, -1.2, 0.02, -0.5, 1.0, 0.0], [0.3, -1.2, 1.1, -0.5, 0.03, 0.0]
    factors = ks.singularity(robot, [[elbow, wrist], [wrist, wrist]]).factors
    names = np.array(factors.names)[factors.nearest]
    assert names.tolist() == [['elbow', 'wrist'], ['wrist', 'wrist']]
    assert ks.singularity(robot, wrist).factors.nearest == factors.names.index('wrist')


def test_another_nearest_factor_is_said_at_once():
    robot = ks.load_robot('ur5e')
    estimator = Estimator(robot, EstimatorSettings())
    said = []
    for k in range(100):
        t = k / 99
        # From the elbow's zero into the wrist's, without leaving ERROR.
        q = [0.3, -1.2, 0.001 + 0.02 * t, -0.5, 0.0215 - 0.02 * t, 0.0]
        stamp = (1 + k) * 10 * MILLISECOND
        sample = JointSample(robot.joint_names, q, [0.0] * 6, stamp, stamp, stamp)
        found = ks.singularity(robot, estimator.take(sample).state.q)
        level, say = estimator.judge(found, stamp)
        assert level == ks.Level.ERROR
        if say:
            said.append(found.factors.names[found.factors.nearest])
    assert said[0] == 'elbow'
    assert said[-1] == 'wrist'
    assert len(said) <= 4


def test_a_complete_list_names_what_is_near_and_another_only_what_is_as_near():
    whole = robot_of('ur5e').singularity.factors
    assert whole.complete
    lacking = dataclasses.replace(whole, complete=False)
    for k in range(len(whole.names)):
        # Away from the factor's zero, and from the nearest singular pose, rad.
        for away, distance, named in ((0.1, 0.1, True), (0.14, 0.1, True), (0.4, 0.1, False)):
            assert whole.may_name(k, away, distance)
            assert lacking.may_name(k, away, distance) == named
    # An approximate factor may be farther away by what it is off.
    about = dataclasses.replace(lacking, approximate=(True,) * len(whole.names))
    for factor, named in ((0.9, True), (1.1, False)):
        away = 0.15 + factor * APPROXIMATE_ZERO_DISTANCE
        assert about.may_name(0, away, 0.1) == named
        assert not lacking.may_name(0, away, 0.1)


def test_too_few_poses_do_not_show_that_a_list_is_complete():
    robot = robot_of('ur5e')
    q = np.random.default_rng(3).uniform(0.4, 1.0, (40, robot.dof))
    enough = 2 * len(robot.singularity.factors.names) + 1
    complete = [
        _product_is_the_determinant(
            robot.singularity.factors, robot.chain, robot.singularity.task, q[:count]
        )
        for count in (enough - 1, enough, 40)
    ]
    assert complete == [False, True, True]


@pytest.mark.parametrize('name', LOOPED)
def test_the_warning_has_the_determinant_of_each_closed_loop(name):
    robot = robot_of(name)
    found = ks.singularity(robot, robot.chain.closure.assembled())
    values = dict(singularity_status(robot, found, ks.Level.WARN, 'base').values)
    told = {key: text for key, text in values.items() if key.startswith('loop_')}
    count = len(robot.loop_names)
    assert len(told) == count
    near = flat_loop(robot, found)
    for loop, text, det in zip(robot.loop_names, told.values(), found.factors.values[-count:]):
        away = f', {found.distance:.9g} rad from flat' if loop == near else ''
        assert text == f'det {det:.9g}{away}'
        assert np.isfinite(det)
