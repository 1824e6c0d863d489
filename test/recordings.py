# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Where recordings of real robots are, and streams of joint states made up for tests.

Nothing of the recordings is part of this project; without them their tests skip.
"""

import numpy as np
import pytest
from folders import RECORDINGS

from kinematics_service.estimation.joint_sample import JointSample

SECOND = 1_000_000_000
BEGIN = 1_700_000_000 * SECOND


# The arm of a recording, of its side and y.
PR2 = """
robot: pr2_{side}_arm
source: "fitted to the /tf of a PR2's robot_state_publisher"
convention: modified
joints:
  - {{name: {side}_shoulder_pan_joint, variable: q1, type: revolute}}
  - {{name: {side}_shoulder_lift_joint, variable: q2, type: revolute}}
  - {{name: {side}_upper_arm_roll_joint, variable: q3, type: revolute}}
  - {{name: {side}_elbow_flex_joint, variable: q4, type: revolute}}
  - {{name: {side}_forearm_roll_joint, variable: q5, type: revolute}}
  - {{name: {side}_wrist_flex_joint, variable: q6, type: revolute}}
  - {{name: {side}_wrist_roll_joint, variable: q7, type: revolute}}
links:
  - {{a: 0,   alpha: 0,     d: 0,     theta: q1}}
  - {{a: 0.1, alpha: -pi/2, d: 0,     theta: q2 + pi/2}}
  - {{a: 0,   alpha: pi/2,  d: 0.4,   theta: q3}}
  - {{a: 0,   alpha: -pi/2, d: 0,     theta: q4}}
  - {{a: 0,   alpha: pi/2,  d: 0.321, theta: q5}}
  - {{a: 0,   alpha: -pi/2, d: 0,     theta: q6}}
  - {{a: 0,   alpha: pi/2,  d: 0,     theta: q7}}
base: {{frame: torso_lift_link, xyz: [0, {y}, 0]}}
tool: {{frame: {side}_wrist_roll_link, rpy: [0, -pi/2, 0]}}
"""


def recorded(name):
    """Return the path of a recording, or skip."""
    path = RECORDINGS / name
    if not path.exists():
        pytest.skip(f'{name} is not in {RECORDINGS} (set KINEMATICS_RECORDINGS)')
    return path


def motion(robot, count, rate=100.0, seed=0):
    """Return times (s), positions and velocities of a smooth motion."""
    random = np.random.default_rng(seed)
    t = np.arange(count) / rate
    low, high = np.clip(robot.limits, -2.5, 2.5).T
    frequency, phase = random.uniform(0.3, 2.0, robot.dof), random.uniform(0, 6, robot.dof)
    middle, reach = 0.5 * (low + high), 0.4 * (high - low)
    angle = t[:, None] * frequency + phase
    return t, middle + reach * np.sin(angle), reach * frequency * np.cos(angle)


def samples_of(robot, t, q, qdot, begin=BEGIN, names=None):
    """Return joint samples, heard 2 ms after their stamps."""
    names = tuple(names or robot.joint_names)
    stamps = begin + np.rint(t * 1e9).astype(np.int64)
    return [
        JointSample(names, p.tolist(), v.tolist(), s, s + 2_000_000, s + 2_000_000)
        for p, v, s in zip(q, qdot, stamps.tolist())
    ]


def awkward(robot, seed=0):
    """Return samples with everything that goes wrong on a topic."""
    t, q, qdot = motion(robot, 600, 100.0, seed)
    samples = samples_of(robot, t, q, qdot)
    random = np.random.default_rng(seed + 1)
    order = random.permutation(robot.dof)
    nan = float('nan')
    for k in range(len(samples)):
        one = samples[k]
        if 40 <= k < 60:
            one = one._replace(velocities=[])
        if k == 70:
            one = one._replace(velocities=[*one.velocities[:-1], nan])
        if k == 80:
            one = one._replace(positions=[nan, *one.positions[1:]])
        if k == 90:
            one = one._replace(positions=one.positions[:-1])
        if k in (100, 101, 102):
            one = one._replace(stamp=samples[99].stamp)
        if k == 110:
            one = one._replace(stamp=samples[105].stamp + 1)
        if k == 120:
            one = one._replace(positions=[])
        if 130 <= k < 140:
            one = one._replace(stamp=0)
        if k == 150:
            one = one._replace(names=(*one.names[:-1], one.names[0]))
        if 200 <= k < 230:
            one = one._replace(
                names=tuple(one.names[j] for j in order),
                positions=[one.positions[j] for j in order],
                velocities=[one.velocities[j] for j in order],
            )
        if 300 <= k < 340:  # two drivers
            half = slice(0, 1) if k % 2 else slice(1, None)
            one = one._replace(
                names=one.names[half],
                positions=one.positions[half],
                velocities=one.velocities[half],
            )
        if k >= 400:  # a bag that loops, 5 s back
            one = one._replace(stamp=one.stamp - 5 * SECOND)
        if k >= 450:  # and a silence
            wait = 3 * SECOND
            one = one._replace(
                stamp=one.stamp + wait, received=one.received + wait, arrival=one.arrival + wait
            )
        samples[k] = one
    other = JointSample(('gripper', 'door'), [0.1, 0.2], [], *samples[250][3:])
    samples.insert(250, other)
    return samples
