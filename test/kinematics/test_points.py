# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Pose, Jacobian and twist of any frame, at any point, in any axes: against other roads."""

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest
from arms import DISTINCT, DISTINCT_BUNDLED, LOOPED, calm_poses, robot_of
from refusal import refused
from tolerances import DIFFERENCE, DIFFERENCE_STEP, ROUND_OFF

import kinematics_service as ks
from kinematics_service.robot.file.parts.description import RigidMotion
from kinematics_service.robot.points import Point, ending_at

SOME_ARMS = (*DISTINCT, *LOOPED)
some_arms = pytest.mark.parametrize('name', SOME_ARMS)

CAMERA = """\
robot: seen
convention: standard
joints:
  - {name: q1, type: revolute}
  - {name: q2, type: revolute}
  - {name: q3, type: revolute}
links:
  - {a: 0, alpha: pi/2, d: 0.4, theta: q1}
  - {a: 0.3, alpha: 0, d: 0, theta: q2}
  - {a: 0.3, alpha: 0, d: 0, theta: q3}
tool: {xyz: [0, 0, 0.1]}
points:
  elbow: {row: 2}
  camera: {row: 2, xyz: [0.1, 0.05, 0.2], rpy: [0.3, -0.7, 1.1]}
  plate: {row: 0, xyz: [0, 0, 0.2]}
"""


@pytest.fixture(scope='module')
def seen():
    return ks.robot_from_text(CAMERA)


def derivative(pose, q, j):
    """Return how a pose (..., 4, 4) moves by joint j, (..., 6), by central differences."""
    step = DIFFERENCE_STEP * np.eye(q.shape[-1])[j]
    ahead, behind, R = pose(q + step), pose(q - step), pose(q)[..., :3, :3]
    change = (ahead - behind) / (2 * DIFFERENCE_STEP)
    turn = change[..., :3, :3] @ np.swapaxes(R, -1, -2)
    angular = np.stack([turn[..., 2, 1], turn[..., 0, 2], turn[..., 1, 0]], axis=-1)
    return np.concatenate([change[..., :3, 3], angular], axis=-1)


@pytest.mark.slow
@some_arms
def test_the_pose_of_a_row_is_its_link_frame(name):
    robot = robot_of(name)
    q = calm_poses(robot, 4)
    frames = ks.link_frames(robot, q)
    for row in range(robot.rows + 1):
        np.testing.assert_allclose(
            ks.forward_kinematics(robot, q, of=row), frames[:, row], rtol=0, atol=ROUND_OFF
        )


@some_arms
def test_the_jacobian_of_a_point_of_a_row_is_the_derivative_of_its_place(name):
    robot = robot_of(name)
    q, at = calm_poses(robot, 4), np.array([0.3, -0.2, 0.5])
    for row in sorted({0, robot.rows // 2, robot.rows}):
        J = ks.jacobian(robot, q, of=row, at=at)

        def pose(q, row=row):
            T = ks.link_frames(robot, q)[:, row]
            T[:, :3, 3] += T[:, :3, :3] @ at
            return T

        for j in range(robot.dof):
            np.testing.assert_allclose(J[..., j], derivative(pose, q, j), rtol=0, atol=DIFFERENCE)


@some_arms
def test_columns_of_joints_behind_a_row_are_zero(name):
    robot = robot_of(name)
    q = calm_poses(robot, 4)
    frames = ks.link_frames(robot, q)
    for row in range(robot.rows + 1):
        J = ks.jacobian(robot, q, of=row)
        for j in range(robot.dof):
            moved = q + 0.1 * np.eye(robot.dof)[j]
            still = np.array_equal(ks.link_frames(robot, moved)[:, row], frames[:, row])
            assert still == (not J[..., j].any()), (row, j)


@some_arms
def test_one_pose_and_many_give_the_same_bits_at_a_row(name):
    robot = robot_of(name)
    q = calm_poses(robot, 24)
    qdot = np.random.default_rng(1).uniform(-1, 1, q.shape)
    row = (robot.rows + 1) // 2
    J, V = ks.jacobian(robot, q, of=row), ks.twist(robot, q, qdot, of=row)
    for k in range(len(q)):
        assert np.array_equal(ks.jacobian(robot, q[k], of=row), J[k])
        assert np.array_equal(ks.twist(robot, q[k], qdot[k], of=row), V[k])


@some_arms
def test_the_tool_is_the_point_called_tool(name):
    robot = robot_of(name)
    q = calm_poses(robot, 4)
    table = robot.point('tool').chain.table
    assert all(map(np.array_equal, table, robot.chain.table))
    assert np.array_equal(ks.jacobian(robot, q, of='tool'), ks.jacobian(robot, q))
    at = robot.description.tool.motion.matrix[:3, 3]
    np.testing.assert_allclose(
        ks.jacobian(robot, q, of=robot.rows, at=at), ks.jacobian(robot, q), rtol=0, atol=ROUND_OFF
    )


def test_a_named_point_moves_with_its_row(seen):
    q = np.random.default_rng(0).uniform(-2, 2, (20, 3))
    T = ks.link_frames(seen, q)[:, 2] @ seen.description.points[1].motion.matrix
    np.testing.assert_allclose(
        ks.forward_kinematics(seen, q, of='camera'), T, rtol=0, atol=ROUND_OFF
    )
    J = ks.jacobian(seen, q, of='camera')
    assert not J[:, :, 2].any()
    assert J[:, :, :2].any()
    elbow = ks.jacobian(seen, q, of='elbow', at=[0.1, 0.05, 0.2])
    np.testing.assert_allclose(J, elbow, rtol=0, atol=ROUND_OFF)
    assert not ks.jacobian(seen, q, of='plate').any()


def test_the_place_of_a_pose_moves_with_at(seen):
    q = [0.1, 0.2, 0.3]
    T = ks.forward_kinematics(seen, q, of='elbow', at=[0.1, 0.05, 0.2])
    assert np.array_equal(T[:3, :3], ks.forward_kinematics(seen, q, of='elbow')[:3, :3])
    np.testing.assert_allclose(
        T[:3, 3], ks.forward_kinematics(seen, q, of='camera')[:3, 3], rtol=0, atol=ROUND_OFF
    )


def test_axes_turn_both_halves_and_keep_the_point(seen):
    random = np.random.default_rng(2)
    q, qdot = random.uniform(-2, 2, (2, 20, 3))
    for of in ('tool', 'camera', 1):
        J, V = ks.jacobian(seen, q, of=of), ks.twist(seen, q, qdot, of=of)
        for axes in ('tool', 'camera', 'elbow', 0, 2):
            R = np.swapaxes(ks.forward_kinematics(seen, q, of=axes)[:, :3, :3], -1, -2)
            expected = np.concatenate([R @ J[:, :3], R @ J[:, 3:]], axis=1)
            found = ks.jacobian(seen, q, axes, of=of)
            np.testing.assert_allclose(found, expected, rtol=0, atol=ROUND_OFF)
            V_axes = (expected @ qdot[..., None])[..., 0]
            found = ks.twist(seen, q, qdot, axes, of=of)
            np.testing.assert_allclose(found, V_axes, rtol=0, atol=ROUND_OFF)
        assert np.array_equal(ks.twist(seen, q, qdot, 'base', of=of), V)


def test_a_pose_in_another_frame_is_the_motion_between_the_two(seen):
    q = np.random.default_rng(3).uniform(-2, 2, (20, 3))
    for axes in ('tool', 'elbow', 1):
        T = ks.forward_kinematics(seen, q, axes, of='camera')
        product = ks.forward_kinematics(seen, q, of=axes) @ T
        np.testing.assert_allclose(
            product, ks.forward_kinematics(seen, q, of='camera'), rtol=0, atol=ROUND_OFF
        )


def test_axes_have_one_keyword(seen):
    q = [0.1, 0.2, 0.3]
    for name in ('base', 'tool'):
        assert np.array_equal(ks.jacobian(seen, q, axes=name), ks.jacobian(seen, q, name))
        assert np.array_equal(ks.twist(seen, q, q, axes=name), ks.twist(seen, q, q, name))
    for function, given in ((ks.jacobian, [q]), (ks.twist, [q, q])):
        with pytest.raises(TypeError, match='frame'):
            function(seen, *given, frame='tool')


def test_the_twist_of_another_point_is_that_of_its_jacobian(seen):
    random = np.random.default_rng(4)
    q, qdot = random.uniform(-2, 2, (2, 20, 3))
    at = np.array([0.3, -0.2, 0.5])
    r = ks.forward_kinematics(seen, q)[:, :3, :3] @ at
    np.testing.assert_allclose(
        ks.twist_at(ks.twist(seen, q, qdot), r),
        ks.twist(seen, q, qdot, at=at),
        rtol=0,
        atol=ROUND_OFF,
    )


def test_the_twist_there_and_back_is_the_same():
    twist, r = np.random.default_rng(5).uniform(-1, 1, 6), [0.3, -0.2, 0.5]
    np.testing.assert_allclose(
        ks.twist_at(ks.twist_at(twist, r), np.negative(r)), twist, rtol=0, atol=ROUND_OFF
    )
    assert ks.twist_at(np.zeros((4, 1, 6)), np.zeros((5, 3))).shape == (4, 5, 6)


@pytest.mark.parametrize(
    ('arguments', 'code', 'words'),
    [
        ((np.zeros(5), np.zeros(3)), 'wrong-shape', ['twist', '(5,)', '(..., 6)']),
        ((np.zeros(6), np.zeros(2)), 'wrong-shape', ['r has', '(2,)', '(..., 3)']),
        ((np.zeros(6), [0, np.inf, 0]), 'not-finite', ['r must', '[0.0, inf, 0.0]']),
        (('here', np.zeros(3)), 'not-a-number', ['twist', "'here'"]),
        ((np.zeros((2, 6)), np.zeros((3, 3))), 'mismatch', ['twist and r', '(2, 6) and (3, 3)']),
    ],
)
def test_what_is_no_twist_is_refused(arguments, code, words):
    with refused(ks.TwistError, code, *words):
        ks.twist_at(*arguments)


@pytest.mark.parametrize('of', ['elbo', 'base', 4, -1, True, None, 1.0, ['elbow']])
def test_a_point_that_the_arm_does_not_have_is_refused_with_those_it_has(seen, of):
    q = [0.1, 0.2, 0.3]
    for function in (
        lambda: ks.jacobian(seen, q, of=of),
        lambda: ks.twist(seen, q, q, of=of),
        lambda: ks.forward_kinematics(seen, q, of=of),
        lambda: seen.point(of),
        lambda: seen.ending_at(of),
    ):
        with pytest.raises(ks.PointError) as refusal:
            function()
        for word in (repr(of), 'seen', 'tool, elbow, camera, plate', '0 to 3'):
            assert word in str(refusal.value)
        assert refusal.value.expected == ('tool', 'elbow', 'camera', 'plate')


@pytest.mark.parametrize('at', [(1, 2), (1, 2, np.nan), 'here', np.zeros((3, 1)), 0.3])
def test_a_place_that_is_not_three_finite_numbers_is_refused(seen, at):
    for function in (
        lambda: ks.jacobian(seen, [0, 0, 0], at=at),
        lambda: ks.forward_kinematics(seen, [0, 0, 0], at=at),
        lambda: seen.ending_at('elbow', at),
    ):
        with pytest.raises(ks.PointError, match='^at must be three'):
            function()


def test_joint_positions_are_judged_as_for_the_tool(seen):
    with refused(ks.JointVectorError, 'wrong-shape', 'q has', '(2,)', 'seen has 3 joints'):
        ks.jacobian(seen, [0, 0], of='elbow')
    with refused(ks.JointVectorError, 'not-finite', 'q must', 'row 0'):
        ks.jacobian(seen, [0, 0, np.nan], of='plate')


def test_rows_are_whole_numbers_of_numpy_too(seen):
    assert np.array_equal(
        ks.jacobian(seen, [0, 1, 2], of=np.int64(2)), ks.jacobian(seen, [0, 1, 2], of=2)
    )


def test_points_are_frozen_and_survive_copies(seen):
    point = seen.point('elbow')
    assert isinstance(point, Point)
    assert seen.point('elbow') is point
    with pytest.raises(AttributeError):
        point.name = 'knee'
    for again in (copy.deepcopy(seen), pickle.loads(pickle.dumps(seen))):
        assert again.points == seen.points
        assert np.array_equal(
            ks.jacobian(again, [0, 1, 2], of='camera'), ks.jacobian(seen, [0, 1, 2], of='camera')
        )


@pytest.mark.slow
@pytest.mark.parametrize('name', DISTINCT_BUNDLED)
def test_an_arm_that_ends_at_a_row_has_the_numbers_of_the_row(name):
    robot = robot_of(name)
    q, row, at = calm_poses(robot, 4), robot.rows, (0.1, 0.2, -0.3)
    shorter = robot.ending_at(row, at)
    assert np.array_equal(ks.jacobian(shorter, q), ks.jacobian(robot.ending_at(row, at), q))
    np.testing.assert_allclose(
        ks.jacobian(shorter, q), ks.jacobian(robot, q, of=row, at=at), rtol=0, atol=ROUND_OFF
    )
    assert shorter.joint_names == robot.joint_names


def test_an_arm_that_ends_at_a_point_is_judged_at_it(seen):
    elbow = seen.ending_at('elbow')
    assert (elbow.tool_frame, elbow.rows, elbow.points) == (
        'elbow',
        2,
        ('tool', 'camera', 'plate'),
    )
    assert elbow.name == 'seen_elbow'
    assert [joint.unused for joint in elbow.description.joints] == [False, False, True]
    assert elbow.singularity.task.generic_rank == 2
    assert elbow.singularity.task.rows == ('x', 'y', 'z')
    # The upper arm stands upright where q2 is 90 degrees: joint 1 no longer moves the elbow.
    upright = [0.2, np.pi / 2, 0.7]
    assert ks.singularity(elbow, upright).rank == 1
    assert ks.singularity(elbow, upright).level == ks.Level.ERROR
    assert ks.singularity(elbow, [0.2, 0.3, 0.7]).level == ks.Level.OK
    assert ks.singularity(seen, upright).level != ks.Level.ERROR
    assert seen.ending_at('tool') is seen


def test_an_arm_that_ends_beside_a_turned_point_is_there(seen):
    q, at = [0.3, 0.2, -0.5], (0.1, -0.2, 0.05)
    found = ks.forward_kinematics(seen.ending_at('camera', at), q)
    expected = ks.forward_kinematics(seen, q, of='camera', at=at)
    np.testing.assert_allclose(found, expected, rtol=0, atol=ROUND_OFF)


def test_an_arm_cannot_end_where_nothing_moves(seen):
    for of in ('plate', 0):
        with pytest.raises(ks.PointError, match=f'{of!r} of seen'):
            seen.ending_at(of)


@pytest.mark.slow
def test_the_place_of_an_end_is_written_in_the_units_of_the_file():
    text = CAMERA.replace('joints:', 'units: {angle: deg, length: mm}\njoints:', 1)
    robot = ks.robot_from_text(text.replace('pi/2', '90').replace('0.3,', '300,'))
    end = robot.ending_at('elbow', [0.1, 0.0, 0.0])
    assert end.description.tool.motion.texts[:3] == ('100.0', '0.0', '0.0')
    q, derived = [0.1, 0.2, 0.3], ks.derive(end)
    exact = np.array(derived.T.subs(dict(zip(derived.variables, q)))).astype(float)
    exact[:3, 3] /= 1000.0  # as the file has them
    np.testing.assert_allclose(
        exact,
        ks.forward_kinematics(robot, q, of='elbow', at=[0.1, 0, 0]),
        rtol=0,
        atol=ROUND_OFF,
    )


def test_a_tool_given_as_a_matrix_keeps_its_rotation_beside_a_new_position():
    description = robot_of('ur5e').description
    matrix = np.array([[0, -1, 0, 0.1], [1, 0, 0, 0.2], [0, 0, 1, 0.3], [0, 0, 0, 1.0]])
    motion = RigidMotion(matrix, tuple(map(repr, matrix.ravel().tolist())))
    tool = replace(description.tool, motion=motion)
    ended = ending_at(replace(description, tool=tool), 'tool', [0.01, 0.02, 0.03]).tool.motion
    written = np.array(ended.texts, dtype=float).reshape(4, 4)
    np.testing.assert_allclose(written, ended.matrix, rtol=0, atol=ROUND_OFF)
    np.testing.assert_allclose(written[:3, 3], [0.08, 0.21, 0.33], rtol=0, atol=ROUND_OFF)
