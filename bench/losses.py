"""
What is lost at 1 kHz while other processes burn every core, and what the node says was lost.

    python bench/losses.py [--seconds 60] [--burners 4] [--rate 1000] [--python PATH]
        [--reliability reliable,best_effort] [--depth 1000] [--publishers 1]

Publishers, node and burners are processes of their own. Each publisher counts what it sent; the
node's diagnostics say what was accepted and what was lost. `--python` is the interpreter of
another installation, to be measured with the same publisher.
"""

import argparse
import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np

ROBOT = 'ur5e'
WARM_UP, REST, PATIENCE = 2.0, 3.0, 120.0
DEPTH = 'qos_overrides./joint_states.subscription.depth'
BURN = 'x = 1\nwhile True:\n    x = x * 3 % 1000003'
# The publishers and this process share some int64: from SENT on the count of each publisher.
GO, SENT = range(2)


def feed(path, number, reliability, rate):
    """Publish joint states at a rate as long as told to, and count them."""
    import rclpy
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from rclpy.serialization import serialize_message
    from sensor_msgs.msg import JointState

    import kinematics_service as ks
    from kinematics_service.estimation.cdr import STAMP, STAMP_AT
    from kinematics_service.estimation.joint_state_form import form_of

    names = list(ks.load_robot(ROBOT).joint_names)

    message = JointState(name=names, position=[0.0] * len(names), velocity=[0.1] * len(names))
    data = bytearray(serialize_message(message))
    places = form_of(bytes(data)).positions
    q = np.array([0.3, -1.0, 1.2, -0.4, 1.1, 0.3])
    slots = np.memmap(path, np.int64, 'r+')
    rclpy.init()
    node = rclpy.create_node('feeder')
    qos = QoSProfile(depth=100, reliability=ReliabilityPolicy[reliability.upper()])
    publisher = node.create_publisher(JointState, 'joint_states', qos)
    with contextlib.suppress(PermissionError):
        os.nice(-15)  # a driver keeps its time
    begin, k = time.perf_counter(), 0
    while slots[GO] >= 0:
        if not slots[GO]:
            time.sleep(0.01)
            begin, k = time.perf_counter(), 0
            continue
        early = begin + k / rate - time.perf_counter()
        if early > 0.0:
            time.sleep(early)
        elif early < -0.5:  # it was held up itself: what it could not send is not a burst
            begin -= early
        data[places] = q.tobytes()
        STAMP.pack_into(data, STAMP_AT, *divmod(time.time_ns(), 1_000_000_000))
        publisher.publish(bytes(data))
        k += 1
        slots[SENT + number] += 1


class Watcher:
    """Hears the node's diagnostics."""

    def __init__(self):
        import rclpy
        from diagnostic_msgs.msg import DiagnosticArray

        rclpy.init()
        self.node = rclpy.create_node('watcher')
        self.executor = rclpy.executors.SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.values, self.sentences, self.heard = {}, [], 0
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._on, 10)

    def _on(self, message):
        status = message.status[0]
        self.values = {pair.key: pair.value for pair in status.values}
        self.sentences.append(status.message)
        self.heard += 1

    def until(self, true, what):
        deadline = time.monotonic() + PATIENCE
        while not true():
            if time.monotonic() > deadline:
                raise SystemExit(f'no {what} in {PATIENCE:g} s')
            self.executor.spin_once(timeout_sec=0.1)

    def rest(self, seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.1)

    def now(self):
        # Two more, so that the second one tells of the time after now.
        heard = self.heard
        self.until(lambda: self.heard >= heard + 2, 'diagnostics')
        return self.values


def one(options, watcher, reliability):
    burners, processes = [], []
    descriptor, path = tempfile.mkstemp(prefix='losses_')
    os.close(descriptor)
    np.zeros(SENT + options.publishers, np.int64).tofile(path)
    slots = np.memmap(path, np.int64, 'r+')

    def start(*command):
        process = subprocess.Popen([*command], stdout=subprocess.DEVNULL)
        processes.append(process)
        return process

    try:
        arguments = ('--ros-args', '-p', f'{DEPTH}:={options.depth}') if options.depth else ()
        start(options.python, '-m', 'kinematics_service', '--robot', ROBOT, *arguments)
        rate = str(options.rate / options.publishers)
        for number in range(options.publishers):
            start(
                sys.executable,
                __file__,
                *('--feed', path, '--number', str(number)),
                *('--reliability', reliability, '--rate', rate),
            )
        watcher.heard = 0
        watcher.values = {}
        watcher.until(
            lambda: watcher.values.get('publishers') == str(options.publishers), 'publisher'
        )
        watcher.rest(WARM_UP)
        slots[GO] = 1
        watcher.rest(WARM_UP)
        slots[GO] = 0
        watcher.rest(REST)
        before, sent = watcher.now(), int(slots[SENT:].sum())
        burners += [subprocess.Popen([sys.executable, '-c', BURN]) for _ in range(options.burners)]
        watcher.rest(WARM_UP)
        watcher.sentences.clear()
        slots[GO] = 1
        watcher.rest(options.seconds)
        slots[GO] = 0
        watcher.rest(REST)
        after = watcher.now()
        sent = int(slots[SENT:].sum()) - sent
        slots[GO] = -1
    finally:
        for process in (*burners, *processes):
            process.send_signal(signal.SIGTERM)
        for process in (*burners, *processes):
            process.wait(timeout=30)
        os.unlink(path)
    arrived = ('accepted', 'dropped: stamp not newer')
    heard = sum(int(after[key]) - int(before[key]) for key in arrived)
    told = int(after['lost']) - int(before['lost']) if 'lost' in after else None
    said = sorted({text for text in watcher.sentences if text != 'fine'})
    print(
        f'{options.publishers} publishers, {reliability}: '
        f'{sent} sent, {heard} heard, {sent - heard} lost, '
        f'{"nothing" if told is None else told} told; sentences beside "fine": {said[:4]}',
        flush=True,
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--seconds', type=float, default=60.0)
    parser.add_argument('--burners', type=int, default=4)
    parser.add_argument('--rate', type=float, default=1000.0)
    parser.add_argument('--python', default=sys.executable)
    parser.add_argument('--depth', type=int, help="of the node's queue")
    parser.add_argument('--reliability', default='reliable,best_effort')
    parser.add_argument('--publishers', type=int, default=1, help='who share the rate')
    parser.add_argument('--feed', help=argparse.SUPPRESS)
    parser.add_argument('--number', type=int, default=0, help=argparse.SUPPRESS)
    options = parser.parse_args()
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', '86')
    if options.feed:
        feed(options.feed, options.number, options.reliability, options.rate)
        return
    watcher = Watcher()
    for reliability in options.reliability.split(','):
        one(options, watcher, reliability)


if __name__ == '__main__':
    main()
