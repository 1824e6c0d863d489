# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
All solutions of general arms of six joints, against many random starts; seven, against slices.

    python bench/inverse_general.py [--poses 300] [--starts 2000] [--seeds 3] [arm ...]
    python bench/inverse_general.py --slices 2000 [--poses 200] [--from 0] [arm ...]

Each row is an arm: how many poses were proved to have all solutions, how many solutions that the
starts of any seed or the pose itself show were missed where that was said, and elsewhere; how many
were given twice; the solutions a pose has in the mean. The times are of one call, in processor
time, the least of four at each pose: what else a machine does counts in it, too. The arms are
those of test/general_arms.py.

With --slices arms with one joint more than their target asks for (test/redundant_arms.py; RRRR is
asked for positions): one joint is held at so many positions, all solutions there are found by the
six joints' elimination, and those inside the limits are looked for on the arcs. *inside* counts
them.
"""

import argparse
import math
import sys
import time
from pathlib import Path

import numpy as np

import kinematics_service as ks

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))

import general_arms
import redundant_arms

# Joint positions nearer than this are one solution to the starts, which end at 1e-10 m.
SAME = 1e-5
CALLS = 4
REDUNDANT = (
    'fr3',
    'xarm7',
    'kinova_gen3',
    'panda-calibrated',
    'kuka_iiwa14-calibrated',
    'RRRRRRR',
    'PRRRRRR',
    'RRPRRRR',
    'RRRRPRR',
    'RRRR',
)
# Random arms are others after so many poses, every second one without limits.
POSES_OF_AN_ARM, FREE = 10, (-math.inf, math.inf)


def count_of(robot, q, starts, seeds):
    """Return what one pose says: result, seconds, how many were missed and given twice."""
    target = ks.forward_kinematics(robot, q)
    seconds = np.inf
    for _ in range(CALLS):
        begin = time.process_time()
        result = ks.inverse_kinematics(robot, target, respect_limits=False)
        seconds = min(seconds, time.process_time() - begin)
    given = np.array([one.q for one in result]).reshape(-1, 6)
    lost = q[None][[not np.any(general_arms.apart(robot, given, q) < SAME)]]
    for seed in range(seeds):
        for one in general_arms.met_by_starts(robot, target, starts, seed):
            if not np.any(general_arms.apart(robot, np.vstack([given, lost]), one) < SAME):
                lost = np.vstack([lost, one])
    twice = sum(
        bool(np.any(general_arms.apart(robot, given[:k], one) < 1e-9))
        for k, one in enumerate(given)
    )
    return result, seconds, len(lost), twice


def row(name, poses, starts, seeds):
    """Print the row of an arm; return its counts."""
    robot = general_arms.general_arm(name)
    begin = time.process_time()
    ks.inverse_kinematics(robot, ks.forward_kinematics(robot, np.full(6, 0.3)))
    first = time.process_time() - begin
    seconds, proved, missed, elsewhere, twice, solutions = [], 0, 0, 0, 0, 0
    for q in general_arms.general_poses(name, poses):
        result, one, lost, double = count_of(robot, q, starts, seeds)
        seconds.append(one)
        solutions += len(result)
        twice += double
        if result.complete == 'proved':
            proved += 1
            missed += lost
        else:
            elsewhere += lost
    us = 1e6 * np.array(seconds)
    print(
        f'{name:12s} {proved:6d} {missed:7d} {elsewhere:9d} {twice:6d} {solutions / poses:7.2f}'
        f' {np.median(us):9.0f} {np.percentile(us, 99):9.0f} {1e3 * first:9.0f}',
        flush=True,
    )
    return poses, proved, missed, elsewhere, twice


def sliced(name, begin, count, slices):
    """Print the row of arms with one joint more: their arcs against dense slices."""
    missed, inside, seconds = 0, 0, []
    random = set(name) <= {'R', 'P'}
    rows = redundant_arms.WHOLE[: 3 if name == 'RRRR' else 6]
    for k in range(begin, begin + count):
        arm, pose = divmod(k, POSES_OF_AN_ARM) if random else (0, k)
        limits = FREE if arm % 2 else redundant_arms.LIMITS
        robot = (
            redundant_arms.random_arm(name, arm, limits)
            if random
            else redundant_arms.redundant_arm(name)
        )
        q = redundant_arms.poses_within(robot, pose + 1, 7)[pose]
        target = ks.forward_kinematics(robot, q)
        target = target[:3, 3] if name == 'RRRR' else target
        start = time.process_time()
        result = ks.inverse_kinematics(robot, target)
        seconds.append(time.process_time() - start)
        positions = np.linspace(-math.pi, math.pi, slices, endpoint=False)
        positions += np.random.default_rng(k).uniform(0.0, math.tau / slices)
        held = 0 if name == 'RRRR' else redundant_arms.held_by(robot)
        found = redundant_arms.in_slices(robot, target, positions, held, rows=rows)
        lost = found[redundant_arms.all_from_curves(result, found) > redundant_arms.ON_ARC]
        inside += len(found)
        missed += len(lost)
        if len(lost):
            print(f'{robot.name} {k}: {len(lost)} as {lost[0].tolist()}')
    print(
        f'{name:22s} {count:6d} {inside:9d} {missed:7d}'
        f' {1e3 * np.median(seconds):9.1f} {1e3 * np.percentile(seconds, 99):9.1f}',
        flush=True,
    )


def against_slices(arguments):
    """Print the table of arms with one joint more."""
    print(f'{arguments.slices} slices a pose')
    print(
        f'{"arm":22s} {"poses":>6s} {"inside":>9s} {"missed":>7s}'
        f' {"median ms":>9s} {"99 % ms":>9s}'
    )
    for name in arguments.arms or REDUNDANT:
        sliced(name, arguments.begin, arguments.poses or 200, arguments.slices)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--poses', type=int)
    parser.add_argument('--starts', type=int, default=2000)
    parser.add_argument('--seeds', type=int, default=3)
    parser.add_argument('--slices', type=int)
    parser.add_argument('--from', dest='begin', type=int, default=0)
    parser.add_argument('arms', nargs='*')
    arguments = parser.parse_args()
    if arguments.slices:
        against_slices(arguments)
        return
    poses = arguments.poses or 300
    print(
        f'{poses} poses an arm, '
        f'{arguments.starts} starts of each of {arguments.seeds} seeds a pose'
    )
    print(
        f'{"arm":12s} {"proved":>6s} {"missed":>7s} {"elsewhere":>9s} {"twice":>6s} {"a pose":>7s}'
        f' {"median us":>9s} {"99 % us":>9s} {"plan ms":>9s}'
    )
    total = np.sum(
        [
            row(name, poses, arguments.starts, arguments.seeds)
            for name in arguments.arms or [*general_arms.GENERAL, *general_arms.THREE_SLIDE]
        ],
        axis=0,
    )
    poses, proved, missed, elsewhere, twice = total
    print(
        f'poses {poses}, proved {proved}, missed there {missed}, elsewhere {elsewhere}, '
        f'twice {twice}'
    )


if __name__ == '__main__':
    main()
