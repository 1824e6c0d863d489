"""Paths of targets of redundant arms: no verdict that a joint path or a dense search refutes."""

import dataclasses
import math

import general_arms
import numpy as np
import pytest
from redundant_arms import in_a_slice, poses_within, random_arm, redundant_arm

import kinematics_service as ks
from kinematics_service.kinematics.family_paths import following, pieces

XYZ = ('x', 'y', 'z')
STEP = 0.2
N = 4


def position_arm():
    return random_arm('RRRR', 3)


def joint_paths(robot, count, seed=0, count_of_targets=N, step=0.19):
    """Return straight joint paths inside the limits that keep away from singular poses."""
    random, (low, high) = np.random.default_rng(seed), robot.limits.T
    scales = np.array(robot.task.column_scales)
    paths = []
    while len(paths) < count:
        way = random.uniform(-step, step, robot.dof) * scales
        q = random.uniform(low, high) + np.arange(count_of_targets)[:, None] * way
        inside = not np.any((q < low) | (q > high))
        if inside and kept(robot, q, 0.03):
            paths.append(q)
    return paths


def kept(robot, q, distance):
    check = ks.check_plan(robot, np.arange(len(q)), q, distance=distance)
    return check.singularity.verdict == 'proved'


def positions(robot, q):
    return ks.forward_kinematics(robot, q)[:, :3, 3]


def assert_it_follows(robot, targets, result, distance=0.03, step=STEP):
    assert result.verdict == 'yes', result
    q = result.path.q
    low, high = robot.limits.T
    assert np.all((q > low - 1e-6) & (q < high + 1e-6))
    steps = np.abs(np.diff(q, axis=0)) / robot.task.column_scales
    assert steps.max(initial=0.0) <= step
    T = ks.forward_kinematics(robot, q)
    at = T if targets.ndim == 3 else T[:, :3, 3]
    assert np.max(np.abs(at - targets)) < 1e-9
    assert kept(robot, q, distance)
    for one, arc, arcs in zip(q, result.path.arcs, result.arcs):
        away = (one - arcs[arc].q) / (2.0 * math.pi)
        away -= np.where(robot.prismatic, 0.0, np.round(away))
        assert np.min(np.max(np.abs(away), axis=1)) < 0.1


@pytest.mark.parametrize('seed', range(3))
def test_a_path_that_a_joint_path_made_is_followed(seed):
    robot = position_arm()
    for q in joint_paths(robot, 2, seed):
        targets = positions(robot, q)
        assert_it_follows(robot, targets, ks.follow_family(robot, targets))
        from_there = ks.follow_family(robot, targets, start=q[0])
        assert_it_follows(robot, targets, from_there)
        assert np.array_equal(from_there.path.q[0], q[0])


@pytest.mark.parametrize(
    'name',
    [
        'kuka_iiwa14',
        *(pytest.param(one, marks=pytest.mark.slow) for one in ('panda', 'RRPRRRR-0')),
    ],
)
def test_seven_joints_follow_a_path_of_poses(name):
    robot = redundant_arm(name)
    (q,) = joint_paths(robot, 1, 4, 3)
    targets = ks.forward_kinematics(robot, q)
    result = ks.follow_family(robot, targets, start=q[0])
    assert_it_follows(robot, targets, result)
    assert result.path.rotation_deviation < 0.1
    assert len(result.links) == 2


@pytest.mark.parametrize('side', [0, 1])
def test_a_joint_that_follows_along_its_limit_is_inside(side):
    robot = position_arm()
    for q in joint_paths(robot, 20, 9):
        q[:, 1] = robot.limits[1, side]
        if kept(robot, q, 0.03):
            assert_it_follows(
                robot, positions(robot, q), ks.follow_family(robot, positions(robot, q))
            )
            return
    raise AssertionError('no such path')


def test_a_target_out_of_reach_is_named():
    robot = position_arm()
    targets = positions(robot, joint_paths(robot, 1)[0])
    targets[2] += 9.0
    result = ks.follow_family(robot, targets)
    assert (result.verdict, result.target, result.path) == ('no', 2, None)
    assert 'm long' in result.reason


def test_a_target_that_needs_a_posture_beyond_the_limits_is_named():
    free, robot = random_arm('RRRR', 3, (-math.inf, math.inf)), position_arm()
    q = joint_paths(robot, 1)[0]
    for beyond in np.random.default_rng(2).uniform(2.05, 3.7, (60, 4)):
        target = positions(free, beyond[None])
        if dense(robot, target[0], 400):
            continue
        targets = np.vstack([positions(robot, q), target])
        result = ks.follow_family(robot, targets)
        assert (result.verdict, result.target) == ('no', N)
        assert 'beyond the limits' in result.reason
        return
    raise AssertionError('no such target')


def dense(robot, target, count=3000):
    """Return postures (m, n) inside the limits at a position, by slices of the first joint."""
    low, high = robot.limits.T
    found = [np.empty((0, robot.dof))]
    for value in np.linspace(low[0], high[0], count):
        q = in_a_slice(robot, target, float(value), 0, XYZ)
        q[:, 1:] += math.tau * np.ceil((low[1:] - q[:, 1:]) / math.tau)
        found.append(q[np.all((q >= low) & (q <= high), axis=1)])
    return np.vstack(found)[:, :] if len(found) > 1 and sum(map(len, found)) else []


def come_to(robot, layers, step):
    """Return the first target that no posture of dense ones comes to by steps; None if all are."""
    here = np.ones(len(layers[0]), dtype=bool)
    for k, (a, b) in enumerate(zip(layers, layers[1:]), 1):
        a = a[here]
        here = np.array([bool(np.any(np.max(np.abs(one - a), axis=1) <= step)) for one in b])
        if not here.any():
            return k
    return None


def test_where_no_is_said_a_dense_search_finds_no_path():
    robot, said = position_arm(), []
    random = np.random.default_rng(7)
    for q in joint_paths(robot, 12, 11, 3):
        # Steps that are too short for some of them.
        step = float(random.uniform(0.04, 0.15))
        targets = positions(robot, q)
        result = ks.follow_family(robot, targets, max_step=step, distance=1e-3)
        said.append(result.verdict)
        if result.verdict == 'yes':
            assert_it_follows(robot, targets, result, 1e-3, step)
        if result.verdict == 'no' and said.count('no') < 3:
            layers = [dense(robot, target, 300) for target in targets]
            end = come_to(robot, layers, step)
            assert end is not None
            assert end <= result.target
    assert said.count('no') > 1
    assert said.count('yes') > 1


def test_no_names_a_target_beyond_the_postures_that_were_left_out():
    # Three targets are come to by postures that lead no farther; what is left ends before.
    robot = position_arm()
    targets = positions(robot, joint_paths(robot, 1, 958157)[0])
    search = following._PathSearch.__new__(following._PathSearch)
    search.arcs, search.complete, search.links, search.left_out = [], [], (), 2
    assert search._refused(1).target == 3
    # Here what is left ends at target 1, and postures of targets 1 and 2 were left out.
    result = ks.follow_family(robot, targets, max_step=0.081, distance=1e-3)
    assert (result.verdict, result.target) == ('no', 3)


def test_postures_all_near_singular_are_refused_by_their_distance():
    robot = position_arm()
    targets = positions(robot, joint_paths(robot, 1)[0])
    result = ks.follow_family(robot, targets, distance=1.0)
    assert result.verdict != 'yes'
    if result.verdict == 'no':
        assert 'singular pose' in result.reason


def test_without_the_proof_of_all_arcs_no_is_not_said(monkeypatch):
    robot = position_arm()
    targets = positions(robot, joint_paths(robot, 1)[0])[::3]
    assert ks.follow_family(robot, targets, max_step=0.01).verdict == 'no'
    solve = following.inverse_kinematics

    def found(*asked, **named):
        return dataclasses.replace(solve(*asked, **named), complete='found')

    monkeypatch.setattr(following, 'inverse_kinematics', found)
    result = ks.follow_family(robot, targets, max_step=0.01)
    assert result.verdict == 'not decided'
    assert 'at target 0, 1' in result.reason


def test_an_arm_whose_arcs_are_not_known_is_not_decided():
    planar = ks.robot_from_text(
        general_arms.text_of('standard', [(0.4, 0.0, 0.0, 0.0)] * 4, 'RRRR', [(-2.5, 2.5)] * 4)
    )
    flat = ks.forward_kinematics(planar, [[0.3, 0.5, 0.4, 0.2], [0.4, 0.5, 0.4, 0.2]])
    result = ks.follow_family(planar, flat, rows=('x', 'y', 'rz'))
    assert result.verdict == 'not decided'
    flat[1, 0, 3] += 9.0
    assert ks.follow_family(planar, flat, rows=('x', 'y', 'rz')).verdict == 'no'


@pytest.mark.parametrize(
    'name',
    [
        'RRRR',
        'kuka_iiwa14',
        pytest.param('panda', marks=pytest.mark.slow),
    ],
)
def test_an_arc_leaves_the_chords_of_its_pieces_no_farther_than_is_proved(name):
    # The bound is for the motion of one joint: of some place on the chord it holds of all joints.
    robot = position_arm() if name == 'RRRR' else redundant_arm(name)
    T = ks.forward_kinematics(robot, poses_within(robot, 1)[0])
    result = ks.inverse_kinematics(robot, T if robot.dof == 7 else T[:3, 3])
    arcs = [arc for family in result.families for arc in family.intervals]
    parts = pieces.pieces_of(robot, arcs)
    halves = parts.halves(robot, arcs).halves(robot, arcs)
    random = np.random.default_rng(0)
    shares = []
    for k in random.choice(len(halves.arc), 300):
        a, b = halves.s[k]
        q = arcs[halves.arc[k]].at(a + random.uniform(0.4, 0.6) * (b - a))
        shares.append(farthest_share(q, halves, k))
    assert max(shares) <= 1.0 + 1e-9  # of the search for the place
    assert max(shares) > 0.2  # it is not wider than need be
    assert np.median(parts.spread[:, 0] / np.maximum(np.diff(parts.s)[:, 0], 1e-9)) < 0.1


def farthest_share(q, parts, k):
    """Return how far q is from the chord of a piece, in units of what is proved: convex."""
    a, b, widths = parts.begin[k], parts.end[k], parts.spread[k]

    def away(share):
        return float(np.max(np.abs(q - a - share * (b - a)) / widths))

    low, high = -0.2, 1.2
    for _ in range(80):
        x, y = low + (high - low) / 3.0, high - (high - low) / 3.0
        low, high = (low, y) if away(x) < away(y) else (x, high)
    return away(low)


@pytest.mark.parametrize('periods', [np.inf, math.tau])
def test_pairs_a_step_apart_are_all_pairs(periods):
    random = np.random.default_rng(3)
    rule = pieces.StepRule(np.array([1.0, 0.5, 1.0]), np.array([np.inf, np.inf, periods]), 0.3)

    def some(m):
        q = random.uniform(-3.0, 3.0, (m, 3))
        return pieces.ArcPieces(
            np.zeros(m, dtype=int),
            np.zeros((m, 2)),
            q,
            q + random.normal(0, 0.05, (m, 3)),
            random.uniform(0, 0.01, (m, 3)),
            q[:, 0],
        )

    a, b = some(300), some(400)
    (x, wide_x), (y, wide_y) = a.box(), b.box()
    way = y - x[:, None]
    if np.isfinite(periods):
        way[..., 2] = np.arctan2(np.sin(way[..., 2]), np.cos(way[..., 2]))
    near = np.all(np.abs(way) <= wide_x[:, None] + wide_y + 0.3 * rule.scales, axis=2)
    pairs = set(zip(*(one.tolist() for one in pieces.a_step_apart(a, b, rule))))
    assert pairs == set(zip(*(one.tolist() for one in np.nonzero(near))))


def test_what_means_nothing_is_refused():
    robot = position_arm()
    targets = positions(robot, joint_paths(robot, 1)[0])
    for wrong in (np.empty((0, 3)), 'x', 3.0, [[1.0, 2.0]], [[[np.nan] * 4] * 4]):
        with pytest.raises(ks.TargetError):
            ks.follow_family(robot, wrong)
    for asked in ({'max_step': 0.0}, {'max_step': 2.0}, {'distance': -1.0}):
        with pytest.raises(ks.PlanError):
            ks.follow_family(robot, targets, **asked)
    for start in ([0.0], [9.0] * 4, [np.nan] * 4, robot.limits.mean(axis=1)):
        with pytest.raises(ks.JointVectorError):
            ks.follow_family(robot, targets, start=start)
