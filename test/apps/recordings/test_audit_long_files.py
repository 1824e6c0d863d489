# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Tables and ROS 1 bags of any length: read in pieces, with the same words and numbers."""

from dataclasses import replace

import numpy as np
import pytest
from arms import robot_of
from audits import (
    JOINT_STATE,
    document,
    joint_states,
    quaternions,
    refusal,
    write_bag,
)
from recordings import SECOND, awkward, motion, samples_of
from refusal import refused
from refused_files import refuse

import kinematics_service as ks
from kinematics_service.apps.recordings.audit import frames
from kinematics_service.apps.recordings.audit.auditing import audit
from kinematics_service.apps.recordings.readers import (
    stored_columns,
    table_reader,
    table_source,
    unpacking,
)
from kinematics_service.apps.recordings.readers.open_file import open_source
from kinematics_service.apps.recordings.readers.source import Selection
from kinematics_service.errors import RecordingError
from kinematics_service.estimation import outcomes
from kinematics_service.estimation.joint_state_columns import columns_of

ROBOT = ('--robot', 'planar_2r')
HEADER = 'stamp,position.q1,position.q2'
# Rows of a table that is longer than one piece, and the line of the row that is made bad.
PIECE = 500
ROWS, BAD = PIECE + 300, PIECE + 100
LINE = BAD + 2


@pytest.fixture(autouse=True)
def short_pieces(monkeypatch):
    """Have tables read in pieces of a few hundred rows, of which a short file has several."""
    monkeypatch.setattr(table_reader, 'LARGEST_BLOCK', PIECE)


def lines(rows=ROWS):
    """Return the rows of a motion of two joints at 100 Hz."""
    q2 = np.round(1.0 + 0.5 * np.sin(0.01 * np.arange(rows)), 9).tolist()
    return [f'{1_700_000_000 + k // 100}.{k % 100:02d},0.2,{q2[k]!r}' for k in range(rows)]


def written(file, rows, header=HEADER):
    file.write_bytes(b'\n'.join([header.encode(), *(one.encode('latin-1') for one in rows)]))
    return file


# Tables


@pytest.mark.parametrize(
    ('row', 'code', 'where'),
    [
        ('1700000200,0.2,x', 'not-a-number', f":{LINE}: column 'position.q2': 'x'"),
        ('soon,0.2,1.0', 'not-a-time', f":{LINE}: column 'stamp': 'soon'"),
        ('1700000200,0.2', 'wrong-length', f':{LINE}: 2 cells'),
        ('1700000200,,1.0,4', 'wrong-length', f':{LINE}: 4 cells'),
        ('1700000200,0.2,1.0\xff', 'encoding', ': '),
        ('1700000200,,' + '1' * 200_000, 'syntax', ': '),
    ],
)
def test_a_bad_line_deep_in_a_table_is_refused_in_a_sentence(tmp_path, row, code, where):
    rows = lines()
    rows[BAD] = row
    file = written(tmp_path / 'bad.csv', rows)
    assert refuse(file, code).startswith(f'{file}{where}')


def test_a_bad_line_deep_in_a_table_leaves_no_output(tmp_path, capsys):
    pytest.importorskip('rosbags', reason='needs rosbags')
    rows = lines()
    rows[BAD] = 'soon'
    file = written(tmp_path / 'bad.csv', rows)
    refusal(capsys, file, *ROBOT, '--out', tmp_path / 'made.mcap')
    assert [one.name for one in tmp_path.iterdir()] == ['bad.csv']


def test_a_quote_that_nobody_closes_does_not_swallow_the_table(tmp_path):
    rows = lines(10_000)  # more than a field may hold
    rows[5] = '1700000000.05,"0.2,1.0'
    file = written(tmp_path / 'quote.csv', rows)
    refuse(file, 'syntax', '131072')


def test_cells_too_many_are_refused_unless_they_are_empty(tmp_path, capsys):
    # They may be decimal commas: 0,2 for 0.2.
    rows = lines(100)
    rows[20] += ',7'
    rows[30] += ',,'
    file = written(tmp_path / 'odd.csv', rows)
    refuse(file, 'wrong-length', f'{file}:22: 4 cells')
    rows[20] = rows[20].removesuffix('7')
    assert document(capsys, written(file, rows), *ROBOT)['messages']['states'] == 100


@pytest.mark.slow
def test_a_missing_cell_and_a_cut_end_far_down_cost_their_rows_alone(tmp_path, capsys):
    rows = lines()
    whole = document(capsys, written(tmp_path / 'whole.csv', rows), *ROBOT)
    assert whole['messages']['states'] == ROWS
    rows[BAD] = rows[BAD].replace(',0.2,', ',,')
    rows[-1] = rows[-1][:12]
    found = document(capsys, written(tmp_path / 'cut.csv', rows), *ROBOT)
    assert found['messages']['total'] == ROWS - 1
    assert found['messages']['states'] == ROWS - 2
    assert found['messages']['by_outcome']['position not finite'] == 1
    last = found['verdict'][-1]
    assert (last['code'], last['sentence'].split(',')[0]) == ('cut-off', f'line {ROWS + 1}')


def test_a_table_is_judged_while_it_is_read(tmp_path):
    rows = lines()
    rows[-2] = 'nonsense'
    file = written(tmp_path / 'run.csv', rows)
    with open_source(file, Selection(robot_of('planar_2r'))) as source:
        first = next(source.blocks)
        assert len(first) == PIECE
        assert source.total == ROWS - 1 + (rows[-1] == '')
        with refused(RecordingError, 'wrong-length', f':{ROWS}: 1 cells'):
            list(source.blocks)


def poses_of(robot, q, random):
    # Rows x y z and a quaternion; some have none, and two are no pose.
    numbers = quaternions(ks.forward_kinematics(robot, q))
    cells = [[repr(float(x)) for x in row] for row in numbers]
    for k in random.choice(len(q), len(q) // 7, replace=False):
        cells[k] = [''] * 7
    cells[3] = cells[90] = ['0.0'] * 7
    return cells


@pytest.mark.slow
@pytest.mark.parametrize(('missing', 'back'), [(False, True), (True, False)])
def test_pieces_of_a_table_give_the_same_document(tmp_path, capsys, monkeypatch, missing, back):
    robot = robot_of('craig_3r')
    random = np.random.default_rng(8)
    for module in (table_source, frames):
        monkeypatch.setattr(module, 'MAX_POSES', 150)
    t, q, qdot = motion(robot, 350, 100.0, 5)
    if back:
        t[150:] -= 2.0
    poses = poses_of(robot, q, random)
    names = [*(f'position.{j}' for j in robot.joint_names)]
    names += [f'velocity.{j}' for j in robot.joint_names]
    names += [f'pose.{end}' for end in ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')]
    rows = []
    for k in range(len(t)):
        if missing or poses[k][0]:
            numbers = [repr(float(x)) for x in (*q[k], *qdot[k])]
            rows.append(','.join([f'{1.7e9 + t[k]:.4f}', *numbers, *poses[k]]))
    file = written(tmp_path / 'run.csv', rows, ','.join(['stamp', *names]))
    whole = document(capsys, file, '--robot', 'craig_3r')
    assert whole['frames']['poses'] == 350 - 50 - sum(bool(poses[k][0]) for k in (3, 90))
    assert whole['frames']['considered'] == 150
    assert whole['frames']['as_given']['position_max'] < 1e-12
    assert whole['stream']['backwards'] == back
    monkeypatch.setattr(table_reader, 'LARGEST_BLOCK', 77)
    monkeypatch.setattr(stored_columns, 'MAX_HELD_NUMBERS', 100)
    assert document(capsys, file, '--robot', 'craig_3r') == whole


# ROS 1 bags


@pytest.fixture
def stores():
    """Return the messages of ROS 2 and of ROS 1."""
    typesys = pytest.importorskip('rosbags.typesys', reason='needs rosbags')
    stores = typesys.Stores
    return typesys.get_typestore(stores.ROS2_JAZZY), typesys.get_typestore(stores.ROS1_NOETIC)


def write_ros1(file, store, samples, connections=1, bad=(), packed='LZ4'):
    """Write samples as a ROS 1 bag, in turns over several publishers; of some only some bytes."""
    from rosbags.rosbag1 import Writer

    time, head = store.types['builtin_interfaces/msg/Time'], store.types['std_msgs/msg/Header']
    writer = Writer(file)
    writer.set_compression(Writer.CompressionFormat[packed])
    with writer:
        own = [
            writer.add_connection('/joint_states', JOINT_STATE, typestore=store, callerid=f'/{k}')
            for k in range(connections)
        ]
        for k, one in enumerate(samples):
            message = store.types[JOINT_STATE](
                head(k, time(*divmod(one.stamp, SECOND)), ''),
                list(one.names),
                np.array(one.positions, dtype=float),
                np.array(one.velocities, dtype=float),
                np.zeros(0),
            )
            raw = bytes(store.serialize_ros1(message, JOINT_STATE))
            writer.write(own[k % connections], one.received, raw[:40] if k in bad else raw)
    return file


def heard(found):
    return {key: found[key] for key in ('series', 'verdict', 'stream', 'messages', 'joints')}


@pytest.mark.parametrize('packed', ['LZ4', 'BZ2'])
def test_a_chunk_of_a_ros_1_bag_that_grows_is_not_unpacked(tmp_path, monkeypatch, stores, packed):
    from rosbags.rosbag1 import writer

    name = f'{packed.lower()}_compress'
    usual = getattr(writer, name)
    monkeypatch.setattr(unpacking, 'MAX_PART_BYTES', 2**24)
    monkeypatch.setattr(writer, name, lambda data, level: usual(data + bytes(2**24), level))
    robot = robot_of('planar_2r')
    samples = samples_of(robot, *motion(robot, 20))
    file = write_ros1(tmp_path / 'run.bag', stores[1], samples, packed=packed)
    assert file.stat().st_size < 2**21
    refuse(file, 'too-large', '16,777,216')


@pytest.mark.slow
def test_a_ros_1_bag_says_what_the_same_messages_say_in_mcap(
    tmp_path, capsys, monkeypatch, stores
):
    robot = robot_of('planar_2r')
    samples = sorted(awkward(robot, 5), key=lambda one: one.received)
    mcap = write_bag(tmp_path / 'mcap', stores[0], joint_states(stores[0], samples))
    expected = heard(document(capsys, mcap, '--robot', 'planar_2r'))
    bag = write_ros1(tmp_path / 'run.bag', stores[1], samples, connections=3)
    found = document(capsys, bag, '--robot', 'planar_2r')
    told = found['verdict'].pop()['sentence'], expected['verdict'].pop()['sentence']
    assert 'no checksums' in told[0]
    assert found['messages']['total'] == len(samples)
    assert {k: v for k, v in heard(found).items() if k != 'verdict'} == {
        k: v for k, v in expected.items() if k != 'verdict'
    }
    monkeypatch.setattr(stored_columns, 'MAX_HELD_NUMBERS', 100)
    again = document(capsys, bag, '--robot', 'planar_2r')
    assert heard(again)['series'] == expected['series']


def test_a_ros_1_bag_not_in_the_order_of_its_times_is_read_in_it(tmp_path, capsys, stores):
    robot = robot_of('planar_2r')
    t, q, qdot = motion(robot, 400)
    samples = samples_of(robot, t, q, qdot)
    mixed = [samples[k] for k in np.random.default_rng(1).permutation(400)]
    bag = write_ros1(tmp_path / 'mixed.bag', stores[1], mixed)
    found = document(capsys, bag, *ROBOT)
    assert found['series']['q'] == q.tolist()
    assert found['stream']['backwards'] == 0


def test_messages_of_equal_length_that_all_differ_are_read(tmp_path, capsys, stores):
    # A frame of its own in each header: no message looks like another one.
    samples = samples_of(robot_of('planar_2r'), *motion(robot_of('planar_2r'), 500))
    messages = [
        (topic, kind, time, replace(message, header=replace(message.header, frame_id=f'{k:06}')))
        for k, (topic, kind, time, message) in enumerate(joint_states(stores[0], samples))
    ]
    found = document(capsys, write_bag(tmp_path / 'bag', stores[0], messages), *ROBOT)
    assert found['messages']['states'] == 500
    assert found['series']['q'] == [sample.positions for sample in samples]


def test_an_unreadable_message_of_a_ros_1_bag_is_counted(tmp_path, capsys, stores):
    robot = robot_of('planar_2r')
    samples = samples_of(robot, *motion(robot, 400))
    bag = write_ros1(tmp_path / 'run.bag', stores[1], samples, bad=(0, 7, 200))
    messages = document(capsys, bag, *ROBOT)['messages']
    assert (messages['total'], messages['states']) == (400, 397)
    assert messages['by_outcome'][outcomes.UNREADABLE] == 3


def test_messages_of_ros_1_are_read_in_columns_as_one_by_one(stores):
    store = stores[1]
    robot = robot_of('planar_2r')
    time, head = store.types['builtin_interfaces/msg/Time'], store.types['std_msgs/msg/Header']
    random = np.random.default_rng(3)
    messages, numbers = [], random.normal(size=(40, 2, 2))
    for k in range(40):
        names = list(robot.joint_names)[:: -1 if k == 11 else 1]
        stamp = time(1_700_000_000 + k, int(random.integers(SECOND)))
        messages.append(
            store.types[JOINT_STATE](head(k, stamp, 'base'), names, *numbers[k], np.zeros(0))
        )
    raws = [bytes(store.serialize_ros1(message, JOINT_STATE)) for message in messages]
    found = columns_of(raws, ros1=True)
    assert np.flatnonzero(~found.alike).tolist() == [11]
    assert found.names == robot.joint_names
    stamps = [m.header.stamp.sec * SECOND + m.header.stamp.nanosec for m in messages]
    assert found.stamps.tolist() == stamps
    np.testing.assert_array_equal(found.positions, numbers[:, 0])
    np.testing.assert_array_equal(found.velocities, numbers[:, 1])
    # What is longer or shorter than its lengths say is left to the reader of messages.
    assert columns_of([raws[0] + b'\0'] * 2, ros1=True) is None
    assert columns_of([raws[0][:-1]] * 2, ros1=True) is None


def test_a_folder_without_room_ends_the_audit_of_a_table_in_a_sentence(tmp_path, monkeypatch):
    file = written(tmp_path / 'run.csv', lines(900))
    monkeypatch.setattr(stored_columns, 'MAX_HELD_NUMBERS', 10)
    monkeypatch.setattr(table_reader, 'LARGEST_BLOCK', 100)
    monkeypatch.setattr('tempfile.tempdir', str(tmp_path / 'none'))
    arm = robot_of('planar_2r')
    with (
        refused(RecordingError, 'no-space', str(tmp_path / 'none'), 'TMPDIR'),
        open_source(file, Selection(arm)) as source,
    ):
        audit(source, arm, str(file))
