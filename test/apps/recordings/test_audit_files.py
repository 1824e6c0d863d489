# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The files an audit reads and writes: bags, tables, plans, pages; and what it says of bad ones.
"""

import hashlib
import json
import math
import re
import sqlite3
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from arms import robot_of
from audits import JOINT_STATE, document, header, joint_states, refusal, run, write_bag
from chromium import chromium_tab
from recordings import BEGIN, PR2, SECOND, awkward, motion, recorded, samples_of
from refusal import refused
from refused_files import refuse

import kinematics_service as ks
from kinematics_service.apps.checking.pose_format import PoseFormat
from kinematics_service.apps.recordings.audit.curves import curve_of
from kinematics_service.apps.recordings.audit.findings import seconds
from kinematics_service.apps.recordings.audit.report.charts import (
    AIR,
    Chart,
    LevelLine,
    ValueScale,
)
from kinematics_service.apps.recordings.audit.report.page_header import origin_of
from kinematics_service.apps.recordings.audit.report.tables import NOTHING, TableColumn, table_of
from kinematics_service.apps.recordings.readers.between_points import PlannedTrajectory, sampled
from kinematics_service.apps.recordings.readers.joint_format import JointFormat
from kinematics_service.apps.recordings.readers.open_file import open_source
from kinematics_service.apps.recordings.readers.source import Selection
from kinematics_service.apps.recordings.readers.stamp_format import StampFormat
from kinematics_service.apps.recordings.readers.yaml_values import read_documents
from kinematics_service.errors import RecordingError
from kinematics_service.estimation.estimator import Estimator, EstimatorOutput, EstimatorSettings
from kinematics_service.estimation.status_text import singularity_status
from kinematics_service.robot.file.text.yaml_reader import YamlError
from kinematics_service.version import __version__

POINT = 'trajectory_msgs/msg/JointTrajectoryPoint'
JOINTS = 'stamp,position.q1,position.q2\n'
# The first bytes of an MCAP file.
MCAP = b'\x89MCAP0\r\n' + bytes(8)


# Bags


@pytest.mark.slow
@pytest.mark.parametrize('plugin', ['MCAP', 'SQLITE3'])
def test_a_bag_is_read_as_directory_and_as_single_file(tmp_path, capsys, store, plugin):
    robot = robot_of('planar_2r')
    samples = sorted(awkward(robot), key=lambda one: one.received)
    bag = write_bag(tmp_path / 'bag', store, joint_states(store, samples), plugin)
    whole = document(capsys, bag, '--robot', 'planar_2r')
    single = next(bag.glob('*.mcap' if plugin == 'MCAP' else '*.db3'))
    alone = document(capsys, single, '--robot', 'planar_2r')
    assert whole['series'] == alone['series']
    assert whole['messages']['total'] == len(samples)


def test_of_two_topics_one_must_be_chosen(tmp_path, capsys, store):
    robot = robot_of('planar_2r')
    samples = samples_of(robot, *motion(robot, 30))
    states = [*joint_states(store, samples, '/a'), *joint_states(store, samples, '/b')]
    bag = write_bag(tmp_path / 'bag', store, states)
    text = refusal(capsys, bag, '--robot', 'planar_2r')
    assert text == f'{bag}: several topics have JointState; choose one with --topic (/a, /b)'
    refuse(bag, 'ambiguous')
    assert document(capsys, bag, '--robot', 'planar_2r', '--topic', '/b')['topic'] == '/b'
    refuse(bag, 'unknown-name', 'topic /c', '/a, /b', topic='/c')
    refuse(bag, 'wrong-type', '/a', JOINT_STATE, 'no topic', topic='/a', pose_topic='/a')


def test_a_bag_without_joint_states_names_what_it_has():
    pytest.importorskip('rosbags', reason='needs rosbags')
    path = recorded('dmp_ros1_bags_malformed/C-Shape-1_poses.bag')
    refuse(path, 'missing-topic', '/pose (geometry_msgs/msg/PoseStamped)', robot='kuka_iiwa14')


def test_a_bag_with_unknown_types_is_read(capsys, tmp_path):
    pytest.importorskip('rosbags', reason='needs rosbags')
    file = tmp_path / 'pr2.yaml'
    file.write_text(PR2.format(side='r', y=-0.188))
    path = recorded('pr2_jsk_ros1_bags/pr1012_deb3032.bag')
    found = document(capsys, path, '--robot', file)
    assert found['messages']['total'] == 280
    assert found['messages']['states'] > 250


@pytest.mark.slow
def test_damaged_bags_are_refused_in_a_sentence(tmp_path, capsys, store):
    robot = robot_of('planar_2r')
    samples = samples_of(robot, *motion(robot, 600))
    bag = write_bag(tmp_path / 'bag', store, joint_states(store, samples))
    data = next(bag.glob('*.mcap')).read_bytes()
    cut = tmp_path / 'cut.mcap'
    cut.write_bytes(data[: len(data) // 2])
    refuse(cut, 'unreadable', 'mcap recover')
    random = np.random.default_rng(0)
    for size in (1, 8, 9, 50, 300):
        cut.write_bytes(data[:size])
        refusal(capsys, cut, '--robot', 'planar_2r')
    for _ in range(10):
        broken = bytearray(data)
        for at in random.integers(0, len(data), 40):
            broken[at] ^= 255
        cut.write_bytes(broken)
        code, _, err = run(capsys, cut, '--robot', 'planar_2r')
        assert code == 0 or len(err.strip().splitlines()) == 1
    other = tmp_path / 'other.db3'
    sqlite3.connect(other).execute('create table a (b)')
    refuse(other, 'unreadable')


@pytest.mark.parametrize(
    ('name', 'content', 'code', 'words'),
    [
        ('empty.mcap', b'', 'empty', ()),
        ('wrong.db3', MCAP, 'wrong-kind', ('sqlite3',)),
        ('renamed.csv', MCAP, 'wrong-kind', ('*.mcap',)),
        ('renamed', MCAP, 'wrong-kind', ('*.mcap',)),
        ('a.doc', b'hello', 'unsupported', ('.doc', '.csv')),
        ('a', b'hello', 'unsupported', ('suffix', '.csv')),
    ],
)
def test_files_of_no_accepted_kind_are_refused(tmp_path, name, content, code, words):
    pytest.importorskip('rosbags', reason='needs rosbags')
    (tmp_path / name).write_bytes(content)
    refuse(tmp_path / name, code, *words)


def test_a_folder_without_bag_and_dataset_is_refused(tmp_path):
    pytest.importorskip('rosbags', reason='needs rosbags')
    refuse(tmp_path, 'wrong-kind', 'metadata.yaml', 'meta/info.json')


@pytest.mark.parametrize(
    ('name', 'wanted', 'option'),
    [
        ('run.csv', {'topic': '/a'}, '--topic'),
        ('run.csv', {'pose_topic': '/a'}, '--pose-topic'),
        ('run.mcap', {'columns': 'position=q'}, '--columns'),
        ('run.mcap', {'stamps': StampFormat('ms')}, '--stamps'),
        ('run.mcap', {'joint_format': JointFormat('deg')}, '--joint-format'),
        ('run.mcap', {'pose_format': PoseFormat('rpy')}, '--pose-format'),
    ],
)
def test_options_for_other_kinds_of_files_are_refused(tmp_path, name, wanted, option):
    (tmp_path / name).write_bytes(MCAP if name.endswith('.mcap') else b'stamp\n')
    refuse(tmp_path / name, 'conflict', f'{option} ', **wanted)


def test_a_missing_file_is_refused_in_one_line(tmp_path, capsys):
    file = tmp_path / 'none.csv'
    assert refusal(capsys, file, '--robot', 'planar_2r') == (
        f'{file}: there is no such file; give one of MCAP (.mcap), rosbag2 (a directory or .db3), '
        'ROS 1 bags (.bag), tables (.csv), and planned trajectories (.yaml, .json)'
    )


def test_a_bag_without_messages_is_refused(tmp_path, store):
    bag = write_bag(tmp_path / 'bag', store, [('/joint_states', JOINT_STATE, 0, None)])
    refuse(bag, 'empty', '/joint_states')


# Tables


@pytest.mark.slow
def test_a_table_of_the_controller_and_a_bag_of_it_are_the_same(capsys):
    pytest.importorskip('rosbags', reason='needs rosbags')
    table = recorded('ur3e_rad/rad_ur3e_25hz.csv')
    bag = recorded('derived_ros2_bags/rad_ur3e_mcap')
    one = document(capsys, table, '--robot', 'ur3e')
    other = document(capsys, bag, '--robot', 'ur3e', '--pose-topic', '/reference_pose')
    assert one['series']['stamp'] == other['series']['stamp']
    np.testing.assert_allclose(one['series']['position'], other['series']['position'], atol=1e-8)
    errors = [found['frames']['errors']['position_rms'] for found in (one, other)]
    assert errors[0] == pytest.approx(errors[1], abs=1e-6)
    assert errors[0] < 5e-4
    assert one['frames']['causes'] == other['frames']['causes'] == []


def test_columns_are_found_by_what_they_begin_with(tmp_path, capsys):
    robot = robot_of('planar_2r')
    t, q, qdot = motion(robot, 50)
    poses = ks.forward_kinematics(robot, q)
    lines = ['time;motor1;motor2;speed1;speed2;p_x;p_y;p_z;p_rx;p_ry;p_rz']
    for k in range(50):
        angle = float(np.sum(q[k]))
        cells = [1.7e9 + t[k], *q[k], *qdot[k], *poses[k, :3, 3], 0.0, 0.0, angle]
        lines.append(';'.join(map(repr, map(float, cells))))
    file = tmp_path / 'own.csv'
    file.write_text('\n'.join(lines))
    columns = 'stamp=time,position=motor,velocity=speed,pose=p_'
    found = document(capsys, file, '--robot', 'planar_2r', '--columns', columns)
    assert found['series']['q'] == q.tolist()
    assert found['series']['qdot'] == qdot.tolist()
    assert found['frames']['as_given']['position_max'] < 1e-12
    refuse(file, 'missing-column', "'position.q1'", "'time', 'motor1'")
    for words, code in (('when=time', 'unknown-key'), ('time', 'syntax')):
        with refused(RecordingError, code, f'--columns: {words!r}', 'position='):
            read_columns(file, words)


def read_columns(file, columns):
    with open_source(file, Selection(robot_of('planar_2r'), columns=columns)):
        pass


@pytest.mark.parametrize(
    ('text', 'code', 'words'),
    [
        ('', 'empty', ()),
        ('stamp,position.q1,position.q2\n', 'empty', ('header',)),
        (f'{JOINTS}1,2,x\n2,3,4\n', 'not-a-number', (":2: column 'position.q2'", "'x'")),
        (f'{JOINTS}1,1_0,3\n', 'not-a-number', ("'1_0'",)),
        (f'{JOINTS}1,2,\u0663\n', 'not-a-number', ("'\\u0663'",)),
        (f'{JOINTS}1_7,2,3\n', 'not-a-time', ("'1_7'",)),
        (f'{JOINTS}\u0661,2,3\n', 'not-a-time', ("'\\u0661'",)),
        (f'{JOINTS}now,2,3\n', 'not-a-time', (":2: column 'stamp'", "'now'")),
        (f'{JOINTS}1,2\n2,3,4\n', 'wrong-length', (':2: 2 cells',)),
        ('stamp,stamp,position.q2\n1,2,3\n', 'duplicate-name', ("'stamp'",)),
        (b'\xff\xfe', 'encoding', ('UTF-8',)),
    ],
)
def test_a_bad_table_is_refused_with_its_line(tmp_path, text, code, words):
    file = tmp_path / 'bad.csv'
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    refuse(file, code, *words)


def test_nanoseconds_missing_cells_and_a_cut_last_line_do_no_harm(tmp_path, capsys):
    file = tmp_path / 'run.csv'
    rows = [f'1700000000.{k:02d}3456789,0.1,{0.1 * k}' for k in range(9)]
    rows[4] = '1700000000.043456789,,0.4'
    file.write_text('\n'.join(['stamp,position.q1,position.q2', *rows, '1700000000.1,0.2']))
    found = document(capsys, file, '--robot', 'planar_2r')
    assert found['series']['stamp'][0] == 1_700_000_000_003_456_789
    assert found['messages']['by_outcome']['position not finite'] == 1
    last = found['verdict'][-1]
    assert (last['code'], last['sentence'].split(',')[0]) == ('cut-off', 'line 11')


# Plans


def plan(points, names=('q1', 'q2')):
    """Return a trajectory as `ros2 topic echo` prints it."""
    lines = [
        'header:',
        '  stamp:',
        '    sec: 0',
        '    nanosec: 0',
        "  frame_id: ''",
        'joint_names:',
    ]
    lines += [f'- {name}' for name in names] + ['points:']
    for time, positions, velocities in points:
        lines += ['- positions:', *(f'  - {value}' for value in positions)]
        if velocities:
            lines += ['  velocities:', *(f'  - {value}' for value in velocities)]
        else:
            lines += ['  velocities: []']
        lines += ['  accelerations: []', '  effort: []', '  time_from_start:']
        lines += [f'    sec: {int(time)}', f'    nanosec: {round(time % 1 * 1e9)}']
    return '\n'.join([*lines, '---', ''])


STRAIGHT = [(0.0, (0.1, 1.0), ()), (1.5, (0.5, -1.0), ())]  # through q2 = 0, between the points
BENT = [(0.0, (0.1, 1.0), ()), (1.5, (0.5, 2.0), ())]


def test_a_plan_that_passes_a_singularity_between_its_points_fails(tmp_path, capsys):
    file = tmp_path / 'plan.yaml'
    file.write_text(plan(STRAIGHT))
    code, out, _ = run(capsys, file, '--robot', 'planar_2r')
    assert code == 1
    assert 'too close to a singularity' in out
    assert run(capsys, file, '--robot', 'planar_2r', '--fail-on', 'never')[0] == 0
    file.write_text(plan(BENT))
    code, out, _ = run(capsys, file, '--robot', 'planar_2r')
    assert code == 0
    assert 'No singular pose' in out


def test_yaml_json_and_a_bag_of_a_plan_are_the_same(tmp_path, capsys, store):
    points = [(0.0, (0.1, 1.0), (0.0, 0.0)), (1.5, (0.5, 0.05), (0.2, 0.1)), (2.0, (0, 1), (0, 0))]
    yaml, text = tmp_path / 'plan.yaml', tmp_path / 'plan.json'
    yaml.write_text(plan(points))
    trajectory = {
        'joint_names': ['q1', 'q2'],
        'points': [
            {'positions': p, 'velocities': v, 'time_from_start': {'sec': 0, 'nanosec': t * 1e9}}
            for t, p, v in points
        ],
    }
    text.write_text(json.dumps({'trajectory': {'joint_trajectory': trajectory}}))
    duration = store.types['builtin_interfaces/msg/Duration']
    message = store.types['trajectory_msgs/msg/JointTrajectory'](
        header(store, 0),
        ['q1', 'q2'],
        [
            store.types[POINT](
                np.array(p, float),
                np.array(v, float),
                np.zeros(0),
                np.zeros(0),
                duration(int(t), round(t % 1 * 1e9)),
            )
            for t, p, v in points
        ],
    )
    kind = 'trajectory_msgs/msg/JointTrajectory'
    bag = write_bag(tmp_path / 'bag', store, [('/plan', kind, BEGIN, message)])
    one, two, three = (
        document(capsys, each, '--robot', 'planar_2r') for each in (yaml, text, bag)
    )
    assert one['series'] == two['series'] == three['series']
    assert one['planned']
    assert one['series']['t'][-1] == pytest.approx(2.0)
    q, t = np.array(one['series']['q']), np.array(one['series']['t'])
    for time, positions, _ in points:
        np.testing.assert_allclose(q[np.argmin(abs(t - time))], positions, atol=1e-9)


def test_between_points_runs_the_polynomial_of_its_conditions():
    times = np.array([0.0, 0.7, 2.0])
    random = np.random.default_rng(0)
    p, v, a = random.normal(size=(3, 3, 2))
    for velocities, accelerations in ((None, None), (v, None), (v, a)):
        samples = sampled(PlannedTrajectory(('a', 'b'), times, p, velocities, accelerations))
        for time, position in zip(times, p):
            k = int(np.argmin(abs(samples.times - time)))
            np.testing.assert_allclose(samples.positions[k], position, atol=1e-12)
            if velocities is not None:
                own = int(np.flatnonzero(times == time)[0])
                np.testing.assert_allclose(samples.velocities[k], v[own], atol=1e-12)
        # Velocities are the differences of positions.
        middle = 0.5 * (samples.velocities[1:] + samples.velocities[:-1])
        steps = np.diff(samples.positions, axis=0) / np.diff(samples.times)[:, None]
        same = np.abs(middle - steps) < 1e-3 * np.max(np.abs(v)) + 1e-9
        assert np.mean(same) > 0.95


@pytest.mark.parametrize(
    ('text', 'code', 'words'),
    [
        ('a: 1\n', 'missing-key', ('JointTrajectory', 'joint_names')),
        ('', 'empty', ()),
        (plan([]), 'empty', ('points',)),
        (plan(BENT, ('q1', 'other')), 'missing-joint', ('q2 of planar_2r', 'q1, other')),
        (plan([(0.0, (1.0,), ())]), 'wrong-length', ('points[0]: positions', '1 number', '2')),
        (
            plan([(0.0, (0.0, 1.0), (0.1,)), (1.0, (0.5, 1.0), (0.0, 0.0))]),
            'wrong-length',
            ('points[0]: velocities', '1 number'),
        ),
        (
            plan([(0.0, (0.0, 1.0), (0.1, 0.1)), (1.0, (0.5, 1.0), ())]),
            'wrong-length',
            ('points[1]: velocities', '0 numbers', 'at all points'),
        ),
        (plan([BENT[0], BENT[0]]), 'wrong-order', ('points[1]: time_from_start', 'points[0]')),
        (plan([(2e6, (0.0, 1.0), ())]), 'out-of-range', ('time_from_start', '1e6')),
        (
            plan(BENT).replace('positions', 'position'),
            'unknown-key',
            ("'position'", "'positions'"),
        ),
        (plan([(0.0, ('.nan', 1), ())]), 'not-finite', ('positions',)),
        ('joint_names: [a\n', 'syntax', ('plan.yaml:2: ',)),
        ('a: 1\nb: &b 1\n', 'syntax', ('plan.yaml:2: ', "'&b'")),
        ('a: *b\n', 'syntax', ('plan.yaml:1: ', "'*b'")),
        ('a: !!python/name:os.system\n', 'syntax', ('plan.yaml:1: tags',)),
        ('%YAML 1.1\n---\na: 1\n', 'syntax', ('%YAML',)),
        ('a: 1\nb: 2\na: 3\n', 'syntax', ('plan.yaml:3: ', "'a'")),
        ('a: ' + 60 * '[' + 60 * ']', 'syntax', ('plan.yaml:1: ', '40 deep')),
        ('a: 1\nb: \x07\n', 'syntax', ('plan.yaml:2: ', r"'\x07'")),
        ('\ta: 1\n', 'syntax', ('spaces',)),
        (plan([(0.0, ('1_0', 1), ())]), 'not-a-number', ('points[0]: positions',)),
        (plan([(0.0, ('"1"', 1), ())]), 'not-a-number', ('points[0]: positions',)),
    ],
)
def test_a_bad_plan_is_refused_in_a_sentence(tmp_path, text, code, words):
    file = tmp_path / 'plan.yaml'
    file.write_text(text)
    refuse(file, code, *words)


def test_the_reader_of_plans_agrees_with_another_one():
    yaml = pytest.importorskip('ruamel.yaml').YAML(typ='safe', pure=True)
    texts = [
        plan(STRAIGHT),
        'a: [1, 2,\n  3]\nb: {c: 1.5, d: [x, "y, z"]}\n',
        '- - 1\n  - -2e-3\n- - .5\n',
        'a:\n  b:\n  - c: 1\n    d:\n    - 2\n  e: ~\n',
        'a: 1 # one\n# two\nb: "c # d"\n',
        "names: ['a/b', c-d, e.f, it's, 'it''s']\n- \"q\"   # shoulder\n".replace('- "', 'x: "'),
        '{a: 1, b: [2]}\n',
        'a: |\n  two\n  lines\nb: >-\n  one\n  line\n---\nc: [1e-3, 1E5, +7, -.25, 3.]\n',
    ]
    for text in texts:
        complete = [one for one in yaml.load_all(text) if one is not None]
        assert read_documents(text) == complete, text
    random = np.random.default_rng(0)
    letters = list('ab:-[]{},\'"# \n\n  1.\t&*!%?|>')
    refusals = []
    for _ in range(800):
        text = ''.join(random.choice(letters, random.integers(1, 40)))
        try:
            read_documents(text)
        except YamlError as error:
            refusals.append(str(error))
    assert len(refusals) > 100
    assert all(re.match(r'\d+: ', refusal) for refusal in refusals)


def test_a_plan_written_by_hand_is_read_as_it_is_meant(tmp_path, capsys):
    file = tmp_path / 'plan.yaml'
    file.write_text(
        '# the gripper\'s way home\njoint_names:\n- "q1"   # the base\n- q2  # don\'t move it\n'
        'points:\n'
        '- {positions: [-2e-1, 1.25], time_from_start: 0.0}\n'
        "- positions:   # it's near\n  - 4e-1\n  - 1.5\n  time_from_start: {sec: 2, nanosec: 0}\n"
    )
    found = document(capsys, file, '--robot', 'planar_2r')
    assert found['series']['q'][0] == [-0.2, 1.25]
    assert found['series']['q'][-1] == [0.4, 1.5]
    assert found['series']['t'][-1] == 2.0


NAMES = '"joint_names": ["q1", "q2"]'


@pytest.mark.parametrize(
    ('text', 'code', 'words'),
    [
        ('{', 'syntax', ()),
        (f'{{{NAMES}, "points": [{{"time_from_start": 0}}]}}', 'missing-key', ('positions',)),
        (f'{{{NAMES}, "points": [], "points": []}}', 'duplicate-key', ("'points'",)),
        (f'{{{NAMES}, "points": 3}}', 'wrong-type', ('points',)),
        ('{"joint_names": "q1", "points": []}', 'wrong-type', ('joint_names',)),
        *(
            (
                f'{{{NAMES}, "points": [{{"positions": [{one}, 0.5], "time_from_start": 0}}]}}',
                code,
                ('positions',),
            )
            for one, code in (
                ('true', 'not-a-number'),
                ('"1"', 'not-a-number'),
                (f'1{"0" * 400}', 'not-finite'),
            )
        ),
        (
            f'{{{NAMES}, "points": [{{"positions": [1, 2], "time_from_start": {{"sec": ""}}}}]}}',
            'wrong-type',
            ('points[0]: time_from_start',),
        ),
    ],
)
def test_json_that_python_would_take_and_nobody_means_is_refused(tmp_path, text, code, words):
    file = tmp_path / 'plan.json'
    file.write_text(text)
    refuse(file, code, *words)


def test_a_plan_with_refused_samples_fails_its_gate(tmp_path, capsys):
    file = tmp_path / 'plan.yaml'
    # The cubic between the points swings out far beyond any number the kernel takes.
    swing = [(0.0, (0.1, 1.0), (1e280, 1e280)), (3.0, (0.5, 1.5), (-1e280, -1e280))]
    file.write_text(plan(swing))
    code, out, _ = run(capsys, file, '--robot', 'planar_2r')
    assert code == 1
    first = ' '.join(out.split('\n', 1)[1].split())
    assert first.startswith('ERROR'), first
    assert '1,999 of 2,001 samples (99.9 %): position too large (1,999).' in first
    assert 'OK' not in out
    assert 'at the 2 samples that' in ' '.join(out.split())
    assert run(capsys, file, '--robot', 'planar_2r', '--fail-on', 'limits')[0] == 1
    assert run(capsys, file, '--robot', 'planar_2r', '--fail-on', 'never')[0] == 0
    found = document(capsys, file, '--robot', 'planar_2r')
    assert (found['level'], found['messages']['refused']) == ('ERROR', 1999)


@pytest.mark.parametrize(('broken', 'level'), [(2, 'OK'), (7, 'WARN')])
def test_a_recording_says_how_much_of_it_could_not_be_judged(tmp_path, capsys, broken, level):
    file = tmp_path / 'run.csv'
    rows = [f'{1e9 + 0.01 * k!r},0.1,1.5' for k in range(2000)]
    for k in range(broken):
        rows[300 + 50 * k] = f'{1e9 + 0.01 * (300 + 50 * k)!r},nan,1.5'
    file.write_text('\n'.join(['stamp,position.q1,position.q2', *rows]))
    found = document(capsys, file, '--robot', 'planar_2r')
    assert found['level'] == found['verdict'][0]['level'] == level
    (told,) = [one for one in found['verdict'] if 'made no new state' in one['sentence']]
    assert told['level'] == level
    share = f'{broken} of 2,000 messages ({0.05 * broken:.2g} %)'
    assert (share in found['verdict'][0]['sentence']) == (level == 'WARN')


def test_what_is_farther_than_any_distance_is_said_to_be(tmp_path, capsys):
    file, page = tmp_path / 'run.csv', tmp_path / 'run.html'
    rows = [f'{1e9 + 0.01 * k!r},0.1,{1.4 + 1e-4 * k!r}' for k in range(200)]
    file.write_text('\n'.join(['stamp,position.q1,position.q2', *rows]))
    code, out, _ = run(capsys, file, '--robot', 'planar_2r', '--html', page)
    assert code == 0
    sentence = 'at its 200 joint states: none found within 1 rad (57 deg) (WARN at 0.1).'
    assert sentence in ' '.join(out.split())
    assert sentence in page.read_text()
    assert '>none found within 1 rad' in page.read_text()
    series = document(capsys, file, '--robot', 'planar_2r')['series']
    assert series['distance'] == [1.0] * 200


# What is written


@pytest.mark.slow
def test_what_is_written_is_what_the_nodes_builders_write(tmp_path, capsys, store):
    serialization = pytest.importorskip('rclpy.serialization', reason='needs ROS 2')
    from built_messages import built

    from kinematics_service.node.messages.messages import StateReport, status_message
    from kinematics_service.node.messages.output_topics import TOPICS
    from kinematics_service.node.parameters.settings import defaults, settings_from

    robot = robot_of('craig_3r')
    samples = sorted(awkward(robot, 7), key=lambda one: one.received)
    bag = write_bag(tmp_path / 'bag', store, joint_states(store, samples))
    out = tmp_path / 'out.mcap'
    assert run(capsys, bag, '--robot', 'craig_3r', '--out', out)[0] == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ['bag', 'out.mcap']
    written = read_back(out)
    settings = settings_from(defaults(robot), robot)
    expected = {name: [] for name in written}
    estimator, stale = Estimator(robot, EstimatorSettings()), False
    for one in samples:
        if not stale and one.arrival - samples[0].arrival > SECOND:
            stale = bool(estimator.joints.missing(one.arrival)) and estimator.go_stale(one.arrival)
        answer = estimator.take(one)
        if not isinstance(answer, EstimatorOutput):
            continue
        stale = False
        report = StateReport(answer, settings)
        for topic in TOPICS:
            name = topic.name.replace('~', '/kinematics')
            message = built(topic, report) if name in expected else None
            if message is not None:
                expected[name].append((one.received, message))
        level, say = estimator.judge(report.singularity, one.arrival)
        if say:
            status_text = singularity_status(robot, report.singularity, level, robot.base_frame)
            status = status_message('kinematics: singularity', status_text)
            expected['/kinematics/singularity/warning'].append((one.received, status))
    assert len(written) == 10
    for name, messages in expected.items():
        read = [
            (stamp, serialization.deserialize_message(raw, type(messages[0][1])))
            for stamp, raw in written[name]
        ]
        if name.endswith('warning'):
            stales = [message for _, message in read if message.level == b'\x03']
            assert len(stales) == 1
            read = [pair for pair in read if pair[1].level != b'\x03']
        assert len(read) == len(messages) > 5, name
        for ours, theirs in zip(read, messages):
            assert ours == theirs


def read_back(path):
    """Return stamp and bytes of the messages of each topic."""
    from rosbags.highlevel import AnyReader

    written = {}
    with AnyReader([path]) as reader:
        for connection, stamp, raw in reader.messages():
            written.setdefault(connection.topic, []).append((stamp, bytes(raw)))
    return written


class _Page(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.open, self.attributes, self.words = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.attributes += [(tag, *pair) for pair in attrs]
        if tag not in ('meta', 'br'):
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in ('meta', 'br', 'path', 'rect', 'line'):
            while self.open and self.open[-1] in ('path', 'rect', 'line'):
                self.open.pop()
            assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)


def test_the_page_is_self_contained_and_the_verdict_comes_first(tmp_path, capsys):
    robot = robot_of('puma560')
    t, q, qdot = motion(robot, 200, 50.0, 3)
    names = ','.join([f'position.{n}' for n in robot.joint_names])
    file, html = tmp_path / 'a<b>.csv', tmp_path / 'page.html'
    rows = [','.join(map(repr, map(float, [1.7e9 + s, *row]))) for s, row in zip(t, q)]
    file.write_text('\n'.join([f'stamp,{names}', *rows]))
    assert run(capsys, file, '--robot', 'puma560', '--html', html)[0] == 0
    text = html.read_text()
    assert len(text) < 1_000_000
    assert '<b>.csv' not in text
    page = _Page(text)
    assert not [one for one in page.attributes if one[1] in ('src', 'href', 'xlink:href')]
    assert not re.search(r'url\(|@import|fetch\(|https?://', text)
    words = ' '.join(' '.join(page.words).split())
    verdict = words.index('singular')
    assert verdict < words.index('Near singularities') < words.index('Joints')
    assert 'nan' not in words.lower().split()
    for unit in (', rad', ', deg', ', m', ', m/s', 't, s', ', ms'):
        assert unit in words
    assert not re.search(r'd="[^"]*nan', text)
    again = run(capsys, file, '--robot', 'puma560', '--html', file, code := '--json')
    assert again[0] == 2
    assert code


def test_the_head_of_the_page_says_what_was_judged_by_what(tmp_path, capsys):
    file, html = tmp_path / 'day 7.csv', tmp_path / 'page.html'
    rows = [f'{1.9e9 + 0.02 * k:.2f},{0.01 * k:.2f},{0.7 - 0.03 * k:.2f}' for k in range(40)]
    file.write_text('\n'.join(['stamp,position.q1,position.q2', *rows]))
    table = ks.bundled_robots()['planar_2r']
    base = (file, '--robot', 'planar_2r', '--warn', '0.27', '--stop', '0.013', '--html', html)
    assert run(capsys, *base)[0] == 0
    text = html.read_text()
    head = text[text.index('<h1>') : text.index('class="verdict')]
    for path in (file, table):
        assert hashlib.sha256(path.read_bytes()).hexdigest() in head
    for words in ('day 7.csv', 'planar_2r', __version__, '0.27 rad', '0.013 rad'):
        assert words in head
    assert re.search(r'<dt>date</dt><dd>20\d\d-\d\d-\d\d \d\d:\d\d:\d\d[-+]', head)
    assert '; ERROR</span>' in text.replace('&#9632', '')
    assert 'bad</span>' not in text


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.parametrize(('width', 'media'), [(500, 'screen'), (703, 'print')])
def test_the_page_does_not_scroll_sideways(width, media, tmp_path, capsys):
    # 703 px are the 186 mm between the margins of A4.
    robot = robot_of('ur10e')
    t, q, _ = motion(robot, 100, 50.0, 3)
    file, html = tmp_path / 'run.csv', tmp_path / 'page.html'
    names = ','.join(f'position.{name}' for name in robot.joint_names)
    rows = [','.join(map(repr, map(float, [1.9e9 + s, *row]))) for s, row in zip(t, q)]
    file.write_text('\n'.join([f'stamp,{names}', *rows]))
    assert run(capsys, file, '--robot', 'ur10e', '--html', html)[0] == 0
    with chromium_tab() as tab:
        tab.open(html.as_uri(), width, 900)
        tab.call('Emulation.setEmulatedMedia', media=media)
        tab.wait_for('document.querySelector("dl.origin") !== null', 'the head')
        assert tab.evaluate('document.documentElement.scrollWidth') <= width
        assert tab.errors == []


def test_the_same_audit_of_the_same_day_is_the_same_page(tmp_path):
    file = tmp_path / 'run.csv'
    file.write_text('stamp,position.q1,position.q2\n1,0,1\n1.5,0.1,0.9\n2,0.2,0.8\n')
    origin = origin_of(file, 'planar_2r', '2031-02-03 04:05:06+00:00')
    assert origin == origin_of(file, 'planar_2r', '2031-02-03 04:05:06+00:00')
    assert origin.robot_sha256 != origin.recording_sha256


@pytest.mark.parametrize(('low', 'high'), [(17.0, 24.0), (2.0, 8.0), (0.9, 1.1), (3.0, 30.0)])
def test_a_logarithmic_axis_has_more_than_one_number(low, high):
    values, begins = np.geomspace(low, high, 50), np.zeros(50, dtype=bool)
    curve = curve_of('x', 'c0', 49.0, [(np.arange(50.0), values, begins)])
    chart = Chart('x', 'ms', [curve], log=True, end=49.0)
    assert chart.html().count('class="y"') >= 2


def test_exit_codes_say_what_was_asked_for(tmp_path, capsys):
    robot = robot_of('planar_2r')
    t, q, _ = motion(robot, 200)
    q[:, 1] = np.linspace(1.0, -1.0, 200)
    file = tmp_path / 'run.csv'
    rows = [f'{1.7e9 + s!r},{a!r},{b!r}' for s, (a, b) in zip(t.tolist(), q.tolist())]
    file.write_text('\n'.join(['stamp,position.q1,position.q2', *rows]))
    base = (file, '--robot', 'planar_2r')
    assert run(capsys, *base)[0] == 0
    assert run(capsys, *base, '--fail-on', 'stop')[0] == 1
    assert run(capsys, *base, '--fail-on', 'limits')[0] == 0
    assert run(capsys, *base, '--fail-on', 'warn', '--warn', '1e-5', '--stop', '1e-6')[0] == 0
    assert run(capsys, *base, '--fail-on', 'sometimes')[0] == 2
    assert run(capsys, *base, '--warn', '-1')[0] == 2
    code, _, err = run(capsys, *base, '--warn', '1.5')
    assert code == 2
    for words in ('--warn, --stop: ', 'at most 1 rad', '1.5 rad'):
        assert words in ' '.join(err.split())
    assert run(capsys, *base, '--timeout', '0')[0] == 2
    assert run(capsys, file, '--robot', 'nothing')[0] == 2
    assert math.isfinite(t[-1])


@pytest.mark.slow
def test_importing_the_command_stays_light():
    import subprocess
    import sys

    code = 'import kinematics_service.cli.commands, sys; print(*sys.modules)'
    loaded = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True)
    assert not {
        'rosbags',
        'kinematics_service.apps.recordings.audit',
        'kinematics_service.apps.checking',
    } & set(loaded.stdout.split())


def test_no_curve_of_three_has_the_colour_of_a_threshold():
    sheet = Path(ks.__file__).parent / 'page.css'
    for colours in sheet.read_text().split('@media')[:2]:
        named = dict(re.findall(r'--(c0|c1|c2|warn|stop): (#[0-9a-f]+);', colours))
        assert len(set(named.values())) == len(named)


def test_one_singular_sample_does_not_squeeze_the_condition_number():
    t, values = np.arange(4.0), np.array([8.0, 12.0, 1e17, 9.0])
    curve = curve_of('condition number', 'c0', 4.0, [(t, values, np.zeros(4, dtype=bool))])
    assert 'data-low="6.35' in Chart('k', '', [curve], log=True, clip=3e3, end=4.0).html()
    assert 'data-low="7.9' in Chart('k', '', [curve], log=True, end=4.0).html()


@pytest.mark.parametrize(('limit', 'high'), [(13.9, 13.9), (14.1, 12.0)])
def test_a_limit_is_on_the_axis_if_it_is_within_half_a_range_of_the_curve(limit, high):
    curve = curve_of(
        'speed', 'c0', 2.0, [(np.arange(2.0), np.array([8.0, 12.0]), np.zeros(2) > 0)]
    )
    scale = ValueScale.of(Chart('speed', '', [curve], levels=[LevelLine(limit, 'limit')]))
    assert scale.high - AIR * (high - 8.0) == pytest.approx(high)


@pytest.mark.parametrize(
    ('time', 'text'), [(59.94, '59.9 s'), (60.0, '1 min 0 s'), (3780.0, '1 h 3 min')]
)
def test_a_duration_is_written_in_its_largest_units(time, text):
    assert seconds(time) == text


def test_a_table_of_a_page_has_no_empty_columns():
    columns = [TableColumn(name, lambda one, name=name: one.get(name, ''), True) for name in 'abc']
    text = table_of(columns, [{'a': '1', 'b': NOTHING}, {'c': '0'}])
    assert re.findall('<th(?: [^>]*)?>(.*?)<', text) == ['a', 'c']
    assert re.findall('<td[^>]*>(.*?)<', text) == ['1', '', '', '0']
