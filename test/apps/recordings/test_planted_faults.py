# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Faults planted in four recordings of a dataset: each is named, and none where there is none."""

import csv
import re
from typing import NamedTuple

import numpy as np
import pytest
from arms import robot_of
from datasets import RPY, pose_numbers, poses_of, swinging, write_lerobot
from folders import RECORDINGS as REAL_RECORDINGS
from recordings import recorded
from scipy.spatial.transform import Rotation

from kinematics_service.apps.checking.pose_format import pose_format
from kinematics_service.apps.recordings.audit.auditing import AuditSettings
from kinematics_service.apps.recordings.audit.dataset.dataset_run import rows_of_dataset
from kinematics_service.apps.recordings.audit.dataset.episode_audit import EpisodeWork
from kinematics_service.apps.recordings.readers.source import Selection
from kinematics_service.robot.measures import Level

REAL = REAL_RECORDINGS / 'ur3e_rad' / 'rad_ur3e_25hz.csv'
# Of 12 bits a turn, as small servos have them.
TICK = 2 * np.pi / 4096
# Frames of a recording that is made here.
COUNT = 130
# What is no fault of the data: where the arm went.
OF_THE_MOTION = re.compile(r'singularity|At its limit|Faster than its limit')


class Recording(NamedTuple):
    """Joint positions (N, n) as read, poses (N, 4, 4) as measured, rate, names of the joints."""

    robot: object
    q: np.ndarray
    poses: np.ndarray
    fps: float
    other: np.ndarray | None = None  # joint positions of a second arm


def real_ur3e():
    rows = list(csv.DictReader(recorded('ur3e_rad/rad_ur3e_25hz.csv').open()))[:COUNT]

    def column(name):
        return np.array([[float(row[f'{name}_{k}']) for k in range(6)] for row in rows])

    numbers = column('actual_TCP_pose')
    poses = np.tile(np.eye(4), (len(numbers), 1, 1))
    poses[:, :3, 3] = numbers[:, :3]
    poses[:, :3, :3] = Rotation.from_rotvec(numbers[:, 3:]).as_matrix()
    return Recording(robot_of('ur3e'), column('actual_q'), poses, 25)


def made_panda():
    robot = robot_of('panda')
    q, read = swinging(robot, COUNT, seed=1, noise=1e-4)
    return Recording(robot, read, poses_of(robot, q), 30)


def made_so101():
    robot = robot_of('so101')
    q, _ = swinging(robot, COUNT, seed=2)
    return Recording(robot, TICK * np.round(q / TICK), poses_of(robot, q), 30)


def made_pair():
    robot = robot_of('ur5e')
    q, read = swinging(robot, COUNT // 2, seed=3, noise=1e-4)
    other, _ = swinging(robot, COUNT // 2, seed=4)
    return Recording(robot, read, poses_of(robot, q), 50, other)


RECORDINGS = {
    'ur3e': real_ur3e,
    'panda': made_panda,
    'so101': made_so101,
    'pair of ur5e': made_pair,
}


def read_as(kind):
    """Return what makes orientations written as one kind of angles be read as roll pitch yaw."""
    return lambda one: one._replace(poses=pose_numbers(one.poses, kind))


def joints(change):
    return lambda one: one._replace(q=change(one.q))


def moved_base(x, y, z):
    def plant(one):
        poses = one.poses.copy()
        poses[:, :3, 3] += (x, y, z)
        return one._replace(poses=poses)

    return plant


def late(frames):
    def plant(one):
        return one._replace(q=one.q[:-frames], poses=one.poses[frames:])

    return plant


def early(frames):
    def plant(one):
        return one._replace(q=one.q[frames:], poses=one.poses[:-frames])

    return plant


def added(j, degrees):
    return joints(lambda q: q + np.radians(degrees) * (np.arange(q.shape[1]) == j))


def other_sign(j):
    return joints(lambda q: q * np.where(np.arange(q.shape[1]) == j, -1.0, 1.0))


def swapped(i, j):
    def change(q):
        q = q.copy()
        q[:, [i, j]] = q[:, [j, i]]
        return q

    return joints(change)


def without(first, count):
    """Rows dropped, as a recorder drops them: joints and poses alike, stamps even."""

    def plant(one):
        kept = np.r_[0:first, first + count : len(one.q)]
        return one._replace(q=one.q[kept], poses=one.poses[kept])

    return plant


def frozen(row):
    def plant(one):
        q = one.q.copy()
        q[row] = q[row - 1]
        return one._replace(q=q)

    return plant


def in_millimetres(one):
    poses = one.poses.copy()
    poses[:, :3, 3] *= 1e3
    return one._replace(poses=poses)


def base_in_tool(one):
    return one._replace(poses=np.linalg.inv(one.poses))


def other_arm(one):
    return one._replace(poses=poses_of(one.robot, one.other))


def of_model(name):
    return lambda one: one._replace(poses=poses_of(robot_of(name), one.q))


def spike(row):
    def change(q):
        q = q.copy()
        q[row] += 0.5
        return q

    return joints(change)


def unknown(row):
    def change(q):
        q = q.copy()
        q[row] = np.nan
        return q

    return joints(change)


class Fault(NamedTuple):
    recording: str
    plant: object
    named: str


ORDER = 'The orientations are angles {}'
FAULTS = {
    'angles XYZ read as xyz': Fault('ur3e', read_as('XYZ'), ORDER.format('XYZ')),
    'vectors read as angles': Fault('ur3e', read_as('rotvec'), 'orientations are rotation vec'),
    'poses 2 frames late': Fault('ur3e', late(2), r'The lag is (1\.[89]|2).* frames'),
    'poses 3 frames early': Fault('so101', early(3), r'The lag is (2\.9|3).* frames'),
    'joints in degrees': Fault('ur3e', joints(np.degrees), 'in degrees, not radians'),
    'joints turned twice': Fault('panda', joints(np.radians), 'into radians twice'),
    'places in millimetres': Fault('so101', in_millimetres, 'in millimetres, not metres'),
    'a base a little off': Fault('panda', moved_base(0.0, 0.05, 0.0), 'in another base frame'),
    'zero of a servo': Fault('so101', added(2, 4), 'zero of joint elbow_flex'),
    'sign of an elbow': Fault('ur3e', other_sign(2), 'elbow_joint counts the other way'),
    'elbow first, as drivers have it': Fault('ur3e', swapped(0, 2), 'are swapped|alphabetical'),
    'base seen from the tool': Fault('so101', base_in_tool, 'base in the tool'),
    'state of the other arm': Fault('pair of ur5e', other_arm, 'those of the right arm'),
    'another model': Fault('panda', of_model('kinova_gen3'), 'those of the robot kinova_gen3'),
    'a frame dropped': Fault('panda', without(90, 1), '1 frame is missing'),
    'a frame repeated': Fault('panda', frozen(110), '1 frame repeats'),
    'a spike': Fault('so101', spike(100), '1 frame is far from'),
    'a row without numbers': Fault('so101', unknown(77), '1 frame without a pose'),
}  # fmt: skip


def findings(tmp_path, one):
    """Return what an audit says of a recording, written as a dataset; poses may be numbers."""
    poses = one.poses if one.poses.ndim == 2 else pose_numbers(one.poses)
    names = list(one.robot.joint_names)
    state = np.column_stack([one.q, np.zeros(len(one.q))])
    names = [*(f'{name}.pos' for name in names), 'gripper.pos']
    vectors = {'observation.state': state, 'observation.ee_pose': poses}
    if one.other is not None:
        other = np.column_stack([one.other[: len(one.q)], np.zeros(len(one.q))])
        vectors['observation.state'] = np.column_stack([state, other])
        vectors['observation.ee_pose'] = np.column_stack(
            [poses, pose_numbers(poses_of(one.robot, other[:, :-1]))]
        )
        names = [f'{side}_{name}' for side in ('left', 'right') for name in names]
    elements = {'observation.state': names}
    if one.other is None:
        elements['observation.ee_pose'] = list(RPY)
    folder = write_lerobot(tmp_path / 'dataset', [vectors], elements, one.fps)
    reading = Selection(one.robot, pose_format=pose_format('rpy'))
    work = EpisodeWork(reading, AuditSettings(), None)
    rows = rows_of_dataset(folder, work, 1, None)
    assert not any(row.error for row in rows), rows
    return [
        text
        for row in rows
        for level, text, _ in row.findings
        if level > Level.OK and not OF_THE_MOTION.search(text)
    ]


@pytest.mark.parametrize('recording', RECORDINGS)
def test_nothing_is_named_where_nothing_is_wrong(tmp_path, recording):
    assert not findings(tmp_path, RECORDINGS[recording]())


def test_planted_faults_are_named(tmp_path):
    # Without the real recording, those of the others.
    made = {name: one() for name, one in RECORDINGS.items() if name != 'ur3e' or REAL.exists()}
    tried = {name: fault for name, fault in FAULTS.items() if fault.recording in made}
    missed = {}
    for k, (name, fault) in enumerate(tried.items()):
        one = made[fault.recording]
        found = findings(tmp_path / str(k), fault.plant(one))
        if not any(re.search(fault.named, text) for text in found):
            missed[name] = found
    assert not missed
