# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Loops that need each other's passive joints: closed together, as parallel machines have them."""

import math
import os
import pickle
import re
import subprocess
import sys
from pathlib import Path

import loop_numbers
import numpy as np
import parallel_machines as machines
import pytest
from arms import robot_of
from refusal import refused
from tolerances import DIFFERENCE, DIFFERENCE_STEP, ROUND_OFF

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.estimation.status_text import singularity_status
from kinematics_service.kernel.compiled import VARIABLE
from kinematics_service.kinematics.acceleration import jacobian_rate
from kinematics_service.kinematics.singularity import flat_loop
from kinematics_service.rigid_motion import rotation_of_roll_pitch_yaw
from kinematics_service.robot.closed_poses import closes_at

POSES = 20


@pytest.fixture(scope='module')
def planar():
    return ks.robot_from_text(machines.planar_text())


@pytest.fixture(scope='module')
def hexapod():
    return ks.robot_from_text(machines.hexapod_text())


def planar_poses():
    random = np.random.default_rng(5)
    for _ in range(POSES):
        middle = [0.25, 0.144] + random.uniform(-0.06, 0.06, 2)
        angle = random.uniform(-0.3, 0.3)
        yield middle, angle, machines.planar_joints(middle, angle)


def test_a_delta_comes_back_from_its_closed_form():
    robot = robot_of('flexpicker')
    random = np.random.default_rng(3)
    for _ in range(POSES):
        place = random.uniform([-0.5, -0.5, -1.25], [0.5, 0.5, -0.8])
        q = machines.delta_joints(place)
        state = ks.evaluate(robot, q)
        np.testing.assert_allclose(state.position, place, rtol=0, atol=ROUND_OFF)
        np.testing.assert_array_equal(state.pose[:3, :3], np.eye(3))
        J = machines.delta_jacobian(place, q)
        scale = 1.0 + np.max(np.abs(J))
        np.testing.assert_allclose(state.jacobian[:3], J, rtol=0, atol=ROUND_OFF * scale)
        assert not np.any(state.jacobian[3:])


def test_a_delta_stays_below_its_elbows_at_all_its_positions():
    # Inside its limits it closes everywhere, on the known one of the two sides.
    robot = robot_of('flexpicker')
    q = np.random.default_rng(4).uniform(*robot.limits.T, (300, 3))
    found = ks.forward_kinematics(robot, q)[:, :3, 3]
    expected = [machines.delta_position(one) for one in q]
    np.testing.assert_allclose(found, expected, rtol=0, atol=10 * ROUND_OFF)


def test_a_delta_is_that_of_the_report():
    # Its examples, rounded to a tenth of a degree.
    robot = robot_of('flexpicker')
    for degrees, place in (
        ([-20.5, -20.5, -20.5], [0.0, 0.0, -0.9]),
        ([47.5, -11.6, 21.4], [0.3, 0.5, -1.1]),
    ):
        found = ks.forward_kinematics(robot, np.radians(degrees))[:3, 3]
        np.testing.assert_allclose(found, place, rtol=0, atol=0.0015)


@pytest.mark.slow
def test_a_planar_platform_comes_back_from_its_closed_form(planar):
    for middle, angle, q in planar_poses():
        state = ks.evaluate(planar, q)
        np.testing.assert_allclose(state.position[:2], middle, rtol=0, atol=ROUND_OFF)
        turned = [math.cos(angle), math.sin(angle)]
        np.testing.assert_allclose(state.pose[:2, 0], turned, rtol=0, atol=ROUND_OFF)
        J = machines.planar_jacobian(middle, angle, q)
        scale = (1.0 + np.max(np.abs(J))) ** 2
        np.testing.assert_allclose(state.jacobian[[0, 1, 5]], J, rtol=0, atol=ROUND_OFF * scale)


def test_a_platform_on_six_legs_comes_back_from_its_closed_form(hexapod):
    random = np.random.default_rng(6)
    for _ in range(POSES):
        place = [0.0, 0.0, machines.HEXAPOD_HEIGHT] + random.uniform(-0.2, 0.2, 3)
        R = rotation_of_roll_pitch_yaw(random.uniform(-0.3, 0.3, 3))
        state = ks.evaluate(hexapod, machines.hexapod_lengths(place, R))
        np.testing.assert_allclose(state.position, place, rtol=0, atol=ROUND_OFF)
        np.testing.assert_allclose(state.pose[:3, :3], R, rtol=0, atol=ROUND_OFF)
        J = machines.hexapod_jacobian(place, R)
        scale = 1.0 + np.max(np.abs(J))
        np.testing.assert_allclose(state.jacobian, J, rtol=0, atol=10 * ROUND_OFF * scale)


@pytest.mark.slow
def test_points_of_passive_rows_move_as_differences_say(planar):
    q = np.array([q for _, _, q in planar_poses()])[:8]
    for row in range(planar.rows + 1):
        J = ks.jacobian(planar, q, of=row)
        for j in range(3):
            step = DIFFERENCE_STEP * np.eye(3)[j]
            later, before = (
                ks.forward_kinematics(planar, q + sign * step, of=row)[:, :3, 3]
                for sign in (1, -1)
            )
            change = (later - before) / (2 * DIFFERENCE_STEP)
            np.testing.assert_allclose(J[:, :3, j], change, rtol=0, atol=100 * DIFFERENCE)
    assert planar.ending_at(1).chain.loops == 0
    assert planar.ending_at(3).chain.loops == 2
    # The elbow of the first arm moves with all motors.
    assert np.all(np.abs(ks.jacobian(planar, q, of=4)[:, :2, 2]).max(axis=1) > 1e-3)


def test_the_jacobian_rate_is_its_derivative(planar):
    random = np.random.default_rng(8)
    for _, _, q in list(planar_poses())[:10]:
        qdot = random.normal(size=3)
        later, before = (
            ks.jacobian(planar, q + sign * DIFFERENCE_STEP * qdot) for sign in (1, -1)
        )
        change = (later - before) / (2 * DIFFERENCE_STEP)
        scale = 1.0 + np.max(np.abs(change))
        found = jacobian_rate(planar, q, qdot)
        np.testing.assert_allclose(found, change, rtol=0, atol=10 * DIFFERENCE * scale)


def test_the_determinant_of_a_group_and_its_gradient(planar):
    assert planar.loop_names == ('right_arm + top_arm',)
    for _, _, q in list(planar_poses())[:10]:
        factors = ks.singularity(planar, q).factors
        state = ks.evaluate(planar, q)
        assert factors.names == state.closure.names == planar.loop_names
        assert factors.results[0, 0] == pytest.approx(state.closure.determinants[0], rel=1e-9)
        for j in range(3):
            step = DIFFERENCE_STEP * np.eye(3)[j]
            later, before = (
                ks.evaluate(planar, q + sign * step).closure.determinants[0] for sign in (1, -1)
            )
            change = (later - before) / (2 * DIFFERENCE_STEP)
            assert factors.results[0, 1 + j] == pytest.approx(change, abs=DIFFERENCE)


def test_where_the_velocity_equation_is_singular_the_determinant_is_zero(planar):
    # Of the rods alone: det [rods, turning]. Both vanish together, and only there.
    ratios = []
    for middle, angle, q in planar_poses():
        ways = np.array([machines.plane_rotation(angle) @ c for c in machines.PLANAR_CORNERS])
        arms = machines.PLANAR_RODS[0] * np.stack([np.cos(q), np.sin(q)], axis=1)
        rods = middle + ways - machines.PLANAR_BASES - arms
        turning = rods[:, 1] * ways[:, 0] - rods[:, 0] * ways[:, 1]
        classical = np.linalg.det(np.column_stack([rods, turning]))
        ratios.append(ks.evaluate(planar, q).closure.determinants[0] / classical)
    np.testing.assert_allclose(np.abs(ratios), abs(ratios[0]), rtol=1e-9)


def test_a_branch_of_a_group_is_kept_or_refused(planar):
    # From the known position to anywhere: the same sign of the determinant, and closed.
    random = np.random.default_rng(9)
    q0 = machines.planar_joints(np.array([0.25, 0.144]), 0.0)
    sign = np.sign(ks.evaluate(planar, q0).closure.determinants[0])
    closed = 0
    for q in q0 + random.uniform(-1.0, 1.0, (60, 3)):
        if not closes_at(planar.chain, q):
            both = 'loops right_arm and top_arm together'
            with refused(ks.LoopError, 'open-loop', both, 'planar_3rrr') as caught:
                ks.evaluate(planar, q)
            assert caught.value.loop == 'right_arm + top_arm'
            continue
        state = ks.evaluate(planar, q)
        closed += 1
        assert np.sign(state.closure.determinants[0]) == sign
        assert state.closure.residuals[0] < 1e-13
        ends = [
            machines.PLANAR_BASES[k]
            + machines.PLANAR_RODS[0] * np.array([math.cos(q[k]), math.sin(q[k])])
            for k in range(3)
        ]
        corners = state.position[:2] + machines.PLANAR_CORNERS @ state.pose[:2, :2].T
        lengths = np.linalg.norm(corners - ends, axis=1)
        np.testing.assert_allclose(lengths, machines.PLANAR_RODS[1], rtol=0, atol=ROUND_OFF)
    assert 6 < closed < 54


def test_the_nearest_flat_position_of_a_group_ends_its_branch(planar):
    # And value and gradient of its determinant stay those of the pose itself.
    random, looked_at = np.random.default_rng(3), 0
    for q in random.uniform(planar.limits[:, 0], planar.limits[:, 1], (100, 3)):
        if not closes_at(planar.chain, q):
            continue
        found = ks.singularity(planar, q)
        # Farther away the nearest may be a pose at which no loop is flat.
        if not 1e-3 <= found.distance <= 0.25:
            continue
        looked_at += 1
        assert flat_loop(planar, found) == 'right_arm + top_arm'
        assert found.factors.estimates[0] == found.distance
        way = found.nearest_singular - q
        assert np.linalg.norm(way) == pytest.approx(found.distance, rel=1e-12)
        closure = ks.evaluate(planar, q).closure
        assert found.factors.values[0] == pytest.approx(closure.determinants[0], rel=1e-9)
        # A determinant falls as the root of what is left of the way.
        near = ks.evaluate(planar, q + (1.0 - 1e-3) * way).closure.determinants[0]
        assert abs(near / found.factors.values[0]) < 0.1
        with pytest.raises(ks.LoopError):
            ks.evaluate(planar, q + 1.02 * way)
    assert looked_at > 4


def test_the_nearest_singular_pose_of_a_machine_with_a_group_is_singular():
    robot = robot_of('flexpicker')
    ring = np.random.default_rng(4).normal(size=(30, 3))
    ring /= np.linalg.norm(ring, axis=1)[:, None]
    for q in ([1.55, 1.72, 1.2], [1.5, 1.2, 1.7], [1.7, 1.4, 1.5]):
        found = ks.singularity(robot, q)
        assert flat_loop(robot, found) == ''
        closure = ks.evaluate(robot, q).closure
        assert found.factors.values[0] == pytest.approx(closure.determinants[0], rel=1e-9)
        assert ks.singularity(robot, found.nearest_singular).smallest_singular_value < 1e-6
        sign = np.sign(found.determinant)
        nearer = ks.singularity(robot, q + 0.98 * found.distance * ring).determinant
        assert np.all(np.sign(nearer) == sign)


def test_a_warning_names_all_loops_of_a_group(planar):
    q = [1.564698, -2.570612, -0.920432]
    found = ks.singularity(planar, q)
    status = singularity_status(planar, found, found.level, 'base_link')
    both = 'loops right_arm and top_arm together'
    assert status.sentence.count(both) == 2
    assert 'right_arm + top_arm = ' in status.sentence
    values = dict(status.values)
    assert values['nearest'] == both
    assert re.search(r'^det \S+, 0\.0027\d* rad', values['loop_right_arm_top_arm'])
    assert all(re.fullmatch('[a-z0-9_]+', key) for key, _ in status.values)


def test_a_machine_with_a_group_is_pickled(planar):
    again = pickle.loads(pickle.dumps(planar))
    q = machines.planar_joints(np.array([0.26, 0.15]), 0.1)
    assert np.array_equal(ks.evaluate(again, q).row, ks.evaluate(planar, q).row)


def test_inverse_kinematics_goes_through_a_group():
    robot = robot_of('flexpicker')
    for place in ([0.1, -0.2, -1.05], [-0.3, 0.2, -0.95], [0.0, 0.0, -1.2]):
        result = ks.inverse_kinematics(robot, place, rows=('x', 'y', 'z'), all_solutions=False)
        (found,) = result.solutions
        np.testing.assert_allclose(found.q, machines.delta_joints(place), rtol=0, atol=1e-6)


@pytest.mark.slow
def test_a_planar_platform_reaches_a_pose_in_one_way_inside_its_limits(planar):
    # And in others with its arms turned over, which the search need not wait for.
    q = machines.planar_joints(np.array([0.26, 0.15]), 0.1)
    result = ks.inverse_kinematics(planar, ks.forward_kinematics(planar, q))
    (found,) = result.solutions
    np.testing.assert_allclose(found.q, q, rtol=0, atol=1e-6)


@pytest.mark.slow
@pytest.mark.skipif(not kernel.is_compiled(), reason='about the compiled kernel')
def test_groups_have_the_numbers_of_the_source_to_the_last_bit(planar, hexapod, tmp_path):
    # Pickled: plain Python takes minutes to look at the poses of a new arm.
    files = []
    for robot in (planar, hexapod):
        files.append(str(tmp_path / f'{robot.name}.pickle'))
        Path(files[-1]).write_bytes(pickle.dumps(robot))
    done = subprocess.run(
        [sys.executable, str(Path(__file__).parent / 'loop_numbers.py'), *files],
        env={**os.environ, VARIABLE: '1'},
        capture_output=True,
        text=True,
        timeout=280,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == list(loop_numbers.lines(files))


def test_loops_that_do_not_go_together_are_refused_by_the_kernel(planar):
    group = planar.chain.closure.first
    first, second = group.members()
    units = np.ones(group.variables)
    parts = [
        lambda: kernel.Loop(first.there, first.back, first.axes(), 1, second),
        lambda: kernel.LoopGroup(second, 3, 1.0, units),
        lambda: kernel.LoopGroup(first, 4, 1.0, units),
        lambda: kernel.LoopGroup(first, 3, 1.0, units[:6]),
        lambda: kernel.assemble(group, 2, 3, np.zeros(500)),
        lambda: kernel.assemble(group, 1, 2, np.zeros(500)),
    ]
    for wrong in parts:
        with pytest.raises(TypeError, match='do not go together'):
            wrong()
