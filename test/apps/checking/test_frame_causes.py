# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The frame check names the right cause of many recordings, and never a wrong one."""

import math

import numpy as np
import pytest
from arms import robot_of
from calibrated_arms import BASE, TOOL

import kinematics_service as ks
from kinematics_service.apps.calibration.corrections import corrected_robot
from kinematics_service.apps.checking.diagnosis import diagnose_frames
from kinematics_service.apps.checking.offsets import fit_offsets
from kinematics_service.apps.recordings.audit.reported_velocities import (
    MotionColumns,
    velocity_check,
)
from kinematics_service.apps.recordings.audit.stream import StreamWatch
from kinematics_service.apps.recordings.readers.block import Block
from kinematics_service.kinematics.uncertainty.parameters import parameters_of
from kinematics_service.rigid_motion import exponential

DEG = math.radians(1.0)
# Standard deviations of a position (m) and a rotation (rad): of a camera, and of printed digits.
CAMERA, DIGITS = (2e-4, 1e-3), (1e-6, 1e-6)
# Standard deviations of lengths (m) and angles (rad) of a real unit's table.
UNIT = {'lengths': 3e-4, 'angles': 0.1 * DEG, 'offsets': 0.05 * DEG}
ONE_JOINT = ks.robot_from_text(
    'robot: one\nconvention: modified\njoints: [{name: turn, type: revolute}]\n'
    'links: [{a: 0.4, alpha: 0.3, d: 0.1, theta: turn}]\n'
)
# Lengths far apart: a rail of a metre, an arm 5 m above it, a finger of 2 cm.
LONG = ks.robot_from_text(
    'robot: long\nconvention: standard\njoints: [{name: rail, type: prismatic},'
    ' {name: pan, type: revolute}, {name: lift, type: revolute}]\nlinks:\n'
    '- {a: 0, alpha: pi/2, d: rail, theta: 0}\n- {a: 0.02, alpha: pi/2, d: 5.0, theta: pan}\n'
    '- {a: 0.3, alpha: 0, d: 0, theta: lift}\n'
)
OWN = {'one': ONE_JOINT, 'long': LONG}


def recording(name, fault, moving, size, noise, unit, seed):
    """Return an arm, what its encoders say, and poses of its tool with a base and a tool."""
    robot, random = OWN.get(name) or robot_of(name), np.random.default_rng(seed)
    slides, n = robot.prismatic, robot.dof
    bounds = np.where(np.isfinite(robot.limits), robot.limits, [-3.0, 3.0])
    low, high = np.clip(bounds, -1.8, 1.8).T
    high = np.where(slides, np.minimum(high, low + 0.8), high)
    reach = np.minimum(np.where(slides, 0.3, 1.0) * size, 0.5 * (high - low))
    t = np.arange(20) * 0.3
    waves = sum(
        np.sin(random.uniform(0.3, 1.6, n) * t[:, None] + random.uniform(0, 6, n)) for _ in '123'
    )
    q = 0.5 * (low + high) + reach * np.clip(waves / 2.0, -1.0, 1.0)
    still = [j for j in range(n) if moving and j not in moving]
    q[:, still] = random.uniform(low, high)[still]
    table = parameters_of(robot).table
    errors = unit * np.array([UNIT[one.group] for one in table]) * random.normal(size=len(table))
    kind, where, value = fault
    seen = q.copy()
    if kind == 'scale':
        seen[:, where] *= value
    elif kind == 'zero':
        seen[:, where] -= value
    elif kind == 'degrees':
        seen = np.where(slides, q, np.degrees(q))
    elif kind == 'table':
        errors[[one.name for one in table].index(where)] += value
    poses = ks.forward_kinematics(corrected_robot(robot, table, errors), q)
    poses = poses if noise is DIGITS else BASE @ poses @ TOOL
    poses[:, :3, 3] += noise[0] * random.normal(size=(len(q), 3))
    turns = exponential(noise[1] * random.normal(size=(len(q), 3)))
    poses[:, :3, :3] = turns @ poses[:, :3, :3]
    return robot, seen, poses


def planted(name, fault, key='', *, moving=(), size=1.0, noise=CAMERA, unit=0.0, value=None):
    return pytest.param(
        (name, fault, moving, size, noise, unit), key, value, id=f'{name}-{fault}-{moving}-{size}'
    )


def scaled(name, joint, factor, key='joint_scale', **more):
    return planted(name, ('scale', joint, factor), key, value=1.0 / factor, **more)


# Named with its value; nothing after the fault: no decisive cause.
RECORDINGS = [
    scaled('ur5e', 2, 1.1),
    scaled('ur5e', 4, 1.0 / DEG),
    scaled('ur5e', 2, 2.0, unit=1.0),
    scaled('ur5e', 4, 0.5, moving=(3, 4)),
    scaled('panda', 3, -2.0),
    scaled('so101', 2, 1.5),
    scaled('one', 0, 2.0),
    scaled('scara_hsr065', 2, 1000.0 * DEG),
    scaled('scara_hsr065', 2, 1.0 / 0.0254),
    scaled('long', 0, 100.0),
    planted('panda', ('degrees', 0, 0.0), 'degrees'),
    scaled('scara_hsr065', 2, 1000.0, 'millimetres'),
    planted('ur5e', ('zero', 2, 3 * DEG), 'joint_offset', value=3 * DEG),
    planted('panda', ('zero', 3, 2 * DEG), 'joint_offset', value=2 * DEG, unit=1.0),
    planted('ur5e', ('table', 'alpha3', 5 * DEG), 'link_twist', value=5 * DEG),
    planted('ur5e', ('table', 'a2', 0.03), 'link_length', value=0.03, noise=DIGITS),
    *(
        planted('ur5e', ('table', name, error), moving=moving, noise=DIGITS, unit=unit)
        for name, error, unit, moving in (
            ('alpha1', 3 * DEG, 0.0, (0, 5)),
            ('alpha3', 0.25 * DEG, 1.0, (0, 4)),
            ('alpha5', 0.25 * DEG, 0.0, (0, 4)),
        )
    ),
    *(
        planted('ur5e', ('zero', joint, 2 * DEG), moving=moving, noise=DIGITS)
        for joint, moving in ((4, (0, 5)), (2, (0, 3)))
    ),
    planted('ur5e', ('zero', 0, 3 * DEG)),
    planted('puma560', ('scale', 4, 2.0), moving=(0, 1, 2)),
    *(
        planted(name, ('none', 0, 0.0), unit=1.0, moving=moving, size=size, noise=noise)
        for name, moving, size, noise in (
            ('ur5e', (0, 5), 1.0, DIGITS),
            ('ur5e', (1, 2, 3), 0.1, DIGITS),
            ('panda', (), 1.0, CAMERA),
            ('one', (), 1.0, DIGITS),
            ('long', (), 1.0, DIGITS),
        )
    ),
]


# One in three is quick to run; the others are of the slow ring.
RINGS = [
    one if k % 3 == 0 else pytest.param(*one.values, id=one.id, marks=pytest.mark.slow)
    for k, one in enumerate(RECORDINGS)
]


@pytest.mark.parametrize(('given', 'key', 'value'), RINGS)
def test_the_right_cause_is_named_and_no_other(given, key, value):
    robot, q, poses = recording(*given, seed=3)
    # Stamps that stand still: no lag is looked for.
    diagnosis = diagnose_frames(robot, q, poses, np.zeros(len(q)), read='rpy')
    assert (diagnosis.cause.key if diagnosis.cause else '') == key, diagnosis.sentence
    kind, where, _ = given[1]
    if kind in ('scale', 'zero') and key.startswith('joint'):
        assert f'joint {robot.joint_names[where]} ' in diagnosis.cause.sentence.lower()
    if value is not None and key != 'millimetres':
        assert diagnosis.cause.value == pytest.approx(value, rel=0.05)


def test_few_moving_joints_have_their_offsets_found():
    # All orientations turn about one axis, by 0.1 rad: positions tell the turn about it.
    robot, q, poses = recording('ur5e', ('none', 0, 0.0), (1, 2, 3), 0.1, CAMERA, 0.0, seed=7)
    exact = BASE @ ks.forward_kinematics(robot, q) @ TOOL
    assert fit_offsets(ks.forward_kinematics(robot, q)[None], exact[None]).score[0] < 1e-9


@pytest.mark.parametrize(
    ('turn', 'words'),
    [
        ([0.0, 0.0, math.pi], '180 deg about z: base_link of UR arms'),
        ([0.0, 0.5 * math.pi, 0.0], '90 deg about y'),
        ([0.3, 0.2, 0.1], '21.4 deg about (0.80, 0.53, 0.27)'),
    ],
)
def test_a_turned_base_is_said(turn, words):
    robot, q, _ = recording('ur5e', ('none', 0, 0.0), (), 1.0, CAMERA, 0.0, seed=3)
    poses = ks.forward_kinematics(robot, q)
    turned = np.eye(4)
    turned[:3, :3] = exponential(np.array(turn))
    poses[:, :3, 3] += 1e-4 * np.random.default_rng(0).normal(size=(len(q), 3))
    sentence = diagnose_frames(robot, q, turned @ poses).sentence
    assert f'turned by {words}) ' in sentence
    assert 'is turned' not in diagnose_frames(robot, q, BASE @ poses).sentence


def test_a_table_may_begin_at_0_s():
    for first, unstamped in ((0, 0), (5, 1)):
        watch = StreamWatch(('q1',))
        times = np.array([0, 10**7, 2 * 10**7])
        watch.take(Block(('q1',), times, times + first, np.zeros((3, 1)), np.zeros((3, 0))))
        assert watch.stream().unstamped == unstamped


@pytest.mark.parametrize(('reach', 'compared'), [(3e-4, False), (3e-3, True)])
def test_velocities_of_a_joint_that_stands_are_not_compared(reach, compared):
    t = np.arange(2000) * 8e-3
    motion = MotionColumns(1)
    q, rates = reach * np.sin(4.0 * t)[:, None], 4.0 * reach * np.cos(4.0 * t)[:, None]
    motion.add(np.rint(1e9 * t).astype(np.int64), q, 0.06 * rates, np.zeros(len(t), dtype=bool))
    assert (velocity_check(motion, 0, False) is not None) == compared
