# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
From the start of the process to its first answer, beside a bare rclpy node; and what it is then.

    python bench/start.py [--robot ur5e] [--runs 5] [--idle 5]

The bare node (plain_node.py --bytes) reads nothing and answers every joint state with constant
bytes: what Python, rclpy and discovery cost by themselves. Cases take turns. CPU is the process's
own until the first answer was heard. `no bytecode` is a first start: nothing that Python or
anybody else keeps for the next one can be read or written. Joint states come every 5 ms; then the
process hears nothing for `--idle` seconds: its share of a core, and wake-ups a second.
"""

import argparse
import os
import signal
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

from processes import node, plain  # isort: skip
from node_process import memory, processor_seconds

# Everything is mounted read-only, for this process alone.
READ_ONLY = ('unshare', '--mount', 'sh', '-c', 'mount -o remount,bind,ro / && exec "$@"', 'sh')


def threads_of(pid):
    """Return the processor time (ns) and the wake-ups of each thread of a process."""
    found = {}
    for task in Path(f'/proc/{pid}/task').iterdir():
        status = (task / 'status').read_text()
        woken = int(status.partition('\nvoluntary_ctxt_switches:')[2].split()[0])
        found[task.name] = int((task / 'schedstat').read_text().split()[0]), woken
    return found


def rested(pid, seconds):
    """Return the share of a core and the wake-ups a second of a process that hears nothing."""
    before = threads_of(pid)
    time.sleep(seconds)
    after = threads_of(pid)
    spent = np.sum([np.subtract(after[one], before[one]) for one in after.keys() & before], axis=0)
    return spent[0] / (1e9 * seconds), spent[1] / seconds


class Starter:
    """Starts processes and hears their first answer."""

    def __init__(self, robot, rest):
        import rclpy
        from geometry_msgs.msg import PoseStamped
        from sensor_msgs.msg import JointState

        self._rclpy = rclpy
        rclpy.init()
        self._node = rclpy.create_node('starter')
        self._subscription = self._node.create_subscription(
            PoseStamped, '/kinematics/pose', self._hear, 10
        )
        self._publisher = self._node.create_publisher(JointState, 'joint_states', 10)
        self._message = JointState(name=robot.joint_names, position=[0.1] * robot.dof)
        self._first, self._rest = None, rest

    def _hear(self, answer):
        if self._first is None:
            self._first = time.monotonic()

    def run(self, command, environment):
        """Return wall and CPU seconds to the first answer, MiB, threads, and what rest costs."""
        begin = time.monotonic()
        process = subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL)
        self._first = None
        while self._first is None:
            self._message.header.stamp = self._node.get_clock().now().to_msg()
            self._publisher.publish(self._message)
            self._rclpy.spin_once(self._node, timeout_sec=0.005)
            if process.poll() is not None or time.monotonic() - begin > 120.0:
                raise SystemExit(f'no answer: {" ".join(command)}')
        cpu, wall = processor_seconds(process.pid), self._first - begin
        time.sleep(1.0)
        found = wall, cpu, memory(process.pid), len(threads_of(process.pid))
        idle = rested(process.pid, self._rest)
        process.send_signal(signal.SIGINT)
        process.wait(timeout=20)
        # What it said last is not the next one's first answer.
        end = time.monotonic() + 0.5
        while time.monotonic() < end:
            self._rclpy.spin_once(self._node, timeout_sec=0.05)
        return *found, *idle


def cases_of(robot, folder):
    """Yield each case: its name, command and environment."""
    usual = dict(os.environ)
    homeless = {name: value for name, value in usual.items() if name != 'HOME'}
    no_bytecode = {
        **usual,
        'PYTHONPYCACHEPREFIX': str(folder / 'nothing'),
        'PYTHONDONTWRITEBYTECODE': '1',
        'HOME': str(folder),
    }
    yield 'bare node', plain('--bytes', '--topics', 'pose'), usual
    yield 'bare node, no bytecode', plain('--bytes', '--topics', 'pose'), no_bytecode
    yield 'kinematics', node('--robot', robot), usual
    yield 'kinematics, no bytecode', node('--robot', robot), no_bytecode
    yield 'kinematics, no HOME', node('--robot', robot), homeless
    if subprocess.run([*READ_ONLY, 'true'], stderr=subprocess.DEVNULL).returncode == 0:
        yield 'kinematics, read-only', [*READ_ONLY, *node('--robot', robot)], usual


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--robot', default='ur5e')
    parser.add_argument('--runs', type=int, default=5)
    parser.add_argument('--idle', type=float, default=5.0, help='s at rest')
    arguments = parser.parse_args()

    import kinematics_service as ks

    starter = Starter(ks.load_robot(arguments.robot), arguments.idle)
    results = {}
    with tempfile.TemporaryDirectory() as folder:
        cases = list(cases_of(arguments.robot, Path(folder)))
        for _ in range(arguments.runs):
            for name, command, environment in cases:
                results.setdefault(name, []).append(starter.run(command, environment))
    print(f'start to first answer, {arguments.robot}, {arguments.runs} runs: median (least, most)')
    print(
        f'{"":26}{"wall, s":>20}{"CPU, s":>20}{"MiB":>7}{"threads":>9}{"idle":>8}{"wake-ups":>10}'
    )
    for name, values in results.items():
        wall, cpu, sizes, threads, idle, woken = zip(*values)
        spans = ''.join(
            f'{statistics.median(some):6.2f} ({min(some):.2f}, {max(some):.2f})'.rjust(20)
            for some in (wall, cpu)
        )
        print(
            f'{name:26}{spans}{max(sizes):7.1f}{max(threads):9}'
            f'{statistics.median(idle):8.2%}{statistics.median(woken):10.1f}',
            flush=True,
        )


if __name__ == '__main__':
    main()
