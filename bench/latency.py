# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Lost messages, latency, memory and unanswered requests: node, feeder and listener, three processes.

    python bench/latency.py [--rate 1000] [--seconds 60] [--robot ur5e]
        [--burners 0] [--reliability reliable] [--depth 1000] [--targets 0] [--reload]

The listener hears pose, Jacobian, twist and one scalar; lost is what was sent and came with no
pose, told what the node's diagnostics say was lost. Latency is from the stamp to the listener's
callback, by sixths of the time. Every half second the node is asked to describe itself; an answer
is late if it comes after the next call. `--burners` are processes that only compute: the feeder
then comes before others, as a driver does. `--targets` is the rate of target poses (Hz), which
another process sends; with `--reload` every second request is one to read the robot again.
`--seconds 3600 --targets 30 --reload` is the soak: a line every five minutes gives the figures so
far.
"""

import argparse
import contextlib
import os
import subprocess
import sys
import time

import numpy as np

from processes import JointStates, age_of, node, paced, peer, running  # isort: skip
from node_process import memory, processor_seconds

WINDOWS = 6
# Memory of the first minutes is not counted: caches fill.
SETTLED = 1 / 6
# Seconds between two requests, two looks at the memory, two lines about the time so far.
ASKED_EVERY, LOOKED_EVERY, SAID_EVERY = 0.5, 5.0, 300.0
BURN = 'while True: pass'
TOPICS = ('jacobian', 'twist', 'singularity/distance')


def feed(options):
    """Publish joint states with the time of sending as their stamp."""
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from sensor_msgs.msg import JointState

    import kinematics_service as ks

    with peer('feeder') as node:
        qos = QoSProfile(depth=100, reliability=ReliabilityPolicy[options.reliability.upper()])
        publisher = node.create_publisher(JointState, 'joint_states', qos)
        while publisher.get_subscription_count() == 0:
            time.sleep(0.05)
        time.sleep(1.0)
        if options.burners:
            with contextlib.suppress(PermissionError):
                os.nice(-15)
        joints, messages = np.arange(ks.load_robot(options.robot).dof), JointStates(options.robot)
        for k in paced(options.rate):
            if k == round(options.rate * options.seconds):
                break
            publisher.publish(messages.at(1.5 * np.sin(0.001 * k + joints)))
        time.sleep(2.0)


def feed_targets(options):
    """Publish target poses that the arm can reach, at their rate, until SIGINT."""
    from geometry_msgs.msg import PoseStamped

    import kinematics_service as ks
    from kinematics_service import kernel

    with peer('target_feeder') as node:
        publisher = node.create_publisher(PoseStamped, '/kinematics/target_pose', 10)
        robot = ks.load_robot(options.robot)
        joints, message, xyzw = np.arange(robot.dof), PoseStamped(), np.empty((1, 4))
        message.header.frame_id = robot.base_frame
        for k in paced(options.targets):
            T = ks.forward_kinematics(robot, np.sin(0.01 * k + joints))
            kernel.quaternions(T[None], xyzw)
            place, turn = message.pose.position, message.pose.orientation
            place.x, place.y, place.z = map(float, T[:3, 3])
            turn.x, turn.y, turn.z, turn.w = map(float, xyzw[0])
            message.header.stamp = node.get_clock().now().to_msg()
            publisher.publish(message)


class Listener:
    """Hears what the node answers, says of itself, and is asked for."""

    def __init__(self, reload=False):
        import rclpy
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import PoseStamped, TwistStamped
        from rclpy.experimental import EventsExecutor
        from sensor_msgs.msg import JointState
        from std_msgs.msg import Float64, Float64MultiArray
        from std_srvs.srv import Trigger

        rclpy.init()
        self.node = rclpy.create_node('listener')
        self.ages, self.told, self.waits, self.asked = [], {}, [], 0
        self._subscribe(PoseStamped, 'pose', lambda data: self.ages.append(1e3 * age_of(data)))
        for kind, name in zip((Float64MultiArray, TwistStamped, Float64), TOPICS):
            self._subscribe(kind, name, lambda data: None)
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10)
        names = ('describe', 'reload') if reload else ('describe',)
        self._clients = [self.node.create_client(Trigger, f'/kinematics/{name}') for name in names]
        self.refused = self.targets = 0
        self._subscribe(JointState, 'ik/joint_states', self._count_target)
        self._request, self._last = Trigger.Request(), time.monotonic()
        self.executor = EventsExecutor()
        self.executor.add_node(self.node)

    def _subscribe(self, kind, name, hear):
        self.node.create_subscription(kind, f'/kinematics/{name}', hear, 1000, raw=True)

    def _count_target(self, data):
        self.targets += 1

    def _on_answer(self, future, asked):
        self.waits.append(time.monotonic() - asked)
        self.refused += not future.result().success

    def _on_diagnostics(self, message):
        self.told = {pair.key: pair.value for pair in message.status[0].values}

    def listen(self, seconds):
        """Listen for a while, and call the service if it is time to."""
        from rclpy.task import Future

        self.executor.spin_until_future_complete(Future(), timeout_sec=seconds)
        now, client = time.monotonic(), self._clients[self.asked % len(self._clients)]
        if now - self._last < ASKED_EVERY or not client.service_is_ready():
            return
        self._last = now
        self.asked += 1
        client.call_async(self._request).add_done_callback(
            lambda future: self._on_answer(future, now)
        )

    @property
    def requests(self):
        """Return what became of the requests, as a text."""
        late = sum(wait > ASKED_EVERY for wait in self.waits)
        return (
            f'{self.asked} requests, {len(self.waits)} answered, {late} of them late, '
            f'{self.refused} refused, longest {max(self.waits, default=0.0):.2f} s; '
            f'{self.targets} targets answered'
        )


def watch(server, listener):
    """Listen while the feeder sends; return the memory (MiB) by time and the CPU seconds used."""
    while listener.node.count_publishers('/kinematics/pose') == 0:
        listener.listen(0.1)
    found, used = [], processor_seconds(server.pid)
    with running([sys.executable, __file__, *sys.argv[1:], '--feed']) as feeder:
        next_look = said = begin = time.monotonic()
        while feeder.poll() is None:
            listener.listen(0.1)
            now = time.monotonic()
            if listener.ages and now >= next_look:
                found.append(memory(server.pid))
                next_look = now + LOOKED_EVERY
            if now - said >= SAID_EVERY:
                said += SAID_EVERY
                print(
                    f'{said - begin:.0f} s: {len(listener.ages)} poses, {listener.requests}, '
                    f'{found[-1]:.2f} MiB, load {os.getloadavg()[0]:.0f}',
                    flush=True,
                )
    used = processor_seconds(server.pid) - used
    end = time.monotonic() + 2.5
    while time.monotonic() < end:
        listener.listen(0.1)
    return np.array(found), used


def report(options, listener, found, used):
    """Print what was seen."""
    sent, heard = round(options.rate * options.seconds), len(listener.ages)
    print(f'{sent} messages at {options.rate:g} Hz, {options.robot}, {options.burners} burners')
    print(f'poses lost {sent - heard}, told {listener.told.get("lost", "nothing")}')
    print(listener.requests)
    print(f'{"window":>8}{"p50 ms":>9}{"p99 ms":>9}{"max ms":>9}')
    for k, window in enumerate(np.array_split(np.array(listener.ages), WINDOWS)):
        p50, p99 = np.percentile(window, [50, 99])
        print(f'{k + 1:>8}{p50:9.3f}{p99:9.3f}{window.max():9.3f}')
    tenths = np.array_split(found, min(10, len(found)))
    print('memory, MiB, a tenth of the time each:', *(f'{part.max():.2f}' for part in tenths))
    settled = found[round(SETTLED * len(found)) :]
    print(
        f'memory: {found[0]:.2f} MiB at first, then {settled.min():.2f} to {settled.max():.2f} '
        f'in the last {(1 - SETTLED) * options.seconds / 60.0:.3g} minutes'
    )
    print(
        f'CPU of the node: {100.0 * used / options.seconds:.0f} % of a core, '
        f'{1e6 * used / max(heard, 1):.0f} us a message'
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--rate', type=float, default=1000.0)
    parser.add_argument('--seconds', type=float, default=60.0)
    parser.add_argument('--robot', default='ur5e')
    parser.add_argument('--burners', type=int, default=0)
    parser.add_argument('--reliability', choices=('reliable', 'best_effort'), default='reliable')
    parser.add_argument('--depth', type=int, help="of the node's queue")
    parser.add_argument('--targets', type=float, default=0.0, help='rate of target poses, Hz')
    parser.add_argument('--reload', action='store_true', help='reload the robot every second')
    for part in ('--feed', '--feed-targets'):
        parser.add_argument(part, action='store_true', help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.feed or options.feed_targets:
        (feed if options.feed else feed_targets)(options)
        return
    queue = ('-p', f'qos_overrides./joint_states.subscription.depth:={options.depth}')
    arguments = ('--ros-args', *queue) if options.depth else ()
    with contextlib.ExitStack() as stack:
        server = stack.enter_context(running(node('--robot', options.robot, *arguments)))
        for _ in range(options.burners):
            stack.enter_context(running([sys.executable, '-c', BURN], stderr=subprocess.DEVNULL))
        if options.targets:
            targets = [sys.executable, __file__, *sys.argv[1:], '--feed-targets']
            stack.enter_context(running(targets))
        listener = Listener(options.reload)
        found, used = watch(server, listener)
    report(options, listener, found, used)
    print(f'exit code of the node: {server.returncode}')


if __name__ == '__main__':
    main()
