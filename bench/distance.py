"""
The distance to the nearest singular pose against brute force, on arms with and without factors.

    python bench/distance.py [--poses 2000] [--saddles 300] [--starts 24] [arm ...]

prints a line for each arm. Of its random poses and saddles, by how far they truly are from a
singular pose: how many are said to be farther than 1.1 times that although decided, are not
decided, and are there. Then those within 0.03 that are said to be OK; the clearance as a share of
the distance where that is below 0.03, 0.1 and 0.3; and microseconds: all measures by first order,
and what the search takes besides, of a random pose and of a message at 1 kHz along a motion and
along one nine times as fast. A line of all ends it. Brute force takes some 50 ms of a pose: two
minutes for 2,000 poses and 300 saddles of an arm.
"""

import argparse
import dataclasses
import sys
import time
from pathlib import Path

import numpy as np

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.robot.robot import build_robot

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))

import brute_force
from arms import robot_of
from calibrated import UR5, calibrated_ur5, with_errors
from urdf_arms import urdf_arms

CALIBRATED = 10
RANDOM_ARMS = (
    *('standard-4-0', 'modified-4-0', 'standard-5-0', 'elementary-5-0', 'standard-6-0'),
    *('modified-6-0', 'shape-6-0', 'standard-7-0', 'modified-7-0', 'shape-7-0'),
)
BANDS = (0.0, 0.03, 0.1, 0.3)
RANGES = (0.0, 0.03, 0.1, 0.2, 0.5, 1.0, np.inf)
# What is said may exceed the truth by this factor.
TOLD = 1.1
COLUMNS = (
    ('arm', '-28s'),
    ('poses', '6d'),
    *((f'{low:g}-{high:g}', '11s') for low, high in zip(RANGES, RANGES[1:])),
    ('OK', '4d'),
    ('clear<0.03', '11.2f'),
    ('<0.1', '6.2f'),
    ('<0.3', '6.2f'),
    ('us', '7.2f'),
    ('random', '8.2f'),
    ('motion', '8.2f'),
    ('nine', '8.2f'),
)


PUMA = (
    (0.0, np.pi / 2, 0.0),
    (0.4318, 0.0, 0.0),
    (0.0203, -np.pi / 2, 0.15005),
    (0.0, np.pi / 2, 0.4318),
    (0.0, -np.pi / 2, 0.0),
    (0.0, 0.0, 0.0),
)
# Lengths far apart, and no angle that is a right one.
UNEVEN = (
    (0.9, 1.1, 0.3),
    (0.01, -0.7, 0.4),
    (0.6, 0.9, 0.002),
    (0.03, -1.2, 0.5),
    (0.004, 1.3, 0.02),
    (0.0, 0.0, 0.1),
)


def calibrated_arms():
    """Yield a name and a robot of 20 arms whose axes nearly meet or are nearly parallel."""
    for words, rows in (('Puma', PUMA), ('UR5', UR5), ('uneven arm', UNEVEN)):
        for error in (1e-5, 1e-3, 1e-2):
            for seed in (1, 2):
                yield f'{words} with errors of {error:g}, {seed}', with_errors(rows, error, seed)
    for seed in (1, 2):
        yield f'UR5 with errors of 1e-07, {seed}', with_errors(UR5, 1e-7, seed)


def arms():
    """Yield a name and a robot of each arm of the table."""
    for name in sorted(ks.bundled_robots()):
        robot = ks.load_robot(name)
        if robot.description.loops:  # no search there, and poses that do not close
            continue
        yield name, robot
        description = robot.description
        if description.singularity.factors:
            bare = dataclasses.replace(description.singularity, factors=())
            without = build_robot(dataclasses.replace(description, singularity=bare))
            yield f'{name} without factors', without
    yield from urdf_arms()
    for seed in range(1, CALIBRATED + 1):
        yield f'calibrated UR5 {seed}', calibrated_ur5(seed)
    yield from calibrated_arms()
    for name in RANDOM_ARMS:
        robot = robot_of(name)
        yield f'{name} {"".join(kind[0] for kind in robot.joint_types)}', robot


def motion(robot, count=4000, seconds=0.001):
    """Return poses of a motion through the limits: of each joint three sines of up to 0.05 Hz."""
    random = np.random.default_rng(5)
    low, high = np.clip(robot.limits, -np.pi, np.pi).T
    t = seconds * np.arange(count)[:, None]
    rates, phases = random.uniform(0.06, 0.3, (3, robot.dof)), random.uniform(0, 6, (3, robot.dof))
    share = np.mean([np.sin(w * t + phase) for w, phase in zip(rates, phases)], axis=0)
    return 0.5 * (low + high + share * (high - low))


def least_time(function):
    """Return the seconds of a call: the least of three."""
    times = []
    for _ in range(3):
        before = time.process_time()
        function()
        times.append(time.process_time() - before)
    return min(times)


def microseconds(robot, random):
    """
    Return the time of the measures, and of the search at random poses, along a motion and along
    one nine times as fast.
    """
    found = []
    motions = [(motion(robot, seconds=times * 0.001), True) for times in (1, 9)]
    for q, in_order in ((random, False), *motions):
        rows = np.ascontiguousarray(ks.evaluate(robot, q).numbers)
        measures = np.empty((len(q), robot.measure_places.width))

        def measure(rows=rows, q=q, measures=measures):
            kernel.measure(robot.arm, rows, q, measures)

        def search(rows=rows, q=q, measures=measures, in_order=in_order):
            alone = kernel.NearestSearch(robot.arm)
            kernel.find_nearest(alone, rows, q, measures, in_order)

        times = least_time(measure), least_time(search)
        found += [1e6 * seconds / len(q) for seconds in times]
    return found[0], found[1], found[3], found[5]


def judged(name, robot, poses, saddles, starts):
    """Return the numbers of a line."""
    low, high = np.clip(robot.limits, -np.pi, np.pi).T
    random = np.random.default_rng(7).uniform(low, high, (poses, robot.dof))
    q = np.concatenate([random, brute_force.saddles(robot, saddles)])
    found = ks.singularity(robot, q)
    by_force, _ = brute_force.nearest_singular(robot, q, starts, known=starts)
    there = np.isfinite(found.nearest_singular[:, 0])
    true = np.minimum(by_force, np.where(there, found.distance, np.inf))
    too_far = found.distance > TOLD * np.minimum(true, 1.0) + 1e-9
    counts = [
        [
            np.sum(within & too_far & found.decided),
            np.sum(within & ~found.decided),
            np.sum(within),
        ]
        for low, high in zip(RANGES, RANGES[1:])
        for within in [(true >= low) & (true < high)]
    ]
    shares = []
    for low, high in zip(BANDS, BANDS[1:]):
        within = (true > low) & (true < high)
        shares.append(np.median(found.clearance[within] / true[within]) if any(within) else np.nan)
    level = found.level > ks.Level.OK
    assert not np.any(found.clearance > true * (1.0 + 1e-6) + 1e-6), 'a clearance is no proof'
    return (
        name,
        len(q),
        *('/'.join(map(str, row)) for row in counts),
        np.sum((true < 0.03) & ~level),
        *shares,
        *microseconds(robot, random),
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('arms', nargs='*')
    parser.add_argument('--poses', type=int, default=2000)
    parser.add_argument('--saddles', type=int, default=300)
    parser.add_argument('--starts', type=int, default=24)
    options = parser.parse_args()
    widths = [int(width.strip('-sdf').split('.')[0]) for _, width in COLUMNS]
    print(' '.join(name.ljust(width) for (name, _), width in zip(COLUMNS[:1], widths)), end=' ')
    print(' '.join(name.rjust(width) for (name, _), width in zip(COLUMNS[1:], widths[1:])))
    lines = []
    for name, robot in arms():
        if options.arms and not any(name.startswith(given) for given in options.arms):
            continue
        line = judged(name, robot, options.poses, options.saddles, options.starts)
        texts = [f'{line[0]:{widths[0]}s}']
        texts += [format(value, width) for value, (_, width) in zip(line[1:], COLUMNS[1:])]
        print(' '.join(texts), flush=True)
        lines.append(line)
    ranges = zip(*(line[2 : 1 + len(RANGES)] for line in lines))
    sums = [
        '/'.join(map(str, map(sum, zip(*(map(int, x.split('/')) for x in r))))) for r in ranges
    ]
    print(
        f'all {len(lines)} arms:',
        ' '.join(sums),
        'OK',
        sum(line[1 + len(RANGES)] for line in lines),
    )


if __name__ == '__main__':
    main()
