# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The demo's motions: exact velocities, inside limits, through a singular pose, for every arm."""

import functools
import math

import numpy as np
import pytest
from arms import DISTINCT_BUNDLED, robot_of
from linkages import SHORT_FIVE_BAR
from tolerances import DIFFERENCE, DIFFERENCE_STEP

import kinematics_service as ks
from kinematics_service.apps.demo.motions.motion import SPEED_RATIO
from kinematics_service.apps.demo.motions.passage import (
    MIN_PERIOD,
    smooth_trajectory,
)
from kinematics_service.apps.demo.motions.trajectory import TRAJECTORIES, sine_trajectory
from kinematics_service.kinematics.singular_poses import singular_poses
from kinematics_service.robot.closed_poses import close_at

# The demo's joint states are 20 ms apart; at the slowed-down singular pose that is 1e-4 rad.
SAMPLES = 2001
# What "through a singular pose" means, in rad.
THROUGH = 0.01
KINDS = tuple(TRAJECTORIES)
# Planning a smooth path takes seconds: for a turning, a sliding, a coupled arm and a wrist.
PLANNED = ('craig_3r', 'rrp_elementary', 'parallelogram_left', 'puma560')
MOTIONS = [
    *(('sine', name) for name in DISTINCT_BUNDLED),
    *(('smooth', name) for name in PLANNED),
]

ONE_JOINT = """
robot: one_joint
convention: standard
source: a test
joints:
  - {name: q1, type: revolute, limits: [-0.5, 0.5], velocity: 0.05}
links:
  - {a: 1, alpha: 0, d: 0, theta: q1}
"""

# Its only singular poses are q2 = 0 and pi, out of reach.
NEVER_STRAIGHT = """
robot: never_straight
convention: standard
source: a test
joints:
  - {name: q1, type: revolute}
  - {name: q2, type: revolute, limits: [1.0, 2.0]}
links:
  - {a: 1, alpha: 0, d: 0, theta: q1}
  - {a: 1, alpha: 0, d: 0, theta: q2}
"""


def motion_of(name, kind='smooth'):
    """Return a motion of an arm; each is planned once for all tests."""
    return planned(name, kind)


@functools.cache
def planned(name, kind):
    return TRAJECTORIES[kind](robot_of(name))


def times(trajectory):
    # A whole period and some, the crossing of the smooth path among them.
    return np.linspace(0.0, 2.0 * trajectory.period, SAMPLES)


@pytest.mark.slow
@pytest.mark.parametrize(('kind', 'name'), MOTIONS)
def test_a_motion_stays_inside_the_limits(kind, name):
    robot = robot_of(name)
    motion = motion_of(name, kind)
    q = motion.at(times(motion)).q
    assert np.all(q > robot.limits[:, 0])
    assert np.all(q < robot.limits[:, 1])


@pytest.mark.slow
@pytest.mark.parametrize(('kind', 'name'), MOTIONS)
def test_a_velocity_is_the_derivative_of_the_position(kind, name):
    motion = motion_of(name, kind)
    t = times(motion)
    late, early = t + DIFFERENCE_STEP, t - DIFFERENCE_STEP
    # By the step as it is rounded beside a time of many seconds.
    difference = (motion.at(late).q - motion.at(early).q) / (late - early)[:, None]
    assert np.max(np.abs(difference - motion.at(t).qdot)) < DIFFERENCE


@pytest.mark.slow
@pytest.mark.parametrize('name', PLANNED)
def test_the_smooth_path_keeps_its_share_of_the_velocity_limits(name):
    robot = robot_of(name)
    motion = motion_of(name)
    fastest = np.max(np.abs(motion.at(times(motion)).qdot), axis=0)
    assert np.all(fastest <= SPEED_RATIO * robot.velocity_limits)
    assert motion.period >= MIN_PERIOD


@pytest.mark.slow
@pytest.mark.parametrize('name', PLANNED)
def test_the_smooth_path_leads_from_regular_poses_through_a_singular_one(name):
    robot = robot_of(name)
    motion = motion_of(name)
    t = np.linspace(0.0, 0.5 * motion.period, SAMPLES)
    smallest = ks.singularity(robot, motion.at(t).q).smallest_singular_value
    assert np.min(smallest) < 1e-3 * np.max(smallest)
    # The distance of each is a search.
    t = t[::5]
    measured = ks.singularity(robot, motion.at(t).q)
    assert np.min(measured.distance) < THROUGH
    for end in (0, -1):
        assert measured.level[end] == ks.Level.OK
        assert measured.distance[end] > 3.0 * robot.singularity.thresholds.warn
        assert np.max(np.abs(motion.at(t[end]).qdot)) < 1e-12
    # The arm does not stop there: every joint goes on at a third of the speed of a sine.
    assert np.allclose(
        np.abs(motion.at(0.25 * motion.period).qdot),
        2.0 * math.pi / 3.0 / motion.period * np.abs(motion.reach),
        rtol=1e-12,
    )
    # Each level lasts long enough to be seen on a table drawn ten times a second.
    for level in (ks.Level.OK, ks.Level.WARN, ks.Level.ERROR):
        assert np.mean(measured.level == level) * 0.5 * motion.period > 0.3


@pytest.mark.slow
@pytest.mark.parametrize('name', PLANNED)
def test_singular_poses_are_singular_and_inside(name):
    robot = robot_of(name)
    q = singular_poses(robot, robot.limits)
    assert len(q)
    assert np.all((q >= robot.limits[:, 0]) & (q <= robot.limits[:, 1]))
    assert np.all(ks.singularity(robot, q).distance < 1e-6)


@pytest.mark.slow
@pytest.mark.parametrize('kind', KINDS)
def test_a_motion_is_the_same_each_time_and_repeats_itself(kind):
    robot = robot_of('craig_3r')
    one, other = motion_of('craig_3r', kind), TRAJECTORIES[kind](robot)
    assert np.array_equal(one.at(1.25).q, other.at(1.25).q)
    assert np.allclose(one.at(1.25 + one.period).q, one.at(1.25).q, rtol=0.0, atol=1e-12)
    assert one.at(1.25).q.shape == one.at(1.25).qdot.shape == (robot.dof,)


@pytest.mark.parametrize('name', ['craig_3r', 'anthropomorphic_3r', 'parallelogram_left'])
def test_document_002_sines_on_three_joints(name):
    motion = sine_trajectory(robot_of(name))
    for t in (0.0, 0.4, 2.0, 5.5):
        q, qdot = motion.at(t)
        assert q == pytest.approx([math.sin(t), math.cos(2 * t), math.sin(3 * t)], abs=1e-12)
        assert qdot == pytest.approx(
            [math.cos(t), -2 * math.sin(2 * t), 3 * math.cos(3 * t)], abs=1e-12
        )


def test_document_002_slider_moves_into_its_limits():
    motion = sine_trajectory(robot_of('rrp_elementary'))
    d3 = motion.at(times(motion)).q[:, 2]
    assert np.ptp(d3) == pytest.approx(2.0, abs=1e-3)
    assert np.min(d3) > 0.0


@pytest.mark.parametrize('text', [ONE_JOINT, NEVER_STRAIGHT])
def test_an_arm_without_singular_poses_moves_all_the_same(text):
    robot = ks.robot_from_text(text)
    assert singular_poses(robot, robot.limits).shape == (0, robot.dof)
    motion = smooth_trajectory(robot)
    q, qdot = motion.at(times(motion))
    assert np.all(np.ptp(q, axis=0) > 0.1)
    assert np.all((q > robot.limits[:, 0]) & (q < robot.limits[:, 1]))
    assert np.all(np.abs(qdot) <= SPEED_RATIO * robot.velocity_limits)


def test_the_loops_of_a_closed_arm_close_all_along_the_smooth_path():
    robot = ks.robot_from_text(SHORT_FIVE_BAR)
    q = smooth_trajectory(robot).at(np.linspace(0.0, MIN_PERIOD, 101)).q
    assert np.all(np.ptp(q, axis=0) > 0.1)
    assert not np.any(close_at(robot.chain, q)[1])
