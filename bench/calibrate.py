"""
How well a calibration finds the errors of synthetic arms, and how fast it is.

    python bench/calibrate.py [runs]

Ten arms with errors of 1 mm and 0.2 degrees (standard deviations) and noise of 0.05 mm and 0.05
mrad, 50 poses each: the share of parameters within three standard deviations of the truth, and the
mean of chi-square over its number of parameters. Then what eight proposed poses leave beside eight
and forty random ones, and the time of 2,000 poses of a 6R arm.
"""

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / 'test'))

from calibrated_arms import TEN, measured_arm, positions_within, predicted, truly

import kinematics_service as ks
from kinematics_service.rigid_motion import exponential

NOISE, POSES = 5e-5, 50


def consistency(name, runs):
    """Print how often errors are within their deviations, and chi-square."""
    within, squares, errors, before, known = [], [], [], [], []
    for seed in range(runs):
        arm = measured_arm(name, POSES, NOISE, seed)
        found = ks.calibrate(arm.robot, arm.q, arm.poses)
        count = len(arm.errors)
        error = np.array([one.correction for one in found.parameters[:count]]) - arm.errors
        deviations = np.array([one.deviation for one in found.parameters[:count]])
        within.append(np.abs(error) < 3.0 * deviations)
        squares.append(error @ np.linalg.solve(found.covariance[:count, :count], error) / count)
        q = positions_within(arm.robot, 50, seed + 10_000)
        errors.append(np.mean((predicted(found, q) - truly(arm, q))[:, :3, 3] ** 2) * 3)
        before.append(found.held_out_before.position_rms)
        known.append((found.known, found.possible))
    print(
        f'{name:22} {100 * np.mean(within):6.2f} % within 3 sigma, chi-square/P '
        f'{np.mean(squares):.3f}, known {set(known)}, nominal {1e3 * np.mean(before):.2f} mm, '
        f'calibrated {1e3 * np.sqrt(np.mean(errors)):.3f} mm',
        flush=True,
    )


def left_by(name, q, seed):
    """Return the error (m, RMS) of an arm calibrated by poses at joint positions."""
    arm = measured_arm(name, 1, seed=seed)
    random = np.random.default_rng([seed, 7])
    poses = truly(arm, q)
    poses[:, :3, 3] += NOISE * random.normal(size=(len(q), 3))
    poses[:, :3, :3] = exponential(NOISE * random.normal(size=(len(q), 3))) @ poses[:, :3, :3]
    found = ks.calibrate(arm.robot, q, poses, check=False)
    others = positions_within(arm.robot, 100, 777)
    return np.sqrt(3.0 * np.mean((predicted(found, others) - truly(arm, others))[:, :3, 3] ** 2))


def proposals(name, runs):
    """Print what eight proposed poses leave, and eight and forty random ones."""
    robot = ks.load_robot(name)
    chosen = ks.propose_poses(robot, 8).q
    proposed = [left_by(name, chosen, seed) for seed in range(runs)]
    few, many = (
        [left_by(name, positions_within(robot, count, seed), seed) for seed in range(runs)]
        for count in (8, 40)
    )
    means = [1e3 * np.sqrt(np.mean(np.square(one))) for one in (proposed, few, many)]
    print(
        f'{name:22} 8 proposed {means[0]:.3f} mm, 8 random {means[1]:.3f} mm, 40 random '
        f'{means[2]:.3f} mm; better than 8 random in '
        f'{100 * np.mean(np.less(proposed, few)):.0f} %, than 40 in '
        f'{100 * np.mean(np.less(proposed, many)):.0f} %',
        flush=True,
    )


def speed():
    """Print the time of 2,000 poses, and its share of five seconds."""
    arm = measured_arm('ur5e', 2000, NOISE)
    begin, used = time.perf_counter(), time.process_time()
    ks.calibrate(arm.robot, arm.q, arm.poses)
    wall, used = time.perf_counter() - begin, time.process_time() - used
    print(
        f'2,000 poses of ur5e: {wall:.2f} s, {used:.2f} s of the processor, {wall / 5:.2f} of 5 s'
    )


def main():
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    print(f'{runs} runs of each arm')
    for name in TEN:
        consistency(name, runs)
    for name in TEN[:4]:
        proposals(name, runs)
    speed()


if __name__ == '__main__':
    main()
