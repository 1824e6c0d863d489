# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Wrenches and joint torques: power on both sides, and what a singular pose hides."""

import numpy as np
import pytest
from arms import DISTINCT, LOOPED, calm_poses, robot_of
from refusal import refused
from tolerances import ROUND_OFF

import kinematics_service as ks

SOME_ARMS = (*DISTINCT, *LOOPED)
some_arms = pytest.mark.parametrize('name', SOME_ARMS)

# Least squares at poses next to singular ones, of torques of some N m.
SOLVED = 1e-8


@some_arms
def test_power_is_the_same_at_the_joints_and_at_the_tool(name):
    robot = robot_of(name)
    q = calm_poses(robot, 6)
    random = np.random.default_rng(5)
    qdot, F = random.uniform(-1, 1, q.shape), random.uniform(-5, 5, (len(q), 6))
    for choice in ({}, {'of': robot.rows, 'at': (0.3, -0.2, 0.5), 'axes': 'tool'}):
        tau = ks.joint_torques(robot, q, F, **choice)
        V = ks.twist(robot, q, qdot, **choice)
        np.testing.assert_allclose(
            np.sum(tau * qdot, axis=-1), np.sum(F * V, axis=-1), rtol=0, atol=1e-11
        )


@some_arms
def test_a_wrench_found_from_torques_explains_them_but_for_what_is_hidden(name):
    robot = robot_of(name)
    q = np.random.default_rng(6).uniform(-1, 1, (12, robot.dof))
    if name in LOOPED:
        q = calm_poses(robot, 12)
    F = np.random.default_rng(5).uniform(-5, 5, (len(q), 6))
    tau = ks.joint_torques(robot, q, F)
    found = ks.wrench_from_torques(robot, q, tau)
    np.testing.assert_allclose(found.residual, 0.0, rtol=0, atol=SOLVED)
    np.testing.assert_allclose(ks.joint_torques(robot, q, found.wrench), tau, rtol=0, atol=SOLVED)
    scales = np.array([1.0] * 3 + [robot.singularity.task.length] * 3)
    # What is left of the true wrench is hidden wholly.
    missing = (F - found.wrench) / scales
    along = np.einsum('nki,ni->nk', found.hidden, missing)
    np.testing.assert_allclose(
        np.einsum('nki,nk->ni', found.hidden, along), missing, rtol=0, atol=SOLVED
    )
    for k, rank in enumerate(found.rank):
        assert not found.hidden[k, :rank].any()
        hidden = found.hidden[k, rank:]
        np.testing.assert_allclose(hidden @ hidden.T, np.eye(6 - rank), rtol=0, atol=ROUND_OFF)
        for direction in hidden * scales:
            torques = ks.joint_torques(robot, q[k], direction)
            np.testing.assert_allclose(torques, 0.0, rtol=0, atol=SOLVED)


def test_a_stretched_arm_hides_the_force_along_it():
    robot = robot_of('planar_2r')
    found = ks.wrench_from_torques(robot, [0.0, 0.0], [6.0, 3.0], at=(0, 0, 0))
    # Both joints feel a force across the arm and a moment about z; one along it, neither.
    assert found.rank == 2
    along = np.zeros(6)
    along[0] = 1.0
    np.testing.assert_allclose(found.hidden[2:].T @ (found.hidden[2:] @ along), along, atol=1e-12)
    bent = ks.wrench_from_torques(robot, [0.0, np.pi / 2], [6.0, 3.0])
    assert abs(np.linalg.norm(bent.hidden[2:] @ along) - 1.0) > 0.1


def test_torques_that_no_wrench_explains_are_in_the_residual():
    text = """\
robot: twice
convention: standard
joints: [{name: q1, type: revolute}, {name: q2, type: revolute}]
links: [{a: 0, alpha: 0, d: 0.1, theta: q1}, {a: 0.5, alpha: 0, d: 0, theta: q2}]
"""
    robot = ks.robot_from_text(text)  # both joints have one axis: they feel the same
    found = ks.wrench_from_torques(robot, [0.3, 0.4], [3.0, 1.0])
    assert found.rank == 1
    np.testing.assert_allclose(found.residual, [1.0, -1.0], rtol=0, atol=ROUND_OFF)
    np.testing.assert_allclose(
        ks.joint_torques(robot, [0.3, 0.4], found.wrench), [2.0, 2.0], rtol=0, atol=ROUND_OFF
    )


def test_a_frame_that_nothing_moves_is_felt_by_no_joint():
    robot = robot_of('craig_3r')
    found = ks.wrench_from_torques(robot, np.zeros((2, 3)), [1.0, 2.0, 3.0], of=0)
    assert found.rank.tolist() == [0, 0]
    assert not found.wrench.any()
    assert found.residual.tolist() == [[1.0, 2.0, 3.0]] * 2


def test_results_are_frozen():
    found = ks.wrench_from_torques(robot_of('craig_3r'), [0, 0, 0], [1, 2, 3])
    for name in ('wrench', 'residual', 'rank', 'hidden'):
        assert not getattr(found, name).flags.writeable


def test_what_does_not_fit_is_refused():
    robot, q = robot_of('craig_3r'), np.zeros((4, 3))
    for wrench, code, word in (
        (np.zeros(5), 'wrong-shape', '(5,)'),
        ('push', 'not-a-number', "'push'"),
        (np.zeros((3, 6)), 'mismatch', '(4, 3) and (3, 6)'),
    ):
        with refused(ks.WrenchError, code, 'wrench', word):
            ks.joint_torques(robot, q, wrench)
    for torques, code, word in (
        (np.zeros(4), 'wrong-shape', '(4,)'),
        ([0, np.inf, 0], 'not-finite', 'inf'),
        (np.zeros((5, 3)), 'mismatch', '(4, 3) and (5, 3)'),
    ):
        with refused(ks.JointVectorError, code, 'torques', word):
            ks.wrench_from_torques(robot, q, torques)
