# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Calibration by points that the tip touched: what it finds, what it cannot, what it refuses."""

from time import process_time

import numpy as np
import pytest
from arms import robot_of
from calibrated_arms import TIP, touching_arm, touching_positions
from refusal import refused

import kinematics_service as ks
from kinematics_service.apps.calibration.same_point import started
from kinematics_service.kinematics.uncertainty.parameters import parameters_of

# Without noise touches are as exact (m).
EXACT = 1e-9
# A known distance counts as one to 0.01 mm: priors of 1 mm pull at it by less than this (m).
PULLED = 1e-6
NOISE = 5e-5
A, B, C = (0.4, 0.2, 0.1), (-0.3, 0.4, 0.3), (0.2, -0.4, 0.25)
ONE, TWO = (('A', A),), (('A', A), ('B', B))
APART = {('A', 'B'): float(np.linalg.norm(np.subtract(A, B)))}
NO_SCALE = 'The scale of the lengths is not'
# Parallel axes, and a sliding joint.
ARMS = ('ur5e', 'offset_stanford_shape')


def tips(found, q):
    """Return where the calibrated arm has the tip, (N, 3)."""
    poses = ks.forward_kinematics(found.calibrated, q) @ found.tool_offsets[0]
    return poses[:, :3, 3]


@pytest.mark.slow
@pytest.mark.parametrize('name', ARMS)
def test_without_noise_another_point_is_touched_exactly(name):
    arm = touching_arm(name, TWO, 40)
    found = ks.calibrate(arm.robot, arm.q, same_point=arm.marks, apart=APART, check=False)
    assert found.known >= found.possible
    assert found.held_out_before.position_rms > 1e-3
    assert found.held_out.position_max < EXACT
    # Poses of the true arm at a point that was never touched.
    there = tips(found, touching_positions(arm.true, C, 30, 77))
    assert np.abs(there - there.mean(axis=0)).max() < EXACT
    a, b = (np.array(one.position) for one in found.points)
    assert abs(np.linalg.norm(a - b) - APART['A', 'B']) < PULLED
    # A turn about the first axis and a height are nobody's: the third point is as far.
    for own, true in ((a, A), (b, B)):
        length = np.linalg.norm(np.subtract(true, C))
        assert np.abs(np.linalg.norm(there - own, axis=1) - length).max() < PULLED


@pytest.mark.slow
@pytest.mark.parametrize(('name', 'points'), [('ur5e', ONE), ('puma560', TWO)])
def test_with_noise_errors_are_within_their_deviations(name, points):
    arm = touching_arm(name, points, 40, NOISE, seed=1)
    found = ks.calibrate(arm.robot, arm.q, same_point=arm.marks, check=False)
    assert found.known == found.possible
    assert 0.7 * NOISE < found.noise.position < 1.4 * NOISE
    count = len(arm.errors)
    error = np.array([one.correction for one in found.parameters[:count]]) - arm.errors
    beyond = np.abs(error) > 3.0 * np.array([one.deviation for one in found.parameters[:count]])
    assert np.sum(beyond) <= 1  # of one number in four hundred
    # Chi-square of as many numbers: all but one in a million.
    assert error @ np.linalg.solve(found.covariance[:count, :count], error) < 2.2 * count + 25.0
    for one, (_, true) in zip(found.points, points):
        assert np.all(np.abs(np.subtract(one.position, true)) < 4.0 * np.array(one.deviation))


def says_no_scale(found):
    return any(one.startswith(NO_SCALE) for one in found.remarks)


@pytest.mark.slow
def test_no_touches_tell_a_scale():
    for points in (ONE,):
        arm = touching_arm('ur5e', points, 40)
        found = ks.calibrate(arm.robot, arm.q, same_point=arm.marks)
        assert says_no_scale(found)
        combined = max((one.names for one in found.combinations), key=len)
        assert {'a2', 'a3', 'd1', 'd5', 'd6'} <= set(combined)
        unknown = sum(len(one.names) - one.determined for one in found.combinations)
        assert len(found.parameters) - unknown == found.possible == found.known


@pytest.mark.slow
def test_the_ratio_of_two_lengths_is_told_and_by_a_distance_each_of_them():
    arm = touching_arm('panda', TWO, 40)
    true = {one.name: error for one, error in zip(parameters_of(arm.robot).table, arm.errors)}
    d3, d5 = 0.316, 0.384
    free, scaled = (
        ks.calibrate(arm.robot, arm.q, same_point=arm.marks, apart=apart).corrections
        for apart in (None, APART)
    )
    ratio = (d3 + true['d3']) / (d5 + true['d5'])
    assert abs((d3 + free['d3']) / (d5 + free['d5']) - ratio) < EXACT
    assert abs(free['d3'] - true['d3']) > 1e-4
    assert abs(scaled['d3'] - true['d3']) < PULLED
    assert abs(scaled['d5'] - true['d5']) < PULLED


@pytest.mark.slow
def test_a_known_distance_tells_the_scale():
    arm = touching_arm('ur5e', TWO, 40)
    found = ks.calibrate(arm.robot, arm.q, same_point=arm.marks, apart=APART)
    plain = ks.calibrate(arm.robot, arm.q, same_point=arm.marks)
    assert found.possible == plain.possible + 1
    assert says_no_scale(plain) > says_no_scale(found)
    assert [(one.determined, ' '.join(one.names)) for one in found.combinations] == [
        (4, 'theta1 A.x A.y B.x B.y'),
        (2, 'd1 A.z B.z'),
        (1, 'd2 d3 d4'),
        (3, 'theta6 d6 a6 alpha6 tool.x tool.y tool.z'),
    ]


def test_a_length_that_is_fixed_tells_the_scale():
    arm = touching_arm('ur5e', ONE, 40)
    found = ks.calibrate(arm.robot, arm.q, same_point=arm.marks, fix=['a2'])
    assert not says_no_scale(found)


def test_a_tool_that_is_fixed_stays_as_in_the_file():
    arm = touching_arm('ur5e', ONE, 40)
    text = ks.bundled_robots()['ur5e'].read_text()
    assert 'tool: {frame: tool0}' in text
    tool = f'tool: {{frame: spike, xyz: {TIP.tolist()}}}'
    spike = ks.robot_from_text(text.replace('tool: {frame: tool0}', tool))
    found = ks.calibrate(spike, arm.q, same_point=arm.marks, fix=['tool'])
    assert np.array_equal(found.tool_offsets[0], np.eye(4))
    assert not any(one.group == 'tool' for one in found.parameters)
    assert not says_no_scale(found)
    assert found.held_out.position_max < EXACT


@pytest.mark.slow
def test_a_wrong_mark_is_an_outlier_and_the_right_point_is_named():
    arm = touching_arm('puma560', TWO, 40, NOISE)
    marks = list(arm.marks)
    marks[7] = 'B'
    q = arm.q.copy()
    q[50] += 0.02
    found = ks.calibrate(arm.robot, q, same_point=marks, check=False)
    assert sorted(found.outliers) == [7, 50]
    assert found.remarks[1:] == ('Row 7 is marked B but touches A',)
    plain = ks.calibrate(arm.robot, arm.q, same_point=arm.marks, check=False)
    assert abs(found.noise.position / plain.noise.position - 1.0) < 0.2


def test_few_touches_leave_the_arm_near_its_table():
    arm = touching_arm('ur5e', ONE, 5, NOISE)
    found = ks.calibrate(arm.robot, arm.q, same_point=arm.marks)
    assert 'the priors decide' in found.remarks[0]
    table = [one for one in found.parameters if one.group not in ('points', 'tool')]
    assert max(abs(one.correction) / one.prior for one in table) < 3.0


def refuses(code, words, *given, **options):
    """Fail unless a calibration is refused with a code and words, separated by |."""
    with refused(ks.CalibrationError, code, *words.split('|')):
        ks.calibrate(*given, **options)


def test_touches_that_tell_nothing_are_refused():
    arm = touching_arm('ur5e', TWO, 40)
    few = arm.robot, arm.q[:42]
    refuses('too-few', 'point B|2 poses|at least 3', *few, same_point=arm.marks[:42])
    alike = arm.robot, np.tile(arm.q[0], (9, 1))
    refuses('no-variation', 'point A', *alike, same_point=['A'] * 9)
    refuses('empty', 'same_point', arm.robot, np.zeros((0, 6)), same_point=[])
    given = {'same_point': arm.marks}
    refuses('wrong-unit', 'degrees|--joint-format deg', arm.robot, np.degrees(arm.q), **given)
    refuses('another-robot', 'ur10e', robot_of('ur10e'), arm.q, **given)


def test_mistakes_of_touches_are_compared_at_once():
    arm = touching_arm('ur5e', TWO, 40, NOISE)
    point = np.array(['AB'.index(mark) for mark in arm.marks])
    random = np.random.default_rng(8)
    joints = arm.q + 0.01 * random.normal(size=(5, *arm.q.shape))
    every = started(arm.robot, joints, point)
    for k, q in enumerate(joints):
        one = started(arm.robot, q, point)
        # Rounds end when steps are below a thousandth of the noise, here of some 4 mm.
        assert np.allclose(one.residuals, every.residuals[k], rtol=0.0, atol=2e-5)
    # The true table has the points and the tip.
    exact = started(arm.true, arm.q, point)
    assert np.max(np.abs(exact.points - [xyz for _, xyz in TWO])) < 3 * NOISE
    assert np.max(np.abs(exact.tip - TIP)) < 3 * NOISE


def test_touches_are_refused_in_less_time_than_they_are_fitted():
    arm = touching_arm('ur5e', TWO, 40, NOISE)
    turned = arm.q.copy()
    turned[:, 2] += turned[:, 1]
    begin = process_time()
    ks.calibrate(arm.robot, arm.q, same_point=arm.marks)
    fitted = process_time()
    why = 'What explains it|elbow_joint turns with joint shoulder_lift_joint'
    refuses('another-robot', why, arm.robot, turned, same_point=arm.marks)
    assert process_time() - fitted < fitted - begin


def test_a_distance_that_no_table_explains_is_refused():
    arm, true = touching_arm('ur5e', TWO, 40), APART['A', 'B']
    for code, given in (('wrong-unit', 1e3 * true), ('mismatch', 1.2 * true)):
        apart = {('A', 'B'): given}
        refuses(code, 'A and B are 75', arm.robot, arm.q, same_point=arm.marks, apart=apart)


def test_words_that_do_not_fit_are_refused():
    arm = touching_arm('ur5e', TWO, 40)
    q, marks = arm.q, arm.marks
    given, touched = (arm.robot, q), {'same_point': marks}
    refuses('wrong-shape', '(80, 6)', arm.robot, q[:, :5], **touched)
    refuses('not-finite', 'q', arm.robot, q * np.nan, **touched)
    refuses('unknown-parameter', "'base'|ur5e", *given, **touched, fix=['base'])
    refuses('conflict', "'A.x'", *given, **touched, fix=['A.x'])
    refuses('reserved-name', "'tool'", *given, same_point=['tool'] * 80)
    refuses('reserved-name', 'links', *given, same_point=['A\nlinks:'] * 80)
    refuses('unknown-name', 'point D|A, B', *given, **touched, apart={('A', 'D'): 0.1})
    refuses('out-of-range', '-1 m', *given, **touched, apart={('A', 'B'): -1.0})
    refuses('conflict', 'same_point', *given, np.zeros((80, 3)), **touched)
    refuses('conflict', 'give poses', *given)
    found = ks.calibrate(*given, **touched, check=False)
    with refused(ks.CalibrationError, 'unsupported', 'touched points'):
        ks.propose_poses(arm.robot, 3, found)
