"""
What the frame doctor of `audit` makes of planted faults, and of recordings with none.

    python bench/frames.py [--data panda ur5e ur3e_rad] [--seeds 20] [--cases NAME ...]

`panda` and `ur5e` are made up: 20 s at 1 kHz whose stamps jitter and whose rows repeat, with the
noise of encoders and of a calibrated unit under the nominal table. `ur3e_rad` is a recording of a
real arm, where `recordings` is found. Each row says what was planted and what was named.
"""

import argparse
import dataclasses
import math
import os
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import numpy as np

import kinematics_service as ks
from kinematics_service.diagnosis.audit.auditing import audit
from kinematics_service.diagnosis.audit.frames import FrameReport
from kinematics_service.formats.recordings.block import Block
from kinematics_service.formats.recordings.source import PoseTrack, RecordingSource
from kinematics_service.robot.robot import build_robot

BEGIN = 1_700_000_000_000_000_000
SECONDS, RATE = 20.0, 1000
# Of encoders (rad) and of measured poses (m, rad); steps of an encoder.
NOISE, POSE_NOISE, ANGLE_NOISE, STEP = 1e-5, 5e-5, 1e-4, 2e-6
# What the unit differs from the nominal table by (m), like the residual of a real one.
UNIT = 2e-4
REPEATED = 0.05
LAGS = (0.005, 0.05, -0.05, 0.2)
RECORDINGS = Path(__file__).parents[2] / 'shared' / 'recordings'


class Data(NamedTuple):
    """A recording: stamps s (N,), joints (N, n), poses (N, 4, 4), and both without a fault."""

    robot: ks.Robot
    t: np.ndarray
    q: np.ndarray
    poses: np.ndarray


def rotations(w):
    angle = np.linalg.norm(w, axis=-1)[:, None, None] + 1e-300
    x, y, z = (w / angle[:, 0]).T
    o = np.zeros_like(x)
    K = np.stack([o, -z, y, z, o, -x, -y, x, o], axis=-1).reshape(-1, 3, 3)
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def placed(xyz, w):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotations(np.array([w]))[0], xyz
    return T


X, Y = placed([0.3, -0.2, 0.5], [0.1, 0.2, 0.8]), placed([0.02, 0.01, 0.15], [0.3, -0.1, 0.2])


def made_up(name, seed=0, lag=0.0, seconds=SECONDS, rate=RATE):
    """Return a recording whose poses come `lag` seconds late."""
    robot, random = ks.load_robot(name), np.random.default_rng(seed)
    t = np.arange(int(seconds * rate)) / rate
    low, high = np.clip(robot.limits, -2.2, 2.2).T
    slow, fast = random.uniform(0.3, 1.5, robot.dof), random.uniform(1.5, 4.0, robot.dof)
    phase, reach = random.uniform(0, 6, (2, robot.dof)), 0.4 * (high - low)

    def motion(t):
        one = np.sin(t[:, None] * slow + phase[0])
        other = np.sin(t[:, None] * fast + phase[1])
        return 0.5 * (low + high) + 0.6 * reach * one + 0.05 * reach * other

    q, at_poses = motion(t), motion(t - lag)
    B = X @ ks.forward_kinematics(robot, at_poses) @ Y
    B[:, :3, 3] += UNIT * np.sin(at_poses[:, [1, 2, 3]] + [0.3, 1.2, 2.0])
    B[:, :3, 3] += POSE_NOISE * random.normal(size=(len(t), 3))
    B[:, :3, :3] = rotations(ANGLE_NOISE * random.normal(size=(len(t), 3))) @ B[:, :3, :3]
    q = np.rint((q + NOISE * random.normal(size=q.shape)) / STEP) * STEP
    # Stamps are late by a little; some rows stand twice.
    late = 0.5 / rate * random.exponential(size=len(t))
    stamps = np.maximum.accumulate(t + np.minimum(late, 3.0 / rate))
    stamps += 0.2e-3 / rate * np.arange(len(t))
    twice = np.flatnonzero(random.random(len(t)) < REPEATED)[1:]
    q[twice], B[twice] = q[twice - 1], B[twice - 1]
    return Data(robot, stamps, q, B)


def real():
    """Return the recording of the UR3e, None where it is not there."""
    file = Path(os.environ.get('KINEMATICS_RECORDINGS', RECORDINGS)) / 'ur3e_rad/rad_ur3e_25hz.csv'
    if not file.exists():
        return None
    table = np.genfromtxt(file, delimiter=',', names=True)

    def six(name):
        return np.stack([table[f'{name}_{k}'] for k in range(6)], axis=1)

    pose = six('actual_TCP_pose')
    B = np.zeros((len(pose), 4, 4))
    B[:, :3, :3], B[:, :3, 3], B[:, 3, 3] = rotations(pose[:, 3:]), pose[:, :3], 1.0
    return Data(
        ks.load_robot('ur3e'), table['timestamp'] - table['timestamp'][0], six('actual_q'), B
    )


def late(data, lag):
    """Return a real recording whose poses come late, by joints of another time."""
    q = np.stack([np.interp(data.t + lag, data.t, column) for column in data.q.T], axis=1)
    inside = (data.t + lag >= data.t[0]) & (data.t + lag <= data.t[-1])
    return Data(data.robot, data.t[inside], q[inside], data.poses[inside])


def faults(data):
    """Yield name, keys of causes that would be right (none: no cause), robot, q and poses."""
    robot, q, B = data.robot, data.q, data.poses
    n, names = robot.dof, robot.joint_names
    yield 'nothing', {'': ''}, robot, q, B
    for i, j in [*((k, k + 1) for k in range(n - 1)), (0, n - 1)]:
        order = list(range(n))
        order[i], order[j] = j, i
        yield f'swap {i + 1} {j + 1}', {'joint_order': names[i]}, robot, q[:, order], B
    yield 'reversed', {'joint_order': 'reverse'}, robot, q[:, ::-1], B
    for j in range(n):
        signs = np.where(np.arange(n) == j, -1.0, 1.0)
        yield f'sign {j + 1}', {'joint_sign': names[j]}, robot, q * signs, B
    yield 'all signs', {'joint_signs': ''}, robot, -q, B
    yield 'degrees', {'degrees': ''}, robot, np.degrees(q), B
    for name, key, poses in poses_of(B):
        yield name, {key: ''}, robot, q, poses
    yield 'other convention', {'convention': ''}, misread(robot), q, B
    for j in range(1, n - 1):
        zero = q + np.where(np.arange(n) == j, math.radians(2.0), 0.0)
        yield f'zero of {j + 1} by 2 deg', {'joint_offset': names[j]}, robot, zero, B
    for row, key in lengths(robot):
        yield f'{key} of row {row} by 5 mm', {'link_length': ''}, longer(robot, row, key), q, B


def poses_of(B):
    R, p = B[:, :3, :3], B[:, :3, 3]

    def made(R, p):
        T = np.array(B)
        T[:, :3, :3], T[:, :3, 3] = R, p
        return T

    yield 'poses in mm', 'millimetres', made(R, 1e3 * p)
    yield 'positions in tool axes', 'tool_axes', made(R, np.einsum('nji,nj->ni', R, p))
    yield 'orientations transposed', 'tool_axes', made(np.swapaxes(R, 1, 2), p)
    yield 'poses inverted', 'tool_axes', np.linalg.inv(B)
    x, y, z, w = quaternions(R).T
    wrong = np.stack([w, x, y, z], axis=1)
    yield 'quaternions w x y z', 'quaternion_order', made(of_quaternions(wrong), p)


def quaternions(R):
    # The eigenvector of the largest eigenvalue (Bar-Itzhack 2000), so any angle will do.
    K = np.zeros((len(R), 4, 4))
    for i in range(3):
        for j in range(3):
            K[:, i, j] = R[:, i, j] + R[:, j, i] - (i == j) * np.trace(R, axis1=1, axis2=2)
    K[:, 0, 3] = K[:, 3, 0] = R[:, 2, 1] - R[:, 1, 2]
    K[:, 1, 3] = K[:, 3, 1] = R[:, 0, 2] - R[:, 2, 0]
    K[:, 2, 3] = K[:, 3, 2] = R[:, 1, 0] - R[:, 0, 1]
    K[:, 3, 3] = np.trace(R, axis1=1, axis2=2)
    return np.linalg.eigh(K)[1][:, :, -1]


def of_quaternions(numbers):
    v, w = numbers[:, :3], np.clip(numbers[:, 3], -1.0, 1.0)
    angle, norm = 2.0 * np.arccos(w), np.linalg.norm(v, axis=1) + 1e-300
    return rotations(v * (angle / norm)[:, None])


def plain(robot, **changes):
    description = robot.description
    singularity = dataclasses.replace(description.singularity, factors=())
    return build_robot(dataclasses.replace(description, singularity=singularity, **changes))


def misread(robot):
    return plain(
        robot, convention={'standard': 'modified', 'modified': 'standard'}[robot.convention]
    )


def lengths(robot):
    for row, link in enumerate(robot.description.links):
        for key in ('a', 'd'):
            if 0 < row < len(robot.description.links) - 1 and not link[key].affine.coefficients:
                yield row, key


def longer(robot, row, key):
    links = list(robot.description.links)
    link = links[row]
    own = link[key]
    affine = dataclasses.replace(own.affine, constant=own.affine.constant + 5e-3)
    changed = dataclasses.replace(own, affine=affine)
    place = link.names.index(key)
    motions = list(link.motions)
    motions[place] = dataclasses.replace(motions[place], argument=changed)
    links[row] = dataclasses.replace(link, motions=tuple(motions))
    return plain(robot, links=tuple(links))


def report_of(robot, t, q, poses):
    """Return the frames of an audit of a table with joints and poses in a row."""
    stamps = BEGIN + np.rint(1e9 * t).astype(np.int64)
    block = Block(robot.joint_names, stamps, stamps, q, np.zeros((len(q), 0)))
    track = PoseTrack('poses', '', stamps, poses, q)
    source = RecordingSource('table', 'made up', False, len(q), iter([block]), track)
    return audit(source, robot, 'made up').frames


def verdict(report, right):
    """Return `right`, `wrong` or `not named`, and what was said."""
    if not isinstance(report, FrameReport):
        return 'not compared', report.reason
    cause = report.diagnosis.cause
    if cause is None:
        word = 'right' if '' in right else 'not named'
        likely = report.diagnosis.likely
        return word, f'likely {likely[0].sentence} ({likely[0].ratio:.2g})' if likely else ''
    good = cause.key in right and right[cause.key] in cause.sentence
    return 'right' if good else 'wrong', f'{cause.sentence} ({cause.ratio:.3g})'


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--data', nargs='+', default=['panda', 'ur5e', 'ur3e_rad'])
    parser.add_argument('--cases', nargs='*', help='only those that contain one of these words')
    parser.add_argument('--seeds', type=int, default=20, help='recordings without a fault')
    arguments = parser.parse_args()
    totals = Counter()

    def said(name, case, report, right):
        word, text = verdict(report, right)
        totals[word] += 1
        print(f'{name:9} {case:24} {word:10} {text}', flush=True)

    for name in arguments.data:
        data = real() if name == 'ur3e_rad' else made_up(name)
        if data is None:
            continue
        for case, right, robot, q, poses in faults(data):
            if not arguments.cases or any(word in case for word in arguments.cases):
                said(name, case, report_of(robot, data.t, q, poses), right)
        for lag in LAGS:
            case = f'lag {1e3 * lag:g} ms'
            if not arguments.cases or any(word in case for word in arguments.cases):
                one = late(data, lag) if name == 'ur3e_rad' else made_up(name, lag=lag)
                report = report_of(one.robot, one.t, one.q, one.poses)
                said(name, case, report, {'time_lag': 'behind' if lag > 0 else 'ahead'})
        for seed in range(1, arguments.seeds if name != 'ur3e_rad' else 0):
            one = made_up(name, seed, seconds=6.0)
            said(
                name,
                f'nothing, seed {seed}',
                report_of(one.robot, one.t, one.q, one.poses),
                {'': ''},
            )
    print(', '.join(f'{word} {number}' for word, number in totals.most_common()))


if __name__ == '__main__':
    main()
