"""
Hostile bytes: beside the official deserializer, and over DDS with the node's log counted.

    python bench/fuzz_bytes.py [--messages 300000] [--over-dds 200000] [--seed 1]

Serialized messages with lengths that lie, bits flipped, bytes cut, put in and taken out, of every
encoding. The node must refuse what the official deserializer refuses, and nothing else.
"""

import argparse
import contextlib
import os
import random
import signal
import struct
import subprocess
import sys
import tempfile
import time

TEXTS = (b'', b'\0', b'a\0', b'ab', b'abc\0', b'\xff\xfe\0', b'a\0b\0', b'q1\0', b'q2\0', b'q3\0')
LENGTHS = (0, 1, 2**31, 2**32 - 1)
# Second byte of the encapsulation by order of bytes and alignment of doubles.
ENCODINGS = {('<', 8): (1, 3), ('>', 8): (0, 2), ('<', 4): (7, 9, 11), ('>', 4): (6, 8, 10)}
AT_ONCE = 100


class Hostile:
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
    from rclpy.serialization import deserialize_message

    from kinematics_service.ros.messages.message_check import WALKS, is_whole

    hostile, kinds = Hostile(seed), list(WALKS)
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


def over_dds(messages, seed):
    import rclpy
    from geometry_msgs.msg import PoseStamped, TwistStamped
    from sensor_msgs.msg import JointState

    log = tempfile.TemporaryFile('w+')  # noqa: SIM115
    node = subprocess.Popen(
        [sys.executable, '-m', 'kinematics_service', '--robot', 'craig_3r'], stderr=log
    )
    rclpy.init()
    peer = rclpy.create_node('hostile')
    topics = {
        'joint_states': JointState,
        'kinematics/target_pose': PoseStamped,
        'kinematics/target_twist': TwistStamped,
        'kinematics/reference_pose': PoseStamped,
    }
    publishers = [(kind, peer.create_publisher(kind, name, 100)) for name, kind in topics.items()]
    hostile = Hostile(seed)
    try:
        while any(publisher.get_subscription_count() == 0 for _, publisher in publishers):
            time.sleep(0.05)
        begin = time.monotonic()
        for k in range(messages):
            kind, publisher = hostile.random.choice(publishers)
            publisher.publish(hostile(kind))
            if k % AT_ONCE == 0:
                time.sleep(0.02)
            assert node.poll() is None, 'the node died'
        elapsed = time.monotonic() - begin
        time.sleep(2.0)
    finally:
        node.send_signal(signal.SIGINT)
        node.wait(timeout=30)
    log.seek(0)
    lines = log.read().splitlines()
    print(
        f'{messages} messages over DDS in {elapsed:.0f} s: {len(lines)} log lines, '
        f'exit code {node.returncode}'
    )
    print('\n'.join(sorted({line.partition(']: ')[2] or line for line in lines})[:20]))
    return node.returncode


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--messages', type=int, default=300_000)
    parser.add_argument('--over-dds', type=int, default=200_000)
    parser.add_argument('--seed', type=int, default=1)
    options = parser.parse_args()
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', '85')
    bad = beside_the_official(options.messages, options.seed)
    return 1 if over_dds(options.over_dds, options.seed) or bad else 0


if __name__ == '__main__':
    sys.exit(main())
