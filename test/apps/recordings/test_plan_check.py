# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Plans: what is proved no sampling refutes, and what is refuted is shown."""

import math

import brute_force
import numpy as np
import pytest
from arms import robot_of
from calibrated import calibrated_ur5
from tolerances import ROUND_OFF

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.apps.recordings.plans import singular_proof
from kinematics_service.apps.recordings.plans.check import _extreme
from kinematics_service.apps.recordings.plans.point_speed import _Speeds, chain_to
from kinematics_service.apps.recordings.plans.polynomials import (
    Pieces,
    PolynomialMotion,
    polynomial_motion,
)

THRESHOLD = 0.03
# Six joints with factors and without, seven, four, and those that slide.
ARMS = ('ur5e', 'calibrated UR5', 'panda', 'scara_hsr065', 'offset_stanford_dh', 'spherical_rrp')
# A singular value is zero below this share of the largest.
SINGULAR = 1e-6
DENSE = 80
# Brackets of speed are this narrow; differences over a dense sampling fall short by less.
BRACKET, DIFFERENCES = 1.0101, 0.999


def named(name):
    return calibrated_ur5(1) if name == 'calibrated UR5' else robot_of(name)


def random_plan(robot, random, points=3, seconds=2.0, reach=2.0):
    """Return times, positions, velocities and accelerations of a plan with quintic segments."""
    low, high = np.clip(robot.limits, -reach, reach).T
    q = random.uniform(low, high, (points, robot.dof))
    qdot = random.normal(size=q.shape) * 0.3 * (high - low) / (2.0 * reach)
    return np.arange(points) * seconds, q, qdot, np.zeros_like(q)


def sampled(plan, count=DENSE):
    """Return times and positions (count a segment) along a plan."""
    motion = polynomial_motion(*plan)
    segment = np.repeat(np.arange(len(motion.begins)), count)
    s = np.tile(np.linspace(0.0, 1.0, count), len(motion.begins))
    return motion.times(segment, s), motion.positions(segment, s)


def near(robot, distance):
    """Return a plan of a UR5e that passes the wrist's singular pose at a distance."""
    q = np.array([[0.0, -1.2, 1.4, -1.6, 0.5, 0.0], [0.4, -1.3, 1.5, -1.5, 0.0, 0.1]])
    q = np.array([q[0], q[1], 2.0 * q[1] - q[0]])
    q[:, 4] = 0.5, distance, 0.5
    return [0.0, 1.0, 2.0], q, np.array([[0.0] * 6, [0.2, -0.1, 0.1, 0.1, 0.0, 0.1], [0.0] * 6])


@pytest.mark.slow
@pytest.mark.parametrize('name', ARMS)
def test_what_is_proved_no_sampling_and_no_search_refutes(name):
    robot, random = named(name), np.random.default_rng(5)
    proved = 0
    for _ in range(3):
        # Short ways, so that many keep away from singular poses.
        times, q, qdot, still = random_plan(robot, random, 2)
        plan = times, q[:1] + 0.2 * (q - q[:1]), 0.2 * qdot, still
        found = ks.check_plan(robot, *plan, distance=THRESHOLD).singularity
        if found.verdict != 'proved':
            continue
        proved += 1
        _, q = sampled(plan)
        there = ks.singularity(robot, q)
        away = np.linalg.norm(
            (there.nearest_singular - q) / robot.singularity.task.column_scales, axis=1
        )
        assert np.nanmin(away, initial=math.inf) > found.lower > THRESHOLD
        if proved == 1:
            nearest = np.argsort(there.distance)[:1]
            by_force, _ = brute_force.nearest_singular(robot, q[nearest], starts=3)
            assert np.min(by_force) > found.lower
    assert proved


def singular_poses(robot, random, count):
    """Return singular poses (count, n), as they are found near random ones."""
    low, high = np.clip(robot.limits, -2.0, 2.0).T
    poses = ks.singularity(robot, random.uniform(low, high, (100, robot.dof))).nearest_singular
    return poses[np.isfinite(poses[:, 0])][:count]


@pytest.mark.parametrize('name', ARMS)
def test_a_plan_past_a_singular_pose_is_refuted_by_one(name):
    robot, random = named(name), np.random.default_rng(6)
    for pose in singular_poses(robot, random, 2):
        # Within 0.02 of it, at none of the points.
        beside = random.normal(size=robot.dof)
        beside *= 0.02 * robot.singularity.task.column_scales / np.linalg.norm(beside)
        way = random.normal(size=robot.dof) * 0.3 * robot.singularity.task.column_scales
        plan = np.array([0.0, 2.0]), pose + beside + np.array([-0.9 * way, way]), None, None
        found = ks.check_plan(robot, *plan, distance=THRESHOLD).singularity
        assert (found.verdict, found.lower) == ('refuted', 0.0)
        moment = found.moment
        t = np.array([moment.time / 2.0])
        on_it = polynomial_motion(*plan).positions(np.array([0]), t)[0]
        np.testing.assert_allclose(moment.q, on_it, rtol=0, atol=1e-9)
        away = np.linalg.norm(
            (found.nearest_singular - moment.q) / robot.singularity.task.column_scales
        )
        assert away == pytest.approx(found.upper, abs=1e-9)
        assert away < 0.0201
        sigma = np.linalg.svd(brute_force.scaled_jacobian(robot, found.nearest_singular))[1]
        assert sigma[robot.singularity.task.generic_rank - 1] < SINGULAR * sigma[0]


@pytest.mark.parametrize(
    ('distance', 'verdict'),
    [(0.3, 'proved'), (0.05, 'proved'), (0.032, 'proved'), (0.0301, 'proved')]
    + [
        (0.03003, 'proved'),
        (0.03001, 'not decided'),
        (0.0299, 'refuted'),
        (0.0, 'refuted'),
        (-0.1, 'refuted'),
    ],
)
def test_a_passage_at_a_set_distance_from_the_wrist(distance, verdict):
    found = ks.check_plan(robot_of('ur5e'), *near(robot_of('ur5e'), distance)).singularity
    assert (found.verdict, found.threshold) == (verdict, THRESHOLD)
    if verdict == 'proved':
        assert THRESHOLD < found.lower <= abs(distance)
        assert found.undecided == ()
    if verdict == 'not decided':
        ((begin, end),) = found.undecided
        assert begin < 1.0 < end
        assert found.lower < THRESHOLD < found.upper
        assert found.upper == pytest.approx(distance, rel=1e-2)
        assert begin < found.moment.time < end
    if verdict == 'refuted':
        assert found.upper <= max(distance, 1e-4) + ROUND_OFF
        assert found.lower == 0.0


@pytest.mark.slow
def test_past_a_straight_elbow_most_plans_of_seven_joints_are_proved():
    # The least singular value falls to 1e-4 there, and singular poses are tenths of a rad away.
    robot, random = robot_of('kinova_gen3'), np.random.default_rng(2)
    verdicts = []
    for _ in range(9):
        q = random.uniform(-1.5, 1.5, (2, 7))
        q[:, 3] = -0.5, 0.6
        verdicts.append(ks.check_plan(robot, [0.0, 2.0], q, distance=THRESHOLD).verdict)
    assert verdicts.count('proved') > 5


def test_joints_move_no_farther_than_the_span_of_a_piece():
    random = np.random.default_rng(21)
    taylor, reach = random.normal(size=(40, 4, 3)), random.uniform(0.2, 1.5, 40)
    span = singular_proof._span(taylor, reach)
    s = reach[:, None] * np.linspace(-1.0, 1.0, 41)
    moved = np.einsum('kpj,kps->ksj', taylor[:, 1:], s[:, None] ** np.arange(1, 4)[:, None])
    assert np.all(np.linalg.norm(moved, axis=2) <= span[:, None] * (1.0 + 1e-12))
    # Of one joint whose powers add up it is what that moves.
    alone = np.abs(taylor[:, :, :1])
    farthest = np.sum(alone[:, 1:, 0] * reach[:, None] ** np.arange(1, 4), axis=1)
    np.testing.assert_allclose(singular_proof._span(alone, reach), farthest, rtol=1e-12)


def test_between_samples_nothing_is_missed():
    # A dip of 8 ms in a plan of 10 s, through the singular pose and back: samples at 100 Hz, and
    # the points, step over it.
    robot = robot_of('ur5e')
    q = np.tile([0.0, -1.2, 1.4, -1.6, 0.5, 0.0], (5, 1))
    q[2, 4] = -0.3
    times = np.array([0.0, 5.001, 5.005, 5.009, 10.0])
    motion = polynomial_motion(times, q, None, None)
    t = np.arange(0.0, 10.0, 0.01)
    segment = np.searchsorted(times, t, side='right') - 1
    at = motion.positions(segment, (t - motion.begins[segment]) / motion.durations[segment])
    assert np.min(ks.singularity(robot, np.concatenate([at, q])).distance) > 0.2
    found = ks.check_plan(robot, times, q)
    assert found.singularity.verdict == 'refuted'
    assert found.singularity.upper < 1e-3
    assert 5.001 < found.singularity.moment.time < 5.009
    wrist = found.joints[4]
    assert (wrist.limits, wrist.speed) == ('proved', 'refuted')
    assert wrist.fastest.value == pytest.approx(0.8 / 0.004)


def test_when_the_clearances_allowed_are_spent_the_rest_is_not_decided(monkeypatch):
    monkeypatch.setattr(singular_proof, 'MAX_CLEARANCES', 1)
    monkeypatch.setattr(singular_proof, 'MAX_CLEARANCES_OF_SEGMENT', 1)
    found = ks.check_plan(robot_of('ur5e'), *near(robot_of('ur5e'), 0.05)).singularity
    assert found.verdict == 'not decided'
    assert found.lower == 0.0
    assert found.undecided[0][0] == 0.0


@pytest.mark.slow
@pytest.mark.parametrize('name', ['ur5e', 'panda', 'scara_hsr065', 'parallelogram_left'])
def test_speeds_are_bracketed(name):
    robot, random = named(name), np.random.default_rng(8)
    for _ in range(1):
        plan = random_plan(robot, random)
        points = [str(robot.rows // 2), robot.joint_names[-1]]
        check = ks.check_plan(robot, *plan, speed_of=points)
        t, q = sampled(plan, 2000)
        frames = ks.link_frames(robot, q)
        ways = [ks.forward_kinematics(robot, q)[:, :3, 3], frames[:, robot.rows // 2, :3, 3]]
        assert [one.of for one in check.speeds] == ['tool', *points]
        for speed, way in zip(check.speeds, ways):
            gone = np.diff(t) > 0.0
            rate = np.linalg.norm(np.diff(way, axis=0)[gone], axis=1) / np.diff(t)[gone]
            assert DIFFERENCES * speed.lower <= np.max(rate) <= speed.upper * (1.0 + 1e-9)
            assert speed.lower <= speed.upper <= BRACKET * speed.lower + 1e-9


def derivatives(robot, motion, segment, s):
    """Return the tool's velocity, acceleration and third derivative at places, by differences."""
    step = 2e-3
    p = [
        ks.forward_kinematics(robot, motion.positions(segment, s + k * step))[:, :3, 3]
        for k in (-2, -1, 1, 2)
    ]
    middle = ks.forward_kinematics(robot, motion.positions(segment, s))[:, :3, 3]
    T = step * motion.durations[segment][:, None]
    third = (p[3] - 2.0 * p[2] + 2.0 * p[1] - p[0]) / (2.0 * T**3)
    return (p[2] - p[1]) / (2.0 * T), (p[2] - 2.0 * middle + p[1]) / T**2, third


@pytest.mark.parametrize('name', [*ARMS, 'parallelogram_left'])
def test_velocities_of_a_point_are_derivatives_and_change_within_their_bounds(name):
    robot, random = named(name), np.random.default_rng(9)
    motion = polynomial_motion(*random_plan(robot, random))
    speeds, count = _Speeds(robot.chain, motion), 60
    pieces = Pieces(
        random.integers(0, 2, count),
        random.uniform(0.2, 0.8, count),
        random.uniform(0.0, 0.15, count),
    )
    taylor, T = motion.taylor(pieces), motion.durations[pieces.segment]
    v, a = speeds._velocity(taylor, T)
    expected = derivatives(robot, motion, pieces.segment, pieces.middle)
    np.testing.assert_allclose(v, expected[0], rtol=0, atol=1e-3)
    np.testing.assert_allclose(a, expected[1], rtol=0, atol=1e-2)
    bound, most = speeds._third(taylor, pieces.half, T), np.zeros(count)
    for share in np.linspace(-1.0, 1.0, 7):
        at = pieces.middle + share * pieces.half
        third = derivatives(robot, motion, pieces.segment, at)[2]
        most = np.maximum(most, np.linalg.norm(third, axis=1))
        assert np.all(most <= 1.001 * bound)
    # A bound that is far too large would cost more than it should.
    assert np.median(bound / most) < 30.0


def test_a_point_of_a_joint_is_on_its_axis():
    robot = robot_of('ur5e')
    q = np.array([[0.3, -1.0, 0.8, 0.2, 0.5, 0.1]])
    chain = chain_to(robot, 'elbow_joint')
    row = np.empty((1, chain.widths[kernel.POSE]))
    kernel.evaluate(chain, q, 0.0 * q, kernel.POSE, row)
    elbow = row[0, :16].reshape(4, 4)[:3, 3]
    np.testing.assert_allclose(elbow, ks.link_frames(robot, q)[0, 2, :3, 3], rtol=0, atol=1e-15)
    assert chain_to(robot, 'shoulder_pan_joint') is None
    assert chain_to(robot, '0') is None


def test_a_speed_limit_is_proved_or_refuted():
    robot = robot_of('planar_2r')
    plan = [0.0, 2.0], [[0.1, 0.5], [0.6, 1.5]]
    (tool,) = ks.check_plan(robot, *plan).speeds
    assert (tool.limit, tool.verdict) == (None, None)
    for limit, verdict in ((0.999 * tool.lower, 'refuted'), (1.02 * tool.lower, 'proved')):
        check = ks.check_plan(robot, *plan, speed_limit=limit)
        assert check.speeds[0].verdict == check.verdict == verdict
    # A limit within the first bracket is decided too.
    within = ks.check_plan(robot, *plan, speed_limit=1.0001 * tool.lower).speeds[0]
    assert within.verdict == 'proved'
    assert within.upper <= 1.0001 * tool.lower * (1.0 + 1e-6)


def test_extremes_of_polynomials_are_those_of_their_roots():
    random = np.random.default_rng(2)
    for degree in (0, 1, 2, 3, 5):
        for _ in range(12):
            c = random.normal(size=(3, degree + 1))
            values = []
            for one in c:
                roots = np.roots(np.polyder(one[::-1])) if degree > 1 else np.zeros(0)
                inside = roots.real[(abs(roots.imag) < 1e-9) & (roots.real > 0) & (roots.real < 1)]
                values += np.polyval(one[::-1], [0.0, 1.0, *inside]).tolist()
            motion = PolynomialMotion(np.arange(3.0), np.ones(3), c[:, :, None])
            found = _extreme(motion, c, np.positive, 'q1')
            assert found.value == pytest.approx(max(values), rel=1e-9, abs=1e-11)
            segment = min(found.moment.point, 2)
            there = np.polyval(c[segment][::-1], found.moment.time - segment)
            assert there == pytest.approx(found.value, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(('side', 'extreme'), [(0, 'least'), (1, 'greatest')])
def test_limits_are_those_of_the_motion_between_the_points(side, extreme):
    robot = robot_of('ur5e')
    limit, outwards = robot.limits[2, side], 2 * side - 1
    q = np.tile([0.0, -1.2, 1.4, -1.6, 0.8, 0.0], (2, 1))
    q[:, 2] = limit - 0.01 * outwards
    qdot = np.zeros((2, 6))
    qdot[:, 2] = 0.1 * outwards, -0.1 * outwards  # a cubic that is 0.025 farther in the middle
    elbow = ks.check_plan(robot, [0.0, 1.0], q, qdot).joints[2]
    assert (elbow.limits, elbow.speed) == ('refuted', 'proved')
    farthest = getattr(elbow, extreme)
    assert farthest.value == pytest.approx(limit + 0.015 * outwards, abs=1e-12)
    assert farthest.moment.time == pytest.approx(0.5, abs=1e-6)
    assert abs(elbow.fastest.value) == pytest.approx(0.1)
    straight = ks.check_plan(robot, [0.0, 1.0], q).joints[2]
    assert straight.limits == 'proved'


def test_a_plan_of_one_point_stays_there():
    robot = robot_of('ur5e')
    check = ks.check_plan(robot, [0.5], [[0.0, -1.2, 1.4, -1.6, 0.5, 0.0]], speed_limit=0.1)
    assert check.verdict == 'proved'
    assert (check.speeds[0].upper, check.joints[0].fastest.value) == (0.0, 0.0)
    assert check.singularity.moment.point == 0
    refuted = ks.check_plan(robot, [0.5], [[0.0, -1.2, 1.4, -1.6, 0.01, 0.0]])
    assert refuted.verdict == refuted.singularity.verdict == 'refuted'
    assert refuted.singularity.upper == pytest.approx(0.01)


@pytest.mark.parametrize(
    ('arguments', 'kind', 'code', 'words'),
    [
        (([0.0, 0.0], [[0, 1], [0, 1]]), ks.PlanError, 'wrong-order', 'times'),
        (([0.0, math.inf], [[0, 1], [0, 1]]), ks.PlanError, 'not-finite', 'times'),
        (([], np.zeros((0, 2))), ks.PlanError, 'wrong-shape', 'times'),
        (([[0.0, 1.0]], [[0, 1], [0, 1]]), ks.PlanError, 'wrong-shape', 'times'),
        (([0.0, 1.0], [[0, 1, 2], [0, 1, 2]]), ks.JointVectorError, 'wrong-shape', 'q (2, 3)'),
        (([0.0, 1.0], [[0, 1], [0, 1]], [[0, 1]]), ks.JointVectorError, 'wrong-shape', 'qdot'),
        (([0.0, 1.0], [[0, 1], [0, math.nan]]), ks.JointVectorError, 'not-finite', 'point 1'),
        (([0.0, 1.0], [['a', 1], [0, 1]]), ks.JointVectorError, None, 'q numbers'),
        (([0.0, 1.0], [[0, 1], [0, 2]], [[1e280, 0], [0, 0]]), ks.PlanError, 'too-large', 'q1'),
        (([0.0], [[0, 1]], None, None, -1.0), ks.PlanError, 'out-of-range', 'distance -1'),
        (([0.0], [[0, 1]], None, None, 1.2), ks.PlanError, 'out-of-range', 'distance 1.2'),
        (([0.0], [[0, 1]], None, None, None, 0.0), ks.PlanError, None, 'speed_limit 0'),
        (
            ([0.0], [[0, 1]], None, None, None, None, ['elbow']),
            ks.PlanError,
            'unknown-name',
            "planar_2r 'elbow'",
        ),
        (([0.0], [[0, 1]], None, None, None, None, ['9']), ks.PlanError, 'unknown-name', "'9'"),
    ],
)
def test_what_is_no_plan_is_refused_in_a_sentence(arguments, kind, code, words):
    # Errors without a code here are those of all functions of the library.
    with pytest.raises(kind) as raised:
        ks.check_plan(robot_of('planar_2r'), *arguments)
    assert type(raised.value) is kind
    assert code in (None, raised.value.code)
    for word in words.split():
        assert word in str(raised.value)
