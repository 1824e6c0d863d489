# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Datasets: which episodes, arms and numbers are read from which files."""

import json
import sys
from zipfile import ZipFile

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
import pytest
from arms import robot_of
from datasets import RPY, fixed, pose_numbers, poses_of, swinging, write_lerobot
from refusal import refused

from kinematics_service.apps.recordings.datasets import episodes
from kinematics_service.apps.recordings.datasets.arms import arms_of
from kinematics_service.apps.recordings.datasets.episodes import episodes_of, is_dataset
from kinematics_service.apps.recordings.datasets.open_episode import open_episode
from kinematics_service.apps.recordings.datasets.vectors import (
    columns_of_episode,
    vectors_of_table,
)
from kinematics_service.apps.recordings.readers.joint_format import JointFormat
from kinematics_service.apps.recordings.readers.source import Selection
from kinematics_service.apps.recordings.readers.stamp_format import stamp_format
from kinematics_service.errors import RecordingError

# Numbers of some radians in single precision.
SINGLE = 1e-6
UR = robot_of('ur5e')
Q = swinging(UR, 70, seed=8)[0]
T = poses_of(UR, Q)
POSE = pose_numbers(T)


def read(path, robot=UR, **wanted):
    """Return the joints (N, n), stamps (N,) and poses of each episode and arm of a dataset."""
    found = {}
    for episode in episodes_of(path):
        columns = columns_of_episode(episode)
        for arm in arms_of(columns.header, Selection(robot, **wanted), episode.rate):
            source = open_episode(episode, columns, arm)
            blocks = list(source.blocks)
            track = source.poses()
            key = episode.name.rpartition('/')[2], arm.label
            found[key] = (
                np.concatenate([block.positions for block in blocks]),
                np.concatenate([block.stamps for block in blocks]),
                None if track is None else track.poses,
            )
    return found


def rows_of(found, key):
    q, stamps, poses = found[key]
    return q, np.diff(stamps) * 1e-9, poses


@pytest.mark.parametrize('version', ['v3.0', 'v2.1'])
def test_lerobot_folders(tmp_path, version):
    state = np.column_stack([Q, np.zeros(70)])
    names = [*(f'{name}.pos' for name in UR.joint_names), 'gripper.pos']
    whole = {'observation.state': state, 'observation.ee_pose': POSE, 'action': state}
    episodes = [
        {name: rows[part] for name, rows in whole.items()} for part in (slice(40), slice(40, 70))
    ]
    folder = write_lerobot(
        tmp_path / 'set',
        episodes,
        {'observation.state': {'motors': names}, 'observation.ee_pose': list(RPY)},
        version=version,
    )
    assert is_dataset(folder)
    found = read(folder)
    first, second = found
    assert first[0].endswith(':0')
    assert second[0].endswith(':1')
    q, steps, poses = rows_of(found, second)
    assert q == pytest.approx(Q[40:], abs=SINGLE)
    assert steps == pytest.approx(np.full(29, 1 / 30), abs=SINGLE)
    assert poses == pytest.approx(T[40:], abs=10 * SINGLE)


def test_names_that_are_no_joints_are_taken_in_their_order(tmp_path):
    state = np.column_stack([Q, np.zeros(70)])
    names = {'observation.state': [f'motor_{k}' for k in range(7)]}
    folder = write_lerobot(tmp_path / 'set', [{'observation.state': state}], names)
    ((q, _, poses),) = read(folder).values()
    assert q == pytest.approx(Q, abs=SINGLE)
    assert poses is None


@pytest.mark.parametrize(
    'nested',
    [lambda one: [one], lambda one: {'motors': one}, lambda one: {'arm': [one[:4], one[4:]]}],
    ids=['list of a list', 'by kind', 'lists by kind'],
)
def test_names_within_lists(tmp_path, nested):
    state = np.column_stack([np.ones((70, 3)), Q[:, ::-1]])
    names = nested(['a', 'b', 'c', *UR.joint_names[::-1]])
    vectors = {'observation.state': state}
    folder = write_lerobot(tmp_path / 'set', [vectors], {'observation.state': names})
    ((q, _, _),) = read(folder).values()
    assert q == pytest.approx(Q, abs=SINGLE)


def test_two_arms_by_name_and_by_number(tmp_path):
    other = Q[::-1]
    state = np.column_stack([Q, np.zeros(70), other, np.ones(70)])
    poses = np.column_stack([POSE, POSE[::-1]])
    sides = [
        f'{side}_{name}.pos' for side in ('left', 'right') for name in (*UR.joint_names, 'jaw')
    ]
    for k, names in enumerate([{'observation.state': sides}, {}]):
        vectors = {'observation.state': state, 'observation.ee_pose': poses}
        folder = write_lerobot(tmp_path / str(k), [vectors], names)
        left, right = read(folder).values()
        assert left[0] == pytest.approx(Q, abs=SINGLE)
        assert right[0] == pytest.approx(other, abs=SINGLE)
        assert [label for _, label in read(folder)] == ['left', 'right']


def test_joints_of_other_names_are_asked_for(tmp_path):
    # Six numbers, as many as the arm has joints: but five of another arm, and its gripper.
    names = [f'{name}.pos' for name in (*robot_of('so101').joint_names, 'gripper')]
    given = {'observation.state': Q}
    folder = write_lerobot(tmp_path / 'set', [given], {'observation.state': names})
    with refused(RecordingError, 'mismatch', 'shoulder_pan, ', 'ur5e') as raised:
        read(folder)
    assert str(raised.value).endswith('--columns position=observation.state[0:6]')
    ((q, _, _),) = read(folder, columns='position=observation.state[0:6]').values()
    assert q == pytest.approx(Q, abs=SINGLE)


def test_numbers_that_may_be_any_joints_are_asked_for(tmp_path):
    folder = write_lerobot(tmp_path / 'set', [{'observation.state': np.ones((5, 10))}], {})
    with refused(RecordingError, 'ambiguous', '--columns position=observation.state[0:6]'):
        read(folder)
    ((q, _, _),) = read(folder, columns='position=observation.state[2:8]').values()
    assert q.shape == (5, 6)
    folder = write_lerobot(tmp_path / 'other', [{'readings': np.ones((5, 10))}], {})
    with refused(RecordingError, 'missing-column', 'readings', '--columns position=VECTOR'):
        read(folder)


def test_a_prefix_names_one_of_the_arms(tmp_path):
    sides = [f'{side}_{name}' for side in ('left', 'right') for name in UR.joint_names]
    state = np.column_stack([Q, Q[::-1]])
    folder = write_lerobot(
        tmp_path / 'set', [{'observation.state': state}], {'observation.state': sides}
    )
    ((q, _, _),) = read(folder, joint_prefix='right_').values()
    assert q == pytest.approx(Q[::-1], abs=SINGLE)


def test_a_pose_is_not_taken_for_joints(tmp_path):
    names = {'observation.state': ['x', 'y', 'z', 'rx', 'ry', 'rz', 'gripper']}
    folder = write_lerobot(tmp_path / 'set', [{'observation.state': np.ones((5, 7))}], names)
    with refused(RecordingError, 'missing-column', 'is a pose', '--columns position=VECTOR'):
        read(folder)


def test_statistics_are_those_of_the_joints_that_are_read(tmp_path):
    low, high = -np.arange(1.0, 15.0), np.arange(2.0, 16.0)
    normalised = np.column_stack([np.zeros((5, 7)), np.linspace(-1.0, 1.0, 35).reshape(5, 7)])
    folder = write_lerobot(tmp_path / 'set', [{'observation.state': normalised}], {})
    file = tmp_path / 'stats.json'
    file.write_text(json.dumps({'observation.state': {'min': list(low), 'max': list(high)}}))
    form = JointFormat(str(file))
    columns = 'position=observation.state[7:13]'
    ((q, _, _),) = read(folder, joint_format=form, columns=columns).values()
    meant = low[7:13] + (normalised[:, 7:13] + 1.0) / 2.0 * (high - low)[7:13]
    assert q == pytest.approx(meant, abs=20 * SINGLE)
    with refused(RecordingError, 'ambiguous', '--columns position=observation.state[0:6]'):
        read(folder, joint_format=form)


def test_hdf5_of_robomimic(tmp_path):
    quaternions = pose_numbers(T, 'xyzw')
    file = tmp_path / 'demo.hdf5'
    with h5py.File(file, 'w') as stream:
        stream.create_group('data/demo_²')  # a digit that is no number
        for k, part in ((10, slice(40, 70)), (2, slice(40))):
            obs = stream.create_group(f'data/demo_{k}/obs')
            obs['robot0_joint_pos'], obs['robot0_joint_vel'] = Q[part], 0.0 * Q[part]
            obs['robot0_eef_pos'] = quaternions[part, :3]
            obs['robot0_eef_quat'] = quaternions[part, 3:]
            obs['agentview_image'] = np.zeros((len(Q[part]), 8, 8, 3), dtype=np.uint8)
    found = read(file, stamps=stamp_format('20Hz'))
    assert list(found) == [('demo_2', ''), ('demo_10', '')]
    q, steps, poses = rows_of(found, ('demo_10', ''))
    assert q == pytest.approx(Q[40:], abs=0)
    assert steps == pytest.approx(np.full(29, 0.05), abs=1e-9)
    assert poses == pytest.approx(T[40:], abs=1e-9)
    with refused(RecordingError, 'missing-column', "'stamp'", '--stamps 30Hz'):
        read(file)


def test_hdf5_of_aloha(tmp_path):
    with h5py.File(tmp_path / 'episode_0.hdf5', 'w') as stream:
        stream['observations/qpos'] = np.column_stack([Q, np.ones(70), Q[::-1], np.ones(70)])
        stream['observations/images/top'] = np.zeros((70, 4, 4, 3), dtype=np.uint8)
        stream['action'] = np.zeros((70, 14))
    left, right = read(tmp_path, stamps=stamp_format('50Hz')).values()
    assert left[0].tolist() == Q.tolist()
    assert right[0].tolist() == Q[::-1].tolist()


def test_npz_with_ends_of_episodes(tmp_path):
    file = tmp_path / 'set.npz'
    np.savez(file, q=np.degrees(Q), episode_ends=[30, 70])
    found = read(file, stamps=stamp_format('10Hz'), joint_format=JointFormat('deg'))
    first, second = found.values()
    assert first[0] == pytest.approx(Q[:30], abs=1e-12)
    assert second[0] == pytest.approx(Q[30:], abs=1e-12)


@pytest.mark.parametrize('turned', [False, True], ids=['list of steps', 'lists of numbers'])
def test_parquet_with_a_row_of_steps_for_each_episode(tmp_path, turned):
    def steps(part):
        if turned:
            times = [0.1 * k for k in range(len(Q[part]))]
            return {'observation': {'state': Q[part].tolist()}, 'timestamp': times}
        return [
            {'observation': {'state': q.tolist()}, 'timestamp': 0.1 * k, 'is_last': False}
            for k, q in enumerate(Q[part])
        ]

    file = tmp_path / 'rlds.parquet'
    parquet.write_table(pa.table({'steps': [steps(slice(30)), steps(slice(30, 70))]}), file)
    first, second = read(file).values()
    assert first[0] == pytest.approx(Q[:30], abs=0)
    assert second[0] == pytest.approx(Q[30:], abs=0)


def test_plain_parquet_with_single_columns(tmp_path):
    file = tmp_path / 'run.parquet'
    columns = {f'j_{k}': Q[:, k] for k in range(6)}
    parquet.write_table(pa.table({'time': np.arange(70) / 5, **columns}), file, row_group_size=16)
    ((q, stamps, _),) = read(file, columns='position=j_').values()
    assert q.tolist() == Q.tolist()
    assert np.diff(stamps).tolist() == [200_000_000] * 69


def test_episodes_over_several_groups_of_rows(tmp_path):
    file = tmp_path / 'set.parquet'
    table = pa.table(
        {
            'observation.state': fixed(Q),
            'timestamp': np.arange(70) / 5,
            'episode_index': np.repeat([3, 1, 7], [20, 25, 25]),
        }
    )
    parquet.write_table(table, file, row_group_size=11)
    found = read(file)
    assert [name for name, _ in found] == ['set.parquet:3', 'set.parquet:1', 'set.parquet:7']
    q = np.concatenate([one[0] for one in found.values()])
    assert q == pytest.approx(Q, abs=SINGLE)


def test_missing_numbers_are_none(tmp_path):
    file = tmp_path / 'set.parquet'
    rows = [None if k == 3 else q.tolist() for k, q in enumerate(Q[:9])]
    vectors = pa.array(rows, pa.list_(pa.float64()))
    parquet.write_table(pa.table({'q': vectors, 'timestamp': np.arange(9.0)}), file)
    ((q, _, _),) = read(file).values()
    # Not in a file: before version 26 pyarrow cannot write and read this.
    of_fixed_size = vectors_of_table(pa.table({'q': pa.array(rows, pa.list_(pa.float64(), 6))}))
    for found in (q, of_fixed_size['q']):
        assert np.isnan(found[3]).all()
        assert found[4].tolist() == Q[4].tolist()


def test_a_damaged_file_is_one_episode_that_cannot_be_read(tmp_path):
    (tmp_path / 'a.parquet').write_bytes(b'PAR1 and then nothing')
    np.savez(tmp_path / 'b.npz', q=Q)
    (tmp_path / 'c.hdf5').write_bytes(b'')
    faults = [episode.fault for episode in episodes_of(tmp_path)]
    assert [one and one.code for one in faults] == ['unreadable', None, 'unreadable']
    assert str(faults[0]).startswith(f'{tmp_path}/a.parquet: ')
    (missing,) = episodes_of(tmp_path / 'none.parquet')
    assert missing.fault.code == 'missing-file'
    assert str(missing.fault).startswith(f'{tmp_path}/none.parquet: ')


FEATURES = '{"features": {"q": {"names": null}}, "fps": '


@pytest.mark.parametrize(
    ('content', 'code', 'word'),
    [
        ('', 'empty', ''),
        *((text, 'wrong-type', '"features"') for text in ('{}', '[]', 'null')),
        *((f'{{"features": {text}}}', 'wrong-type', '"features"') for text in ('[1]', '{"a": 1}')),
        *((f'{FEATURES}{rate}}}', 'wrong-type', 'fps') for rate in ('"x"', '[30]', 'true')),
        *((f'{FEATURES}{rate}}}', 'out-of-range', 'fps') for rate in ('-1', 'NaN', '1e300')),
        *((f'{FEATURES}{rate}}}', 'out-of-range', 'fps') for rate in ('1e999', f'1{"0" * 400}')),
        (f'{FEATURES}30, "fps": 50}}', 'duplicate-key', "'fps'"),
        ('[' * 100_000, 'too-deep', ''),
        ('[' + '0,' * 2**19, 'too-large', '1 MiB'),
    ],
)
def test_a_description_that_is_none_is_refused(tmp_path, content, code, word):
    (tmp_path / 'meta').mkdir()
    (tmp_path / 'meta' / 'info.json').write_text(content)
    with refused(RecordingError, code, 'info.json: ', word):
        list(episodes_of(tmp_path))


def test_without_the_libraries_the_sentence_says_what_to_install(tmp_path, monkeypatch):
    parquet.write_table(pa.table({'q': fixed(Q)}), tmp_path / 'a.parquet')
    for name in ('pyarrow', 'pyarrow.parquet', 'h5py'):
        monkeypatch.setitem(sys.modules, name, None)
    with refused(RecordingError, 'missing-package', "pip install '.[dataset]'"):
        list(episodes_of(tmp_path))


@pytest.mark.parametrize('stamp', [np.nan, -1.0, np.inf, 1e300])
def test_stamps_that_are_none_are_no_stamps(tmp_path, stamp):
    file = tmp_path / 'set.parquet'
    times = np.arange(70.0)
    times[3] = stamp
    parquet.write_table(pa.table({'q': fixed(Q), 'timestamp': times}), file)
    ((_, stamps, _),) = read(file, stamps=stamp_format('s')).values()
    assert stamps[3] == 0
    assert np.diff(stamps)[4:].tolist() == [10**9] * 65


def test_a_small_file_that_holds_what_fills_any_memory_is_refused(tmp_path, monkeypatch):
    file = tmp_path / 'set.hdf5'
    with h5py.File(file, 'w') as stream:  # nothing of it is written
        stream.create_dataset('q', shape=(10**9, 6), dtype='f8', chunks=(10**4, 6))
    assert file.stat().st_size < 10**5
    with refused(RecordingError, 'too-large', '6,000,000,000'):
        read(file)
    parquet.write_table(
        pa.table({'q': fixed(Q), 'timestamp': np.ones(70)}), tmp_path / 'a.parquet'
    )
    parquet.write_table(pa.table({'episode_index': np.ones(70)}), tmp_path / 'b.parquet')
    monkeypatch.setattr(episodes, 'MAX_NUMBERS', 69)
    for name, count in (('a', 490), ('b', 70)):
        with refused(RecordingError, 'too-large', f'{name}.parquet: {count} ', '69'):
            read(tmp_path / f'{name}.parquet')


def header_alone(file, **arrays):
    """Write an npz file of arrays (shape, type) that have headers and no numbers."""
    with ZipFile(file, 'w') as packed:
        for name, (shape, kind) in arrays.items():
            with packed.open(f'{name}.npy', 'w') as stream:
                header = {'descr': kind, 'fortran_order': False, 'shape': shape}
                np.lib.format.write_array_header_2_0(stream, header)


def test_arrays_are_refused_by_their_headers(tmp_path):
    file = tmp_path / 'set.npz'
    header_alone(file, q=((10**9, 2), '|u1'), qd=((10**9, 2), '<f8'), pose=((10**9, 2), '<f4'))
    with refused(RecordingError, 'too-large', '6,000,000,000'):
        read(file)
    for name, kind in (('episode_index', '|u1'), ('episode_ends', '<i8'), ('episode', '<U100')):
        header_alone(file, **{name: ((10**9,), kind)})
        (episode,) = episodes_of(file)
        assert episode.fault.code == 'too-large'
    with ZipFile(file, 'w') as packed:  # a header of two gigabytes is not read
        packed.writestr(
            'q.npy', b'\x93NUMPY\x02\x00' + (2**31).to_bytes(4, 'little') + b' ' * 2**15
        )
    (episode,) = episodes_of(file)
    assert episode.fault.code == 'unreadable'
    assert 'header' in str(episode.fault)
    header_alone(file, q=((-5, 6), '<f8'))
    (episode,) = episodes_of(file)
    assert episode.fault.code == 'wrong-shape'
    assert '(-5, 6)' in str(episode.fault)


def test_pictures_in_an_npz_file_are_not_read(tmp_path):
    file = tmp_path / 'set.npz'
    np.savez(file, q=Q)
    with ZipFile(file, 'a') as packed, packed.open('image.npy', 'w') as stream:
        header = {'descr': '|u1', 'fortran_order': False, 'shape': (70, 480, 640, 3)}
        np.lib.format.write_array_header_2_0(stream, header)
    (found,) = read(file, stamps=stamp_format('10Hz')).values()
    assert found[0].tolist() == Q.tolist()


@pytest.mark.parametrize(
    ('column', 'numbers', 'code', 'word'),
    [
        ('episode_ends', [30, 500_000_000], 'wrong-order', '30 and 500,000,000'),
        ('episode_ends', range(1, 72), 'wrong-shape', '(71,)'),
        ('episode_ends', [30.0, 70.0], 'wrong-shape', 'float64'),
        ('episode_ends', [[30, 70]], 'wrong-shape', '(1, 2)'),
        ('episode_ends', 70, 'wrong-shape', '()'),
        ('episode_ends', [30, 60], 'wrong-length', '60 of 70'),
        ('episode_ends', [True, False], 'wrong-shape', 'bool'),
        ('episode_ends', [40, 30], 'wrong-order', '40 and 30'),
        ('episode_ends', [-1, 70], 'wrong-order', '0 and -1'),
        ('episode_ends', [30, 30], 'wrong-order', '30 and 30'),
        ('episode_ends', [2**64 - 1], 'wrong-order', 'from 1'),
        ('episode_index', [0] * 9, 'wrong-shape', '(9,)'),
        ('episode_index', ['a'] * 70, 'wrong-shape', '<U1'),
        ('episode_index', [0.0] * 69 + [np.nan], 'not-finite', 'row 69'),
        ('q.0', [0.0] * 70, 'duplicate-name', "'q.0'"),
    ],
)
def test_arrays_that_do_not_fit_each_other_are_refused(tmp_path, column, numbers, code, word):
    file = tmp_path / 'set.npz'
    np.savez(file, q=Q, **{column: np.array(numbers)})
    with refused(RecordingError, code, f'{file}: ', word):
        read(file)


def test_more_episodes_than_a_file_may_have_are_refused(tmp_path, monkeypatch):
    assert episodes.MAX_EPISODES == 2**20
    monkeypatch.setattr(episodes, 'MAX_EPISODES', 1000)
    for count, code in ((1000, None), (1001, 'too-many')):
        steps = pa.nulls(count, pa.list_(pa.float64()))
        parquet.write_table(pa.table({'steps': steps}), tmp_path / 'set.parquet')
        episode, *others = episodes_of(tmp_path)
        assert (episode.fault and episode.fault.code) == code
    assert '1,000' in str(episode.fault)
    assert not others


def test_two_columns_of_one_name_are_refused(tmp_path):
    columns = pa.array([{'b': 1.0}]), pa.array([1.0])
    parquet.write_table(pa.table(columns, ['a', 'a.b']), tmp_path / 'set.parquet')
    numbered = pa.table([[0], [0], [1.0]], ['episode_index', 'episode_index', 'q'])
    parquet.write_table(numbered, tmp_path / 'numbered.parquet')
    with h5py.File(tmp_path / 'set.h5', 'w') as stream:
        stream['a/b'] = stream['a.b'] = Q
    for name in ('set.parquet', 'numbered.parquet', 'set.h5'):
        with refused(RecordingError, 'duplicate-name', f'{name}: 2 '):
            read(tmp_path / name)


def test_numbers_in_other_files_are_not_read(tmp_path):
    with h5py.File(tmp_path / 'other.hdf5', 'w') as stream:
        stream['q'] = Q
    (tmp_path / 'secret').write_bytes(Q.tobytes())
    layout = h5py.VirtualLayout(shape=Q.shape, dtype='f8')
    layout[:] = h5py.VirtualSource(tmp_path / 'other.hdf5', 'q', shape=Q.shape)
    for k in range(2):
        with h5py.File(tmp_path / f'{k}.hdf5', 'w') as stream:
            if k:
                stream.create_virtual_dataset('q', layout)
            else:
                size = (str(tmp_path / 'secret'), 0, h5py.h5f.UNLIMITED)
                stream.create_dataset('q', shape=Q.shape, dtype='f8', external=[size])
        with refused(RecordingError, 'unsupported', '/q'):
            read(tmp_path / f'{k}.hdf5')
    for name in ('data', 'data/demo_0', 'demo_0', 'q'):
        with h5py.File(tmp_path / 'link.hdf5', 'w') as stream:
            stream[name] = h5py.ExternalLink('other.hdf5', '/')
        with refused(RecordingError, 'empty', 'link.hdf5'):
            read(tmp_path / 'link.hdf5')


def test_groups_far_within_each_other_and_huge_chunks_are_refused(tmp_path):
    with h5py.File(tmp_path / 'deep.hdf5', 'w') as stream:
        stream['/'.join(40 * 'a')] = Q
    with refused(RecordingError, 'too-deep', '32'):
        read(tmp_path / 'deep.hdf5')
    with h5py.File(tmp_path / 'chunk.hdf5', 'w') as stream:
        chunks = (10, 50_000_000)
        stream.create_dataset('q', shape=(10, 6), dtype='f8', maxshape=(None, None), chunks=chunks)
    with refused(RecordingError, 'too-large', '500,000,000'):
        read(tmp_path / 'chunk.hdf5')


def test_long_texts_in_all_rows_are_held_once_or_not_at_all(tmp_path):
    # In each file there are 20 GB of texts.
    text = pa.array(['x' * 10**5]).dictionary_encode()
    texts = pa.DictionaryArray.from_arrays(np.zeros(200_000, dtype=np.int32), text.dictionary)
    file = tmp_path / 'set.parquet'
    parquet.write_table(pa.table({'episode_id': texts, 'q': np.ones(200_000)}), file)
    (episode,) = episodes_of(file)
    assert episode.count == 200_000
    assert len(columns_of_episode(episode)) == 200_000
    steps = pa.StructArray.from_arrays([texts, np.ones(200_000)], ['text', 'q'])
    row = pa.ListArray.from_arrays([0, 200_000], steps)
    parquet.write_table(pa.table({'steps': row}), file)
    (episode,) = episodes_of(file)
    assert columns_of_episode(episode).header == ['q']


def test_episodes_by_name_and_by_number_that_is_no_whole_one(tmp_path):
    for ids in (['b', 'b', 'a'], [1.0, 1.0, 0.5]):
        file = tmp_path / 'set.parquet'
        parquet.write_table(pa.table({'episode_id': ids, 'q': [1.0, 2.0, 3.0]}), file)
        assert [(one.first, one.count) for one in episodes_of(file)] == [(0, 2), (2, 1)]


def test_the_bound_holds_for_columns_with_points_in_their_names(tmp_path, monkeypatch):
    parquet.write_table(pa.table({'observation.state': fixed(Q)}), tmp_path / 'a.parquet')
    monkeypatch.setattr(episodes, 'MAX_NUMBERS', 419)
    with refused(RecordingError, 'too-large', '420', '419'):
        read(tmp_path / 'a.parquet')
