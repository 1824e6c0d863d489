# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Batches on several cores: the same numbers to the last bit, the first fault, no lost error."""

import copy
import dataclasses
import pickle
import threading

import numpy as np
import pytest
from arms import robot_of
from refusal import refused

import kinematics_service as ks
from kinematics_service.kinematics import threads

# So that few poses are many.
MIN_PART = 60
POSES = 3 * MIN_PART + 17


@pytest.fixture(autouse=True)
def small_parts(monkeypatch):
    monkeypatch.setattr(threads, 'MIN_PART', MIN_PART)


@pytest.fixture
def two_cores(monkeypatch):
    monkeypatch.setattr(threads, 'cores', lambda: 2)


def poses(robot):
    return np.random.default_rng(5).uniform(-3, 3, (POSES, robot.dof))


@pytest.mark.parametrize('name', ['ur5e', 'parallelogram_left', 'panda'])
def test_two_cores_give_the_numbers_of_one_to_the_last_bit(name, monkeypatch):
    robot = robot_of(name)
    q = poses(robot)
    found = []
    for cores in (1, 2, 3):
        monkeypatch.setattr(threads, 'cores', lambda cores=cores: cores)
        near = ks.singularity(robot, q, q)
        found.append([ks.evaluate(robot, q, q).numbers, near.distance, near.way_out, near.rate])
    for several in found[1:]:
        for one, other in zip(found[0], several):
            assert one.tobytes() == other.tobytes()


def test_the_first_bad_row_is_named_whichever_part_meets_one_first(two_cores):
    robot = robot_of('planar_2r')
    q = poses(robot)
    q[[POSES - 5, MIN_PART + 3], 1] = np.nan
    with refused(ks.JointVectorError, 'not-finite', f'row {MIN_PART + 3} is'):
        ks.jacobian(robot, q)


def test_every_row_is_done_once_and_small_batches_start_no_thread(two_cores):
    seen = []

    def work(begin, end):
        seen.append((begin, end, threading.current_thread()))
        return -1

    assert threads.in_parts(POSES, work) == -1
    bounds = sorted((begin, end) for begin, end, _ in seen)
    assert bounds[0][0] == 0
    assert bounds[-1][1] == POSES
    assert all(one[1] == other[0] for one, other in zip(bounds, bounds[1:]))
    seen.clear()
    threads.in_parts(2 * MIN_PART - 1, work)
    assert [row[2] for row in seen] == [threading.current_thread()]


def test_an_error_in_a_thread_reaches_the_caller(two_cores):
    def work(begin, end):
        if begin > 0:
            raise ZeroDivisionError(begin)
        return -1

    with pytest.raises(ZeroDivisionError):
        threads.in_parts(POSES, work)


def test_the_measures_of_one_pose_are_a_frozen_record_like_those_of_a_batch():
    robot = robot_of('ur5e')
    q = np.array([0.3, -1.2, 0.4, -0.5, 1.0, 0.1])
    found = ks.singularity(robot, q, q)
    batch = ks.singularity(robot, q[None], q[None])
    names = [field.name for field in dataclasses.fields(ks.Singularity)]
    assert [field.name for field in dataclasses.fields(found)] == names
    for name in names:
        value, whole = getattr(found, name), getattr(batch, name)
        if name not in ('generic_rank', 'factors'):
            assert np.array_equal(value, whole[0]), name
        assert value is getattr(found, name)  # taken once
    other = dataclasses.replace(found, distance=1.0)
    assert (other.distance, other.determinant) == (1.0, found.determinant)
    for twin in (copy.copy(found), copy.deepcopy(found), pickle.loads(pickle.dumps(found))):
        assert twin.distance == found.distance
        assert np.array_equal(twin.factors.estimates, found.factors.estimates)
    with pytest.raises(AttributeError):
        _ = found.nonsense
    with pytest.raises(ValueError, match='read-only'):
        found.way_out[0] = 1.0
