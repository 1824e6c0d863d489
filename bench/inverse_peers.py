# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
All solutions beside ssik: six joints by time, seven by the ends of their arcs, too.

    python bench/inverse_peers.py [--poses 150] [--targets 1000] [arm ...]

Six joints: random poses inside the limits of each library's own model of the arm. ssik lists full
turns apart, and answers a pose with no proof; here each answer says whether there are others.
Seven: the same targets, made by ssik's model, moved to where ours has its frames. Ends of arcs are
compared modulo full turns. Times are means of the least of three calls, one library's after the
other's at each pose.
"""

import argparse
import math
import time

import numpy as np
from ssik import Manipulator

import kinematics_service as ks

SIX = {
    'ur5e': 'ur5e_ik',
    'xarm6': 'xarm6_ik',
    'gen3_lite': 'gen3_lite_ik',
    'puma560': 'puma560_ik',
    'crx10ia_l': 'fanuc_crx10ial_ik',
}
SEVEN = {'panda': 'franka_panda_ik', 'kuka_iiwa14': 'iiwa14_ik'}
CALLS = 3
# Ends of arcs are the same (rad), and the poses of both models (m, and of a rotation).
SAME, SAME_MODEL = 1e-7, 1e-9
# An end is one of a limit where a joint is as near to it (rad).
NEAR_LIMIT = 1e-4


def inside(limits, count, seed):
    low, high = np.clip(np.array(limits, float), -math.pi, math.pi).T
    return np.random.default_rng(seed).uniform(low, high, (count, len(low)))


def least(function, target):
    seconds, answer = math.inf, None
    for _ in range(CALLS):
        begin = time.process_time()
        answer = function(target)
        seconds = min(seconds, time.process_time() - begin)
    return seconds, answer


def six_joints(name, count):
    robot, peer = ks.load_robot(name), Manipulator.from_prebuilt(SIX[name])
    ours = ks.forward_kinematics(robot, inside(robot.limits, count, 3))
    theirs = [np.array(peer.fk(q)) for q in inside(peer.joint_limits, count, 3)]
    ks.inverse_kinematics(robot, ours[0])
    peer.solve(theirs[0])
    rows = []
    for a, b in zip(ours, theirs):
        one, result = least(lambda T: ks.inverse_kinematics(robot, T), a)
        other, found = least(peer.solve, b)
        rows.append((one, other, len(result), len(found), result.complete == 'proved'))
    every, _ = least(lambda T: ks.inverse_kinematics_of_each(robot, T), ours)
    one, other, solutions, found, proved = np.mean(rows, axis=0)
    half, of_other = np.median(np.array(rows)[:, :2], axis=0)
    print(
        f'{name:12s} {1e6 * one:8.1f} {1e6 * half:8.1f} {1e6 * every / count:8.1f} '
        f'{1e6 * other:8.1f} {1e6 * of_other:8.1f} {one / other:7.2f} {half / of_other:7.2f} '
        f'{every / count / other:7.2f} {solutions:6.1f} {found:6.1f} {100 * proved:6.1f} %',
        flush=True,
    )


def between_models(robot, peer):
    """Return the motions before and after the peer's pose that make it ours."""
    q = np.random.default_rng(0).uniform(-1.0, 1.0, robot.dof)
    after = np.linalg.inv(peer.fk(q)) @ ks.forward_kinematics(robot, q)
    for q in np.random.default_rng(1).uniform(-1.0, 1.0, (5, robot.dof)):
        away = np.array(peer.fk(q)) @ after - ks.forward_kinematics(robot, q)
        if np.max(np.abs(away)) > SAME_MODEL:
            raise SystemExit(f'{robot.name}: the models differ by {np.max(np.abs(away)):.1e}')
    return after


def limit_ends(limits, rows):
    """Return those of joint positions (m, 7) at which a joint is at a limit, and how far off."""
    q = np.array(rows, float).reshape(-1, len(limits))
    away = np.abs(q[:, :, None] - limits[None])
    away = np.min(np.abs(away - math.tau * np.round(away / math.tau)), axis=(1, 2))
    return q[away < NEAR_LIMIT], away[away < NEAR_LIMIT]


def farthest(some, others):
    """Return how far each of some joint positions is from the nearest of others, turns aside."""
    if not len(others):
        return np.full(len(some), math.inf)
    away = some[:, None] - others[None]
    away -= math.tau * np.round(away / math.tau)
    return np.min(np.max(np.abs(away), axis=2), axis=1)


def arcs_of_peer(peer, target, limits):
    manifold = peer.self_motion(target)
    return [
        chart.q(np.array(interval))
        for chart in manifold.charts
        for interval in chart.in_limits(limits)
    ]


def seven_joints(name, count):
    robot, peer = ks.load_robot(name), Manipulator.from_prebuilt(SEVEN[name])
    after, limits = between_models(robot, peer), np.array(robot.limits)
    peers = [np.array(peer.fk(q)) for q in inside(limits, count, 5)]
    ks.inverse_kinematics(robot, peers[0] @ after)
    seconds, ends, same, lost, extra, loose = [], 0, 0, 0, 0, 0
    for target in peers:
        ours, result = least(lambda T: ks.inverse_kinematics(robot, T), target @ after)
        begin = time.process_time()
        found = arcs_of_peer(peer, target, limits)
        seconds.append((ours, time.process_time() - begin))
        arcs = [arc for family in result.families for arc in family.intervals]
        mine, _ = limit_ends(limits, [q for arc in arcs if arc.ends for q in arc.q[[0, -1]]])
        theirs, off = limit_ends(limits, [q for ends_of in found for q in ends_of])
        ends += len(mine)
        of_theirs = farthest(theirs, mine)
        # What ssik puts beside the limit is as far from ours as that.
        loose += int(np.sum((of_theirs > SAME) & (of_theirs < NEAR_LIMIT)))
        lost += int(np.sum(of_theirs >= NEAR_LIMIT))
        of_mine = farthest(mine, theirs)
        same += int(np.sum(of_mine < SAME))
        extra += int(np.sum(of_mine >= NEAR_LIMIT))
    one, other = np.mean(seconds, axis=0)
    half, of_other = np.median(seconds, axis=0)
    print(
        f'{name:12s} {1e3 * one:7.2f} {1e3 * half:7.2f} {1e3 * other:8.1f} {1e3 * of_other:8.1f} '
        f'{ends:7d} {same:7d} {loose:6d} {lost:6d} {extra:6d}',
        flush=True,
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--poses', type=int, default=150)
    parser.add_argument('--targets', type=int, default=1000)
    parser.add_argument('arms', nargs='*', default=[*SIX, *SEVEN])
    arguments = parser.parse_args()
    print(f'six joints, {arguments.poses} poses: us a pose, of a mean and a median')
    print(
        f'{"arm":12s} {"ours":>8s} {"median":>8s} {"of each":>8s} {"ssik":>8s} {"median":>8s} '
        f'{"ratio":>7s} {"":7s} {"":7s} {"ours":>6s} {"ssik":>6s} {"proved":>8s}'
    )
    for name in [name for name in SIX if name in arguments.arms]:
        six_joints(name, arguments.poses)
    print(f'\nseven joints, {arguments.targets} targets: ms a target; ends of arcs at limits')
    print(
        f'{"arm":12s} {"ours":>7s} {"median":>7s} {"ssik":>8s} {"median":>8s} '
        f'{"ends":>7s} {"same":>7s} {"beside":>6s} {"lost":>6s} {"extra":>6s}'
    )
    for name in [name for name in SEVEN if name in arguments.arms]:
        seven_joints(name, arguments.targets)


if __name__ == '__main__':
    main()
