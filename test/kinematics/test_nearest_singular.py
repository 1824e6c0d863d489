"""The singular pose nearest to a pose, against brute force."""

import math

import brute_force
import numpy as np
import pytest
from arms import elementary_arm, first_order_distances, random_poses, robot_of, without_factors
from brute_force import judged_poses
from calibrated import UR5, calibrated_ur5, with_errors

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.estimation.status_text import singularity_status
from kinematics_service.kinematics.singularity import (
    measured_before,
    measured_in_order,
    singularity_of,
)

# What a search that ended says is singular: the least singular value as a share of the largest.
SINGULAR = 2e-7
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
# Random poses of each arm that brute force judges, and a quarter as many saddles.
RANDOM = 32

ARMS = {
    'craig_3r': lambda: robot_of('craig_3r'),
    'puma560': lambda: robot_of('puma560'),
    'ur5e': lambda: robot_of('ur5e'),
    'so101': lambda: robot_of('so101'),
    'ur5e without factors': lambda: without_factors('ur5e'),
    'offset_stanford_dh': lambda: without_factors('offset_stanford_dh'),
    'parallelogram_left': lambda: without_factors('parallelogram_left'),
    'panda': lambda: without_factors('panda'),
    'kinova_gen3': lambda: without_factors('kinova_gen3'),
    'calibrated UR5': lambda: calibrated_ur5(1),
    'four joints': lambda: robot_of('standard-4-0'),
    'five joints': lambda: robot_of('modified-5-0'),
    'six joints': lambda: robot_of('shape-6-0'),
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
every_arm = pytest.mark.parametrize('name', ARMS)


def share(robot, q):
    # The singular value that singular poses lack, as a share of the largest, by numpy.
    s = np.linalg.svd(brute_force.scaled_jacobian(robot, q), compute_uv=False)
    return s[..., robot.task.generic_rank - 1] / s[..., 0]


@pytest.mark.slow
@every_arm
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
    far = (true > 0.2) & found.decided
    assert np.all(found.level[far] == ks.Level.OK)
    # Beside a saddle branches cross, and the second nearest one may be found.
    near = there & (true < 0.1) & (np.arange(len(q)) < RANDOM)
    np.testing.assert_allclose(found.distance[near], true[near], rtol=FOUND, atol=1e-7)


@pytest.mark.slow
@every_arm
def test_what_is_found_is_singular_and_as_far_as_it_says(name):
    robot = ARMS[name]()
    q = judged_poses(robot, 200)
    found = ks.singularity(robot, q)
    there = np.isfinite(found.nearest_singular[:, 0])
    assert np.sum(there) > 0
    assert np.max(share(robot, found.nearest_singular[there])) < SINGULAR
    way = (found.nearest_singular[there] - q[there]) / robot.task.column_scales
    distance = np.minimum(np.linalg.norm(way, axis=1), math.pi)
    np.testing.assert_allclose(found.distance[there], distance, rtol=1e-9, atol=1e-12)
    # Nearer than the horizon either one was found, or none is said to be near.
    lost = ~there & (found.distance < 0.1)
    assert not np.any(found.decided[lost])


def test_a_pose_between_two_branches_of_a_broken_family():
    # The first-order estimate is 0.115 here: no warning.
    robot = robot_of('kinova_gen3')
    q = [
        *(-2.7854390445630877, -1.8356412764871797, -2.8008966579309162, -0.004736943881479938),
        *(-2.202519851462171, -0.0056163518339347185, 0.7092176331702467),
    ]
    found = ks.singularity(robot, q)
    assert found.distance == pytest.approx(0.0280, abs=1e-4)
    assert found.level is ks.Level.ERROR
    assert found.decided
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
    assert found.decided
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
    assert found.decided
    assert share(robot, found.nearest_singular) < SINGULAR
    # A second road comes as near: from where it was found, and from beside.
    starts = np.random.default_rng(4).normal(size=(12, robot.dof)) * 0.3 * distance
    starts[0] = 0.0
    starts += found.nearest_singular - q
    away, _ = brute_force.descend(robot, np.tile(q, (12, 1)), starts)
    assert np.min(away) == pytest.approx(distance, rel=1e-2)


def test_a_nearer_one_that_is_not_excluded_is_warned_of():
    # Brute force finds one 0.018 rad away, the search 0.145.
    q = [
        *(-1.237149681, 0.012586181, -0.016897593, 0.006425746),
        *(-1.469670128, 1.78463578, -0.254302367),
    ]
    found = ks.singularity(robot_of('kinova_gen3'), q)
    assert not found.decided
    assert found.level > ks.Level.OK


# Poses of a motion, 2 ms apart, and the share of them that may differ by more than SAME from
# those that are searched alone; by how much any may be farther. A search of its own misses the
# nearest singular pose now and then, too.
ALONG, SAME, DIFFERENT, FARTHER = 3000, 2e-3, 0.02, 0.11


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
        measured_in_order(ks.evaluate(robot, q), search or kernel.NearestSearch(robot.arm))
    )


@pytest.mark.slow
@pytest.mark.parametrize('fastest', [0.3, 1.0])
@pytest.mark.parametrize(
    'name',
    ['ur5e', 'ur5e without factors', 'so101', 'calibrated UR5', 'panda', 'kinova_gen3', 'rpprr'],
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
    np.testing.assert_array_equal(found.decided, alone.decided)


def test_along_a_motion_few_poses_are_evaluated():
    robot = ARMS['ur5e without factors']()
    q = motion(robot, 0.3)
    counts = {}
    for kept in (True, False):
        search, counts[kept] = kernel.NearestSearch(robot.arm), 0
        for pose in q:
            search = search if kept else kernel.NearestSearch(robot.arm)
            along(robot, pose[None], search)
            counts[kept] += search.evaluations
    assert 0 < counts[True] < 0.6 * counts[False]


@pytest.mark.parametrize(('name', 'most'), [('six joints', 7.0), ('kinova_gen3', 8.5)])
def test_of_a_fast_motion_each_pose_is_few_evaluations(name, most):
    # Five times as far from message to message as at 500 Hz.
    robot = ARMS[name]()
    search, counts = kernel.NearestSearch(robot.arm), []
    for pose in motion(robot, 1.0)[::5]:
        along(robot, pose[None], search)
        counts.append(search.evaluations)
    assert np.mean(counts) < most


def test_runs_that_go_round_what_is_all_but_singular_end():
    # The elbow of this arm misses singular poses by the errors. All such runs followed: 16.8.
    robot = with_errors(PUMA, 1e-5, seed=1)
    counts = []
    for pose in random_poses(robot, 300):
        search = kernel.NearestSearch(robot.arm)
        along(robot, pose[None], search)
        counts.append(search.evaluations)
    assert np.mean(counts) < 15.0


def test_after_a_jump_nothing_is_left_of_the_motion():
    robot = ARMS['calibrated UR5']()
    q = motion(robot, 1.0)[::500]
    alone, found = ks.singularity(robot, q), along(robot, q)
    for name in ('distance', 'nearest_singular', 'decided', 'level'):
        np.testing.assert_array_equal(getattr(found, name), getattr(alone, name))


def test_pieces_of_a_motion_are_the_motion():
    robot = ARMS['ur5e without factors']()
    q, search = motion(robot, 1.0), kernel.NearestSearch(robot.arm)
    whole = along(robot, q)
    parts = [along(robot, part, search) for part in np.array_split(q, [1, 2, 700, 701, 1900])]
    for name in ('distance', 'nearest_singular', 'decided', 'level'):
        pieces = np.concatenate([getattr(part, name) for part in parts])
        np.testing.assert_array_equal(pieces, getattr(whole, name))


def test_a_search_that_may_evaluate_little_says_that_it_is_not_decided():
    robot = ARMS['kinova_gen3']()
    q = random_poses(robot, 300)
    search = kernel.NearestSearch(robot.arm)
    search.budget = 4
    few = singularity_of(measured_in_order(ks.evaluate(robot, q), search))
    assert np.sum(~few.decided) > 20 + np.sum(~ks.singularity(robot, q).decided)


def test_one_pose_has_a_pose_or_none():
    robot = robot_of('ur5e')
    near = ks.singularity(robot, [0.1, -1.0, 1.2, 0.5, 0.05, 0.7])
    # The wrist alone is stretched.
    np.testing.assert_allclose(near.nearest_singular, [0.1, -1.0, 1.2, 0.5, 0.0, 0.7], atol=1e-9)
    assert near.distance == pytest.approx(0.05, abs=1e-9)
    assert near.decided is True
    far = ks.singularity(robot, [0.1, -1.0, 1.2, 0.5, 1.3, 0.7])
    assert far.nearest_singular is None
    assert far.distance > 0.2
    at = ks.singularity(robot, [0.1, -1.0, 1.2, 0.5, 0.0, 0.7])
    np.testing.assert_array_equal(at.nearest_singular, [0.1, -1.0, 1.2, 0.5, 0.0, 0.7])


@pytest.mark.parametrize('name', ['ur5e', 'ur5e without factors', 'kinova_gen3', 'four joints'])
def test_the_rate_is_how_the_distance_changes(name):
    robot = ARMS[name]()
    q = random_poses(robot, 2000, seed=1)
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
    assert found.decided
    assert found.distance_at_least is False


@pytest.mark.parametrize('q2', [1.001, 1.4, math.pi / 2, 2.1])
def test_beyond_one_radian_it_says_at_least(q2):
    found = ks.singularity(robot_of('planar_2r'), [[0.4, q2], [0.4, 0.5]])
    np.testing.assert_array_equal(found.distance_at_least, [True, False])
    np.testing.assert_allclose(found.distance, [1.0, 0.5], rtol=1e-9)
    assert np.all(np.isnan(found.nearest_singular[0]))
    assert found.level[0] == ks.Level.OK


def test_of_a_wrist_that_is_stretched_it_is_no_more_than_its_angle():
    q = random_poses(robot_of('ur5e'), 3000, seed=4)
    elbow, wrist = (np.abs(q[:, j] - math.pi * np.round(q[:, j] / math.pi)) for j in (2, 4))
    for robot in (robot_of('ur5e'), without_factors('ur5e')):
        found = ks.singularity(robot, q)
        too_far = found.distance > 1.1 * np.minimum(np.minimum(elbow, wrist), 1.0)
        assert not np.any(too_far & found.decided)


@pytest.mark.slow
@pytest.mark.parametrize('name', ['ur5e', 'craig_3r', 'planar_3r', 'offset_stanford_printed'])
def test_where_a_file_lists_all_factors_the_nearest_is_always_found(name):
    robot = robot_of(name)
    assert robot.factors.complete
    q = np.concatenate([random_poses(robot, 30, seed=9), brute_force.saddles(robot, 20)])
    found = ks.singularity(robot, q)
    by_force, _ = brute_force.nearest_singular(robot, q, starts=8, known=8)
    assert np.all(found.decided)
    assert np.all(found.distance <= 1.1 * np.minimum(by_force, 1.0) + 1e-9)
    assert np.all(found.distance_at_least[np.minimum(by_force, found.distance) > 1.0])


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
    assert robot.factors.complete
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
    assert found.decided
    assert found.distance == pytest.approx(distance, rel=1e-3)
    assert share(robot, found.nearest_singular) < SINGULAR


def test_a_pose_that_the_atlas_knows_is_an_answer():
    # Elbow and shoulder are all but singular together, by three thousandths of the largest value:
    # each way along singular poses leads to where none is.
    robot = with_errors(PUMA, 1e-3, seed=1)
    q = [2.241888300, -1.704260800, 1.680749280, 0.263700540, -1.814653130, 0.482440890]
    for found in (ks.singularity(robot, q), ks.singularity(robot, [q])):
        assert np.max(found.distance) < 0.4
        assert not np.any(found.decided)
        assert np.all(share(robot, found.nearest_singular) < SINGULAR)


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
        assert found.decided
    assert share(robot, ks.singularity(robot, q).nearest_singular) < SINGULAR


def test_where_a_file_lists_all_factors_no_determinant_changes_its_sign_nearer():
    robot = robot_of('offset_stanford_printed')
    random = np.random.default_rng(17)
    low, high = np.clip(robot.limits, -np.pi, np.pi).T
    q = random.uniform(low, high, (600, robot.dof))
    # Where its boom is vertical, or stretched, its wrist too, and the factor all but stands.
    q[:, [1, 4]] = math.pi * random.integers(-1, 2, (600, 2))
    q[:, 3] = math.pi / 4 * random.integers(-4, 5, 600)
    q[300:] += random.normal(size=(300, robot.dof)) * 0.1
    found = ks.singularity(robot, q)
    assert np.all(found.decided)
    here = np.sign(np.linalg.det(brute_force.scaled_jacobian(robot, q)))
    within = q[found.distance > 1e-6], here[found.distance > 1e-6]
    radius = 0.9 * found.distance[found.distance > 1e-6]
    for _ in range(120):
        way = random.normal(size=(len(radius), 4))
        way *= (radius / np.linalg.norm(way, axis=1))[:, None]
        there = within[0].copy()
        there[:, 1:5] += way * robot.task.column_scales[1:5]
        assert np.all(np.linalg.det(brute_force.scaled_jacobian(robot, there)) * within[1] > 0.0)


FACTORED = [
    *('craig_3r', 'offset_stanford_dh', 'parallelogram_left', 'planar_2r', 'puma560'),
    *('rrp_elementary', 'ur5e'),
]


@pytest.mark.parametrize('name', FACTORED)
def test_a_factor_of_few_joints_has_no_zero_nearer_than_is_said(name):
    robot, random = robot_of(name), np.random.default_rng(23)
    q = random_poses(robot, 300, seed=23)
    turns = np.array(robot.joint_types) == 'revolute'
    q[:150, turns] = (math.pi / 4 * random.integers(-4, 5, (150, robot.dof)))[:, turns]
    q[50:150] += random.normal(size=(100, robot.dof)) * 0.03
    found = ks.singularity(robot, q)
    assert np.mean(found.decided) > 0.99
    # As far as it says, but for a tenth, in any direction, no factor has another sign.
    far = found.decided & (found.distance > 1e-6)
    q, radius = q[far], found.distance[far] / 1.1
    here = robot.factors.evaluate(q)[..., 0]
    for _ in range(300):
        way = random.normal(size=q.shape)
        way *= (radius * random.uniform(size=len(q)) ** 0.3 / np.linalg.norm(way, axis=1))[:, None]
        there = robot.factors.evaluate(q + way * robot.task.column_scales)[..., 0]
        assert np.all(there * here > 0.0)


@pytest.mark.parametrize('name', [*FACTORED, 'offset_stanford_printed'])
def test_the_proof_of_a_factor_is_refuted_by_no_zero(name):
    # Of radii up to beyond the truth: where samples of the ball have another sign it is none.
    robot, random = robot_of(name), np.random.default_rng(29)
    tape, n = robot.factors.tape, robot.dof
    for q in random_poses(robot, 20, seed=29):
        for f in range(tape.factors):
            counts = np.zeros(n)
            counts[: tape.joints] = tape.dependences[f]
            way = random.normal(size=(4000, n)) * counts
            way *= random.uniform(size=4000)[:, None] ** 0.3 / np.linalg.norm(way, axis=1)[:, None]
            here = robot.factors.evaluate(q[None])[0, f, 0]
            for radius in (0.01, 0.1, 0.3, 0.6, 0.8, 1.0):
                there = robot.factors.evaluate(q + radius * way * robot.task.column_scales)
                least = np.min(there[:, f, 0] * np.sign(here))
                says = kernel.prove_factor(
                    tape, robot.task.kernel_rows, f, counts, q, radius, 5000
                )
                if least <= 0.0:
                    assert says != kernel.PROVED
                elif least > 0.2 * abs(here):
                    assert says == kernel.PROVED


@pytest.mark.parametrize('name', [*FACTORED, 'offset_stanford_printed'])
def test_a_zero_just_inside_the_radius_is_not_proved_away(name):
    robot = robot_of(name)
    tape = robot.factors.tape
    q = random_poses(robot, 250, seed=37)
    found = ks.singularity(robot, q)
    near = np.isfinite(found.nearest_singular[:, 0])
    assert np.sum(near) > 100
    there = np.abs(robot.factors.evaluate(found.nearest_singular[near])[..., 0])
    for one, away, values in zip(q[near], found.distance[near], there):
        f = int(np.argmin(values))
        counts = np.zeros(robot.dof)
        counts[: tape.joints] = tape.dependences[f]
        task = robot.task.kernel_rows
        assert kernel.prove_factor(tape, task, f, counts, one, 1.0005 * away, 300) != kernel.PROVED


@pytest.mark.parametrize(('radius', 'proved'), [(0.5, True), (0.6, True), (0.75, False)])
def test_what_slope_and_curvature_do_not_see_is_not_proved_away(radius, proved):
    # f = 1 + cos 8x + 0.3 sin 4x has a minimum of 0.3 at pi/8 and one below zero at 3 pi/8: its
    # nearest zero is 0.6898 away. cos 8x is written as c*c - s*s.
    task = robot_of('planar_2r').task.kernel_rows
    one, c, s, share = (kernel.CONSTANT, 0, 0), (kernel.COSINE, 0, 0), (kernel.SINE, 0, 0), 0.3
    steps = [
        (kernel.JOINT, 1, 0),
        *(c, s, (kernel.PRODUCT, 1, 1), (kernel.PRODUCT, 2, 2), (kernel.DIFFERENCE, 3, 4)),
        *(one, (kernel.PRODUCT, 6, 2), (kernel.SUM, 5, 7), one, (kernel.SUM, 8, 9)),
    ]
    numbers = np.ones(len(steps))
    numbers[[1, 2, 6]] = 4.0, 4.0, share
    tape = kernel.Tape(np.array(steps).ravel(), numbers, np.array([len(steps) - 1]))
    q = np.array([0.0, math.pi / 8])
    says = kernel.prove_factor(tape, task, 0, np.array([0.0, 1.0]), q, radius, 200)
    assert (says == kernel.PROVED) == proved


X, Y, Z = ('joint', 0), ('joint', 1), ('joint', 2)


def sine(one, number=1.0):
    return (kernel.SINE, one, one, number)


def cosine(one):
    return (kernel.COSINE, one, one, 1.0)


def times(one, other):
    return (kernel.PRODUCT, one, other, 1.0)


def less(one, other):
    return (kernel.DIFFERENCE, one, other, 1.0)


def plus(one, other):
    return (kernel.SUM, one, other, 1.0)


def versine(one):
    return less(('number', 1.0), cosine(one))


def tape_of(expression):
    """Return the tape of an expression, as one factor."""
    steps, numbers = [], []

    def written(one):
        if one[0] == 'joint':
            steps.append((kernel.JOINT, one[1], 0))
        elif one[0] == 'number':
            steps.append((kernel.CONSTANT, 0, 0))
        else:
            steps.append((one[0], written(one[1]), written(one[2])))
        numbers.append(one[3] if len(one) == 4 else one[1] if one[0] == 'number' else 1.0)
        return len(steps) - 1

    last = written(expression)
    return kernel.Tape(np.array(steps).ravel(), np.array(numbers), np.array([last]))


@pytest.mark.parametrize(
    'third_order',
    [
        # Each has one kind of third derivatives at q = 0, and nothing below the third order.
        *(times(versine(X), sine(Y)), times(sine(Y), versine(X))),
        *(times(versine(Y), sine(X)), times(sine(X), versine(Y))),
        *(times(sine(X), times(sine(Y), sine(Z))), times(times(sine(Y), sine(Z)), sine(X))),
        *(times(sine(Y), times(sine(X), sine(Z))), times(times(sine(X), sine(Z)), sine(Y))),
        *(times(sine(Z), times(sine(X), sine(Y))), times(times(sine(X), sine(Y)), sine(Z))),
        sine(times(versine(X), sine(Y))),
        less(sine(X), plus(sine(X, 0.5), sine(X, 0.5))),
        less(cosine(plus(sine(X), versine(Y))), cosine(X)),
        less(cosine(plus(sine(Y), versine(X))), cosine(Y)),
        less(cosine(plus(sine(X), times(sine(Y), sine(Z)))), cosine(X)),
        less(cosine(plus(sine(Y), times(sine(X), sine(Z)))), cosine(Y)),
        less(cosine(plus(sine(Z), times(sine(X), sine(Y)))), cosine(Z)),
        times(cosine(Z), times(versine(X), sine(Y))),
        times(times(versine(X), sine(Y)), cosine(Z)),
    ],
)
def test_each_kind_of_third_derivatives_counts_in_a_proof(third_order):
    task = robot_of('planar_3r').task.kernel_rows
    tape, joints = tape_of(plus(('number', 1e-4), third_order)), np.zeros(3)
    joints[: tape.joints] = tape.dependences[0]
    # The least of x*x*y/2 and of x*y*z on a ball, and of x^3/8 on a line: by hand.
    share = 1 / 8 if np.sum(joints) == 1 else math.sqrt(3) / 9
    nearest = (1e-4 / share) ** (1 / 3)
    way = np.random.default_rng(5).normal(size=(20_000, 3)) * joints
    way *= 1.02 * nearest / np.linalg.norm(way, axis=1)[:, None]
    values = np.empty((len(way), 1, 4))
    kernel.evaluate_factors(tape, way, values)
    assert np.min(values[:, 0, 0]) < 0.0
    says = [
        kernel.prove_factor(tape, task, 0, joints, np.zeros(3), radius, 200)
        for radius in (0.6 * nearest, 1.02 * nearest)
    ]
    assert says[0] == kernel.PROVED
    assert says[1] != kernel.PROVED


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
    assert found.decided
    assert found.distance[0] * robot.task.column_scales[2] == pytest.approx(distance, abs=1e-9)
    assert share(robot, found.nearest_singular)[0] < SINGULAR


def test_a_factor_that_cannot_be_bounded_decides_nothing():
    # Newton's method finds no zero of a root; its derivatives have no bound there.
    text = (
        'robot: rooted\nsource: test\nconvention: standard\n'
        'joints:\n  - {name: j1, variable: q1, type: revolute}\n'
        '  - {name: j2, variable: q2, type: revolute}\n'
        'links:\n  - {a: 1, alpha: 0, d: 0, theta: q1}\n  - {a: 1, alpha: 0, d: 0, theta: q2}\n'
        'singularity:\n  factors:\n    - {name: elbow, expression: sqrt(1 - cos(q2)*cos(q2))}\n'
    )
    robot = ks.robot_from_text(text)
    assert robot.factors.complete
    for found in (ks.singularity(robot, [0.2, 0.5]), ks.singularity(robot, [[0.2, 0.5]])):
        assert not np.any(found.decided & (found.distance > 0.55))


def test_without_boxes_for_its_proof_nothing_is_decided_and_with_them_the_nearest_is_found():
    # The slope leads to the elbow, 0.0275 away; the shoulder's zero is behind a saddle.
    robot = robot_of('puma560')
    q = np.array([SADDLES_OF_FACTORS[-1][1]])
    for boxes, decided, distance in ((0, False, 0.027515416), (200, True, 0.023801056)):
        search = kernel.NearestSearch(robot.arm)
        search.boxes = boxes
        found = along(robot, q, search)
        assert found.distance[0] == pytest.approx(distance, rel=1e-6)
        assert found.decided[0] == decided


def test_along_a_motion_what_is_decided_is_not_beyond_the_truth_by_more_than_a_tenth():
    # What is proved at one pose holds at the next ones but for what the joints have moved.
    robot = robot_of('ur5e')
    for q in short_motions(robot, seed=3):
        live, alone = along(robot, q), ks.singularity(robot, q)
        true = np.minimum(alone.distance, 1.0)
        assert not np.any(live.decided & (live.distance > 1.1 * true + 1e-9))


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
        (
            [-1.569611169, 0.000351174, 1.586361788, -1.587427964, 3.1399146, -0.00569261],
            0.119015869,
        ),
    ],
)
def test_beside_a_pose_that_errors_leave_all_but_singular_the_nearest_is_found(q, distance):
    # The least singular value is 1e-4, and a saddle; the nearest singular poses are far for that.
    robot = with_errors(PUMA, 1e-4, seed=21)
    found = ks.singularity(robot, [q])
    by_force, _ = brute_force.nearest_singular(robot, np.array([q]), starts=24, known=12)
    assert by_force[0] == pytest.approx(distance, rel=1e-3)
    assert found.decided
    assert found.distance[0] == pytest.approx(distance, rel=1e-3)


def test_of_two_joints_about_one_axis_none_moves_on_the_way_to_a_singular_pose():
    robot = robot_of('six_joint_dh')
    q = random_poses(robot, 40, seed=5)
    found = ks.singularity(robot, q)
    by_force, _ = brute_force.nearest_singular(robot, q, starts=6, known=6)
    near = np.isfinite(found.nearest_singular[:, 0])
    assert np.sum(near) > 20
    assert np.max(share(robot, found.nearest_singular[near])) < SINGULAR
    # Before a run ends elimination may turn them by a little, which changes nothing.
    np.testing.assert_allclose(found.nearest_singular[near][:, :2], q[near][:, :2], atol=1e-3)
    assert not np.any(found.decided & (found.distance > 1.1 * np.minimum(by_force, 1.0) + 1e-9))


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
    q = random_poses(robot, 400, seed=9)
    found, true = ks.singularity(robot, q), by_closed_form(q, a3, a4)
    # The samples of the curves are up to 5e-3 rad apart; where two places of them are nearly as
    # near the other one may be found.
    apart = found.distance - np.minimum(true, 1.0)
    assert np.all(apart > -2e-3)
    assert np.all(apart < 0.02 * true)
    assert np.all(found.decided)


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
        alone = np.max(only, axis=1) == 0.0
        assert np.sum(alone) > 100
        np.testing.assert_allclose(found.distance[alone], np.abs(away[alone]), atol=1e-6)
        assert np.max(share(robot, found.nearest_singular[alone])) < 1e-11


def test_curves_of_singular_poses_take_few_evaluations():
    # 11 before their poses were known all along them.
    robot, evaluations = robot_of('six_joint_dh'), 0
    search = kernel.NearestSearch(robot.arm)
    for pose in random_poses(robot, 100, seed=6):
        search.forget()
        along(robot, pose[None], search)
        evaluations += search.evaluations
    assert evaluations < 400


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
@pytest.mark.parametrize('error', [0.0, 1e-5, 1e-2])
def test_with_errors_of_parallel_axes_the_nearest_is_found_as_well(error):
    robot = with_errors(PARALLEL, error, seed=1)
    q = np.concatenate([random_poses(robot, 40, seed=7), brute_force.saddles(robot, 14)])
    found = ks.singularity(robot, q)
    by_force, _ = brute_force.nearest_singular(robot, q, starts=6, known=6)
    far = found.distance > 1.1 * np.minimum(by_force, 1.0) + 1e-9
    assert not np.any(far & found.decided)


def test_where_none_is_found_and_it_is_not_decided_no_number_is_given():
    # Two singular values all but vanish together: each run goes round there.
    robot = robot_of('kinova_gen3')
    q = [2.067041, 1.958902, -2.125402, -3.097502, 2.482926, 1.026782, -1.358374]
    for found in (ks.singularity(robot, q), ks.singularity(robot, [q])):
        assert found.distance == 1.0
        assert not found.decided
        assert not found.distance_at_least
        assert found.distance_unknown
        # The first order says that one is nearer than the warning.
        assert found.level == ks.Level.WARN
    assert 'not decided' in repr(ks.singularity(robot, q))
    # What an audit keeps of it says the same.
    kept = found.distance, found.nearest_singular, found.decided
    assert singularity_of(measured_before(ks.evaluate(robot, [q]), *kept)).distance_unknown
    text = singularity_status(robot, ks.singularity(robot, q), ks.Level.WARN, 'base').sentence
    assert text.startswith('it is not decided whether a singularity is near')
    assert 'farther' not in text
    assert 'distance' not in text


# Of random poses so many may be said to be farther than 1.1 times the truth although decided.
MISSED_NEAR, MISSED_FAR = 0, 1


@pytest.mark.slow
@pytest.mark.parametrize(
    'name', ['ur5e without factors', 'calibrated UR5', 'kinova_gen3', 'six joints', 'rpprr']
)
def test_at_any_range_it_is_the_true_one(name):
    robot = ARMS[name]()
    q = random_poses(robot, 32, seed=12)
    found = ks.singularity(robot, q)
    by_force, _ = brute_force.nearest_singular(robot, q, starts=8, known=8)
    true = np.minimum(by_force, 1.0)
    far = (found.distance > 1.1 * true + 1e-9) & found.decided
    assert np.sum(far & (true < 0.2)) <= MISSED_NEAR
    assert np.sum(far) <= MISSED_FAR
    assert np.all(found.level[true < 0.03] > ks.Level.OK)


# Along short motions a pose asked alone is farther than the one that is followed by this share at
# most; so is one of a batch, which is searched as shortly as the first of a motion, but for arms
# of seven joints: so many of a thousand of theirs, and by a tenth one of a hundred, beyond 0.2 rad
# alone. The poses of one motion are missed together. One that is followed is farther by a tenth
# than one of a batch never.
NO_FARTHER, A_TENTH, NEAR = 1.02, 1.1, 0.2
RARELY = {'kinova_gen3': (30, 10)}


def short_motions(robot, seed):
    random = np.random.default_rng(31)
    for q in random_poses(robot, 30, seed=seed):
        step = random.normal(size=robot.dof)
        step *= random.choice([1e-3, 3e-3, 9e-3, 2e-2]) / np.linalg.norm(step)
        yield q + step * np.sin(0.06 * np.arange(60))[:, None] / 0.06


@pytest.mark.slow
@pytest.mark.parametrize(
    'name',
    [
        *('ur5e', 'ur5e without factors', 'craig_3r', 'so101', 'calibrated UR5', 'six joints'),
        'kinova_gen3',
    ],
)
def test_live_and_asked_alone_agree(name):
    robot, farther, by_a_tenth = ARMS[name](), [], []
    for q in short_motions(robot, seed=8):
        batch, live = ks.singularity(robot, q), along(robot, q)
        farther += list(batch.distance > NO_FARTHER * live.distance + 1e-9)
        missed = batch.distance > A_TENTH * live.distance + 1e-9
        assert not np.any(missed & (live.distance < NEAR))
        by_a_tenth += list(missed)
        assert np.all(live.distance <= A_TENTH * batch.distance + 1e-9)
        np.testing.assert_array_equal(batch.level, live.level)
        for k, pose in enumerate(q):
            alone = ks.singularity(robot, pose)
            assert alone.distance <= NO_FARTHER * live.distance[k] + 1e-9
            assert alone.level == live.level[k]
    shares = 1000 * np.mean([farther, by_a_tenth], axis=1)
    assert np.all(shares <= RARELY.get(name, (0, 0)))


@pytest.mark.parametrize(
    ('name', 'q', 'distance', 'of_batch'),
    [
        (
            'kuka_iiwa14',
            [
                *(1.000454686, -0.166750755, 2.433674785, -0.140546661),
                *(0.078952724, -1.442820237, -1.575904922),
            ],
            0.140547,
            0.217720,
        ),
        (
            'kinova_gen3',
            [
                *(-2.208270951, -0.580489479, -1.362282835, -2.50153292),
                *(-2.003181283, -0.436581089, -0.666119892),
            ],
            0.597350,
            0.654472,
        ),
    ],
)
def test_one_pose_alone_is_searched_for_longer_than_one_of_a_batch(name, q, distance, of_batch):
    robot = without_factors(name)
    assert ks.singularity(robot, [q]).distance[0] == pytest.approx(of_batch, rel=1e-4)
    alone = ks.singularity(robot, q)
    assert alone.distance == pytest.approx(distance, rel=1e-4)
    assert alone.decided
    assert share(robot, alone.nearest_singular) < SINGULAR
    # A command and a state that is measured later ask alone, too.
    later = singularity_of(ks.evaluate(robot, q))
    assert later.distance == alone.distance


@pytest.mark.slow
@pytest.mark.parametrize('error', [1e-5, 1e-4, 1e-3])
def test_where_two_singular_values_vanish_together_a_plan_finds_no_nearer_one(error):
    # The wrist is stretched or folded there, but for the errors, and shoulder or elbow often, too.
    robot = with_errors(PUMA, error, seed=5)
    random = np.random.default_rng(6)
    q = math.pi / 4 * random.integers(-4, 5, (300, 6)).astype(float)
    q[:, 4] = math.pi * random.integers(0, 2, 300)
    found = ks.singularity(robot, q)
    for pose in q[found.decided & (found.distance > 0.1)]:
        check = ks.check_plan(robot, [0.0], [pose], distance=0.1)
        assert check.singularity.verdict != 'refuted'


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
        assert robot.thresholds.level(1.0, level) is ks.Level.OK
        assert robot.thresholds.level(0.99, level) is not ks.Level.OK


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
