"""
From the start of the process to its first answer, beside a bare rclpy node; and what it is then.

    python bench/start.py [--robot ur5e] [--runs 5]

The bare node (plain_node.py --bytes) reads nothing and answers every joint state with constant
bytes: what Python, rclpy and discovery cost by themselves. Cases take turns. CPU is the process's
own until the first answer was heard. `no bytecode` is a first start: nothing that Python or
anybody else keeps for the next one can be read or written. Joint states come every 5 ms.
"""

import argparse
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SECOND = 1_000_000_000
TICKS = os.sysconf('SC_CLK_TCK')
IDLE = 5.0  # s, nothing is heard and nobody listens
NODE = (sys.executable, '-m', 'kinematics_service', '--robot')
BARE = (sys.executable, str(Path(__file__).with_name('plain_node.py')), '--bytes', '--topics')
# Everything is mounted read-only, for this process alone.
READ_ONLY = ('unshare', '--mount', 'sh', '-c', 'mount -o remount,bind,ro / && exec "$@"', 'sh')


def cpu_of(pid):
    """Return the CPU seconds of a process."""
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def resident_of(pid):
    """Return the resident set of a process in MiB."""
    pages = int(Path(f'/proc/{pid}/statm').read_text().split()[1])
    return pages * os.sysconf('SC_PAGE_SIZE') / 2**20


class Starter:
    """Starts processes and hears their first answer."""

    def __init__(self, robot):
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
        self._first = None

    def _hear(self, answer):
        if self._first is None:
            self._first = time.monotonic()

    def run(self, command, environment):
        """Return wall and CPU seconds to the first answer, MiB, threads, and the idle share."""
        begin = time.monotonic()
        process = subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL)
        self._first = None
        while self._first is None:
            self._message.header.stamp = self._node.get_clock().now().to_msg()
            self._publisher.publish(self._message)
            self._rclpy.spin_once(self._node, timeout_sec=0.005)
            if process.poll() is not None or time.monotonic() - begin > 120.0:
                raise SystemExit(f'no answer: {" ".join(command)}')
        cpu, wall = cpu_of(process.pid), self._first - begin
        time.sleep(1.0)
        before = cpu_of(process.pid)
        time.sleep(IDLE)
        idle = (cpu_of(process.pid) - before) / IDLE
        found = wall, cpu, resident_of(process.pid), len(os.listdir(f'/proc/{process.pid}/task'))
        process.send_signal(signal.SIGINT)
        process.wait(timeout=20)
        # What it said last is not the next one's first answer.
        end = time.monotonic() + 0.5
        while time.monotonic() < end:
            self._rclpy.spin_once(self._node, timeout_sec=0.05)
        return *found, idle


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
    yield 'bare node', [*BARE, 'pose'], usual
    yield 'bare node, no bytecode', [*BARE, 'pose'], no_bytecode
    yield 'kinematics', [*NODE, robot], usual
    yield 'kinematics, no bytecode', [*NODE, robot], no_bytecode
    yield 'kinematics, no HOME', [*NODE, robot], homeless
    if subprocess.run([*READ_ONLY, 'true'], stderr=subprocess.DEVNULL).returncode == 0:
        yield 'kinematics, read-only', [*READ_ONLY, *NODE, robot], usual


def imports():
    """Return the milliseconds that the node's imports take, by package."""
    code = 'import kinematics_service.ros.process.runner'
    lines = subprocess.run(
        [sys.executable, '-X', 'importtime', '-c', code],
        capture_output=True,
        text=True,
        check=True,
    ).stderr.splitlines()
    packages = {}
    for line in lines[1:]:
        own, _, name = line.removeprefix('import time:').split('|')
        top = name.strip().partition('.')[0]
        packages[top] = packages.get(top, 0.0) + int(own) * 1e-3
    return packages


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--robot', default='ur5e')
    parser.add_argument('--runs', type=int, default=5)
    arguments = parser.parse_args()
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', '91')

    import kinematics_service as ks

    starter = Starter(ks.load_robot(arguments.robot))
    results = {}
    with tempfile.TemporaryDirectory() as folder:
        cases = list(cases_of(arguments.robot, Path(folder)))
        for _ in range(arguments.runs):
            for name, command, environment in cases:
                results.setdefault(name, []).append(starter.run(command, environment))
    print(f'start to first answer, {arguments.robot}, {arguments.runs} runs: median (least, most)')
    print(f'{"":26}{"wall, s":>20}{"CPU, s":>20}{"MiB":>7}{"threads":>9}{"idle":>7}')
    for name, values in results.items():
        wall, cpu, memory, threads, idle = zip(*values)
        spans = ''.join(
            f'{statistics.median(some):6.2f} ({min(some):.2f}, {max(some):.2f})'.rjust(20)
            for some in (wall, cpu)
        )
        print(
            f'{name:26}{spans}{max(memory):7.1f}{max(threads):9}{statistics.median(idle):7.1%}',
            flush=True,
        )
    packages = imports()
    print(f'imports of the node: {sum(packages.values()):.0f} ms, by package:')
    for name, own in sorted(packages.items(), key=lambda item: -item[1])[:14]:
        print(f'{name:24}{own:8.0f}')


if __name__ == '__main__':
    main()
