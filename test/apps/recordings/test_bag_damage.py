# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""What an audit says of a bag that is damaged: each flipped bit is harmless, or it is told."""

import json
import struct

import numpy as np
import pytest
from arms import robot_of
from audits import JOINT_STATE, document, joint_states, run, write_bag
from joint_state_mcap import Writer, message_bytes
from recordings import BEGIN, SECOND, motion, samples_of
from refused_files import refuse

pytest.importorskip('rosbags', reason='needs rosbags')
BITS = 24


def mcap(path, count=150, checksums=True, chunk=25, more=0):
    """
    Write a motion of the planar arm; `more`: so many messages than there are the index promises.
    """
    robot = robot_of('planar_2r')
    t, q, qdot = motion(robot, count)
    stamps = BEGIN + np.rint(t * 1e9).astype(np.int64)
    messages = message_bytes(robot.joint_names, stamps, q, qdot)
    with path.open('wb') as file:
        writer = Writer(file, checksums=checksums)
        for at in range(0, count, chunk):
            writer.write(stamps[at : at + chunk] + 1000, messages[at : at + chunk])
        writer._count += more
        writer.close()
    return path


def findings(capsys, path):
    """Return what an audit finds, without the name of the file."""
    found = document(capsys, path, '--robot', 'planar_2r')
    return {key: value for key, value in found.items() if key != 'file'}


def faults(found):
    """Return level, code and first word of each fault of the file."""
    return [
        (one['level'], one['code'], one['sentence'].split()[0])
        for one in found['verdict']
        if one['code']
    ]


@pytest.mark.slow
def test_a_flipped_bit_changes_nothing_or_is_told(tmp_path, capsys):
    whole = mcap(tmp_path / 'whole.mcap')
    expected, data = findings(capsys, whole), whole.read_bytes()
    assert not faults(expected)
    broken = tmp_path / 'broken.mcap'
    told = 0
    for at in np.random.default_rng(4).integers(0, 8 * len(data), BITS).tolist():
        flipped = bytearray(data)
        flipped[at // 8] ^= 1 << at % 8
        broken.write_bytes(flipped)
        code, out, err = run(capsys, broken, '--robot', 'planar_2r', '--json', '-')
        if code:
            assert len(err.strip().splitlines()) == 1
            told += 1
            continue
        found = json.loads(out)
        del found['file']
        if found['level'] == 'ERROR' and 'wrong-checksum' in str(faults(found)):
            told += 1
            assert run(capsys, broken, '--robot', 'planar_2r', '--fail-on', 'limits')[0] == 1
        else:
            assert found == expected
    assert told > BITS // 2


def test_a_file_without_checksums_says_so(tmp_path, capsys, store):
    found = findings(capsys, mcap(tmp_path / 'none.mcap', checksums=False))
    assert faults(found) == [('OK', 'no-checksum', 'none.mcap')]
    samples = samples_of(robot_of('planar_2r'), *motion(robot_of('planar_2r'), 40))
    bag = write_bag(tmp_path / 'bag', store, joint_states(store, samples), 'SQLITE3')
    assert faults(findings(capsys, bag)) == [('OK', 'no-checksum', 'bag.db3')]


def test_what_the_index_promises_and_is_not_there_is_told(tmp_path, capsys, store):
    found = findings(capsys, mcap(tmp_path / 'less.mcap', 120, more=7))
    assert faults(found) == [('WARN', 'wrong-length', 'less.mcap')]
    (text,) = (one['sentence'] for one in found['verdict'] if one['code'])
    assert text == 'less.mcap counts 127 messages on /joint_states, but holds 120.'
    samples = samples_of(robot_of('planar_2r'), *motion(robot_of('planar_2r'), 40))
    bag = write_bag(tmp_path / 'bag', store, joint_states(store, samples), 'SQLITE3')
    about = bag / 'metadata.yaml'
    about.write_text(about.read_text().replace('message_count: 40', 'message_count: 43'))
    assert faults(findings(capsys, bag))[0] == ('WARN', 'wrong-length', 'bag')


def test_a_damaged_database_is_told(tmp_path, capsys, store):
    samples = samples_of(robot_of('planar_2r'), *motion(robot_of('planar_2r'), 500))
    bag = write_bag(tmp_path / 'bag', store, joint_states(store, samples), 'SQLITE3')
    file = next(bag.glob('*.db3'))
    data = bytearray(file.read_bytes())
    page = struct.unpack('>H', data[16:18])[0]
    # The number of cells of every index page but the first.
    for at in range(page, len(data), page):
        if data[at] == 10:
            data[at + 4] ^= 1
    file.write_bytes(data)
    code, out, err = run(capsys, bag, '--robot', 'planar_2r', '--json', '-')
    assert code == 1 or ('ERROR', 'wrong-checksum', 'bag.db3') in faults(json.loads(out)), out


@pytest.mark.slow
@pytest.mark.parametrize('plugin', ['MCAP', 'SQLITE3'])
def test_an_unreadable_joint_state_is_counted_as_the_node_counts_it(
    tmp_path, capsys, store, plugin
):
    from rosbags.rosbag2 import StoragePlugin, Writer

    robot = robot_of('planar_2r')
    samples = samples_of(robot, *motion(robot, 200))
    raws = [
        bytes(store.serialize_cdr(message, JOINT_STATE))
        for *_, message in joint_states(store, samples)
    ]
    raws[30] = b'\x00\x07' + raws[30][2:]
    raws[31] = raws[31][:20]
    raws[90] = b''
    with Writer(tmp_path / 'bag', version=9, storage_plugin=StoragePlugin[plugin]) as writer:
        topic = writer.add_connection('/joint_states', JOINT_STATE, typestore=store)
        for one, raw in zip(samples, raws):
            writer.write(topic, one.received, raw)
    found = findings(capsys, tmp_path / 'bag')
    counted = found['messages']
    assert (counted['total'], counted['states'], counted['refused']) == (200, 197, 3)
    assert counted['by_outcome']['not a JointState'] == 3
    first = counted['first_refused']['not a JointState']
    assert (first['message'], first['code']) == (30, 'unreadable')
    good = [k for k in range(200) if k not in (30, 31, 90)]
    assert found['series']['message'] == good
    assert found['series']['q'] == [list(samples[k].positions) for k in good]
    for k in range(200):
        raws[k] = raws[k][:5]
    with Writer(tmp_path / 'bad', version=9, storage_plugin=StoragePlugin[plugin]) as writer:
        topic = writer.add_connection('/joint_states', JOINT_STATE, typestore=store)
        for one, raw in zip(samples, raws):
            writer.write(topic, one.received, raw)
    refuse(tmp_path / 'bad', 'no-states', '200 not a JointState')
    assert samples[0].stamp > SECOND
