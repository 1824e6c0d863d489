# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The best posture of a redundant arm on the arc that its nearest one is on."""

import math

import numpy as np
import pytest
from arms import robot_of
from redundant_arms import poses_within, random_arm, redundant_arm

import kinematics_service as ks
from kinematics_service.kinematics.clearance import clearances
from kinematics_service.kinematics.inverse.problem.target import ik_target_of
from kinematics_service.kinematics.inverse.self_motion.best_posture import (
    COST_OF_DISTANCE,
    CRITERIA,
    best_posture,
    has_arcs,
    place_on_arc,
)

REACHED = 1e-12  # m and of a rotation's numbers, at arms of about 1 m
# Places on an arc are found to a billionth of a tenth of a rad.
PLACED = 1e-7
STEP = 0.1
ARMS = (
    ('panda', None, None),
    ('xarm7', None, None),
    ('RRPRRRR-0', None, None),
    ('RRRR', ('x', 'y', 'z'), None),
    ('puma560', None, 'y'),
    ('ur5e', None, 'x'),
)
arms = pytest.mark.parametrize(('name', 'rows', 'axis'), ARMS)
criteria = pytest.mark.parametrize('criterion', CRITERIA)


def arm_of(name):
    if name == 'RRRR':
        return random_arm(name, 4)
    return robot_of(name) if name in ('puma560', 'ur5e') else redundant_arm(name)


def target_at(robot, q, rows, axis):
    return ik_target_of(robot, ks.forward_kinematics(robot, q), rows, axis)


def off(robot, target, q):
    """Return how far the tool is from a target, in what counts of it."""
    T = ks.forward_kinematics(robot, q)
    away = [np.max(np.abs(T[:3, 3] - target.pose[:3, 3]))]
    if target.axis:
        k = 'xyz'.index(target.axis)
        away.append(np.max(np.abs(T[:3, k] - target.pose[:3, k])))
    elif len(target.rows) == 6:
        away.append(np.max(np.abs(T - target.pose)))
    return max(away)


def distance(arc, a, b):
    return float(np.linalg.norm((a - b) / arc.scales))


def value_of(robot, criterion, q):
    if criterion == 'clearance':
        return float(clearances(robot, q[None].copy())[0])
    return float(np.min([q - robot.limits[:, 0], robot.limits[:, 1] - q]))


@pytest.mark.slow
@criteria
@arms
def test_the_best_posture_of_the_arc_is_the_best_of_its_samples(name, rows, axis, criterion):
    robot = arm_of(name)
    for q in poses_within(robot, 1, seed=8):
        target = target_at(robot, q, rows, axis)
        arc, s = place_on_arc(robot, target, q)
        assert distance(arc, arc.at(s), q) < PLACED
        best = best_posture(robot, target, q, criterion, math.inf)
        assert off(robot, target, best.q) < REACHED
        assert np.all(best.q >= robot.limits[:, 0] - PLACED)
        assert np.all(best.q <= robot.limits[:, 1] + PLACED)
        values = [value_of(robot, criterion, one) for one in arc.q]
        found = value_of(robot, criterion, best.q)
        # Of clearance some samples alone are looked at; what is farther has to be better.
        slack = 0.05 * max(values) if criterion == 'clearance' else 0.0
        slack += COST_OF_DISTANCE * arc.length
        assert max(values) - slack < found
        assert found > value_of(robot, criterion, q) - slack
        assert best.left == 0.0


@pytest.mark.slow
@criteria
@arms
def test_an_answer_is_no_farther_along_the_arc_than_asked(name, rows, axis, criterion):
    robot = arm_of(name)
    for q in poses_within(robot, 1, seed=9):
        target = target_at(robot, q, rows, axis)
        whole = best_posture(robot, target, q, criterion, math.inf)
        best = best_posture(robot, target, q, criterion, STEP)
        assert off(robot, target, best.q) < REACHED
        assert distance(best.arc, best.q, q) < STEP + PLACED
        if best.left == 0.0:
            assert distance(best.arc, best.q, whole.q) < PLACED
        # Asked again from there, and again, it comes to the best.
        for _ in range(60):
            if best.left == 0.0:
                break
            best = best_posture(robot, target, best.q, criterion, 0.5)
        assert best.left == 0.0
        least = value_of(robot, criterion, whole.q)
        assert value_of(robot, criterion, best.q) > (
            0.9 * least if criterion == 'clearance' else least - 1e-2
        )


def test_round_a_closed_arc_the_shorter_way_is_taken():
    robot = arm_of('RRRR')
    q = poses_within(robot, 5, seed=8)[4]
    target = target_at(robot, q, ('x', 'y', 'z'), None)
    arc, _ = place_on_arc(robot, target, q)
    assert arc.closed
    starts = np.linspace(0.0, arc.length, 8, endpoint=False)
    left = [best_posture(robot, target, arc.at(s), 'margin', 0.0).left for s in starts]
    assert 0.3 * arc.length < max(left) <= 0.5 * arc.length


@pytest.mark.slow
@pytest.mark.parametrize(
    ('name', 'criterion'), [('panda', 'clearance'), ('kuka_iiwa14', 'margin')]
)
def test_answers_along_a_path_do_not_jump(name, criterion):
    robot = arm_of(name)
    q, other = poses_within(robot, 2, seed=3)
    path = [q + 0.002 * k * (other - q) for k in range(30)]
    here, moves = path[0], []
    for k, one in enumerate(path[1:]):
        asked = ks.forward_kinematics(robot, one)
        found = ks.inverse_kinematics(robot, asked, near=here, curves=False)
        near = found.families[0].q
        best = best_posture(robot, ik_target_of(robot, asked), near, criterion, STEP)
        assert off(robot, ik_target_of(robot, asked), best.q) < REACHED, k
        # From the nearest posture by the step at most; that one is as near as the path moves.
        assert distance(best.arc, best.q, near) < STEP + PLACED
        moves.append(distance(best.arc, best.q, here))
        here = best.q
    assert max(moves) < STEP + 0.05


def test_a_posture_at_a_limit_is_on_the_arc_that_begins_there():
    robot = arm_of('panda')
    q = poses_within(robot, 1, seed=5)[0]
    arc, _ = place_on_arc(robot, target_at(robot, q, None, None), q)
    for end, place in zip(arc.ends, (0.0, arc.length)):
        at = arc.at(place)
        j = robot.joint_names.index(end.joint)
        assert min(np.abs(robot.limits[j] - at[j])) < PLACED
        best = best_posture(robot, target_at(robot, at, None, None), at, 'margin', STEP)
        assert distance(arc, best.q, at) == pytest.approx(STEP, abs=0.01)
        assert value_of(robot, 'margin', best.q) > 0.0


def test_a_singular_posture_has_no_arc():
    robot = arm_of('kuka_iiwa14')
    # Stretched: the tool is at the edge of the reach, and the elbow straight.
    q = np.array([0.4, 0.5, 0.0, 0.0, 0.0, 0.0, 0.3])
    assert best_posture(robot, target_at(robot, q, None, None), q, 'margin', STEP) is None


def test_an_arm_without_a_joint_more_has_no_arcs():
    robot = robot_of('ur5e')
    q = poses_within(robot, 1)[0]
    assert not has_arcs(robot, robot.singularity.task.rows, '')
    assert has_arcs(robot, ('x', 'y', 'z'), 'z')
    assert best_posture(robot, target_at(robot, q, None, None), q, 'margin', STEP) is None
