"""
Closed loops: what they cost a message, and whether every answer is closed or refused truly.

    python bench/loops.py [--poses 100000]

The message of an arm with a loop stands beside that of the same arm with coupled joints. The
random positions are those of a five-bar without limits whose rods are too short for half of them.
"""

import argparse
import math
import re
import time

import numpy as np

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.estimation.estimator import Estimator, EstimatorSettings
from kinematics_service.estimation.joint_sample import JointSample
from kinematics_service.robot.closed_poses import close_at

ROUNDS, MESSAGES = 40, 400
GRID = 3601  # directions of a rod in the dense search


class Stream:
    """Samples of a slow motion, every millisecond."""

    def __init__(self, robot, middle):
        self.estimator, self.at = Estimator(robot, EstimatorSettings()), 10**12
        t = np.arange(MESSAGES)[:, None] * 1e-3
        swing = 0.2 * np.sin(2.0 * math.pi * t + np.arange(robot.dof))
        self.names = robot.joint_names
        self.q = [tuple(row) for row in (np.asarray(middle) + swing).tolist()]
        self.qdot = tuple([0.1] * robot.dof)

    def run(self):
        """Return the seconds of a message."""
        samples = []
        for q in self.q:
            self.at += 1_000_000
            samples.append(JointSample(self.names, q, self.qdot, self.at, self.at, self.at))
        begin = time.perf_counter()
        for sample in samples:
            self.estimator.take(sample, kernel.JACOBIAN)
        return (time.perf_counter() - begin) / len(samples)


def messages():
    """Print the time of a message of arms with and without loops."""
    arms = {
        'parallelogram_left': ([0.0, 1.5, 0.2], 0),
        'four_bar_arm': ([0.0, 1.5, 0.2], 1),
        'five_bar': ([2.1, 1.0], 1),
        'excavator': ([0.0, 2.7, 2.9, 2.3], 4),
        'flexpicker': ([0.2, 0.0, 0.4], 3),
    }
    streams = {name: Stream(ks.load_robot(name), middle) for name, (middle, _) in arms.items()}
    best = dict.fromkeys(streams, math.inf)
    for _ in range(ROUNDS):
        for name, stream in streams.items():
            best[name] = min(best[name], stream.run())
    print(f'{"arm":20} {"loops":>5} {"us a message":>13}')
    for name, seconds in best.items():
        print(f'{name:20} {arms[name][1]:5} {1e6 * seconds:13.2f}')


def short_five_bar():
    """Return a five-bar without limits whose rods reach half of all positions of its elbows."""
    text = ks.bundled_robots()['five_bar'].read_text(encoding='utf-8').split('known_poses')[0]
    text = re.sub(r', limits: \[.*?\]', '', text.replace('distal: 0.4', 'distal: 0.2'))
    elbow = math.pi / 2 - math.acos(0.15 / 0.2)
    place = f'assembled: {{q: [pi/2, pi/2], psi1: {-elbow}, psi2: {elbow}}}'
    return ks.robot_from_text(re.sub('assembled: .*', place, text))


def positions(count):
    """Print how many random positions close, how well, and how many are refused wrongly."""
    robot = short_five_bar()
    q = np.random.default_rng(7).uniform(-math.pi, math.pi, (count, 2))
    begin = time.perf_counter()
    sections, failed = close_at(robot.chain, q)
    seconds = time.perf_counter() - begin
    closed = failed == 0.0
    left = 0.25 * np.stack([np.cos(q[:, 0]), np.sin(q[:, 0])], axis=1)
    right = 0.25 * np.stack([np.cos(q[:, 1]), np.sin(q[:, 1])], axis=1) + [0.3, 0.0]
    ends = [
        pin + 0.2 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        for pin, angle in ((left, q[:, 0] + sections[:, 2]), (right, q[:, 1] + sections[:, 3]))
    ]
    apart = np.linalg.norm(ends[0] - ends[1], axis=1)
    way, tip = right - left, ends[0] - left
    side = way[:, 0] * tip[:, 1] - way[:, 1] * tip[:, 0]
    angles = np.linspace(-math.pi, math.pi, GRID)
    around = 0.2 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    open_ones = np.flatnonzero(~closed)
    wrongly = sum(
        bool(np.min(np.linalg.norm(left[k] + around - right[k], axis=1)) < 0.2)
        for k in open_ones[:200]
    )
    reachable = np.linalg.norm(way, axis=1) <= 0.4
    print(f'{count} random positions of a five-bar: {int(np.sum(closed))} closed')
    print(f'  ends apart by at most {np.max(apart[closed]):.1e} m')
    print(f'  on the other branch: {int(np.sum(side[closed] <= 0.0))}')
    print(f'  refused though the rods reach: {int(np.sum(~closed & reachable))}')
    print(f'  of 200 refused, dense search closes {wrongly}')
    print(f'  {1e6 * seconds / count:.0f} us each, from the known position')


def main():
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--poses', type=int, default=100_000)
    arguments = parser.parse_args()
    messages()
    print()
    positions(arguments.poses)


if __name__ == '__main__':
    main()
