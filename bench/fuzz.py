"""
Two hundred thousand hostile messages: the node lives, its memory is flat, and it answers the next.

    python bench/fuzz.py [--messages 200000] [--seed 1]

Each message is one row of the input table at random, most of them wrong; every 1000th is good and
its pose is compared with the library's. The node runs in a process of its own.
"""

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np

ROBOT = 'craig_3r'
NAMES = ['q1', 'q2', 'q3']
# A bare rclpy node grows by 0.3 MiB with each message of so many names (freed strings that the C
# library does not give back), so these are sent before memory is watched.
WARM_UP, MANY = 100, 20_000
SOME = 300
AT_ONCE = 50  # messages between two looks at the answers, so that no queue overflows


def rss(pid):
    with open(f'/proc/{pid}/status') as status:
        return next(int(line.split()[1]) for line in status if line.startswith('VmRSS')) / 1024


class Hostile:
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


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--messages', type=int, default=200_000)
    parser.add_argument('--seed', type=int, default=1)
    arguments = parser.parse_args()
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', '88')
    import rclpy
    from geometry_msgs.msg import PoseStamped
    from rclpy.experimental import EventsExecutor
    from sensor_msgs.msg import JointState

    import kinematics_service as ks

    robot = ks.load_robot(ROBOT)
    rclpy.init()
    node = rclpy.create_node('fuzz')
    answers = {}
    total = [0]

    def on_pose(message):
        total[0] += 1
        stamp = message.header.stamp
        answers[(stamp.sec, stamp.nanosec)] = message.pose.position

    node.create_subscription(PoseStamped, '/kinematics/pose', on_pose, 1000)
    publisher = node.create_publisher(JointState, 'joint_states', 1000)
    executor = EventsExecutor()
    executor.add_node(node)
    # A file: a pipe that nobody empties would stop the node.
    log = tempfile.TemporaryFile('w+')  # noqa: SIM115
    server = subprocess.Popen(
        [sys.executable, '-m', 'kinematics_service', '--robot', ROBOT],
        stderr=log,
    )
    hostile, message = Hostile(arguments.seed), JointState()
    checked, memory = 0, []

    def good_one_is_answered():
        # Stamped anew at each try: what came before may have been stamped in the future.
        message.name, message.velocity = list(NAMES), [0.0] * 3
        message.position = [hostile.random.uniform(-3, 3) for _ in NAMES]
        message.header.frame_id = ''
        deadline = time.monotonic() + 10
        while time.monotonic() < deadline:
            now = time.time_ns()
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(now, 1_000_000_000)
            key = (message.header.stamp.sec, message.header.stamp.nanosec)
            publisher.publish(message)
            until = time.monotonic() + 0.2
            while key not in answers and time.monotonic() < until:
                executor.spin_once(timeout_sec=0.02)
            if key in answers:
                p = answers[key]
                expected = ks.forward_kinematics(robot, list(message.position))[:3, 3]
                assert np.allclose([p.x, p.y, p.z], expected, atol=1e-12), 'wrong answer'
                return True
        return False

    try:
        while publisher.get_subscription_count() == 0 or not node.count_publishers(
            '/kinematics/pose'
        ):
            executor.spin_once(timeout_sec=0.1)
        for _ in range(WARM_UP):
            hostile.fill(message, MANY)
            publisher.publish(message)
            time.sleep(0.02)
        begin = time.monotonic()
        for k in range(1, arguments.messages + 1):
            hostile(message)
            publisher.publish(message)
            if k % AT_ONCE == 0:
                executor.spin_once(timeout_sec=0.0)
                time.sleep(0.01)
            if k % 1000 == 0:
                assert server.poll() is None, 'the node died'
                assert good_one_is_answered(), 'no answer to a good message'
                checked += 1
                answers.clear()
            if k % (arguments.messages // 20) == 0:
                memory.append(rss(server.pid))
                print(f'{k:8} messages  {total[0]:8} answers  {memory[-1]:8.1f} MiB', flush=True)
        elapsed = time.monotonic() - begin
    finally:
        server.send_signal(signal.SIGINT)
        server.wait(timeout=20)
    log.seek(0)
    errors = log.read()
    internal = [line for line in errors.splitlines() if 'internal error' in line]
    warm = memory[len(memory) // 4 :]
    print(
        f'{arguments.messages} hostile messages in {elapsed:.0f} s, {checked} good ones checked, '
        f'memory after warm-up {min(warm):.1f} to {max(warm):.1f} MiB, '
        f'{len(internal)} internal errors, exit code {server.returncode}'
    )
    print('\n'.join(internal[:3]))
    return 1 if server.returncode or internal or 'Traceback' in errors else 0


if __name__ == '__main__':
    sys.exit(main())
