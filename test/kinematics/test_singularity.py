# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The distance to the nearest singular pose, the directions that go with it, and the time left."""

import copy
import dataclasses
import functools
import math
import pickle

import numpy as np
import pytest
from arms import (
    DISTINCT,
    DISTINCT_BUNDLED,
    elementary_arm,
    first_order_distances,
    poses,
    random_poses,
    robot_of,
    scaled,
    searched_poses,
    sliding,
    task_jacobian,
    without_factors,
)
from tolerances import QUOTIENT, ROUND_OFF

import kinematics_service as ks
from kinematics_service.kinematics.singularity import singularity_of
from kinematics_service.kinematics.singularity_rates import measured_before
from kinematics_service.robot.measures import Thresholds
from kinematics_service.robot.robot import with_singularity

every_arm = pytest.mark.parametrize('name', DISTINCT)

# Central differences of ln w: the step's square times third derivatives that grow as 1 / distance
# cubed, and round-off over the step; poses are kept this far from singular ones.
LOG_STEP, LOG_DIFFERENCE, KEPT_AWAY = 1e-5, 1e-5, 0.02


def joint_scale(robot):
    # A unit of joint motion: a radian, or a characteristic length of a prismatic joint.
    return np.where(sliding(robot), robot.singularity.task.length, 1.0)


def log_product(robot, q):
    # ln of the product of the first singular values, by numpy.
    sigma = np.linalg.svd(scaled(robot, task_jacobian(robot, q)), compute_uv=False)
    return np.sum(np.log(sigma[..., : robot.singularity.task.generic_rank]), axis=-1)


def log_gradient(robot, q):
    columns = []
    for step in LOG_STEP * np.diag(joint_scale(robot)):
        columns.append(log_product(robot, q + step) - log_product(robot, q - step))
    return np.stack(columns, axis=-1) / (2 * LOG_STEP)


@pytest.mark.slow
@every_arm
def test_first_order_and_way_out_are_the_gradient_of_the_log_of_the_product(name):
    robot = without_factors(name)
    q = random_poses(robot, 60)
    found, distance = ks.singularity(robot, q), first_order_distances(robot, q)
    clear = distance > KEPT_AWAY
    gradient = log_gradient(robot, q)
    norm = np.linalg.norm(gradient, axis=1)
    capped = norm < 1 / math.pi
    expected = np.where(capped, math.pi, 1 / np.where(capped, 1.0, norm))
    sure = clear & (np.abs(norm - 1 / math.pi) > LOG_DIFFERENCE)
    np.testing.assert_allclose(distance[sure], expected[sure], rtol=LOG_DIFFERENCE)
    # The way out is that gradient, of unit length in units of joint motion; back in rad or m.
    steep = clear & (norm > 1e-3)
    way = found.way_out / joint_scale(robot)
    np.testing.assert_allclose(
        way[steep] * norm[steep, None], gradient[steep], rtol=0, atol=LOG_DIFFERENCE / KEPT_AWAY
    )
    np.testing.assert_allclose(np.linalg.norm(way[steep], axis=1), 1.0, rtol=0, atol=ROUND_OFF)


@pytest.mark.slow
@every_arm
def test_distance_is_an_angle_between_zero_and_pi(name):
    robot = without_factors(name)
    found = ks.singularity(robot, poses(robot, 40) if robot.dof < 8 else searched_poses(robot))
    assert np.all((found.distance >= 0.0) & (found.distance <= math.pi))
    assert np.all((found.distance == 0.0) == (found.rank < found.generic_rank))


@every_arm
def test_lost_direction_and_joint_motion_are_singular_vectors(name):
    robot = without_factors(name)
    q = poses(robot)
    found = ks.singularity(robot, q)
    J = scaled(robot, task_jacobian(robot, q))
    to_base = robot.description.base.motion.matrix[:3, :3]
    lost = (found.lost_direction.reshape(-1, 2, 3) @ to_base).reshape(-1, 6)  # frame 0 axes
    rows = [('x', 'y', 'z', 'rx', 'ry', 'rz').index(row) for row in robot.singularity.task.rows]
    others = np.delete(lost, rows, axis=1)
    assert np.all(np.abs(others) < ROUND_OFF)
    left, right = lost[:, rows], found.joint_motion / joint_scale(robot)
    for vectors in (left, right):
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1.0, rtol=0, atol=ROUND_OFF)
    sigma = found.smallest_singular_value
    size = ROUND_OFF * np.max(found.singular_values)
    # J right = sigma left and left J = sigma right, unless the arm has idle joints besides.
    regular = found.rank >= found.generic_rank
    moved = (J @ right[:, :, None])[..., 0]
    asked = (left[:, None, :] @ J)[:, 0]
    np.testing.assert_allclose(moved[regular], (sigma[:, None] * left)[regular], rtol=0, atol=size)
    np.testing.assert_allclose(
        asked[regular], (sigma[:, None] * right)[regular], rtol=0, atol=size
    )
    # Where rank is lost no joint gives that motion, and that joint motion gives none.
    tolerance = 1e-9 * np.max(found.singular_values)
    np.testing.assert_allclose(moved[~regular], 0.0, rtol=0, atol=tolerance)
    np.testing.assert_allclose(asked[~regular], 0.0, rtol=0, atol=tolerance)


@every_arm
def test_the_way_out_leads_away_to_first_order(name):
    robot = without_factors(name)
    q = random_poses(robot, 60, seed=1)
    found = ks.singularity(robot, q)
    distance = first_order_distances(robot, q)
    near = (distance < 0.5) & (distance > 1e-3)
    step = 1e-4 * distance[near, None] * found.way_out[near]
    q = q[near]
    gained = log_product(robot, q + step) - log_product(robot, q - step)
    # Along the gradient ln w grows by its norm times the step.
    np.testing.assert_allclose(gained, 2e-4, rtol=1e-3)


SINGULAR = {
    'planar_2r': [[0.3, 0.0], [1.0, math.pi]],
    'planar_3r': [[0.3, 0.0, 1.0]],
    'anthropomorphic_3r': [[0.4, 0.7, 0.0], [0.4, 0.7, math.pi]],
    'craig_3r': [[0.4, 0.7, 0.0]],
    'rrp_elementary': [[0.4, math.pi / 2, 0.2], [0.4, 0.3, -0.4]],
    'spherical_rrp': [[0.4, 0.0, 0.5], [0.4, 0.9, 0.0]],
    'scara_hsr065': [[0.1, 0.0, 0.1, 1.0]],
    'ur3e': [[0.1, -1.0, 0.0, 0.5, 0.6, 0.7], [0.1, -1.0, 1.2, 0.5, 0.0, 0.7]],
    'puma560': [[0.1, 0.8, -0.5, 0.4, 0.0, 0.3]],
    'offset_stanford_dh': [[0.1, 0.8, 0.2, 0.4, 0.0, 0.3]],
    'kuka_iiwa14': [[0.4, 0.5, 0.6, 0.0, 0.3, 0.8, 0.2]],
}


@pytest.mark.parametrize('name', SINGULAR)
def test_rank_loss_has_distance_zero_and_a_way_out_either_way(name):
    robot = without_factors(name)
    for q in np.array(SINGULAR[name]):
        found = ks.singularity(robot, q)
        assert found.rank < found.generic_rank
        assert found.distance == 0.0
        assert found.level is ks.Level.ERROR
        assert found.condition_number > 1e9
        assert np.linalg.norm(found.way_out / joint_scale(robot)) == pytest.approx(1.0)
        for sign in (1, -1):
            away = ks.singularity(robot, q + sign * 0.01 * found.way_out)
            assert away.rank == found.generic_rank
            assert away.distance > 0.003


@pytest.mark.parametrize('name', SINGULAR)
def test_the_pose_left_along_the_way_out_is_found_again(name):
    robot = without_factors(name)
    for q in np.array(SINGULAR[name]):
        found = ks.singularity(robot, q)
        for step in (1e-2, 1e-3, 1e-4):
            # Curved families may come a little nearer than the pose that was left.
            near = ks.singularity(robot, q + step * found.way_out)
            assert near.distance == pytest.approx(step, rel=2 * step + 1e-5)
            again = ks.singularity(robot, near.nearest_singular)
            assert again.singular_values[again.generic_rank - 1] < 1e-6 * again.singular_values[0]


# A distance that is exact to round-off leaves the pose along the set open to its root.
ALONG = 1e-8


def test_planar_2r_by_its_closed_form():
    # w = |sin q2|, so |grad ln w| = |cot q2|; the singular poses are its zeros.
    robot = robot_of('planar_2r')
    q = random_poses(robot, 2000)
    expected = np.minimum(np.abs(np.tan(q[:, 1])), math.pi)
    np.testing.assert_allclose(first_order_distances(robot, q), expected, rtol=QUOTIENT)
    zero = np.pi * np.round(q[:, 1] / np.pi)
    near = np.abs(q[:, 1] - zero) < 0.19
    found = ks.singularity(robot, q[near])
    np.testing.assert_allclose(found.distance, np.abs(q[near, 1] - zero[near]), atol=ROUND_OFF)
    poses_there = np.stack([q[near, 0], zero[near]], axis=1)
    np.testing.assert_allclose(found.nearest_singular, poses_there, rtol=0, atol=ALONG)


def closed_form(name, q, length):
    # 1 / |grad ln |det|| by hand, prismatic joints in units of the length.
    if name in ('anthropomorphic_3r', 'craig_3r'):
        L1, L2, L3 = (0.0 if name.startswith('a') else 0.12), 0.4, 0.3
        s2, s23 = np.sin(q[:, 1]), np.sin(q[:, 1] + q[:, 2])
        r = L1 + L2 * np.cos(q[:, 1]) + L3 * np.cos(q[:, 1] + q[:, 2])
        slopes = [-(L2 * s2 + L3 * s23) / r, 1 / np.tan(q[:, 2]) - L3 * s23 / r]
    elif name == 'rrp_elementary':
        slopes = [-np.tan(q[:, 1]), 2 * length / (0.4 + q[:, 2])]
    else:
        slopes = [1 / np.tan(q[:, 1]), 2 * length / q[:, 2]]
    return np.minimum(1 / np.hypot(*slopes), math.pi)


@pytest.mark.parametrize(
    'name', ['anthropomorphic_3r', 'craig_3r', 'rrp_elementary', 'spherical_rrp']
)
def test_first_order_by_its_closed_form(name):
    robot = without_factors(name)
    q = random_poses(robot, 5000)
    found = first_order_distances(robot, q)
    expected = closed_form(name, q, robot.singularity.task.length)
    near = expected > 1e-4
    np.testing.assert_allclose(found[near], expected[near], rtol=1e-8)


def families(name):
    # Points of the curve in the q2, q3 plane where the tip is on the first axis: q2 and the sign
    # given, then q2 + q3 and the sign, since each way is sparse where the other is dense.
    L1, L2, L3 = (0.0 if name.startswith('a') else 0.12), 0.4, 0.3
    angle = np.linspace(-math.pi, math.pi, 1001)
    curves = []
    for far, near in ((L2, L3), (L3, L2)):
        cosine = -(L1 + far * np.cos(angle)) / near
        given, cosine = angle[np.abs(cosine) <= 1.0], cosine[np.abs(cosine) <= 1.0]
        for other in (np.arccos(cosine), -np.arccos(cosine)):
            q2, q23 = (given, other) if far == L2 else (other, given)
            curves.append(np.stack([q2, q23 - q2], axis=-1))
    return np.concatenate(curves)


def true_distances(name, q):
    turn = 2 * math.pi
    elbow = np.abs(q[:, 2] - math.pi * np.round(q[:, 2] / math.pi))
    # The environment in which the release tests wheels has no scipy.
    spatial = pytest.importorskip('scipy.spatial')
    points = spatial.cKDTree(np.mod(families(name), turn), boxsize=turn)
    return np.minimum(elbow, points.query(np.mod(q[:, 1:], turn))[0])


@functools.cache
def poses_with_true_distances(name):
    q = random_poses(robot_of(name), 600, seed=2)
    # As many again close to the curve and to the folded elbow, where estimates are worst.
    close = q.copy()
    random = np.random.default_rng(3)
    close[:300, 1:] = random.choice(families(name), 300) + random.uniform(-0.06, 0.06, (300, 2))
    close[300:, 2] = math.pi + random.uniform(-0.06, 0.06, 300)
    q = np.concatenate([q, close])
    return q, true_distances(name, q)


# Found distance by that to the points of the curve, which are up to 0.012 rad apart: of poses 0.02
# to 0.05 rad away it is a twentieth less at most, and never more.
SHARES = {'factors': (0.95, 1.0 + 1e-4), 'no factors': (0.95, 1.0 + 1e-4)}


@pytest.mark.slow
@pytest.mark.parametrize('judged', SHARES)
@pytest.mark.parametrize('name', ['craig_3r'])
def test_distance_against_the_true_one(name, judged):
    robot = robot_of(name) if judged == 'factors' else without_factors(name)
    q, true = poses_with_true_distances(name)
    found = ks.singularity(robot, q)
    # Nearer than this the points of the curve are too far apart to tell.
    near = (true > 0.02) & (true < 0.05)
    shares = found.distance[near] / true[near]
    assert np.sum(near) > 150
    assert np.median(shares) == pytest.approx(1.0, abs=0.02)
    low, high = SHARES[judged]
    assert low < np.min(shares)
    assert np.max(shares) < high
    # No pose this near goes without a warning.
    assert np.sum(true < 0.03) > 150
    assert np.all(found.level[true < 0.03] > ks.Level.OK)


@pytest.mark.slow
def test_a_warning_means_something_on_a_ur3e():
    # Of random poses over full turns, so many lie this near.
    q = np.random.default_rng(0).uniform(-math.pi, math.pi, (6_000, 6))
    distance = ks.singularity(without_factors('ur3e'), q).distance
    assert np.mean(distance < 0.1) == pytest.approx(0.21, abs=0.01)
    assert np.mean(distance < 0.05) == pytest.approx(0.11, abs=0.01)
    # By its shoulder, elbow and wrist, one by one, it is about the same.
    distance = ks.singularity(robot_of('ur3e'), q[:2_000]).distance
    assert np.mean(distance < 0.1) == pytest.approx(0.20, abs=0.015)
    assert np.mean(distance < 0.05) == pytest.approx(0.105, abs=0.015)


@pytest.mark.parametrize(
    ('links', 'types'),
    [
        ('Rz(q1), Ry(q2), Tx(1), Ry(q3), Tx(0.8), Ry(q4), Tx(0.3)', 'rrrr'),
        ('Rz(q1), Ry(q2), Tx(1), Ry(q3), Tx(0.8), Ry(q4), Tx(0.3), Rx(q5), Tz(0.1)', 'rrrrr'),
        ('Rz(q1), Tz(q2), Tx(0.2), Tx(q3), Ry(q4), Tx(0.3), Rz(q5), Ty(0.1)', 'rpprr'),
        ('Rz(q1), Tx(0.3), Ry(q2), Tz(q3), Rz(q4), Tx(0.2)', 'rrpr'),
    ],
)
def test_arms_with_fewer_joints_than_rows_have_a_distance_too(links, types):
    robot = elementary_arm(links, types)
    assert len(robot.singularity.task.rows) > robot.dof
    q = random_poses(robot, 100)
    found = ks.singularity(robot, q)
    J = task_jacobian(robot, q)
    gram = np.linalg.det(np.swapaxes(J, -1, -2) @ J)
    np.testing.assert_allclose(found.manipulability**2, gram, rtol=1e-7, atol=1e-12)
    assert found.determinant is None
    gradient, distance = (
        np.linalg.norm(log_gradient(robot, q), axis=1),
        first_order_distances(robot, q),
    )
    clear = distance > KEPT_AWAY
    expected = 1 / np.maximum(gradient, 1 / math.pi)
    np.testing.assert_allclose(distance[clear], expected[clear], rtol=1e-4)


def test_manipulability_of_a_redundant_arm():
    robot = robot_of('panda')
    q = np.array([0.3, 0.5, -0.2, -2.0, 0.1, 1.6, 0.4])
    J = ks.jacobian(robot, q)
    assert ks.singularity(robot, q).manipulability == pytest.approx(
        math.sqrt(np.linalg.det(J @ J.T)), rel=QUOTIENT
    )


def test_the_lost_direction_of_a_stretched_planar_arm_is_along_its_links():
    found = ks.singularity(robot_of('planar_2r'), [0.7, 0.0])
    along = [math.cos(0.7), math.sin(0.7), 0, 0, 0, 0]
    assert abs(found.lost_direction @ along) == pytest.approx(1.0, abs=ROUND_OFF)
    # Stretched, J = [2 t, t]: joint 1 against twice joint 2.
    against = np.array([1.0, -2.0]) / math.sqrt(5.0)
    assert abs(found.joint_motion @ against) == pytest.approx(1.0, abs=ROUND_OFF)
    # Only the elbow leads out.
    np.testing.assert_allclose(np.abs(found.way_out), [0.0, 1.0], rtol=0, atol=ROUND_OFF)


MEASURED = {
    'distance': Thresholds('distance', 0.1, 0.03),
    'determinant': Thresholds('determinant', 0.01, 0.001),
    'manipulability': Thresholds('manipulability', 0.01, 0.001),
    'smallest_singular_value': Thresholds('smallest_singular_value', 0.05, 0.01),
    'condition_number': Thresholds('condition_number', 17.0, 30.0),
}


@pytest.mark.parametrize('measure', MEASURED)
def test_time_to_warning_against_stepping_forward_in_time(measure):
    robot = with_singularity(robot_of('puma560'), thresholds=MEASURED[measure])
    random = np.random.default_rng(5)
    q, qdot = random_poses(robot, 3000), random.uniform(-1, 1, (3000, 6))
    found = ks.singularity(robot, q, qdot)
    beyond = found.level > ks.Level.OK
    assert np.all(found.time_to_warning[beyond] == 0.0)
    assert np.all(found.time_to_warning[~beyond] > 0.0)
    # Soon enough for a first-order forecast: half the time further half the margin must be gone.
    soon = (found.time_to_warning < 0.02) & ~beyond
    assert np.sum(soon) >= 10
    warn = robot.singularity.thresholds.warn
    times = found.time_to_warning[soon]
    at = np.abs(getattr(found, measure)[soon])
    late = q[soon] + times[:, None] * qdot[soon]
    arrived = np.abs(getattr(ks.singularity(robot, late), measure))
    share = (arrived - warn) / (at - warn)
    assert np.quantile(np.abs(share), 0.9) < 0.15
    # Never approached: going the other way, the forecast is for ever.
    back = ks.singularity(robot, q[soon], -qdot[soon])
    assert np.all(np.isinf(back.time_to_warning) | (back.rate * found.rate[soon] > 0.0))


@pytest.mark.parametrize('measure', ['distance', 'condition_number'])
def test_known_distances_are_watched_where_the_distance_is(measure):
    robot = with_singularity(robot_of('puma560'), thresholds=MEASURED[measure])
    q = random_poses(robot, 5)
    found = ks.singularity(robot, q, np.ones_like(q))
    before = measured_before(
        ks.evaluate(robot, q, np.ones_like(q)), found.distance, found.nearest_singular
    )
    for name in ('distance', 'nearest_singular', 'rate', 'time_to_warning'):
        np.testing.assert_array_equal(getattr(singularity_of(before), name), getattr(found, name))


def test_time_to_warning_of_a_planar_arm():
    # distance = |q2|.
    robot = robot_of('planar_2r')
    found = ks.singularity(robot, [0.2, 0.3], [1.0, -0.5])
    assert found.rate == pytest.approx(-0.5, rel=1e-9)
    assert found.time_to_warning == pytest.approx((0.3 - 0.1) / 0.5, rel=1e-9)
    away = ks.singularity(robot, [0.2, 0.3], [1.0, 0.5])
    assert away.rate == pytest.approx(0.5, rel=1e-9)
    assert away.time_to_warning == math.inf
    for q2, qdot2 in ((0.3, 0.0), (0.05, 0.0)):
        still = ks.singularity(robot, [0.2, q2], [0.0, qdot2])
        assert still.rate == 0.0
        assert still.time_to_warning == (math.inf if q2 > 0.1 else 0.0)
    assert ks.singularity(robot, [0.2, 0.3]).time_to_warning is None
    assert ks.singularity(robot, [0.2, 0.3]).rate is None


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('measure', MEASURED)
@pytest.mark.parametrize(
    ('name', 'q'),
    [
        ('anthropomorphic_3r', [0.3, 0.0, 0.0]),
        ('anthropomorphic_3r', [0.3, math.pi / 2, 0.0]),
        ('spherical_rrp', [0.3, 0.4, 0.0]),
    ],
)
def test_motion_within_the_singular_set_is_no_trouble(name, q, measure):
    # The first joint turns about a line the tool is on, or an arm without length: the measure
    # stays where it is, be it infinite.
    robot = with_singularity(robot_of(name), thresholds=MEASURED[measure])
    found = ks.singularity(robot, q, [1.0, 0.0, 0.0])
    assert found.time_to_warning == 0.0
    assert found.level is ks.Level.ERROR
    assert not math.isnan(found.rate)


@pytest.mark.slow
@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('name', DISTINCT)
def test_every_pose_has_numbers(name):
    robot = robot_of(name)
    q = searched_poses(robot)
    found = ks.singularity(robot, q, np.ones_like(q))
    for field in dataclasses.fields(found):
        numbers = getattr(found, field.name)
        if field.name in ('condition_number', 'time_to_warning'):
            assert not np.any(np.isnan(numbers)), field.name
        elif field.name == 'nearest_singular':
            assert np.all(np.isfinite(numbers).any(axis=1) == np.isfinite(numbers).all(axis=1))
        elif not (numbers is None or dataclasses.is_dataclass(numbers)):
            assert np.all(np.isfinite(numbers)), field.name


@pytest.mark.parametrize('name', DISTINCT_BUNDLED)
def test_one_pose_gives_plain_numbers(name):
    robot = robot_of(name)
    q = np.full(robot.dof, 0.3)
    found = ks.singularity(robot, q, q)
    for number in (found.manipulability, found.condition_number, found.distance):
        assert type(number) is float
    assert found.determinant is None or type(found.determinant) is float
    assert np.ndim(found.rank) == np.ndim(found.time_to_warning) == np.ndim(found.rate) == 0


def test_results_are_frozen():
    found = ks.singularity(robot_of('puma560'), np.zeros(6))
    with pytest.raises(dataclasses.FrozenInstanceError):
        found.distance = 1.0
    for vector in (found.lost_direction, found.joint_motion, found.way_out, found.singular_values):
        with pytest.raises(ValueError, match='read-only'):
            vector[0] = 1.0


# One pose asked for each value when it is wanted, and a batch filled with all of them.
@pytest.mark.parametrize('q', [[0.3, -0.4, 0.5], [[0.3, -0.4, 0.5], [0.1, 0.2, 0.0]]])
@pytest.mark.parametrize('name', ['craig_3r', 'spherical_rrp'])
def test_a_result_is_a_value(name, q):
    found = ks.singularity(robot_of(name), q, np.ones(3))
    again = ks.singularity(robot_of(name), q, np.ones(3))
    assert found is not again
    assert found == again
    assert found != ks.singularity(robot_of(name), q)
    assert found != ks.singularity(robot_of(name), np.add(q, 1e-9), np.ones(3))
    for same in (pickle.loads(pickle.dumps(found)), copy.copy(found), copy.deepcopy(found)):
        assert same == again
        assert repr(same).partition('(')[2] == repr(found).partition('(')[2]
    values = dataclasses.asdict(found)
    assert list(values) == [field.name for field in dataclasses.fields(ks.Singularity)]
    np.testing.assert_array_equal(values['way_out'], found.way_out)
    other = dataclasses.replace(found, level=ks.Level.STALE)
    assert isinstance(other, ks.Singularity)
    assert other.level is ks.Level.STALE
    assert other != found
    assert dataclasses.replace(other, level=found.level) == again
    with pytest.raises(dataclasses.FrozenInstanceError):
        found.level = ks.Level.OK


@pytest.mark.parametrize('name', ['puma560', 'panda'])
def test_a_pickled_result_is_no_larger_than_its_numbers(name):
    robot = robot_of(name)
    found = ks.singularity(robot, np.full(robot.dof, 0.3), np.ones(robot.dof))
    numbers = 8 * robot.singularity.measure_places.width
    assert len(pickle.dumps(found)) < 2 * numbers + 1000
    assert name.encode() not in pickle.dumps(found)


@pytest.mark.parametrize('name', ['ur5e', 'puma560', 'kinova_gen3'])
def test_a_pose_of_a_batch_does_not_depend_on_those_before_it(name):
    robot = robot_of(name)
    random = np.random.default_rng(1)
    ways = random.uniform(-2.0, 2.0, (6, 1, robot.dof))
    q = ways + np.linspace(0.0, 0.8, 40)[:, None] * random.normal(size=ways.shape)
    q = q.reshape(-1, robot.dof)
    order = random.permutation(len(q))
    along, mixed = ks.singularity(robot, q), ks.singularity(robot, q[order])
    assert np.array_equal(along.distance[order], mixed.distance)
