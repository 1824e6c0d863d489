# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The frame doctor finds planted offsets and names planted faults, and none on clean data."""

import dataclasses
import math
import time

import numpy as np
import pytest
from arms import robot_of, seeded, sliding
from calibrated_arms import BASE, TOOL, measured_arm
from recordings import motion, recorded
from refusal import refused
from scipy.spatial.transform import Rotation

import kinematics_service as ks
from kinematics_service.apps.checking.angle_orders import likely_orders, order_hypotheses_of
from kinematics_service.apps.checking.diagnosis import diagnose_frames
from kinematics_service.apps.checking.errors import NOMINAL, PoseLimit
from kinematics_service.apps.checking.euler_orders import EULER_ORDERS, rotation_of_euler
from kinematics_service.apps.checking.offsets import fit_offsets, least_angles
from kinematics_service.apps.checking.other_robots import left_by, other_robot
from kinematics_service.apps.checking.pose_format import PoseFormat
from kinematics_service.apps.recordings.readers.tool_poses import PoseRows
from kinematics_service.errors import FramesError
from kinematics_service.rigid_motion import exponential
from kinematics_service.robot.file.parts.convention_table import CONVENTIONS
from kinematics_service.robot.robot import build_robot

# Of both conventions; with a joint that slides, and with one more than six.
SPATIAL = ('panda', 'offset_stanford_dh')
# A planar arm, coupled joints, a SCARA, five joints, six, seven.
CLEAN = ('planar_2r', 'parallelogram_left', 'scara_hsr065', 'so101', 'puma560', 'panda')
# A decent measuring system: standard deviation of each coordinate.
NOISE, NOISE_ANGLE = 5e-5, math.radians(0.01)


def rotation(w):
    angle = float(np.linalg.norm(w))
    x, y, z = np.asarray(w) / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K


def placed(xyz, w):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation(w), xyz
    return T


X = placed([0.3, -0.2, 0.5], [0.1, 0.2, 0.8])
Y = placed([0.02, 0.01, 0.15], [0.3, -0.1, 0.2])


def measured(robot, q, seed=0):
    """
    Return the poses of a second source that stands elsewhere and carries another tool, with noise.
    """
    random = np.random.default_rng(seed)
    B = X @ ks.forward_kinematics(robot, q) @ Y
    for T in B:
        T[:3, :3] = rotation(NOISE_ANGLE * random.normal(size=3)) @ T[:3, :3]
        T[:3, 3] += NOISE * random.normal(size=3)
    return B


def poses_of_arm(name, count=40):
    robot = robot_of(name)
    t, q, _ = motion(robot, count, 20.0, 2)
    q = np.where(sliding(robot), 0.2 * q, q)
    return robot, t, q, measured(robot, q)


def keys(diagnosis):
    return {cause.key for cause in diagnosis.causes}


@pytest.mark.slow
@pytest.mark.parametrize('name', CLEAN)
def test_offsets_are_found_and_no_cause_is_named_on_clean_data(name):
    robot, t, q, B = poses_of_arm(name)
    diagnosis = diagnose_frames(robot, q, B, t)
    assert diagnosis.cause is None, diagnosis.sentence
    assert diagnosis.errors.position_rms < 2.0 * NOISE
    assert diagnosis.errors.rotation_rms < 2.0 * NOISE_ANGLE
    assert diagnosis.as_given.position_rms > 0.1
    if not diagnosis.undetermined:
        np.testing.assert_allclose(diagnosis.base_offset, X, atol=2e-3)
        np.testing.assert_allclose(diagnosis.tool_offset, Y, atol=2e-3)
    exact = diagnose_frames(robot, q, X @ ks.forward_kinematics(robot, q) @ Y, t)
    assert exact.errors.position_rms < 1e-9
    assert exact.cause is None


@pytest.mark.parametrize('name', ['planar_2r', 'scara_hsr065'])
def test_what_the_poses_do_not_determine_is_said(name):
    robot, t, q, B = poses_of_arm(name)
    (free,) = diagnose_frames(robot, q, B, t).undetermined
    assert 'of the base against' in free


@pytest.mark.slow
@pytest.mark.parametrize('name', SPATIAL)
def test_a_joint_that_counts_the_other_way_is_named(name):
    robot, t, q, B = poses_of_arm(name)
    j = 2 if name == 'offset_stanford_dh' else robot.dof - 1  # one that slides, and the last one
    wrong = q.copy()
    wrong[:, j] *= -1.0
    cause = diagnose_frames(robot, wrong, B, t).cause
    assert cause.key == 'joint_sign'
    assert robot.joint_names[j] in cause.sentence
    assert cause.ratio > 10.0


@pytest.mark.slow
@pytest.mark.parametrize('name', SPATIAL)
def test_joints_in_each_others_place_are_named(name):
    robot, t, q, B = poses_of_arm(name)
    if name == 'panda':
        back = diagnose_frames(robot, q[:, ::-1], B, t).cause
        assert 'reverse' in back.sentence
        return
    i, j = robot.dof - 2, robot.dof - 1
    wrong = q.copy()
    wrong[:, [i, j]] = wrong[:, [j, i]]
    cause = diagnose_frames(robot, wrong, B, t).cause
    assert cause.key == 'joint_order'
    assert robot.joint_names[i] in cause.sentence
    assert robot.joint_names[j] in cause.sentence


@pytest.mark.slow
def test_units_axes_and_quaternion_order_are_named():
    robot, t, q, B = poses_of_arm('offset_stanford_dh', 20)
    degrees = np.where(sliding(robot), q, np.degrees(q))
    assert diagnose_frames(robot, degrees, B, t).cause.key == 'degrees'
    millimetres = B.copy()
    millimetres[:, :3, 3] *= 1e3
    cause = diagnose_frames(robot, q, millimetres, t).cause
    assert (cause.key, 'not metres' in cause.sentence) == ('millimetres', True)
    in_tool = B.copy()
    in_tool[:, :3, 3] = np.einsum('nji,nj->ni', B[:, :3, :3], B[:, :3, 3])
    assert diagnose_frames(robot, q, in_tool, t).cause.key == 'tool_axes'
    assert diagnose_frames(robot, q, np.linalg.inv(B), t).cause.key == 'tool_axes'
    cause = diagnose_frames(robot, q, shuffled(B), t).cause
    assert cause.key == 'quaternion_order'
    assert cause.sentence.endswith('read as x y z w')


def shuffled(B):
    """Return poses whose quaternions w x y z were read as x y z w, by the half-angle formulas."""
    wrong = B.copy()
    for T, R in zip(wrong, B[:, :3, :3]):
        w = 0.5 * math.sqrt(max(1.0 + np.trace(R), 1e-12))
        x, y, z = (R[2, 1] - R[1, 2]), (R[0, 2] - R[2, 0]), (R[1, 0] - R[0, 1])
        x, y, z = x / (4 * w), y / (4 * w), z / (4 * w)
        x, y, z, w = np.array([w, x, y, z]) / np.linalg.norm([w, x, y, z])
        T[:3, :3] = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    return wrong


def misread(robot):
    """Return the robot of the same table under the other convention."""
    other = {'standard': 'modified', 'modified': 'standard'}[robot.convention]
    assert [one.name for one in CONVENTIONS[robot.convention].others] == [other]
    description = robot.description
    plain = dataclasses.replace(description.singularity, factors=())
    return build_robot(dataclasses.replace(description, convention=other, singularity=plain))


@pytest.mark.slow
def test_a_joint_that_turns_with_another_is_named():
    arm = measured_arm('puma560', 40, NOISE, seed=4, size=0.5)
    for (i, j), sign in [((1, 2), 1.0), ((0, 4), -1.0)]:
        q = arm.q.copy()
        q[:, j] -= sign * q[:, i]
        cause = diagnose_frames(arm.robot, q, arm.poses).cause
        assert cause.key == 'joint_coupling'
        variables = arm.robot.variables
        assert f'needs {variables[j]} {"+" if sign > 0.0 else "-"} {variables[i]}' in (
            cause.sentence
        )


def taken_for(poses, written, read):
    """Return poses whose angles, written in one order, were read in another one."""
    wrong = poses.copy()
    angles = Rotation.from_matrix(poses[:, :3, :3]).as_euler(written)
    wrong[:, :3, :3] = Rotation.from_euler(read, angles).as_matrix()
    return wrong


# Every eighth order of few poses of one arm, and one of more poses of another arm.
OTHER_ORDERS = [written for written in EULER_ORDERS if written != 'xyz']


@pytest.mark.slow
@pytest.mark.parametrize(
    ('name', 'count', 'orders'),
    [
        ('ur5e', 12, OTHER_ORDERS[::8]),
        ('puma560', 40, OTHER_ORDERS[2:3]),
    ],
)
def test_angles_in_any_other_order_are_named(name, count, orders):
    arm = measured_arm(name, count, NOISE, seed=3, size=0.5)
    for k, written in enumerate(orders):
        wrong = taken_for(arm.poses, written, 'xyz')
        diagnosis = diagnose_frames(arm.robot, arm.q, wrong, read='rpy')
        assert diagnosis.cause.key == 'angle_order', diagnosis.sentence
        assert f'(--pose-format {written})' in diagnosis.sentence
        assert 'roll pitch yaw, FANUC' in diagnosis.sentence  # as they are read
        # Where the reading is unknown kinds that come to the same are one.
        if k or name != 'ur5e':
            continue
        found = diagnose_frames(arm.robot, arm.q, wrong)
        assert found.cause.key == 'angle_order', found.sentence
        assert f'the orientations are angles {written}' in found.sentence.lower().replace(
            written.lower(), written
        )


def test_angles_read_as_a_rotation_vector_are_named():
    arm = measured_arm('ur5e', 40, NOISE, size=0.5)
    wrong = arm.poses.copy()
    angles = Rotation.from_matrix(arm.poses[:, :3, :3]).as_euler('ZYX')
    wrong[:, :3, :3] = Rotation.from_rotvec(angles).as_matrix()
    cause = diagnose_frames(arm.robot, arm.q, wrong, read='rotvec').cause
    assert cause.sentence.endswith('rotation vectors (--pose-format ZYX)')


def test_a_cause_that_leaves_more_than_an_instrument_does_is_not_decisive():
    # Twenty times less with the sign undone, but something else is wrong with the orientations.
    arm = measured_arm('ur5e', 60, NOISE, seed=2, size=0.3)
    random = np.random.default_rng(4)
    poses = arm.poses.copy()
    poses[:, :3, :3] = (
        Rotation.from_rotvec(0.02 * random.normal(size=(60, 3))).as_matrix() @ (poses[:, :3, :3])
    )
    q = arm.q * [1, 1, -1, 1, 1, 1]
    diagnosis = diagnose_frames(arm.robot, q, poses)
    assert diagnosis.cause is None
    assert diagnosis.causes[0].key == 'joint_sign'
    assert diagnosis.causes[0].ratio > 10.0
    assert 'tried, not decided: joint elbow_joint' in diagnosis.sentence
    # Whoever says that as much is to be expected has it named.
    limit = PoseLimit(0.05, math.radians(5.0))
    assert diagnose_frames(arm.robot, q, poses, limit=limit).cause.key == 'joint_sign'


@pytest.mark.parametrize('kind', ['joint_sign', 'angle_order'])
def test_a_mistake_is_tried_though_much_is_left_beside_it(kind):
    # Five times less with it undone: what is left of few poses is no reason to leave it out.
    arm = measured_arm('ur5e', 60, NOISE, seed=2, size=0.3)
    q, poses = arm.q, arm.poses.copy()
    noise = Rotation.from_rotvec(0.2 * np.random.default_rng(4).normal(size=(60, 3)))
    poses[:, :3, :3] = noise.as_matrix() @ poses[:, :3, :3]
    if kind == 'joint_sign':
        q = q * [1, 1, -1, 1, 1, 1]
    else:
        poses = taken_for(poses, 'zyx', 'xyz')
    diagnosis = diagnose_frames(arm.robot, q, poses, read='rpy')
    assert diagnosis.cause is None
    assert [one.key for one in diagnosis.causes] == [kind]
    assert 3.0 < diagnosis.causes[0].ratio < 10.0


@pytest.mark.slow
@pytest.mark.parametrize('name', ['panda', 'offset_stanford_dh'])
def test_a_table_read_by_the_other_convention_is_named(name):
    robot, t, q, B = poses_of_arm(name)
    cause = diagnose_frames(misread(robot), q, B, t).cause
    assert cause.key == 'convention'


@pytest.mark.slow
@pytest.mark.parametrize('name', SPATIAL)
def test_a_zero_position_that_is_off_is_named_with_its_size(name):
    robot, t, q, B = poses_of_arm(name)
    # One that slides, and one that turns; those of the ends are base and tool offsets.
    for j in (2,) if name == 'offset_stanford_dh' else (robot.dof - 2,):
        wrong = q.copy()
        off = 0.01 if sliding(robot)[j] else 0.03
        wrong[:, j] += off
        found = [
            cause
            for cause in diagnose_frames(robot, wrong, B, t).causes
            if cause.key == 'joint_offset' and robot.joint_names[j] in cause.sentence
        ]
        assert found[0].value == pytest.approx(-off, rel=0.05)


@pytest.mark.parametrize('name', ['puma560', 'panda'])
def test_a_late_source_is_named_with_its_lag(name):
    robot, t, q, B = poses_of_arm(name, 120)
    for lag in (0.05,) if name == 'panda' else (-0.03,):
        late = np.stack([np.interp(t - lag, t, column) for column in q.T], axis=1)
        middle = slice(5, -5)
        cause = diagnose_frames(robot, late[middle], B[middle], t[middle]).cause
        assert cause.key == 'time_lag'
        assert cause.value == pytest.approx(lag, rel=0.1)


def test_a_wrong_length_is_named_with_its_row():
    robot, t, q, B = poses_of_arm('ur5e')
    text = ks.bundled_robots()['ur5e'].read_text().partition('known_poses:')[0]
    assert '-0.425' in text
    longer = ks.robot_from_text(text.replace('-0.425', '-0.435'))
    cause = diagnose_frames(longer, q, B, t).cause
    assert cause.key == 'link_length'
    assert 'a of links[1]' in cause.sentence
    assert cause.value == pytest.approx(0.01, rel=0.05)


@pytest.mark.parametrize('size', [0.003, 0.007])
def test_a_length_that_explains_most_but_not_two_thirds_is_mentioned_not_named(size):
    robot, t, q, B = poses_of_arm('ur5e')
    text = ks.bundled_robots()['ur5e'].read_text().partition('known_poses:')[0]
    longer = ks.robot_from_text(text.replace('-0.3922', f'{-0.3922 - size:.4f}'))
    # Something else remains besides, which no cause explains.
    random = np.random.default_rng(1)
    B[:, :3, 3] += 0.22 * size * random.normal(size=(len(B), 3))
    diagnosis = diagnose_frames(longer, q, B, t)
    assert diagnosis.cause is None
    likely = diagnosis.likely[0]
    assert likely.key == 'link_length'
    assert 2.0 <= likely.ratio < 3.0
    assert likely.value == pytest.approx(size, rel=0.2)
    assert 'most likely, not decisive: a length' in diagnosis.sentence
    assert 'a of links[2]' in diagnosis.sentence


def test_a_length_that_explains_just_two_thirds_is_named():
    robot, t, q, B = poses_of_arm('ur5e', 120)
    text = ks.bundled_robots()['ur5e'].read_text().partition('known_poses:')[0]
    longer = ks.robot_from_text(text.replace('-0.425', '-0.435'))
    B[:, :3, 3] += 2e-3 * np.random.default_rng(1).normal(size=(len(B), 3))
    (cause,) = diagnose_frames(longer, q, B, t).causes
    assert cause.key == 'link_length'
    assert 3.0 <= cause.ratio < 4.0


@pytest.mark.parametrize('axis', [0, 2])
def test_mirrored_axes_are_refused_not_explained(axis):
    robot, t, q, B = poses_of_arm('ur5e', 40)
    B[:, :3, axis] *= -1.0
    with refused(FramesError, 'mirrored', '40 of 40'):
        ks.diagnose_frames(robot, q, B, t)
    sheared = measured(robot, q)
    sheared[7, 0, 0] += 0.2
    with refused(FramesError, 'not-a-rotation', 'pose 7 '):
        diagnose_frames(robot, q, sheared)


@pytest.mark.parametrize('lag', [-0.15, 0.35])
def test_a_lag_of_many_samples_is_named_by_the_motion_around_few_poses(lag):
    robot, t, q, B = poses_of_arm('panda', 800)
    at = np.arange(60, 740, 17)
    times = t[at] + lag
    if lag < 0.0:  # poses and joints at one time: the motion beside them does not matter
        assert diagnose_frames(robot, q[at], B[at], t[at], motion=(t + lag, q)).cause is None
    then = np.stack([np.interp(times, t, column) for column in q.T], axis=1)
    cause = diagnose_frames(robot, then, B[at], times, motion=(t, q)).cause
    assert cause.key == 'time_lag'
    assert cause.value == pytest.approx(-lag, abs=2e-3)


@pytest.mark.parametrize(
    ('motion', 'code', 'word'),
    [
        (([0.0, 1.0], np.zeros((2, 5))), 'wrong-shape', '(K, 6)'),
        (([0.0, 0.0], np.zeros((2, 6))), 'wrong-order', 'times'),
        (([0.0, 1.0], np.full((2, 6), math.nan)), 'not-finite', 'positions'),
    ],
)
def test_a_motion_that_is_none_is_refused(motion, code, word):
    robot, t, q, B = poses_of_arm('ur5e', 12)
    with refused(FramesError, code, 'motion', word):
        diagnose_frames(robot, q, B, t, motion=motion)
    with refused(FramesError, 'missing', 'stamps'):
        diagnose_frames(robot, q, B, motion=([0.0, 1.0], np.zeros((2, 6))))


def test_lengths_and_angles_are_written_as_a_person_reads_them():
    from kinematics_service.apps.checking.errors import angle_in_words, length_in_words

    written = [length_in_words(x) for x in (0.0, 4.2e-5, 0.00884, 0.9, 1.0, 37.25, 503.2, 2911.0)]
    assert written == [
        '0 mm',
        '0.042 mm',
        '8.84 mm',
        '900 mm',
        '1 m',
        '37.2 m',
        '503 m',
        '2,911 m',
    ]
    assert [angle_in_words(math.radians(x)) for x in (0.108, 137.2)] == ['0.108 deg', '137 deg']


def test_poses_without_variety_or_of_the_wrong_shape_are_met_with_a_sentence():
    robot, _, q, B = poses_of_arm('ur5e')
    still = diagnose_frames(robot, np.repeat(q[:1], 20, 0), np.repeat(B[:1], 20, 0))
    assert len(still.undetermined) == 6
    assert still.cause is None
    few = diagnose_frames(robot, q[:5], measured(robot, -q[:5]))
    assert few.cause is None
    with refused(FramesError, 'too-few', '2', '3'):
        diagnose_frames(robot, q[:2], B[:2])
    with refused(FramesError, 'wrong-shape', '(N, 6)'):
        diagnose_frames(robot, q[:, :5], B)
    with refused(FramesError, 'wrong-shape', 'stamps'):
        diagnose_frames(robot, q, B, np.arange(3.0))
    with refused(FramesError, 'not-finite'):
        diagnose_frames(robot, q * math.nan, B)


def test_a_few_hundred_poses_take_little_time():
    robot, t, q, B = poses_of_arm('ur5e', 300)
    diagnose_frames(robot, q, B, t)
    begin = time.process_time()
    diagnose_frames(robot, q, B, t)
    # 20 ms on one core; threads of the linear algebra count here as well.
    assert time.process_time() - begin < 0.2


# A real arm


@pytest.fixture(scope='module')
def real():
    import csv

    with recorded('ur3e_rad/rad_ur3e_25hz.csv').open(newline='') as file:
        rows = list(csv.DictReader(file))

    def six(name):
        return np.array([[float(row[f'{name}_{k}']) for k in range(6)] for row in rows])

    t = np.array([float(row['timestamp']) for row in rows])
    poses = PoseRows(PoseFormat('rotvec'), 6)
    poses.take(np.arange(len(t)), six('actual_TCP_pose'))
    return robot_of('ur3e'), t, six('actual_q'), poses.track('TCP', '').poses


def test_a_real_arms_tool_is_found_and_no_cause_named(real):
    robot, t, q, B = real
    diagnosis = diagnose_frames(robot, q, B, t)
    assert diagnosis.cause is None
    assert diagnosis.tool_offset[2, 3] == pytest.approx(0.150, abs=1e-3)  # as set on it
    # The rest is the unit's factory calibration.
    assert diagnosis.errors.position_rms < 5e-4
    assert diagnosis.errors.rotation_rms < math.radians(0.15)


@pytest.mark.slow
def test_faults_planted_in_a_real_recording_are_named(real):
    robot, every_t, every_q, every_B = real
    t, q, B = every_t[::5], every_q[::5], every_B[::5]
    wrong = q.copy()
    wrong[:, 0] *= -1.0
    cause = diagnose_frames(robot, wrong, B, t).cause
    assert cause.key == 'joint_sign'
    assert robot.joint_names[0] in cause.sentence
    elbow_first = diagnose_frames(robot, q[:, [2, 1, 0, 3, 4, 5]], B, t).cause
    assert elbow_first.key == 'joint_order'
    wrong = q.copy()
    wrong[:, 3] += 0.03
    cause = diagnose_frames(robot, wrong, B, t).cause
    assert cause.key == 'joint_offset'
    assert cause.value == pytest.approx(-0.03, rel=0.1)
    then = every_t - 0.04
    late = np.stack([np.interp(then, every_t, column) for column in every_q.T], axis=1)
    cause = diagnose_frames(robot, late, every_B, every_t).cause
    assert cause.key == 'time_lag'
    assert cause.value == pytest.approx(0.04, rel=0.1)


def poses_of_loops(name):
    robot = robot_of(name)
    q = seeded(robot, 30)
    # Not to the ends of their ways: zero positions that are off leave the loops closed.
    middle = robot.chain.closure.assembled()
    return robot, middle + 0.6 * (q - middle)


@pytest.mark.slow
@pytest.mark.parametrize('name', ['five_bar', 'excavator'])
def test_a_machine_with_closed_loops_has_its_offsets_found(name):
    robot, q = poses_of_loops(name)
    B = X @ ks.forward_kinematics(robot, q) @ Y
    diagnosis = diagnose_frames(robot, q, B)
    assert diagnosis.errors.position_rms < 1e-9
    assert diagnosis.cause is None
    assert 'closed loops' not in diagnosis.sentence
    # The zero of its first joint or of its second, as the encoder has it.
    off = q.copy()
    off[:, 1] += 0.02
    diagnosis = diagnose_frames(robot, off, B)
    assert diagnosis.cause.key == 'joint_offset'
    assert diagnosis.cause.value == pytest.approx(-0.02, rel=1e-3)
    assert robot.joint_names[1] in diagnosis.sentence


def test_what_is_no_cause_that_was_tried_is_said_of_closed_loops():
    robot, q = poses_of_loops('five_bar')
    B = ks.forward_kinematics(robot, q)
    B[:, :3, 3] += 0.01 * np.random.default_rng(5).normal(size=(len(q), 3))
    diagnosis = diagnose_frames(robot, q, B)
    assert diagnosis.cause is None
    assert 'are no causes' in diagnosis.sentence
    open_arm = robot_of('planar_2r')
    B = ks.forward_kinematics(open_arm, q)
    B[:, :3, 3] += 0.01 * np.random.default_rng(5).normal(size=(len(q), 3))
    assert 'tried' not in diagnose_frames(open_arm, q, B).sentence


def test_positions_at_which_a_loop_does_not_close_have_no_frames_to_check():
    with pytest.raises(ks.LoopError):
        diagnose_frames(
            robot_of('excavator'),
            np.tile([0, 9.0, 2.9, 2.3], (4, 1)),
            np.tile(np.eye(4), (4, 1, 1)),
        )


@pytest.mark.slow
@pytest.mark.parametrize('seed', range(3))
def test_an_arm_that_goes_round_four_poses_has_its_offsets_found(seed):
    # After a third and a seventh of the recording it is at the same pose again.
    random = np.random.default_rng(seed)
    base = placed(3.0 * random.normal(size=3), 2.0 * random.normal(size=3))
    tool = placed(3.0 * random.normal(size=3), 2.0 * random.normal(size=3))
    robot = robot_of(('ur5e', 'puma560', 'panda')[seed % 3])
    q = np.tile(random.uniform(-1.5, 1.5, (4, robot.dof)), (21, 1))
    diagnosis = diagnose_frames(robot, q, base @ ks.forward_kinematics(robot, q) @ tool)
    np.testing.assert_allclose(diagnosis.base_offset, base, atol=1e-6)
    np.testing.assert_allclose(diagnosis.tool_offset, tool, atol=1e-6)


@pytest.mark.parametrize(
    ('own', 'true', 'named'),
    [
        ('ur5e', 'ur10e', 'ur10e'),
        ('ur3e', 'ur5e', 'ur5e'),
        ('panda', 'kuka_iiwa14', 'kuka_iiwa14'),
    ],
)
def test_the_bundled_robot_is_named_whose_poses_they_are(own, true, named):
    q = np.random.default_rng(9).uniform(-1.2, 1.2, (10, robot_of(own).dof))
    poses = BASE @ ks.forward_kinematics(robot_of(true), q) @ TOOL
    poses[:, :3, 3] += np.random.default_rng(1).normal(0.0, 3e-4, (10, 3))

    def said(poses):
        left = left_by(robot_of(own), q, poses)
        return other_robot(robot_of(own), left, q, poses, NOMINAL)

    assert f'robot {named} leaves 0.' in said(poses).in_words()
    # Poses of no arm are nobody's.
    assert said(poses[::-1]) is None


def read_as_another(written, read, seed, first=0, off=0.0):
    """Return orientations of twenty angles, those of them read as others, and these undone."""
    random = np.random.default_rng(seed)
    angles = random.uniform(-1.0, 1.0, (20, 3)) * [3.0, 1.4, 3.0]
    angles[:, 1] += 1.5 if written[0] == written[2] else 0.0
    angles[:first] = angles[0] + 0.05 * random.normal(size=(first, 3))
    true, seen = np.tile(np.eye(4), (2, 20, 1, 1))
    true[:, :3, :3] = rotation_of_euler(written, angles)
    seen[:, :3, :3] = rotation_of_euler(read, angles)
    A = true.copy()
    A[:, :3, :3] = true[:, :3, :3] @ exponential(off * random.normal(size=(20, 3)))
    return true, seen, A


@pytest.mark.parametrize('seed', [4, 12])
def test_triples_that_were_chosen_among_few_poses_are_chosen_again(seed):
    # The first four poses are nearly alike, and off by six degrees: they do not tell which of two
    # triples each was made of.
    true, seen, A = read_as_another('zyz', 'xyz', seed, first=4, off=0.1)
    undone = [one.poses for one in order_hypotheses_of(seen, A, 'xyz')]
    assert min(np.max(np.abs(poses - true)) for poses in undone) < 1e-9


@pytest.mark.parametrize('seed', range(3))
def test_orders_that_are_one_order_turned_are_all_tried(seed):
    # Nothing is known of the reading; of two axes that move, many kinds leave the same products.
    true, seen, A = read_as_another('zyz', 'xyx', seed, off=1e-3)
    undone = [one.poses for one in order_hypotheses_of(seen, A)]
    assert min(np.max(np.abs(poses - true)) for poses in undone) < 1e-9


@pytest.mark.parametrize('written', OTHER_ORDERS[::2])
def test_every_order_is_tried_that_is_read_as_another(written):
    true, seen, A = read_as_another(written, 'xyz', 7, off=1e-3)
    undone = [one.poses for one in order_hypotheses_of(seen, A, 'xyz')]
    assert min(np.max(np.abs(poses - true)) for poses in undone) < 1e-9


def test_no_offsets_leave_less_than_the_least_angle():
    true, seen, A = read_as_another('zyz', 'xyz', 3, off=0.01)
    orders = likely_orders(seen, A, 'xyz')
    B = np.stack([true, *(one.undone(seen, A).poses for one in orders)])
    A = np.broadcast_to(A, B.shape)
    left = np.sqrt(np.mean(np.sum(fit_offsets(A, B).rotation ** 2, axis=-1), axis=-1))
    least = least_angles(A, B)
    assert np.all(least <= left)
    # It tells many of them from the right one.
    assert least[0] < 0.02
    assert np.sum(least > 0.15) > 5


@pytest.mark.parametrize('lag', [0.45, -0.45])
def test_a_lag_is_looked_for_as_far_on_either_side(lag):
    # The arm swings three times a second: from another swing no step leads to the right one.
    robot, t = robot_of('ur5e'), np.arange(0.0, 6.0, 0.01)
    phases = np.random.default_rng(5).uniform(0.0, 6.0, 6)

    def swinging(at):
        return 0.2 * np.sin(6.0 * math.pi * at[:, None] + phases) + 0.05 * np.sin(at[:, None])

    at = np.arange(0.6, 5.4, 0.07)
    B = measured(robot, swinging(at))
    cause = diagnose_frames(robot, swinging(at + lag), B, at + lag, motion=(t, swinging(t))).cause
    assert cause.key == 'time_lag'
    assert cause.value == pytest.approx(-lag, abs=2e-3)
