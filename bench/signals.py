"""
Ends many nodes with a signal, idle and under load, and prints how they took it.

    python bench/signals.py [RUNS]
    python bench/signals.py --starts RUNS

Each of RUNS runs (default 200) starts `python -m kinematics_service`, waits until it listens (or,
under load, has answered), and sends SIGINT or SIGTERM, once or twice. With --starts the signal
comes at a random moment of the first 5 s, whatever the node does then, idle and with two processes
a core that only compute.
"""

import os
import random
import signal
import statistics
import subprocess
import sys
import threading
import time
from collections import Counter

NODE = [sys.executable, '-m', 'kinematics_service', '--robot', 'craig_3r']
RATE = 1000.0
DEADLINE = 30.0
MOMENTS, WAY_OUT = 5.0, 2.0

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
    """A node that runs; `listening` is set when it says so."""

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
        """Return the exit code and the seconds between the first signal and the end."""
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
    """Return (exit code, seconds, whether a traceback was written) of each run."""
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


def starts(runs: int) -> int:
    """
    Stop nodes at random moments of their start; return 1 where one did not end as it should.

    What the interpreter itself says of a signal, before it has read a line of ours, is counted
    by itself.
    """
    bad = 0
    print(
        '| load | starts | exit code 0 | by the signal | early | tracebacks | longest s | late |'
    )
    print('|---|---|---|---|---|---|---|---|')
    for busy in (False, True):
        hogs = [
            subprocess.Popen([sys.executable, '-c', 'while True: pass'])
            for _ in range(2 * (os.cpu_count() or 1) if busy else 0)
        ]
        try:
            results = [_stopped_start(k) for k in range(runs // 2)]
        finally:
            for hog in hogs:
                hog.kill()
                hog.wait()
        tally = Counter(how for how, _ in results)
        longest = max(seconds for _, seconds in results)
        late = sum(seconds > WAY_OUT for _, seconds in results)
        bad += tally['bad'] + late
        print(
            f'| {"busy" if busy else "idle"} | {len(results)} | {tally["0"]} | {tally["signal"]} '
            f'| {tally["early"]} | {tally["bad"]} | {longest:.2f} | {late} |',
            flush=True,
        )
    return 1 if bad else 0


def _stopped_start(k: int) -> tuple[str, float]:
    number = (signal.SIGINT, signal.SIGTERM)[k % 2]
    node = Node()
    try:
        time.sleep(random.uniform(0.0, MOMENTS))
        code, seconds = node.end(number, False)
    finally:
        if node.popen.poll() is None:
            node.popen.kill()
    text = '\n'.join(node.lines)
    if 'Traceback' in text or code not in (0, -number):
        if '/kinematics_service/' not in text:  # in no line of the package
            return 'early', seconds
        print(f'exit code {code}: {text}', file=sys.stderr)
        return 'bad', seconds
    return ('signal' if code else '0'), seconds


def main(runs: int) -> int:
    """Print a table; return 1 where some node did not end as it should."""
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
    words = sys.argv[1:]
    part = starts if words[:1] == ['--starts'] else main
    words = [word for word in words if word != '--starts']
    sys.exit(part(int(words[0]) if words else 200))
