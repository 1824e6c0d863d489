"""
Verdicts on random plans against dense sampling and brute force, and the time of 1,000 points.

    python bench/plans.py [--segments 630] [arm ...]

prints a line for each arm: random segments (quintic, 2 s, 1 to 5 rad a joint) proved to
keep 0.03 rad from every singular pose, refuted by one, or not decided; those that 60 samples call
fine, and how many of these are refuted; the proved ones that 400 samples or a search by brute
force refute (there must be none); clearances computed, median and most; brackets of the tool's
speed that 400 samples by differences break (there must be none); ms a segment. Then the time of
plans of 1,000 points, and of passages of a UR5e's wrist at a set distance from its singular pose.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np

import kinematics_service as ks
from kinematics_service.kinematics.plans.polynomials import polynomial_motion

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))

import brute_force
from calibrated import calibrated_ur5

ARMS = (
    'ur5e',
    'calibrated UR5',
    'puma560',
    'panda',
    'kinova_gen3',
    'offset_stanford_dh',
    'scara_hsr065',
    'spherical_rrp',
    'craig_3r',
)
THRESHOLD, SECONDS, COARSE, DENSE, NEAREST = 0.03, 2.0, 60, 400, 4
COLUMNS = ('segments', 'proved', 'refuted', 'undecided', 'fine', 'wrongly', 'broken')
COLUMNS += ('median', 'most', 'speeds', 'ms')


def robot_of(name):
    """Return a bundled robot, or a UR5 whose table is off by a calibration."""
    return calibrated_ur5(1) if name == 'calibrated UR5' else ks.load_robot(name)


def random_segments(robot, count, seed=13):
    """Yield times, positions, velocities and accelerations of random segments."""
    random = np.random.default_rng(seed)
    low, high = np.clip(robot.limits, -2.5, 2.5).T
    for _ in range(count // 9 + 1):
        points = random.uniform(low, high, (10, robot.dof))
        rates = np.zeros_like(points)
        rates[1:-1] = (points[2:] - points[:-2]) / (4.0 * SECONDS)
        for k in range(9):
            times = np.array([0.0, SECONDS])
            yield times, points[k : k + 2], rates[k : k + 2], np.zeros((2, robot.dof))


def sampled(segment, count):
    """Return times (count,) and joint positions (count, n) along a segment."""
    motion = polynomial_motion(*segment)
    s = np.linspace(0.0, 1.0, count)
    return s * SECONDS, motion.positions(np.zeros(count, dtype=int), s)


def distances(robot, q):
    """Return the distance of poses (N, n) to the singular pose found for each, or infinity."""
    away = ks.singularity(robot, q).nearest_singular - q
    found = np.linalg.norm(away / robot.task.column_scales, axis=1)
    return np.where(np.isfinite(found), found, np.inf)


def is_broken(robot, segment):
    """Return whether a proved segment is nearer to a singular pose than it is said to be."""
    _, q = sampled(segment, DENSE)
    found = ks.singularity(robot, q).distance
    nearest = np.argsort(found)[:NEAREST]
    by_force, _ = brute_force.nearest_singular(robot, q[nearest], starts=6)
    return min(np.min(distances(robot, q)), np.min(by_force)) < THRESHOLD


def breaks_speed(robot, segment, speed):
    """Return whether the tool is faster than it is said to be, by differences."""
    t, q = sampled(segment, DENSE)
    way = np.diff(ks.forward_kinematics(robot, q)[:, :3, 3], axis=0)
    fastest = np.max(np.linalg.norm(way, axis=1) / np.diff(t))
    return fastest > speed.upper * (1.0 + 1e-9) or speed.upper > 1.0101 * speed.lower


def judged(robot, count):
    """Return the numbers of a line."""
    verdicts = {'proved': 0, 'refuted': 0, 'not decided': 0}
    fine = wrongly = broken = speeds = 0
    evaluations, spent = [], 0.0
    for segment in list(random_segments(robot, count))[:count]:
        before = time.process_time()
        check = ks.check_plan(robot, *segment, distance=THRESHOLD)
        spent += time.process_time() - before
        found = check.singularity
        verdicts[found.verdict] += 1
        evaluations.append(found.evaluations)
        calls_fine = np.min(distances(robot, sampled(segment, COARSE)[1])) >= THRESHOLD
        fine += calls_fine
        wrongly += calls_fine and found.verdict == 'refuted'
        broken += found.verdict == 'proved' and is_broken(robot, segment)
        speeds += breaks_speed(robot, segment, check.speeds[0])
    return (
        count,
        *verdicts.values(),
        fine,
        wrongly,
        broken,
        int(np.median(evaluations)),
        max(evaluations),
        speeds,
        1e3 * spent / count,
    )


def thousand_points():
    """Print the time of plans of 1,000 points of a UR5e."""
    robot = ks.load_robot('ur5e')
    t = np.linspace(0.0, 100.0, 1000)
    frequency = np.array([0.5, 0.4, 0.3, 0.2, 0.3, 0.6])
    middle = [0.0, -1.2, 1.4, -1.6, -1.2, 0.0]
    q = middle + 0.3 * np.sin(t[:, None] * frequency)
    qdot = 0.3 * frequency * np.cos(t[:, None] * frequency)
    random = np.random.default_rng(3)
    steps = [-1.2, 1.4, -1.2] + random.uniform(-0.6, 0.6, (1000, 3))
    far = np.column_stack([random.uniform(-2.5, 2.5, 1000), steps[:, :2], q[:, 3], steps[:, 2], q])
    plans = {
        'ordinary, positions': (t, q),
        'ordinary, velocities': (t, q, qdot),
        'up to 5 rad between points': (t, far[:, :6]),
    }
    print(f'\n{"1,000 points of a UR5e":28s} verdict       clearances  seconds')
    for name, plan in plans.items():
        before = time.process_time()
        check = ks.check_plan(robot, *plan, speed_limit=10.0, speed_of=['elbow_joint'])
        spent = time.process_time() - before
        found = check.singularity
        print(f'{name:28s} {found.verdict:12s} {found.evaluations:11d} {spent:8.2f}')


def passages():
    """Print the verdicts on passages of the wrist's singular pose at set distances."""
    robot = ks.load_robot('ur5e')
    random = np.random.default_rng(5)
    print(f'\n{"wrist passed at":16s} proved refuted undecided  clearances, median and most')
    for away in (0.3, 0.1, 0.05, 0.035, 0.032, 0.031, 0.0305, 0.0301, 0.0299, 0.02):
        verdicts, evaluations = [], []
        for _ in range(40):
            first = np.array([random.uniform(-2, 2), -1.0, 1.4, random.uniform(-2, 2), 0.8, 0.0])
            last = first + [*random.uniform(-1, 1, 4), 0.0, random.uniform(-1, 1)]
            last[1:3] = -1.3, 1.2
            middle = 0.5 * (first + last)
            middle[4] = away
            rates = (last - first) / 2.0
            plan = [first, middle, last], np.array([0 * rates, rates, 0 * rates])
            found = ks.check_plan(robot, [0.0, 1.0, 2.0], *plan).singularity
            verdicts.append(found.verdict)
            evaluations.append(found.evaluations)
        counts = [verdicts.count(one) for one in ('proved', 'refuted', 'not decided')]
        print(
            f'{away:<16g} {counts[0]:6d} {counts[1]:7d} {counts[2]:9d} '
            f'{int(np.median(evaluations)):12d} {max(evaluations):6d}',
            flush=True,
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('arms', nargs='*')
    parser.add_argument('--segments', type=int, default=630)
    options = parser.parse_args()
    print(f'{"arm":20s}', *(f'{name:>9s}' for name in COLUMNS))
    for name in options.arms or ARMS:
        line = judged(robot_of(name), options.segments)
        print(
            f'{name:20s}', *(f'{value:9d}' for value in line[:-1]), f'{line[-1]:9.2f}', flush=True
        )
    thousand_points()
    passages()


if __name__ == '__main__':
    main()
