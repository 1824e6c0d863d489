"""The search for the nearest singular pose against brute force, alone and along a motion."""

import brute_force
import numpy as np
import pytest
from arms import robot_of, seeded
from calibrated import UR5, with_errors

import kinematics_service as ks
from kinematics_service import kernel

# A search may be farther than brute force by this factor, or this many rad.
TOO_FAR, ROUND_OFF = 1.05, 1e-4
# Singular: the least singular value as a share of the largest.
SINGULAR = 1e-7
IIWA = [-2.2151, 0.1521, -2.3128, 0.169, 0.25, -0.6411, -0.9194]


def search(robot, q, in_order=False, samples=24):
    """Return distances (N,), 1 where none was found, and the poses (N, n)."""
    q = np.ascontiguousarray(q, dtype=float)
    rows = np.ascontiguousarray(ks.evaluate(robot, q).numbers)
    distances, poses = np.empty(len(q)), np.empty(q.shape)
    one = kernel.SingularSearch(robot.arm, samples)
    kernel.find_singular(one, rows, q, distances, poses, in_order)
    return np.minimum(distances, 1.0), poses


def motion(robot, count, step):
    """Return poses of a smooth motion, `step` rad apart."""
    t, n = step * np.arange(count)[:, None], robot.dof
    return np.sin(0.7 * np.arange(n) + t / np.sqrt(n)) + 0.3 * np.arange(n)


ARMS = ('craig_3r', 'scara_hsr065', 'standard-5-0', 'puma560', 'kinova_gen3')


@pytest.mark.parametrize('name', [*ARMS, 1e-7, 1e-3])
def test_no_singular_pose_is_nearer_by_brute_force(name):
    robot = robot_of(name) if isinstance(name, str) else with_errors(UR5, name, 1)
    q = np.concatenate([seeded(robot, 10), brute_force.saddles(robot, 6)])
    distances, poses = search(robot, q)
    by_force, _ = brute_force.nearest_singular(robot, q, 4, known=3)
    assert np.all(distances <= TOO_FAR * np.minimum(by_force, 1.0) + ROUND_OFF)
    near = distances < 1.0
    sigma = np.linalg.svd(brute_force.scaled_jacobian(robot, poses[near]), compute_uv=False)
    assert np.all(sigma[:, robot.task.generic_rank - 1] <= SINGULAR * sigma[:, 0])
    moved = np.linalg.norm((poses - q) / robot.task.column_scales, axis=1)
    np.testing.assert_allclose(moved[near], distances[near], atol=1e-12)


@pytest.mark.parametrize('q2', [0.0, 1e-9, 1e-3, -0.7, np.pi - 0.2])
def test_planar_2r_is_singular_where_its_elbow_is_straight(q2):
    distances, _ = search(ks.load_robot('planar_2r'), [[0.3, q2]])
    assert distances[0] == pytest.approx(min(abs(q2), np.pi - abs(q2)), rel=1e-6, abs=1e-10)


def test_a_pose_between_two_sheets_finds_the_nearer_one():
    distances, _ = search(ks.load_robot('kuka_iiwa14'), [IIWA])
    assert distances[0] == pytest.approx(0.1690, abs=1e-4)


@pytest.mark.parametrize('name', ['puma560', 'kuka_iiwa14', 'craig_3r', 'four_bar_arm'])
@pytest.mark.parametrize('step', [2e-3, 2e-2])
def test_a_motion_is_followed_as_its_poses_are_found_alone(name, step):
    robot = robot_of(name)
    q = motion(robot, 400, step)
    tracked, _ = search(robot, q, in_order=True)
    alone, _ = search(robot, q[::8])
    assert np.all(tracked[::8] <= TOO_FAR * alone + ROUND_OFF)
    # Without an atlas a pose of closed loops alone may miss what a motion has met.
    assert robot.chain.loops or np.all(alone <= TOO_FAR * tracked[::8] + ROUND_OFF)


@pytest.mark.parametrize('samples', [0, 24])
def test_starts_reach_what_many_more_reach(samples):
    robot = with_errors(UR5, 1e-3, 2)
    q = seeded(robot, 40)
    distances, _ = search(robot, q, samples=samples)
    many, _ = search(robot, q, samples=600)
    far = np.sum(distances > TOO_FAR * many + ROUND_OFF)
    assert (far == 0) == (samples > 0)


def test_an_arm_that_is_never_singular_has_none():
    text = 'robot: one\nsource: t\nconvention: standard\njoints:\n  - {name: a, type: revolute}\n'
    robot = ks.robot_from_text(text + 'links:\n  - {a: 1, alpha: 0, d: 0, theta: a}\n')
    assert search(robot, [[0.3]])[0] == 1.0
