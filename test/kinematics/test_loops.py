# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Closed loops: the passive joints follow the others, on the branch that is known."""

import json
import math
import os
import pickle
import re
import subprocess
import sys
from pathlib import Path

import linkages
import loop_numbers
import numpy as np
import pytest
from arms import LOOPED, away_from_flat, other_branch_text, robot_of, seeded, without_known_poses
from folders import GOLDEN
from refusal import refused
from tolerances import DIFFERENCE, DIFFERENCE_STEP, QUOTIENT, ROUND_OFF

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.estimation.status_text import singularity_status
from kinematics_service.kernel.compiled import VARIABLE
from kinematics_service.kinematics.singularity import flat_loop, singularity_of
from kinematics_service.kinematics.singularity_rates import measured_in_order
from kinematics_service.robot.closed_poses import close_at, closes_at, tried_poses

every_arm = pytest.mark.parametrize('name', LOOPED)
# Angles of pins are quotients of lengths that carry round-off.
CLOSED_FORM = 1e-12

BOTH_WAYS = """
robot: parallelogram
convention: standard
constants: {L1: 0.4, L2: 0.15, L3: L1, L4: L2, L5: 0.35}
joints:
  - {name: theta1, type: revolute}
  - {name: theta2, type: revolute}
  - {name: theta3, type: revolute}
links:
  - {alpha: -pi/2, a: 0,       d: 0, theta: 0}
  - {alpha: pi/2,  a: 0,       d: 0, theta: theta1}
  - {alpha: 0,     a: L2,      d: 0, theta: theta2}
  - {alpha: 0,     a: L3,      d: 0, theta: psi1}
  - {alpha: 0,     a: L4 + L5, d: 0, theta: psi2}
loops:
  - name: parallelogram
    passive: [psi1, psi2]
    from: {row: 2}
    links: [{alpha: 0, a: L1, d: 0, theta: theta3}]
    meets: {row: 5, xyz: [-L5, 0, 0]}
    rows: [x, y]
    assembled: {q: [0, pi/2, 0], psi1: -pi/2, psi2: -pi/2}
"""


def golden():
    return json.loads((GOLDEN / 's000b_x_general_loop.json').read_text())['configs']


@pytest.mark.parametrize('branch', [1, -1])
def test_the_general_loop_of_the_source_document(branch):
    robot = robot_of('four_bar_arm') if branch == 1 else ks.robot_from_text(other_branch_text())
    configs = [config for config in golden() if config['branch'] == branch]
    assert len(configs) > 10
    q = np.array([config['q'] for config in configs])
    qdot = np.array([config['qdot'] for config in configs])
    state = ks.evaluate(robot, q, qdot)
    for name, found in (('T', state.pose), ('J', state.jacobian), ('twist', state.twist)):
        expected = [config[name] for config in configs]
        np.testing.assert_allclose(found, expected, rtol=0, atol=ROUND_OFF, err_msg=name)
    found = ks.singularity(robot, q)
    expected = [config['task_det'] for config in configs]
    np.testing.assert_allclose(found.determinant, expected, rtol=0, atol=ROUND_OFF)
    psi = np.array([[config['passive_psi1'], config['passive_psi2']] for config in configs])
    turns = (state.closure.passive - psi) / (2 * math.pi)
    np.testing.assert_allclose(turns, np.round(turns), rtol=0, atol=ROUND_OFF)
    # det d Phi / d psi of the document: L3 L4 sin psi2.
    expected = 0.38 * 0.17 * np.sin(psi[:, 1])
    np.testing.assert_allclose(state.closure.determinants[:, 0], expected, rtol=0, atol=ROUND_OFF)


def test_the_five_bar_by_circles():
    robot = robot_of('five_bar')
    for q in seeded(robot, 50):
        (x, y), angle = linkages.five_bar(q)
        T = ks.forward_kinematics(robot, q)
        np.testing.assert_allclose(T[:2, 3], [x, y], rtol=0, atol=CLOSED_FORM)
        expected = [math.cos(angle), math.sin(angle)]
        np.testing.assert_allclose(T[:2, 0], expected, rtol=0, atol=CLOSED_FORM)


def test_the_crank_slider_by_its_formula():
    robot = robot_of('crank_slider')
    q = np.linspace(-9.0, 9.0, 200)
    found = ks.forward_kinematics(robot, q[:, None])[:, 0, 3]
    expected = [linkages.crank_slider(angle) for angle in q]
    np.testing.assert_allclose(found, expected, rtol=0, atol=CLOSED_FORM)


def test_the_excavator_by_triangles():
    robot = robot_of('excavator')
    for q in seeded(robot, 50):
        place, pitch, (boom, stick, bucket) = linkages.excavator(q)
        state = ks.evaluate(robot, q)
        np.testing.assert_allclose(state.position, place, rtol=0, atol=10 * CLOSED_FORM)
        assert state.pose[2, 0] == pytest.approx(math.sin(pitch), abs=10 * CLOSED_FORM)
        passive = dict(zip(robot.passive_joint_names, state.closure.passive))
        found = [passive['boom'], passive['stick'], passive['bucket']]
        np.testing.assert_allclose(found, [boom, stick, bucket], rtol=0, atol=10 * CLOSED_FORM)


def test_a_loop_that_is_a_parallelogram_is_the_coupled_arm():
    looped, coupled = ks.robot_from_text(BOTH_WAYS), robot_of('parallelogram_left')
    random = np.random.default_rng(2)
    q = random.uniform(-math.pi, math.pi, (100, 3))
    q[:, 2] = q[:, 1] - random.uniform(0.05, math.pi - 0.05, 100)  # on this side of flat
    one, other = ks.evaluate(looped, q), ks.evaluate(coupled, q)
    np.testing.assert_allclose(one.pose, other.pose, rtol=0, atol=ROUND_OFF)
    np.testing.assert_allclose(one.jacobian, other.jacobian, rtol=0, atol=ROUND_OFF)
    # Nearer to flat, round-off over the sine moves the rods, and their rates over the sine again.
    q[:, 2] = q[:, 1] - random.uniform(0.01, 0.05, 100)
    one, other = ks.evaluate(looped, q), ks.evaluate(coupled, q)
    sines = np.sin(q[:, 1] - q[:, 2])[:, None, None]
    apart = (one.jacobian - other.jacobian) * sines**2
    np.testing.assert_allclose(apart, 0.0, rtol=0, atol=0.01 * ROUND_OFF)


@every_arm
def test_the_jacobian_is_the_derivative_of_the_closed_arm(name):
    robot = robot_of(name)
    q = away_from_flat(robot, seeded(robot, 60), 0.05)
    assert len(q) > 20
    J = ks.jacobian(robot, q)
    for j in range(robot.dof):
        step = np.zeros(robot.dof)
        step[j] = DIFFERENCE_STEP
        later, before = (ks.forward_kinematics(robot, q + sign * step) for sign in (1, -1))
        change = (later - before) / (2 * DIFFERENCE_STEP)
        scale = 1.0 + np.max(np.abs(J))
        np.testing.assert_allclose(J[:, :3, j], change[:, :3, 3], rtol=0, atol=DIFFERENCE * scale)
        T = ks.forward_kinematics(robot, q)
        turning = change[:, :3, :3] @ np.swapaxes(T[:, :3, :3], 1, 2)
        omega = np.stack([turning[:, 2, 1], turning[:, 0, 2], turning[:, 1, 0]], axis=1)
        np.testing.assert_allclose(J[:, 3:, j], omega, rtol=0, atol=DIFFERENCE * scale)


@every_arm
def test_the_twist_is_the_jacobian_times_the_joint_velocities(name):
    robot = robot_of(name)
    q = seeded(robot, 50)
    qdot = np.random.default_rng(3).normal(size=q.shape)
    state = ks.evaluate(robot, q, qdot)
    expected = (state.jacobian @ qdot[..., None])[..., 0]
    np.testing.assert_allclose(state.twist, expected, rtol=ROUND_OFF, atol=10 * ROUND_OFF)


@every_arm
def test_determinants_of_the_closure_have_the_right_gradient(name):
    robot = robot_of(name)
    for q in away_from_flat(robot, seeded(robot, 40))[:4]:
        results = ks.singularity(robot, q).factors.results
        state = ks.evaluate(robot, q)
        np.testing.assert_allclose(results[:, 0], state.closure.determinants, rtol=QUOTIENT)
        for j in range(robot.dof):
            step = np.zeros(robot.dof)
            step[j] = DIFFERENCE_STEP
            later, before = (
                ks.evaluate(robot, q + sign * step).closure.determinants for sign in (1, -1)
            )
            change = (later - before) / (2 * DIFFERENCE_STEP)
            scale = 1.0 + np.max(np.abs(results))
            np.testing.assert_allclose(
                results[:, 1 + j], change, rtol=0, atol=10 * DIFFERENCE * scale
            )


@every_arm
def test_the_way_out_is_the_gradient_of_the_manipulability_or_of_the_loop_that_is_nearer(name):
    # By differences of the sum of log singular values, which the kernel takes from dJ, dC and all.
    robot = robot_of(name)
    for q in away_from_flat(robot, seeded(robot, 40))[:4]:
        found = ks.singularity(robot, q)
        # Where none was found it leads away from what the first order says to be nearest.
        named = (
            ('', *robot.loop_names)
            if found.nearest_singular is None
            else (flat_loop(robot, found),)
        )
        ways = [steepest_way(robot, q, loop) for loop in named]
        if not any(way is None for way in ways):
            assert min(np.max(np.abs(found.way_out - way)) for way in ways) < 1e-5


def steepest_way(robot, q, loop):
    # Of the log of a loop's determinant, or of the sum of log singular values; None without one.
    task = robot.singularity.task

    def logs(at):
        if loop:
            k = robot.loop_names.index(loop)
            return math.log(abs(ks.evaluate(robot, at).closure.determinants[k]))
        sigma = ks.singularity(robot, at).singular_values
        return float(np.sum(np.log(sigma[: task.generic_rank])))

    slopes = np.empty(robot.dof)
    for j in range(robot.dof):
        step = np.zeros(robot.dof)
        step[j] = DIFFERENCE_STEP
        slopes[j] = (logs(q + step) - logs(q - step)) / (2 * DIFFERENCE_STEP)
    slopes *= task.column_scales
    steepest = float(np.linalg.norm(slopes))
    return slopes / steepest * task.column_scales if steepest >= 0.1 else None


def test_the_way_out_near_a_flat_loop_does_not_lead_to_the_end_of_its_branch():
    # There J grows: the way out of the manipulability leads the other way.
    robot = ks.robot_from_text(linkages.SHORT_FIVE_BAR)
    ends = math.asin(0.15 / 0.25)
    for away in (0.1, 1e-2, 1e-4):
        q = np.array([math.pi / 2 + ends - away, math.pi / 2 - ends + away / 3])
        found = ks.singularity(robot, q)
        assert flat_loop(robot, found) == 'rods'
        assert found.distance == pytest.approx(0.94 * away, rel=0.2)
        onto = found.factors.motions[0]
        assert found.way_out @ onto < -0.99 * np.linalg.norm(onto)
        with pytest.raises(ks.LoopError):
            ks.evaluate(robot, q - 2.0 * away * found.way_out)
        beyond = ks.singularity(robot, q + away * found.way_out)
        assert beyond.distance > 1.5 * found.distance


def test_where_loops_hardly_ever_close_few_poses_are_tried():
    robot = ks.robot_from_text(linkages.SHORT_FIVE_BAR)
    closed, opened = np.array([2.2, 0.93]), np.array([math.pi, 0.0])
    assert closes_at(robot.chain, np.stack([closed, opened])).tolist() == [True, False]
    found, tried = tried_poses(robot.chain, np.tile(opened, (100, 1)))
    assert (len(found), tried) == (0, 20)
    half = np.tile(np.stack([opened, closed]), (50, 1))
    found, tried = tried_poses(robot.chain, half)
    assert tried == 100
    np.testing.assert_array_equal(found, half[1::2])


def test_what_is_near_is_told_as_arm_or_loop():
    robot = ks.robot_from_text(linkages.SHORT_FIVE_BAR)
    found = ks.singularity(robot, [2.2, 0.93])
    status = singularity_status(robot, found, found.level, 'base_link')
    assert status.sentence == (
        'at a flat position of the loop rods: rods = -0.0191, distance 0.012 rad (0.7 deg), '
        'det(J) = -0.22; there the motors do not hold what the loop rods moves'
    )
    values = dict(status.values)
    assert values['nearest'] == 'loop rods'
    assert re.search(r'^det -0\.0190\d*, 0\.0120\d* rad', values['loop_rods'])
    # At a dead centre the slider stands still, and the loop holds it.
    robot = robot_of('crank_slider')
    found = ks.singularity(robot, [1e-3])
    status = singularity_status(robot, found, found.level, 'base_link')
    assert 'singularity of the arm' in status.sentence
    assert 'along x in base_link' in status.sentence
    assert dict(status.values)['nearest'] == 'arm'


@pytest.mark.slow
def test_every_position_closes_or_is_refused_truly():
    # A five-bar with short rods and no limits: at half of all positions the elbows are too far
    # apart. A dense search finds no position of the rods where it is refused.
    text = without_known_poses('five_bar').replace('distal: 0.4', 'distal: 0.2')
    text = re.sub(r', limits: \[.*?\]', '', text)
    elbow = math.pi / 2 - math.acos(0.15 / 0.2)
    text = re.sub(
        'assembled: .*', f'assembled: {{q: [pi/2, pi/2], psi1: {-elbow}, psi2: {elbow}}}', text
    )
    robot = ks.robot_from_text(text)
    q = np.random.default_rng(4).uniform(-math.pi, math.pi, (400, 2))
    sections, failed = close_at(robot.chain, q)
    closed = failed == 0.0
    assert 0.3 < np.mean(closed) < 0.7
    left = 0.25 * np.stack([np.cos(q[:, 0]), np.sin(q[:, 0])], axis=1)
    right = 0.25 * np.stack([np.cos(q[:, 1]), np.sin(q[:, 1])], axis=1) + [0.3, 0.0]
    psi = sections[:, 2:4]
    ends = [
        elbow + 0.2 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        for elbow, angle in ((left, q[:, 0] + psi[:, 0]), (right, q[:, 1] + psi[:, 1]))
    ]
    apart = np.linalg.norm(ends[0] - ends[1], axis=1)
    assert np.max(apart[closed]) < ROUND_OFF
    # The tip is on the left of the way from one elbow to the other: the known branch.
    way, tip = right - left, ends[0] - left
    assert np.all((way[:, 0] * tip[:, 1] - way[:, 1] * tip[:, 0])[closed] > 0.0)
    angles = np.linspace(-math.pi, math.pi, 3601)
    around = 0.2 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    for k in np.flatnonzero(~closed)[:60]:
        distances = np.linalg.norm(left[k] + around - right[k], axis=1)
        assert np.min(distances) > 0.2, q[k]


def test_a_line_that_meets_one_flat_position_is_bent():
    # On these lines the elbows of a five-bar fall together, where its rods may turn as they like.
    text = re.sub(r', limits: \[.*?\]', '', without_known_poses('five_bar'))
    text = text.replace('distal: 0.4', 'distal: 0.3')
    robot = ks.robot_from_text(text.replace('psi1: -1.27, psi2: 1.27', 'psi1: -1.51, psi2: 1.51'))
    for q in ([0.0, math.pi], [0.0, -math.pi], [0.3, math.pi - 0.3]):
        T = ks.forward_kinematics(robot, q)
        (x, y), direction = linkages.five_bar(q, distal=0.3)
        np.testing.assert_allclose(T[:2, 3], [x, y], rtol=0, atol=CLOSED_FORM)
        expected = [math.cos(direction), math.sin(direction)]
        np.testing.assert_allclose(T[:2, 0], expected, rtol=0, atol=CLOSED_FORM)


def test_a_position_at_which_the_loop_does_not_close_says_why():
    text = (
        without_known_poses('five_bar')
        .replace('[0, 2*pi/3]', '[0, pi]')
        .replace('[pi/3, pi]', '[0, pi]')
    )
    text = text.replace('distal: 0.4', 'distal: 0.3')
    robot = ks.robot_from_text(text.replace('psi1: -1.27, psi2: 1.27', 'psi1: -1.51, psi2: 1.51'))
    with refused(ks.LoopError, 'open-loop', "'rods'", 'five_bar', '[3.14159, 0.1]') as caught:
        ks.forward_kinematics(robot, [math.pi, 0.1])
    assert caught.value.loop == 'rods'
    assert re.search(r'branch ends at \[2\.\d+, 0\.\d+\]$', str(caught.value))
    with pytest.raises(ks.LoopError) as caught:
        ks.jacobian(robot, [[1.5, 1.5], [math.pi, 0.1]])
    assert caught.value.row == 1


def test_a_singular_pose_that_is_found_is_as_far_as_it_says():
    robot = robot_of('four_bar_arm')
    q = [0.1, 1.2, 0.3]
    found = ks.singularity(robot, q)
    assert found.distance == pytest.approx(np.linalg.norm(found.nearest_singular - q))
    assert ks.singularity(robot, found.nearest_singular).distance < 1e-6
    assert found.clearance == 0.0
    many = ks.singularity(robot, seeded(robot, 40))
    found = np.isfinite(many.nearest_singular[:, 0])
    assert 0 < np.sum(found) < 40
    assert not np.any(many.clearance)


@pytest.mark.parametrize(
    'q', [[1.256, 0.049, -0.069], [0.942, 1.107, 0.217], [0.82, -0.55, -0.177]]
)
def test_a_closed_arm_is_as_far_from_a_singular_pose_as_rays_say(q):
    # The first order says 0.38, 0.42 and 0.78 rad; along 400 rays the nearest is 0.89 rad away.
    robot = robot_of('flexpicker')
    in_order = singularity_of(
        measured_in_order(ks.evaluate(robot, [q]), kernel.NearestSearch(robot.singularity.arm))
    )
    for found in (ks.singularity(robot, q), ks.singularity(robot, [q]), in_order):
        assert found.distance > 0.87


def rays(n):
    """Directions of joint motion, evenly spread."""
    if n == 1:
        return np.array([[1.0], [-1.0]])
    k = np.arange(60 * (n - 1)) + 0.5
    if n == 2:
        angle = 2 * np.pi * k / len(k)
        return np.column_stack([np.cos(angle), np.sin(angle)])
    height, angle = 1 - 2 * k / len(k), np.pi * (1 + math.sqrt(5)) * k
    ring = np.sqrt(1 - height**2)
    return np.column_stack([ring * np.cos(angle), ring * np.sin(angle), height])


def signs_of_determinants(robot, q):
    """Return the sign at each pose (N, n), 0 where loops do not close."""
    closed, signs = closes_at(robot.chain, q), np.zeros(len(q))
    if np.any(closed):
        signs[closed] = np.sign(ks.singularity(robot, q[closed]).determinant)
    return signs


@pytest.mark.parametrize('name', ['crank_slider', 'five_bar', 'four_bar_arm'])
def test_a_distance_is_to_a_singular_pose_and_about_to_the_nearest(name):
    # Along rays to where the determinant changes its sign, or a branch ends.
    robot = robot_of(name)
    checked = 0
    for q in seeded(robot, 12):
        found, here = ks.singularity(robot, q), signs_of_determinants(robot, q[None])
        if found.nearest_singular is None:
            continue
        nearest = 1.0
        for ray in rays(robot.dof):
            away = np.arange(0.02, nearest, 0.02)
            crossed = signs_of_determinants(robot, q + away[:, None] * ray) != here
            nearest = away[crossed].min(initial=nearest)
        assert found.distance > nearest - 0.04
        assert found.distance < 1.1 * nearest
        checked += 1
        if checked == (3 if robot.dof < 3 else 1):
            return
    pytest.fail('few are near')


def test_along_a_motion_loops_are_named_and_judged_as_alone():
    robot = robot_of('five_bar')
    q = np.linspace([0.4, 2.4], [1.6, 1.4], 100)
    state = measured_in_order(ks.evaluate(robot, q), kernel.NearestSearch(robot.singularity.arm))
    live, alone = singularity_of(state), ks.singularity(robot, q)
    assert np.array_equal(live.level, alone.level)
    near = alone.distance <= 0.2
    assert 0 < np.sum(near) < len(q)
    assert np.array_equal(live.factors.nearest[near], alone.factors.nearest[near])
    # A search that follows a motion may differ by 5 %; here it does by less.
    np.testing.assert_allclose(live.distance, alone.distance, rtol=0.02)


def test_the_nearest_flat_position_is_found():
    # Elbows whose way is two rods long: a curve of q, which is sampled.
    robot = ks.robot_from_text(linkages.SHORT_FIVE_BAR)
    q1, way = np.linspace(1.2, 3.2, 20_001), np.array([[0.3, 0.0]])
    left = 0.25 * np.stack([np.cos(q1), np.sin(q1)], axis=1)
    apart = left - way
    reach = np.linalg.norm(apart, axis=1)
    cosine = (0.25**2 + reach**2 - 0.6**2) / (2 * 0.25 * reach)
    real = np.abs(cosine) <= 1.0
    towards = np.arctan2(apart[real, 1], apart[real, 0])
    turn = np.arccos(cosine[real])
    curve = np.concatenate(
        [np.stack([q1[real], towards + sign * turn], axis=1) for sign in (1, -1)]
    )
    for q in ([2.15, 0.95], [2.0, 0.8], [2.3, 1.2], [1.9, 0.7]):
        found = ks.singularity(robot, q)
        assert flat_loop(robot, found) == 'rods'
        distances = np.linalg.norm(curve - q, axis=1)
        assert found.distance == pytest.approx(np.min(distances), abs=1e-4)
        nearest = curve[np.argmin(distances)]
        np.testing.assert_allclose(found.nearest_singular, nearest, rtol=0, atol=5e-3)
        with pytest.raises(ks.LoopError):
            ks.evaluate(robot, found.nearest_singular + 0.01 * (found.nearest_singular - q))


def test_the_nearest_singular_pose_of_the_closed_arm_is_found():
    # A crank's dead centres are at whole half turns.
    robot = robot_of('crank_slider')
    for q in (0.12, -0.17, 3.0, 3.3, 6.4):
        found = ks.singularity(robot, [q])
        assert flat_loop(robot, found) == ''
        expected = math.pi * round(q / math.pi)
        assert found.nearest_singular[0] == pytest.approx(expected, abs=1e-7)
        assert found.distance == pytest.approx(abs(q - expected), abs=1e-7)
    # The distal rod and the proximal one of a side are in line; no circle of less way is singular.
    robot = robot_of('five_bar')
    around = np.linspace(0.0, 2.0 * math.pi, 200)
    ring = np.stack([np.cos(around), np.sin(around)], axis=1)
    for q in ([1.7, 1.8], [1.2, 1.75], [1.5, 1.9]):
        found = ks.singularity(robot, q)
        assert flat_loop(robot, found) == ''
        there = ks.singularity(robot, found.nearest_singular)
        assert there.smallest_singular_value < 1e-6
        sign = np.sign(found.determinant)
        nearer = ks.singularity(robot, q + 0.98 * found.distance * ring).determinant
        farther = ks.singularity(robot, q + 1.02 * found.distance * ring).determinant
        assert np.all(np.sign(nearer) == sign)
        assert np.any(np.sign(farther) != sign)


@pytest.mark.parametrize('share', [0.0, 1e-8])
def test_a_singular_pose_of_a_closed_arm_is_its_own_nearest(share):
    robot = robot_of('crank_slider')
    found = ks.singularity(robot, [share])
    assert found.distance == pytest.approx(share, abs=1e-7)
    assert found.level == ks.Level.ERROR


def test_the_nearer_of_loop_and_arm_is_told():
    robot = robot_of('crank_slider')
    # At a dead centre the slider stands, and the loop is far from flat.
    found = ks.singularity(robot, [1e-3])
    assert found.distance == pytest.approx(1e-3, rel=1e-2)
    assert found.factors.names == ('slider_crank',)
    assert found.factors.estimates[0] > 0.5
    # The general loop is flat where crank and upper arm are opposite.
    robot = robot_of('four_bar_arm')
    found = ks.singularity(robot, [0.0, math.pi / 2, -math.pi / 2 + 0.02])
    assert found.factors.estimates[0] == pytest.approx(found.distance, rel=QUOTIENT)
    assert 0.005 < found.distance < 0.02
    assert found.level == ks.Level.ERROR


@every_arm
def test_a_batch_is_its_poses_one_by_one(name):
    robot = robot_of(name)
    q = seeded(robot, 40)
    batch = ks.evaluate(robot, q).row
    for k, one in enumerate(q):
        assert np.array_equal(ks.evaluate(robot, one).numbers, batch[k])


def test_points_move_with_the_loop():
    robot = robot_of('four_bar_arm')
    assert robot.joint_names == ('theta1', 'theta2', 'theta3')
    assert robot.passive_joint_names == ('psi1', 'psi2')
    q = seeded(robot, 30)
    for row in range(robot.rows + 1):
        J = ks.jacobian(robot, q, of=row)
        for j in range(3):
            step = np.zeros(3)
            step[j] = DIFFERENCE_STEP
            later, before = (
                ks.forward_kinematics(robot, q + sign * step, of=row)[:, :3, 3] for sign in (1, -1)
            )
            change = (later - before) / (2 * DIFFERENCE_STEP)
            scale = 1.0 + np.max(np.abs(J))
            np.testing.assert_allclose(J[:, :3, j], change, rtol=0, atol=100 * DIFFERENCE * scale)
        frames = ks.link_frames(robot, q)[:, row]
        np.testing.assert_allclose(ks.forward_kinematics(robot, q, of=row), frames, atol=ROUND_OFF)
    # The coupler's frame as a tool of its own, with its own measures; the crank needs no loop.
    elbow = robot.ending_at(4)
    np.testing.assert_allclose(
        ks.jacobian(elbow, q), ks.jacobian(robot, q, of=4), rtol=0, atol=ROUND_OFF
    )
    assert elbow.chain.loops == 1
    assert robot.ending_at(3).chain.loops == 0


def test_an_arm_with_loops_survives_pickling():
    robot = robot_of('excavator')
    again = pickle.loads(pickle.dumps(robot))
    q = seeded(robot, 5)
    assert np.array_equal(ks.evaluate(robot, q).row, ks.evaluate(again, q).row)


def test_loops_cost_no_room_where_there_are_none():
    chain = robot_of('puma560').chain
    assert chain.loops == 0
    assert chain.closure is None
    assert chain.widths[kernel.POSE] == kernel.JACOBIAN_AT
    assert chain.closure_at == chain.frames_at


@pytest.mark.slow
@pytest.mark.skipif(not kernel.is_compiled(), reason='about the compiled kernel')
def test_the_compiled_kernel_closes_loops_with_the_numbers_of_its_source(tmp_path):
    # Pickled: plain Python takes minutes to look at the poses of a new arm.
    names = [str(tmp_path / f'{name}.pickle') for name in ('crank_slider', 'five_bar')]
    for name in names:
        Path(name).write_bytes(pickle.dumps(ks.load_robot(Path(name).stem)))
    script = Path(__file__).parent / 'loop_numbers.py'
    done = subprocess.run(
        [sys.executable, str(script), *names],
        env={**os.environ, VARIABLE: '1'},
        capture_output=True,
        text=True,
        timeout=280,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == list(loop_numbers.lines(names))
