# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""All postures of arms with one joint more than their target asks for: found, cut at limits."""

import functools
import math
import re
from dataclasses import replace

import general_arms
import mpmath
import numpy as np
import pytest
import redundant_arms
from redundant_arms import (
    BUNDLED,
    CALIBRATED,
    RANDOM,
    SLIDING,
    farthest_from_curves,
    in_a_slice,
    missed,
    poses_within,
    random_arm,
    redundant_arm,
)

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.kinematics.inverse.problem.target import ik_target_of
from kinematics_service.kinematics.inverse.self_motion import sliced_arm
from kinematics_service.robot.robot import build_robot

ARMS = (*BUNDLED, *CALIBRATED, *RANDOM, *SLIDING)
REACHED = 1e-12  # m and of a rotation's numbers, at arms of about 1 m
AT_LIMIT = 1e-9
ON_ARC = 1e-6
# Slices a test takes: attacks with 2,000 are made by hand.
SLICES = np.linspace(-math.pi, math.pi, 45, endpoint=False) + 0.013


@functools.cache
def target_and_result(name, k=0, **asked):
    robot = redundant_arm(name)
    q = poses_within(robot, k + 1)[k]
    target = ks.forward_kinematics(robot, q)
    return robot, q, target, ks.inverse_kinematics(robot, target, **asked)


def assert_arcs_are_true(robot, target, result):
    for family in result.families:
        for arc in family.intervals:
            for q in [*arc.q[::5], arc.at(0.37 * arc.length)]:
                assert np.max(np.abs(ks.forward_kinematics(robot, q) - target)) < REACHED
            margins = arc.margins()
            assert margins.min() > -AT_LIMIT
            assert np.max(np.abs(np.diff(arc.q, axis=0))) < 0.2
            if arc.closed:
                assert not arc.ends
            for end, q in zip(arc.ends, (arc.q[0], arc.q[-1])):
                if end.limit == 'singular':
                    continue
                j, side = robot.joint_names.index(end.joint), ('lower', 'upper').index(end.limit)
                assert abs(q[j] - robot.limits[j, side]) < AT_LIMIT


@pytest.mark.parametrize('name', ARMS)
def test_the_tool_stays_along_every_arc_and_the_limits_end_it(name):
    # One with a joint that slides takes as long as three others.
    for k in range(1 if name in SLIDING else 2):
        robot, q, target, result = target_and_result(name, k)
        assert result.status == 'solved'
        assert result.complete == 'found'
        assert_arcs_are_true(robot, target, result)
        assert farthest_from_curves(robot, result, q) < ON_ARC


@pytest.mark.slow
@pytest.mark.parametrize('name', ['panda', 'kinova_gen3', 'xarm7', *RANDOM[:2], 'RRPRRRR-0'])
def test_dense_slices_have_no_solution_that_is_on_no_arc(name):
    robot, _, target, result = target_and_result(name)
    assert not missed(robot, target, result, SLICES, redundant_arms.held_by(robot))


@pytest.mark.parametrize('held', [0, -1])
@pytest.mark.parametrize('name', [*BUNDLED, 'RRRRRRR-0'])
def test_the_slice_through_a_posture_has_it(name, held):
    robot = redundant_arm(name)
    for q in poses_within(robot, 3):
        found = in_a_slice(robot, ks.forward_kinematics(robot, q), float(q[held]), held)
        turned = (found - q) / math.tau
        assert np.abs(turned - np.round(turned)).max(axis=1).min() < 1e-9


def test_the_first_posture_is_the_nearest():
    robot, q, _, result = target_and_result('kuka_iiwa14')
    near = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q), near=q)
    assert np.max(np.abs(near.families[0].q - q)) < ON_ARC
    away = [np.linalg.norm(family.q - q) for family in near.families]
    assert away == sorted(away)
    middle = robot.limits.mean(axis=1)
    everywhere = np.vstack([arc.q for family in result.families for arc in family.intervals])
    least = np.min(np.linalg.norm(everywhere - middle, axis=1))
    assert np.linalg.norm(result.families[0].q - middle) < least + 1e-9


@pytest.mark.parametrize('name', ['xarm7', 'kinova_gen3'])
def test_the_first_posture_is_on_the_turns_of_near(name):
    robot = redundant_arm(name)
    q = np.clip([5.0, 0.3, -0.5, 0.9, 5.0, 0.4, 0.2], *robot.limits.T)
    result = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q), near=q)
    arc = min(result.families[0].intervals, key=lambda one: np.max(np.abs(one.nearest_to(q) - q)))
    assert np.max(np.abs(arc.nearest_to(q) - q)) < ON_ARC
    assert np.max(np.abs(result.families[0].q - q)) < ON_ARC
    for one in (arc for family in result.families for arc in family.intervals):
        for at, end in zip((one.q[0], one.q[-1]), one.ends):
            if end.limit != 'singular':
                j = robot.joint_names.index(end.joint)
                assert abs(at[j] - robot.limits[j, int(end.limit == 'upper')]) < AT_LIMIT


def test_the_best_postures_of_an_arc_are_no_worse_than_its_samples():
    robot, q, _, result = target_and_result('panda')
    arc = result.families[0].intervals[0]
    best = arc.with_largest_margin()
    assert np.min([best - arc.limits[:, 0], arc.limits[:, 1] - best]) >= arc.margins().max()
    nearest = arc.nearest_to(q)
    assert np.linalg.norm(nearest - q) <= np.linalg.norm(arc.q - q, axis=1).min() + 1e-12
    clear = arc.with_largest_clearance(robot)
    assert any(np.array_equal(clear, one) for one in arc.q)
    assert np.all(arc.ranges[:, 0] < best + 1e-12)
    assert np.all(best < arc.ranges[:, 1] + 1e-12)


def test_the_nearest_posture_of_a_closed_arc_may_be_where_it_closes():
    free = random_arm('RRRRRRR', 0, (-math.inf, math.inf))
    target, arcs = closed_curves()
    for arc in arcs:
        step = 0.4 * float(arc.s[1])
        lap = arc.q[-1] - arc.q[0]
        assert np.max(np.abs(arc.at(arc.length + step) - arc.at(step) - lap)) < REACHED
        for s in (-0.4 * arc.s[1], 0.4 * arc.s[1], arc.length + 0.4 * arc.s[1]):
            q = arc.at(float(s))
            assert np.max(np.abs(ks.forward_kinematics(free, q) - target)) < REACHED
            assert np.max(np.abs(arc.nearest_to(q) - q)) < ON_ARC


@pytest.mark.parametrize(('name', 'k'), [('fr3', 110), ('xarm7', 70)])
def test_the_nearest_posture_is_found_where_a_joint_turns_at_the_first_sample(name, k):
    # The end of a joint's range there was a place twice: at the end of a lap, and at its begin.
    robot = redundant_arm(name)
    target = ks.forward_kinematics(robot, poses_within(robot, k + 1, 7)[k])
    for family in ks.inverse_kinematics(robot, target).families:
        for arc in family.intervals:
            assert np.diff(arc.s).min() > 0.0
            for s in np.linspace(0.0, arc.length, 40):
                q = arc.at(float(s))
                assert np.max(np.abs(arc.nearest_to(q) - q)) < ON_ARC


@functools.cache
def closed_curves(k=0):
    """Return a target that arms without limits have closed curves at, and the arcs of these."""
    free = random_arm('RRRRRRR', 0, (-math.inf, math.inf))
    target = ks.forward_kinematics(free, poses_within(random_arm('RRRRRRR', 0), k + 1, 5)[k])
    families = ks.inverse_kinematics(free, target).families
    assert all(len(one.intervals) == 1 and one.intervals[0].closed for one in families)
    return target, [one.intervals[0] for one in families]


@functools.cache
def dense_samples(k=0, count=3000):
    """Return postures (count, n) of each closed curve at a target."""
    return [
        np.array([arc.at(s) for s in np.linspace(0.0, arc.length, count, endpoint=False)])
        for arc in closed_curves(k)[1]
    ]


def inside_by_samples(q, limits):
    """Return how many arcs of a closed curve's dense samples are inside limits, no turns told."""
    wrapped = q - math.tau * np.floor((q - limits[0]) / math.tau)
    inside = np.all(wrapped <= limits[1], axis=1)
    return int(np.count_nonzero(inside & ~np.roll(inside, 1)))


@pytest.mark.parametrize(('limits', 'k'), [((-1.9, 1.9), 1), ((-1.0, 2.9), 1)])
def test_limits_cut_curves_into_as_many_arcs_as_dense_samples(limits, k):
    robot = random_arm('RRRRRRR', 0, limits)
    result = ks.inverse_kinematics(robot, closed_curves(k)[0], respect_limits=False)
    expected = sorted(inside_by_samples(q, limits) for q in dense_samples(k))
    assert sorted(len(family.intervals) for family in result.families) == expected


def test_limits_cut_one_curve_into_five_arcs():
    target, _ = closed_curves()
    cut = [
        (limits, counts)
        for limits in [(-x, x) for x in np.arange(1.2, 3.1, 0.1).tolist()]
        if max(counts := [inside_by_samples(q, limits) for q in dense_samples()]) >= 5
    ]
    assert cut
    for limits, counts in cut[::3]:
        robot = random_arm('RRRRRRR', 0, limits)
        result = ks.inverse_kinematics(robot, target, respect_limits=False)
        found = sorted(len(family.intervals) for family in result.families)
        assert found == sorted(counts)
        assert_arcs_are_true(robot, target, result)


def folds_of(robot, position):
    """Return how often joint 1 turns round along all curves."""
    families = ks.inverse_kinematics(robot, position).families
    paths = [arc.q[:, 0] for one in families for arc in one.intervals]
    return sum(np.count_nonzero(np.diff(np.sign(np.diff(path)))) for path in paths)


def test_where_two_folds_become_one_nothing_is_missed():
    # A curve turns round twice more on one side of such a target: a fold of higher order between.
    robot = random_arm('RRRR', 3, (-math.inf, math.inf))
    ends = [ks.forward_kinematics(robot, q)[:3, 3] for q in poses_within(robot, 5)]
    met = 0
    for a, b in zip(ends, ends[1:]):
        counts = [folds_of(robot, a), folds_of(robot, b)]
        if counts[0] == counts[1]:
            continue
        low, high = 0.0, 1.0
        for _ in range(30):
            middle = 0.5 * (low + high)
            if folds_of(robot, a + middle * (b - a)) == counts[0]:
                low = middle
            else:
                high = middle
        for share in (low, high, low - 1e-6, high + 1e-6):
            position = a + share * (b - a)
            result = ks.inverse_kinematics(robot, position)
            assert not missed(robot, position, result, SLICES, 0, rows=('x', 'y', 'z'))
            met += 1
    assert met


def test_a_limit_that_a_curve_only_touches_does_not_end_it():
    target, arcs = closed_curves()
    arc = min(arcs, key=lambda one: float(np.ptp(one.q[:, 2])))
    low, high = arc.ranges[2]
    assert high - low < 6.0
    for beyond, closed in ((1e-9, True), (-1e-4, False)):
        limits = [(-math.inf, math.inf)] * 7
        limits[2] = (float(low - 0.1), float(high + beyond))
        robot = random_arm('RRRRRRR', 0, limits)
        result = ks.inverse_kinematics(robot, target, near=arc.q[0])
        same = min(result.families, key=lambda one: np.linalg.norm(one.q - arc.q[0]))
        assert [one.closed for one in same.intervals] == [closed]
        if not closed:
            assert same.intervals[0].ends == (
                ks.IkArcEnd('j3', 'upper'),
                ks.IkArcEnd('j3', 'upper'),
            )


def assert_all_turns_are_counted(robot, result, q):
    """Check that a posture is on as many arcs as it has full turns inside the limits."""
    low, high = robot.limits.T
    first, last = np.ceil((low - q) / math.tau), np.floor((high - q) / math.tau)
    count = 0
    for family in result.families:
        for arc in family.intervals:
            away = arc.q - q
            away -= math.tau * np.round(away / math.tau)
            near = np.max(np.abs(away), axis=1) < 0.2
            for k in np.flatnonzero(near & ~np.roll(near, 1)):
                local = arc.nearest_to(q + math.tau * np.round((arc.q[k] - q) / math.tau))
                turned = (local - q) / math.tau
                if np.max(np.abs(turned - np.round(turned))) < 1e-6:
                    count += arc.windings
    assert count == int(np.prod(last - first + 1))


def test_limits_wider_than_a_turn_wind_the_arcs():
    robot = random_arm('RRRRRRR', 0, (-1.5 * math.pi, 1.5 * math.pi))
    target = ks.forward_kinematics(robot, poses_within(robot, 1, 5)[0])
    result = ks.inverse_kinematics(robot, target)
    arcs = [arc for family in result.families for arc in family.intervals]
    assert max(arc.windings for arc in arcs) > 1
    assert_all_turns_are_counted(robot, result, arcs[0].at(0.5 * arcs[0].length))


def test_a_joint_that_makes_a_whole_turn_a_lap_goes_on_lap_by_lap():
    # The last link is short: it turns round, and the others follow.
    robot = ks.robot_from_text("""\
robot: winding
convention: standard
joints:
  - {name: q1, type: revolute}
  - {name: q2, type: revolute}
  - {name: q3, type: revolute}
  - {name: q4, type: revolute, limits: [-1.5*pi, 1.5*pi]}
links:
  - {a: 0.1, alpha: 1.2, d: 0.2, theta: q1}
  - {a: 0.5, alpha: 0.3, d: 0.1, theta: q2}
  - {a: 0.4, alpha: -0.9, d: 0.1, theta: q3}
  - {a: 0.05, alpha: 0, d: 0, theta: q4}
""")
    target = ks.forward_kinematics(robot, [0.3, -0.5, 1.1, 0.4])[:3, 3]
    result = ks.inverse_kinematics(robot, target)
    assert result.complete == 'found'
    assert len(result.families) == 2
    for family in result.families:
        (arc,) = family.intervals
        assert set(arc.ends) == {ks.IkArcEnd('q4', 'lower'), ks.IkArcEnd('q4', 'upper')}
        ends = np.sort(arc.q[[0, -1], 3])
        np.testing.assert_allclose(ends, robot.limits[3], rtol=0, atol=AT_LIMIT)
        positions = ks.forward_kinematics(robot, arc.q)[:, :3, 3]
        assert np.max(np.abs(positions - target)) < REACHED


@pytest.mark.parametrize('name', BUNDLED[:3])
def test_singular_targets_have_arcs(name):
    robot = redundant_arm(name)
    q = poses_within(robot, 1)[0]
    # Axes 1 and 3, and 5 and 7, are one where the joint between them is at zero.
    for zero in ((1,), (1, 5)) if name == 'kuka_iiwa14' else ((1,),):
        q[list(zero)] = 0.0
        result = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q), near=q)
        assert result.complete == 'found'
        assert result.families
        assert_arcs_are_true(robot, ks.forward_kinematics(robot, q), result)


@pytest.mark.parametrize('k', [5, 11])
def test_curves_go_on_beyond_where_they_cross(k):
    # Axes 1 and 3 are one: q1 + q3 = const is a curve, and crosses the others.
    robot = redundant_arm('kuka_iiwa14')
    q = poses_within(robot, k + 1, 9)[k]
    q[1] = 0.0
    target = ks.forward_kinematics(robot, q)
    result = ks.inverse_kinematics(robot, target, near=q)
    assert not missed(robot, target, result, SLICES, 0)
    assert not missed(robot, target, result, SLICES, -1)


@pytest.mark.parametrize('name', ['panda', 'kuka_iiwa14'])
@pytest.mark.parametrize('share', [1e-2, 1e-3, 1e-4])
def test_curves_that_nearly_meet_stay_apart(name, share):
    # Beside a target at which two curves cross, no step leads from one to the other.
    robot = redundant_arm(name)
    q = poses_within(robot, 1)[0]
    q[1] = share
    target = ks.forward_kinematics(robot, q)
    result = ks.inverse_kinematics(robot, target, near=q)
    assert farthest_from_curves(robot, result, q) < ON_ARC
    assert_arcs_are_true(robot, target, result)
    assert not missed(robot, target, result, SLICES, -1)


def test_small_curves_are_found():
    # Near the end of the arm's reach what is left of a curve is small, or nothing.
    robot = random_arm('RRRRRRR', 1, (-math.inf, math.inf))
    # So far outwards, as shares of its length, a target has a curve left, and here none.
    for seed, low, high in ((0, 1.6438520, 1.6456343), (1, 2.2800620, 2.2824190)):
        q = np.random.default_rng(seed).uniform(-math.pi, math.pi, 7)
        target = ks.forward_kinematics(robot, q)
        assert not ks.inverse_kinematics(robot, scaled(target, high)).families
        target = scaled(target, low)
        result = ks.inverse_kinematics(robot, target)
        (length,) = (arc.length for family in result.families for arc in family.intervals)
        assert length < 1.5
        assert not missed(robot, target, result, SLICES[::2], -1)


def scaled(target, share):
    moved = target.copy()
    moved[:3, 3] *= share
    return moved


def test_what_cannot_be_reached_has_no_curves():
    robot = redundant_arm('panda')
    target = ks.forward_kinematics(robot, poses_within(robot, 1)[0])
    target[:3, 3] += 3.0
    result = ks.inverse_kinematics(robot, target)
    assert (result.status, result.families) == ('unreachable', ())


# Fewer rows than a pose has.


def test_four_joints_for_a_position():
    robot = random_arm('RRRR', 3)
    for q in poses_within(robot, 2):
        target = ks.forward_kinematics(robot, q)[:3, 3]
        result = ks.inverse_kinematics(robot, target)
        assert result.status == 'solved'
        assert result.complete == 'found'
        for family in result.families:
            for arc in family.intervals:
                for one in arc.q[::7]:
                    at = ks.forward_kinematics(robot, one)[:3, 3]
                    assert np.max(np.abs(at - target)) < REACHED
        assert farthest_from_curves(robot, result, q) < ON_ARC
        asked = {'rows': ('x', 'y', 'z')}
        assert not missed(robot, target, result, SLICES, 0, **asked)


@pytest.mark.filterwarnings('error')
def test_complex_positions_that_are_kilometres_apart_are_no_warning():
    # Two sliding joints carry a length of 20 km: their complex positions are as far apart.
    robot = ks.robot_from_text("""\
robot: far
convention: standard
joints:
  - {name: q1, type: revolute}
  - {name: q2, type: revolute}
  - {name: q3, type: prismatic}
  - {name: q4, type: prismatic}
links:
  - {a: 0.3, alpha: 0.7, d: 0.1, theta: q1}
  - {a: 0.2, alpha: 1.1, d: 0.4, theta: q2}
  - {a: 20000, alpha: 0.9, d: q3, theta: 0.3}
  - {a: 0.1, alpha: 0.5, d: q4, theta: 0.8}
""")
    target = ks.forward_kinematics(robot, [0.3, -0.4, 2.1, -2.6])[:3, 3]
    assert ks.inverse_kinematics(robot, target).families


@pytest.mark.parametrize('name', ['ur5e', 'puma560'])
def test_six_joints_for_a_direction(name):
    robot = ks.load_robot(name)
    for q in poses_within(robot, 1):
        target = ks.forward_kinematics(robot, q)
        result = ks.inverse_kinematics(robot, target, axis='x')
        assert result.status == 'solved'
        for family in result.families:
            for arc in family.intervals:
                for one in arc.q[::9]:
                    T = ks.forward_kinematics(robot, one)
                    assert np.max(np.abs(T[:3, [0, 3]] - target[:3, [0, 3]])) < REACHED
        assert farthest_from_curves(robot, result, q) < ON_ARC


@pytest.mark.parametrize(
    ('name', 'q'),
    [
        # Two joints are at a limit: the curve goes through a corner.
        ('panda', [2.8973, 0.399, 2.8973, -1.399, 1.806, 3.107, -0.61]),
        ('panda', [-0.578, 1.342, -1.817, -3.0718, -2.8973, 2.407, 1.03]),
        ('panda', [0.768, -1.288, 0.933, -0.0698, 0.861, -0.0175, 0.827]),
        # The elbow is at a limit, and stands still while the others move.
        ('kuka_iiwa14', [1.975, 0.297, 2.231, math.radians(120), 1.951, 0.354, -2.269]),
        ('kuka_iiwa14', [-1.133, -1.121, -0.787, -math.radians(120), -1.546, 1.871, 0.868]),
        # It comes to the limit from beyond, and goes back.
        ('panda', [0.616, 1.326, 2.305, -0.0698, -math.pi / 2, 1.749, 2.86]),
        ('xarm7', [-0.561, 0.211, 2.262, -0.19198, -math.pi / 2, 1.606, -1.655]),
        # There another one passes its limit.
        ('kuka_iiwa14', [0.543, -math.radians(120), -1.793, 1.238, 0, -math.radians(120), -0.638]),
        ('xarm7', [-0.593, 1.41, 0.407, 3.372, math.tau, -1.69297, -0.647]),
    ],
)
def test_a_posture_at_limits_is_on_an_arc(name, q):
    robot = ks.load_robot(name)
    result = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q), near=q)
    assert (result.status, result.complete) == ('solved', 'found')
    arcs = [arc for family in result.families for arc in family.intervals]
    # Of arcs that differ by full turns one is there.
    ways = [np.remainder(one.q - q + math.pi, math.tau) - math.pi for one in arcs]
    away = [np.min(np.max(np.abs(way), axis=1)) for way in ways]
    k = int(np.argmin(away))
    arc, row = arcs[k], int(np.argmin(np.max(np.abs(ways[k]), axis=1)))
    turned = q + math.tau * np.round((arc.q[row] - q) / math.tau)
    np.testing.assert_allclose(arc.nearest_to(turned), turned, rtol=0, atol=1e-7)
    low, high = np.array(robot.limits).T
    at = np.vstack([arc.q, arc.at(0.5 * arc.length)])
    assert np.all((at >= low - 1e-9) & (at <= high + 1e-9))
    target = ks.forward_kinematics(robot, q)
    for one in at:
        np.testing.assert_allclose(ks.forward_kinematics(robot, one), target, atol=1e-11)


def exactly(screws, goal, t):
    """Return the solution that Newton leads to from complex angles (6,), in forty digits."""
    axes = [mpmath.matrix(axis.tolist()) for axis in screws.axes]
    points = [mpmath.matrix(point.tolist()) for point in screws.points]
    R_goal = mpmath.matrix(goal[:3, :3].tolist())
    p_goal = mpmath.matrix(goal[:3, 3].tolist())

    def cross(a, b):
        i, j = (1, 2, 0), (2, 0, 1)
        return mpmath.matrix([a[i[k]] * b[j[k]] - a[j[k]] * b[i[k]] for k in range(3)])

    for _ in range(6):
        R, p, moved = mpmath.eye(3), mpmath.matrix(3, 1), []
        for axis, point, angle in zip(axes, points, t):
            z, o = R * axis, R * point + p
            moved.append((z, o))
            columns = [
                row * mpmath.cos(angle)
                + cross(axis, row) * mpmath.sin(angle)
                + axis * (axis.T * row)[0] * (1 - mpmath.cos(angle))
                for row in (mpmath.matrix([i == k for i in range(3)]) for k in range(3))
            ]
            E = mpmath.matrix(3, 3)
            for k, column in enumerate(columns):
                E[:, k] = column
            R = R * E
            p = o - R * point
        J, left = mpmath.matrix(6, 6), mpmath.matrix(6, 1)
        S = R_goal * R.T
        for k, (z, o) in enumerate(moved):
            J[:3, k], J[3:, k] = cross(z, p - o), z
        left[:3, 0] = p_goal - p
        for k in range(3):
            a, b = (k + 2) % 3, (k + 1) % 3
            left[3 + k] = (S[a, b] - S[b, a]) / 2
        step = mpmath.lu_solve(J, left)
        t = [x + y for x, y in zip(t, step)]
        if max(abs(x) for x in step) < 1e-30:
            break
    else:
        pytest.fail('Newton does not converge')
    # Axes and goal are of unit length and orthogonal to round-off, which far angles enlarge.
    assert max(abs(x) for x in (R - R_goal)) < 1e-6
    return t


def test_complex_solutions_far_from_real_ones_are_certified_each_once():
    robot = redundant_arm('panda-calibrated')
    arm = sliced_arm.sliced(sliced_arm.sliced_arm_of(robot, redundant_arms.WHOLE, ''), 0)
    target = ik_target_of(robot, ks.forward_kinematics(robot, poses_within(robot, 1, 7)[0]))
    goal = arm.motion_of_six(target.pose, 1.7)
    solutions = np.empty((kernel.MAX_CANDIDATES, 6, 2))
    count = kernel.complex_solutions(arm.six.form, goal.copy(), solutions, np.empty(3))
    solutions = solutions[:count]
    assert count == 16
    assert np.sum(np.abs(solutions[:, :, 1]).max(axis=1) > 7.0) == 4
    screws = replace(arm.screws, axes=arm.screws.axes[1:], points=arm.screws.points[1:])
    with mpmath.workdps(40):
        found = []
        for one in solutions:
            t = exactly(screws, goal, [mpmath.mpc(*angle) for angle in one])
            there = np.array([complex(x) for x in t])
            assert np.max(np.abs(there - (one[:, 0] + 1j * one[:, 1]))) < 1e-6
            found.append(np.exp(1j * there))
    away = np.array([[np.max(np.abs(a - b)) for a in found] for b in found])
    assert np.min(away + 1e3 * np.eye(len(found))) > 1e-3


def test_the_joint_at_its_limit_is_named_where_another_is_a_turn_from_one():
    # Limits are a turn from 0, so that joints 1 and 7 come to limits, or to 0, at one place.
    robot = ks.load_robot('xarm7')
    target = ks.forward_kinematics(robot, [0.0, 0.3, -0.5, 0.9, 0.6, 0.4, 0.0])
    result = ks.inverse_kinematics(robot, target)
    assert_arcs_are_true(robot, target, result)
    ends = [end.joint for f in result.families for arc in f.intervals for end in arc.ends]
    assert {'joint1', 'joint7'} <= set(ends)


@pytest.mark.parametrize('width', [1e-8, 1e-9, 1e-12])
def test_a_posture_between_limits_that_nearly_meet_is_on_an_arc(width):
    robot, random = ks.load_robot('kuka_iiwa14'), np.random.default_rng(7)
    for joints in ((0,), (1, 6), (3, 4)):
        q = random.uniform(*robot.limits.T)
        own = list(robot.description.joints)
        for j in joints:
            own[j] = replace(own[j], lower=float(q[j]), upper=float(q[j]) + width)
        narrow = build_robot(replace(robot.description, joints=tuple(own)))
        found = ks.inverse_kinematics(narrow, ks.forward_kinematics(robot, q), near=q)
        arcs = [arc for family in found.families for arc in family.intervals]
        assert min(np.linalg.norm(arc.nearest_to(q) - q) for arc in arcs) < 1e-6


@pytest.mark.parametrize('seed', [4, 44, 133])
def test_a_singular_posture_between_narrow_limits_is_listed(seed):
    # The arm is stretched: Newton's method ends 1e-8 rad beside postures of its curves.
    robot, random = ks.load_robot('kuka_iiwa14'), np.random.default_rng(seed)
    q = random.uniform(*robot.limits.T)
    q[3] = 0.0
    own = [
        replace(one, lower=float(x) - (4e-9 if k == 5 else 1e-7), upper=float(x) + 1e-7)
        for k, (one, x) in enumerate(zip(robot.description.joints, q))
    ]
    narrow = build_robot(replace(robot.description, joints=tuple(own)))
    found = ks.inverse_kinematics(narrow, ks.forward_kinematics(narrow, q), near=q)
    assert found.status in ('solved', 'family')
    assert all(family.feasible for family in found.families)
    assert min(np.linalg.norm(family.q - q) for family in found.families) < ON_ARC


@pytest.mark.parametrize('seed', [2, 6, 10])
def test_a_curve_that_closes_in_one_direction_alone_reaches_the_target_everywhere(seed):
    # The arm is stretched: a curve ends at a singular pose in one direction, and closes in the
    # other.
    robot = ks.load_robot('kuka_iiwa14')
    q = np.random.default_rng(seed).uniform(*robot.limits.T)
    q[3] = 0.0
    target = ks.forward_kinematics(robot, q)
    found = ks.inverse_kinematics(robot, target, near=q)
    curves = [arc.curve for family in found.families for arc in family.intervals]
    assert curves
    for curve in curves:
        poses = ks.forward_kinematics(robot, curve.q)
        np.testing.assert_allclose(poses, [target] * len(poses), rtol=0, atol=REACHED)
        # It comes back to its first sample if it is closed, and only then.
        away = curve.q[1:] - curve.q[0]
        away -= math.tau * np.round(away / math.tau)
        assert curve.closed == (np.abs(away).max(axis=1).min() < ON_ARC)


def test_the_step_that_closes_a_curve_leaves_no_bend_out():
    # Beside a singular pose: a sharp bend lies between the sample where curves are closed too
    # early and the first one.
    robot = redundant_arm('fr3')
    q = poses_within(robot, 68, 7)[67]
    found = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q))
    curves = {arc.curve for family in found.families for arc in family.intervals}
    for curve in curves:
        # The longest step, 0.125 rad, and its largest correction.
        assert np.linalg.norm(np.diff(curve.q, axis=0), axis=1).max() < 0.13
    # Two of them once were one, traced from two seeds.
    assert len(curves) == 4


def test_a_plane_arm_with_two_joints_more_has_no_curves():
    # On a rail in its plane: all postures of a position form a surface.
    rows = [(0.0, 0.5 * math.pi, 0.0, 0.0), *((one, 0.0, 0.0, 0.0) for one in (0.4, 0.4, 0.2))]
    limits = [(-1.0, 1.0), (-3.0, 3.0), (-3.0, 3.0), (-3.0, 3.0)]
    robot = ks.robot_from_text(general_arms.text_of('standard', rows, 'PRRR', limits))
    position = ks.forward_kinematics(robot, [-0.4, 0.97, 0.89, -1.13])[:3, 3]
    found = ks.inverse_kinematics(robot, position)
    (family,) = found.families
    assert (found.status, family.intervals) == ('family', ())
    assert family.motions.shape == (2, 4)
    assert family.joints == robot.joint_names


def test_a_direction_and_two_coordinates_are_no_target_of_arcs():
    robot = ks.load_robot('kuka_iiwa14')
    q = [0.3, 0.4, 0.5, 1.0, 0.2, 0.7, 0.1]
    target = ks.forward_kinematics(robot, q)
    found = ks.inverse_kinematics(robot, target, axis='z', rows=['x', 'y'])
    (family,) = found.families
    assert (found.status, family.motions.shape) == ('family', (3, 7))
    reached = ks.forward_kinematics(robot, family.q)
    np.testing.assert_allclose(reached[[0, 1], 3], target[[0, 1], 3], rtol=0, atol=REACHED)
    np.testing.assert_allclose(reached[:3, 2], target[:3, 2], rtol=0, atol=REACHED)


def test_a_posture_to_be_near_may_be_far_away():
    robot = ks.load_robot('kuka_iiwa14')
    target = ks.forward_kinematics(robot, [0.3, 0.4, 0.5, 1.0, 0.2, 0.7, 0.1])
    found = ks.inverse_kinematics(robot, target, near=[1e16, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert found.status == 'solved'


@pytest.mark.parametrize('degrees', [540.0, 900.0])
def test_limits_of_many_turns_are_counted(degrees):
    text = ks.bundled_robots()['kuka_iiwa14'].read_text(encoding='utf-8')
    limits = f'limits: [-{degrees}, {degrees}]'
    robot = ks.robot_from_text(re.sub(r'limits: \[[^]]*\]', limits, text))
    q = np.array([0.4, 0.7, -0.3, -1.2, 0.5, 0.9, -0.2])
    found = ks.inverse_kinematics(robot, ks.forward_kinematics(robot, q), near=q)
    assert (found.status, found.complete) == ('solved', 'found')
    arcs = [arc for family in found.families for arc in family.intervals]
    assert_all_turns_are_counted(robot, found, q)
    assert min(np.linalg.norm(arc.nearest_to(q) - q) for arc in arcs) < 1e-9
