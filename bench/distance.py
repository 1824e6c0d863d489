# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The distance to the nearest singular pose against many more starts and brute force.

    python bench/distance.py [--poses 2000] [--saddles 500] [--force 0] [--seed 7] [arm ...]

prints a line for each arm: of its random poses and saddles, by their true distance, how many are
found more than 5 % too far, and how many there are; those within 0.03 rad that are called OK;
and microseconds of the search at a random pose of a batch, of a message along a motion at 500 Hz,
and of the slowest message but the first. A line of all ends it. The truth is the best of this
search, of the same search with 600 samples of the atlas and of brute force (`--force` starts).
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.robot.closed_poses import closes_at

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))

import brute_force
from arms import robot_of
from calibrated import UR5, calibrated_ur5, with_errors

PUMA = (
    (0.0, np.pi / 2, 0.0),
    (0.4318, 0.0, 0.0),
    (0.0203, -np.pi / 2, 0.15005),
    (0.0, np.pi / 2, 0.4318),
    (0.0, -np.pi / 2, 0.0),
    (0.0, 0.0, 0.0),
)
RANDOM_ARMS = (
    *('standard-4-0', 'modified-4-0', 'standard-5-0', 'elementary-5-0', 'shape-5-0'),
    *('standard-6-0', 'modified-6-0', 'shape-6-0', 'standard-7-0', 'modified-7-0', 'shape-7-0'),
)
RANGES = (0.0, 0.03, 0.2, 1.0)
TOO_FAR, ROUND_OFF, SAMPLES = 1.05, 1e-4, 600


def arms():
    """Yield a name and a robot of each arm of the table."""
    for name in sorted(ks.bundled_robots()):
        yield name, ks.load_robot(name)
    for words, rows in (('Puma', PUMA), ('UR5', UR5)):
        for error in (1e-7, 1e-5, 1e-4, 1e-3, 1e-2):
            yield f'{words} with errors of {error:g}', with_errors(rows, error, 1)
    yield 'calibrated UR5', calibrated_ur5(1)
    for name in RANDOM_ARMS:
        yield name, robot_of(name)


def motion(robot, count=3000, seconds=0.002):
    """Return poses of a motion through the limits: of each joint three sines of up to 0.05 Hz."""
    random = np.random.default_rng(5)
    low, high = np.clip(robot.limits, -np.pi, np.pi).T
    t = seconds * np.arange(count)[:, None]
    rates, phases = random.uniform(0.06, 0.3, (3, robot.dof)), random.uniform(0, 6, (3, robot.dof))
    share = np.mean([np.sin(w * t + phase) for w, phase in zip(rates, phases)], axis=0)
    return 0.5 * (low + high + share * (high - low))


def searched(robot, q, search, in_order=False):
    """Return the distances (N,), and the seconds of each pose."""
    rows = np.ascontiguousarray(ks.evaluate(robot, q).numbers)
    measures = np.empty((len(q), robot.singularity.measure_places.width))
    kernel.measure(robot.singularity.arm, rows, q, measures)
    seconds = np.empty(len(q))
    for k in range(len(q)):
        one = slice(k, k + 1)
        before = time.process_time()
        kernel.find_nearest(search, rows[one], q[one], measures[one], in_order)
        seconds[k] = time.process_time() - before
    return measures[:, kernel.DISTANCE], seconds


def judged(robot, poses, saddles, force, seed):
    """Return the numbers of a line."""
    low, high = np.clip(robot.limits, -np.pi, np.pi).T
    random = np.random.default_rng(seed).uniform(low, high, (poses, robot.dof))
    if robot.chain.loops:
        # There is no proof, and no brute force: the differences of J would leave the branch.
        q = random = random[closes_at(robot.chain, random)]
        force = 0
    else:
        q = np.concatenate([random, brute_force.saddles(robot, saddles, seed)])
    robot.singularity.arm.atlas()
    found, seconds = searched(robot, q, kernel.NearestSearch(robot.singularity.arm))
    more, _ = searched(robot, q, kernel.NearestSearch(robot.singularity.arm, SAMPLES))
    true = np.minimum(found, more)
    if force:
        by_force, _ = brute_force.nearest_singular(robot, q, force, known=force)
        true = np.minimum(true, by_force)
    far = found > TOO_FAR * true + ROUND_OFF
    inside = [(true >= low) & (true < high) for low, high in zip(RANGES, RANGES[1:])]
    clearance = ks.singularity(robot, q[:300]).clearance
    if not robot.chain.loops:
        assert np.all(clearance <= true[:300] * (1.0 + 1e-6) + 1e-6), 'a clearance is no proof'
    path = motion(robot)
    path = path[closes_at(robot.chain, path)]
    _, along = searched(robot, path, kernel.NearestSearch(robot.singularity.arm), True)
    counts = [(int(np.sum(far & one)), int(np.sum(one))) for one in inside]
    each = np.mean(seconds[: len(random)]), np.mean(along), np.max(along[1:])
    microseconds = 1e6 * np.array(each)
    return counts, int(np.sum((true < RANGES[1]) & (found > 0.1))), microseconds


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('arms', nargs='*')
    parser.add_argument('--poses', type=int, default=2000)
    parser.add_argument('--saddles', type=int, default=500)
    parser.add_argument('--force', type=int, default=0)
    parser.add_argument('--seed', type=int, default=7)
    options = parser.parse_args()
    ranges = ''.join(f'{f"{low:g}-{high:g}":>12s}' for low, high in zip(RANGES, RANGES[1:]))
    print(f'{"arm":28s}{ranges}{"OK":>4s}{"random":>8s}{"500 Hz":>8s}{"slowest":>8s}')
    total, ok = np.zeros((len(RANGES) - 1, 2), int), 0
    for name, robot in arms():
        if options.arms and not any(name.startswith(given) for given in options.arms):
            continue
        given = options.poses, options.saddles, options.force, options.seed
        counts, lost, microseconds = judged(robot, *given)
        texts = ''.join(f'{f"{far}/{all_}":>12s}' for far, all_ in counts)
        print(f'{name:28s}{texts}{lost:4d}' + ''.join(f'{us:8.0f}' for us in microseconds))
        total, ok = total + counts, ok + lost
    print(f'{"all":28s}' + ''.join(f'{f"{far}/{all_}":>12s}' for far, all_ in total) + f'{ok:4d}')


if __name__ == '__main__':
    main()
