# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Covariances of pose and twist by the `uncertainty` of a robot file: draws and differences."""

import re
from dataclasses import replace

import numpy as np
import pytest
from arms import DISTINCT_BUNDLED, robot_of
from calibrated_arms import measured_arm
from refusal import refused

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.apps.calibration.corrections import (
    built_nearly,
    corrected_robot,
    with_ends,
)
from kinematics_service.apps.calibration.identified_table import motion_of
from kinematics_service.apps.calibration.robot_text import CalibrationOrigin, calibrated_text
from kinematics_service.kinematics.uncertainty.arm_errors import named_errors, table_errors_of
from kinematics_service.kinematics.uncertainty.corrected_chain import CorrectingMotion, pose_change
from kinematics_service.kinematics.uncertainty.parameters import (
    every_parameter_of,
    parameters_of,
    placement,
)
from kinematics_service.rigid_motion import rotation_vector
from kinematics_service.robot.file.parts.description import Uncertainty
from kinematics_service.robot.file.parts.parameters import TABLE_GROUPS
from kinematics_service.robot.robot import build_robot

# Standard errors of a sampled variance that the largest of 42 numbers stays within.
SURE = 4.5
# Central differences of this step (rad, m) are exact to its square, and to round-off over it.
STEP, DIFFERENCE = 1e-5, 1e-8
# Sums of a few dozen products, of sizes about one.
ROUND_OFF = 1e-12
# L is written with six digits.
WRITTEN = 1e-4
# Modified, prismatic, coupled, shape matrices, elementary.
KINDS = (
    'panda',
    'scara_hsr065',
    'parallelogram_left',
    'offset_stanford_shape',
    'rrp_elementary',
    'ur5e',
)


def nothing(n):
    zeros = (0.0,) * n
    return Uncertainty(zeros, zeros, zeros, None, (), (), 0.0, 0.0)


def with_uncertainty(robot, **said):
    given = replace(nothing(robot.dof), **said)
    return build_robot(replace(robot.description, uncertainty=given))


def pose_of_arm(robot, q):
    found = robot.limits
    low = np.maximum(found[:, 0], -1.5)
    return np.minimum(np.maximum(q, low), np.minimum(found[:, 1], 1.5))


def six_of(pose, middle):
    """Return how a pose (4, 4) differs from another: x y z, rotation about fixed axes."""
    turned = rotation_vector((pose[:3, :3] @ middle[:3, :3].T)[None])[0]
    return np.concatenate([pose[:3, 3] - middle[:3, 3], turned])


@pytest.mark.slow
@pytest.mark.parametrize('name', DISTINCT_BUNDLED)
def test_pose_and_twist_change_as_central_differences_of_other_tables_do(name):
    # All numbers of the table, base, tool and joints are off along one random direction: then
    # the covariance is the product of the change with itself.
    robot, random = robot_of(name), np.random.default_rng(7)
    known = [one for one in named_errors(robot).parameters if one.group != 'gears']
    off = random.normal(size=len(known))
    q = pose_of_arm(robot, random.normal(size=robot.dof))
    qdot = random.normal(size=robot.dof)
    uncertain = with_uncertainty(
        robot,
        factor=tuple((one.name, (float(x),)) for one, x in zip(known, off)),
        velocity_noise=(1e-9,) * robot.dof,
    )

    def six(way):
        values = way * STEP * off
        count = len(known) - 12
        base, tool = robot.description.base.motion.matrix, robot.description.tool.motion.matrix
        base = base @ motion_of(values[count : count + 6])
        tool = motion_of(values[count + 6 :]) @ tool
        corrected = corrected_robot(robot, known, values).description
        other = built_nearly(with_ends(corrected, base, tool))
        pose = ks.forward_kinematics(other, q)
        twists = [ks.twist(other, q, qdot, axes) for axes in ('base', 'tool')]
        return pose, twists

    (before, twists_before), (after, twists_after) = six(-1.0), six(1.0)
    middle = ks.forward_kinematics(robot, q)
    change = (six_of(after, middle) - six_of(before, middle)) / (2.0 * STEP)
    size = np.linalg.norm(change)
    found = ks.pose_covariance(uncertain, q)
    assert np.abs(found - np.outer(change, change)).max() < DIFFERENCE * size**2
    for axes, one, other in zip(('base', 'tool'), twists_before, twists_after):
        change = (other - one) / (2.0 * STEP)
        found = ks.twist_covariance(uncertain, q, qdot, axes)
        size = max(np.linalg.norm(change), size)
        assert np.abs(found - np.outer(change, change)).max() < DIFFERENCE * size**2


@pytest.mark.slow
@pytest.mark.parametrize('name', DISTINCT_BUNDLED)
def test_joints_that_are_off_change_pose_and_twist_as_differences_say(name):
    robot, random = robot_of(name), np.random.default_rng(8)
    q = pose_of_arm(robot, random.normal(size=robot.dof))
    qdot = random.normal(size=robot.dof)
    deviations = tuple(random.uniform(0.5, 2.0, robot.dof).tolist())
    uncertain = with_uncertainty(robot, noise=deviations, velocity_noise=deviations)
    J = ks.jacobian(robot, q)
    scaled = J * deviations
    found = ks.pose_covariance(uncertain, q)
    assert np.abs(found - scaled @ scaled.T).max() < ROUND_OFF * np.abs(found).max()
    for axes in ('base', 'tool'):
        changes = np.array(
            [
                ks.twist(robot, q + STEP * e, qdot, axes)
                - ks.twist(robot, q - STEP * e, qdot, axes)
                for e in np.eye(robot.dof)
            ]
        ).T / (2.0 * STEP)
        changes = np.concatenate([changes, ks.jacobian(robot, q, axes)], axis=1)
        scaled = changes * (*deviations, *deviations)
        expected = scaled @ scaled.T
        found = ks.twist_covariance(uncertain, q, qdot, axes)
        assert np.abs(found - expected).max() < DIFFERENCE * np.abs(expected).max()


@pytest.mark.slow
@pytest.mark.parametrize('name', DISTINCT_BUNDLED)
def test_gears_that_are_off_move_joints_by_a_share_more(name):
    robot, random = robot_of(name), np.random.default_rng(11)
    q = pose_of_arm(robot, random.normal(size=robot.dof))
    qdot, off = random.normal(size=(2, robot.dof))
    uncertain = with_uncertainty(
        robot,
        factor=tuple((f'gear{k + 1}', (float(x),)) for k, x in enumerate(off)),
        velocity_noise=(1e-9,) * robot.dof,
    )
    shares = [1.0 + way * STEP * off for way in (-1.0, 1.0)]
    middle = ks.forward_kinematics(robot, q)
    before, after = (six_of(ks.forward_kinematics(robot, q * one), middle) for one in shares)
    change = (after - before) / (2.0 * STEP)
    found = ks.pose_covariance(uncertain, q)
    size = max(1.0, np.linalg.norm(change))
    assert np.abs(found - np.outer(change, change)).max() < DIFFERENCE * size**2
    for axes in ('base', 'tool'):
        before, after = (ks.twist(robot, q * one, qdot * one, axes) for one in shares)
        change = (after - before) / (2.0 * STEP)
        size = max(1.0, np.linalg.norm(change))
        found = ks.twist_covariance(uncertain, q, qdot, axes)
        assert np.abs(found - np.outer(change, change)).max() < DIFFERENCE * size**2


def test_a_dense_covariance_goes_through_the_columns_that_the_calibration_has():
    for name in KINDS:
        robot, random = robot_of(name), np.random.default_rng(9)
        arm = every_parameter_of(robot.description)
        count = len(arm.table)
        rows = random.normal(size=(count, count))
        uncertain = with_uncertainty(
            robot,
            factor=tuple(
                (one.name, tuple(row[: k + 1].tolist()))
                for k, (one, row) in enumerate(zip(arm.table, rows))
            ),
            floor_xyz=0.5,
            floor_rpy=0.25,
        )
        description = robot.description
        base, tool = description.base.motion.matrix, description.tool.motion.matrix
        chain = placement(arm.chain, base, tool, (count, count + 6))
        q = pose_of_arm(robot, random.normal(size=(4, robot.dof)))
        J = pose_change(chain, np.zeros(count + 12), q).jacobian[:, :, :count] @ np.tril(rows)
        expected = J @ np.swapaxes(J, 1, 2) + np.diag([0.25] * 3 + [0.0625] * 3)
        found = ks.pose_covariance(uncertain, q)
        assert np.abs(found - expected).max() < ROUND_OFF * np.abs(expected).max()
        assert np.array_equal(found, np.swapaxes(found, 1, 2))
        for k in range(2):
            assert np.array_equal(ks.pose_covariance(uncertain, q[k]), found[k])


def test_the_kernel_refuses_what_does_not_go_together():
    robot = robot_of('craig_3r')
    fine = {
        'frame': np.array([0, 2]),
        'screw': np.ones((2, 6)),
        'gear': np.array([-1, 2]),
        'spread': np.ones((2, 1)),
        'rates': np.zeros(3),
        'floor': np.zeros(6),
    }
    for name, wrong in (
        ('frame', np.array([0, robot.chain.frames])),
        ('frame', np.array([-1, 2])),
        ('frame', np.array([2, 0])),
        ('screw', np.ones((1, 6))),
        ('gear', np.array([-1, 3])),
        ('gear', np.array([-2, 0])),
        ('gear', np.zeros(1, np.int64)),
        ('spread', np.ones((3, 1))),
        ('rates', np.zeros(2)),
        ('floor', np.zeros(5)),
    ):
        with pytest.raises(TypeError, match='what may be off do not go together'):
            kernel.PoseErrors(robot.chain, kernel.PoseErrorTable(**{**fine, name: wrong}))
    errors = kernel.PoseErrors(robot.chain, kernel.PoseErrorTable(**fine))
    q, found = np.zeros((2, 3)), np.zeros((2, 2, 6, 6))
    rows = ks.evaluate(robot, q, q, depth=kernel.ALL_FRAMES).row
    for arguments in (
        (None, rows, q, q, False, found),
        (errors, np.ascontiguousarray(rows[:, :-1]), q, q, False, found),
        (errors, rows, q[:1], q, False, found),
        (errors, rows, q, q[:1], False, found),
        (errors, rows, q, q, False, found[:1]),
        (errors, rows, q, q, False, found.astype(np.float32)),
    ):
        with pytest.raises(TypeError):
            kernel.covariances(*arguments)
    kernel.covariances(errors, rows, q, q, False, found)
    assert np.all(np.isfinite(found))


# Draws


def drawn_poses(chain, values, q):
    """Return the poses (N, 4, 4) of N arms, each with corrections (N, P) and joints (N, n)."""
    T = np.tile(np.eye(4), (len(q), 1, 1))
    for k, parts in enumerate(chain.still):
        for part in parts:
            if not isinstance(part, CorrectingMotion):
                T = T @ part
                continue
            i, j = (part.axis + 1) % 3, (part.axis + 2) % 3
            value = values[:, part.column, None]
            if part.turns:
                c, s, x, y = np.cos(value), np.sin(value), T[:, :, i], T[:, :, j]
                T[:, :, i], T[:, :, j] = c * x + s * y, c * y - s * x
            else:
                T[:, :, 3] += value * T[:, :, part.axis]
        if k < len(chain.screws.theta_0):
            theta_0, d_0, by_theta, by_d = (numbers[k] for numbers in chain.screws)
            theta = (theta_0 + q @ by_theta)[:, None]
            c, s, x, y = np.cos(theta), np.sin(theta), T[:, :, 0].copy(), T[:, :, 1].copy()
            T[:, :, 0], T[:, :, 1] = c * x + s * y, c * y - s * x
            T[:, :, 3] += (d_0 + q @ by_d)[:, None] * T[:, :, 2]
    return T


def drawn(name, draws):
    """Return covariances (2, 6, 6) by the robot file, and those of draws."""
    random = np.random.default_rng(3)
    robot = robot_of(name)
    table = parameters_of(robot).table
    n, count = robot.dof, len(table)
    factor = np.tril(random.normal(size=(count, count)))
    factor *= np.array([1e-4 if one.angle else 5e-5 for one in table])[:, None]
    noise, rates = random.uniform(1e-4, 3e-4, (2, n))
    uncertain = with_uncertainty(
        robot,
        noise=tuple(noise.tolist()),
        velocity_noise=tuple(rates.tolist()),
        factor=tuple(
            (one.name, tuple(row[: k + 1].tolist()))
            for k, (one, row) in enumerate(zip(table, factor))
        ),
    )
    q = pose_of_arm(robot, random.normal(size=n))
    qdot = random.uniform(0.5, 1.5, n)
    description = robot.description
    base, tool = description.base.motion.matrix, description.tool.motion.matrix
    chain = placement(parameters_of(robot).chain, base, tool, (count, count + 6))
    values = np.zeros((draws, count + 12))
    values[:, :count] = random.normal(size=(draws, count)) @ factor.T
    joints = q + noise * random.normal(size=(draws, n))
    moving = qdot + rates * random.normal(size=(draws, n))
    step = 1e-4
    before, after = (
        drawn_poses(chain, values, joints + way * step * moving) for way in (-1.0, 1.0)
    )
    middle = np.linalg.inv(before[:1])
    six = np.concatenate(
        [before[:, :3, 3], rotation_vector(before[:, :3, :3] @ middle[:, :3, :3])], axis=1
    )
    turned = rotation_vector(after[:, :3, :3] @ np.swapaxes(before[:, :3, :3], 1, 2))
    twists = np.concatenate([after[:, :3, 3] - before[:, :3, 3], turned], axis=1) / (2.0 * step)
    found = ks.pose_covariance(uncertain, q), ks.twist_covariance(uncertain, q, qdot)
    return found, (np.cov(six.T), np.cov(twists.T))


def apart(found, expected):
    """Return the largest difference in units of the two deviations' product."""
    sizes = np.sqrt(np.diag(found))
    there = np.flatnonzero(sizes > 1e-6 * sizes.max())
    least = np.flatnonzero(sizes <= 1e-6 * sizes.max())
    assert np.all(np.sqrt(np.diag(expected))[least] <= 1e-3 * sizes.max())
    at = np.ix_(there, there)
    return np.max(np.abs(found - expected)[at] / np.outer(sizes, sizes)[at])


@pytest.mark.parametrize('name', ['parallelogram_left', 'offset_stanford_shape'])
def test_covariances_are_those_of_twenty_thousand_arms(name):
    for found, expected in zip(*drawn(name, 20_000)):
        assert apart(found, expected) < SURE * np.sqrt(2.0 / 20_000)


@pytest.mark.slow
@pytest.mark.parametrize('name', ['rrp_elementary'])
def test_covariances_are_those_of_a_hundred_thousand_arms_within_two_percent(name):
    for found, expected in zip(*drawn(name, 100_000)):
        assert apart(found, expected) < 0.02


# Robot files

FILE = """\
robot: slide
source: a test
convention: standard
units: {angle: deg, length: mm}
joints:
  - {name: q1, type: revolute}
  - {name: q2, type: prismatic, limits: [0, 500]}
links:
  - {a: 400, alpha: 90, d: 0, theta: q1}
  - {a: 0, alpha: 0, d: q2, theta: 0}
"""


def test_numbers_are_in_the_units_of_the_file_and_of_each_joint():
    robot = ks.robot_from_text(
        FILE + 'uncertainty:\n'
        '  encoder_noise: [0.01, 0.1]\n'
        '  encoder_resolution: [0.02, 0.5]\n'
        '  backlash: [0.06, 0]\n'
        '  velocity_noise: [1, 2]\n'
        '  parameters: {lengths: 0.3, alpha1: 0.1, a1: 0, base.rz: 0.5, gears: 1e-3, gear2: 0}\n'
        '  floor: {xyz: 0.05, rpy: 0.2}\n'
    )
    said = robot.description.uncertainty
    turn = np.radians([0.01, 0.02, 0.06, 0.1, 0.5, 0.2])
    deviations = [
        np.sqrt(turn[0] ** 2 + (turn[1] ** 2 + turn[2] ** 2) / 12.0),
        np.sqrt(1e-4**2 + 5e-4**2 / 12.0),
    ]
    np.testing.assert_allclose(said.joint_deviations, deviations, rtol=1e-14)
    np.testing.assert_allclose(said.velocity_noise, [np.radians(1.0), 2e-3], rtol=1e-14)
    # The group is that of the row's lengths; a name counts for more, and 0 is none.
    found = table_errors_of(robot, said)
    by_size = sorted(np.linalg.norm(found.factor, axis=1))
    said_ones = [3e-4, 3e-4, turn[3], turn[4], 1e-3]
    np.testing.assert_allclose(by_size, sorted(said_ones), rtol=1e-12)
    assert found.gears.tolist() == [-1, -1, -1, -1, 0]
    by_hand = ks.pose_covariance(
        ks.robot_from_text(FILE + 'uncertainty: {floor: {xyz: 0.05, rpy: 0.2}}\n'), [0.1, 0.2]
    )
    np.testing.assert_allclose(by_hand, np.diag([2.5e-9] * 3 + [turn[5] ** 2] * 3), rtol=1e-12)


def test_a_file_that_does_not_say_has_no_covariance_of_zeros():
    silent = ks.robot_from_text(FILE)
    q = [0.1, 0.2]
    with pytest.raises(ks.CalibrationError, match='slide'):
        ks.pose_covariance(silent, q)
    with pytest.raises(ks.CalibrationError, match='velocity_noise'):
        ks.twist_covariance(silent, q, q, joints=1e-3)
    rates = ks.robot_from_text(FILE + 'uncertainty: {velocity_noise: [1, 1]}\n')
    with pytest.raises(ks.CalibrationError, match='slide'):
        ks.pose_covariance(rates, q)
    assert np.all(np.linalg.eigvalsh(ks.twist_covariance(rates, q, q)) > -ROUND_OFF)
    for said, name in (({'velocities': -1.0}, 'velocities'), ({'axes': 'elbow'}, 'elbow')):
        with pytest.raises(ks.CalibrationError, match=name):
            ks.twist_covariance(silent, q, q, **{'joints': 1.0, 'velocities': 1.0, **said})


def test_what_is_given_stands_instead_of_what_the_file_says():
    robot = ks.robot_from_text(
        FILE + 'uncertainty: {encoder_noise: [0.01, 0.1], velocity_noise: [1, 1],'
        ' parameters: {a1: 0.3}}\n'
    )
    q, qdot = np.array([0.3, 0.2]), np.array([0.5, -0.1])
    said = robot.description.uncertainty
    assert np.array_equal(
        ks.pose_covariance(robot, q, joints=said.noise), ks.pose_covariance(robot, q)
    )
    assert np.array_equal(
        ks.twist_covariance(robot, q, qdot, velocities=said.velocity_noise),
        ks.twist_covariance(robot, q, qdot),
    )
    more = ks.pose_covariance(robot, q, joints=1.0) - ks.pose_covariance(robot, q, joints=0.0)
    J = ks.jacobian(robot, q)
    np.testing.assert_allclose(more, J @ J.T, atol=ROUND_OFF)


def test_a_point_of_the_arm_keeps_what_is_off_before_it():
    robot = ks.robot_from_text(
        FILE + 'points: {elbow: {row: 1}}\n'
        'uncertainty: {parameters: {theta1: 0.1, d2: 5, tool.x: 5, base.z: 0.2}}\n'
    )
    found = ks.pose_covariance(robot.ending_at('elbow'), [0.0, 0.1])
    turn = np.radians(0.1)
    expected = np.zeros((6, 6))
    expected[2, 2] = 2e-4**2
    expected[np.ix_([1, 5], [1, 5])] = turn**2 * np.array([[0.16, 0.4], [0.4, 1.0]])
    np.testing.assert_allclose(found, expected, atol=1e-18)


# What calibrate writes


def written(found, arm, name, frames):
    text = ks.bundled_robots()[name].read_text()
    origin = CalibrationOrigin('made up', '2026-01-01')
    return calibrated_text(found, text, arm.q, arm.poses, origin, frames)


@pytest.mark.slow
@pytest.mark.parametrize('name', ['panda', 'rrp_elementary'])
def test_the_covariance_of_a_calibration_is_read_back(name):
    arm = measured_arm(name, 30, 5e-5)
    found = ks.calibrate(arm.robot, arm.q, arm.poses)
    robot = ks.robot_from_text(written(found, arm, name, 'robot'))
    said = robot.description.uncertainty
    # The noise of the poses, two numbers of one part in ten.
    assert abs(said.floor_xyz / 5e-5 - 1.0) < 0.3
    bare = build_robot(
        replace(robot.description, uncertainty=replace(said, floor_xyz=0.0, floor_rpy=0.0))
    )
    got = ks.pose_covariance(bare, arm.q[:6])
    expected = ks.pose_covariance(robot, arm.q[:6], calibration=found)
    sizes = np.sqrt(np.diagonal(expected, axis1=1, axis2=2))
    products = sizes[:, :, None] * sizes[:, None, :]
    assert np.all(np.abs(got - expected) <= WRITTEN * products)


def test_a_calibration_of_another_arm_of_as_many_joints_is_refused():
    arm = measured_arm('rrp_elementary', 20, 5e-5)
    found = ks.calibrate(arm.robot, arm.q, arm.poses)
    with refused(ks.CalibrationError, 'mismatch', 'calibration', 'parallelogram_left'):
        ks.pose_covariance('parallelogram_left', [0.1, 0.2, 0.3], calibration=found)


@pytest.mark.slow
@pytest.mark.parametrize('name', ['scara_hsr065', 'parallelogram_left'])
def test_gear_ratios_that_were_fitted_are_carried_into_covariances(name):
    # Poses of the controller's own frames: a base that is open hides what gears are off by.
    arm = measured_arm(name, 40, 5e-5, base=np.eye(4), tool=np.eye(4), gears=True)
    found = ks.calibrate(arm.robot, arm.q, arm.poses, fit=['all'], fix=['base', 'tool'])
    of_table = [k for k, one in enumerate(found.parameters) if one.group in TABLE_GROUPS]
    values = np.array([found.parameters[k].correction for k in of_table])
    gears = {one.name: one.correction for one in found.parameters if one.group == 'gears'}
    assert len(gears) == arm.robot.dof
    # Of all but gears the chain of the calibration says how poses move; with a gear the joints of
    # the calibrated arm are as much farther.
    table, chain = parameters_of(arm.robot, gears=True).table, parameters_of(arm.robot, True).chain
    assert [one.name for one in table] == [found.parameters[k].name for k in of_table]
    count, description = len(table), arm.robot.description
    base, tool = description.base.motion.matrix, description.tool.motion.matrix
    chain = placement(chain, base, tool, (count, count + 6))
    values = np.concatenate([values, np.zeros(12)])
    robot, q = found.calibrated, arm.q[0]
    qdot = np.random.default_rng(12).normal(size=robot.dof)

    def farther(k, way):
        ratio = 1.0 + gears[f'gear{k + 1}']
        share = np.ones(robot.dof)
        share[k] = (ratio + way * STEP) / ratio
        return share

    def of_poses(q):
        J = pose_change(chain, values, q[None]).jacobian[0, :, :count]
        middle = ks.forward_kinematics(robot, q)
        for k in range(robot.dof):
            after, before = (
                six_of(ks.forward_kinematics(robot, farther(k, way) * q), middle)
                for way in (1.0, -1.0)
            )
            J[:, count - robot.dof + k] = (after - before) / (2.0 * STEP)
        return J

    J = of_poses(q)
    ahead, back = (of_poses(q + way * 1e-4 * qdot) for way in (1.0, -1.0))
    rates = (ahead - back) / 2e-4
    # Turned by a small rotation the angular velocity is another, too.
    rates[3:] -= np.cross(ks.twist(robot, q, qdot)[3:], J[3:].T).T
    for k in range(robot.dof):
        after, before = (
            ks.twist(robot, farther(k, way) * q, farther(k, way) * qdot) for way in (1.0, -1.0)
        )
        rates[:, count - robot.dof + k] = (after - before) / (2.0 * STEP)
    covariance = found.covariance[np.ix_(of_table, of_table)]
    # As the calibration has it, and as the file says it.
    read = ks.robot_from_text(written(found, arm, name, 'robot'))
    said = replace(read.description.uncertainty, floor_xyz=0.0, floor_rpy=0.0)
    assert {f'gear{k + 1}' for k in range(robot.dof)} <= {row for row, _ in said.factor}
    bare = build_robot(replace(read.description, uncertainty=said))
    for one, known in ((robot, {'calibration': found}), (bare, {})):
        for rows, S in (
            (J, ks.pose_covariance(one, q, **known)),
            (rates, ks.twist_covariance(one, q, qdot, velocities=0.0, **known)),
        ):
            expected = rows @ covariance @ rows.T
            sizes = np.sqrt(np.diag(expected))
            assert np.all(np.abs(S - expected) <= WRITTEN * np.outer(sizes, sizes))
            # And they count: without what is open of them it is less.
            still = covariance[: -robot.dof, : -robot.dof]
            less = rows[:, : -robot.dof] @ still @ rows[:, : -robot.dof].T
            assert np.abs(S - less).max() > 10.0 * WRITTEN * np.abs(S).max()


@pytest.mark.slow
def test_poses_in_the_measured_frames_are_off_by_what_the_file_says():
    arm = measured_arm('ur5e', 40, 5e-5)
    found = ks.calibrate(arm.robot, arm.q[:30], arm.poses[:30])
    text = written(found, arm._replace(q=arm.q[:30], poses=arm.poses[:30]), 'ur5e', 'measured')
    robot = ks.robot_from_text(text)
    q = arm.q[30:]
    off = np.array([six_of(T, M) for T, M in zip(arm.poses[30:], ks.forward_kinematics(robot, q))])
    S = ks.pose_covariance(robot, q)
    squares = np.einsum('ni,nij,nj->n', off, np.linalg.inv(S), off)
    # Ten poses of six numbers: the mean of 60 squares is 1 with a deviation of 0.18.
    assert 0.4 < np.sum(squares) / 60.0 < 1.7
    # Base and tool are known together with the table: each alone is not, all of them are.
    assert np.sqrt(S[:, :3, :3].max()) < 2e-4


def test_what_a_file_says_of_its_joints_is_kept_by_a_calibration():
    arm = measured_arm('ur5e', 30, 5e-5)
    text = ks.bundled_robots()['ur5e'].read_text()
    text += 'uncertainty: {encoder_noise: 1e-5, backlash: 2e-5, parameters: {angles: 0.1}}\n'
    found = ks.calibrate(ks.robot_from_text(text), arm.q, arm.poses)
    assert found.calibrated.description.uncertainty.parameters == ()
    origin = CalibrationOrigin('made up', '2026-01-01')
    made = calibrated_text(found, text, arm.q, arm.poses, origin)
    said = ks.robot_from_text(made).description.uncertainty
    assert said.noise == (1e-5,) * 6
    assert said.backlash == (2e-5,) * 6
    assert said.parameters == ()
    assert len(said.factor) == len(re.findall('^    [a-z]+[0-9]: ', made, re.MULTILINE)) > 20
