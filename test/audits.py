# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Audits as tests make them: by the command and by the library, of bags that are written here."""

import itertools
import json

import numpy as np
from recordings import SECOND

from kinematics_service.__main__ import main
from kinematics_service.apps.checking.hypotheses import quaternions_of
from kinematics_service.apps.recordings.audit.auditing import AuditSettings, audit
from kinematics_service.apps.recordings.readers.block import Block
from kinematics_service.apps.recordings.readers.source import RecordingSource
from kinematics_service.estimation.estimator import EstimatorSettings

JOINT_STATE = 'sensor_msgs/msg/JointState'
SETTINGS = EstimatorSettings()
LARGEST_BLOCK = 16_384
TIMES = ('stamp', 'received')


def blocks_of(samples):
    """Yield samples in blocks, in their order."""

    def kind(sample):
        return tuple(sample.names), len(sample.positions), len(sample.velocities)

    for (names, *_), alike in itertools.groupby(samples, kind):
        while rows := list(itertools.islice(alike, LARGEST_BLOCK)):
            stamps, received = ([getattr(one, name) for one in rows] for name in TIMES)
            tables = ([getattr(one, name) for one in rows] for name in ('positions', 'velocities'))
            q, qdot = (np.array(table, float).reshape(len(rows), -1) for table in tables)
            yield Block(names, np.array(stamps), np.array(received), q, qdot)


def run(capsys, *argv):
    code = main(['audit', *map(str, argv)])
    out, err = capsys.readouterr()
    assert 'Traceback' not in out + err
    return code, out, err


def refusal(capsys, *argv, code=1):
    result = run(capsys, *argv)
    assert result[0] == code, result
    assert len(result[2].strip().splitlines()) == 1, result[2]
    return result[2].strip()


def write_bag(folder, store, messages, plugin='MCAP'):
    """Write messages (topic, type, time, message) as a rosbag2 bag."""
    from rosbags.rosbag2 import StoragePlugin, Writer

    with Writer(folder, version=9, storage_plugin=StoragePlugin[plugin]) as writer:
        connections = {}
        for topic, kind, stamp, message in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            if message is not None:
                writer.write(connections[topic], stamp, store.serialize_cdr(message, kind))
    return folder


def header(store, stamp, frame=''):
    time = store.types['builtin_interfaces/msg/Time'](*divmod(stamp, SECOND))
    return store.types['std_msgs/msg/Header'](time, frame)


def joint_states(store, samples, topic='/joint_states'):
    kind = store.types[JOINT_STATE]
    for one in samples:
        message = kind(
            header(store, one.stamp),
            list(one.names),
            np.array(one.positions, dtype=float),
            np.array(one.velocities, dtype=float),
            np.zeros(0),
        )
        yield topic, JOINT_STATE, one.received, message


def document(capsys, *argv):
    code, out, err = run(capsys, *argv, '--json', '-')
    assert code in (0, 1), err
    return json.loads(out)


def audited(samples, robot, settings=SETTINGS):
    """Return the audit of samples and the batches it was made of."""
    parts = []
    source = RecordingSource('made up', '/joint_states', False, None, blocks_of(samples))
    result = audit(source, robot, 'made_up', AuditSettings(settings), write=parts.append)
    return result, parts


def quaternions(poses):
    """Return places and quaternions (N, 7) of poses."""
    return np.column_stack([poses[:, :3, 3], quaternions_of(poses)])
