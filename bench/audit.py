"""
Time and memory of an audit of 1,000,000 messages, as MCAP and as CSV.

    python bench/audit.py [--messages 1000000] [--robot ur5e] [--out] [--folder DIR]

The recordings are made in a temporary folder (or DIR), one second of 1 kHz after the other. Every
audit is a process of its own, so that its peak memory is its own.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import kinematics_service as ks

RATE = 1000
BEGIN = 1_700_000_000_000_000_000


def motion(robot, count):
    t = np.arange(count) / RATE
    frequency = 0.3 + 0.17 * np.arange(robot.dof)
    phase = 1.3 * np.arange(robot.dof)
    low, high = np.clip(robot.limits, -2.5, 2.5).T
    reach = 0.4 * (high - low)
    angle = t[:, None] * frequency + phase
    return 0.5 * (low + high) + reach * np.sin(angle), reach * frequency * np.cos(angle)


def write_mcap(path, robot, q, qdot):
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    kind = 'sensor_msgs/msg/JointState'
    stamp_type = store.types['builtin_interfaces/msg/Time']
    header = store.types['std_msgs/msg/Header']
    empty = np.zeros(0)
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection('/joint_states', kind, typestore=store)
        for k in range(len(q)):
            stamp = BEGIN + k * 1_000_000
            message = store.types[kind](
                header(stamp_type(*divmod(stamp, 1_000_000_000)), ''),
                list(robot.joint_names),
                q[k],
                qdot[k],
                empty,
            )
            writer.write(connection, stamp + 500_000, store.serialize_cdr(message, kind))


def write_csv(path, robot, q, qdot):
    names = robot.joint_names
    columns = [f'position.{name}' for name in names] + [f'velocity.{name}' for name in names]
    with path.open('w') as file:
        file.write(','.join(['stamp', *columns]) + '\n')
        for k in range(len(q)):
            seconds, nanoseconds = divmod(BEGIN + k * 1_000_000, 1_000_000_000)
            row = ','.join(f'{value:.9f}' for value in (*q[k], *qdot[k]))
            file.write(f'{seconds}.{nanoseconds:09d},{row}\n')


def one_audit(path, robot_name, out):
    from kinematics_service.diagnosis.audit.auditing import AuditProgress, audit
    from kinematics_service.diagnosis.audit.report.document import document_of
    from kinematics_service.diagnosis.audit.report.page import page_of
    from kinematics_service.formats.recordings.open_file import open_source
    from kinematics_service.formats.recordings.source import Selection
    from kinematics_service.printing import json_text

    robot = ks.load_robot(robot_name)
    phases = {}
    at = time.perf_counter()

    def phase(name):
        nonlocal at
        phases[name] = time.perf_counter() - at
        at = time.perf_counter()

    with open_source(path, Selection(robot)) as source:
        messages = sum(len(block) for block in source.blocks)
    phase('reading alone')
    if out:
        from kinematics_service.diagnosis.audit.report.bag_writer import open_writer

        written = path.parent / 'written.mcap'
        with (
            open_source(path, Selection(robot)) as source,
            open_writer(written, robot, '') as writer,
        ):
            audit(source, robot, str(path), None, AuditProgress(part=writer.write))
        phase('all with --out')
    with open_source(path, Selection(robot)) as source:
        result = audit(source, robot, str(path))
    phase('all but page and JSON')
    phases['mathematics'] = (
        phases['all but page and JSON'] - phases['reading alone'] - result.phases['findings']
    )
    phases['findings'] = result.phases['findings']
    page = page_of(result)
    phase('page')
    document = json_text(document_of(result))
    phase('JSON')
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(
        json.dumps(
            {
                'phases': phases,
                'messages': messages,
                'states': len(result.timeline),
                'stretches': len(result.stretches),
                'page_kB': len(page) / 1e3,
                'json_kB': len(document) / 1e3,
                'peak_MB': peak / 1e3,
            }
        )
    )


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('--messages', type=int, default=1_000_000)
    parser.add_argument('--robot', default='ur5e')
    parser.add_argument('--out', action='store_true', help='also write the MCAP of answers')
    parser.add_argument('--folder')
    parser.add_argument('--one', help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        one_audit(Path(arguments.one), arguments.robot, arguments.out)
        return
    with tempfile.TemporaryDirectory(dir=arguments.folder) as folder:
        robot = ks.load_robot(arguments.robot)
        q, qdot = motion(robot, arguments.messages)
        paths = {'MCAP': Path(folder) / 'run', 'CSV': Path(folder) / 'run.csv'}
        write_mcap(paths['MCAP'], robot, q, qdot)
        write_csv(paths['CSV'], robot, q, qdot)
        print(f'{arguments.messages:,} messages, {arguments.robot}')
        for name, path in paths.items():
            command = [sys.executable, __file__, '--one', str(path), '--robot', arguments.robot]
            command += ['--out'] if arguments.out and name == 'MCAP' else []
            text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
            found = json.loads(text.splitlines()[-1])
            phases = found.pop('phases')
            print(name, *(f'{key} {value:,.0f}' for key, value in found.items()), sep='  ')
            print('   ', *(f'{key} {value:.2f} s' for key, value in phases.items()), sep='  ')


if __name__ == '__main__':
    main()
