# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
What holds for every arm: bundled robots, and random ones of every convention and 1 to 12 joints.
"""

import dataclasses
import functools
import json
import math

import mpmath
import numpy as np
import pytest
from arms import (
    BUNDLED,
    DISTINCT,
    RANDOM,
    arm_of,
    first_order_distances,
    poses,
    robot_of,
    searched_poses,
    sliding,
    without_factors,
)
from folders import RECORDINGS
from random_robots import CONVENTIONS, Constant, random_arm
from tolerances import DIFFERENCE, DIFFERENCE_STEP, FOUND, QUOTIENT, ROUND_OFF

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.robot.file.parts.description import Placement, RigidMotion
from kinematics_service.robot.robot import build_robot

CALIBRATION = RECORDINGS / 'vendor_reference' / 'ur_calibration_reference.json'

every_arm = pytest.mark.parametrize('name', DISTINCT)
# Each number of joints, in one convention or another.
random_arms = pytest.mark.parametrize(
    'name', [name for k, name in enumerate(RANDOM) if k % 6 == k // 12 % 6]
)


def vee(S):
    return np.stack([S[..., 2, 1], S[..., 0, 2], S[..., 1, 0]], axis=-1)


def difference_quotient(ahead, behind, between, step):
    # dp/ds and vee(dR/ds R^T) from poses at s + step and s - step.
    change = (ahead - behind) / (2.0 * step)
    S = change[..., :3, :3] @ np.swapaxes(between[..., :3, :3], -1, -2)
    return np.concatenate([change[..., :3, 3], vee(S)], axis=-1)


def moved(robot, base=None, tool=None):
    # The same robot on another base, with another tool.
    description = robot.description
    places = {}
    for place, T in (('base', base), ('tool', tool)):
        if T is not None:
            frame = getattr(description, place).frame
            places[place] = Placement(frame, RigidMotion(T, ('0',) * 6))
    return build_robot(dataclasses.replace(description, **places))


def both_halves(R, six_rows):
    return np.concatenate([R @ six_rows[..., :3, :], R @ six_rows[..., 3:, :]], axis=-2)


def bits(array):
    return np.ascontiguousarray(array).view(np.uint64)


@pytest.mark.slow
@random_arms
def test_pose_is_the_product_of_the_table(name):
    robot, arm = robot_of(name), arm_of(name)
    q = poses(robot)
    expected = [arm.pose(position) for position in q]
    np.testing.assert_allclose(ks.forward_kinematics(robot, q), expected, rtol=0, atol=ROUND_OFF)


@pytest.mark.slow
@random_arms
def test_frames_are_the_partial_products_of_the_table(name):
    robot, arm = robot_of(name), arm_of(name)
    q = poses(robot)
    expected = [arm.frames(position) for position in q]
    np.testing.assert_allclose(ks.link_frames(robot, q), expected, rtol=0, atol=ROUND_OFF)


@pytest.mark.slow
@every_arm
def test_first_frame_is_the_base_and_the_last_carries_the_tool(name):
    robot = robot_of(name)
    q = poses(robot)
    frames = ks.link_frames(robot, q)
    assert frames.shape == (len(q), robot.rows + 1, 4, 4)
    base, tool = (
        place.motion.matrix for place in (robot.description.base, robot.description.tool)
    )
    assert np.all(frames[:, 0] == base)
    np.testing.assert_allclose(
        frames[:, -1] @ tool, ks.forward_kinematics(robot, q), rtol=0, atol=ROUND_OFF
    )


@every_arm
def test_poses_are_rigid_motions(name):
    robot = robot_of(name)
    T = ks.link_frames(robot, poses(robot))
    R = T[..., :3, :3]
    np.testing.assert_allclose(
        R @ np.swapaxes(R, -1, -2), np.broadcast_to(np.eye(3), R.shape), rtol=0, atol=ROUND_OFF
    )
    np.testing.assert_allclose(np.linalg.det(R), 1.0, rtol=0, atol=ROUND_OFF)
    assert np.all(T[..., 3, :] == [0, 0, 0, 1])


@every_arm
def test_jacobian_is_the_derivative_of_the_pose(name):
    robot = robot_of(name)
    q = poses(robot)
    J, T, h = ks.jacobian(robot, q), ks.forward_kinematics(robot, q), DIFFERENCE_STEP
    for j, step in enumerate(h * np.eye(robot.dof)):
        ahead, behind = (ks.forward_kinematics(robot, q + sign * step) for sign in (1, -1))
        column = difference_quotient(ahead, behind, T, h)
        np.testing.assert_allclose(J[..., j], column, rtol=0, atol=DIFFERENCE)


@every_arm
def test_twist_is_the_derivative_of_the_pose_along_a_path(name):
    robot = robot_of(name)
    random = np.random.default_rng(1)
    a, w, phase = random.uniform(0.2, 1.0, (3, robot.dof))

    def q(t):
        return a * np.sin(w * np.asarray(t)[..., None] + phase)

    t, h = np.linspace(0.0, 6.0, 20), DIFFERENCE_STEP
    qdot = a * w * np.cos(w * t[:, None] + phase)
    ahead, between, behind = (ks.forward_kinematics(robot, q(t + s)) for s in (h, 0.0, -h))
    expected = difference_quotient(ahead, behind, between, h)
    np.testing.assert_allclose(ks.twist(robot, q(t), qdot), expected, rtol=0, atol=DIFFERENCE)


@every_arm
def test_twist_is_the_jacobian_times_the_velocities(name):
    robot = robot_of(name)
    q = poses(robot)
    qdot = np.random.default_rng(2).uniform(-2, 2, q.shape)
    for frame in ('base', 'tool'):
        expected = ks.jacobian(robot, q, axes=frame) @ qdot[..., None]
        found = ks.twist(robot, q, qdot, axes=frame)
        np.testing.assert_allclose(found, expected[..., 0], rtol=0, atol=ROUND_OFF)


@every_arm
def test_tool_axes_turn_both_halves_of_the_jacobian(name):
    robot = robot_of(name)
    q = poses(robot)
    to_tool = np.swapaxes(ks.forward_kinematics(robot, q)[:, :3, :3], -1, -2)
    expected = both_halves(to_tool, ks.jacobian(robot, q))
    np.testing.assert_allclose(
        ks.jacobian(robot, q, axes='tool'), expected, rtol=0, atol=ROUND_OFF
    )


@pytest.mark.slow
@every_arm
def test_another_base_turns_the_jacobian_and_moves_the_pose(name):
    robot = robot_of(name)
    B = Constant((0.7, -0.2, 1.1, 0.4, -1.0, 2.0)).matrix()
    q, other = poses(robot), moved(robot, base=B @ robot.description.base.motion.matrix)
    np.testing.assert_allclose(
        ks.forward_kinematics(other, q),
        B @ ks.forward_kinematics(robot, q),
        rtol=0,
        atol=ROUND_OFF,
    )
    np.testing.assert_allclose(
        ks.jacobian(other, q),
        both_halves(B[:3, :3], ks.jacobian(robot, q)),
        rtol=0,
        atol=ROUND_OFF,
    )


@pytest.mark.slow
@every_arm
def test_another_tool_shifts_the_reference_point(name):
    robot = without_factors(name)  # they may hold for one tool only
    D = Constant((0.3, -0.1, 0.2, 1.0, 0.5, -2.0)).matrix()
    q, other = poses(robot), moved(robot, tool=robot.description.tool.motion.matrix @ D)
    T, J = ks.forward_kinematics(robot, q), ks.jacobian(robot, q)
    np.testing.assert_allclose(ks.forward_kinematics(other, q), T @ D, rtol=0, atol=ROUND_OFF)
    shift = T[:, :3, :3] @ D[:3, 3]
    expected = J.copy()
    # v at the new point is v + w x shift.
    expected[:, :3] += np.cross(J[:, 3:], shift[:, :, None], axis=1)
    np.testing.assert_allclose(ks.jacobian(other, q), expected, rtol=0, atol=ROUND_OFF)


@pytest.mark.slow
@random_arms
def test_coupled_jacobian_is_the_open_one_times_the_coupling(name):
    robot = robot_of(name)
    opened = arm_of(name).opened()
    chain = ks.robot_from_text(opened.arm.text())
    q = poses(robot)
    q_chain = q @ opened.coupling.T + opened.constants
    np.testing.assert_allclose(
        ks.forward_kinematics(robot, q),
        ks.forward_kinematics(chain, q_chain),
        rtol=0,
        atol=ROUND_OFF,
    )
    expected = ks.jacobian(chain, q_chain) @ opened.coupling
    np.testing.assert_allclose(ks.jacobian(robot, q), expected, rtol=0, atol=ROUND_OFF)


def test_parallelogram_is_its_open_chain_times_the_couplings_of_the_document():
    # Document 000: [J1, J2 - J3 + J4, J3 - J4], joints of the chain th1, th2, th2p1, th2p2.
    text = ks.bundled_robots()['parallelogram_left'].read_text()
    text = text.replace('theta: theta3 - theta2}', 'theta: p1}')
    text = text.replace('theta: pi - (theta3 - theta2)}', 'theta: p2}')
    text = text.replace('{name: theta3,', '{name: p1, type: revolute}\n  - {name: p2,')
    text = text[: text.index('singularity:')]
    chain, robot = ks.robot_from_text(text), ks.load_robot('parallelogram_left')
    q = poses(robot)
    passive = q[:, 2] - q[:, 1]
    q_chain = np.stack([q[:, 0], q[:, 1], passive, math.pi - passive], axis=-1)
    J = ks.jacobian(chain, q_chain)
    expected = np.stack(
        [J[..., 0], J[..., 1] - J[..., 2] + J[..., 3], J[..., 2] - J[..., 3]], axis=-1
    )
    np.testing.assert_allclose(ks.jacobian(robot, q), expected, rtol=0, atol=ROUND_OFF)


@functools.cache
def standard_arm(dof):
    arm = random_arm(1, dof, 'standard')
    return arm, ks.robot_from_text(arm.text())


@pytest.mark.slow
@pytest.mark.parametrize('convention', CONVENTIONS[1:])
@pytest.mark.parametrize('dof', [1, 3, 6, 7])
def test_one_arm_in_two_conventions_is_one_arm(dof, convention):
    arm, one = standard_arm(dof)
    other = ks.robot_from_text(arm.in_convention(convention).text())
    q = poses(one)
    for number in (ks.forward_kinematics, ks.jacobian):
        np.testing.assert_allclose(number(one, q), number(other, q), rtol=0, atol=ROUND_OFF)
    assert one.singularity.task.rows == other.singularity.task.rows
    assert one.singularity.task.generic_rank == other.singularity.task.generic_rank
    assert one.singularity.task.dependent_joints == other.singularity.task.dependent_joints
    np.testing.assert_allclose(
        ks.singularity(one, q).singular_values,
        ks.singularity(other, q).singular_values,
        rtol=0,
        atol=ROUND_OFF,
    )


@pytest.mark.slow
@pytest.mark.parametrize('units', [('deg', 'm'), ('rad', 'mm')])
@pytest.mark.parametrize('name', RANDOM[::9])
def test_a_file_in_degrees_and_millimetres_equals_its_twin(name, units):
    robot = robot_of(name)
    twin = ks.robot_from_text(arm_of(name).text(units))
    q = poses(robot)
    for number in (ks.forward_kinematics, ks.jacobian):
        np.testing.assert_allclose(number(robot, q), number(twin, q), rtol=0, atol=ROUND_OFF)
    np.testing.assert_allclose(robot.limits, twin.limits, rtol=1e-15)
    assert robot.singularity.task.length == pytest.approx(
        twin.singularity.task.length, rel=ROUND_OFF
    )


def test_a_helical_joint_turns_and_slides():
    pitch = 0.02
    robot = ks.robot_from_text(
        'robot: screw\nsource: a jack\nconvention: standard\n'
        'joints: [{name: q, type: helical}]\n'
        f'links: [{{a: 0.3, alpha: 0, d: {pitch}*q, theta: q}}]\n'
    )
    q = np.linspace(-9, 9, 19)[:, None]
    J = ks.jacobian(robot, q)[..., 0]
    s, c, zero, one = np.sin(q[:, 0]), np.cos(q[:, 0]), np.zeros(19), np.ones(19)
    expected = np.stack([-0.3 * s, 0.3 * c, pitch * one, zero, zero, one], axis=-1)
    np.testing.assert_allclose(J, expected, rtol=0, atol=ROUND_OFF)
    heights = ks.forward_kinematics(robot, q)[:, 2, 3]
    np.testing.assert_allclose(heights, pitch * q[:, 0], rtol=0, atol=ROUND_OFF)


@pytest.mark.slow
@every_arm
def test_a_batch_is_its_single_poses_bit_for_bit(name):
    robot = robot_of(name)
    q = poses(robot, 4)
    qdot = np.random.default_rng(3).uniform(-1, 1, q.shape)
    batch = ks.evaluate(robot, q, qdot, depth=kernel.ALL_FRAMES)
    measures = arrays_of(ks.singularity(robot, q, qdot))
    for k in range(len(q)):
        single = ks.evaluate(robot, q[k], qdot[k], depth=kernel.ALL_FRAMES)
        assert np.array_equal(bits(single.numbers), bits(batch.numbers[k]))
        one_pose = arrays_of(ks.singularity(robot, q[k], qdot[k]))
        for field, whole in measures.items():
            # None where a batch has no numbers: no singular pose was found near.
            value = one_pose.get(field, np.nan)
            np.testing.assert_array_equal(value, whole[k], field)


def arrays_of(found):
    # Every array of a result and of the results in it, by name.
    arrays = {}
    for field in dataclasses.fields(found):
        value = getattr(found, field.name)
        if dataclasses.is_dataclass(value):
            arrays |= arrays_of(value)
        elif value is not None and field.name not in ('generic_rank', 'names'):
            arrays[field.name] = value
    return arrays


@pytest.mark.slow
@pytest.mark.parametrize('leading', [(0,), (1,), (2, 0, 3), (1, 2, 1, 2), (600,)])
@pytest.mark.parametrize('name', ['craig_3r', 'parallelogram_left'])
def test_leading_dimensions_come_out_as_they_went_in(name, leading):
    robot, n = robot_of(name), robot_of(name).dof
    q = np.random.default_rng(4).uniform(-1, 1, (*leading, n))
    assert ks.forward_kinematics(robot, q).shape == (*leading, 4, 4)
    assert ks.jacobian(robot, q).shape == ks.jacobian(robot, q, axes='tool').shape
    assert ks.jacobian(robot, q).shape == (*leading, 6, n)
    assert ks.twist(robot, q, q, axes='tool').shape == (*leading, 6)
    assert ks.link_frames(robot, q).shape == (*leading, robot.rows + 1, 4, 4)
    state = ks.evaluate(robot, q, q)
    assert state.quaternion_xyzw.shape == (*leading, 4)
    assert state.position.shape == (*leading, 3)
    found = ks.singularity(robot, q, q)
    count = min(n, len(robot.singularity.task.rows))
    assert found.singular_values.shape == (*leading, count)
    assert found.lost_direction.shape == (*leading, 6)
    assert found.joint_motion.shape == found.way_out.shape == (*leading, n)
    for number in (found.distance, found.rank, found.level, found.time_to_warning, found.rate):
        assert np.shape(number) == leading


def test_velocities_broadcast_against_positions():
    robot = robot_of('panda')
    random = np.random.default_rng(5)
    q, qdot = random.uniform(-1, 1, (4, 1, 7)), random.uniform(-1, 1, (3, 7))
    twist = ks.twist(robot, q, qdot)
    times = ks.singularity(robot, q, qdot).time_to_warning
    assert twist.shape == (4, 3, 6)
    assert times.shape == (4, 3)
    for i in range(4):
        for k in range(3):
            assert np.array_equal(twist[i, k], ks.twist(robot, q[i, 0], qdot[k]))
            assert times[i, k] == ks.singularity(robot, q[i, :1], qdot[k]).time_to_warning[0]
    assert ks.twist(robot, q[0, 0], np.zeros((0, 7))).shape == (0, 6)


@pytest.mark.parametrize('turns', [-3, 50])
@every_arm
def test_a_full_turn_of_a_joint_changes_nothing(name, turns):
    robot = robot_of(name)
    q = poses(robot, count=8)
    if name in BUNDLED:
        whole = ~sliding(robot)
    else:
        # Not where a gear ratio of a half, or a pitch, hangs on the joint.
        whole = np.array([kind == 'revolute' for kind in robot.joint_types])
        for row in arm_of(name).rows:
            for factor in row:
                for joint, ratio in getattr(factor, 'terms', ()):
                    whole[joint] &= ratio % 1.0 == 0.0
    turned = q + 2 * math.pi * turns * whole
    # The sum rounds to the spacing of doubles there, and each joint does so.
    rounding = ROUND_OFF + 16 * robot.dof * np.spacing(2 * math.pi * abs(turns))
    for number in (ks.forward_kinematics, ks.jacobian):
        np.testing.assert_allclose(number(robot, q), number(robot, turned), rtol=0, atol=rounding)


@pytest.mark.parametrize('size', [1e6, 1e12, 1e15])
@pytest.mark.parametrize('name', ['planar_3r', 'craig_3r', 'ur5e', 'panda', 'anthropomorphic_3r'])
def test_huge_angles_are_reduced_exactly(name, size):
    # No offsets in these tables, so theta is q itself and nothing is rounded before the sine.
    # Nor are there factors, which add angles up.
    robot = without_factors(name)
    q = np.random.default_rng(6).uniform(-size, size, (20, robot.dof))
    with mpmath.workdps(60):
        turn = 2 * mpmath.pi
        reduced = [[float(mpmath.mpf(x) - turn * mpmath.nint(x / turn)) for x in row] for row in q]
    for number in (ks.forward_kinematics, ks.jacobian):
        np.testing.assert_allclose(
            number(robot, q), number(robot, reduced), rtol=0, atol=ROUND_OFF
        )
    np.testing.assert_allclose(
        first_order_distances(robot, q),
        first_order_distances(robot, np.array(reduced)),
        rtol=QUOTIENT,
    )
    # The singular pose must be a number, too: of larger positions none is looked for.
    found, right = ks.singularity(robot, q).distance, ks.singularity(robot, reduced).distance
    apart = np.abs(found - right)
    assert size >= kernel.LARGEST_REDUCED or np.all(
        apart < 0.05 * right + robot.dof * np.spacing(size)
    )


@every_arm
def test_huge_angles_leave_a_rigid_motion(name):
    robot = robot_of(name)
    q = np.where(sliding(robot), 0.5, np.random.default_rng(7).uniform(-1e12, 1e12, robot.dof))
    if 'helical' in robot.joint_types:
        q = q * 1e-9
    R = ks.forward_kinematics(robot, q)[:3, :3]
    np.testing.assert_allclose(R @ R.T, np.eye(3), rtol=0, atol=ROUND_OFF)
    assert np.all(np.isfinite(ks.jacobian(robot, q)))


# A seeded prismatic joint slides a metre whatever the arm, so these have none. Each is built four
# times, of which those of more joints take a third of a second.
TURNING = [n for n in RANDOM if 'prismatic' not in arm_of(n).kinds][::2]


@pytest.mark.slow
@pytest.mark.parametrize('name', [n for n in TURNING if arm_of(n).dof < 7])
def test_size_does_not_matter_to_the_unit_free_measures(name):
    # A micrometre or a kilometre arm is judged like a metre one. Powers of two, which change no
    # round-off: that may decide from which start a search goes on, and so which pose it finds.
    arm, robot = arm_of(name), robot_of(name)
    q = searched_poses(robot)
    found = ks.singularity(robot, q)
    for factor in (2.0**-45, 2.0**10):
        other = ks.robot_from_text(arm.scaled(factor).text())
        assert other.singularity.task.rows == robot.singularity.task.rows
        assert other.singularity.task.generic_rank == robot.singularity.task.generic_rank
        assert other.singularity.task.dependent_joints == robot.singularity.task.dependent_joints
        assert other.singularity.task.length == pytest.approx(
            robot.singularity.task.length * factor, rel=QUOTIENT
        )
        again = ks.singularity(other, q)
        assert np.array_equal(found.rank, again.rank)
        np.testing.assert_allclose(
            first_order_distances(other, q),
            first_order_distances(robot, q),
            rtol=1e-6,
            atol=QUOTIENT,
        )
        np.testing.assert_array_equal(again.distance, found.distance)
        np.testing.assert_allclose(again.clearance, found.clearance, rtol=1e-9, atol=QUOTIENT)
    # A decimal factor rounds; the same pose is found but where that decides on another start.
    again = ks.singularity(ks.robot_from_text(arm.scaled(1e-6).text()), q)
    assert np.array_equal(found.rank, again.rank)
    assert np.mean(np.isclose(again.distance, found.distance, rtol=FOUND, atol=QUOTIENT)) > 0.9
    np.testing.assert_allclose(again.distance, found.distance, rtol=0.1)


def calibrated_tables():
    if not CALIBRATION.exists():
        return []
    data = json.loads(CALIBRATION.read_text())
    return [
        {
            key: np.add(data[delta['model']][key], delta[key])
            for key in ('a', 'alpha', 'd', 'theta')
        }
        for delta in data['unit_delta_dh']
    ]


TABLES = calibrated_tables()


@pytest.mark.slow
@pytest.mark.skipif(not TABLES, reason='the vendor reference is not here')
@pytest.mark.parametrize('k', range(len(TABLES)))
def test_factory_calibrated_arms_with_all_but_parallel_axes(k):
    # Their d2 and d3 are hundreds of metres that cancel: against 40 digits, to the round-off of
    # the largest length.
    table = TABLES[k]
    lines = ['robot: calibrated', 'source: a factory', 'convention: standard', 'joints:']
    lines += [f'  - {{name: q{i}, type: revolute}}' for i in range(6)] + ['links:']
    for i in range(6):
        a, alpha, d, theta = (repr(float(table[key][i])) for key in ('a', 'alpha', 'd', 'theta'))
        lines.append(f'  - {{a: {a}, alpha: {alpha}, d: {d}, theta: q{i} + {theta}}}')
    robot = ks.robot_from_text('\n'.join(lines) + '\n')
    longest = float(np.max(np.abs(table['d'])))
    assert robot.singularity.task.generic_rank == 6
    assert robot.singularity.task.dependent_joints == ()
    q = np.random.default_rng(8).uniform(-math.pi, math.pi, (5, 6))
    found, J = ks.forward_kinematics(robot, q), ks.jacobian(robot, q)
    for position, T, columns in zip(q, found, J):
        exact = as_doubles(exact_standard_pose(table, position))
        np.testing.assert_allclose(T, exact, rtol=0, atol=longest * ROUND_OFF)
        for j, column in enumerate(columns.T):
            with mpmath.workdps(40):
                step = mpmath.mpf(10) ** -15
                ahead, behind = (
                    exact_standard_pose(table, position, j, sign * step) for sign in (1, -1)
                )
                slope = as_doubles((ahead - behind) / (2 * step))
            expected = [*slope[:3, 3], *vee(slope[:3, :3] @ exact[:3, :3].T)]
            np.testing.assert_allclose(column, expected, rtol=0, atol=longest * ROUND_OFF)


def as_doubles(matrix):
    return np.array(matrix.tolist(), dtype=float)


def exact_standard_pose(table, q, moving=0, by=0):
    with mpmath.workdps(40):
        T = mpmath.eye(4)
        for i in range(6):
            a, alpha, d, theta = (
                mpmath.mpf(float(table[key][i])) for key in ('a', 'alpha', 'd', 'theta')
            )
            theta += mpmath.mpf(float(q[i])) + (by if i == moving else 0)
            c, s = mpmath.cos(theta), mpmath.sin(theta)
            ca, sa = mpmath.cos(alpha), mpmath.sin(alpha)
            T *= mpmath.matrix(
                [
                    [c, -s * ca, s * sa, a * c],
                    [s, c * ca, -c * sa, a * s],
                    [0, sa, ca, d],
                    [0, 0, 0, 1],
                ]
            )
        return T
