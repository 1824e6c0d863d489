# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Files that are made to cost time or memory, or to be taken for something else, are refused."""

import json
import os
import re
import struct
from dataclasses import replace

import numpy as np
import pytest
from arms import robot_of
from audits import document, joint_states, run, write_bag
from recordings import motion, samples_of
from refusal import refused
from refused_files import refuse

import kinematics_service as ks
from kinematics_service.apps.recordings.readers import plan_reader, table_reader, unpacking
from kinematics_service.apps.recordings.readers.between_points import (
    MAX_SAMPLES,
    MAX_STEP,
    MIN_SAMPLES,
    PlannedTrajectory,
    sampled,
)
from kinematics_service.apps.recordings.readers.open_file import open_source
from kinematics_service.apps.recordings.readers.plan_reader import MAX_FILE_BYTES
from kinematics_service.apps.recordings.readers.recording import read_recording
from kinematics_service.apps.recordings.readers.source import Selection
from kinematics_service.apps.recordings.readers.table_rows import MAX_LINE_LENGTH
from kinematics_service.errors import RecordingError, UrdfError
from kinematics_service.robot.measures import Level

# More than any memory; a file of holes takes no room on a disk.
HUGE = 2**36
# So many names that a search through all of them for each takes an hour.
MANY = 200_000
ROW = 'stamp,position.q1,position.q2\n'


def plan_of(positions, names=('q1', 'q2')):
    points = [
        {'positions': list(q), 'time_from_start': {'sec': k}} for k, q in enumerate(positions)
    ]
    return {'joint_names': list(names), 'points': points}


@pytest.mark.slow
@pytest.mark.timeout(60)
def test_many_names_take_no_longer_than_they_are_many(tmp_path):
    keys = ','.join(f'"k{k}": 1' for k in range(MANY))
    (tmp_path / 'plan.json').write_text(f'{{{keys}, "k{MANY - 1}": 2}}')
    refuse(tmp_path / 'plan.json', 'duplicate-key', f'k{MANY - 1}')
    columns = ','.join(f'c{k}' for k in range(80_000))
    (tmp_path / 'table.csv').write_text(f'stamp,{columns},c79999\n1\n')
    refuse(tmp_path / 'table.csv', 'duplicate-name', 'c79999')


@pytest.mark.slow
@pytest.mark.parametrize(
    ('name', 'head', 'code', 'limit'),
    [
        ('plan.json', '{', 'too-large', f'{MAX_FILE_BYTES >> 20} MiB'),
        ('plan.yaml', 'a: 1\n', 'too-large', f'{MAX_FILE_BYTES >> 20} MiB'),
        ('table.csv', '', 'syntax', '1 MiB'),
        ('table.csv', ROW, 'syntax', '1 MiB'),
        ('table.csv', ROW + '1,0.1,0.5\n', 'syntax', '1 MiB'),
    ],
)
def test_a_file_larger_than_memory_is_refused_by_its_beginning(
    tmp_path, monkeypatch, name, head, code, limit
):
    # Lines are not counted to the end of the holes.
    monkeypatch.setattr(table_reader, '_count_lines', lambda file: 1)
    file = tmp_path / name
    file.write_text(head)
    os.truncate(file, HUGE)
    refuse(file, code, limit)


def test_a_recording_for_the_demo_larger_than_memory_is_refused(tmp_path):
    file = tmp_path / 'recording.csv'
    file.write_text(ROW)
    os.truncate(file, HUGE)
    with refused(RecordingError, 'syntax', '1 MiB'):
        read_recording(file, robot_of('planar_2r'))


def test_a_long_line_of_a_table_is_read_up_to_the_longest(tmp_path, capsys):
    file = tmp_path / 'table.csv'
    blanks = ' ' * (MAX_LINE_LENGTH - len('1,0.1,0.5\n'))
    file.write_text(f'{ROW}1,0.1,0.5{blanks}\n2,0.1,0.6\n')
    assert document(capsys, file, '--robot', 'planar_2r')['messages']['total'] == 2
    file.write_text(f'{ROW}1,0.1,0.5{blanks} \n2,0.1,0.6\n')
    refuse(file, 'syntax', '1 MiB')


def test_a_cell_longer_than_csv_takes_is_a_sentence(tmp_path):
    file = tmp_path / 'table.csv'
    cell = 'x' * 140_000
    for text in (f'stamp,{cell}\n1,2\n', f'{ROW}1,"{cell}",2\n'):
        file.write_text(text)
        refuse(file, 'syntax', 'field')
    file.write_text(f'stamp,{cell[:100_000]}\n1,2\n')
    assert len(refuse(file, 'missing-column', 'position.q1')) < 1000


@pytest.mark.parametrize('suffix', ['.json', '.yaml', '.csv', '.mcap', '.bag', ''])
def test_what_is_no_file_is_refused_and_not_waited_for(tmp_path, suffix):
    pipe, link = tmp_path / f'pipe{suffix}', tmp_path / f'zero{suffix}'
    os.mkfifo(pipe)
    link.symlink_to('/dev/zero')
    for file in (pipe, link):
        refuse(file, 'not-a-file', 'pipe')


def test_a_file_that_is_missing_is_refused_with_the_accepted_kinds(tmp_path):
    for name in ('none.csv', 'none.mcap', 'none'):
        refuse(tmp_path / name, 'missing-file', '.mcap', '.csv', '.yaml')


def packed_bag(folder, store, pack):
    """Write a bag of a hundred joint states whose file is compressed, after `pack`."""
    zstd = pytest.importorskip('rosbags.rosbag2.reader').zstd
    write_bag(folder, store, hundred(store))
    (file,) = folder.glob('*.mcap')
    packed = file.with_name(f'{file.name}.zstd')
    packed.write_bytes(pack(zstd, file.read_bytes()))
    file.unlink()
    call_compressed(folder, 'FILE', file.name, packed.name)
    return packed


def call_compressed(folder, mode, *names):
    metadata = folder / 'metadata.yaml'
    text = metadata.read_text().replace(*names or ('', ''))
    text = re.sub('compression_format: .*', 'compression_format: zstd', text)
    metadata.write_text(re.sub('compression_mode: .*', f'compression_mode: {mode}', text))


def hundred(store):
    robot = robot_of('planar_2r')
    return list(joint_states(store, samples_of(robot, *motion(robot, 100))))


def test_a_compressed_bag_is_read(tmp_path, capsys, store):
    packed_bag(tmp_path / 'bag', store, lambda zstd, data: zstd.compress(data))
    assert document(capsys, tmp_path / 'bag', '--robot', 'planar_2r')['messages']['total'] == 100


@pytest.mark.parametrize('begin', [b'', b'\x50\x2a\x4d\x18\x02\x00\x00\x00ab'])
def test_a_compressed_bag_that_grows_is_not_unpacked(tmp_path, monkeypatch, store, begin):
    def bomb(zstd, data):
        # Frames of zeros behind the bag, each 7,000 times as small; before it what is skipped.
        return begin + zstd.compress(data) + 50 * zstd.compress(bytes(2**18))

    file = packed_bag(tmp_path / 'bag', store, bomb)
    monkeypatch.setattr(unpacking, 'MIN_EXPANSION_BYTES', 2**22)
    assert refuse(tmp_path / 'bag', 'too-large', '4 MiB').startswith(f'{file}: ')


def written(folder, store, plugin, pack=bytes, chunk=None):
    """Write a hundred joint states: each message after `pack`, a chunk after `chunk`."""
    rosbag2 = pytest.importorskip('rosbags.rosbag2')
    writer = rosbag2.Writer(folder, version=9, storage_plugin=rosbag2.StoragePlugin[plugin])
    if chunk is not None:
        writer.set_compression(rosbag2.CompressionMode.STORAGE, rosbag2.CompressionFormat.ZSTD)
    topic, kind, *_ = hundred(store)[0]
    with writer:
        connection = writer.add_connection(topic, kind, typestore=store)
        if chunk is not None:
            chunk(writer.storage)
        for _, _, stamp, message in hundred(store):
            writer.write(connection, stamp, pack(store.serialize_cdr(message, kind)))
    return folder


@pytest.fixture
def zstd():
    return pytest.importorskip('rosbags.rosbag2.reader').zstd


PLUGINS = pytest.mark.parametrize('plugin', ['MCAP', 'SQLITE3'])


@PLUGINS
def test_a_bag_whose_messages_are_compressed_is_read(tmp_path, capsys, store, zstd, plugin):
    bag = written(tmp_path / 'bag', store, plugin, zstd.compress)
    call_compressed(bag, 'MESSAGE')
    assert document(capsys, bag, '--robot', 'planar_2r')['messages']['total'] == 100
    bag = written(tmp_path / 'damaged', store, plugin)
    call_compressed(bag, 'MESSAGE')
    refuse(bag, 'unreadable')


@PLUGINS
def test_a_compressed_message_that_grows_is_not_unpacked(
    tmp_path, monkeypatch, store, zstd, plugin
):
    # Frames of zeros behind the message: 20 MB in 1 kB.
    monkeypatch.setattr(unpacking, 'MAX_PART_BYTES', 2**24)
    zeros = 20 * zstd.compress(bytes(2**20))
    bag = written(tmp_path / 'bag', store, plugin, lambda data: zstd.compress(data) + zeros)
    call_compressed(bag, 'MESSAGE')
    refuse(bag, 'too-large', '16,777,216')


def test_a_part_of_a_bag_may_have_256_mib():
    assert unpacking.MAX_PART_BYTES == 2**28


def test_messages_of_one_length_are_held_to_a_bound(tmp_path, store, zstd, monkeypatch):
    pytest.importorskip('rosbags')
    monkeypatch.setattr(
        'kinematics_service.apps.recordings.readers.bag_reader.LARGEST_BYTES', 1000
    )
    bag = written(tmp_path / 'bag', store, 'MCAP')
    with open_source(bag, Selection(robot_of('planar_2r'))) as source:
        blocks = list(source.blocks)
    assert sum(map(len, blocks)) == 100
    assert {len(block) for block in blocks[:-1]} == {11}  # of 88 bytes each


@pytest.mark.parametrize('is_honest', [True, False])
def test_a_chunk_that_grows_is_not_unpacked(tmp_path, monkeypatch, store, zstd, is_honest):
    def grows(storage):
        if is_honest:  # a record of no known kind
            storage.chunk.bio.write(struct.pack('<BQ', 0x80, 2**24) + bytes(2**24))
        else:
            zeros = zstd.compress(bytes(2**20))
            storage.compressor = lambda data: zstd.compress(data) + 20 * zeros

    monkeypatch.setattr(unpacking, 'MAX_PART_BYTES', 2**24)

    bag = written(tmp_path / 'bag', store, 'MCAP', chunk=grows)
    (file,) = bag.glob('*.mcap')
    assert file.stat().st_size < 2**17
    assert ('16,777,216' in refuse(bag, 'too-large', 'unpacks')) == is_honest


def test_a_chunk_is_not_held_many_times(tmp_path, capsys, monkeypatch, store, zstd):
    monkeypatch.setattr(unpacking, 'MAX_OVERLAP_BYTES', 2**24)

    class Listed(list):
        # The index names each chunk as often as it is said.
        def append(self, record):
            self.extend(copies * [record])

    def held(storage):
        storage.chunk.bio.write(struct.pack('<BQ', 0x80, 2**20) + bytes(2**20))
        storage.chunks = Listed()

    copies = 2
    bag = written(tmp_path / 'twice', store, 'MCAP', chunk=held)
    assert document(capsys, bag, '--robot', 'planar_2r')['messages']['total'] == 200
    copies = 20
    bag = written(tmp_path / 'often', store, 'MCAP', chunk=held)
    refuse(bag, 'too-large', '20 MiB', '16', 'mcap sort')


@pytest.mark.slow
def test_a_plan_that_goes_far_is_sampled_within_bounds_and_says_how_coarsely(
    tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr(plan_reader, 'MAX_FILE_SAMPLES', 1_000)
    count = 8
    q = np.column_stack([6280.0 * (np.arange(count) % 2), np.full(count, 1.0)])
    file = tmp_path / 'plan.json'
    file.write_text(json.dumps(plan_of(q)))
    code, out, err = run(capsys, file, '--robot', 'planar_2r', '--json', '-')
    assert (code, err) == (1, '')
    found = json.loads(out)
    assert any('Not decided' in one['sentence'] for one in found['verdict'])
    assert 960 < found['messages']['total'] <= 1_000
    (coarse,) = [one for one in found['verdict'] if 'sampled coarsely' in one['sentence']]
    # 6280 rad in 142 samples.
    assert (coarse['level'], 'up to 44 rad' in coarse['sentence']) == ('WARN', True)
    file.write_text(json.dumps(plan_of(q[:5] / 6280.0)))
    found = document(capsys, file, '--robot', 'planar_2r')
    assert not [one for one in found['verdict'] if 'sampled coarsely' in one['sentence']]


def test_trajectories_of_a_file_share_the_samples(tmp_path, monkeypatch):
    monkeypatch.setattr(plan_reader, 'MAX_FILE_SAMPLES', 3000)
    q = np.column_stack([np.zeros(11), 100.0 * (np.arange(11) % 2)])
    file = tmp_path / 'plan.json'
    file.write_text(json.dumps({'all': [plan_of(q)] * 4}))
    source = plan_reader.open_planned(file, Selection(robot_of('planar_2r')))
    blocks = list(source.blocks)
    assert sum(map(len, blocks)) == 3001 + 3 * (10 * MIN_SAMPLES + 1)
    assert [remark.level for remark in source.remarks] == [Level.OK, Level.WARN]


@pytest.mark.parametrize('most', [10, 1000, 5000, 10**9])
@pytest.mark.parametrize('moving', [False, True])
def test_samples_are_shared_by_the_segments_that_need_them(most, moving):
    q = np.array([[0.0], [0.001], [20.0], [20.5], [1e300], [-1e300]])
    velocities = np.array([[0.0], [1.0], [0.0], [200.0], [0.0], [0.0]]) if moving else None
    times = np.arange(6.0)
    steps = sampled(PlannedTrajectory(('q',), times, q, velocities, None), most)
    counts = np.diff(np.searchsorted(steps.times, times))
    assert np.all(counts >= MIN_SAMPLES)
    assert np.sum(counts) <= max(most, 0) + MIN_SAMPLES * 5
    assert steps.times[-1] == 5.0
    assert steps.positions[-1] == q[-1]
    at = np.searchsorted(steps.times, times)
    assert np.array_equal(steps.positions[at[:4]], q[:4])
    if most == 10**9:
        assert counts.tolist()[1:] == [2000, 2000 if moving else 50, MAX_SAMPLES, MAX_SAMPLES]
        for k in (0, 2) if not moving else ():
            moves = np.abs(np.diff(steps.positions[at[k] : at[k + 1] + 1], axis=0))
            assert np.max(moves) <= 1.0001 * MAX_STEP


def test_the_work_of_an_audit_of_many_plans_is_told_while_it_goes_on():
    from kinematics_service.apps.recordings.audit.planned import PlanSettings, checks_of
    from kinematics_service.apps.recordings.readers.source import RecordingSource

    q = np.array([[0.1, 0.5], [0.2, 0.6]])
    plans = [PlannedTrajectory(('q1', 'q2'), np.arange(2.0), q, None, None)] * 5
    source = RecordingSource('plan', '', True, None, iter(()), plans=plans)
    told = []
    checks = checks_of(robot_of('planar_2r'), source, '', PlanSettings(), told.append)
    assert (len(checks), told) == (5, [1] * 5)


OTHERS = {
    'its own': 'int32 X=3',
    'a field less': 'std_msgs/Header header\nstring[] name\nfloat64[] position\n'
    'float64[] velocity',
    'an array of a length': 'std_msgs/Header header\nstring[] name\nfloat64[2] position\n'
    'float64[] velocity\nint8[] effort',
    'single precision': 'std_msgs/Header header\nstring[] name\nfloat32[] position\n'
    'float64[] velocity\nfloat64[] effort',
    'another header': None,
}


@pytest.mark.slow
@pytest.mark.parametrize('other', OTHERS)
def test_a_type_of_the_name_of_another_is_refused(tmp_path, store, other):
    # The bytes are those of the usual message: the definition in the file says something else.
    robot = robot_of('planar_2r')
    samples = samples_of(robot, *motion(robot, 30))
    bag = write_bag(tmp_path / 'bag', store, joint_states(store, samples))
    (file,) = bag.glob('*.mcap')
    with open_source(file, Selection(robot)) as source:
        assert sum(map(len, source.blocks)) == 30
    content = file.read_bytes()
    begin = content.index(b'std_msgs/Header header')
    end = content.index(b'\n====', begin)
    written = content[begin:end]
    name, seen = 'sensor_msgs/msg/JointState', 'header'
    if other == 'another header':
        name, seen = 'std_msgs/msg/Header', 'stamp, frame_xy'
        assert content.count(b'string frame_id') > 1
        changed = content.replace(b'string frame_id', b'string frame_xy')
    else:
        text = OTHERS[other].encode()
        changed = content.replace(written, text + b'\n' * (len(written) - len(text)))
        seen = 'header' if 'header' in OTHERS[other] else ''
    file.write_bytes(changed)
    refuse(file, 'mismatch', '/joint_states', name, f'fields {seen}')


def urdf_of(count, mimic=''):
    links = ''.join(f'<link name="l{k}"/>' for k in range(count + 1))
    joints = ''.join(
        f'<joint name="j{k}" type="continuous"><parent link="l{k}"/>'
        f'<child link="l{k + 1}"/><origin xyz="0.1 0 0"/>{mimic if k else ""}</joint>'
        for k in range(count)
    )
    return f'<robot name="r">{links}{joints}</robot>'


@pytest.mark.slow
@pytest.mark.parametrize(
    ('count', 'text', 'words'),
    [
        (1200, urdf_of(1200), ("'l1200'", '1200 joints')),
        (600, urdf_of(600, mimic='<mimic joint="j0"/>'), ('600 rows',)),
        (2, urdf_of(2).replace('"r"', f'"{"r" * 300_000}"'), ('256 KiB',)),
    ],
)
def test_a_urdf_too_large_for_a_robot_file_is_refused_by_its_own_name(
    tmp_path, count, text, words
):
    file = tmp_path / 'long.urdf'
    file.write_text(text)
    with pytest.raises(UrdfError) as raised:
        ks.import_urdf(file, 'l0', f'l{count}')
    assert str(raised.value).startswith(str(file))
    for word in words:
        assert word in str(raised.value)
    assert 'not a robot file' not in str(raised.value)


LOOPS = {
    'ab ba': '(a, b, a)',
    'ab bc ca': '(a, c, b, a)',
    'ab cd dc': '(c, d, c)',
    'ab bb': '(b, b)',
    'ab ac bd ce ed dc': '(c, d, e, c)',
}


@pytest.mark.parametrize('joints', LOOPS)
def test_a_urdf_with_a_loop_anywhere_is_refused_with_its_links(joints):
    pairs = joints.split()
    text = ''.join(
        f'<joint name="{pair}{k}" type="continuous"><parent link="{pair[0]}"/>'
        f'<child link="{pair[1]}"/></joint>'
        for k, pair in enumerate(pairs)
    )
    links = ''.join(f'<link name="{name}"/>' for name in sorted(set(''.join(pairs))))
    with pytest.raises(UrdfError) as raised:
        ks.import_urdf(f'<robot name="r">{links}{text}</robot>', 'a', 'b')
    assert LOOPS[joints] in str(raised.value)


def test_the_robot_of_an_accepted_urdf_is_as_it_was():
    text = (
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="continuous">'
        '<parent link="a"/><child link="b"/></joint></robot>'
    )
    found = ks.import_urdf(text, 'a', 'b')
    again = ks.robot_from_text(found.text)
    assert replace(found.robot.description, file='') == replace(again.description, file='')
