# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Self-motion: what leaves the tool at rest, turned as little as can be, and where it leads."""

import numpy as np
import pytest
from arms import DISTINCT, DISTINCT_BUNDLED, LOOPED, calm_poses, robot_of, seeded
from refusal import refused
from tolerances import DIFFERENCE, DIFFERENCE_STEP, ROUND_OFF

import kinematics_service as ks

SOME_ARMS = (*DISTINCT, *LOOPED)
some_arms = pytest.mark.parametrize('name', SOME_ARMS)
REDUNDANT = ('panda', 'kuka_iiwa14', 'standard-7-0', 'standard-9-0', 'modified-12-0')
redundant = pytest.mark.parametrize('name', REDUNDANT)

# A basis that is held to another by a share of 1e-10 of the Jacobian.
AT_REST = 1e-9
# The nearest of motions that rest alike: they differ by 1e-10 of J, of which round-off is 1e-6.
NEAREST = 1e-6
# Jacobians of arms of some m by two programs, multiplied.
PINOCCHIO = 1e-10
# A minimum that was found to 1e-5 of it, over steps of 1e-3 rad.
GRADIENT = 1e-4


@some_arms
def test_the_null_space_leaves_the_rows_of_the_task_at_rest(name):
    robot = robot_of(name)
    q = calm_poses(robot, 8)
    basis = ks.null_space(robot, q)
    k = robot.dof - robot.singularity.task.generic_rank
    assert basis.shape == (len(q), robot.dof, k)
    np.testing.assert_allclose(
        np.swapaxes(basis, -1, -2) @ basis,
        np.broadcast_to(np.eye(k), (len(q), k, k)),
        atol=ROUND_OFF,
    )
    for one, at in zip(basis, q):
        J = ks.jacobian(robot, at)
        halves = [
            robot.singularity.task.rotation.T @ J[:3],
            robot.singularity.task.rotation.T @ J[3:],
        ]
        moved = np.concatenate(halves)[robot.singularity.task.axes] @ one
        np.testing.assert_allclose(moved, 0.0, atol=ROUND_OFF * max(1.0, np.max(np.abs(J))))


@redundant
def test_the_tool_stays_where_it_is_to_second_order(name):
    robot = robot_of(name)
    for q in calm_poses(robot, 4):
        T = ks.forward_kinematics(robot, q)
        for direction in ks.null_space(robot, q).T:
            ahead, behind = (
                ks.forward_kinematics(robot, q + sign * DIFFERENCE_STEP * direction)
                for sign in (1, -1)
            )
            change = (ahead - behind) / (2 * DIFFERENCE_STEP)
            np.testing.assert_allclose(change, 0.0, atol=DIFFERENCE)
            np.testing.assert_allclose(ahead, T, rtol=0, atol=1e-10)


@pytest.mark.parametrize(
    ('name', 'rows'),
    [
        *((name, None) for name in ('panda', 'standard-9-0')),
        *((name, ('x', 'y', 'z')) for name in ('kuka_iiwa14', 'modified-12-0')),
        ('standard-7-0', ('rz', 'x')),
    ],
)
def test_the_basis_turns_little_from_pose_to_pose(name, rows):
    robot = robot_of(name)
    start, other = seeded(robot, 2)
    way = start + 0.5 * (other - start)
    basis, step = ks.null_space(robot, start, rows), 0.0
    for s in np.linspace(0.0, 1.0, 401):
        new = ks.null_space(robot, start + s * (way - start), rows, near=basis)
        step = max(step, float(np.linalg.norm(new - basis, 2)))
        basis = new
    assert step < 0.1
    k = basis.shape[1]
    np.testing.assert_allclose(basis.T @ basis, np.eye(k), atol=ROUND_OFF)
    at_end = ks.null_space(robot, way, rows)
    np.testing.assert_allclose(basis @ basis.T, at_end @ at_end.T, atol=AT_REST)


def test_the_basis_goes_straight_through_a_pose_that_leaves_more_at_rest():
    robot = robot_of('planar_2r')
    before = ks.null_space(robot, [0.3, -1e-3], ['x', 'rz'])
    assert before.shape == (2, 0)
    robot = robot_of('panda')
    q = np.array([0.2, 0.4, 0.1, -1.5, 0.0, 0.0, 0.5])
    basis, turned = ks.null_space(robot, q - 0.1), 0.0
    for s in np.linspace(-0.1, 0.1, 801):
        new = ks.null_space(robot, q + s, near=basis)
        turned, basis = max(turned, float(np.linalg.norm(new - basis))), new
    assert turned < 0.2
    # Stretched, the elbow of an arm on a line of shoulders leaves two motions at rest.
    straight = robot_of('kuka_iiwa14')
    zero = np.zeros(7)
    wanted = ks.null_space(straight, zero + 1e-4)
    chosen = ks.null_space(straight, zero, near=wanted)
    J = ks.jacobian(straight, zero)
    np.testing.assert_allclose(J @ chosen, 0.0, atol=AT_REST)
    idle = np.linalg.svd(J)[2][np.linalg.matrix_rank(J, 1e-9) :].T
    assert idle.shape[1] > 1
    along = idle @ (idle.T @ wanted)
    np.testing.assert_allclose(chosen, along / np.linalg.norm(along), rtol=0, atol=NEAREST)


def test_a_batch_is_its_poses():
    robot = robot_of('panda')
    q = seeded(robot, 6).reshape(2, 3, 7)
    whole = ks.null_space(robot, q)
    assert whole.shape == (2, 3, 7, 1)
    near = -whole
    np.testing.assert_array_equal(whole[1, 2], ks.null_space(robot, q[1, 2]))
    np.testing.assert_allclose(ks.null_space(robot, q, near=near), near, rtol=0, atol=AT_REST)
    assert np.all(np.max(whole, axis=-2) > -np.min(whole, axis=-2))


def test_a_point_has_a_null_space_of_its_own():
    robot = robot_of('panda')
    q = calm_poses(robot, 1)[0]
    basis = ks.null_space(robot, q, ['x', 'y', 'z'], of=4)
    np.testing.assert_allclose(ks.jacobian(robot, q, of=4)[:3] @ basis, 0.0, atol=ROUND_OFF)
    assert basis.shape == (7, 7 - np.linalg.matrix_rank(ks.jacobian(robot, q, of=4)[:3], 1e-9))


@pytest.mark.parametrize(
    ('choice', 'error', 'code', 'words'),
    [
        ({'rows': ['vx']}, ks.PointError, 'unknown-name', ['rows', "'vx'"]),
        ({'rows': []}, ks.PointError, 'empty', ['rows', 'rx ry rz']),
        ({'near': np.zeros((7, 2))}, ks.JointVectorError, 'wrong-shape', ['near', '(7, 2)']),
        ({'near': np.zeros((6, 1))}, ks.JointVectorError, 'mismatch', ['near', '(6, 1)']),
        ({'near': np.full((7, 1), np.nan)}, ks.JointVectorError, 'not-finite', ['near', 'nan']),
    ],
)
def test_what_is_no_choice_is_refused(choice, error, code, words):
    with refused(error, code, *words):
        ks.null_space('panda', np.zeros(7), **choice)


@pytest.mark.parametrize('name', ['panda', 'kuka_iiwa14', 'standard-7-0'])
def test_the_self_motion_raises_the_distance_by_the_square_of_its_length(name):
    robot = robot_of(name)
    random, tried = np.random.default_rng(8), 0
    for q in random.uniform(-0.9, 0.9, (400, robot.dof)):
        here = ks.singularity(robot, q)
        motion = ks.self_motion(robot, q)
        if here.nearest_singular is None or not 0.02 < here.distance < 0.3:
            continue
        square = motion @ motion
        if square < 1e-4:
            continue
        step = 1e-3 / np.sqrt(square)
        ahead, behind = (ks.singularity(robot, q + sign * step * motion) for sign in (1, -1))
        if any(
            one.nearest_singular is None
            or np.linalg.norm(one.nearest_singular - here.nearest_singular) > 0.01
            for one in (ahead, behind)
        ):
            continue  # another singular pose is the nearest there
        change = (ahead.distance - behind.distance) / (2 * step)
        assert change == pytest.approx(square, rel=0.02, abs=GRADIENT)
        np.testing.assert_allclose(ks.jacobian(robot, q) @ motion, 0.0, atol=1e-11)
        tried += 1
        if tried == 5:
            return
    assert tried


def test_no_self_motion_is_zero():
    np.testing.assert_array_equal(ks.self_motion('puma560', np.full(6, 0.3)), np.zeros(6))
    many = ks.self_motion('panda', np.random.default_rng(2).uniform(-1, 1, (3, 2, 7)))
    assert many.shape == (3, 2, 7)
    assert np.isfinite(many).all()


@pytest.mark.peers
@pytest.mark.parametrize(
    'name', [n for n in DISTINCT_BUNDLED if not n.startswith('parallelogram')]
)
def test_null_space_inverse_and_wrench_by_pinocchios_jacobian(name):
    pinocchio = pytest.importorskip('pinocchio')
    robot, random = robot_of(name), np.random.default_rng(4)
    model = pinocchio.buildModelFromXML(ks.export_urdf(robot), True)
    data, frame = model.createData(), model.getFrameId(robot.tool_frame)
    joints = [model.joints[model.getJointId(joint)] for joint in robot.joint_names]
    task = robot.singularity.task
    for q in seeded(robot, 3):
        whole = pinocchio.neutral(model)
        for joint, x in zip(joints, q):
            whole[joint.idx_q : joint.idx_q + joint.nq] = (
                [np.cos(x), np.sin(x)] if joint.nq == 2 else x
            )
        J = pinocchio.computeFrameJacobian(
            model, data, whole, frame, pinocchio.LOCAL_WORLD_ALIGNED
        )[:, [joint.idx_v for joint in joints]]
        size = np.max(np.abs(J))
        turned = np.concatenate([task.rotation.T @ J[:3], task.rotation.T @ J[3:]])[task.axes]
        np.testing.assert_allclose(
            turned @ ks.null_space(robot, q), 0.0, rtol=0, atol=PINOCCHIO * size
        )
        scaled = task.row_scales[:, None] * turned * task.column_scales
        expected = np.linalg.pinv(scaled, 1e-10)
        expected = task.column_scales[:, None] * expected * task.row_scales
        np.testing.assert_allclose(
            ks.pseudo_inverse(robot, q).matrix,
            expected,
            rtol=0,
            atol=PINOCCHIO * max(1.0, np.max(np.abs(expected)) ** 2),
        )
        torques = J.T @ random.normal(size=6)
        wrench = ks.wrench_from_torques(robot, q, torques).wrench
        largest = max(1.0, np.max(np.abs(wrench)))
        np.testing.assert_allclose(J.T @ wrench, torques, rtol=0, atol=PINOCCHIO * largest)
