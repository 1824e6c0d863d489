# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Jumps of joint zeros, by poses of a second source."""

import math
from dataclasses import replace

import numpy as np
import pytest
from second_source import CALIBRATED, CAMERA, NOMINAL, TRACKER, WatchedArm

from kinematics_service.apps.calibration.corrections import corrected_robot
from kinematics_service.apps.calibration.zero_jump import THRESHOLDS, JumpDetector
from kinematics_service.rigid_motion import exponential
from kinematics_service.robot.file.parts.parameters import gear_parameters
from kinematics_service.robot.robot import build_robot

FIRST = 20
# Two joints, coupled joints, a SCARA, five joints, six, seven.
HEALTHY = ('planar_2r', 'parallelogram_left', 'scara_hsr065', 'so101', 'puma560', 'panda')
SOURCES = [(CALIBRATED, TRACKER), (CALIBRATED, CAMERA), (NOMINAL, TRACKER), (NOMINAL, CAMERA)]


def an_arm(error, noise, name='ur5e', seed=3):
    return WatchedArm(name, error, noise, np.random.default_rng(seed))


def watched(arm, poses, step=8):
    """Return the results after every few poses."""
    detector = JumpDetector(arm.file, poses.at(slice(FIRST)))
    return [
        detector.observe(poses.at(slice(k, k + step))) for k in range(FIRST, len(poses.q), step)
    ]


def slipped(arm, begin, joint, degrees, count=100):
    """Return poses of which one joint is off from one of them on."""
    q = arm.everywhere(begin + count)
    offset = np.zeros_like(q)
    offset[begin:, joint] = np.radians(degrees)
    return arm.poses(q, offset)


def test_a_healthy_pose_exceeds_a_threshold_at_one_of_1e10_tests():
    assert math.erfc(math.sqrt(THRESHOLDS[1] / 2.0)) == pytest.approx(1e-10, rel=0.1)
    half = THRESHOLDS[6] / 2.0
    tail = math.exp(-half) * (1.0 + half + half**2 / 2.0)
    assert tail == pytest.approx(1e-10, rel=0.1)


@pytest.mark.parametrize(('error', 'noise'), SOURCES)
@pytest.mark.parametrize('begin', [20, 150])
def test_a_slip_is_found_and_the_joint_named_with_its_size(error, noise, begin):
    degrees = 0.2 if error == CALIBRATED else 1.0
    for joint in (1, 4) if begin == 20 else (4,):
        arm = an_arm(error, noise)
        results = watched(
            arm, slipped(arm, begin, joint, degrees, 50 if noise == TRACKER else 100)
        )
        assert all(one.jump is None for one in results if FIRST + one.tested < begin)
        jump = results[-1].jump
        assert jump.key == 'joint_offset'
        assert jump.names[0] == arm.file.joint_names[joint]
        assert np.degrees(jump.sizes[0]) == pytest.approx(degrees, rel=0.25)
        assert f'zero of joint {arm.file.joint_names[joint]} +' in jump.sentence


@pytest.mark.parametrize('name', HEALTHY)
def test_a_healthy_arm_raises_no_alarm_in_a_new_region(name):
    arm = an_arm(NOMINAL, TRACKER, name)
    q = np.concatenate([arm.region(60, 0.3), arm.region(40, 0.3)])
    results = watched(arm, arm.poses(q))
    assert all(one.jump is None for one in results)
    assert results[-1].outliers == 0


def test_a_zero_that_comes_back_ends_the_alarm_and_another_slip_is_found():
    arm = an_arm(CALIBRATED, TRACKER)
    q = arm.everywhere(360)
    offset = np.zeros_like(q)
    offset[60:260, 2] = np.radians(0.5)
    offset[320:, 3] = np.radians(-0.5)
    named = [one.jump.names if one.jump else () for one in watched(arm, arm.poses(q, offset))]
    at = [named[(k - FIRST) // 8] for k in (50, 100, 250, 284, 300, 350)]
    assert at == [(), ('elbow_joint',), ('elbow_joint',), (), (), ('wrist_1_joint',)]


@pytest.mark.parametrize(('joint', 'end'), [(0, 'base'), (5, 'tool')])
def test_a_large_slip_of_an_end_joint_is_named_with_the_end_that_looks_the_same(joint, end):
    arm = an_arm(CALIBRATED, TRACKER)
    name = arm.file.joint_names[joint]
    jump = watched(arm, slipped(arm, 60, joint, 3.0, 50))[-1].jump
    assert (jump.key, jump.names) == ('joint_offset', (name,))
    assert f'the {end} turned about the axis of {name} would look the same' in jump.sentence


def test_errors_of_gears_that_the_file_states_raise_no_alarm():
    deviation = 3e-3
    alarms = []
    for states_gears in (False, True):
        arm = an_arm(CALIBRATED, TRACKER)
        gears = gear_parameters(arm.file.description.joints)
        errors = deviation * arm.random.normal(size=len(gears))
        arm.true = corrected_robot(arm.true, gears, errors)
        said = arm.file.description.uncertainty
        own = (*said.parameters, *((one.name, deviation) for one in gears if states_gears))
        said = replace(said, parameters=own)
        arm.file = build_robot(replace(arm.file.description, uncertainty=said))
        q = np.concatenate([arm.region(60, 0.3) for _ in range(3)])
        alarms.append(any(one.jump for one in watched(arm, arm.poses(q))))
    assert alarms == [True, False]


def test_the_smallest_slip_found_is_given_and_grows_with_the_noise():
    sizes = []
    for noise in (TRACKER, CAMERA):
        arm = an_arm(CALIBRATED, noise)
        last = watched(arm, arm.poses(arm.everywhere(120)))[-1]
        sizes.append({name: size for name, size, _ in last.smallest})
        name, size = min(sizes[-1].items(), key=lambda one: one[1])
        joint = arm.file.joint_names.index(name)
        found = [
            watched(arm, slipped(arm, 60, joint, np.degrees(share * size), 50))[-1].jump
            for share in (0.4, 1.6)
        ]
        assert found[0] is None
        assert found[1].names[0] == name
    assert all(2.0 < sizes[1][name] / sizes[0][name] < 8.0 for name in sizes[0])


def test_outliers_and_a_source_that_fails_for_five_poses_are_no_slip():
    arm = an_arm(CALIBRATED, CAMERA)
    poses = arm.poses(arm.everywhere(160))
    poses.poses[5] = arm.anywhere()  # one of the first, too
    poses.poses[60] = arm.anywhere()
    poses.poses[100:105] = [arm.anywhere() for _ in range(5)]
    results = watched(arm, poses)
    assert all(one.jump is None for one in results)
    assert results[-1].outliers == 6
    assert results[-1].noise == pytest.approx(CAMERA, rel=0.3)
    poses.poses[120:, :3, 3] += 0.01 * arm.random.normal(size=(40, 3))
    last = watched(arm, poses)[-1]
    assert last.jump is None
    assert 'look at the second source' in last.sentence()


@pytest.mark.parametrize(
    ('seed', 'share', 'size'), [(6, 0.1, 0.3), (8, 0.1, 0.3), (9, 0.2, 0.3), (10, 0.1, 0.3)]
)
def test_outliers_of_a_healthy_arm_are_no_jump(seed, share, size):
    arm = an_arm(NOMINAL, TRACKER, seed=seed)
    poses = arm.poses(arm.path(100))
    bad = arm.random.random(100) < share
    poses.poses[bad, :3, 3] += arm.random.normal(0.0, size, (bad.sum(), 3))
    assert [one.jump for one in watched(arm, poses, 4) if one.jump] == []


def test_a_joint_that_did_not_move_is_never_named():
    arm = an_arm(CALIBRATED, TRACKER)
    q = arm.everywhere(160)
    q[:, 3] = 0.4
    offset = np.zeros_like(q)
    offset[60:, 3] = np.radians(1.0)
    results = watched(arm, arm.poses(q, offset))
    assert not any('wrist_1_joint' in one.jump.names for one in results if one.jump)
    assert 'wrist_1_joint' not in {name for name, _, _ in results[-1].smallest}


@pytest.mark.parametrize('part', ['base', 'tool', 'time_lag'])
def test_a_jump_of_another_part_is_named(part):
    arm = an_arm(CALIBRATED, TRACKER)
    q = arm.path(160)
    rates = np.gradient(q, axis=0) * 5.0
    offset = np.zeros_like(q)
    if part == 'time_lag':
        offset[80:] = -0.02 * rates[80:]
    poses = arm.poses(q, offset, rates)
    change = np.eye(4)
    change[:3, :3], change[:3, 3] = exponential(np.array([0.0, 0.003, 0.002])), 0.002
    if part == 'base':
        poses.poses[80:] = change @ poses.poses[80:]
    elif part == 'tool':
        poses.poses[80:] = poses.poses[80:] @ change
    jump = watched(arm, poses)[-1].jump
    assert jump.key == part
    assert jump.count == 80
    if part == 'time_lag':
        assert jump.sizes[0] == pytest.approx(-0.02, rel=0.2)
        assert 'ms later since' in jump.sentence


@pytest.mark.parametrize('seed', range(4))
def test_errors_that_successive_poses_share_raise_no_alarm(seed):
    arm = an_arm(NOMINAL, TRACKER, seed=seed)
    poses, shared = arm.poses(arm.everywhere(200)), np.zeros(3)
    for pose in poses.poses:
        shared = 0.8 * shared + 1e-4 * arm.random.normal(size=3)
        pose[:3, 3] += shared
    assert all(one.jump is None for one in watched(arm, poses))


def test_a_zero_that_creeps_is_found():
    arm = an_arm(NOMINAL, TRACKER)
    q = arm.everywhere(300)
    offset = np.zeros_like(q)
    offset[100:, 2] = np.radians(0.001) * np.arange(200)
    assert watched(arm, arm.poses(q, offset))[-1].jump.names[0] == 'elbow_joint'
