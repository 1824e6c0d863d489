# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
A second source of the tool's pose in an audit: matched, judged, and told from what it cannot be.
"""

import json
import math

import numpy as np
import pytest
from arms import robot_of
from audits import JOINT_STATE, header, joint_states, quaternions, run
from recordings import motion, samples_of

import kinematics_service as ks
from kinematics_service.apps.checking.pose_format import PoseFormat, pose_format
from kinematics_service.apps.recordings.audit import neighbourhoods
from kinematics_service.apps.recordings.audit.auditing import audit
from kinematics_service.apps.recordings.audit.frames import FrameReport, NotCompared
from kinematics_service.apps.recordings.audit.neighbourhoods import WINDOW_AROUND_POSES, joined
from kinematics_service.apps.recordings.audit.report.page_frames import frame_section
from kinematics_service.apps.recordings.audit.reported_velocities import (
    MotionColumns,
    smooth_products,
)
from kinematics_service.apps.recordings.audit.verdict import verdict_of
from kinematics_service.apps.recordings.readers import bag_poses
from kinematics_service.apps.recordings.readers.block import Block
from kinematics_service.apps.recordings.readers.open_file import open_source
from kinematics_service.apps.recordings.readers.source import (
    MAX_POSES,
    PoseTrack,
    RecordingSource,
    Selection,
)

BEGIN = 1_700_000_000_000_000_000
# Standard deviation of an encoder (rad), and of the poses of a controller (m).
NOISE, POSE_NOISE = 1e-5, 5e-5
# A lag is found this well (s): a fifth of the interval of a recording at 1 kHz and at 25 Hz.
AT_1_KHZ, AT_25_HZ = 2e-4, 8e-3


def frames(capsys, *argv):
    code, out, err = run(capsys, *argv, '--json', '-')
    assert code == 0, err
    return json.loads(out)['frames']


def table(file, t, q, numbers, ends):
    """Write a table with joints and the numbers of a pose in each row."""
    joints = [f'position.q{j}' for j in range(q.shape[1])]
    rows = np.column_stack([1.7e9 + t, q, numbers])
    lines = [','.join(['stamp', *joints, *(f'pose.{end}' for end in ends)])]
    lines += [','.join([f'{row[0]:.6f}', *map(repr, row[1:].tolist())]) for row in rows]
    file.write_text('\n'.join(lines))
    return file


QUATERNION = ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')
AS_NUMBERS = ('--columns', 'stamp=stamp,position=position.q,pose=pose.')


def moving(robot, rate, lag=0.0, seconds=8.0, seed=0):
    """Return stamps that jitter, joints of an encoder, and poses that come `lag` seconds late."""
    random = np.random.default_rng(seed)
    count = round(seconds * rate)
    slack = round(rate)
    fine, q, _ = motion(robot, count + 2 * slack, rate, seed + 5)
    fine = fine - slack / rate
    t = fine[slack:-slack]
    then = np.stack([np.interp(t - lag, fine, column) for column in q.T], axis=1)
    poses = ks.forward_kinematics(robot, then)
    poses[:, :3, 3] += POSE_NOISE * random.normal(size=(count, 3))
    q = q[slack:-slack] + NOISE * random.normal(size=then.shape)
    # At 1 kHz intervals of 0.2 to 4 ms; one row in twenty stands twice.
    late = np.minimum(random.exponential(0.6, count), 3.6) * 1e-3
    stamps = np.maximum.accumulate(0.8 * t + late) + 0.2 * t
    twice = np.flatnonzero(random.random(count) < 0.05)[1:]
    q[twice], poses[twice] = q[twice - 1], poses[twice - 1]
    return stamps, q, poses


def audited(robot, t, q, track):
    stamps = BEGIN + np.rint(1e9 * t).astype(np.int64)
    blocks = [
        Block(
            robot.joint_names,
            stamps[k : k + 500],
            stamps[k : k + 500],
            q[k : k + 500],
            np.zeros((len(q[k : k + 500]), 0)),
        )
        for k in range(0, len(q), 500)
    ]
    return audit(
        RecordingSource('table', 'joints', False, len(q), iter(blocks), lambda: track),
        robot,
        'made up',
    )


def in_rows(robot, t, q, poses):
    stamps = BEGIN + np.rint(1e9 * t).astype(np.int64)
    return audited(robot, t, q, PoseTrack('poses', '', stamps, poses, q)).frames


# A lag


@pytest.mark.slow
def test_a_lag_is_named_at_1_khz_though_stamps_jitter_and_rows_repeat():
    lag = -0.045
    robot = robot_of('panda')
    report = in_rows(robot, *moving(robot, 1000.0, lag, seconds=4.0))
    cause = report.diagnosis.cause
    assert cause is not None, report.sentence
    assert cause.key == 'time_lag'
    assert -cause.value == pytest.approx(lag, abs=AT_1_KHZ + 0.02 * abs(lag))
    assert 'ahead of' in cause.sentence


def test_a_lag_is_named_at_25_hz():
    lag = 0.18
    robot = robot_of('ur5e')
    report = in_rows(robot, *moving(robot, 25.0, lag, seconds=20.0))
    cause = report.diagnosis.cause
    assert cause is not None, report.sentence
    assert cause.key == 'time_lag'
    assert -cause.value == pytest.approx(lag, abs=AT_25_HZ)
    assert 'behind' in cause.sentence


@pytest.mark.slow
@pytest.mark.parametrize('seed', [0])
@pytest.mark.parametrize(('name', 'rate'), [('panda', 1000.0), ('ur5e', 125.0), ('ur5e', 25.0)])
def test_nothing_is_named_where_nothing_is_wrong(name, rate, seed):
    robot = robot_of(name)
    report = in_rows(robot, *moving(robot, rate, seconds=4.0, seed=seed))
    assert report.diagnosis.causes == report.diagnosis.likely == (), report.sentence
    assert report.level == 0


def test_poses_of_another_clock_rate_are_matched_and_their_lag_named():
    robot = robot_of('ur5e')
    t, q, poses = moving(robot, 500.0, 0.04, seconds=4.0)
    own = np.arange(40, 1900, 7)
    stamps = BEGIN + np.rint(1e9 * t[own]).astype(np.int64) + 300_000
    report = audited(robot, t, q, PoseTrack('/pose', 'base', stamps, poses[own])).frames
    assert report.matched == report.considered == len(own)
    assert report.diagnosis.cause.key == 'time_lag'
    assert -report.diagnosis.cause.value == pytest.approx(0.04, abs=2e-3)


# What is kept


def test_only_states_around_some_hundred_poses_are_kept(monkeypatch):
    robot = robot_of('planar_2r')
    seconds = 40
    t = np.arange(seconds * 1000) / 1000.0
    q = np.stack([np.sin(t), np.cos(0.7 * t)], axis=1)
    stamps = BEGIN + np.rint(1e9 * t).astype(np.int64)
    few = stamps[::10_000] + 400
    monkeypatch.setattr(neighbourhoods, 'LARGEST_BLOCK', 1000)
    states = MotionColumns(q.shape[1])
    states.add(stamps, q, q, np.zeros(len(q), dtype=bool))
    track = joined(robot, PoseTrack('p', '', few, np.tile(np.eye(4), (len(few), 1, 1))), states)
    np.testing.assert_allclose(track.q, q[::10_000], atol=1e-6)
    assert np.all(track.within)
    kept = len(track.states_at)
    assert kept <= len(few) * (2 * WINDOW_AROUND_POSES / 1e6 + 4) < len(t) / 5
    # Of more poses than are wanted every second one goes, again and again.
    many = PoseTrack('p', '', stamps, np.tile(np.eye(4), (len(t), 1, 1)))
    track = joined(robot, many, states)
    assert MAX_POSES < len(track.poses) <= 2 * MAX_POSES
    np.testing.assert_array_equal(track.q, q[track.poses])


# Which poses belong to which joints


@pytest.mark.parametrize('step', [0.7, 45.0])
def test_poses_in_the_row_of_the_joints_belong_to_them_whatever_the_step(tmp_path, capsys, step):
    robot = robot_of('ur5e')
    random = np.random.default_rng(4)
    q = random.uniform(-1.5, 1.5, (30, 6))
    poses = ks.forward_kinematics(robot, q)
    file = table(tmp_path / 'set.csv', step * np.arange(30), q, quaternions(poses), QUATERNION)
    found = frames(capsys, file, '--robot', 'ur5e', *AS_NUMBERS)
    assert found['matched'] == found['poses'] == 30
    assert found['as_given']['position_max'] < 1e-9
    assert found['level'] == 'OK'


def test_rows_whose_stamps_are_whole_seconds_are_compared(tmp_path, capsys):
    robot = robot_of('ur5e')
    t, q, poses = moving(robot, 125.0, seconds=2.0)
    file = table(tmp_path / 'coarse.csv', np.floor(t), q, quaternions(poses), QUATERNION)
    found = frames(capsys, file, '--robot', 'ur5e', *AS_NUMBERS)
    assert found['matched'] == found['poses'] == len(t)
    assert found['as_given']['position_rms'] < 1e-3


def bare(robot, t, q, stamps, poses, gap=None):
    from kinematics_service.apps.recordings.audit.auditing import AuditSettings
    from kinematics_service.apps.recordings.audit.frames import FrameSettings

    nanoseconds = BEGIN + np.rint(1e9 * t).astype(np.int64)
    block = Block(robot.joint_names, nanoseconds, nanoseconds, q, np.zeros((len(q), 0)))
    track = PoseTrack('/tcp', '', stamps, poses)
    source = RecordingSource('bag', '/joint_states', False, len(q), iter([block]), lambda: track)
    return audit(source, robot, 'made up', AuditSettings(frames=FrameSettings(gap)))


def test_poses_between_joint_states_far_apart_cost_the_frames_not_the_audit():
    robot = robot_of('ur5e')
    t, q, _ = motion(robot, 30, 0.4, 3)
    stamps = BEGIN + np.rint(1e9 * (t + 0.9)).astype(np.int64)
    poses = ks.forward_kinematics(robot, q)
    result = bare(robot, t, q, stamps, poses)
    assert isinstance(result.frames, NotCompared)
    assert len(result.timeline) == 30
    sentences = [one.text for one in verdict_of(result)]
    (text,) = [one for one in sentences if '/tcp' in one]
    assert '30 of 30 poses' in text
    assert '29 between joint states more than 0.5 s apart' in text
    assert '1 before' in text
    assert result.frames.code == 'too-few'
    assert verdict_of(result)[0].level >= 0
    assert isinstance(bare(robot, t, q, stamps, poses, gap=3.0).frames, FrameReport)


def test_the_page_draws_what_remains_between_the_sources():
    robot = robot_of('ur5e')
    t, q, poses = moving(robot, 25.0, seconds=1.6)
    poses[:, 0, 3] += np.where(np.arange(len(t)) == 20, 0.05, 0.0)
    section = frame_section(bare(robot, t, q, BEGIN + np.rint(1e9 * t).astype(np.int64), poses))
    assert '<h2>Frames: poses of /tcp</h2>' in section
    assert section.count('<figure') == 2
    for title in ('position remaining', 'orientation remaining'):
        assert f'aria-label="{title}"' in section


@pytest.mark.parametrize(('beside', 'level'), [(15, 'WARN'), (30, 'OK')])
def test_poses_of_which_most_are_not_compared_are_not_fine(beside, level):
    robot = robot_of('ur5e')
    t, q, poses = moving(robot, 25.0, seconds=1.6)
    stamps = BEGIN + np.rint(1e9 * t).astype(np.int64)
    stamps[beside:] += 10**12  # after the last joint state
    result = bare(robot, t, q, stamps, poses)
    said = {one.text: one.level.name for one in verdict_of(result)}
    text = f'{len(t) - beside} of {len(t)} poses have no joint'
    assert [name for one, name in said.items() if text in one] == [level]


def test_the_gate_of_frames_fails_where_they_cannot_be_compared(tmp_path, capsys):
    robot = robot_of('ur5e')
    t, q, _ = motion(robot, 40, 20.0)
    vectors = np.column_stack([np.zeros((40, 3)), 90.0 + 0.1 * np.arange(40), np.zeros((40, 2))])
    file = table(tmp_path / 'd.csv', t, q, vectors, ('x', 'y', 'z', 'rx', 'ry', 'rz'))
    base = (file, '--robot', 'ur5e', *AS_NUMBERS)
    code, out, _ = run(capsys, *base)
    assert code == 0
    assert '--pose-format deg, or deg,rpy' in out
    assert run(capsys, *base, '--fail-on', 'frames')[0] == 1
    html = tmp_path / 'page.html'
    run(capsys, *base, '--html', html)
    assert 'Not compared: ' in html.read_text()
    assert 'length 93.9 rad' in html.read_text()


# How far apart is bad


def rough(tmp_path, amount):
    # What no constant offset and no single cause explains: the tool's place by its orientation.
    robot = robot_of('ur5e')
    t, q, _ = motion(robot, 80, 10.0, 6)
    poses = ks.forward_kinematics(robot, q)
    poses[:, :3, 3] += amount * np.sqrt(2.0 / 3.0) * np.sin(7.0 * q[:, :3] + q[:, 3:] * [2, 3, 5])
    return table(tmp_path / f'{amount}.csv', t, q, quaternions(poses), QUATERNION)


@pytest.mark.slow
def test_a_remainder_that_no_cause_explains_is_judged_by_its_size(tmp_path, capsys):
    def level(amount, *options):
        file = rough(tmp_path, amount)
        code, out, _ = run(
            capsys, file, '--robot', 'ur5e', *AS_NUMBERS, '--fail-on', 'frames', *options
        )
        line, *_ = [line for line in out.splitlines() if 'Poses of' in line]
        return code, line.split()[0], line

    assert level(2e-3)[:2] == (0, 'OK')
    assert level(8e-3)[:2] == (0, 'WARN')
    code, word, line = level(0.06)
    assert (code, word) == (1, 'ERROR')
    assert '(ERROR at 20 mm or 2 deg)' in line
    code, word, line = level(400.0)
    assert (code, word) == (1, 'ERROR')
    assert 'e+' not in line
    assert ' m, ' in line
    assert level(8e-3, '--pose-stop', '5 mm')[:2] == (1, 'ERROR')
    assert level(8e-3, '--pose-warn', '9mm, 1deg')[:2] == (0, 'OK')


@pytest.mark.slow
@pytest.mark.parametrize(
    ('option', 'value', 'words'),
    [
        ('--pose-warn', '5', ("'5'", '4mm,0.5deg')),
        ('--pose-warn', '3 cm', ("'3 cm'", '4mm,0.5deg')),
        ('--pose-stop', '1.2.3mm', ("'1.2.3mm'", '4mm,0.5deg')),
        ('--pose-stop', '1mm', ('1mm', '--pose-warn 4mm,0.5deg')),
        ('--pose-gap', '-1', ('-1 s', '3600 s')),
        ('--pose-gap', 'nan', ('nan s', '3600 s')),
        ('--pose-format', 'feet', ("'feet'", 'rotvec, rpy, matrix')),
        ('--pose-format', 'mm,m', ('mm and m',)),
    ],
)
def test_wrong_options_are_told_with_the_choices(capsys, option, value, words):
    code, _, err = run(capsys, 'run.csv', '--robot', 'ur5e', *AS_NUMBERS, option, value)
    assert code == 2
    for word in (f'{option}: ', *words):
        assert word in ' '.join(err.split())


# Kinds and units of pose columns


def angles_of(poses):
    """Return roll, pitch, yaw by the textbook formulas (R = Rz(yaw) Ry(pitch) Rx(roll)), deg."""
    R = poses[:, :3, :3]
    pitch = np.arcsin(-R[:, 2, 0])
    roll, yaw = np.arctan2(R[:, 2, 1], R[:, 2, 2]), np.arctan2(R[:, 1, 0], R[:, 0, 0])
    return np.degrees(np.stack([roll, pitch, yaw], axis=1))


@pytest.mark.slow
def test_every_kind_and_unit_of_pose_columns_is_read(tmp_path):
    robot = robot_of('ur5e')
    t, q, _ = motion(robot, 20, 20.0, 8)
    poses = ks.forward_kinematics(robot, q)
    p, numbers, angles = poses[:, :3, 3], quaternions(poses), angles_of(poses)
    rows, columns = poses.reshape(-1, 16), np.swapaxes(poses, 1, 2).reshape(-1, 16)
    vectors = np.column_stack([p, ks_vectors(poses)])
    rxyz, count = ('x', 'y', 'z', 'rx', 'ry', 'rz'), lambda n: tuple(map(str, range(n)))
    cases = [
        (numbers, QUATERNION, ''),
        (numbers, count(7), 'xyzw'),
        (numbers[:, [0, 1, 2, 6, 3, 4, 5]], count(7), 'wxyz'),
        (vectors, rxyz, ''),
        (
            np.degrees(vectors) * ([0.001] * 3 + [1] * 3) / ([math.degrees(0.001)] * 3 + [1] * 3),
            rxyz,
            'deg',
        ),
        (np.column_stack([1e3 * p, angles]), rxyz, 'mm,deg,rpy'),
        (np.column_stack([p, np.radians(angles)]), ('x', 'y', 'z', 'roll', 'pitch', 'yaw'), ''),
        (np.column_stack([p, angles[:, ::-1]]), count(6), 'deg,ZYX'),
        (np.column_stack([p, angles]), ('x', 'y', 'z', 'rx', 'ry', 'rz'), 'deg,xyz'),
        (rows, count(16), ''),
        (columns, count(16), 'matrix'),
        (rows[:, :12], count(12), 'matrix'),
    ]
    for k, (values, ends, form) in enumerate(cases):
        file = table(tmp_path / f'{k}.csv', t, q, values, ends)
        wanted = Selection(
            robot, columns=AS_NUMBERS[1], pose_format=pose_format(form) if form else PoseFormat()
        )
        with open_source(file, wanted) as source:
            assert sum(map(len, source.blocks)) == 20
            np.testing.assert_allclose(source.poses().poses, poses, atol=1e-6, err_msg=f'{k}')


def test_angles_about_moving_axes_read_as_roll_pitch_yaw_are_named(tmp_path, capsys):
    from scipy.spatial.transform import Rotation

    from kinematics_service.rigid_motion import pose_of

    robot = robot_of('ur5e')
    t, q, _ = motion(robot, 60, 20.0, 8)
    poses = pose_of([1, 2, 0.5], (0.1, 1.0, -2.0)) @ ks.forward_kinematics(robot, q)
    angles = Rotation.from_matrix(poses[:, :3, :3]).as_euler('XYZ')
    numbers = np.column_stack([poses[:, :3, 3], angles])
    file = table(tmp_path / 'tracker.csv', t, q, numbers, ('x', 'y', 'z', 'roll', 'pitch', 'yaw'))
    found = frames(capsys, file, '--robot', 'ur5e', *AS_NUMBERS)
    assert found['cause'] == 'angle_order'
    assert '--pose-format XYZ' in found['sentence']
    right = frames(capsys, file, '--robot', 'ur5e', *AS_NUMBERS, '--pose-format', 'XYZ')
    assert right['errors']['position_max'] < 1e-6


def ks_vectors(poses):
    from kinematics_service.rigid_motion import rotation_vector

    return rotation_vector(poses[:, :3, :3])


def test_positions_that_no_arm_reaches_are_told(tmp_path, capsys):
    robot = robot_of('ur5e')
    t, q, _ = motion(robot, 80, 20.0, 8)
    poses = ks.forward_kinematics(robot, q)
    poses[:, :3, 3] *= 1e3
    file = table(tmp_path / 'mm.csv', t, q, quaternions(poses), QUATERNION)
    out = run(capsys, file, '--robot', 'ur5e', *AS_NUMBERS)[1]
    assert '--pose-format mm' in out
    out = run(capsys, file, '--robot', 'ur5e', *AS_NUMBERS, '--pose-format', 'mm')[1]
    assert 'millimetres' not in out


def test_single_rows_that_are_no_pose_are_left_out_and_told(tmp_path, capsys):
    robot = robot_of('ur5e')
    t, q, _ = motion(robot, 80, 20.0, 8)
    numbers = quaternions(ks.forward_kinematics(robot, q))
    numbers[0, 3:] = 0.0
    file = table(tmp_path / 'first.csv', t, q, numbers, QUATERNION)
    found = frames(capsys, file, '--robot', 'ur5e', *AS_NUMBERS)
    assert found['matched'] == 79
    assert found['doubts'][0].startswith('1 of 80 poses')


# A joint that stands still


@pytest.mark.parametrize(('sigma', 'rate'), [(1.2e-4, 125.0), (2e-5, 1000.0)])
def test_a_joint_that_stands_still_is_not_accused_by_the_noise_of_its_encoder(sigma, rate):
    robot = robot_of('ur5e')
    random = np.random.default_rng(2)
    t, q, qdot = motion(robot, 1000, rate, 7)
    q[:, 5], qdot[:, 5] = 0.3, 0.0
    q = q + sigma * random.normal(size=q.shape)
    qdot = qdot + 1e-4 * random.normal(size=q.shape)
    stamps = BEGIN + np.rint(1e9 * t).astype(np.int64)
    qdot[:, 2] *= math.degrees(1.0)
    block = Block(robot.joint_names, stamps, stamps, q, qdot)
    result = audit(
        RecordingSource('table', 'joints', False, 1000, iter([block])), robot, 'made up'
    )
    assert result.joints[5].check is None
    (text,) = (one.text for one in verdict_of(result) if 'Reported' in one.text)
    assert robot.joint_names[2] in text
    assert ': degrees?' in text


# A topic of a bag


POSE = 'geometry_msgs/msg/PoseStamped'


def bag_with_poses(folder, store, robot, count, unreadable=()):
    """
    Write a motion at 100 Hz with the tool's pose in each state, some messages of it cut short.
    """
    from rosbags.rosbag2 import StoragePlugin, Writer

    t, q, qdot = motion(robot, count)
    samples = samples_of(robot, t, q, qdot)
    numbers = quaternions(ks.forward_kinematics(robot, q))
    types = store.types
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        states = writer.add_connection('/joint_states', JOINT_STATE, typestore=store)
        tool = writer.add_connection('/tool', POSE, typestore=store)
        for k, (_, _, at, state) in enumerate(joint_states(store, samples)):
            pose = types[POSE](
                header(store, samples[k].stamp, 'base'),
                types['geometry_msgs/msg/Pose'](
                    types['geometry_msgs/msg/Point'](*numbers[k, :3]),
                    types['geometry_msgs/msg/Quaternion'](*numbers[k, 3:]),
                ),
            )
            data = bytes(store.serialize_cdr(pose, POSE))
            writer.write(states, at, store.serialize_cdr(state, JOINT_STATE))
            writer.write(tool, at, data[:30] if k in unreadable else data)
    return folder


def test_of_a_long_topic_poses_are_given_up_while_it_is_read(tmp_path, capsys, store, monkeypatch):
    robot = robot_of('ur5e')
    bag = bag_with_poses(tmp_path / 'bag', store, robot, 300)
    monkeypatch.setattr(bag_poses, 'MAX_POSES_HELD', 64)
    found = frames(capsys, bag, '--robot', 'ur5e', '--pose-topic', '/tool')
    assert found['poses'] == 300
    assert 32 < found['matched'] <= 64
    assert found['causes'] == []
    assert found['errors']['position_rms'] < 1e-9


@pytest.mark.slow
def test_what_is_kept_of_a_topic_is_bounded_and_evenly_spread(store, monkeypatch):
    monkeypatch.setattr(bag_poses, 'MAX_POSES_HELD', 256)
    robot_pose = np.array([0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0])
    types, read = store.types, []

    def message(raw):
        read.append(raw)
        pose = types['geometry_msgs/msg/Pose'](
            types['geometry_msgs/msg/Point'](*robot_pose[:3]),
            types['geometry_msgs/msg/Quaternion'](*robot_pose[3:]),
        )
        return [types[POSE](header(store, int(raw)), pose)]

    count = 5 * bag_poses.MAX_POSES_HELD
    messages = ((0, str(BEGIN + k).encode()) for k in range(count))
    track = bag_poses.track_of_messages('/tool', POSE, messages, message)
    assert track.total == count
    assert bag_poses.MAX_POSES_HELD / 2 < len(track.stamps) <= bag_poses.MAX_POSES_HELD
    assert np.unique(np.diff(track.stamps)).tolist() == [8]
    assert len(read) < 3 * bag_poses.MAX_POSES_HELD


def test_poses_that_cannot_be_read_are_counted(tmp_path, capsys, store):
    robot = robot_of('ur5e')
    bag = bag_with_poses(tmp_path / 'bag', store, robot, 90, (3, 40))
    base = (bag, '--robot', 'ur5e', '--pose-topic', '/tool')
    found = frames(capsys, *base)
    assert found['poses'] == 90
    assert found['matched'] == 88
    assert [doubt.split(' messages')[0] for doubt in found['doubts']] == ['2 of 90']
    broken = bag_with_poses(tmp_path / 'broken', store, robot, 40, range(40))
    code, out, _ = run(capsys, broken, *base[1:], '--fail-on', 'frames', '--json', '-')
    document = json.loads(out)
    assert (code, document['frames']['matched'], document['frames']['code']) == (
        1,
        0,
        'unreadable',
    )
    assert [one['level'] for one in document['verdict'] if one['code'] == 'unreadable'] == ['WARN']


def test_a_gate_without_a_second_source_is_not_passed_in_silence(tmp_path, capsys):
    robot = robot_of('ur5e')
    t, q, _ = motion(robot, 60)
    file = table(tmp_path / 'bare.csv', t, q, np.zeros((60, 0)), ())
    base = (file, '--robot', 'ur5e', '--columns', 'stamp=stamp,position=position.q')
    code, out, err = run(capsys, *base, '--fail-on', 'limits,frames')
    assert code == 1
    assert err.strip().startswith(f'{file}: --fail-on frames: ')
    assert '--pose-topic' in err
    assert 'found near the arm' in out
    code, _, err = run(capsys, *base, '--fail-on', 'limits')
    assert (code, err) == (0, '')


# A joint that stands still, in pieces


def test_the_motion_in_noisy_differences_is_of_products_that_share_no_position():
    random = np.random.default_rng(8)
    velocities, use = random.normal(size=400), random.random(400) > 0.2
    expected = [k for k in range(2, 400) if np.all(use[k - 2 : k + 1])]
    products = [velocities[k] * velocities[k - 2] for k in expected]
    np.testing.assert_array_equal(smooth_products(velocities, use), products)
