# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Hostile messages: the node lives, its memory is flat, it answers the next good one right.

    python bench/fuzz.py [--messages 200000] [--seed 1]

Messages over DDS to a node of its own, most of them with one field wrong, a tenth of bytes with
lengths that lie, bits flipped, cut, put in and taken out, of every encoding, on each of its
topics; every 1000th is good and its pose is compared with the library's. The lines of the node's
log are counted.
"""

import argparse
import random
import sys
import tempfile
import time

import numpy as np

from processes import node, running  # isort: skip
import rclpy
from geometry_msgs.msg import PoseStamped, TwistStamped
from hostile_bytes import HostileBytes
from node_process import memory
from rclpy.experimental import EventsExecutor
from sensor_msgs.msg import JointState

import kinematics_service as ks

ROBOT = 'craig_3r'
NAMES = ['q1', 'q2', 'q3']
# A bare rclpy node grows by 0.3 MiB with each message of so many names (freed strings that the C
# library does not give back), so these are sent before memory is watched.
WARM_UP, MANY = 100, 20_000
SOME = 300
AT_ONCE = 50  # messages between two looks at the answers, so that no queue overflows
TOPICS = {
    'joint_states': JointState,
    'kinematics/target_pose': PoseStamped,
    'kinematics/target_twist': TwistStamped,
    'kinematics/reference_pose': PoseStamped,
}


class HostileFields:
    """Makes messages, each with one thing wrong (or nothing)."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        self.kinds = [name for name in dir(self) if name.startswith('make_')]

    def numbers(self, count):
        choices = [0.0, 1.0, -3.14, 1e308, -1e308, 5e-324, float('nan'), float('inf'), -1e15]
        return [
            self.random.choice(choices) if self.random.random() < 0.3 else self.random.gauss(0, 2)
            for _ in range(count)
        ]

    def __call__(self, message):
        message.name, message.velocity, message.effort = list(NAMES), [0.1] * 3, []
        message.position = [self.random.uniform(-3, 3) for _ in NAMES]
        now = time.time_ns()
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(now, 1_000_000_000)
        kind = self.random.choice(self.kinds)
        getattr(self, kind)(message)
        return kind

    def make_order(self, m):
        self.random.shuffle(m.name)

    def make_extra_names(self, m):
        extra = self.random.randrange(1, 60)
        m.name += [f'other{k}' for k in range(extra)]
        m.position = list(m.position) + self.numbers(extra)
        m.velocity = []

    def make_foreign(self, m):
        m.name = ['a', 'b', 'c']

    def make_part(self, m):
        k = self.random.randrange(3)
        m.name, m.position, m.velocity = [NAMES[k]], [m.position[k]], [m.velocity[k]]

    def make_no_position(self, m):
        m.position = []

    def make_wrong_length(self, m):
        m.position = self.numbers(self.random.choice([1, 2, 4, 100]))

    def make_duplicate(self, m):
        m.name = [self.random.choice(NAMES) for _ in range(3)]

    def make_numbers(self, m):
        m.position = self.numbers(3)

    def make_velocities(self, m):
        m.velocity = self.numbers(self.random.choice([0, 1, 2, 3, 3, 4]))

    def make_stamp(self, m):
        m.header.stamp.sec = self.random.choice([0, -1, -(2**31), 2**31 - 1, 1, 1_000_000])
        m.header.stamp.nanosec = self.random.choice([0, 1, 999_999_999, 2**32 - 1])

    def make_unstamped(self, m):
        m.header.stamp.sec = m.header.stamp.nanosec = 0

    def make_old(self, m):
        m.header.stamp.sec -= self.random.choice([0, 1, 2, 10, 100_000])

    def make_empty(self, m):
        m.name, m.position, m.velocity = [], [], []

    def make_many(self, m):
        if self.random.random() < 0.01:
            self.fill(m, SOME)

    def fill(self, m, count):
        m.header.frame_id = 'x' * 10_000
        m.name = [f'j{k}' for k in range(count)]
        m.position = [0.0] * count

    def make_odd_names(self, m):
        m.name = [
            self.random.choice(['', ' ', 'q1 ', 'Q1', '\0', 'é' * 300, 'q\n1']) for _ in NAMES
        ]

    def make_frame(self, m):
        m.header.frame_id = 'x' * self.random.randrange(10_000)


class Peer:
    """Sends messages to the node, and hears its poses."""

    def __init__(self, seed):
        rclpy.init()
        self.node = rclpy.create_node('fuzz')
        self.robot, self.answers, self.number = ks.load_robot(ROBOT), {}, 0
        self.node.create_subscription(PoseStamped, '/kinematics/pose', self._on_pose, 1000)
        self.publishers = [
            (kind, self.node.create_publisher(kind, name, 1000)) for name, kind in TOPICS.items()
        ]
        self.executor = EventsExecutor()
        self.executor.add_node(self.node)
        self.fields, self.bytes, self.message = (
            HostileFields(seed),
            HostileBytes(seed),
            JointState(),
        )
        while any(publisher.get_subscription_count() == 0 for _, publisher in self.publishers):
            self.executor.spin_once(timeout_sec=0.1)
        while not self.node.count_publishers('/kinematics/pose'):
            self.executor.spin_once(timeout_sec=0.1)

    def _on_pose(self, message):
        self.number += 1
        stamp = message.header.stamp
        self.answers[(stamp.sec, stamp.nanosec)] = message.pose.position

    def warm_up(self):
        """Send the longest messages."""
        for _ in range(WARM_UP):
            self.fields.fill(self.message, MANY)
            self.publishers[0][1].publish(self.message)
            time.sleep(0.02)

    def send(self, k):
        """Send a hostile message: each tenth is of bytes, on one of all topics."""
        if k % 10:
            self.fields(self.message)
            self.publishers[0][1].publish(self.message)
        else:
            kind, publisher = self.bytes.random.choice(self.publishers)
            publisher.publish(self.bytes(kind))
        if k % AT_ONCE == 0:
            self.executor.spin_once(timeout_sec=0.0)
            time.sleep(0.01)

    def good_one_is_answered(self):
        """Return whether a good message has its answer."""
        # Stamped anew at each try: what came before may have been stamped in the future.
        message = JointState(name=NAMES, velocity=[0.0] * 3)
        message.position = [self.fields.random.uniform(-3, 3) for _ in NAMES]
        deadline = time.monotonic() + 10
        while time.monotonic() < deadline:
            key = divmod(time.time_ns(), 1_000_000_000)
            message.header.stamp.sec, message.header.stamp.nanosec = key
            self.publishers[0][1].publish(message)
            until = time.monotonic() + 0.2
            while key not in self.answers and time.monotonic() < until:
                self.executor.spin_once(timeout_sec=0.02)
            if key in self.answers:
                p = self.answers[key]
                expected = ks.forward_kinematics(self.robot, list(message.position))[:3, 3]
                assert np.allclose([p.x, p.y, p.z], expected, atol=1e-12), 'wrong answer'
                self.answers.clear()
                return True
        return False


def over_dds(messages, seed):
    """Send messages to a node; return whether it ended badly."""
    sizes, checked = [], 0
    # A file: a pipe that nobody empties would stop the node.
    with tempfile.TemporaryFile('w+') as log:
        with running(node('--robot', ROBOT), stderr=log) as process:
            peer = Peer(seed)
            peer.warm_up()
            begin = time.monotonic()
            for k in range(1, messages + 1):
                peer.send(k)
                if k % 1000 == 0:
                    assert process.poll() is None, 'the node died'
                    assert peer.good_one_is_answered(), 'no answer to a good message'
                    checked += 1
                if k % max(1, messages // 20) == 0:
                    sizes.append(memory(process.pid))
                    print(
                        f'{k:8} messages  {peer.number:8} answers  {sizes[-1]:8.1f} MiB',
                        flush=True,
                    )
            elapsed = time.monotonic() - begin
        log.seek(0)
        lines = log.read().splitlines()
    faults = [line for line in lines if 'internal error' in line or 'Traceback' in line]
    warm = sizes[len(sizes) // 4 :]
    print(
        f'{messages} hostile messages in {elapsed:.0f} s, {checked} good ones checked, '
        f'memory after warm-up {min(warm):.1f} to {max(warm):.1f} MiB, {len(lines)} log lines, '
        f'{len(faults)} internal errors, exit code {process.returncode}'
    )
    print('\n'.join(faults[:3]))
    return bool(process.returncode or faults)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--messages', type=int, default=200_000)
    parser.add_argument('--seed', type=int, default=1)
    options = parser.parse_args()
    return int(over_dds(options.messages, options.seed))


if __name__ == '__main__':
    sys.exit(main())
