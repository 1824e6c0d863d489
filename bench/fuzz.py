"""
Hostile messages: the node lives, its memory is flat, it answers the next good one right.

    python bench/fuzz.py [--messages 200000] [--bytes 300000] [--seed 1]

First bytes with lengths that lie, bits flipped, cut, put in and taken out, of every encoding: what
the official deserializer refuses must be refused, and nothing else. Then messages over DDS to a
node of its own, most of them with one field wrong, some of such bytes on each of its topics; every
1000th is good and its pose is compared with the library's. The lines of the node's log are
counted.
"""

import argparse
import contextlib
import os
import random
import struct
import sys
import tempfile
import time

import numpy as np

from processes import node, running  # isort: skip
import rclpy
from geometry_msgs.msg import PoseStamped, TwistStamped
from node_process import memory
from rclpy.experimental import EventsExecutor
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState

import kinematics_service as ks
from kinematics_service.ros.messages.message_check import WALKS, is_whole

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
TEXTS = (b'', b'\0', b'a\0', b'ab', b'abc\0', b'\xff\xfe\0', b'a\0b\0', b'q1\0', b'q2\0', b'q3\0')
LENGTHS = (0, 1, 2**31, 2**32 - 1)
# Second byte of the encapsulation by order of bytes and alignment of doubles.
ENCODINGS = {('<', 8): (1, 3), ('>', 8): (0, 2), ('<', 4): (7, 9, 11), ('>', 4): (6, 8, 10)}


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


class HostileBytes:
    """Makes bytes that are nearly a message of a kind."""

    def __init__(self, seed):
        self.random = random.Random(seed)

    def __call__(self, kind):
        draw = self.random
        if draw.random() < 0.002:
            return draw.randbytes(draw.randrange(80))
        data = self._serialized(kind)
        for _ in range(draw.choice([0, 0, 0, 1, 1, 2, 8])):
            if data:
                self._spoil(data)
        return bytes(data)

    def _length(self, count):
        if self.random.random() < 0.06:
            return self.random.choice((*LENGTHS, count - 1, count + 1, 2 * count)) % 2**32
        return count

    def _serialized(self, kind):
        draw, data = self.random, bytearray()
        order, size = draw.choice('<<<>'), draw.choice([8, 8, 8, 4])
        fill = draw.choice([b'\0', b'\xd0'])

        def align(to):
            data.extend(fill * (-len(data) % to))

        def number(value):
            align(4)
            data.extend(struct.pack(order + 'I', value))

        def text():
            one = draw.choice(TEXTS)
            number(self._length(len(one)))
            data.extend(one)

        def doubles(count):
            if count:
                align(size)
            data.extend(struct.pack(f'{order}{count}d', *(draw.gauss(0, 1) for _ in range(count))))

        number(draw.choice([0, 1, 5, 2**31]))
        number(draw.randrange(2**32))
        text()
        if kind.__name__ == 'JointState':
            count = draw.choice([0, 1, 2, 3, 6, 20])
            number(self._length(count))
            for _ in range(count):
                text()
            for _ in range(3):
                many = draw.choice([count, count, 0, 1, count + 1])
                number(self._length(many))
                doubles(many)
        else:
            doubles(7 if kind.__name__ == 'PoseStamped' else 6)
        head = (0, draw.choice(ENCODINGS[order, size]), draw.choice([0, 255]), draw.choice([0, 3]))
        return bytearray(head) + data

    def _spoil(self, data):
        draw = self.random
        at, kind = draw.randrange(len(data)), draw.randrange(7)
        if kind == 0:
            data[at] ^= 1 << draw.randrange(8)
        elif kind == 1:
            del data[at:]
        elif kind == 2:
            data[at:at] = draw.randbytes(draw.randrange(1, 9))
        elif kind == 3:
            del data[at : at + draw.randrange(1, 9)]
        elif kind == 4:
            data[at] = draw.choice([0, 1, 127, 255])
        elif kind == 5:
            data[1:2] = bytes([draw.choice([*range(20), 128, 255])])
        else:
            data.extend(bytes(draw.randrange(20)))


@contextlib.contextmanager
def silent():
    """Nothing on standard error, where the official deserializer says what it refuses."""
    kept = os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)


def beside_the_official(messages, seed):
    hostile, kinds = HostileBytes(seed), list(WALKS)
    accepted = differences = 0
    with silent():
        for _ in range(messages):
            kind = hostile.random.choice(kinds)
            data = hostile(kind)
            try:
                deserialize_message(data, kind)
                official = True
            except Exception:  # whatever it raises
                official = False
            accepted += official
            if is_whole(data, kind) != official:
                differences += 1
                print(f'{"refused" if official else "let through"}: {kind.__name__} {data.hex()}')
    print(f'{messages} messages, {accepted} accepted, {differences} differences', flush=True)
    return differences


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
    parser.add_argument('--bytes', type=int, default=300_000)
    parser.add_argument('--seed', type=int, default=1)
    options = parser.parse_args()
    bad = beside_the_official(options.bytes, options.seed)
    return 1 if over_dds(options.messages, options.seed) or bad else 0


if __name__ == '__main__':
    sys.exit(main())
