# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
How well a calibration finds the errors of synthetic arms, and how fast it is.

    python bench/calibrate.py [runs]

Ten arms with errors of 1 mm and 0.2 degrees (standard deviations) and noise of 0.05 mm and 0.05
mrad, 50 poses each: the share of parameters within three standard deviations of the truth, and the
mean of chi-square over its number of parameters. The same of touched points, two of them from 25
poses each, or ten where an arm of three joints has few poses at one; and in how many runs it is
said that no length is told, without and with a distance that is known. Then what eight proposed
poses leave beside eight and forty random ones, and the time of 2,000 poses of a 6R arm.

    python bench/calibrate.py [runs] --touches [arm ...] [--size SHARE]

is the part on touched points alone; with errors of the table, and priors, that are this share
of those. Beside chi-square, which takes the parameters as normal with the covariance, it says how
much less likely the truth is than what was found: that needs no covariance, and is 1 over the
number of all parameters where the fit is right.

    python bench/calibrate.py [runs] --few [arm ...] [--positions [arm ...]] [--begin SEED]

is chi-square of 10 to 40 poses, of 10 to 40 positions alone, how many errors are within their
deviations, and chi-square of 40 poses that nothing was fitted to. Few numbers tell the noise of
ten positions: chi-square has then so heavy a tail that its mean says little.

    python bench/calibrate.py [runs] --proposals [arm ...]

is the part on proposed poses. Beside what calibrations leave it says what they must, to first
order: the tool's error over random poses (m, RMS), tr(A M^-1) with A the mean square of how these
move with the parameters and M what priors and measured poses tell. Of any eight poses inside the
limits, and of any shares of them, that is at least `floor_of`.

    python bench/calibrate.py [runs] --zeros

is the zeros of an SO-101 by touches of a sheet that lies anywhere, with a play of 0.5 degrees and
0.6 mm (1 mm in all) or 1 mm of each number: what they are off by, without and with the way that
the joints came.

    python bench/calibrate.py [runs] --camera

is 25 poses of a board seen by a camera on the tool of a UR5e, and by a fixed one: how far a board
at 200 other poses is off, beside the closed form of AX = XB with the nominal table; and 25 images
of a board whose corners have a noise of 0.2 px, or are found in images that are rendered, beside
the closed forms of OpenCV as well.
"""

import argparse
import sys
import time
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / 'test'))

from arms import robot_of
from calibrated_arms import (
    BOARD,
    INTRINSICS,
    TEN,
    TIP,
    board_errors,
    camera_arm,
    closed_form,
    held_out_chi_square,
    measured_arm,
    pictured,
    pictured_arm,
    pictured_errors,
    positions_within,
    predicted,
    sheet_touches,
    touching_positions,
    true_arm,
    truly,
)

import kinematics_service as ks
from kinematics_service.apps.calibration.chosen_parameters import prior_of
from kinematics_service.apps.calibration.zeros import calibrate_zeros, zeros_of
from kinematics_service.kinematics.uncertainty.corrected_chain import pose_change
from kinematics_service.kinematics.uncertainty.parameters import parameters_of, placement
from kinematics_service.rigid_motion import exponential, pose_of
from kinematics_service.robot.file.parts.parameters import ENDS, TABLE_GROUPS, end_parameters

NOISE, POSES = 5e-5, 50
# Counts of poses, or of positions alone.
FEW = (10, 12, 15, 20, 40)
# Poses proposed, random ones to choose from, draws of them; rounds to the floor, and how near.
PROPOSED, CANDIDATES, DRAWS, TRIALS, CLOSE = 8, 1500, 200, 400, 5e-3
# Trials whose images are rendered.
RENDERED = 10
# Joints (rad, m) of two poses at one point of an arm with few of them differ by more.
APART = 0.1


def chi_square(found, errors):
    """Return the squares of errors of the table's numbers, by their covariance, over how many."""
    error, covariance = table_errors(found, errors)
    return error @ np.linalg.solve(covariance, error) / len(error)


def table_errors(found, errors):
    """Return how far the table's numbers are off the true errors, and their covariance."""
    table = [k for k, one in enumerate(found.parameters) if one.group in TABLE_GROUPS]
    error = np.array([found.parameters[k].correction for k in table]) - errors
    return error, found.covariance[np.ix_(table, table)]


def few(name, runs, begin, what):
    """Print chi-square of few poses or positions, and by how many numbers these tell the noise."""
    for count in FEW:
        squares, freedom, deviations, held_out = [], [], [], []
        for seed in range(begin, begin + runs):
            arm = measured_arm(name, count, NOISE, seed)
            seen = arm.poses if what == 'poses' else arm.poses[:, :3, 3]
            found = ks.calibrate(arm.robot, arm.q, seen, check=False)
            squares.append(chi_square(found, arm.errors))
            freedom.append(found.freedom.position)
            if what == 'poses':
                held_out.append(held_out_chi_square(arm, found, 40, NOISE, seed))
            error, covariance = table_errors(found, arm.errors)
            deviations.append(np.abs(error) / np.sqrt(np.diag(covariance)))
        shares = (f'{100.0 * np.mean(np.less(deviations, k)):.1f}' for k in (1, 2, 3))
        print(
            f'{name:22} {count} {what}: chi-square/P {np.mean(squares):.3f} (median '
            f'{np.median(squares):.3f}, largest {np.max(squares):.2f}), within 1, 2, 3 deviations '
            f'{", ".join(shares)} %, the noise is told by {np.median(freedom):.1f} numbers'
            + (f', held-out poses {np.mean(held_out):.3f}' if held_out else ''),
            flush=True,
        )


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
        squares.append(chi_square(found, arm.errors))
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


def touches(name, runs, size=1.0):
    """Print the same of points that the tip touched, and where no scale is told."""
    within, squares, likely, known, silent, scaled = [], [], [], [], 0, []
    for seed in range(runs):
        arm = touched_arm(name, seed, size)
        priors = {one.name: size * one.scale for one in parameters_of(arm.robot).table}
        found = ks.calibrate(arm.robot, arm.q, same_point=arm.marks, tolerances=priors)
        count = len(arm.errors)
        error = np.array([one.correction for one in found.parameters[:count]]) - arm.errors
        deviations = np.array([one.deviation for one in found.parameters[:count]])
        within.append(np.abs(error) < 3.0 * deviations)
        squares.append(chi_square(found, arm.errors))
        likely.append(less_likely(arm, found) / len(found.parameters))
        known.append((found.known, found.possible))
        silent += not says_no_scale(found)
        if seed < max(1, runs // 4):
            apart = {('0', '1'): float(np.linalg.norm(arm.points[1] - arm.points[0]))}
            found = ks.calibrate(arm.robot, arm.q, same_point=arm.marks, apart=apart)
            scaled.append(says_no_scale(found))
    print(
        f'{name:22} {100 * np.mean(within):6.2f} % within 3 sigma, chi-square/P '
        f'{np.mean(squares):.3f} (median {np.median(squares):.3f}), likelihood/P '
        f'{np.mean(likely):.3f}, known {set(known)}, no length told: said in '
        f'{runs - silent} of {runs}, with a distance in {sum(scaled)} of {len(scaled)}',
        flush=True,
    )


def less_likely(arm, found):
    """Return the squares that the truth leaves beyond those of what was found, in deviations."""
    count = len(arm.errors)
    T = ks.forward_kinematics(arm.true, arm.q)
    points = np.array(arm.points)[[int(mark) for mark in arm.marks]]
    left = points - T[:, :3, 3] - T[:, :3, :3] @ TIP
    used = np.delete(np.arange(len(left)), found.outliers)
    table = found.parameters[:count]
    priors = np.array([one.prior for one in table])
    corrections = np.array([one.correction for one in table])
    truth, fit = (
        np.sum((remainders[used] / found.noise.position) ** 2) + np.sum((values / priors) ** 2)
        for remainders, values in ((left, arm.errors), (found.remainders[:, 0], corrections))
    )
    return truth - fit


def says_no_scale(found):
    """Return whether it is said that no length is told by itself."""
    return any('scale of the lengths' in one for one in found.remarks)


class TouchedArm(NamedTuple):
    """An arm with errors; joint positions and names of the points touched, and where these are."""

    robot: ks.Robot
    true: ks.Robot
    errors: np.ndarray
    q: np.ndarray
    marks: list
    points: list


def touched_arm(name, seed, size=1.0):
    """Return an arm that touches points inside its own reach, with noise."""
    _, errors, true = true_arm(name, seed, size)
    count = 10 if true.dof == 3 else 2
    points, q = [], []
    tries = iter(range(1000))
    while len(points) < count:
        k = next(tries)
        at = positions_within(true, 1, [seed, 6, k])
        T = ks.forward_kinematics(true, at)[0]
        point = T[:3, 3] + T[:3, :3] @ TIP
        try:
            rows = touching_positions(true, point, POSES // count, [seed, 7, k], NOISE)
        except AssertionError:
            continue  # at the edge of the reach
        if np.max(np.ptp(rows, axis=0)) < APART:
            continue  # one pose alone
        points.append(point)
        q.append(rows)
    marks = [str(k) for k in range(count) for _ in range(POSES // count)]
    return TouchedArm(robot_of(name), true, errors, np.concatenate(q), marks, points)


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
    """Print what eight proposed poses leave, eight and forty random ones, and any eight."""
    robot = ks.load_robot(name)
    chosen = ks.propose_poses(robot, PROPOSED).q
    proposed = [left_by(name, chosen, seed) for seed in range(runs)]
    few, many = (
        [left_by(name, positions_within(robot, count, seed), seed) for seed in range(runs)]
        for count in (PROPOSED, 40)
    )
    means = [1e3 * np.sqrt(np.mean(np.square(one))) for one in (proposed, few, many)]
    print(
        f'{name:22} 8 proposed {means[0]:.4f} mm, 8 random {means[1]:.4f} mm, 40 random '
        f'{means[2]:.4f} mm; better than 8 random in '
        f'{100 * np.mean(np.less(proposed, few)):.0f} %, than 40 in '
        f'{100 * np.mean(np.less(proposed, many)):.0f} %',
        flush=True,
    )
    print_bounds(robot, chosen)


def print_bounds(robot, chosen):
    """Print what proposed poses leave to first order, random ones, and no poses less than."""
    rows = rows_of(robot, positions_within(robot, CANDIDATES, 5))
    there = rows_of(robot, positions_within(robot, CANDIDATES, 777))[:, :3]
    A = np.tensordot(there, there, ((0, 1), (0, 1))) / len(there)

    def left(rows):
        told = np.eye(len(A)) + np.tensordot(rows, rows, ((0, 1), (0, 1)))
        return 1e3 * NOISE * np.sqrt(np.trace(np.linalg.solve(told, A)))

    own = left(rows_of(robot, chosen))
    random = np.random.default_rng(6)
    equal = {0.95: PROPOSED, 0.5: PROPOSED}
    quantiles = {}
    for count in (*range(PROPOSED, 20), 40):
        draws = [left(rows[random.choice(len(rows), count, replace=False)]) for _ in range(DRAWS)]
        quantiles[count] = np.quantile(draws, (0.05, 0.5, 0.95))
        for share in equal:
            if np.mean(np.greater(draws, own)) >= share:
                equal[share] = count
    texts = (
        f'{count} random {" ".join(f"{x:.4f}" for x in quantiles[count])}'
        for count in (PROPOSED, 12, 40)
    )
    print(
        f'{"":22} to first order: proposed {own:.4f}, floor {floor_of(rows, A):.4f}; 5, 50, 95 % '
        f'of {", ".join(texts)}; as good as {equal[0.95]} random in 95 %, '
        f'{equal[0.5]} in half of the draws',
        flush=True,
    )


def rows_of(robot, q):
    """Return how measured poses move with all parameters (N, 6, P), in noise and in priors."""
    arm = parameters_of(robot)
    every = [*arm.table, *(one for end in ENDS for one in end_parameters(end, 0))]
    count = len(arm.table)
    ends = robot.description.base.motion.matrix, robot.description.tool.motion.matrix
    chain = placement(arm.chain, *ends, (count, count + 6))
    priors = np.array([prior_of(one, {}) for one in every])
    return pose_change(chain, np.zeros(len(every)), q).jacobian * priors / NOISE


def floor_of(rows, A):
    """
    Return what no eight of these poses leave less than, mm.

    tr(A M^-1) is convex in the shares w of the poses, so that at any shares its tangent is below
    it: what is returned holds for all shares, however far from the best ones these are.
    """
    squares = np.swapaxes(rows, 1, 2) @ rows
    shares, best = np.full(len(rows), 1.0 / len(rows)), 0.0
    for _ in range(TRIALS):
        S = np.linalg.inv(np.eye(len(A)) + PROPOSED * np.tensordot(shares, squares, 1))
        gains = np.einsum('kij,ij->k', squares, S @ A @ S)
        value = np.trace(S @ A)
        best = max(best, value - PROPOSED * (np.max(gains) - shares @ gains))
        if value - best < CLOSE * value:
            break
        shares = shares * np.sqrt(gains)
        shares /= np.sum(shares)
    return 1e3 * NOISE * np.sqrt(best)


def zeros(runs):
    """Print how far zeros of an SO-101 are off that touches of a sheet tell."""
    robot, place = robot_of('so101'), pose_of([0.0, -0.25, 0.0], (0.0, 0.0, 0.1))
    for each, noise, told in product((1, 2, 3), (6e-4, 1e-3), ('nothing', 'the way')):
        errors, deviations, plays = [], [], []
        for seed in range(runs):
            made = sheet_touches(robot, place, each, noise, np.radians(0.5), seed)
            way = made.approach if told == 'the way' else None
            found = calibrate_zeros(robot, made.q, made.points, approach=way)
            own = zeros_of(found)[1:4]  # the sheet hides the others
            errors.append(np.degrees([one.correction for one in own] - made.zeros[1:4]))
            deviations.append(np.degrees([one.deviation for one in own]))
            plays.append(
                np.degrees(found.parameters[-1].correction) if told == 'the way' else np.nan
            )
        errors, far = np.array(errors), np.abs(errors).max(axis=1)
        print(
            f'{12 * each} touches, {1e3 * noise} mm, told {told}: '
            f'rms {np.sqrt(np.mean(errors**2)):.2f} deg, of each '
            f'{np.round(np.sqrt(np.mean(errors**2, axis=0)), 2)}, worst of a run: median '
            f'{np.median(far):.2f}, largest {far.max():.2f}; within 0.3 deg '
            f'{100 * np.mean(np.abs(errors) < 0.3):.0f} %; chi-square/P '
            f'{np.mean((errors / deviations) ** 2):.2f}; play {np.mean(plays):.3f}',
            flush=True,
        )


def cameras(runs):
    """Print how far off a board is by camera, board and arm at once, and by the closed form."""
    for where in ('on-tool', 'fixed'):
        errors, squares = [], []
        for seed in range(runs):
            arm = camera_arm(where, 25, seed)
            found = ks.calibrate(arm.robot, arm.q, arm.poses, camera=where)
            errors.append(board_errors(arm, where, found))
            count = len(arm.errors)
            off = np.array([one.correction for one in found.parameters[:count]]) - arm.errors
            squares.append(off @ np.linalg.solve(found.covariance[:count, :count], off) / count)
        fitted, closed = 1e3 * np.array(errors).T
        ratio = closed / fitted
        print(
            f'camera {where}: median {np.median(fitted):.2f} mm, largest {fitted.max():.2f}; '
            f'closed form {np.median(closed):.2f} mm, largest {closed.max():.2f}; nearer by '
            f'{np.median(ratio):.1f} (median), {ratio.min():.1f} (least); chi-square/P '
            f'{np.mean(squares):.3f}',
            flush=True,
        )


def images(runs, rendered=False):
    """Print the same of corners of a board in images, or found in them, beside OpenCV's forms."""
    forms = {'Park and Martin': closed_form, **opencv_forms()}
    for where in ('on-tool', 'fixed'):
        errors, squares, sizes = [], [], 0
        for seed in range(runs):
            arm = pictured_arm(where, 25, seed)
            if rendered:
                from pictures import with_pictures

                with TemporaryDirectory() as folder:
                    random = np.random.default_rng(seed)
                    to = Path(folder) / 'pictures'
                    arm = with_pictures(to, arm, BOARD, INTRINSICS, random)
            found = pictured(arm, where)
            errors.append(pictured_errors(arm, where, found, forms.values()))
            count = len(arm.errors)
            off = np.array([one.correction for one in found.parameters[:count]]) - arm.errors
            squares.append(off @ np.linalg.solve(found.covariance[:count, :count], off) / count)
            sizes += any('times' in one for one in (*found.refusals, *found.remarks))
        fitted, *closed = 1e3 * np.array(errors).T
        print(
            f'{"rendered " * rendered}images, camera {where}: median {np.median(fitted):.3f} mm, '
            f'largest {fitted.max():.3f}; chi-square/P {np.mean(squares):.3f}; a size is doubted '
            f'in {sizes}'
        )
        for name, own in zip(forms, closed):
            ratio = own / fitted
            print(
                f'  {name}: median {np.median(own):.2f} mm, largest {own.max():.2f}; nearer by '
                f'{np.median(ratio):.1f} (median), {ratio.min():.1f} (least)',
                flush=True,
            )


def opencv_forms():
    """Return the closed forms of OpenCV 4 by name; version 5 has none."""
    import cv2

    if not hasattr(cv2, 'calibrateHandEye'):
        return {}

    def form(method):
        def solved(A, B):
            X = np.eye(4)
            parts = A[:, :3, :3], A[:, :3, 3], B[:, :3, :3], B[:, :3, 3]
            R, t = cv2.calibrateHandEye(*map(list, parts), method=method)
            X[:3, :3], X[:3, 3] = R, t[:, 0]
            return X

        return solved

    begin = 'CALIB_HAND_EYE_'
    return {
        f'OpenCV, {name.removeprefix(begin).capitalize()}': form(getattr(cv2, name))
        for name in dir(cv2)
        if name.startswith(begin)
    }


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
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('runs', nargs='?', type=int, default=20)
    parser.add_argument('--touches', nargs='*', metavar='ARM')
    parser.add_argument('--few', nargs='*', metavar='ARM')
    parser.add_argument('--positions', nargs='*', metavar='ARM')
    parser.add_argument('--proposals', nargs='*', metavar='ARM')
    parser.add_argument('--zeros', action='store_true')
    parser.add_argument('--camera', action='store_true')
    parser.add_argument('--size', type=float, default=1.0)
    parser.add_argument('--begin', type=int, default=0)
    given = parser.parse_args()
    runs = given.runs
    print(f'{runs} runs of each arm')
    if given.camera:
        cameras(runs)
        images(runs)
        images(min(runs, RENDERED), rendered=True)
        return
    if given.zeros:
        zeros(runs)
        return
    if given.touches is not None:
        for name in given.touches or TEN:
            touches(name, runs, given.size)
        return
    for what, names in (('poses', given.few), ('positions', given.positions)):
        for name in () if names is None else names or TEN:
            few(name, runs, given.begin, what)
    if given.few is not None or given.positions is not None:
        return
    if given.proposals is not None:
        for name in given.proposals or TEN[:4]:
            proposals(name, runs)
        return
    for name in TEN:
        consistency(name, runs)
    for name in TEN:
        touches(name, runs)
    for name in TEN[:4]:
        proposals(name, runs)
    speed()


if __name__ == '__main__':
    main()
