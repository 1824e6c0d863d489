# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
What is no calibration is refused and explained, and what is one is not.

Each wrong thing is made by hand here: the calibration does not know its name.
"""

import json
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from arms import robot_of
from calibrated_arms import (
    BASE,
    TOOL,
    measured_arm,
    positions_within,
    touching_arm,
    true_arm,
)
from refusal import refused
from scipy.spatial.transform import Rotation

import kinematics_service as ks
from kinematics_service.apps.calibration.acceptance import JudgedFit, refusals_of
from kinematics_service.apps.calibration.checking import measured
from kinematics_service.apps.calibration.explanations import (
    TriedCalibration,
    explained,
    misfits_of_poses,
    mistakes_of,
)
from kinematics_service.apps.calibration.placing import Free, offsets_of
from kinematics_service.apps.calibration.report import document_of, sentences_of
from kinematics_service.apps.calibration.robot_text import CalibrationOrigin, calibrated_text
from kinematics_service.apps.checking.errors import Errors
from kinematics_service.apps.checking.hypotheses import Hypothesis
from kinematics_service.apps.checking.known_poses import pose_errors
from kinematics_service.errors import CalibrationError
from kinematics_service.printing import json_text
from kinematics_service.rigid_motion import exponential, pose_of

NOISE = 5e-5
# Six joints, seven, a SCARA, coupled joints, each convention.
RIGHT = ('puma560', 'kuka_iiwa14', 'scara_hsr065', 'parallelogram_left', 'rrp_elementary')
RIGHT += ('offset_stanford_shape',)
MADE_UP = CalibrationOrigin('made up', '2026-01-01')


def measured_at(name, q, seed, size=0.3, noise=NOISE):
    """Return poses with noise of an arm with errors at joint positions."""
    _, _, true = true_arm(name, seed, size)
    random = np.random.default_rng([seed, 8])
    poses = BASE @ ks.forward_kinematics(true, q) @ TOOL
    poses[:, :3, 3] += noise * random.normal(size=(len(q), 3))
    poses[:, :3, :3] = exponential(noise * random.normal(size=(len(q), 3))) @ poses[:, :3, :3]
    return poses


def without_coupling(name, j, i, sign, moving, count, seed):
    """
    Return an arm, joint positions and poses, as if joint j turned with joint i by the encoders.

    Joint i is at 0 but in the last `moving` rows.
    """
    robot = measured_arm(name, 1).robot
    q = positions_within(robot, count, seed)
    q[: count - moving, i] = 0.0
    poses = measured_at(name, q, seed)
    q[:, j] -= sign * q[:, i]
    return robot, q, poses


@pytest.mark.slow
@pytest.mark.parametrize(
    ('name', 'j', 'i', 'sign', 'kind'),
    [
        ('puma560', 2, 1, 1.0, 'poses'),
        ('ur5e', 2, 1, -1.0, 'positions'),
    ],
)
def test_rows_in_which_one_joint_moves_contradict_the_arm(name, j, i, sign, kind):
    # Six rows of 66 are fewer than a tenth.
    robot, q, poses = without_coupling(name, j, i, sign, 6, 66, 4)
    found = ks.calibrate(robot, q, poses if kind == 'poses' else poses[:, :3, 3])
    assert not found.accepted
    assert sorted(found.outliers) == list(range(60, 66))
    joint, other = (robot.joint_names[k] for k in (i, j))
    assert f'joint {joint} is' in found.refusals[0]
    assert found.explained.decided
    (sentence,) = found.explained.sentences
    assert f'{other} turns with joint {joint}' in sentence
    assert f'needs {robot.variables[j]} {"+" if sign > 0.0 else "-"} {robot.variables[i]}' in (
        sentence
    )
    # With and without these rows, before anything else.
    sentences = list(sentences_of(found))
    assert 'contradict the arm where joint' in sentences[0]
    assert sentences[1].startswith('What explains it: joint')
    assert found.without.after.position_rms < 3e-4 < 4e-3 < found.with_outliers.after.position_rms
    assert found.with_outliers.held_out.position_rms > 4e-3
    assert any(one.startswith('With the outliers') for one in sentences)
    document = json.loads(json_text(document_of(found, [])))
    assert document['accepted'] is False
    assert document['explained']['decided'] is True
    if kind == 'positions':
        return
    # Known poses are those of all rows.
    text = ks.bundled_robots()[name].read_text()
    made = calibrated_text(found, text, q, poses, MADE_UP, anyway=True)
    assert max(error.share for error in pose_errors(ks.robot_from_text(made))) > 1.0
    assert document['errors_with_outliers']['after']['position_rms'] > 4e-3


def test_a_coupling_that_all_rows_lack_is_named_before_a_fit():
    robot, q, poses = without_coupling('ur5e', 2, 1, 1.0, 30, 30, 3)
    words = f'turns with joint {robot.joint_names[1]}: ', 'needs q3 + q2'
    with refused(CalibrationError, 'joint-coupling', *words):
        ks.calibrate(robot, q, poses)
    with refused(CalibrationError, 'another-robot', 'What explains it', *words):
        ks.calibrate(robot, q, poses[:, :3, 3])


def test_touches_of_joints_that_turn_together_are_explained():
    arm = touching_arm('ur5e', (('A', (0.4, 0.2, 0.1)), ('B', (-0.3, 0.4, 0.3))), 25, NOISE)
    q = arm.q.copy()
    q[:, 2] += q[:, 1]
    with refused(CalibrationError, 'another-robot', 'joint elbow', 'q3 - q2: '):
        ks.calibrate(arm.robot, q, same_point=arm.marks)
    assert ks.calibrate(arm.robot, arm.q, same_point=arm.marks, check=False).accepted


@pytest.mark.parametrize('written', ['XYZ', 'ZYZ'])
def test_angles_in_another_order_are_no_calibration(written):
    arm = measured_arm('ur5e', 40, NOISE, seed=3)
    wrong = arm.poses.copy()
    angles = Rotation.from_matrix(wrong[:, :3, :3]).as_euler(written)
    wrong[:, :3, :3] = Rotation.from_euler('xyz', angles).as_matrix()
    with refused(CalibrationError, 'angle-order', f'--pose-format {written})'):
        ks.calibrate(arm.robot, arm.q, wrong, read='rpy')
    if written == 'ZYZ':
        return
    # What nobody asked about is refused as well, by what remains of the orientations.
    found = ks.calibrate(arm.robot, arm.q, wrong, check=False)
    assert any('deg remain' in one for one in found.refusals)
    text = ks.bundled_robots()['ur5e'].read_text()
    with refused(CalibrationError, 'not-accepted', 'deg remain'):
        calibrated_text(found, text, arm.q, wrong, MADE_UP)
    made = calibrated_text(found, text, arm.q, wrong, MADE_UP, anyway=True)
    assert made.startswith('# NO CALIBRATION, written anyway: ')
    # The file does not agree with itself: no instrument is off by as much.
    known = ks.robot_from_text(made).description.known_poses
    assert max(one.tolerance_rpy for one in known) < np.radians(2.01)  # two digits


@pytest.mark.slow
@pytest.mark.parametrize(
    ('seed', 'number', 'wrong'), [(0, '-0.425', '-0.725'), (1, '0.1333', '0.4333')]
)
def test_a_length_that_is_wrong_by_300_mm_is_refused_however_little_the_arm_moves(
    seed, number, wrong
):
    text = ks.bundled_robots()['ur5e'].read_text().partition('singularity:')[0]
    assert number in text
    robot = ks.robot_from_text(text.replace(number, wrong))
    random = np.random.default_rng(seed)
    middle, reach = [0.2, -1.2, 1.4, -1.7, -1.5, 0.3], [0.15, 0.1, 0.1, 0.1, 0.2, 0.3]
    q = np.array(middle) + random.uniform(-1, 1, (36, 6)) * reach
    poses = measured_at('ur5e', q, seed)
    # What a frame check would say of few motions does not matter here.
    found = ks.calibrate(robot, q, poses if seed else poses[:, :3, 3], check=False)
    assert not found.accepted
    assert 'less than 4 mm' in found.refusals[-1]


@pytest.mark.parametrize(('count', 'seed'), [(30, 0)])
def test_two_bad_rows_are_left_out_and_named_without_refusal(count, seed):
    arm = measured_arm('puma560', count, NOISE, seed=seed)
    poses = arm.poses.copy()
    random = np.random.default_rng(seed)
    bad = sorted(random.choice(count, 2, replace=False).tolist())
    poses[bad, :3, 3] += random.normal(size=(2, 3)) * 0.3
    found = ks.calibrate(arm.robot, arm.q, poses, check=False)
    assert found.accepted
    assert sorted(found.outliers) == bad
    assert any(one.startswith('2 outliers are left out') for one in sentences_of(found))
    assert found.with_outliers.after.position_rms > 0.01


@pytest.mark.parametrize(('off', 'accepted'), [(1e-3, True), (0.02, False)])
def test_more_than_a_tenth_left_out_is_refused_beyond_the_limits_of_audit(off, accepted):
    arm = measured_arm('puma560', 60, NOISE, seed=1)
    poses = arm.poses.copy()
    random = np.random.default_rng(5)
    bad = random.choice(60, 7, replace=False)
    poses[bad, :3, 3] += off * exponential(random.normal(size=(7, 3)))[:, 0]
    found = ks.calibrate(arm.robot, arm.q, poses, check=False)
    assert sorted(found.outliers) == sorted(bad.tolist())
    proposed = [one for one in found.remarks if '--noise 0.2mm,0.003deg' in one]
    assert (found.accepted, len(proposed)) == (accepted, accepted)
    if accepted:
        noise = (2e-4, np.radians(0.003))
        again = ks.calibrate(arm.robot, arm.q, poses, noise=noise, check=False)
        assert len(again.outliers) < 4
    else:
        assert found.refusals[0].startswith('7 of 60 poses')
    poses[bad[0]] = arm.poses[bad[0]]
    assert ks.calibrate(arm.robot, arm.q, poses, check=False).accepted


@pytest.mark.parametrize(('size', 'no_better'), [(1.0, False), (0.0, True)])
def test_a_calibration_that_is_no_better_than_the_table_says_so(size, no_better):
    # An arm that is its table gains nothing: what is written must say it.
    arm = measured_arm('ur5e', 20, NOISE, 3, size)
    found = ks.calibrate(arm.robot, arm.q, arm.poses, check=False)
    assert found.accepted
    text = ks.bundled_robots()['ur5e'].read_text()
    for lines in (sentences_of(found), certificate_of(found, text, arm).splitlines()):
        (line,) = [one for one in lines if 'held-out' in one]
        assert ('no better, within two' in line) == no_better
    assert document_of(found, [])['no_better'] == no_better


def certificate_of(found, text, arm):
    return calibrated_text(found, text, arm.q, arm.poses, MADE_UP)


def test_few_positions_again_and_again_do_not_judge_themselves():
    arm = measured_arm('ur5e', 3, seed=1)
    rows = np.repeat(np.arange(3), 14)
    positions = arm.poses[rows, :3, 3]
    positions += NOISE * np.random.default_rng(5).normal(size=positions.shape)
    found = ks.calibrate(arm.robot, arm.q[rows], positions, check=False)
    assert found.held_out.position_rms == pytest.approx(found.held_out_before.position_rms, 0.01)
    (refusal,) = found.refusals
    assert refusal.startswith('held-out positions do not judge')


@pytest.mark.parametrize(('kind', 'least'), [('poses', 4), ('positions', 5)])
def test_rows_that_do_no_more_than_place_base_and_tool_are_refused(kind, least):
    # Beside one held out, two poses or three positions leave no number for the table.
    for different, is_refused in ((least - 1, True), (least, False)):
        arm = measured_arm('ur5e', different, seed=1)
        rows = np.repeat(np.arange(different), 14)
        poses = arm.poses[rows]
        poses[:, :3, 3] += NOISE * np.random.default_rng(5).normal(size=(len(rows), 3))
        found = ks.calibrate(
            arm.robot, arm.q[rows], poses if kind == 'poses' else poses[:, :3, 3], check=False
        )
        assert (not found.accepted, found.only_worse) == (is_refused, is_refused)


@pytest.mark.slow
@pytest.mark.parametrize(
    ('name', 'seed', 'count', 'noise'),
    [(name, *((20, 12, NOISE), (21, 40, 1e-3))[k % 2]) for k, name in enumerate(RIGHT)],
)
def test_right_tables_are_accepted(name, seed, count, noise):
    arm = measured_arm(name, count, noise, seed)
    found = ks.calibrate(arm.robot, arm.q, arm.poses)
    assert found.accepted, found.refusals


def test_an_instrument_that_leaves_more_says_so():
    arm = measured_arm('ur5e', 60, seed=2)
    random = np.random.default_rng(3)
    poses = arm.poses.copy()
    poses[:, :3, 3] += 4e-3 * random.normal(size=(60, 3))
    poses[:, :3, :3] = exponential(8e-3 * random.normal(size=(60, 3))) @ poses[:, :3, :3]
    assert not ks.calibrate(arm.robot, arm.q, poses, check=False).accepted
    found = ks.calibrate(arm.robot, arm.q, poses, noise=(4e-3, 8e-3), check=False)
    assert found.accepted
    # It is no less than stated, and more where more remains.
    assert found.noise.position >= 4e-3
    found = ks.calibrate(arm.robot, arm.q, poses, noise=(1e-5, 1e-5), check=False)
    assert 3e-3 < found.noise.position < 5e-3
    assert not found.accepted


def test_tolerances_of_known_poses_are_those_of_the_noise():
    arm = measured_arm('ur5e', 30, 2e-4, seed=2)
    found = ks.calibrate(arm.robot, arm.q, arm.poses, check=False)
    text = ks.bundled_robots()['ur5e'].read_text()
    read = ks.robot_from_text(calibrated_text(found, text, arm.q, arm.poses, MADE_UP))
    for one in read.description.known_poses:
        assert one.tolerance_xyz == pytest.approx(6.0 * found.noise.position, rel=0.05)
        assert one.tolerance_rpy == pytest.approx(6.0 * found.noise.rotation, rel=0.05)


def test_corrections_far_beyond_their_usual_errors_are_remarked():
    arm = measured_arm('ur5e', 40, NOISE, seed=2, size=0.3)
    q = arm.q.copy()
    q[:, 2] -= np.radians(1.5)
    found = ks.calibrate(arm.robot, q, arm.poses, check=False)
    (remark,) = [one for one in found.remarks if one.startswith('theta3')]
    assert 'theta3 is corrected by 1.' in remark
    assert 'usual error of 0.2 deg' in remark
    right = ks.calibrate(arm.robot, arm.q, arm.poses, check=False)
    assert not any(' is corrected by ' in one for one in right.remarks)


def test_base_and_tool_begin_near_what_is_found():
    arm = measured_arm('ur5e', 40, NOISE, seed=2)
    found = ks.calibrate(arm.robot, arm.q, arm.poses, check=False)
    ends = found.base_offsets[0] @ arm.robot.description.base.motion.matrix
    assert np.abs(found.base_starts[0] - ends).max() < 0.02


@pytest.mark.parametrize('positions', [True, False])
def test_base_and_tool_are_found_in_spite_of_bad_rows_of_many_problems_at_once(positions):
    robot = robot_of('ur5e')
    random = np.random.default_rng(6)
    q = random.uniform(-2.0, 2.0, (3, 30, 6))
    A = ks.forward_kinematics(robot, q)
    X, Y = (
        np.array([pose_of(random.uniform(-0.5, 0.5, 3), turned) for _ in range(3)])
        for turned in ((0.3, -0.2, 1.5), (0.0, 0.0, 0.0) if positions else (1.0, 0.2, -0.4))
    )
    B = X[:, None] @ A @ Y[:, None]
    B[:, 3:6, :3, 3] += 0.2
    found = offsets_of(A, B, positions, Free())
    assert np.abs(found.base - X).max() < 1e-6
    assert np.abs(found.tool - Y).max() < 1e-6
    for k in range(3):
        alone = offsets_of(A[k], B[k], positions, Free())
        assert np.abs(alone.base - found.base[k]).max() < 1e-9
        assert np.abs(alone.remainder - found.remainder[k]).max() < 1e-9


def test_each_mistake_is_weighed_as_if_it_were_alone_in_its_own_unit():
    robot = robot_of('ur5e')
    q = np.random.default_rng(7).uniform(-2.0, 2.0, (30, 6))
    poses = ks.forward_kinematics(robot, q * [1, 1, -1, 1, 1, 1])
    given = measured(robot, q, poses, None)
    changes = mistakes_of(robot, given, '')
    scores_of = partial(misfits_of_poses, robot, given, np.ones(30, dtype=bool))
    scores = scores_of(changes)
    best = changes[int(np.argmin(scores))]
    assert best.sentence.startswith('joint elbow_joint counts')
    assert scores.min() < 1e-9
    for change, score in list(zip(changes, scores))[::29]:
        assert scores_of([change])[0] == pytest.approx(score, abs=1e-6)
    near = np.array(ks.forward_kinematics(robot, q))
    near[:, :3, 3] += np.random.default_rng(8).normal(size=(30, 3)) * 2e-3
    metres, millimetres = scores_of([Hypothesis('', '', poses=near, unit=u) for u in (1.0, 1e-3)])
    assert millimetres < 0.1 * metres


def test_a_mistake_that_fits_no_better_than_none_is_not_tried():
    changes = [Hypothesis('', name) for name in ('better', 'worse')]
    misfits = np.array([0.5, 0.1, 0.6])
    tried = []

    def outcome_of(change):
        tried.append(change.sentence)
        return TriedCalibration(True, Errors(1e-5, 1e-5, 1e-5, 1e-5), 0)

    causes = explained(changes, misfits, outcome_of, Errors(1.0, 1.0, 1.0, 1.0), False)
    assert tried == ['better']
    assert causes.decided


# Of rows, numbered from the lowest of joint q1 on, those that were left out are the highest. Three
# are told by that joint where so by chance in one of a thousand calibrations, with the two joints
# and three sides that are looked at for each: 18 / 34,220 of 60 rows, 18 / 9,880 of 40.
@pytest.mark.parametrize(
    ('count', 'left', 'told'), [(60, 3, True), (40, 3, False), (1000, 3, True), (1000, 2, False)]
)
def test_rows_left_out_are_told_by_a_joint_where_that_is_no_chance(count, left, told):
    q = np.column_stack([np.linspace(-1.0, 1.0, count), np.zeros(count)])
    out = np.arange(count) >= count - left
    after = np.where(out[:, None, None], 0.1, 0.0) * np.ones((count, 2, 3))
    nothing = Errors(0.0, 0.0, 0.0, 0.0)
    left_out = SimpleNamespace(after=nothing)
    found = SimpleNamespace(
        **{'robot': robot_of('planar_2r'), 'q': q, 'count': count, 'used': ~out, 'rows': 'poses'},
        **{'remainders': after, 'outliers': np.flatnonzero(out), 'positions': False},
        **{'without': left_out, 'with_outliers': left_out, 'instrument': None, 'worse': ''},
    )
    refusals = refusals_of(JudgedFit(found, True))
    assert len(refusals) == told
    assert all('where joint q1 is above' in sentence for sentence in refusals)
