# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
A robot identified from measured poses: what it finds, what it knows, and what it refuses.

Measured arms are built from robot descriptions and go through the kernel; the calibration has a
chain of its own, so that each number comes by two roads.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from arms import DISTINCT_BUNDLED, robot_of
from calibrated_arms import (
    BASE,
    TEN,
    TOOL,
    held_out_chi_square,
    measured_arm,
    positions_within,
    predicted,
    truly,
)
from recordings import recorded
from refusal import refused
from tolerances import DIFFERENCE, DIFFERENCE_STEP, ROUND_OFF

import kinematics_service as ks
from kinematics_service.apps.calibration.identified_table import (
    CalibratedParameter,
    structural_rank,
)
from kinematics_service.apps.calibration.report import sentences_of
from kinematics_service.apps.calibration.robot_text import CalibrationOrigin, calibrated_text
from kinematics_service.kinematics.uncertainty.corrected_chain import pose_change, poses_of
from kinematics_service.kinematics.uncertainty.parameters import (
    parameters_of,
    placement,
    scaled_jacobian,
)
from kinematics_service.rigid_motion import exponential, pose_of, rotation_vector
from kinematics_service.robot.file.parts.description import Tolerances
from kinematics_service.robot.file.parts.parameters import end_parameters

# Without noise parameters come back as exactly (m, rad).
EXACT = 1e-9
# A laser tracker's noise (m, rad).
NOISE = 5e-5
# Turning, sliding, coupled joints; seven joints; each convention.
KINDS = ('ur5e', 'panda', 'scara_hsr065', 'parallelogram_left', 'rrp_elementary')
KINDS += ('offset_stanford_shape',)
every_arm = pytest.mark.parametrize('name', DISTINCT_BUNDLED)
ten_arms = pytest.mark.parametrize('name', TEN)


def chain_of(robot):
    arm = parameters_of(robot)
    count = len(arm.table)
    return arm.table, placement(arm.chain, np.eye(4), np.eye(4), (count, count + 6))


def off(one, other):
    """Return how far poses are apart at most, m and rad."""
    R = one[:, :3, :3] @ np.swapaxes(other[:, :3, :3], 1, 2)
    return max(np.abs(one[:, :3, 3] - other[:, :3, 3]).max(), np.abs(rotation_vector(R)).max())


@pytest.mark.slow
@ten_arms
def test_corrections_of_a_chain_are_those_of_the_robot_file(name):
    arm = measured_arm(name, 4, size=10.0)
    table, chain = chain_of(arm.robot)
    base, tool = (
        end.motion.matrix for end in (arm.robot.description.base, arm.robot.description.tool)
    )
    poses = base @ poses_of(chain, np.concatenate([arm.errors, np.zeros(12)]), arm.q) @ tool
    assert off(poses, ks.forward_kinematics(arm.true, arm.q)) < ROUND_OFF


@pytest.mark.slow
@pytest.mark.parametrize('name', KINDS)
def test_poses_move_with_corrections_as_differences_say(name):
    arm = measured_arm(name, 4, size=10.0)
    _, chain = chain_of(arm.robot)
    values = np.concatenate([arm.errors, 0.01 * np.arange(12)])
    change = pose_change(chain, values, arm.q)
    for k in range(len(values)):
        step = np.zeros(len(values))
        step[k] = DIFFERENCE_STEP
        ahead, back = (poses_of(chain, values + s * step, arm.q) for s in (1.0, -1.0))
        turned = rotation_vector(ahead[:, :3, :3] @ np.swapaxes(back[:, :3, :3], 1, 2))
        moved = np.concatenate([(ahead - back)[:, :3, 3], turned], axis=1) / (2 * DIFFERENCE_STEP)
        assert np.abs(moved - change.jacobian[:, :, k]).max() < DIFFERENCE


@pytest.mark.slow
@every_arm
def test_the_parameters_are_as_many_as_theory_says(name):
    # Four for an axis that turns, two for one that slides, six for the base (Mooring, Roth and
    # Driels 1991). Of coupled joints every row counts that moves.
    robot = robot_of(name)
    table, chain = chain_of(robot)
    ends = [*end_parameters('base', 0), *end_parameters('tool', 0)]
    kinds = list(robot.joint_types)
    theory = 4 * kinds.count('revolute') + 2 * kinds.count('prismatic') + 6
    if name == 'parallelogram_left':
        theory += 2  # a fourth row moves, parallel to the others: its length, and its angle
    assert structural_rank(scaled_jacobian(robot, chain, [*table, *ends])) == theory


def test_an_extra_angle_stands_between_parallel_axes_alone():
    def extra(name):
        return [one.name for one in chain_of(robot_of(name))[0] if one.place in ('Ry', 'Ty')]

    assert extra('ur5e') == ['beta2', 'beta3']
    assert extra('puma560') == ['beta2']
    assert extra('panda') == []
    # Axes that coincide may also come apart along y.
    assert extra('six_joint_dh') == ['beta1', 'b1', 'beta3', 'beta4']


@pytest.mark.slow
@pytest.mark.parametrize('name', KINDS)
def test_without_noise_the_arm_is_found_exactly(name):
    arm = measured_arm(name, 40)
    found = ks.calibrate(arm.robot, arm.q, arm.poses, check=False)
    q = positions_within(arm.robot, 50, 9)
    assert off(predicted(found, q), truly(arm, q)) < EXACT
    told = found.singular_values[: found.known]
    assert found.known >= found.possible
    assert len(told) == found.known
    assert found.held_out.position_max < EXACT
    assert not found.outliers


@pytest.mark.slow
@pytest.mark.parametrize('name', ['panda', 'offset_stanford_shape'])
def test_with_noise_errors_are_within_their_deviations(name):
    arm = measured_arm(name, 50, NOISE, seed=3)
    found = ks.calibrate(arm.robot, arm.q, arm.poses, check=False)
    assert found.known == found.possible
    assert 0.7 * NOISE < found.noise.position < 1.4 * NOISE
    table = [one for one in found.parameters if one.group not in ('base', 'tool')]
    error = np.array([one.correction for one in table]) - arm.errors
    beyond = np.abs(error) > 3.0 * np.array([one.deviation for one in table])
    assert np.sum(beyond) <= 1  # of one number in four hundred
    # Chi-square of as many numbers: all but one in a million.
    covariance = found.covariance[: len(table), : len(table)]
    assert error @ np.linalg.solve(covariance, error) < 2.2 * len(table) + 25.0


@pytest.mark.slow
def test_poses_that_nothing_was_fitted_to_are_as_far_off_as_the_deviations_say():
    # Chi-square over its number by Student's factor; bench/calibrate.py --few has 200 runs an arm.
    squares = []
    for name in ('puma560', 'ur5e', 'panda', 'scara_hsr065'):
        for seed in range(100, 102):
            arm = measured_arm(name, 15, NOISE, seed)
            found = ks.calibrate(arm.robot, arm.q, arm.poses, check=False)
            assert found.accepted
            assert not found.outliers
            squares.append(held_out_chi_square(arm, found, 20, NOISE, seed))
    # 0.8 to 1.2 is required of the mean over 200 fits of each arm; that of eight scatters by 0.09.
    assert abs(np.mean(squares) - 1.0) < 3.0 * 0.08


@pytest.mark.parametrize(
    ('name', 'count', 'noise', 'told'),
    [
        ('panda', 10, None, False),
        ('kuka_iiwa14', 9, None, False),
        ('panda', 10, (NOISE, NOISE), True),
        ('panda', 16, None, True),
    ],
)
def test_a_noise_that_is_assumed_is_said_to_be(name, count, noise, told):
    # 30 numbers for 41 parameters leave none that tells how far they scatter.
    arm = measured_arm(name, count, NOISE, seed=5)
    found = ks.calibrate(arm.robot, arm.q, arm.poses[:, :3, 3], noise=noise, check=False)
    sentences = '. '.join(sentences_of(found))
    assert ('is assumed' in sentences) == (not told)
    assert ('The noise, which' in sentences) == told


def test_positions_alone_tell_all_but_the_last_orientation():
    arm = measured_arm('ur5e', 60)
    found = ks.calibrate(arm.robot, arm.q, arm.poses[:, :3, 3])
    q = positions_within(arm.robot, 50, 9)
    assert found.positions
    assert found.known >= found.possible == 27
    assert np.abs(predicted(found, q) - truly(arm, q))[:, :3, 3].max() < EXACT


def test_what_cannot_be_told_apart_is_named():
    arm = measured_arm('ur5e', 40, NOISE)
    found = ks.calibrate(arm.robot, arm.q, arm.poses, check=False)
    sums = [one.sentence.removeprefix('only ').partition(' is ')[0] for one in found.combinations]
    assert sums == [
        'theta1 + base.rz',
        'd1 + base.z',
        'd2 + d3 + d4',
        'theta6 + tool.rz',
        'd6 + tool.z',
        'a6 + tool.x',
        'alpha6 + tool.rx',
    ]
    unknown = sum(len(one.names) - one.determined for one in found.combinations)
    assert len(found.parameters) - unknown == found.possible == 30
    assert set(found.not_identifiable) == {
        name for one in found.combinations for name in one.names
    } - {name for name in found.corrections if '.' in name}
    # What is not told stays at its nominal value: the base has the wider prior by far.
    assert abs(found.corrections['theta1']) < 1e-6


def test_outliers_are_named_by_row_and_do_not_count():
    arm = measured_arm('puma560', 80, NOISE)
    poses = arm.poses.copy()
    bad = [3, 17, 29, 40, 41, 55, 62, 79]
    poses[bad, :3, 3] += 0.03 * np.random.default_rng(1).normal(size=(8, 3))
    found = ks.calibrate(arm.robot, arm.q, poses, check=False)
    assert sorted(found.outliers) == bad
    q = positions_within(arm.robot, 50, 9)
    assert off(predicted(found, q), truly(arm, q)) < 10 * NOISE


@pytest.mark.slow
@pytest.mark.parametrize('count', [4])
def test_few_poses_never_make_the_arm_worse_than_its_table(count):
    for seed in (0,):
        arm = measured_arm('ur5e', count, NOISE, seed)
        q = positions_within(arm.robot, 60, 99)
        found = ks.calibrate(arm.robot, arm.q, arm.poses, check=False)
        plain = ks.calibrate(arm.robot, arm.q, arm.poses, fit=['base', 'tool'], check=False)
        error, before = (
            np.sqrt(np.mean((predicted(one, q) - truly(arm, q))[:, :3, 3] ** 2))
            for one in (found, plain)
        )
        assert error < before
        assert np.abs(list(found.corrections.values())).max() < 0.5


def test_base_and_tool_stay_as_in_the_file_where_they_are_fixed():
    arm = measured_arm('ur5e', 40, NOISE, base=np.eye(4), tool=np.eye(4))
    found = ks.calibrate(arm.robot, arm.q, arm.poses, fix=['base', 'tool'], check=False)
    assert np.array_equal(found.base_offsets[0], np.eye(4))
    assert np.array_equal(found.tool_offsets[0], np.eye(4))
    # Now the first and last numbers of the table are told, too.
    assert [one.names for one in found.combinations] == [('d2', 'd3', 'd4')]
    assert abs(found.corrections['theta1'] - arm.errors[0]) < 3e-4


@pytest.mark.slow
def test_sets_have_bases_or_tools_of_their_own():
    arm = measured_arm('puma560', 60, NOISE)
    other = pose_of([-2.0, 0.3, 1.0], (0.5, -0.4, 1.0))
    poses = arm.poses.copy()
    poses[30:] = other @ np.linalg.inv(BASE) @ poses[30:]
    sets = np.repeat([0, 1], 30)
    found = ks.calibrate(arm.robot, arm.q, poses, sets=sets, check=False)
    assert (
        np.abs(found.base_offsets[1] @ np.linalg.inv(found.base_offsets[0]) @ BASE - other).max()
        < 2e-3
    )
    assert found.held_out.position_rms < 3 * NOISE
    assert found.known == found.possible == 36
    both = ks.calibrate(arm.robot, arm.q, poses, sets=sets, own=['base', 'tool'], check=False)
    assert both.held_out.position_rms < 3 * NOISE


def test_the_prior_of_a_group_decides_what_stays():
    arm = measured_arm('ur5e', 30, NOISE)
    own = {'lengths': 1e-9, 'theta3': 0.1}
    found = ks.calibrate(arm.robot, arm.q, arm.poses, tolerances=own, check=False)
    priors = {one.name: one.prior for one in found.parameters}
    assert (priors['a2'], priors['theta3'], priors['theta2']) == (1e-9, 0.1, np.radians(0.2))
    assert abs(found.corrections['a2']) < 1e-8


def with_tolerance(name, text):
    return ks.robot_from_text(ks.bundled_robots()[name].read_text() + f'\ntolerance: {text}\n')


@pytest.mark.slow
def test_what_is_identifiable_is_so_beside_the_tolerance_it_was_given():
    wide = CalibratedParameter('theta2', 'offsets', True, 1, 'theta', 0.02, 0.01, 0.17)
    assert wide.identifiable
    assert not replace(wide, prior=0.02).identifiable
    # Of a base nothing is known before; it is measured by a usual error.
    assert not replace(wide, name='base.rz', group='base', prior=1.0).identifiable


def test_the_robot_file_says_how_far_its_numbers_may_be_off():
    arm = measured_arm('ur5e', 30, NOISE)
    robot = with_tolerance('ur5e', '{length: 0.3e-3, of: {d1: 2e-3, theta3: 1e-9, beta5: 0.1}}')
    found = ks.calibrate(robot, arm.q, arm.poses, check=False)
    priors = {one.name: one.prior for one in found.parameters}
    assert (priors['a2'], priors['d1'], priors['theta3']) == (0.3e-3, 2e-3, 1e-9)
    assert priors['theta2'] == np.radians(0.2)  # nothing is said of angles
    assert abs(found.corrections['theta3']) < 1e-8
    (remark,) = found.remarks
    assert 'tolerance of beta5' in remark
    # What the call says holds instead.
    own = {'lengths': 1e-4}
    found = ks.calibrate(robot, arm.q, arm.poses, tolerances=own, check=False)
    priors = {one.name: one.prior for one in found.parameters}
    assert (priors['a2'], priors['d1'], priors['theta3']) == (1e-4, 1e-4, 1e-9)


def test_what_is_proposed_depends_on_the_tolerances_of_the_robot_file():
    robot = with_tolerance('craig_3r', '{length: 1e-6, angle: 1e-6, of: {theta3: 0.02}}')
    proposed, usual = (ks.propose_poses(one, 2) for one in (robot, robot_of('craig_3r')))
    before = dict(zip(proposed.names, proposed.before.tolist()))
    assert (before['a2'], before['theta2'], before['theta3']) == pytest.approx((1e-6, 1e-6, 0.02))
    assert not np.array_equal(proposed.q, usual.q)


def test_a_calibrated_table_has_no_tolerances_of_the_nominal_one():
    robot = with_tolerance('ur5e', '{length: 2e-3, of: {a2: 1e-4}}')
    arm = measured_arm('ur5e', 20, NOISE)
    found = ks.calibrate(robot, arm.q, arm.poses, check=False)
    assert found.calibrated.description.tolerances == Tolerances()
    text = (
        ks.bundled_robots()['ur5e'].read_text() + '\ntolerance: {length: 2e-3, of: {a2: 1e-4}}\n'
    )
    origin = CalibrationOrigin('made up', '2026-01-01')
    assert '\ntolerance:' not in calibrated_text(found, text, arm.q, arm.poses, origin)


# Gear ratios


def geared_arm(name, count, noise=0.0):
    """Return a measured arm whose gear ratios are off, too, and its errors by name."""
    arm = measured_arm(name, count, noise, gears=True)
    return arm, {one.name: float(error) for one, error in zip(arm.parameters, arm.errors)}


@pytest.mark.slow
@pytest.mark.parametrize('name', KINDS)
def test_poses_move_with_gear_ratios_as_differences_say(name):
    arm, _ = geared_arm(name, 4)
    chain, errors = parameters_of(arm.robot, gears=True).chain, arm.errors
    change = pose_change(chain, errors, arm.q)
    for k in (k for k, one in enumerate(arm.parameters) if one.group == 'gears'):
        step = DIFFERENCE_STEP * (np.arange(len(errors)) == k)
        ahead, back = (poses_of(chain, errors + s * step, arm.q) for s in (1.0, -1.0))
        turned = rotation_vector(ahead[:, :3, :3] @ np.swapaxes(back[:, :3, :3], 1, 2))
        moved = np.concatenate([(ahead - back)[:, :3, 3], turned], axis=1) / (2 * DIFFERENCE_STEP)
        assert np.abs(moved - change.jacobian[:, :, k]).max() < DIFFERENCE


@pytest.mark.slow
@pytest.mark.parametrize('name', ['scara_hsr065', 'parallelogram_left'])
def test_gear_ratios_are_found_where_they_are_asked_for(name):
    arm, true = geared_arm(name, 30)
    found = ks.calibrate(arm.robot, arm.q, arm.poses, fit=['all'], check=False)
    plain = ks.calibrate(arm.robot, arm.q, arm.poses, check=False)
    gears = [one for one in found.parameters if one.group == 'gears']
    assert found.possible == plain.possible + len(gears) == plain.possible + arm.robot.dof
    assert not any(one.group == 'gears' for one in plain.parameters)
    assert max(abs(one.correction - true[one.name]) for one in gears) < EXACT
    assert all(one.identifiable and one.prior == 1e-3 for one in gears)
    q = positions_within(arm.robot, 50, 9)
    assert (
        off(predicted(found, q), truly(arm, q)) < EXACT < off(predicted(plain, q), truly(arm, q))
    )


@pytest.mark.slow
def test_with_noise_gear_ratios_are_within_their_deviations():
    arm, true = geared_arm('puma560', 60, NOISE)
    found = ks.calibrate(arm.robot, arm.q, arm.poses, fit=['all'], check=False)
    for one in found.parameters:
        if one.group == 'gears':
            assert abs(one.correction - true[one.name]) < 3.0 * one.deviation < 1e-3
    one = ks.calibrate(arm.robot, arm.q, arm.poses, fit=['gear2', 'base', 'tool'], check=False)
    assert [each.name for each in one.parameters if each.group == 'gears'] == ['gear2']
    # What goes on from a calibration takes its gears along.
    among = arm.q[:5]
    proposed = ks.propose_poses(arm.robot, 1, found, among=among)
    assert proposed.names == tuple(found.corrections)
    covariance = ks.pose_covariance(found.calibrated, arm.q[0], calibration=found)
    assert np.all(np.linalg.eigvalsh(covariance) > 0.0)


def test_axes_that_are_nearly_parallel_get_an_extra_angle_and_no_length_of_kilometres():
    text = ks.bundled_robots()['ur5e'].read_text().split('singularity:')[0]
    assert '{a: a2, alpha: 0, ' in text
    for off_parallel in (1e-4, 1e-2, 1e-3):
        alpha = f'{{a: a2, alpha: {off_parallel}, '
        robot = ks.robot_from_text(text.replace('{a: a2, alpha: 0, ', alpha))
        table = parameters_of(robot).table
        assert [one.name for one in table if one.place == 'Ry'] == ['beta2', 'beta3']
    arm = measured_arm('ur5e', 40, NOISE)
    found = ks.calibrate(robot, arm.q, arm.poses, check=False)
    assert found.held_out.position_rms < 3.0 * NOISE
    of_table = [one for one in found.parameters if one.group not in ('base', 'tool')]
    assert max(abs(one.correction) for one in of_table) < 0.02


# The poses to measure next


def errors_with(q, seeds=2):
    # RMS over poses of the arm of what a calibration by these joint positions leaves, m.
    squares = []
    for seed in range(seeds):
        arm = measured_arm('ur5e', 1, seed=seed)
        random = np.random.default_rng(seed)
        poses = truly(arm, q)
        poses[:, :3, 3] += NOISE * random.normal(size=(len(q), 3))
        poses[:, :3, :3] = exponential(NOISE * random.normal(size=(len(q), 3))) @ poses[:, :3, :3]
        found = ks.calibrate(arm.robot, q, poses, check=False)
        others = positions_within(arm.robot, 50, 99)
        squares.append((predicted(found, others) - truly(arm, others))[:, :3, 3] ** 2)
    return np.sqrt(3.0 * np.mean(squares))


@pytest.mark.slow
def test_proposed_poses_tell_more_than_random_ones():
    robot = robot_of('ur5e')
    proposed = ks.propose_poses(robot, 8)
    assert np.all(np.asarray(ks.singularity(robot, proposed.q).level) == ks.Level.OK)
    assert np.all(proposed.q > robot.limits[:, 0])
    assert np.all(proposed.q < robot.limits[:, 1])
    assert np.all(proposed.after <= proposed.before + 1e-12)
    assert errors_with(proposed.q) < 0.8 * errors_with(positions_within(robot, 8, 5))


@pytest.mark.slow
def test_positions_chosen_among_many_tell_more_than_the_first_ones():
    robot = robot_of('ur5e')
    # A part of the room, as an instrument sees it, each position twice.
    many = np.repeat(0.2 + 0.3 * positions_within(robot, 150, 21), 2, axis=0)
    proposed = ks.propose_poses(robot, 10, among=many)
    assert np.array_equal(proposed.q, many[proposed.rows])
    assert len(np.unique(proposed.q, axis=0)) == 10
    assert errors_with(proposed.q) < 0.8 * errors_with(many[:20:2])


def test_poses_are_proposed_from_which_the_tool_faces_the_instrument():
    robot = robot_of('ur5e')
    point, axis = np.array([2.0, 0.5, 1.0]), np.array([1.0, 0.0, 1.0])
    sight = ks.LineOfSight(point, math.radians(30.0), axis)
    poses = ks.forward_kinematics(robot, ks.propose_poses(robot, 12, line_of_sight=sight).q)
    for pose in poses:
        way = pose[:3, :3].T @ (point - pose[:3, 3])
        assert math.degrees(math.acos(way @ axis / np.linalg.norm(way) / math.sqrt(2.0))) < 30.0
    # By hand: a planar arm's z axis never faces a point in its plane, its x axis one ahead.
    planar, q = robot_of('planar_2r'), [[0.0, 0.5], [math.pi, 0.5]]
    ahead = ks.LineOfSight((5.0, 0.0, 0.0), math.radians(40.0), (1, 0, 0))
    assert ks.propose_poses(planar, 1, among=q, line_of_sight=ahead).rows.tolist() == [0]
    with refused(ks.CalibrationError, 'too-few', 'only 0', 'faces'):
        ks.propose_poses(planar, 1, among=q, line_of_sight=ahead._replace(axis=(0, 0, 1)))


@pytest.mark.parametrize(
    ('among', 'code', 'word'),
    [
        (np.zeros((5, 2)), 'too-few', 'only 1'),
        (np.zeros((0, 2)), 'too-few', 'only 0'),
        (np.zeros((5, 3)), 'wrong-shape', '(N, 2)'),
        (np.zeros(2), 'wrong-shape', 'not (2,)'),
        ([[0.0, math.nan]], 'not-finite', 'among'),
    ],
)
def test_positions_that_cannot_be_chosen_among_are_refused(among, code, word):
    with refused(ks.CalibrationError, code, word):
        ks.propose_poses(robot_of('planar_2r'), 2, among=among)


def test_no_pose_is_proposed_twice():
    # One sliding joint: all poses tell of the same few numbers.
    robot = ks.robot_from_text(
        'robot: rail\nconvention: standard\n'
        'joints: [{name: s, type: prismatic, limits: [0, 1]}]\n'
        'links: [{theta: 0, d: s, a: 0, alpha: 0}]\n'
    )
    q = ks.propose_poses(robot, 6).q
    assert len(np.unique(np.round(q, 6), axis=0)) == 6


def test_proposed_poses_go_on_from_what_is_known():
    arm = measured_arm('ur5e', 8, NOISE)
    found = ks.calibrate(arm.robot, arm.q, arm.poses, check=False)
    proposed = ks.propose_poses(arm.robot, 3, found)
    deviations = {one.name: one.deviation for one in found.parameters}
    assert np.allclose(proposed.before, [deviations[name] for name in proposed.names], rtol=1e-6)
    assert np.prod(proposed.after / proposed.before) < 1e-4
    again = ks.propose_poses(arm.robot, 3, found)
    assert np.array_equal(again.q, proposed.q)
    for count in (0, 201):
        with refused(ks.CalibrationError, 'out-of-range', f'count: {count}', '200'):
            ks.propose_poses(arm.robot, count)


@pytest.mark.timeout(60)
def test_poses_are_proposed_after_a_few_poses_along_a_motion():
    # Directions are measured to 1e-9 rad while numbers are unknown: the information's condition
    # is 1e20, and the gains of two exchanges were positive in turn without end.
    arm, random = measured_arm('ur5e', 1), np.random.default_rng(5)
    t = np.arange(27) / 10.0
    swing = np.sin([0.9, 0.7, 1.1, 1.3, 0.8, 1.2] * t[:, None] + np.arange(6))
    q = [0.2, -1.2, 1.3, -1.0, 1.0, 0.3] + 1.1 * swing
    poses = truly(arm, q)
    poses[:, :3, 3] += NOISE * random.normal(size=(27, 3))
    found = ks.calibrate(arm.robot, q, poses, check=False)
    assert found.known < found.possible
    proposed = ks.propose_poses(arm.robot, 3, found)
    assert len(np.unique(proposed.q, axis=0)) == 3
    assert np.prod(proposed.after / proposed.before) < 0.1


@pytest.mark.parametrize('name', ['scara_hsr065', 'rrp_elementary', 'planar_2r'])
def test_every_kind_of_arm_gets_proposals(name):
    proposed = ks.propose_poses(robot_of(name), 3, positions=name == 'scara_hsr065')
    assert proposed.q.shape == (3, robot_of(name).dof)
    assert ('tool.rx' in proposed.names) == (name != 'scara_hsr065')


# What is refused


def refuses(code, robot, q, poses, *words, **options):
    """Fail unless a calibration is refused with a code, and with words in the sentence."""
    with refused(ks.CalibrationError, code, *words):
        ks.calibrate(robot, q, poses, **options)


@pytest.fixture(scope='module')
def arm():
    return measured_arm('ur5e', 50, NOISE)


def test_mirrored_axes_are_refused(arm):
    poses = arm.poses.copy()
    poses[:, :3, 0] *= -1.0
    refuses('mirrored', arm.robot, arm.q, poses)
    refuses('mirrored', arm.robot, arm.q, arm.poses[:, :3, 3] * [1.0, 1.0, -1.0])
    # With orientations that are rotations: those of the arm, or of axes that are left-handed.
    poses = arm.poses.copy()
    poses[:, 1, 3] *= -1.0
    left_handed = np.diag([1.0, -1.0, 1.0, 1.0])
    for given in (poses, left_handed @ arm.poses @ left_handed):
        refuses('mirrored', arm.robot, arm.q[::3], given[::3], 'positions', 'undone')


def test_degrees_are_refused(arm):
    for poses in (arm.poses, arm.poses[:, :3, 3]):
        q = np.degrees(arm.q[::3])
        refuses('wrong-unit', arm.robot, q, poses[::3], 'degrees', '--joint-format deg')


def test_millimetres_are_refused(arm):
    poses = arm.poses.copy()
    poses[:, :3, 3] *= 1e3
    for given in (poses, poses[:, :3, 3]):
        refuses('wrong-unit', arm.robot, arm.q[::3], given[::3], 'millimetres', '--pose-format mm')


def test_another_robot_is_refused(arm):
    for poses in (arm.poses, arm.poses[:, :3, 3]):
        refuses('another-robot', robot_of('ur3e'), arm.q[::3], poses[::3], 'ur3e')


def test_too_few_poses_and_poses_that_are_all_alike_are_refused(arm):
    refuses('too-few', arm.robot, arm.q[:2], arm.poses[:2], '2 poses')
    alike = np.tile(arm.q[0], (20, 1)), np.tile(arm.poses[:1], (20, 1, 1))
    refuses('no-variation', arm.robot, *alike)
    twice = np.tile(arm.q[:2], (9, 1)), np.tile(arm.poses[:2], (9, 1, 1))
    refuses('too-few', arm.robot, *twice, '18 poses', '2 different')
    found = ks.calibrate(arm.robot, arm.q[:8], arm.poses[:8], check=False)
    assert 'the priors decide' in found.remarks[0]


@pytest.mark.parametrize('order', [np.repeat, np.tile])
def test_repeated_poses_are_held_out_together(order):
    arm = measured_arm('ur5e', 4)
    rows = order(np.arange(4), 10)
    random = np.random.default_rng(5)
    poses = arm.poses[rows]
    poses[:, :3, 3] += NOISE * random.normal(size=(40, 3))
    q = arm.q[rows] + 1e-4 * random.uniform(size=(40, 6))
    found = ks.calibrate(arm.robot, q, poses, check=False)
    # Three poses do not foretell the fourth one.
    assert found.held_out.position_rms > 1e-3
    assert found.remarks[0].startswith('4 different poses of 40')


def test_sessions_of_a_row_each_are_held_out_one_after_the_other(arm):
    names = [f'day{k}' for k in range(12)]
    found = ks.calibrate(arm.robot, arm.q[:12], arm.poses[:12], sessions=names, check=False)
    # Other days tell the table, but not the drift of a day that is held out.
    assert 5 * NOISE < found.held_out.position_rms < 0.5 * found.held_out_before.position_rms


def test_three_positions_are_taken_for_no_mistake_that_brings_them_together():
    arm = measured_arm('ur5e', 3, NOISE, 1)
    ks.calibrate(arm.robot, arm.q, arm.poses[:, :3, 3])


def measured_true(arm, q):
    """Return poses with noise of an arm whose joints are at q."""
    poses = BASE @ ks.forward_kinematics(arm.true, q) @ TOOL
    poses[:, :3, 3] += NOISE * np.random.default_rng(6).normal(size=(len(q), 3))
    return poses


@pytest.mark.parametrize(('name', 'j'), [('ur5e', 0), ('scara_hsr065', 2)])
def test_a_joint_that_hardly_moves_is_named_with_its_range(name, j):
    arm = measured_arm(name, 40)
    q = arm.q.copy()
    q[:, j] = 0.1 + 1e-3 * np.linspace(0.0, 1.0, 40)[np.random.default_rng(3).permutation(40)]
    found = ks.calibrate(arm.robot, q, measured_true(arm, q), check=False)
    moved = '1 mm' if arm.robot.prismatic[j] else '0.0573 deg'
    (said,) = (one for one in found.remarks if 'too little' in one)
    assert f'{arm.robot.joint_names[j]} (by {moved})' in said
    if not arm.robot.prismatic[j]:
        assert f'a{j + 1}' in found.not_identifiable
    found = ks.calibrate(arm.robot, arm.q, measured_true(arm, arm.q), check=False)
    assert not any('too little' in one or 'gear ratio' in one for one in found.remarks)


@pytest.mark.parametrize('j', [5])
def test_a_gear_ratio_that_is_off_is_remarked_on_by_its_joint(j):
    arm = measured_arm('ur5e', 40)
    off = arm.q.copy()
    off[:, j] *= 1.002
    poses = measured_true(arm, off)
    found = ks.calibrate(arm.robot, arm.q, poses, check=False)
    (said,) = (one for one in found.remarks if 'gear ratio' in one)
    assert f'of joint {arm.robot.joint_names[j]}, ' in said
    assert 'off by 0.2 %' in said
    found = ks.calibrate(arm.robot, arm.q, poses, fit=['all'], check=False)
    assert found.noise.position < 1.5 * NOISE
    assert not any('gear ratio' in one for one in found.remarks)


def test_a_base_that_is_not_fitted_is_not_said_to_be(arm):
    away = arm.poses.copy()
    away[:, 0, 3] += 3.0
    given = arm.robot, arm.q[::3], away[::3]
    refuses('another-robot', *given, 'fit base and tool too', fit=['a2'])
    refuses('another-robot', *given, 'with base as in', fix=['base'])


def test_arrays_that_do_not_fit_are_refused(arm):
    given = arm.robot, arm.q, arm.poses
    refuses('wrong-shape', arm.robot, arm.q[:, :5], arm.poses, '(N, 6)')
    refuses('not-finite', arm.robot, arm.q * np.nan, arm.poses)
    refuses('wrong-shape', *given, 'qdot', '(50, 6)', qdot=arm.q[:, :5])
    refuses('not-finite', *given, 'qdot', qdot=arm.q * np.nan)
    refuses('unknown-parameter', *given, "'bse'", 'a2', fit=['bse'])
    refuses('empty', *given, 'fit', fit=['a2'], fix=['lengths'])
    refuses('empty', *given, 'fit', fix=['all'])
    refuses('unknown-name', *given, "own: 'arm'", own=['arm'])
    refuses('out-of-range', *given, 'sets', 'from 0', sets=np.full(50, 3))
    refuses('out-of-range', *given, 'a2', tolerances={'a2': 0.0}, check=False)
    refuses('conflict', *given, 'same_point', apart={('A', 'B'): 1.0})


# A real robot


def test_the_factory_calibration_of_a_ur3e_is_found_to_the_last_printed_digit():
    file = recorded('ur3e_rad') / 'rad_ur3e_25hz.csv'
    table = np.genfromtxt(file, delimiter=',', names=True, dtype=None, encoding='utf-8')
    q, pose = (
        np.column_stack([table[f'{name}_{k}'] for k in range(6)])
        for name in ('actual_q', 'actual_TCP_pose')
    )
    poses = np.tile(np.eye(4), (len(q), 1, 1))
    poses[:, :3, 3], poses[:, :3, :3] = pose[:, :3], exponential(pose[:, 3:])
    found = ks.calibrate(robot_of('ur3e'), q, poses, fix=['base'])
    # Nominal, with the tool fitted, 0.42 mm; nine printed digits are left of blocks of time that
    # nothing was fitted to.
    assert 3e-4 < found.held_out_before.position_rms < 6e-4
    assert found.held_out.position_rms < 2e-9
    assert found.known == found.possible == 26


def test_a_calibration_is_frozen(arm):
    found = ks.calibrate(arm.robot, arm.q, arm.poses, check=False)
    with pytest.raises(ValueError, match='read-only'):
        found.covariance[0, 0] = 0.0
