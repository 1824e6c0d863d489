"""
Ends many nodes with a signal, idle and under load, and prints how they took it.

    python bench/signals.py [RUNS]

Each of RUNS runs (default 200) starts `python -m kinematics_service`, waits until it listens (or,
under load, has answered), and sends SIGINT or SIGTERM, once or twice.
"""

import os
import random
import signal
import statistics
import subprocess
import sys
import threading
import time

NODE = [sys.executable, '-m', 'kinematics_service', '--robot', 'craig_3r']
RATE = 1000.0
DEADLINE = 30.0

LOAD = f"""
import time, rclpy
from sensor_msgs.msg import JointState
rclpy.init()
node = rclpy.create_node('load')
publisher = node.create_publisher(JointState, 'joint_states', 100)
message = JointState(name=['q1', 'q2', 'q3'], position=[0.1, 0.2, 0.3], velocity=[0.1, 0.2, 0.3])
begin, k = time.monotonic(), 0
while True:
    message.header.stamp = node.get_clock().now().to_msg()
    publisher.publish(message)
    k += 1
    time.sleep(max(0.0, begin + k / {RATE} - time.monotonic()))
"""

ANSWERED = """
import sys, rclpy
from geometry_msgs.msg import PoseStamped
rclpy.init()
node = rclpy.create_node('ear')
node.create_subscription(PoseStamped, '/kinematics/pose', lambda pose: print('.', flush=True), 1)
rclpy.spin(node)
"""


class Node:
    """
    A node that runs; `listening` is set when it says so.

    """

    def __init__(self) -> None:
        self.listening = threading.Event()
        self.lines: list[str] = []
        self.popen = subprocess.Popen(
            NODE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self) -> None:
        for line in self.popen.stderr or ():
            self.lines.append(line.rstrip())
            if 'listening to' in line:
                self.listening.set()

    def end(self, number: int, twice: bool) -> tuple[int, float]:
        """
        Return the exit code and the seconds between the first signal and the end.

        """
        begin = time.monotonic()
        self.popen.send_signal(number)
        if twice:
            time.sleep(random.uniform(0.005, 0.05))
            self.popen.send_signal(number)
        code = self.popen.wait(DEADLINE)
        seconds = time.monotonic() - begin
        self.reader.join(DEADLINE)
        return code, seconds


def ends(number: int, twice: bool, runs: int, ear: subprocess.Popen | None) -> list[tuple]:
    """
    Return (exit code, seconds, whether a traceback was written) of each run.

    """
    results = []
    for _ in range(runs):
        node = Node()
        try:
            if not node.listening.wait(DEADLINE):
                raise SystemExit('the node does not start: ' + ' | '.join(node.lines))
            if ear is not None:
                for _ in range(20):  # what was answered before is long heard by then
                    ear.stdout.readline()
            code, seconds = node.end(number, twice)
        finally:
            if node.popen.poll() is None:
                node.popen.kill()
        results.append((code, seconds, any('Traceback' in line for line in node.lines)))
    return results


def main(runs: int) -> int:
    """
    Print a table; return 1 where some node did not end as it should.

    """
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', str(random.randrange(1, 100)))
    each = max(1, runs // 8)
    bad = 0
    print('| signal | load | runs | exit code 0 | tracebacks | median s | longest s | over 1 s |')
    print('|---|---|---|---|---|---|---|---|')
    for busy in (False, True):
        helpers = []
        if busy:
            helpers.append(subprocess.Popen([sys.executable, '-c', LOAD]))
            helpers.append(
                subprocess.Popen([sys.executable, '-c', ANSWERED], stdout=subprocess.PIPE)
            )
        try:
            for number in (signal.SIGINT, signal.SIGTERM):
                for twice in (False, True):
                    results = ends(number, twice, each, helpers[1] if busy else None)
                    codes, seconds, tracebacks = zip(*results)
                    late = sum(took > 1.0 for took in seconds)
                    fine = sum(code == 0 for code in codes)
                    bad += len(results) - fine + sum(tracebacks) + late
                    print(
                        f'| {number.name}{" twice" if twice else ""} '
                        f'| {"1 kHz" if busy else "idle"} | {len(results)} | {fine} '
                        f'| {sum(tracebacks)} | {statistics.median(seconds):.3f} '
                        f'| {max(seconds):.3f} | {late} |',
                        flush=True,
                    )
        finally:
            for helper in helpers:
                helper.kill()
                helper.wait()
    return 1 if bad else 0


if __name__ == '__main__':
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 200))
