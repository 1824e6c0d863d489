# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Derivatives of the Jacobian, and accelerations: against differences, and Pinocchio."""

import numpy as np
import pytest
from arms import DISTINCT, DISTINCT_BUNDLED, LOOPED, calm_poses, robot_of
from refusal import refused
from tolerances import DIFFERENCE, DIFFERENCE_STEP, ROUND_OFF

import kinematics_service as ks

SOME_ARMS = (*DISTINCT, *LOOPED)
some_arms = pytest.mark.parametrize('name', SOME_ARMS)

# Sums of products of three numbers: accelerations of long arms reach 100 m/s^2.
ACCELERATION = 1e-10
AT = np.array([0.3, -0.2, 0.5])


def motion(robot, count=8):
    """Return positions, velocities and accelerations, each (N, n)."""
    q = calm_poses(robot, count)
    qdot, qddot = np.random.default_rng(7).uniform(-1.5, 1.5, (2, *q.shape))
    return q, qdot, qddot


@some_arms
def test_the_rate_of_the_jacobian_is_its_difference_along_the_motion(name):
    robot = robot_of(name)
    q, qdot, _ = motion(robot)
    step = DIFFERENCE_STEP * qdot
    for choice in ({}, {'of': (robot.rows + 1) // 2, 'at': AT}):
        ahead, behind = (ks.jacobian(robot, q + sign * step, **choice) for sign in (1, -1))
        np.testing.assert_allclose(
            ks.jacobian_rate(robot, q, qdot, **choice),
            (ahead - behind) / (2 * DIFFERENCE_STEP),
            rtol=0,
            atol=DIFFERENCE,
        )


@some_arms
def test_the_acceleration_is_the_derivative_of_the_twist(name):
    robot = robot_of(name)
    q, qdot, qddot = motion(robot)

    def twist(t, **choice):
        return ks.twist(robot, q + t * qdot + 0.5 * t * t * qddot, qdot + t * qddot, **choice)

    for choice in ({}, {'of': (robot.rows + 1) // 2, 'at': AT}):
        h = DIFFERENCE_STEP
        expected = (twist(h, **choice) - twist(-h, **choice)) / (2 * h)
        found = ks.acceleration(robot, q, qdot, qddot, **choice)
        np.testing.assert_allclose(found, expected, rtol=0, atol=DIFFERENCE)


@some_arms
def test_the_acceleration_is_that_of_the_rate_and_of_the_jacobian(name):
    robot = robot_of(name)
    q, qdot, qddot = motion(robot, 2)
    rate, J = ks.jacobian_rate(robot, q, qdot), ks.jacobian(robot, q)
    expected = rate @ qdot[..., None] + J @ qddot[..., None]
    found = ks.acceleration(robot, q, qdot, qddot)
    np.testing.assert_allclose(found, expected[..., 0], rtol=0, atol=ACCELERATION)
    one = [ks.acceleration(robot, *one) for one in zip(q, qdot, qddot)]
    np.testing.assert_allclose(found, one, rtol=0, atol=ACCELERATION)


def extrapolated(f, h=1e-4):
    """Return df/dt at 0 by Richardson's extrapolation of two central differences."""
    wide, narrow = ((f(step) - f(-step)) / (2 * step) for step in (h, h / 2))
    return (4 * narrow - wide) / 3


@pytest.mark.parametrize('name', LOOPED)
def test_accelerations_through_loops_to_ten_digits(name):
    robot = robot_of(name)
    q, qdot, qddot = motion(robot, 12)
    qdot, qddot = 0.3 * qdot, 0.3 * qddot
    assert len(q) == 12
    for choice in ({}, {'of': (robot.rows + 1) // 2, 'at': AT}):

        def twist(t, choice=choice):
            later = q + t * qdot + 0.5 * t * t * qddot
            return ks.twist(robot, later, qdot + t * qddot, **choice)

        def J(t, choice=choice):
            return ks.jacobian(robot, q + t * qdot, **choice)

        for expected, found in (
            (extrapolated(twist), ks.acceleration(robot, q, qdot, qddot, **choice)),
            (extrapolated(J), ks.jacobian_rate(robot, q, qdot, **choice)),
        ):
            scale = 1.0 + np.max(np.abs(found))
            np.testing.assert_allclose(found, expected, rtol=0, atol=ACCELERATION * scale)


def test_the_crank_slider_accelerates_by_its_formula():
    robot, r, length = robot_of('crank_slider'), 0.05, 0.15
    q, qdot, qddot = np.linspace(-3.0, 3.0, 50), 2.5, -1.5
    s, c = r * np.sin(q), r * np.cos(q)
    u = np.sqrt(length**2 - s**2)
    slope, curve = -s - s * c / u, -c - (c**2 - s**2) / u - (s * c) ** 2 / u**3
    found = ks.acceleration(robot, q[:, None], [qdot], [qddot])
    expected = curve * qdot**2 + slope * qddot
    np.testing.assert_allclose(found[:, 0], expected, rtol=0, atol=ROUND_OFF)


def test_where_a_loop_does_not_close_there_is_no_acceleration():
    with pytest.raises(ks.LoopError):
        ks.acceleration(robot_of('excavator'), [0, 9.0, 2.9, 2.3], np.zeros(4), np.zeros(4))


@pytest.mark.peers
@pytest.mark.parametrize(
    'name', [n for n in DISTINCT_BUNDLED if not n.startswith('parallelogram')]
)
def test_pinocchio_classical_accelerations_of_a_row_and_the_tool(name):
    pinocchio = pytest.importorskip('pinocchio')
    robot = robot_of(name)
    model = pinocchio.buildModelFromXML(ks.export_urdf(robot), True)
    data = model.createData()
    joints = [model.joints[model.getJointId(joint)] for joint in robot.joint_names]
    row = (robot.rows + 1) // 2
    frames = {row: f'{robot.name}_frame_{row}', 'tool': robot.tool_frame}
    references = pinocchio.ReferenceFrame
    for q, qdot, qddot in zip(*motion(robot, 3)):
        whole, v, a = pinocchio.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
        for joint, *values in zip(joints, q, qdot, qddot):
            turned = [np.cos(values[0]), np.sin(values[0])] if joint.nq == 2 else values[0]
            whole[joint.idx_q : joint.idx_q + joint.nq] = turned
            v[joint.idx_v], a[joint.idx_v] = values[1:]
        pinocchio.forwardKinematics(model, data, whole, v, a)
        for of, frame in frames.items():
            number = model.getFrameId(frame)
            for axes, reference in (
                ('base', references.LOCAL_WORLD_ALIGNED),
                (of, references.LOCAL),
            ):
                expected = pinocchio.getFrameClassicalAcceleration(model, data, number, reference)
                np.testing.assert_allclose(
                    ks.acceleration(robot, q, qdot, qddot, axes, of=of),
                    expected.vector,
                    rtol=0,
                    atol=ACCELERATION,
                )


def test_a_link_that_turns_steadily_draws_its_end_inwards():
    robot = robot_of('planar_2r')
    found = ks.acceleration(robot, [0.4, 0.9], [2.0, 0.0], [0.0, 3.0])
    r1, r2 = np.array([np.cos(0.4), np.sin(0.4)]), np.array([np.cos(1.3), np.sin(1.3)])
    expected = -4 * (r1 + r2) + 3 * np.array([-r2[1], r2[0]])
    np.testing.assert_allclose(found, [*expected, 0, 0, 0, 3], rtol=0, atol=ROUND_OFF)


def test_nothing_accelerates_in_front_of_the_first_joint():
    robot = robot_of('craig_3r')
    assert not ks.acceleration(robot, [0.1, 0.2, 0.3], [1, 2, 3], [4, 5, 6], of=0).any()
    assert ks.jacobian_rate(robot, np.zeros((2, 3)), [1, 2, 3], of=0).shape == (2, 6, 3)


@pytest.mark.parametrize(
    ('qddot', 'code', 'words'),
    [
        ([1, 2], 'wrong-shape', ['qddot', '(2,)', '(..., 3)']),
        ([1, 2, np.nan], 'not-finite', ['qddot', '[1.0, 2.0, nan]']),
        ('fast', 'not-a-number', ['qddot', "'fast'"]),
        (np.zeros((5, 3)), 'mismatch', ['q and qddot', '(4, 3) and (5, 3)']),
    ],
)
def test_accelerations_that_do_not_fit_are_refused(qddot, code, words):
    robot = robot_of('craig_3r')
    with refused(ks.JointVectorError, code, *words) as refusal:
        ks.acceleration(robot, np.zeros((4, 3)), np.zeros(3), qddot)
    assert refusal.value.argument == 'qddot'
