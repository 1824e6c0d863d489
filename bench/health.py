# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Jumps of joint zeros found by a second source of poses: how soon, how sure, and false alarms.

    python bench/health.py [--trials 20] [--poses 100000] [--seed 1]

A line for each table (calibrated: errors of 1e-5 that the file knows; nominal: errors of 1e-3),
instrument, number of poses before the jump, and size: how many jumps of joints 2 to 5 of a ur5e
are found within 50 poses (tracker) or 100 (camera), in how many of them the joint is named first,
alone, or among two; the median delay. Then false alarms: healthy poses of five arms, in small
regions that change, on paths and at rest, half of the runs with a nominal table.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np

from kinematics_service.apps.calibration.zero_jump import JumpDetector

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))

from second_source import CALIBRATED, CAMERA, NOMINAL, TRACKER, WatchedArm

ARMS = ('ur5e', 'puma560', 'kuka_iiwa14', 'scara_hsr065', 'so101')
FIRST = 20


def found_after(arm, begin, joint, size, most):
    """Return the delay (poses) and the names of a jump that begins after so many poses."""
    q = arm.everywhere(begin + most)
    offset = np.zeros_like(q)
    offset[begin:, joint] = size
    stream = arm.poses(q, offset)
    detector = JumpDetector(arm.file, stream.at(slice(0, FIRST)))
    if detector.observe(stream.at(slice(FIRST, begin))).jump:
        return -1, ()
    for k in range(begin, begin + most):
        if detector.observe(stream.at(slice(k, k + 1))).jump:
            first = k + 1 - begin
            jump = detector.observe(stream.at(slice(k + 1, None))).jump  # the name after all poses
            return first, jump.names if jump else ()
    return 0, ()


def jumps(trials, random):
    """Print how jumps are found."""
    for error, sizes in ((CALIBRATED, (0.1, 0.2, 0.5, 1.0)), (NOMINAL, (1.0, 2.0, 3.0))):
        for source, noise, most in (('tracker', TRACKER, 50), ('camera', CAMERA, 100)):
            for begin in (20, 1000, 10_000):
                for size in sizes:
                    few = trials if begin < 10_000 else max(trials // 4, 4)
                    results = []
                    for trial in range(few):
                        joint = 1 + trial % 4
                        arm = WatchedArm('ur5e', error, noise, random)
                        delay, names = found_after(arm, begin, joint, np.radians(size), most)
                        name = arm.file.joint_names[joint]
                        results.append(
                            (delay, names[:1] == (name,), len(names) == 1, name in names)
                        )
                    found = [one for one in results if one[0] > 0]
                    print(
                        f'{error:g} {source:8s} after {begin:6d}: {size:.1f} deg found '
                        f'{len(found)} of {few}, first {sum(one[1] for one in found)}, '
                        f'alone {sum(one[1] and one[2] for one in found)}, '
                        f'among two {sum(one[3] for one in found)}, early '
                        f'{sum(one[0] < 0 for one in results)}, after '
                        f'{np.median([one[0] for one in found]) if found else np.nan:.0f}, '
                        f'{max((one[0] for one in found), default=0)} poses',
                        flush=True,
                    )


def healthy(poses, random, names=ARMS):
    """Print false alarms of healthy arms."""
    alarms, seen, spent = 0, 0, 0.0
    for run in range(10**6):
        if seen >= poses:
            break
        name, error = names[run % len(names)], (CALIBRATED, NOMINAL)[run // len(names) % 2]
        noise = (TRACKER, CAMERA)[run // (2 * len(names)) % 2]
        arm = WatchedArm(name, error, noise, random)
        width = random.uniform(0.2, 0.5)
        parts = [arm.region(FIRST + int(random.integers(100)), width)]
        for _ in range(6):
            kind = random.integers(4)
            count = int(random.integers(5, 400))
            if kind == 3:
                parts.append(arm.path(count))
            elif kind == 2:
                parts.append(np.repeat(arm.region(count // 20 + 1, width), 20, axis=0))
            else:
                parts.append(arm.region(count, width))
        stream = arm.poses(np.concatenate(parts))
        detector, told = JumpDetector(arm.file, stream.at(slice(0, FIRST))), False
        began = time.process_time()
        for k in range(FIRST, len(stream.q), 8):
            jump = detector.observe(stream.at(slice(k, k + 8))).jump
            if jump and not told:
                told = True
                print(name, error, noise, k, jump.sentence, flush=True)
        spent += time.process_time() - began
        alarms, seen = alarms + told, seen + len(stream.q)
    print(f'{alarms} alarms in {run} runs, {seen} poses; {1e6 * spent / seen:.0f} us a pose')


if __name__ == '__main__':
    parser = argparse.ArgumentParser()
    parser.add_argument('--trials', type=int, default=20)
    parser.add_argument('--poses', type=int, default=100_000)
    parser.add_argument('--seed', type=int, default=1)
    given = parser.parse_args()
    jumps(given.trials, np.random.default_rng(given.seed))
    healthy(given.poses, np.random.default_rng(given.seed + 1))
