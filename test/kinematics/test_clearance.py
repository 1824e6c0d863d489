# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The radius in which no pose is singular: proved, and so never above the distance of one."""

import math

import brute_force
import numpy as np
import pytest
from arms import elementary_arm, random_poses, robot_of, without_factors
from brute_force import judged_poses
from calibrated import calibrated_ur5

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.robot.clearance_bounds import find_bounds
from kinematics_service.robot.robot import with_chain

# Round-off of a distance: a pose counts as singular when it is this near to one (rad).
AT_IT = 1e-6
# The characteristic length is that of poses inside the limits, which are others behind gears.
OTHER_LENGTH = 0.1
# Steps of differences along a motion, and the share that they are off by.
STEP, DIFFERENCE = 1e-3, 1.01


def named(name):
    return calibrated_ur5(1) if name == 'calibrated UR5' else without_factors(name)


# Three to nine joints; sliding, coupled, singular everywhere, redundant, with errors.
KINDS = (
    *('calibrated UR5', 'craig_3r', 'rrp_elementary', 'parallelogram_left', 'scara_hsr065'),
    *('so101', 'six_joint_dh', 'panda', 'shape-4-0', 'elementary-6-0', 'standard-9-0'),
)


@pytest.mark.slow
@pytest.mark.parametrize('name', KINDS)
def test_no_singular_pose_is_nearer_than_the_clearance(name):
    robot = named(name)
    # A tenth of a second each where many joints are redundant.
    q = judged_poses(robot, 60 if robot.dof < 8 else 8)
    found = ks.singularity(robot, q)
    distance = np.linalg.norm(
        (found.nearest_singular - q) / robot.singularity.task.column_scales, axis=1
    )
    there = np.isfinite(distance)
    assert np.all(found.clearance >= 0.0)
    assert np.all(found.clearance <= kernel.FARTHEST)
    assert np.all(found.clearance[there] <= distance[there] * (1.0 + 1e-6) + AT_IT)


@pytest.mark.parametrize('gear', [0.4, 2.5])
@pytest.mark.parametrize('wrist', ['', ', Rx({0}*q4), Ry({0}*q5), Rx({0}*q6), Tx(0.1)'])
def test_of_an_arm_behind_gears_it_is_that_of_the_arm_itself(wrist, gear):
    # Joints that all turn by a share of theirs: every angle, and so every distance, by as much.
    links = 'Rz({0}*q1), Ty(0.1), Ry({0}*q2), Tx(1), Ry({0}*q3), Tx(0.7)' + wrist
    types = 'r' * links.count('*')
    geared, plain = (elementary_arm(links.format(ratio), types) for ratio in (gear, 1.0))
    q = np.random.default_rng(6).uniform(-1.0, 1.0, (60, len(types)))
    found = ks.singularity(plain, q).clearance
    near = found < min(1.0, gear)
    assert np.sum(near & (found > 0.01)) > 20
    behind = gear * ks.singularity(geared, q / gear).clearance
    np.testing.assert_allclose(behind[near], found[near], rtol=OTHER_LENGTH)


@pytest.mark.slow
@pytest.mark.parametrize('name', ['calibrated UR5', 'offset_stanford_dh', 'panda'])
def test_no_pose_of_a_search_that_ended_is_nearer_than_the_clearance(name):
    robot = named(name)
    q = judged_poses(robot, 24)
    distance, _ = brute_force.nearest_singular(robot, q, starts=6)
    assert np.sum(np.isfinite(distance)) > 6
    clearance = ks.singularity(robot, q).clearance
    assert np.all(clearance <= distance * (1.0 + 1e-6) + AT_IT)


@pytest.mark.slow
@pytest.mark.parametrize(
    ('name', 'shares'),
    [
        ('calibrated UR5', (0.97, 0.9)),
        ('craig_3r', (0.97, 0.9)),
        ('kuka_iiwa14', (0.95, 0.8)),
    ],
)
def test_near_the_singular_set_the_clearance_is_nearly_the_distance(name, shares):
    robot = named(name)
    found = ks.singularity(robot, random_poses(robot, 800))
    for limit, share in zip((0.03, 0.1), shares):
        near = (found.distance < limit) & (found.distance > 1e-3)
        assert np.median(found.clearance[near] / found.distance[near]) > share


def test_where_a_redundant_arm_is_nearly_singular_on_a_sheet_it_keeps_a_clearance():
    # Past the straight elbow of a kinova_gen3, whose offsets leave singular only what has two
    # dimensions less.
    robot = robot_of('kinova_gen3')
    q = random_poses(robot, 200, seed=3)
    q[:, 3] *= 0.02
    found = ks.singularity(robot, q)
    assert np.median(found.smallest_singular_value) < 3e-3
    assert np.mean(found.clearance > 0.03) > 0.9
    away = np.linalg.norm(found.nearest_singular - q, axis=1)
    assert np.sum(np.isfinite(away)) > 20
    assert np.all(found.clearance[np.isfinite(away)] < away[np.isfinite(away)])
    nearest = np.argsort(found.distance)[:12]
    by_force, _ = brute_force.nearest_singular(robot, q[nearest], starts=4)
    assert np.sum(np.isfinite(by_force)) > 6
    assert np.all(found.clearance[nearest] < by_force)


def bent(robot, q, motion, order):
    # The largest singular value of a derivative of J_t along a motion.
    weights = {
        2: ((-1, 1), (0, -2), (1, 1)),
        3: ((-2, -0.5), (-1, 1), (1, -1), (2, 0.5)),
        4: ((-2, 1), (-1, -4), (0, 6), (1, -4), (2, 1)),
    }[order]
    scales = robot.singularity.task.column_scales
    J = sum(
        weight * brute_force.scaled_jacobian(robot, q + k * STEP * motion * scales)
        for k, weight in weights
    )
    return np.linalg.svd(J / STEP**order, compute_uv=False)[..., 0]


@pytest.mark.parametrize(
    'name',
    ['puma560', 'panda', 'scara_hsr065', 'spherical_rrp', 'parallelogram_left', 'planar_3r'],
)
def test_the_jacobian_bends_no_more_than_its_bounds_say(name):
    robot = robot_of(name)
    strokes = np.max(np.abs(np.clip(robot.limits, -1.0, 1.0)), axis=1)
    bounds = find_bounds(robot.chain, robot.singularity.task, strokes)
    random = np.random.default_rng(0)
    low, high = np.clip(robot.limits, -1.0, 1.0).T
    q = random.uniform(low, high, (300, robot.dof))
    motion = np.zeros_like(q)
    motion[:, bounds.moving] = random.normal(size=(300, len(bounds.moving)))
    motion /= np.linalg.norm(motion, axis=1, keepdims=True)
    if np.any(bounds.point):
        robot = with_tool_at(robot, bounds.point)
    assert np.max(bent(robot, q, motion, 2)) < DIFFERENCE * bounds.bend
    assert np.max(bent(robot, q, motion, 3)) < DIFFERENCE * bounds.twist
    assert np.max(bent(robot, q, motion, 4)) < DIFFERENCE * bounds.fourth


def with_tool_at(robot, point):
    # The robot with its tool's origin moved to a point in its own axes.
    table = robot.chain.table
    before = np.array(table.before)
    before[-1, :, 3] += before[-1, :, :3] @ point
    return with_chain(robot, kernel.Chain(table._replace(before=before)))


def test_what_a_search_takes_for_singular_is_not_nearer_behind_a_long_tool():
    # Nearly straight elbows: of what J says of the tool, 2 m away, less is left than of what it
    # says of the wrist.
    robot = with_tool_at(without_factors('kuka_iiwa14'), np.array([0.0, 0.0, 2.0]))
    q = np.random.default_rng(0).uniform(-2.0, 2.0, (150, 7))
    q[:, 3] *= 0.03
    found = ks.singularity(robot, q)
    distance = np.linalg.norm(found.nearest_singular - q, axis=1)
    assert np.all(found.clearance <= distance * (1.0 + 1e-6))


def test_a_last_axis_nearly_parallel_to_the_one_before_it_costs_no_clearance():
    # They meet 300 m away.
    shares = []
    for tilt in (0.0, 1e-3):
        robot = elementary_arm(
            'Rz(q1), Tz(0.3), Rx(1.57), Rz(q2), Tx(0.4), Rx(0.3), Rz(q3), Tx(0.05), Rx(1.3), '
            f'Tz(0.2), Rz(q4), Tx(0.2), Rx(1.2), Rz(q5), Tx(0.3), Ry({tilt}), Rz(q6), Tx(0.1)',
            'rrrrrr',
        )
        found = ks.singularity(robot, random_poses(robot, 100))
        shares.append(np.median(found.clearance / found.distance))
    assert shares[1] > 0.9 * shares[0] > 0.5


def test_a_sliding_joint_without_limits_has_bounds_where_it_is():
    robot = robot_of('spherical_rrp')
    # However far out the boom is, where it is upright the arm is singular: 0.4 rad away.
    for out in (0.5, 5.5, 20.0, 100.0):
        found = ks.singularity(robot, [0.3, 0.4, out])
        assert 0.3 < found.clearance <= 0.4
        assert found.nearest_singular is None or found.clearance <= found.distance


def test_one_pose_has_the_clearance_of_a_batch():
    robot = robot_of('kinova_gen3')
    q = random_poses(robot, 20)
    batch = ks.singularity(robot, q.reshape(4, 5, 7)).clearance
    assert batch.shape == (4, 5)
    one = [ks.singularity(robot, pose).clearance for pose in q]
    np.testing.assert_array_equal(batch.ravel(), one)
    assert type(one[0]) is float


def test_at_a_singular_pose_there_is_none():
    assert ks.singularity(robot_of('ur5e'), [0.1, -1.0, 0.0, 0.5, 0.6, 0.7]).clearance == 0.0


@pytest.mark.parametrize('size', [1, 2, 5, 7, 12])
def test_eigenvectors_are_those_of_numpy(size):
    random = np.random.default_rng(size)
    for _ in range(50):
        H = random.normal(size=(size, size))
        H += H.T
        left, Z = H.copy(), np.zeros((size, size))
        kernel.eigenvectors(left, Z)
        np.testing.assert_allclose(Z @ H @ Z.T, np.diag(np.diag(left)), rtol=0, atol=1e-13 * size)
        np.testing.assert_allclose(Z @ Z.T, np.eye(size), rtol=0, atol=1e-14 * size)
        np.testing.assert_allclose(
            np.sort(np.diag(left)), np.linalg.eigvalsh(H), rtol=0, atol=1e-13 * size
        )


def test_opposite_eigenvalues_are_told_apart():
    # A saddle: singular vectors would mix the two.
    H, Z = np.array([[0.0, 1.0], [1.0, 0.0]]), np.zeros((2, 2))
    kernel.eigenvectors(H, Z)
    assert sorted(np.diag(H)) == pytest.approx([-1.0, 1.0])
    assert math.isclose(abs(Z[0, 0]), math.sqrt(0.5))
