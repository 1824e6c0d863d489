# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Inverse kinematics: how many originating positions are found, how exactly, and how fast.

    python bench/inverse.py [--poses 10000] [--peers 500] [--eaik PYTHON]

The first table is the round trip over random poses inside the limits of each arm. The second
compares, on the same poses in the same run, one solution and a full set with one solution of
roboticstoolbox's `ik_LM` (C++) on the same chain, and with a full set of EAIK where a Python has
it. Success is counted by this library's forward kinematics. Times are medians.
"""

import argparse
import json
import math
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

import kinematics_service as ks
from kinematics_service.robot.conventions import table_rows
from kinematics_service.robot.task import ROW_NAMES

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))

from arms import random_poses
from general_arms import apart

PROVED = 1e-10
SAME = 1e-5  # of originating positions: near singular poses the last digits of a pose decide
THREE = [
    'anthropomorphic_3r',
    'craig_3r',
    'parallelogram_left',
    'parallelogram_right',
    'rrp_elementary',
    'spherical_rrp',
]
SIX = [
    'puma560',
    'ur3e',
    'ur5e',
    'ur10e',
    'offset_stanford_dh',
    'offset_stanford_shape',
    'offset_stanford_printed',
    'six_joint_dh',
    'six_joint_dh_unit',
]
REDUNDANT = ['panda', 'kuka_iiwa14', 'kinova_gen3']
FEW = ['planar_2r', 'planar_3r', 'scara_hsr065']
# Not the parallelograms: the toolbox has no coupled joints.
PEERED = [*THREE[:2], *THREE[4:], *FEW, *SIX, *REDUNDANT]

EAIK = """
import json, sys, time
import numpy as np
from eaik.IK_HP import HPRobot
case = json.load(sys.stdin)
robot = HPRobot(np.array(case['axes']), np.array(case['points']))
times, found = [], []
for T in np.array(case['targets']):
    start = time.perf_counter()
    answer = robot.IK(T)
    times.append(time.perf_counter() - start)
    found.append([list(map(float, q)) for q in answer.Q])
json.dump({'times': times, 'found': found}, sys.stdout)
"""


def round_trip(name, poses):
    robot = ks.load_robot(name)
    q = random_poses(robot, poses, 1)
    targets = ks.forward_kinematics(robot, q)
    rows = rows_of(robot)
    ks.inverse_kinematics(robot, targets[0], rows=rows)
    times, hits, worst, count = [], 0, 0.0, 0
    for one, target in zip(q, targets):
        start = time.perf_counter()
        result = ks.inverse_kinematics(robot, target, rows=rows)
        times.append(time.perf_counter() - start)
        hits += any(apart(robot, s.q, one) < SAME for s in result) or any(
            family.distance(one) < SAME for family in result.families
        )
        worst = max([worst, *(s.residual for s in (*result, *result.families))])
        count += len(result) + len(result.families)
    times = 1e6 * np.array(times)
    print(
        f'{name:24s} {100.0 * hits / poses:8.3f} % {worst:9.1e} {count / poses:6.2f} '
        f'{np.median(times):9.0f} {np.percentile(times, 99):9.0f} '
        f'{np.sum(times) / count:9.1f}  {result.method}',
        flush=True,
    )


def toolbox_arm(robot):
    import roboticstoolbox as rtb

    # One link a screw, from the table itself: before, the joint about or along z, after.
    chain = rtb.ET.SE3(robot.description.base.motion.matrix)
    variables = list(robot.variables)
    for row in table_rows(robot.description):
        chain = chain * rtb.ET.SE3(row.before)
        theta, d = dict(row.theta.coefficients), dict(row.d.coefficients)
        chain = chain * rtb.ET.Rz(row.theta.constant) * rtb.ET.tz(row.d.constant)
        for coefficients, make in ((theta, rtb.ET.Rz), (d, rtb.ET.tz)):
            for variable, factor in coefficients.items():
                if abs(factor) == 1.0:
                    joint = make(jindex=variables.index(variable), flip=factor < 0)
                    k = variables.index(variable)
                    limits = robot.limits[k]
                    finite = np.where(np.isfinite(limits), limits, [-math.pi, math.pi])
                    if robot.joint_types[k] == 'prismatic':
                        finite = np.where(np.isfinite(limits), limits, [0.0, 1.0])
                    joint.qlim = finite
                    chain = chain * joint
        chain = chain * rtb.ET.SE3(row.after)
    return chain * rtb.ET.SE3(robot.description.tool.motion.matrix)


def rows_of(robot):
    # What the arm can be asked for; six joints and more: the pose.
    return robot.singularity.task.rows if robot.dof < 6 else ROW_NAMES


def ours(robot, targets, everything):
    times, found = [], []
    rows = rows_of(robot)
    for target in targets:
        start = time.perf_counter()
        result = ks.inverse_kinematics(robot, target, rows=rows, all_solutions=everything)
        times.append(time.perf_counter() - start)
        found.append([*(s.q for s in result), *(family.q for family in result.families)])
    return np.array(times), found


def toolbox(robot, targets, tolerance):
    arm = toolbox_arm(robot)
    check = arm.eval(np.full(robot.dof, 0.1))
    np.testing.assert_allclose(
        check, ks.forward_kinematics(robot, np.full(robot.dof, 0.1)), atol=1e-9
    )
    times, found = [], []
    mask = np.array([1.0 if name in rows_of(robot) else 0.0 for name in ROW_NAMES])
    for target in targets:
        start = time.perf_counter()
        answer = arm.ik_LM(target, tol=tolerance, mask=mask)
        times.append(time.perf_counter() - start)
        found.append([np.array(answer.q)] if answer.success else [])
    return np.array(times), found


def eaik(robot, targets, python):
    from kinematics_service.kinematics.inverse.problem.screws import screws_of

    screws = screws_of(robot.chain)
    if any(screws.slides) or not np.array_equal(screws.coupling, np.eye(robot.dof)):
        return None
    # EAIK's offsets: from one axis to the next, in base axes at rest; its tool is not turned.
    points = np.vstack([screws.points, screws.tool])
    offsets = np.vstack([points[:1], np.diff(points, axis=0)])
    turn = screws.home[:3, :3]
    moved = np.array(targets)
    moved[:, :3, :3] = moved[:, :3, :3] @ turn.T
    case = {
        'axes': screws.axes.tolist(),
        'points': offsets.tolist(),
        'targets': moved.tolist(),
    }
    run = subprocess.run(
        [python, '-c', EAIK], input=json.dumps(case), capture_output=True, text=True
    )
    if run.returncode:
        print(f'{"":24s} EAIK: {run.stderr.strip().splitlines()[-1]}')
        return None
    answer = json.loads(run.stdout)
    return np.array(answer['times']), [[np.array(q) for q in qs] for qs in answer['found']]


def miss(robot, q, target):
    # In the rows that count; frame 0 of these arms is not turned in the base.
    off = ks.forward_kinematics(robot, q) - target
    rows = rows_of(robot)
    linear = [k for k in range(3) if ROW_NAMES[k] in rows]
    angular = slice(0, 3) if set(rows) - set(ROW_NAMES[:3]) else slice(0, 0)
    return float(
        max(np.max(np.abs(off[linear, 3])), np.max(np.abs(off[:3, angular]), initial=0.0))
    )


def compare(name, count, python):
    robot = ks.load_robot(name)
    targets = ks.forward_kinematics(robot, random_poses(robot, count, 2))
    ours(robot, targets[:2], True), ours(robot, targets[:2], False)
    rows = {
        'one': (ours(robot, targets, False), PROVED),
        'all': (ours(robot, targets, True), PROVED),
        # Its tolerance is half the square of the error: PROVED itself, and its default.
        'ik_LM, tol 5e-21': (toolbox(robot, targets, 0.5 * PROVED**2), PROVED),
        'ik_LM, tol 1e-6': (toolbox(robot, targets, 1e-6), 2e-3),
    }
    if python and robot.dof == 6:
        rows['EAIK, all'] = (eaik(robot, targets, python), PROVED)
    for peer, (row, near_enough) in rows.items():
        if row is None:
            print(f'{name:24s} {peer:17s} has no such arm')
            continue
        times, found = row
        solved, total, worst = 0, 0, 0.0
        for target, qs in zip(targets, found):
            errors = [miss(robot, q, target) for q in qs if np.all(np.isfinite(q))]
            good = [error for error in errors if error < near_enough]
            solved += bool(good)
            total += len(good)
            worst = max([worst, *good])
        print(
            f'{name:24s} {peer:17s} {100.0 * solved / count:8.2f} % {total / count:6.2f} '
            f'{1e6 * np.median(times):9.1f} {1e6 * np.sum(times) / max(total, 1):9.1f} '
            f'{worst:9.1e}',
            flush=True,
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--poses', type=int, default=10_000)
    parser.add_argument('--peers', type=int, default=500)
    parser.add_argument('--eaik', metavar='PYTHON', default=sys.executable)
    parser.add_argument('robots', nargs='*', default=[*THREE, *FEW, *SIX, *REDUNDANT])
    arguments = parser.parse_args()
    print(f'{arguments.poses} random poses inside the limits; Python {sys.version.split()[0]}')
    print(
        f'{"robot":24s} {"origin":>10s} {"residual":>9s} {"a set":>6s} {"us a set":>9s} '
        f'{"99 %":>9s} {"us a sol.":>9s}'
    )
    for name in arguments.robots if arguments.poses else ():
        if name not in REDUNDANT:  # a curve is known at its representative only
            round_trip(name, arguments.poses)
    if not arguments.peers:
        return
    print(f'\n{arguments.peers} poses; solved: one solution within {PROVED:g} (2e-3 at tol 1e-6)')
    print(
        f'{"robot":24s} {"":17s} {"solved":>10s} {"a set":>6s} {"us a call":>9s} '
        f'{"us a sol.":>9s} {"worst":>9s}'
    )
    for name in [name for name in PEERED if name in arguments.robots]:
        compare(name, arguments.peers, arguments.eaik)


if __name__ == '__main__':
    main()
