# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The singular pose nearest to a pose, against brute force."""

import dataclasses
import math

import brute_force
import numpy as np
import pytest
from arms import elementary_arm, first_order_distances, random_poses, robot_of, without_factors
from brute_force import judged_poses
from calibrated import UR5, calibrated_ur5, with_errors
from tolerances import ROUND_OFF

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.estimation.status_text import singularity_status
from kinematics_service.kinematics.singular_poses import singular_poses
from kinematics_service.kinematics.singularity import singularity_of
from kinematics_service.kinematics.singularity_rates import measured_in_order
from kinematics_service.robot.closed_poses import closes_at

# What a search that ended says is singular: the least singular value as a share of the largest.
SINGULAR = 2e-7
# A search may be farther than brute force by this factor.
TOO_FAR = 1.05
# A found distance is that of the nearest pose up to this share: the gain that ends a search.
FOUND = 2e-3
PUMA = (
    (0.0, math.pi / 2, 0.0),
    (0.4318, 0.0, 0.0),
    (0.0203, -math.pi / 2, 0.15005),
    (0.0, math.pi / 2, 0.4318),
    (0.0, -math.pi / 2, 0.0),
    (0.0, 0.0, 0.0),
)
# Rows (a, alpha, d) of an iiwa: with errors some sheets of singular poses are nearly so only.
IIWA_ROWS = (
    (0.0, -math.pi / 2, 0.36),
    (0.0, math.pi / 2, 0.0),
    (0.0, math.pi / 2, 0.42),
    (0.0, -math.pi / 2, 0.0),
    (0.0, -math.pi / 2, 0.4),
    (0.0, math.pi / 2, 0.0),
    (0.0, 0.0, 0.126),
)
# Random poses of each arm that brute force judges, and a quarter as many saddles.
RANDOM = 16

ARMS = {
    'craig_3r': lambda: robot_of('craig_3r'),
    'ur5e': lambda: robot_of('ur5e'),
    'so101': lambda: robot_of('so101'),
    'ur5e without factors': lambda: without_factors('ur5e'),
    'offset_stanford_dh': lambda: without_factors('offset_stanford_dh'),
    'parallelogram_left': lambda: without_factors('parallelogram_left'),
    'kinova_gen3': lambda: without_factors('kinova_gen3'),
    'calibrated UR5': lambda: calibrated_ur5(1),
    'four joints': lambda: robot_of('standard-4-0'),
    'eight joints': lambda: robot_of('standard-8-0'),
    'four parallel axes': lambda: elementary_arm(
        'Rz(q1), Tx(0.3), Rz(q2), Tx(0.4), Rz(q3), Tx(0.2), Rz(q4), Tx(0.1), Rx(q5), Tz(0.2), '
        'Ry(q6), Tx(0.3)',
        'rrrrrr',
    ),
    'rpprr': lambda: elementary_arm(
        'Rz(q1), Tz(q2), Tx(0.2), Tx(q3), Ry(q4), Tx(0.3), Rz(q5), Ty(0.1)', 'rpprr'
    ),
}
# Three to eight joints; sliding, coupled, redundant, with errors; by factors and by J alone.
KINDS = (
    *('craig_3r', 'ur5e', 'so101', 'offset_stanford_dh', 'parallelogram_left', 'kinova_gen3'),
    *('calibrated UR5', 'eight joints', 'four parallel axes', 'rpprr'),
)
every_kind = pytest.mark.parametrize('name', KINDS)


def share(robot, q):
    # The singular value that singular poses lack, as a share of the largest, by numpy.
    s = np.linalg.svd(brute_force.scaled_jacobian(robot, q), compute_uv=False)
    return s[..., robot.singularity.task.generic_rank - 1] / s[..., 0]


@pytest.mark.slow
@every_kind
def test_the_distance_is_that_of_brute_force(name):
    robot = ARMS[name]()
    q = judged_poses(robot, RANDOM)
    found = ks.singularity(robot, q)
    there = np.isfinite(found.nearest_singular[:, 0])
    by_force, _ = brute_force.nearest_singular(robot, q, starts=6)
    true = np.where(there, np.minimum(by_force, found.distance), by_force)
    # None that is near goes without a warning, and no warning is without reason.
    assert np.all(found.level[true < 0.03] > ks.Level.OK)
    assert np.all(found.distance[true < 0.1] < 0.15)
    assert np.all(found.level[true > 0.2] == ks.Level.OK)
    # Beside a saddle branches cross, and the second nearest one may be found.
    near = there & (true < 0.1) & (np.arange(len(q)) < RANDOM)
    np.testing.assert_allclose(found.distance[near], true[near], rtol=FOUND, atol=1e-7)


@pytest.mark.slow
@every_kind
def test_what_is_found_is_singular_and_as_far_as_it_says(name):
    robot = ARMS[name]()
    q = judged_poses(robot, 100)
    found = ks.singularity(robot, q)
    there = np.isfinite(found.nearest_singular[:, 0])
    assert np.sum(there) > 0
    assert np.max(share(robot, found.nearest_singular[there])) < SINGULAR
    way = (found.nearest_singular[there] - q[there]) / robot.singularity.task.column_scales
    distance = np.minimum(np.linalg.norm(way, axis=1), math.pi)
    np.testing.assert_allclose(found.distance[there], distance, rtol=1e-9, atol=1e-12)
    assert np.all(found.distance[~there] == 1.0)


@pytest.mark.parametrize(
    ('q', 'distance', 'too_far'),
    [
        (
            [
                *(-2.7854390445630877, -1.8356412764871797, -2.8008966579309162),
                *(-0.004736943881479938, -2.202519851462171, -0.0056163518339347185),
                0.7092176331702467,
            ],
            0.0280,
            0.01,
        ),
        (
            [
                *(-1.237149681, 0.012586181, -0.016897593, 0.006425746),
                *(-1.469670128, 1.78463578, -0.254302367),
            ],
            0.0177,
            # One of the 0.2 % that may be farther than 5 %: the level is right.
            0.2,
        ),
    ],
)
def test_a_pose_between_two_branches_of_a_broken_family(q, distance, too_far):
    # The first-order estimate is 0.115 at the first pose: no warning.
    robot = robot_of('kinova_gen3')
    found = ks.singularity(robot, q)
    assert found.distance == pytest.approx(distance, rel=too_far)
    assert found.level is ks.Level.ERROR
    assert share(robot, found.nearest_singular) < SINGULAR


@pytest.mark.parametrize(
    ('seed', 'q', 'distance'),
    [
        (2, [0.359002964, 1.569728301, 0.000745785, -1.571522556, 0.001112542, 2.734877639], 4e-4),
        (3, [-2.749104748, 0.060516894, -0.000497414, -0.78350622, 5.789e-06, -2.60475668], 0.027),
    ],
)
def test_at_a_saddle_of_a_calibrated_arm_the_gradient_says_nothing(seed, q, distance):
    robot = calibrated_ur5(seed)
    assert first_order_distances(robot, np.array(q)) == math.pi
    found = ks.singularity(robot, q)
    assert found.level is ks.Level.ERROR
    assert found.distance == pytest.approx(distance, rel=0.1)
    assert share(robot, found.nearest_singular) < SINGULAR


@pytest.mark.parametrize(
    'q',
    [
        [-0.91084616, 0.06821454, 2.94704908, -3.56848894, 1.75205972, 1.85331923, -0.72943987],
        [-1.55958535, -0.05282931, -0.27097269, -3.57349326, -1.327464, 1.6369291, -1.2821958],
        [-0.79539258, -0.07456522, -0.26166548, -3.56767791, -1.330324, 1.5546962, -2.3620299],
    ],
)
def test_where_two_singular_values_vanish_nearly_together_the_nearest_is_found(q):
    # Steps along the set keep a search from coming in there; others are found 0.18 rad away.
    robot, q = robot_of('fr3'), np.array(q)
    found = ks.singularity(robot, q)
    by_force, _ = brute_force.nearest_singular(robot, q[None], starts=24)
    assert by_force[0] < 0.08
    assert found.distance == pytest.approx(by_force[0], rel=0.01)
    assert share(robot, found.nearest_singular) < SINGULAR


@pytest.mark.parametrize(
    ('name', 'q', 'distance'),
    [
        (
            'Puma',
            [-1.819265, -1.571817237, -1.522984207, 0.979327398, 2.74622787, 0.599575321],
            0.000548,
        ),
        (
            'UR5',
            [1.818614326, 1.480083142, 0.029709397, -1.14523631, -0.703614525, -2.549258218],
            0.026074,
        ),
        (
            'kuka_iiwa14',
            [
                *(-1.624943601, -0.026910036, -0.047482498, -3.140296089),
                *(2.353796902, 0.537872835, 2.74297088),
            ],
            0.001296,
        ),
        (
            'kuka_iiwa14',
            [
                *(-1.273489102, 0.102253977, 0.136930204, -0.027970115),
                *(-3.195200103, -0.041143573, -2.189981537),
            ],
            0.027970,
        ),
    ],
)
def test_where_sheets_of_singular_poses_meet_the_nearest_is_found(name, q, distance):
    # Neither singular value says by its first order where they are: between them both are small.
    robot = {
        'Puma': lambda: with_errors(PUMA, 1e-5, seed=11),
        'UR5': lambda: with_errors(UR5, 1e-3, seed=13),
    }.get(name, lambda: without_factors(name))()
    found = ks.singularity(robot, q)
    assert found.distance == pytest.approx(distance, rel=1e-3)
    assert share(robot, found.nearest_singular) < SINGULAR
    # A second road comes as near: from where it was found, and from beside.
    starts = np.random.default_rng(4).normal(size=(12, robot.dof)) * 0.3 * distance
    starts[0] = 0.0
    starts += found.nearest_singular - q
    away, _ = brute_force.descend(robot, np.tile(q, (12, 1)), starts)
    assert np.min(away) == pytest.approx(distance, rel=1e-2)


# Poses of a motion, 2 ms apart, and the share of them that may differ by more than SAME from
# those that are searched alone; by how much any may be farther. A search of its own misses the
# nearest singular pose now and then, too.
ALONG, SAME, DIFFERENT, FARTHER = 1000, 2e-3, 0.02, 0.11


def motion(robot, fastest):
    random = np.random.default_rng(5)
    low, high = np.clip(robot.limits, -math.pi, math.pi).T
    rates = random.uniform(0.2, 1.0, (3, robot.dof)) * fastest
    phases = random.uniform(0.0, 6.0, (3, robot.dof))
    t = 0.002 * np.arange(ALONG)[:, None]
    share = np.mean([np.sin(w * t + phase) for w, phase in zip(rates, phases)], axis=0)
    return 0.5 * (low + high + share * (high - low))


def along(robot, q, search=None):
    return singularity_of(
        measured_in_order(
            ks.evaluate(robot, q), search or kernel.NearestSearch(robot.singularity.arm)
        )
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ('name', 'fastest'),
    [
        *(('ur5e', 0.3), ('so101', 1.0), ('calibrated UR5', 1.0)),
        *(('kinova_gen3', 0.3), ('kinova_gen3', 1.0), ('rpprr', 1.0)),
    ],
)
def test_along_a_motion_the_distance_is_that_of_each_pose_alone(name, fastest):
    robot = ARMS[name]()
    q = motion(robot, fastest)
    alone, found = ks.singularity(robot, q), along(robot, q)
    near = np.minimum(alone.distance, found.distance) < 0.2
    change = found.distance[near] / alone.distance[near] - 1.0
    assert np.max(change, initial=0.0) < FARTHER
    assert np.mean(np.abs(change) > SAME) < DIFFERENT if np.any(near) else True
    assert np.mean(found.level != alone.level) < 0.002
    there = np.isfinite(found.nearest_singular[:, 0])
    assert np.max(share(robot, found.nearest_singular[there]), initial=0.0) < SINGULAR


def test_pieces_of_a_motion_are_the_motion():
    robot = ARMS['ur5e without factors']()
    q, search = motion(robot, 1.0), kernel.NearestSearch(robot.singularity.arm)
    whole = along(robot, q)
    parts = [along(robot, part, search) for part in np.array_split(q, [1, 2, 200, 201, 600])]
    for name in ('distance', 'nearest_singular', 'level'):
        pieces = np.concatenate([getattr(part, name) for part in parts])
        np.testing.assert_array_equal(pieces, getattr(whole, name))


def test_one_pose_has_a_pose_or_none():
    robot = robot_of('ur5e')
    near = ks.singularity(robot, [0.1, -1.0, 1.2, 0.5, 0.05, 0.7])
    # The wrist alone is stretched.
    np.testing.assert_allclose(near.nearest_singular, [0.1, -1.0, 1.2, 0.5, 0.0, 0.7], atol=1e-9)
    assert near.distance == pytest.approx(0.05, abs=1e-9)
    far = ks.singularity(robot, [0.1, -1.0, 1.2, 0.5, 1.3, 0.7])
    assert far.nearest_singular is None
    assert far.distance > 0.2
    at = ks.singularity(robot, [0.1, -1.0, 1.2, 0.5, 0.0, 0.7])
    np.testing.assert_array_equal(at.nearest_singular, [0.1, -1.0, 1.2, 0.5, 0.0, 0.7])


@pytest.mark.parametrize('name', ['ur5e', 'kinova_gen3', 'four joints'])
def test_the_rate_is_how_the_distance_changes(name):
    robot = ARMS[name]()
    q = random_poses(robot, 1000, seed=1)
    qdot = np.random.default_rng(2).normal(size=q.shape)
    found = ks.singularity(robot, q, qdot)
    near = np.isfinite(found.nearest_singular[:, 0])
    near &= (found.distance > 0.02) & (found.distance < 0.15)
    step = 1e-3
    ahead, behind = (
        ks.singularity(robot, q[near] + sign * step * qdot[near]).distance for sign in (1, -1)
    )
    change = (ahead - behind) / (2 * step)
    # Where another branch becomes the nearest one meanwhile, there is no rate.
    wrong = np.abs(change - found.rate[near]) > 0.05 * np.linalg.norm(qdot[near], axis=1)
    assert np.sum(near) > 20
    assert np.mean(wrong) < 0.05


@pytest.mark.parametrize('q2', [0.03, 0.3, -0.7, 0.999, math.pi - 0.4, math.pi + 0.9])
def test_of_a_planar_arm_it_is_the_angle_of_its_elbow(q2):
    found = ks.singularity(robot_of('planar_2r'), [0.4, q2])
    assert found.distance == pytest.approx(abs(q2 - math.pi * round(q2 / math.pi)), rel=1e-9)


def test_of_a_wrist_that_is_stretched_it_is_no_more_than_its_angle():
    q = random_poses(robot_of('ur5e'), 800, seed=4)
    elbow, wrist = (np.abs(q[:, j] - math.pi * np.round(q[:, j] / math.pi)) for j in (2, 4))
    for robot in (robot_of('ur5e'), without_factors('ur5e')):
        found = ks.singularity(robot, q)
        too_far = found.distance > 1.1 * np.minimum(np.minimum(elbow, wrist), 1.0)
        assert not np.any(too_far)


@pytest.mark.parametrize(
    ('q', 'distance'),
    [
        ([0.0, -1.143519633, 0.354110873, 0.795525523, 1.868984837, 0.0], 0.583544),
        ([0.0, -1.258560515, 0.243619742, 1.653614687, -2.317999080, 0.0], 0.491275),
    ],
)
def test_the_factors_of_a_file_do_not_hide_the_joints_of_each_other(q, distance):
    # The zeros of a factor that depends on few joints are looked up before those of one of more.
    robot = robot_of('offset_stanford_dh')
    assert robot.singularity.factors.complete
    assert ks.singularity(robot, q).distance == pytest.approx(distance, rel=1e-5)


@pytest.mark.parametrize(
    ('name', 'q', 'distance'),
    [
        (
            'kinova_gen3',
            [
                *(-0.979143965, 0.0094584967, 0.849612688, -0.0475542002),
                *(-0.490086326, 0.0201540688, 2.567698015),
            ],
            0.030079,
        ),
        (
            'so101',
            [-1.093134886, -0.401606677, -1.111687103, -0.0969837996, -2.575112485],
            0.114560,
        ),
    ],
)
def test_a_direction_between_the_two_least_singular_values_is_lost_nearest(name, q, distance):
    # More than one equation tells where such arms are singular.
    robot = without_factors(name)
    found = ks.singularity(robot, q)
    assert found.distance == pytest.approx(distance, rel=1e-3)
    assert share(robot, found.nearest_singular) < SINGULAR


def test_a_pose_that_only_the_atlas_knows_is_found():
    # Elbow and shoulder are all but singular together, by three thousandths of the largest value.
    robot = with_errors(PUMA, 1e-3, seed=1)
    q = [2.241888300, -1.704260800, 1.680749280, 0.263700540, -1.814653130, 0.482440890]
    found = ks.singularity(robot, q)
    assert found.distance < 0.4
    assert share(robot, found.nearest_singular) < SINGULAR


# Saddles of a factor, and poses beside them: its slope leads to zeros on the other side.
SADDLES_OF_FACTORS = [
    (
        'offset_stanford_printed',
        [-2.558208454, -3.078020928, 1.626312307, 1.615329625, -3.141592654, -1.147231652],
        0.015526994,
    ),
    (
        'offset_stanford_printed',
        [0.253770732, -1.610147375, -0.347517761, 0.765501579, 2.554726203, 2.607553607],
        0.097157322,
    ),
    (
        'offset_stanford_printed',
        [-2.356984417, 3.18240977, 0.520969302, -2.414316658, -3.267274318, -1.728205579],
        0.139147582,
    ),
    (
        'offset_stanford_printed',
        [-2.314829456, 4.554437929, -0.491726998, 0.740831475, -2.879270384, -1.084522501],
        0.362484552,
    ),
    (
        'offset_stanford_printed',
        [2.90897722, 1.555626528, -0.418188954, 0.75126715, -0.336160921, -1.82184397],
        0.456748622,
    ),
    (
        'puma560',
        [-0.752571139, -0.014131888, 1.645289659, -0.67035343, 1.120497388, 1.95252929],
        0.023801056,
    ),
]


@pytest.mark.parametrize(('name', 'q', 'distance'), SADDLES_OF_FACTORS)
def test_beside_a_saddle_of_a_factor_the_nearest_is_found(name, q, distance):
    robot = robot_of(name)
    for found in (ks.singularity(robot, q), ks.singularity(robot, [q])):
        assert found.distance == pytest.approx(distance, rel=1e-6)
    assert share(robot, ks.singularity(robot, q).nearest_singular) < SINGULAR


@pytest.mark.parametrize(
    ('name', 'q', 'distance'),
    [
        ('rrp_elementary', [0.0, math.pi, 0.2907562057], 0.6907562057),
        ('spherical_rrp', [-math.pi / 2, -math.pi / 2, 0.3394281], 0.3394281),
    ],
)
def test_where_two_directions_are_lost_at_once_the_zero_of_a_factor_is_found(name, q, distance):
    # The least singular value has no slope where the boom is vertical and has no length.
    robot = robot_of(name)
    found = ks.singularity(robot, [q])
    assert found.distance[0] * robot.singularity.task.column_scales[2] == pytest.approx(
        distance, abs=1e-9
    )
    assert share(robot, found.nearest_singular)[0] < SINGULAR


@pytest.mark.parametrize(
    ('q', 'distance'),
    [
        (
            [2.356241551, -1.5942e-05, 1.570875735, 1.570840278, -3.141796706, 3.141540573],
            0.104804547,
        ),
        (
            [-0.004692928, -3.143760744, 1.567351213, -0.800130882, -0.002582921, -0.768231596],
            0.104110573,
        ),
    ],
)
def test_beside_a_pose_that_errors_leave_all_but_singular_the_nearest_is_found(q, distance):
    # The least singular value is 1e-4, and a saddle; the nearest singular poses are far for that.
    robot = with_errors(PUMA, 1e-4, seed=21)
    found = ks.singularity(robot, [q])
    by_force, _ = brute_force.nearest_singular(robot, np.array([q]), starts=6, known=12)
    assert by_force[0] == pytest.approx(distance, rel=1e-3)
    assert found.distance[0] == pytest.approx(distance, rel=1e-3)


def test_of_two_joints_about_one_axis_none_moves_on_the_way_to_a_singular_pose():
    robot = robot_of('six_joint_dh')
    q = random_poses(robot, 20, seed=5)
    found = ks.singularity(robot, q)
    by_force, _ = brute_force.nearest_singular(robot, q, starts=12)
    near = np.isfinite(found.nearest_singular[:, 0])
    assert np.sum(near) > 10
    assert np.max(share(robot, found.nearest_singular[near])) < SINGULAR
    np.testing.assert_array_equal(found.nearest_singular[near][:, :2], q[near][:, :2])
    assert not np.any(found.distance > TOO_FAR * np.minimum(by_force, 1.0) + 1e-9)


def turned_to(angles, others):
    # The differences of angles, the shortest way.
    return np.remainder(angles - others + math.pi, math.tau) - math.pi


def by_closed_form(q, a3, a4):
    # Of six_joint_dh: axes 3, 4 and 5 are in one plane where theta4 is 0 or pi; besides that it
    # is singular where the last axis lies in the first: theta3 + theta4 + theta5 a multiple of pi,
    # and a3 cos(theta3) + a4 cos(theta3 + theta4) = 0. These curves are sampled.
    distance = np.min(np.abs(turned_to(q[:, 3, None], [0.0, math.pi])), axis=1)
    theta3 = np.linspace(-math.pi, math.pi, 4001)
    cosine = -a3 / a4 * np.cos(theta3)
    theta3, cosine = theta3[np.abs(cosine) <= 1.0], cosine[np.abs(cosine) <= 1.0]
    curves = np.concatenate(
        [
            np.stack([theta3, both - theta3, whole - both], axis=1)
            for both in (np.arccos(cosine), -np.arccos(cosine))
            for whole in (0.0, math.pi)
        ]
    )
    on_curves = [np.min(np.linalg.norm(turned_to(curves, one), axis=1)) for one in q[:, [2, 3, 4]]]
    return np.minimum(distance, on_curves)


@pytest.mark.parametrize(
    ('name', 'a3', 'a4'), [('six_joint_dh', 0.4, 0.35), ('six_joint_dh_unit', 1.0, 1.0)]
)
def test_where_all_singular_poses_are_known_by_hand_the_nearest_is_found(name, a3, a4):
    robot = robot_of(name)
    q = random_poses(robot, 120, seed=9)
    found, true = ks.singularity(robot, q), by_closed_form(q, a3, a4)
    # The samples of the curves are up to 5e-3 rad apart; where two places of them are nearly as
    # near the other one may be found.
    apart = found.distance - np.minimum(true, 1.0)
    assert np.all(apart > -2e-3)
    assert np.all(apart < 0.02 * true)


@pytest.mark.parametrize(
    ('name', 'joint', 'position'),
    [
        ('six_joint_dh', 3, 0.0),
        ('so101', 2, math.atan2(0.0052, 0.1349) - math.atan2(0.11257, 0.028)),
    ],
)
def test_where_one_joint_alone_is_singular_it_is_no_farther_than_that_joint(name, joint, position):
    robot = robot_of(name)
    random = np.random.default_rng(3)
    q = random_poses(robot, 200, seed=4)
    away = random.uniform(-1.2, 1.2, len(q))
    q[:, joint] = position + away
    for found in (ks.singularity(robot, q), along(robot, q)):
        assert np.all(found.distance <= np.minimum(np.abs(away), 1.0) + 1e-6)
        only = np.abs(found.nearest_singular - q)
        only[:, joint] = 0.0
        alone = np.max(only, axis=1) < ROUND_OFF
        assert np.sum(alone) > 100
        np.testing.assert_allclose(found.distance[alone], np.abs(away[alone]), atol=ROUND_OFF)
        assert np.max(share(robot, found.nearest_singular[alone])) < 1e-11


# Axes 2, 3 and 4 are parallel but for errors: sheets become curves that nearly meet, and poses
# are known beside them, not all along.
PARALLEL = (
    (0.0304, math.pi / 2, -0.149),
    (0.116, 0.0, 0.0),
    (0.135, 0.0, 0.0),
    (0.0, math.pi / 2, -0.0002),
    (-0.0002, math.pi / 2, -0.159),
)


@pytest.mark.slow
@pytest.mark.parametrize('error', [1e-5, 1e-2])
def test_with_errors_of_parallel_axes_the_nearest_is_found_as_well(error):
    robot = with_errors(PARALLEL, error, seed=1)
    q = np.concatenate([random_poses(robot, 16, seed=7), brute_force.saddles(robot, 6)])
    found = ks.singularity(robot, q)
    by_force, _ = brute_force.nearest_singular(robot, q, starts=6, known=6)
    assert np.all(found.distance <= TOO_FAR * np.minimum(by_force, 1.0) + 1e-9)


@pytest.mark.slow
@pytest.mark.parametrize('name', ['calibrated UR5', 'kinova_gen3', 'rpprr'])
def test_at_any_range_it_is_the_true_one(name):
    robot = ARMS[name]()
    q = random_poses(robot, 12, seed=12)
    found = ks.singularity(robot, q)
    by_force, _ = brute_force.nearest_singular(robot, q, starts=8, known=8)
    true = np.minimum(by_force, 1.0)
    assert np.all(found.distance <= TOO_FAR * true + 1e-9)
    assert np.all(found.level[true < 0.03] > ks.Level.OK)


@pytest.mark.parametrize(
    ('name', 'q', 'distance'),
    [
        (
            'kuka_iiwa14',
            [
                *(1.000454686, -0.166750755, 2.433674785, -0.140546661),
                *(0.078952724, -1.442820237, -1.575904922),
            ],
            0.140547,
        ),
        (
            'kinova_gen3',
            [
                *(-2.208270951, -0.580489479, -1.362282835, -2.50153292),
                *(-2.003181283, -0.436581089, -0.666119892),
            ],
            0.597350,
        ),
    ],
)
def test_alone_and_in_a_batch_the_same_pose_is_found(name, q, distance):
    robot = without_factors(name)
    alone = ks.singularity(robot, q)
    assert alone.distance == pytest.approx(distance, rel=1e-4)
    assert share(robot, alone.nearest_singular) < SINGULAR
    assert ks.singularity(robot, [q]).distance[0] == alone.distance
    # A command and a state that is measured later ask alone, too.
    later = singularity_of(ks.evaluate(robot, q))
    assert later.distance == alone.distance


def test_a_threshold_of_one_radian_is_left_where_it_is_at_least_that():
    robot = ks.robot_from_text(
        'robot: far\nsource: test\nconvention: standard\n'
        'joints:\n  - {name: j1, variable: q1, type: revolute}\n'
        '  - {name: j2, variable: q2, type: revolute}\n'
        'links:\n  - {a: 1, alpha: 0, d: 0, theta: q1}\n  - {a: 1, alpha: 0, d: 0, theta: q2}\n'
        'singularity: {measure: distance, warn: 1.0, stop: 0.8}\n'
    )
    levels = [ks.singularity(robot, [0.0, q2]).level for q2 in (1.2, 0.95, 0.7)]
    assert levels == [ks.Level.OK, ks.Level.WARN, ks.Level.ERROR]
    # Hysteresis would leave them at 1.5 and 1.2 rad, which it never says.
    for level in (ks.Level.WARN, ks.Level.ERROR):
        assert robot.singularity.thresholds.level(1.0, level) is ks.Level.OK
        assert robot.singularity.thresholds.level(0.99, level) is not ks.Level.OK


@pytest.mark.parametrize('name', ['kinova_gen3', 'gen3_lite', 'kuka_iiwa14'])
def test_each_pose_of_a_batch_has_a_search_of_its_own(name):
    # Along a motion each would begin with what the last one found; in another order it cannot.
    robot = robot_of(name)
    random = np.random.default_rng(2)
    way = random.normal(size=robot.dof)
    begin = random.uniform(-0.5, 0.5, robot.dof)
    q = begin + 0.004 * np.arange(100)[:, None] * way / np.linalg.norm(way)
    order = random.permutation(len(q))
    along, mixed = ks.singularity(robot, q), ks.singularity(robot, q[order])
    assert len(np.unique(along.distance)) > 50
    assert np.array_equal(along.distance[order], mixed.distance)
    assert np.array_equal(along.nearest_singular[order], mixed.nearest_singular)


BESIDE_SHEETS = [-2.2151, 0.1521, -2.3128, 0.169, 0.25, -0.6411, -0.9194]


def test_between_two_sheets_the_nearer_one_is_found():
    found = ks.singularity(robot_of('kuka_iiwa14'), [BESIDE_SHEETS])
    assert found.distance[0] == pytest.approx(0.1690, abs=1e-4)


@pytest.mark.parametrize('q2', [1.001, 1.4, math.pi / 2, 2.1])
def test_beyond_one_radian_none_is_found(q2):
    found = ks.singularity(robot_of('planar_2r'), [[0.4, q2], [0.4, 0.5]])
    np.testing.assert_allclose(found.distance, [1.0, 0.5], rtol=1e-9)
    assert np.all(np.isnan(found.nearest_singular[0]))
    assert found.level[0] == ks.Level.OK
    assert 'none found within 1 rad' in repr(ks.singularity(robot_of('planar_2r'), [0.4, q2]))


@pytest.mark.parametrize('name', ['puma560', 'kuka_iiwa14', 'craig_3r'])
@pytest.mark.parametrize('fastest', [0.3, 3.0])
def test_a_motion_is_followed_in_few_evaluations(name, fastest):
    robot = ARMS.get(name, lambda: robot_of(name))()
    q, search = motion(robot, fastest)[:800], kernel.NearestSearch(robot.singularity.arm)
    live, alone = along(robot, q, search), ks.singularity(robot, q[::8])
    assert np.all(live.distance[::8] <= TOO_FAR * alone.distance + 1e-9)
    assert np.all(alone.distance <= TOO_FAR * live.distance[::8] + 1e-9)
    assert search.evaluations < (20 if fastest < 1.0 else 80) * len(q)


def test_starts_reach_what_many_more_reach():
    robot = with_errors(UR5, 1e-3, 2)
    q = random_poses(robot, 40)
    many = along(robot, q, kernel.NearestSearch(robot.singularity.arm, 600)).distance
    assert np.all(ks.singularity(robot, q).distance <= TOO_FAR * many)


def test_after_a_jump_nothing_is_left_of_the_motion():
    robot = ARMS['calibrated UR5']()
    q = motion(robot, 1.0)[::150]
    alone, found = ks.singularity(robot, q), along(robot, q)
    for name in ('distance', 'nearest_singular', 'level'):
        np.testing.assert_array_equal(getattr(found, name), getattr(alone, name))


FACTORED = [
    *('craig_3r', 'parallelogram_left', 'puma560', 'rrp_elementary', 'ur5e'),
    'offset_stanford_printed',
]


@pytest.mark.parametrize('name', FACTORED)
def test_no_factor_of_a_file_has_a_zero_nearer_than_is_said(name):
    robot, random = robot_of(name), np.random.default_rng(23)
    q = random_poses(robot, 300, seed=23)
    turns = np.array(robot.joint_types) == 'revolute'
    q[:150, turns] = (math.pi / 4 * random.integers(-4, 5, (150, robot.dof)))[:, turns]
    q[50:150] += random.normal(size=(100, robot.dof)) * 0.03
    found = ks.singularity(robot, q)
    # Up to 5 % nearer than it says, no factor has another sign in any direction.
    far = found.distance > 1e-6
    q, radius = q[far], found.distance[far] / TOO_FAR
    here = robot.singularity.factors.evaluate(q)[..., 0]
    for _ in range(150):
        way = random.normal(size=q.shape)
        way *= (radius * random.uniform(size=len(q)) ** 0.3 / np.linalg.norm(way, axis=1))[:, None]
        there = robot.singularity.factors.evaluate(q + way * robot.singularity.task.column_scales)[
            ..., 0
        ]
        assert np.all(there * here > 0.0)


@pytest.mark.slow
@pytest.mark.parametrize('error', [1e-5, 1e-4, 1e-3])
def test_where_two_singular_values_vanish_together_a_plan_finds_no_nearer_one(error):
    # The wrist is stretched or folded there, but for the errors, and shoulder or elbow often, too.
    robot = with_errors(PUMA, error, seed=5)
    random = np.random.default_rng(6)
    q = math.pi / 4 * random.integers(-4, 5, (100, 6)).astype(float)
    q[:, 4] = math.pi * random.integers(0, 2, 100)
    found = ks.singularity(robot, q)
    for pose in q[found.distance > 0.1]:
        check = ks.check_plan(robot, [0.0], [pose], distance=0.1)
        assert check.singularity.verdict != 'refuted'


@pytest.mark.parametrize('name', ['craig_3r', 'rrp_elementary'])
def test_singular_poses_are_inside_limits_and_singular(name):
    robot = robot_of(name)
    inside = np.array([[-1.0, 1.0], [0.5, 2.0], [-0.7, 0.3]])
    q = singular_poses(robot, inside)
    assert np.all((q >= inside[:, 0]) & (q <= inside[:, 1]))
    assert np.max(share(robot, q)) < SINGULAR
    assert len(q) > 30
    np.testing.assert_array_equal(q, singular_poses(robot, inside))
    assert len(singular_poses(robot_of('five_bar'), inside[:2])) == 0


def test_an_arm_that_is_never_singular_has_none():
    text = 'robot: one\nsource: t\nconvention: standard\njoints:\n  - {name: a, type: revolute}\n'
    robot = ks.robot_from_text(text + 'links:\n  - {a: 1, alpha: 0, d: 0, theta: a}\n')
    assert ks.singularity(robot, [0.3]).distance == 1.0


def test_a_nearly_singular_pose_without_one_found_is_warned_of():
    robot = robot_of('puma560')
    found = ks.singularity(robot, [0.1, -1.0, 1.2, 0.5, 0.9, 0.7])
    nearly = dataclasses.replace(
        found, condition_number=2e4, distance=1.0, nearest_singular=None, level=ks.Level.WARN
    )
    text = singularity_status(robot, nearly, ks.Level.WARN, 'base').sentence
    for words in ('nearly singular', '2e+04', 'within 0.1 rad', 'within 1 rad'):
        assert words in text


@pytest.mark.parametrize('name', ['four_bar_arm', 'flexpicker', 'five_bar'])
def test_with_closed_loops_the_nearest_of_all_that_are_known_is_found(name):
    # Each singular pose that any of the searches found is a candidate for all other poses.
    robot = robot_of(name)
    low, high = np.clip(robot.limits, -math.pi, math.pi).T
    q = np.random.default_rng(11).uniform(low, high, (300, robot.dof))
    q = q[closes_at(robot.chain, q)]
    found = ks.singularity(robot, q)
    known = found.nearest_singular[np.isfinite(found.distance) & (found.distance < 1.0)]
    _, reach, period = robot.singularity.arm.spans.T
    motions = (known - q[:, None]) / robot.singularity.task.column_scales
    turns = np.where(np.isfinite(period), period, 1.0)
    motions -= np.where(np.isfinite(period), turns * np.round(motions / turns), 0.0)
    nearest = np.min(np.linalg.norm(motions[..., reach > 0.0], axis=2), axis=1)
    true = np.minimum(nearest, found.distance)
    too_far = found.distance > TOO_FAR * true + ROUND_OFF
    assert np.sum(true < 1.0) > 130
    assert np.sum(too_far) <= 0.005 * len(q)
    assert not np.any(too_far & (true < 0.05))


@pytest.mark.parametrize('name', ['five_bar', 'four_bar_arm'])
def test_with_closed_loops_what_is_found_is_a_pose_and_singular(name):
    # Where a branch of the loops ends, they do not close beyond it.
    robot = robot_of(name)
    low, high = np.clip(robot.limits, -math.pi, math.pi).T
    q = np.random.default_rng(3).uniform(low, high, (100, robot.dof))
    called = ks.singularity(robot, q[closes_at(robot.chain, q)]).nearest_singular
    called = called[np.isfinite(called[:, 0])]
    assert len(called) > 20
    assert np.max([ks.singularity(robot, pose).distance for pose in called]) < 1e-4


@pytest.mark.parametrize('error', [1e-5, 1e-3])
def test_a_pose_that_is_called_singular_is_so_when_it_is_asked_again(error):
    robot = with_errors(IIWA_ROWS, error, 1)
    q = np.random.default_rng(1).uniform(-2.9, 2.9, (200, robot.dof))
    called = ks.singularity(robot, q).nearest_singular
    called = called[np.isfinite(called[:, 0])]
    assert len(called) > 100
    assert np.max(ks.singularity(robot, called).distance) < 1e-6
    for pose in called[:40]:
        assert ks.singularity(robot, pose).distance < 1e-6


@pytest.mark.parametrize('angle', [0.0, math.pi, -math.pi])
def test_a_jacobian_that_vanishes_altogether_is_singular(angle):
    # The crank is in line with its rod. The only singular value is 0 there, and its own largest.
    robot = robot_of('crank_slider')
    found = ks.singularity(robot, [angle])
    assert found.distance == 0.0
    assert found.level.name == 'ERROR'
    assert found.rank == 0
    for away in (1e-9, 1e-6, 1e-3):
        assert ks.singularity(robot, [angle + away]).distance == pytest.approx(away, rel=1e-4)


def test_one_row_of_a_planar_arm_vanishes_where_both_links_lie_along_it():
    text = """
robot: planar
convention: standard
joints: [{name: q1, type: revolute}, {name: q2, type: revolute}]
links: [{alpha: 0, a: 0.4, d: 0, theta: q1}, {alpha: 0, a: 0.3, d: 0, theta: q2}]
singularity: {task: [x]}
"""
    robot = ks.robot_from_text(text)
    for q in ([0.0, 0.0], [math.pi, 0.0], [0.0, math.pi]):
        assert ks.singularity(robot, q).distance == 0.0
    for q in ([1e-7, 2e-7], [0.05, 0.02], [0.2, -0.1]):
        assert ks.singularity(robot, q).distance == pytest.approx(np.linalg.norm(q), rel=1e-5)


@pytest.mark.parametrize('turns', [0, 100_000])
def test_beyond_the_largest_positions_nothing_is_searched(turns):
    # The last digits of such positions are too coarse, also beside a singular pose.
    q = np.array([0.1 + math.tau * turns, -1.2, 1.1, 0.3, 1e-6, 0.2])
    found = ks.singularity(robot_of('ur5e'), q)
    assert (found.nearest_singular is None) == (turns > 0)
    assert found.level.name == ('WARN' if turns else 'ERROR')
