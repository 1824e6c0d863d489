# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Poses of a running robot are matched with the joint states around them."""

import numpy as np
from arms import robot_of

from kinematics_service.apps.calibration.collecting import MAX_POSES, PoseCollector

STEP = 10_000_000


def collector(name='planar_2r'):
    return PoseCollector(robot_of(name))


def pose(x):
    T = np.eye(4)
    T[0, 3] = x
    return T


def test_joints_are_those_of_the_time_of_a_pose():
    one = collector()
    one.note_state(0, np.array([0.0, 0.0]))
    one.note_pose(STEP // 4, pose(1.0))  # before the state after it
    one.note_state(STEP, np.array([0.4, 0.8]))
    one.note_state(2 * STEP, np.array([0.8, 1.6]))
    one.note_pose(STEP, pose(2.0))  # late
    got = one.collected()
    assert np.allclose(got.q, [[0.1, 0.2], [0.4, 0.8]])
    assert np.allclose(got.rates, [40.0, 80.0])
    assert got.poses[:, 0, 3].tolist() == [1.0, 2.0]
    assert got.stamps == (STEP // 4, STEP)


def test_of_poses_at_one_place_the_slowest_is_kept():
    one = collector()
    for k, x in enumerate([0.0, 0.01, 0.011, 0.0111, 0.02]):
        one.note_state(k * STEP, np.array([x, 0.0]))
        one.note_pose(k * STEP, pose(k))
    one.note_state(5 * STEP, np.array([0.5, 0.0]))
    assert one.collected().poses[:, 0, 3].tolist() == [2.0]
    one.note_pose(5 * STEP, pose(5))
    one.note_state(6 * STEP, np.array([0.5, 0.0]))
    assert one.collected().poses[:, 0, 3].tolist() == [2.0, 5.0]


def test_poses_without_states_around_them_are_left_out_and_counted():
    one = collector()
    one.note_state(100 * STEP, np.zeros(2))
    one.note_pose(50 * STEP, pose(1.0))  # older than all states
    one.note_pose(105 * STEP, pose(2.0))
    one.note_state(150 * STEP, np.ones(2))  # half a second later
    assert len(one) == 0
    assert one.unmatched == 2


def test_stamps_that_step_back_begin_a_new_time():
    one = collector()
    one.note_state(100 * STEP, np.zeros(2))
    one.note_state(STEP, np.ones(2))
    one.note_state(2 * STEP, np.ones(2))
    one.note_pose(STEP, pose(1.0))
    assert one.collected().q.tolist() == [[1.0, 1.0]]


def test_poses_kept_have_a_bound_and_early_ones_stay():
    one = collector()
    for k in range(3 * MAX_POSES):
        one.note_state(k * STEP, np.array([0.1 * k, 0.0]))
        one.note_pose(k * STEP, pose(k))
    assert MAX_POSES // 2 <= len(one) <= MAX_POSES
    assert one.collected().poses[0, 0, 3] == 0.0
