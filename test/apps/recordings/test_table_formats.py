# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Tables as people have them: stamps, units of joints, heads, numbers and poses of many makers."""

import json
import math

import numpy as np
import pytest
from arms import robot_of
from audits import run
from refusal import refused
from refused_files import refuse
from scipy.spatial.transform import Rotation

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.checking.pose_format import pose_format
from kinematics_service.apps.recordings.readers.joint_format import JointFormat
from kinematics_service.apps.recordings.readers.open_file import open_source
from kinematics_service.apps.recordings.readers.source import Selection
from kinematics_service.apps.recordings.readers.stamp_format import stamp_format
from kinematics_service.errors import RecordingError

PLANAR = robot_of('planar_2r')
UR = robot_of('ur5e')
# Numbers are printed with as many digits.
PRINTED = 1e-8


@pytest.fixture
def read(tmp_path):
    """Return a function that returns stamps, positions, poses and remarks of a table."""

    def read(text, robot=PLANAR, **wanted):
        file = tmp_path / 'table.csv'
        file.write_text(text)
        with open_source(file, Selection(robot, **wanted)) as source:
            blocks = list(source.blocks)
            track = source.poses()
            remarks = [remark.text for remark in source.remarks]
        stamps = np.concatenate([block.stamps for block in blocks])
        return stamps, np.concatenate([block.positions for block in blocks]), track, remarks

    return read


def table(header, rows, delimiter=','):
    lines = [delimiter.join(f'{x:.12g}' for x in row) for row in rows]
    return '\n'.join([delimiter.join(header), *lines]) + '\n'


@pytest.mark.parametrize(
    ('cell', 'stamps', 'guess'),
    [
        ('1700000000123456789', '', 'ns'),
        ('1700000000123456', '', 'us'),
        ('1700000000123.5', '', 'ms'),
        ('12', '', ''),
        ('12', 's', ''),
        ('12', 'ns', ''),
    ],
)
def test_stamps_of_every_unit(read, cell, stamps, guess):
    expected = {'12': 12 * 10**9, '1700000000123.5': 1700000000123500000}.get(
        cell, int(cell.split('.')[0].ljust(19, '0'))
    )
    if stamps == 'ns':
        expected = 12
    form = {'stamps': stamp_format(stamps)} if stamps else {}
    found, _, _, remarks = read(f'stamp,position.q1,position.q2\n{cell},1,2\n', **form)
    assert found.tolist() == [expected]
    assert [f'taken in {guess}' in one for one in remarks] == ([True] if guess else [])


@pytest.mark.parametrize('last', ['3', '3,'], ids=['quickly', 'line by line'])
def test_rows_without_stamps_are_numbered(read, last):
    text = (
        f'position.q1,position.q2,note\n1,2,3\n4,5,{last}\n'
        if last == '3'
        else ('position.q1,position.q2,note\n1,2,"a,b"\n4,5,3\n')
    )
    found, q, _, _ = read(text, stamps=stamp_format('30Hz'))
    assert np.diff(found).tolist() == [33333334] or np.diff(found).tolist() == [33333333]
    assert q.tolist() == [[1.0, 2.0], [4.0, 5.0]]
    still, _, _, _ = read(text, stamps=stamp_format('none'))
    assert np.diff(still).tolist() == [10**10]


def test_rows_without_stamps_are_asked_for(tmp_path):
    file = tmp_path / 'run.csv'
    file.write_text('position.q1,position.q2\n1,2\n')
    refuse(file, 'missing-column', "'stamp'", '--stamps 30Hz', '--stamps none')


def test_stamps_that_a_spreadsheet_has_spoilt_are_asked_for(read):
    text = 'stamp;position.q1;position.q2\n2,02E+13;1;2\n2,02E+13;3;4\n'
    with refused(RecordingError, 'not-a-time', "'stamp'", '--stamps'):
        read(text)
    _, q, _, _ = read(text, stamps=stamp_format('none'))
    assert q.tolist() == [[1.0, 2.0], [3.0, 4.0]]


def test_stamps_coarser_than_the_rows_are_asked_for(read):
    rows = ''.join(f'{k // 3},{k},0\n' for k in range(3, 33))
    *_, remarks = read(f'stamp,position.q1,position.q2\n{rows}')
    assert '20 of 30 rows' in remarks[0]
    assert '--stamps 30Hz' in remarks[0]
    *_, remarks = read(f'stamp,position.q1,position.q2\n{rows}', stamps=stamp_format('3Hz'))
    assert not remarks


@pytest.mark.parametrize(
    'text', ['0Hz', '-3Hz', '0.000001Hz', 'fast', 'minutes', '1e9Hz', 'nan Hz']
)
def test_stamps_that_are_none(text):
    with refused(RecordingError, 'unknown-unit', repr(text), '30Hz'):
        stamp_format(text)


def test_joints_in_degrees_turns_and_ticks(read):
    text = 'stamp,position.q1,position.q2\n1,90,1024\n2,-45,4096\n'
    _, q, _, _ = read(text, joint_format=JointFormat('deg,q2=4096@2048'))
    assert q == pytest.approx(np.array([[90, -90], [-45, 180]]) * math.pi / 180, abs=1e-15)
    _, q, _, _ = read(text, joint_format=JointFormat('turns,q2=-1024'))
    assert q == pytest.approx(np.array([[180, -2], [-90, -8]]) * math.pi, abs=1e-12)


def test_sliding_joints_have_lengths():
    robot = robot_of('scara_hsr065')
    units = JointFormat('deg,mm').units(robot)
    meant = np.where(robot.prismatic, 1e-3, math.pi / 180)
    assert units.scale.tolist() == meant.tolist()


def test_percent_of_the_limits():
    robot = robot_of('so101')
    units = JointFormat('percent').units(robot)
    lower, upper = robot.limits.T
    assert units.positions(np.full(5, 100.0)) == pytest.approx(upper, abs=1e-12)
    assert units.positions(np.full(5, -100.0)) == pytest.approx(lower, abs=1e-12)


def test_a_calibration_of_servos_tells_the_angles(tmp_path):
    robot = robot_of('so101')
    file = tmp_path / 'follower.json'
    motors = {
        name: {'id': k, 'drive_mode': 0, 'homing_offset': 9, 'range_min': 800, 'range_max': 3000}
        for k, name in enumerate([*robot.joint_names, 'gripper'])
    }
    motors['elbow_flex']['drive_mode'] = 1
    file.write_text(json.dumps(motors))
    units = JointFormat(str(file)).units(robot)
    reach = 1100 * 2 * math.pi / 4095  # from the middle of the range to its end
    signs = np.array([1, 1, -1, 1, 1])
    assert units.positions(np.full(5, 100.0)) == pytest.approx(signs * reach, abs=1e-12)
    assert units.positions(np.zeros(5)).tolist() == [0.0] * 5


def test_statistics_tell_what_was_normalised(tmp_path):
    file = tmp_path / 'stats.json'
    file.write_text(json.dumps({'observation.state': {'min': [-1, 0.5, 0], 'max': [3, 1.5, 1]}}))
    units = JointFormat(str(file)).units(PLANAR)
    assert units.positions(np.array([-1.0, 1.0])) == pytest.approx([-1.0, 1.5], abs=1e-15)


@pytest.mark.parametrize(
    ('text', 'code', 'words'),
    [
        ('grad', 'unknown-unit', ("'grad'", 'turns')),
        ('q7=deg', 'unknown-name', ("'q7'", 'planar_2r', 'q1, q2')),
        ('0@12', 'unknown-unit', ("'0@12'",)),
        ('nowhere.json', 'missing-file', ('nowhere.json', 'calibration')),
        ('.json', 'unreadable', ('calibration',)),
        ('percent', 'missing-limits', ('percent', 'joint q1')),
    ],
)
def test_joint_formats_that_are_none(tmp_path, monkeypatch, text, code, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / '.json').mkdir()
    with refused(RecordingError, code, '--joint-format: ', *words):
        JointFormat(text).units(PLANAR)


@pytest.mark.parametrize(
    'content', ['[]', '{', '{"q1": {"range_min": 0, "range_max": 9}}', '{"observation.state": {}}']
)
def test_a_file_that_gives_no_unit_is_refused(tmp_path, content):
    file = tmp_path / 'stats.json'
    file.write_text(content)
    with refused(RecordingError, 'wrong-kind', str(file), 'range_min', 'observation.state'):
        JointFormat(str(file)).units(PLANAR)


@pytest.mark.parametrize('delimiter', [';', '\t'])
def test_decimal_commas(read, delimiter):
    cells = (
        ('stamp', 'position.q1', 'position.q2'),
        ('1,5', '-0,25', '2'),
        ('2,5', '3', '1,5e-1'),
    )
    text = '\n'.join(map(delimiter.join, cells))
    found, q, _, remarks = read(text)
    assert found.tolist() == [1_500_000_000, 2_500_000_000]
    assert q.tolist() == [[-0.25, 2.0], [3.0, 0.15]]
    assert any('commas' in one for one in remarks)


def test_thousands_are_no_decimals(read):
    with refused(RecordingError, 'not-a-number', ":2: column 'position.q1'", "'1.234.5'"):
        read('stamp;position.q1;position.q2\n1;1.234,5;2\n')


@pytest.mark.parametrize(
    'first', ['', '# q1, q2\n', '# a remark\n\n'], ids=['bare', 'other remark', 'blank line']
)
def test_columns_without_names_are_counted(read, tmp_path, first):
    text = f'{first}0.5,7,-1\n0.6,8,-2\n'
    found, q, _, _ = read(text, columns='stamp=1,position=2-3')
    assert found.tolist() == [500_000_000, 600_000_000]
    assert q.tolist() == [[7.0, -1.0], [8.0, -2.0]]
    with refused(RecordingError, 'missing-header', '--columns stamp=1,position=2-7'):
        read(text)
    with refused(RecordingError, 'out-of-range', '--columns: 2-9', '1 to 3'):
        read(text, columns='stamp=1,position=2-9')
    with refused(RecordingError, 'wrong-length', '--columns: position=', 'planar_2r'):
        read(text, columns='stamp=1,position=1-3')


def test_names_behind_a_mark_of_remarks_are_names(read):
    _, q, _, _ = read('# stamp,position.q1,position.q2\n1,2,3\n')
    assert q.tolist() == [[2.0, 3.0]]


def test_elements_of_a_vector(read):
    text = 'stamp,s.0,s.1,s.2,s.3\n1,2,3,4,5\n'
    assert read(text, columns='position=s[2:4]')[1].tolist() == [[4.0, 5.0]]
    assert read(text, columns='position=s[:2]')[1].tolist() == [[2.0, 3.0]]
    assert read(text, columns='position=s')[1].tolist() == [[2.0, 3.0]]


Q = np.array([[0.3, -1.1, 1.4, -0.7, -1.2, 0.4], [0.5, -0.9, 1.2, -1.7, 0.8, 1.4]])
T = ks.forward_kinematics(UR, Q)
R = Rotation.from_matrix(T[:, :3, :3])
JOINTS = [f'position.{name}' for name in UR.joint_names]


@pytest.mark.parametrize(
    ('ends', 'numbers'),
    [
        (['pos_x', 'pos_y', 'pos_z', 'quat_x', 'quat_y', 'quat_z', 'quat_w'], R.as_quat()),
        (['pos_x', 'pos_y', 'pos_z', 'quat_w', 'quat_x', 'quat_y', 'quat_z'],
         np.roll(R.as_quat(), 1, axis=1)),
        (['pos_0', 'pos_1', 'pos_2', 'quat_0', 'quat_1', 'quat_2', 'quat_3'], R.as_quat()),
        (['pos_x', 'pos_y', 'pos_z', 'quat_rx', 'quat_ry', 'quat_rz'], R.as_rotvec()),
        (['pos_x', 'pos_y', 'pos_z', 'quat_roll', 'quat_pitch', 'quat_yaw'], R.as_euler('xyz')),
    ],
    ids=['xyzw', 'wxyz by name', 'numbers', 'vector', 'angles'],
)  # fmt: skip
def test_a_pose_with_two_beginnings(read, ends, numbers):
    rows = np.column_stack([Q, T[:, :3, 3], numbers])
    text = table([*JOINTS, *ends], rows)
    columns = 'position=position.,pose=pos_+quat_'
    _, _, track, remarks = read(text, UR, columns=columns, stamps=stamp_format('none'))
    assert track.poses == pytest.approx(T, abs=PRINTED)
    assert not remarks


def xyz(unit):
    return T[:, :3, 3] / unit


MADE = {
    'kuka': ('A1 A2 A3 A4 A5 A6 X Y Z A B C', R.as_euler('ZYX', degrees=True)),
    'fanuc': ('J1 J2 J3 J4 J5 J6 X Y Z W P R', R.as_euler('xyz', degrees=True)),
    'abb': ('rax_1 rax_2 rax_3 rax_4 rax_5 rax_6 x y z q1 q2 q3 q4', R.as_quat()[:, [3, 0, 1, 2]]),
    'kawasaki': ('JT1 JT2 JT3 JT4 JT5 JT6 X Y Z O A T', R.as_euler('ZYZ', degrees=True)),
}


@pytest.mark.parametrize('maker', MADE)
def test_heads_of_makers_tell_units_and_angles(read, maker):
    head, numbers = MADE[maker]
    text = table(
        ['time', *head.split()],
        np.column_stack([[1, 2], np.degrees(Q), xyz(1e-3), numbers]),
    )
    _, q, track, remarks = read(text, UR)
    assert q == pytest.approx(Q, abs=PRINTED)
    assert track.poses == pytest.approx(T, abs=PRINTED)
    assert sum(maker.upper() in one for one in remarks) == 2
    assert track.name == ' '.join(head.split()[6:])
    # What is guessed gives way to what is said.
    _, q, _, _ = read(text, UR, joint_format=JointFormat('rad'))
    assert q == pytest.approx(np.degrees(Q), abs=PRINTED * 60)


@pytest.mark.parametrize(
    ('word', 'kind', 'length', 'numbers'),
    [
        ('staubli', 'XYZ', 1e-3, R.as_euler('XYZ', degrees=True)),
        ('leica', 'XYZ', 1e-3, R.as_euler('XYZ', degrees=True)),
        ('faro', 'ZXZ', 1e-3, R.as_euler('ZXZ')),
        ('KUKA', 'ZYX', 1e-3, R.as_euler('ZYX', degrees=True)),
        ('ur', 'rotvec', 1.0, R.as_rotvec()),
        ('m,rad,kuka', 'ZYX', 1.0, R.as_euler('ZYX')),
    ],
)
def test_a_maker_is_a_word_for_its_pose(read, word, kind, length, numbers):
    head = [*JOINTS, *(f'pose.{end}' for end in ('x', 'y', 'z', 'rx', 'ry', 'rz'))]
    form = pose_format(word)
    assert form.kind == kind
    _, _, track, _ = read(
        table(head, np.column_stack([Q, xyz(length), numbers])),
        UR,
        pose_format=form,
        stamps=stamp_format('none'),
    )
    assert track.poses == pytest.approx(T, abs=PRINTED)


def test_two_makers_exclude_each_other():
    with pytest.raises(RecordingError, match='KUKA and abb'):
        pose_format('KUKA,abb')


def test_poses_at_rest_have_no_speed(tmp_path, capsys):
    q = np.random.default_rng(6).uniform(-3.0, 3.0, (20, 6))
    file = tmp_path / 'rest.csv'
    file.write_text(table(JOINTS, q))
    _, out, _ = run(capsys, file, '--robot', 'ur5e', '--stamps', 'none')
    assert 'Faster' not in out
    assert 'jump' not in out
    assert 'Faster' in run(capsys, file, '--robot', 'ur5e', '--stamps', '1Hz')[1]


def test_audit_and_calibrate_take_the_same_options(tmp_path, capsys):
    random = np.random.default_rng(5)
    q = random.uniform(-2.0, 2.0, (30, 6))
    poses = ks.forward_kinematics(UR, q)
    angles = Rotation.from_matrix(poses[:, :3, :3]).as_euler('ZYX', degrees=True)
    rows = np.column_stack([np.degrees(q), 1e3 * poses[:, :3, 3], angles])
    file = tmp_path / 'bare.csv'
    np.savetxt(file, rows, '%.9f', ';')
    file.write_text(file.read_text().replace('.', ','))
    words = ['--columns', 'position=1-6,pose=7-12', '--stamps', 'none', '--joint-format', 'deg']
    words += ['--pose-format', 'kuka', '--robot', 'ur5e']
    code, out, err = run(capsys, file, *words, '--fail-on', 'frames')
    assert code == 0, out + err
    assert main(['calibrate', str(file), *words]) == 0
    assert 'refused' not in capsys.readouterr().out


def bare(path, head, rows, joined=','):
    path.write_text('\n'.join(joined.join(map(str, row)) for row in [head, *rows]))
    return path


def test_columns_named_as_the_joints_are_read_and_their_units_said(tmp_path):
    robot = robot_of('planar_2r')
    file = bare(tmp_path / 'a.csv', ['time', 'q2', 'note', 'q1'], [[0, 2, 7, 1], [1, 4, 7, 3]])
    with open_source(file, Selection(robot)) as source:
        (block,) = source.blocks
        told = [remark.text for remark in source.remarks]
    assert block.positions.tolist() == [[1.0, 2.0], [3.0, 4.0]]
    (remark,) = told
    assert remark.startswith('q1, q2 are taken in rad')
    # Given by hand, also where the usual beginnings are there.
    head = ['stamp', 'position.q1', 'position.q2', 'q1', 'q2']
    both = bare(tmp_path / 'b.csv', head, [[0, 5, 6, 1, 2]])
    for columns, expected in ((None, [5.0, 6.0]), ('position=', [1.0, 2.0])):
        with open_source(both, Selection(robot, columns=columns)) as source:
            assert next(iter(source.blocks)).positions.tolist() == [expected]


@pytest.mark.parametrize(
    ('head', 'words'),
    [
        (['q1', 'q2'], ("'stamp' (seconds)", '--stamps none')),
        (['stamp', 'q1'], ("'position.q1'", "'q1'")),
    ],
)
def test_of_a_table_of_joints_what_is_missing_is_said(tmp_path, head, words):
    refuse(bare(tmp_path / 'a.csv', head, [[1, 2]]), 'missing-column', *words)


def test_the_joints_of_a_gantry_are_no_pose(tmp_path):
    text = (
        'robot: gantry\nconvention: standard\njoints:\n'
        '  - {name: x, variable: q1, type: prismatic}\n'
        '  - {name: y, variable: q2, type: prismatic}\n'
        '  - {name: z, variable: q3, type: prismatic}\n'
        'links: [{theta: 0, d: q1, a: 0, alpha: pi/2}, {theta: pi/2, d: q2, a: 0, alpha: pi/2}, '
        '{theta: 0, d: q3, a: 0, alpha: 0}]\n'
    )
    file = bare(tmp_path / 'a.csv', ['time', 'x', 'y', 'z'], [[0, 1, 2, 3]])
    with open_source(file, Selection(ks.robot_from_text(text))) as source:
        assert next(iter(source.blocks)).positions.tolist() == [[1.0, 2.0, 3.0]]
        assert source.poses() is None
