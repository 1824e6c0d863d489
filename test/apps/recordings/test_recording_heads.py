# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Heads of recordings as people write them: units, spaces, numbers, stamps."""

import numpy as np
import pytest
from arms import robot_of
from refusal import refused
from scipy.spatial.transform import Rotation

import kinematics_service as ks
from kinematics_service.apps.checking.pose_format import pose_format
from kinematics_service.apps.recordings.readers.joint_format import JointFormat
from kinematics_service.apps.recordings.readers.open_file import open_source
from kinematics_service.apps.recordings.readers.source import Selection
from kinematics_service.apps.recordings.readers.stamp_format import stamp_format
from kinematics_service.errors import RecordingError

UR, SCARA = robot_of('ur5e'), robot_of('scara_hsr065')
Q = np.array([[0.3, -1.1, 1.4, -0.7, -1.2, 0.4], [0.5, -0.9, 1.2, -1.7, 0.8, 1.4]])
T = ks.forward_kinematics(UR, Q)
R = Rotation.from_matrix(T[:, :3, :3])
XYZ, DEG = T[:, :3, 3], np.degrees(1.0)
QUATERNION, VECTOR = np.hstack([XYZ, R.as_quat()]), np.hstack([XYZ, R.as_rotvec()])
RPY = np.hstack([1e3 * XYZ, R.as_euler('xyz', degrees=True)])
TIMES = np.array([[1.5], [2.5]])
PRINTED = 1e-8  # of the digits that are written
NAMES = UR.joint_names
SLIDES = np.array([[0.1, 0.2, 0.05, 0.3], [0.2, 0.1, 0.06, 0.5]])
IN_MM = np.where(SCARA.prismatic, 1e3, DEG)


def each(form, names=NAMES):
    return ','.join(form.format(name) for name in names)


def numbered(form, first=1):
    return each(form, range(first, first + 6))


# The words of options by their names.
OPTIONS = {'joint_format': JointFormat, 'pose_format': pose_format, 'stamps': stamp_format}
QXYZW = 'qx,qy,qz,qw'
# Head, numbers below it (stamps first), options; all mean 1.5 s, 2.5 s, Q and, with poses, T.
READ = {
    'deg behind': ('stamp,' + each('{}_deg'), [TIMES, DEG * Q], {}),
    'deg in brackets': ('stamp,' + each('{} [deg]'), [TIMES, DEG * Q], {}),
    'degree sign': ('stamp,' + each('{} (°)'), [TIMES, DEG * Q], {}),
    'beginning and unit': ('stamp,' + each('position.{}_deg'), [TIMES, DEG * Q], {}),
    'rad in words': ('time (s),' + each('position.{} (radians)'), [TIMES, Q], {}),
    'rad said twice': ('t,' + each('{}_rad'), [TIMES, Q], {'joint_format': 'rad'}),
    'deg beside rad': (
        'stamp,' + each('{}_deg', NAMES[:5]) + f',{NAMES[5]}_rad',
        [TIMES, Q * [DEG, DEG, DEG, DEG, DEG, 1]], {},
    ),
    'turns': ('time,' + each('{} [turns]'), [TIMES, Q / (2 * np.pi)], {}),
    'joints by q': ('time,' + numbered('q{}'), [TIMES, Q], {'joint_format': 'rad'}),
    'joints by J and space': ('time,' + numbered('J {}'), [TIMES, Q], {'joint_format': 'rad'}),
    'joints by joint_': ('Time,' + numbered('joint_{}', 0), [TIMES, Q], {'joint_format': 'rad'}),
    'joints by Axis, deg': ('TIME [s],' + numbered('Axis {} [deg]'), [TIMES, DEG * Q], {}),
    'joints in brackets': ('t,' + numbered('q[{}]', 0), [TIMES, Q], {'joint_format': 'rad'}),
    'J beside pose.x': (
        'stamp,' + numbered('J{}') + ',' + each('pose.{}', ['x', 'y', 'z', *QXYZW.split(',')]),
        [TIMES, Q, QUATERNION], {'joint_format': 'rad'},
    ),
    'names beside tcp_x': (
        'stamp,' + each('{}') + ',tcp_x,tcp_y,tcp_z,tcp_rx,tcp_ry,tcp_rz', [TIMES, Q, VECTOR], {},
    ),
    'heads with a space': (
        'stamp,' + each('{}') + ',' + each('Goal {}', ['x', 'y', 'z', 'rx', 'ry', 'rz']),
        [TIMES, Q, VECTOR], {'columns': 'pose=Goal'},
    ),
    'pose alone is given': (
        'stamp,' + each('{}') + ',a.x,a.y,a.z,a.rx,a.ry,a.rz,b.x,b.y,b.z,b.rx,b.ry,b.rz',
        [TIMES, Q, VECTOR, 0 * VECTOR], {'columns': 'pose=a.'},
    ),
    'stamp alone is given': (
        'when,' + each('position.{}'), [TIMES, Q], {'columns': 'stamp=when'},
    ),
    'stamp with its unit is given': (
        'when [ms],' + each('{}_deg'), [1e3 * TIMES, DEG * Q], {'columns': 'stamp=when [ms]'},
    ),
    'mm and deg of a pose': (
        'stamp,' + each('position.{}')
        + ',pose.x [mm],pose.y [mm],pose.z [mm],pose.roll [deg],pose.pitch [deg],pose.yaw [deg]',
        [TIMES, Q, RPY], {},
    ),
    'mm and deg behind': (
        'stamp,' + each('{}_rad') + ',x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg',
        [TIMES, Q, RPY], {},
    ),
    'mm beside a quaternion': (
        'stamp,' + each('{}_rad') + ',x_mm,y_mm,z_mm,' + QXYZW,
        [TIMES, Q, QUATERNION * [1e3, 1e3, 1e3, 1, 1, 1, 1]], {},
    ),
    'centimetres': (
        'stamp,' + each('{}_rad') + ',X (cm),Y (cm),Z (cm),rx (rad),ry (rad),rz (rad)',
        [TIMES, Q, VECTOR * [100, 100, 100, 1, 1, 1]], {},
    ),
    'the unit of heads beside a kind': (
        'stamp,' + each('{}') + ',x [mm],y [mm],z [mm],rx [deg],ry [deg],rz [deg]',
        [TIMES, Q, RPY], {'pose_format': 'rpy'},
    ),
    'velocities by numbers': (
        'time,' + numbered('q{} [deg]') + ',' + numbered('qd{} [deg/s]'),
        [TIMES, DEG * Q, DEG * Q], {},
    ),
    'velocities by name': (
        'stamp,' + each('position.{}_deg') + ',' + each('velocity.{}_deg_s'),
        [TIMES, DEG * Q, DEG * Q], {},
    ),
    'ms': ('time [ms],' + each('{}_rad'), [1e3 * TIMES, Q], {}),
    'us behind': ('timestamp_us,' + each('{}_rad'), [1e6 * TIMES, Q], {}),
    'ns behind': ('stamp_ns,' + each('position.{}'), [1e9 * TIMES, Q], {}),
    'semicolons': (('t;' + each('{}_deg')).replace(',', ';'), [TIMES, DEG * Q], {}),
    'tabs and spaces in heads': (
        ('Time (s),' + numbered('Joint {} (deg)')).replace(',', '\t'), [TIMES, DEG * Q], {},
    ),
    'poses that are commanded': (
        'stamp,' + each('{}') + ',target_x,target_y,target_z,target_rx,target_ry,target_rz',
        [TIMES, np.hstack([Q, VECTOR])], {},
    ),
    'a pose that is not asked for': (
        'stamp,' + each('position.{}') + ',b.x,b.y,b.z,b.rx,b.ry,b.rz',
        [TIMES, np.hstack([Q, VECTOR])], {'columns': 'position=position.'},
    ),
    'aligned blanks': (
        ('stamp,' + each('position.{}')).replace(',', '   '), [TIMES, Q], {},
    ),
    'no stamps': (numbered('theta_{}_deg'), [DEG * Q], {'stamps': 'none'}),
}  # fmt: skip


def read(tmp_path, text, robot=UR, **options):
    file = tmp_path / 'table.csv'
    file.write_text(text, encoding='utf-8')
    wanted = {key: OPTIONS.get(key, str)(word) for key, word in options.items()}
    with open_source(file, Selection(robot, **wanted)) as source:
        blocks, track = list(source.blocks), source.poses()
    return (np.concatenate([getattr(one, field) for one in blocks])
            for field in ('stamps', 'positions', 'velocities')), track, source.remarks  # fmt: skip


def table(head, *columns):
    delimiter = next((sign for sign in (';', '\t', '   ') if sign in head), ',')
    rows = np.hstack([np.asarray(one, dtype=object) for one in columns])
    cells = (one if isinstance(one, str) else f'{one:.12g}' for one in rows.ravel())
    cells = np.array(list(cells), dtype=object).reshape(rows.shape)
    return '\n'.join([head, *(delimiter.join(row) for row in cells)])


@pytest.mark.parametrize('name', READ)
def test_heads_are_read(tmp_path, name):
    head, columns, options = READ[name]
    (stamps, q, qdot), track, _ = read(tmp_path, table(head, *columns), **options)
    if options.get('stamps') != 'none':
        assert stamps.tolist() == [1_500_000_000, 2_500_000_000]
    assert q == pytest.approx(Q, abs=PRINTED)
    if len(columns) > 2 and columns[2].shape == Q.shape and 'velocit' in name:
        assert qdot == pytest.approx(Q, abs=PRINTED)
    elif len(columns) > 2:
        assert track.poses == pytest.approx(T, abs=PRINTED)
    else:
        assert track is None


def test_numbers_beside_names_are_no_joints(tmp_path):
    for head, robot in (('t,q0,q1', 'planar_2r'), ('t,x,y,z,q1,q2,q3,q4', 'scara_hsr065')):
        text = table(head, np.full((2, head.count(',') + 1), 0.1))
        with refused(RecordingError, 'missing-column'):
            read(tmp_path, text, robot_of(robot), joint_format='rad')


def test_sliding_joints_have_their_own_unit(tmp_path):
    units = ('mm' if slides else 'deg' for slides in SCARA.prismatic)
    head = ','.join(f'{name} [{unit}]' for name, unit in zip(SCARA.joint_names, units))
    (_, q, _), _, _ = read(tmp_path, table(f't,{head}', TIMES, SLIDES * IN_MM), SCARA)
    assert q == pytest.approx(SLIDES, abs=PRINTED)
    wrong = head.replace('mm', 'deg')
    with refused(RecordingError, 'unknown-unit', "'deg'", 'm, mm'):
        read(tmp_path, table(f't,{wrong}', TIMES, SLIDES * IN_MM), SCARA)


DEGREES = 'stamp,' + each('{}_deg')
# Head, options, code of the error, a word of its text.
REFUSED = {
    'a unit left out': (
        'stamp,' + each('{}_deg', NAMES[:5]) + f',{NAMES[5]}', {}, 'mixed-units', '=deg',
    ),
    'heads against an option': (
        DEGREES, {'joint_format': 'rad'}, 'conflict', '--joint-format rad',
    ),
    'a speed as a position': ('stamp,' + each('{} [deg/s]'), {}, 'unknown-unit', "'deg/s'"),
    'a length of a turning joint': ('stamp,' + each('{}_mm'), {}, 'unknown-unit', "'mm'"),
    'gon': ('stamp,' + each('{} [gon]'), {}, 'unknown-unit', "'gon'"),
    'numbers without a unit': ('t,' + numbered('q{}'), {}, 'missing-unit', '--joint-format rad'),
    'seven numbers': ('stamp,' + each('q{}', range(7)), {}, 'missing-column', "'position.sho"),
    'two families': ('stamp,' + numbered('q{}') + ',' + numbered('J{}'), {}, 'missing-column', ''),
    'numbers with a gap': (
        'stamp,' + each('q{}', [1, 2, 3, 4, 5, 7]), {}, 'missing-column', "'position.sho",
    ),
    'targets': ('stamp,' + numbered('target_q{}'), {}, 'missing-column', "'position.sho"),
    'speeds of another unit': (
        'stamp,' + each('position.{}_deg') + ',' + each('velocity.{} [rad/s]'),
        {}, 'mixed-units', 'rad/s',
    ),
    'speeds in degrees alone': (
        'stamp,' + each('position.{}') + ',' + each('velocity.{}_deg/s'),
        {}, 'mixed-units', 'deg/s',
    ),
    'speeds against an option': (
        'stamp,' + each('position.{}') + ',' + each('velocity.{} [rad/s]'),
        {'joint_format': 'deg'}, 'mixed-units', 'rad/s',
    ),
    'rpm': (
        'stamp,' + each('position.{}') + ',' + each('velocity.{} [rpm]'), {}, 'mixed-units', 'rpm',
    ),
    'cells too many': (
        'stamp,' + each('position.{}') + '\n1,' + '0,1,' * 6, {}, 'wrong-length', '14 cells',
    ),
    'stamps of two units': (
        'time_ms,' + each('{}_rad'), {'stamps': 's'}, 'conflict', '--stamps s',
    ),
    'stamps in hours': ('time [h],' + each('{}_rad'), {}, 'unknown-unit', "'h'"),
    'x in mm, y in m': (
        'stamp,' + each('{}_rad') + ',x_mm,y_m,z_mm,' + QXYZW, {}, 'mixed-units', 'y_m',
    ),
    'heads of a pose against an option': (
        'stamp,' + each('{}_rad') + ',x_cm,y_cm,z_cm,' + QXYZW, {'pose_format': 'mm'},
        'conflict', '--pose-format mm',
    ),
    'angles in mm': (
        'stamp,' + each('{}_rad') + ',x_mm,y_mm,z_mm,rx_mm,ry_mm,rz_mm', {},
        'unknown-unit', "'mm'",
    ),
    'poses with names without joints': (
        'image,' + ','.join(f'pose.{end}' for end in ('x,y,z,' + QXYZW).split(',')),
        {'stamps': 'none'}, 'missing-column', 'ik --one',
    ),
    'poses without joints': (
        'image,x,y,z,' + QXYZW, {'stamps': 'none'}, 'missing-column', 'ik --one',
    ),
}  # fmt: skip


@pytest.mark.parametrize('name', REFUSED)
def test_heads_are_refused_with_the_reason(tmp_path, name):
    head, options, code, word = REFUSED[name]
    count = head.count(',') + 1
    with refused(RecordingError, code, 'table.csv:', word):
        read(tmp_path, table(head, np.full((2, count), 0.1)), **options)


@pytest.mark.parametrize(
    ('first', 'second', 'expected'),
    [
        ('2024-09-24T14:05:15.1Z', '2024-09-24T14:05:16.25Z', (1727186715.1, 1.15)),
        ('2024-09-24 14:05:15.1', '2024-09-24 14:05:16', (1727186715.1, 0.9)),
        ('2024-09-24T14:05:15+02:00', '2024-09-24T14:05:16+0200', (1727179515, 1)),
        ('2024-09-24 14:05:15 UTC', '2024-09-24 14:05:15.000000001 UTC', (1727186715, 1e-9)),
        ('09/24/2024 14:05:15', '', None),
        ('24.09.2024 14:05', '', None),
        ('2024-13-24T14:05:15', '', None),
        ('14:05:15.1', '', None),
    ],
)
def test_dates_are_stamps(tmp_path, first, second, expected):
    text = table('time,' + each('{}_rad'), [[first], [second]], Q)
    if expected is None:
        with refused(RecordingError, 'not-a-time', "'time'", 'date'):
            read(tmp_path, text)
        return
    (stamps, _, _), _, _ = read(tmp_path, text)
    assert stamps[0] == pytest.approx(expected[0] * 1e9, abs=200)
    assert np.diff(stamps).tolist() == [round(expected[1] * 1e9)]


@pytest.mark.parametrize(
    ('head', 'columns', 'words', 'has_poses'),
    [
        ('t,' + numbered('q{}_rad'), [Q], ('q1, q2', 'shoulder_pan_joint'), False),
        ('t,' + each('{}') + ',tcp x,tcp y,tcp z,tcp rx,tcp ry,tcp rz', [Q, VECTOR],
         ('tcp x', 'rotvec'), True),
        ('t,' + each('{}') + ',a.x,a.y,a.z,a.rx,a.ry,a.rz,b.x,b.y,b.z,b.rx,b.ry,b.rz',
         [Q, VECTOR, VECTOR], ('pose=a.', 'pose=b.'), False),
    ],
)  # fmt: skip
def test_what_is_guessed_is_said(tmp_path, head, columns, words, has_poses):
    _, track, remarks = read(tmp_path, table(head, TIMES, *columns))
    assert any(all(word in one.text for word in words) for one in remarks), remarks
    assert (track is not None) == has_poses
