"""
An hour at 1 kHz: memory flat, nothing lost, latency the same at the end, every request answered.

    python bench/soak.py [--minutes 60] [--rate 1000] [--robot ur5e]

Node, feeder and listener are three processes. The listener hears pose, Jacobian, twist and one
scalar; lost is what was sent and came with no pose. Memory is the node's resident set. Every half
second it calls `~/describe`: an answer is late if it comes after the next call. A line every five
minutes says what there was by then.
"""

import argparse
import math
import os
import signal
import struct
import subprocess
import sys
import time

import numpy as np

SECOND = 1_000_000_000
WINDOWS = 6
# Memory of the first minutes is not counted: caches fill.
SETTLED = 1 / 6
# Feeder and listener handle bytes, so that they leave the machine to the node: CDR begins with
# four bytes of its own, and both messages with a stamp.
STAMP = struct.Struct('<iI')
BEHIND_HEADER = 4
SENTINEL = 0.123456789
# Seconds between two requests, and between two lines about the time so far.
ASKED_EVERY, SAID_EVERY = 0.5, 300.0


def feed(arguments):
    """Publish joint states with the time of sending as their stamp."""
    import rclpy
    from rclpy.serialization import serialize_message
    from sensor_msgs.msg import JointState

    import kinematics_service as ks

    rclpy.init()
    node = rclpy.create_node('feeder')
    publisher = node.create_publisher(JointState, 'joint_states', 100)
    while publisher.get_subscription_count() == 0:
        time.sleep(0.05)
    time.sleep(1.0)
    robot = ks.load_robot(arguments.robot)
    message = JointState(name=robot.joint_names, velocity=[0.1] * robot.dof)
    message.position = [SENTINEL] * robot.dof
    data = bytearray(serialize_message(message))
    places = data.index(struct.pack('<d', SENTINEL))
    period, begin = 1.0 / arguments.rate, time.perf_counter()
    for k in range(round(arguments.rate * arguments.minutes * 60.0)):
        wait = begin + k * period - time.perf_counter()
        if wait > 0:
            time.sleep(wait)
        positions = [1.5 * math.sin(0.001 * k + joint) for joint in range(robot.dof)]
        struct.pack_into(f'<{robot.dof}d', data, places, *positions)
        STAMP.pack_into(data, BEHIND_HEADER, *divmod(time.time_ns(), SECOND))
        publisher.publish(bytes(data))
    time.sleep(2.0)
    rclpy.shutdown()


def resident(pid):
    """Return the resident set of a process in MiB."""
    with open(f'/proc/{pid}/statm') as statm:
        return int(statm.read().split()[1]) * os.sysconf('SC_PAGE_SIZE') / 2**20


class Requests:
    """Calls of the node's service `~/describe`."""

    def __init__(self, node):
        from std_srvs.srv import Trigger

        self._client = node.create_client(Trigger, '/kinematics/describe')
        self._request = Trigger.Request()
        self._asked = time.monotonic()
        self.number, self.waits = 0, []

    def ask(self):
        """Call the service if it is time to."""
        now = time.monotonic()
        if now - self._asked < ASKED_EVERY or not self._client.service_is_ready():
            return
        self._asked = now
        self.number += 1
        self._client.call_async(self._request).add_done_callback(
            lambda future: self.waits.append(time.monotonic() - now)
        )

    def __str__(self):
        late = sum(wait > ASKED_EVERY for wait in self.waits)
        return (
            f'{self.number} requests, {len(self.waits)} answered, {late} of them late, '
            f'longest {max(self.waits, default=0.0):.2f} s'
        )


def watch(arguments):
    """Start node and feeder, listen, and print what was seen."""
    import rclpy
    from geometry_msgs.msg import PoseStamped, TwistStamped
    from rclpy.experimental import EventsExecutor
    from rclpy.qos import QoSProfile
    from rclpy.task import Future
    from std_msgs.msg import Float64, Float64MultiArray

    rclpy.init()
    node = rclpy.create_node('listener')
    latencies = []

    def on_pose(data):
        seconds, nanoseconds = STAMP.unpack_from(data, BEHIND_HEADER)
        latencies.append((time.time_ns() - seconds * SECOND - nanoseconds) * 1e-6)

    qos = QoSProfile(depth=1000)
    node.create_subscription(PoseStamped, '/kinematics/pose', on_pose, qos, raw=True)
    for kind, name in (
        (Float64MultiArray, 'jacobian'),
        (TwistStamped, 'twist'),
        (Float64, 'singularity/distance'),
    ):
        node.create_subscription(kind, f'/kinematics/{name}', lambda data: None, qos, raw=True)
    executor, never, requests = EventsExecutor(), Future(), Requests(node)
    executor.add_node(node)
    server = subprocess.Popen(
        [sys.executable, '-m', 'kinematics_service', '--robot', arguments.robot]
    )
    memory = []
    try:
        while node.count_publishers('/kinematics/pose') == 0:
            executor.spin_once(timeout_sec=0.1)
        feeder = subprocess.Popen([sys.executable, __file__, *sys.argv[1:], '--feed'])
        next_look = said = begin = time.monotonic()
        while feeder.poll() is None:
            executor.spin_until_future_complete(never, timeout_sec=0.1)
            requests.ask()
            if time.monotonic() - said >= SAID_EVERY:
                said += SAID_EVERY
                print(
                    f'{said - begin:.0f} s: {len(latencies)} poses, {requests}, '
                    f'{memory[-1]:.2f} MiB, load {os.getloadavg()[0]:.0f}',
                    flush=True,
                )
            if latencies and time.monotonic() >= next_look:
                memory.append(resident(server.pid))
                next_look = time.monotonic() + 5.0
    finally:
        server.send_signal(signal.SIGINT)
        code = server.wait(timeout=20)
    sent = round(arguments.rate * arguments.minutes * 60.0)
    print(f'{sent} messages at {arguments.rate:g} Hz, {arguments.robot}; node exit code {code}')
    print(f'poses lost: {sent - len(latencies)}; {requests}')
    print(f'{"window":>8}{"p50 ms":>9}{"p99 ms":>9}{"max ms":>9}')
    for k, window in enumerate(np.array_split(np.array(latencies), WINDOWS)):
        p50, p99 = np.percentile(window, [50, 99])
        print(f'{k + 1:>8}{p50:9.3f}{p99:9.3f}{window.max():9.3f}')
    print('memory, MiB, a tenth of the time each: ', end='')
    print(
        ' '.join(
            f'{part.max():.2f}' for part in np.array_split(np.array(memory), min(10, len(memory)))
        )
    )
    settled = np.array(memory[round(SETTLED * len(memory)) :])
    print(
        f'memory: {memory[0]:.2f} MiB at first, then {settled.min():.2f} to '
        f'{settled.max():.2f} MiB in the last {(1 - SETTLED) * arguments.minutes:g} minutes'
    )


def main():
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--minutes', type=float, default=60.0)
    parser.add_argument('--rate', type=float, default=1000.0)
    parser.add_argument('--robot', default='ur5e')
    parser.add_argument('--feed', action='store_true', help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', '89')
    feed(arguments) if arguments.feed else watch(arguments)


if __name__ == '__main__':
    main()
