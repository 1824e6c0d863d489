# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Every system of the source documents against numbers made independently with 50 digits."""

import json

import numpy as np
import pytest
from arms import robot_of
from folders import GOLDEN
from tolerances import DETERMINANT, ROUND_OFF

import kinematics_service as ks

# Golden system: the bundled robot that is the same arm.
SYSTEMS = {
    's000a_anthropomorphic_dh': ('anthropomorphic_3r',),
    's000b_parallelogram_closed_loop': ('parallelogram_left', 'parallelogram_right'),
    's000c_spherical_rrp_dh': ('spherical_rrp',),
    's001_craig_3r_mdh': ('craig_3r',),
    's002_rrp_ets': ('rrp_elementary',),
    's003a_sheth_uicker_6dof': ('offset_stanford_shape', 'offset_stanford_dh'),
    's003b_dh_as_printed_6dof': ('offset_stanford_printed',),
    's003c_dh_matched_6dof': ('offset_stanford_dh', 'offset_stanford_shape'),
    's004a_six_joint_dh_generic': ('six_joint_dh',),
    's004b_six_joint_dh_unit': ('six_joint_dh_unit',),
}
PAIRS = [(system, robot) for system, robots in SYSTEMS.items() for robot in robots]
TASK_ROWS = ('x', 'y', 'z', 'rx', 'ry', 'rz')


def golden(system):
    return json.loads((GOLDEN / f'{system}.json').read_text())


def unscaled(name):
    # The golden singular values are of J_t in m and rad as they are: characteristic length 1.
    from kinematics_service.robot.robot import with_singularity

    return with_singularity(robot_of(name), length=1.0)


def test_every_golden_system_but_the_general_loop_has_a_robot():
    files = {path.stem for path in GOLDEN.glob('s0*.json')}
    assert files - set(SYSTEMS) == {'s000b_x_general_loop'}, 'its coupling is not linear'


@pytest.mark.parametrize(('system', 'name'), PAIRS)
def test_pose_jacobian_and_twist(system, name):
    data, robot = golden(system), robot_of(name)
    configs = data['configs']
    q = np.array([config['q'] for config in configs])
    qdot = np.array([config['qdot'] for config in configs])
    np.testing.assert_allclose(
        ks.forward_kinematics(robot, q), [c['T'] for c in configs], rtol=0, atol=ROUND_OFF
    )
    np.testing.assert_allclose(
        ks.jacobian(robot, q), [c['J'] for c in configs], rtol=0, atol=ROUND_OFF
    )
    np.testing.assert_allclose(
        ks.twist(robot, q, qdot), [c['twist'] for c in configs], rtol=0, atol=ROUND_OFF
    )


@pytest.mark.parametrize(('system', 'name'), PAIRS)
def test_task_rows_are_the_documents(system, name):
    rows = [TASK_ROWS[i] for i in golden(system)['task_rows']]
    assert list(robot_of(name).singularity.task.rows) == rows


@pytest.mark.parametrize(('system', 'name'), PAIRS)
def test_determinant_rank_and_singular_values(system, name):
    data, robot = golden(system), unscaled(name)
    deficient = robot.singularity.task.structurally_deficient
    for config in data['configs']:
        found = ks.singularity(robot, config['q'])
        assert found.rank == config['rank_task'], config['name']
        np.testing.assert_allclose(
            found.singular_values, config['sv_task'], rtol=0, atol=ROUND_OFF
        )
        assert found.determinant == pytest.approx(config['task_det'], rel=0, abs=DETERMINANT)
        product = np.prod(config['sv_task'][: robot.singularity.task.generic_rank])
        expected = product if deficient else config['task_manip']
        assert found.manipulability == pytest.approx(expected, rel=0, abs=ROUND_OFF)


@pytest.mark.parametrize(('system', 'name'), PAIRS)
def test_singular_configurations_are_errors_and_lose_a_direction(system, name):
    data, robot = golden(system), robot_of(name)
    for config in data['configs']:
        found = ks.singularity(robot, config['q'])
        if (
            config['kind'] == 'singular'
            and config['rank_task'] < robot.singularity.task.generic_rank
        ):
            assert found.distance < 1e-9, config['name']
            assert found.level == ks.Level.ERROR
            J = np.array(config['J'])
            scale = np.repeat([1.0, 1 / robot.singularity.task.length], 3)
            lost = found.lost_direction * scale
            # No joint moves the tool along the lost direction.
            weight = np.repeat([1.0, robot.singularity.task.length**2], 3)
            np.testing.assert_allclose((lost * weight) @ J, 0.0, atol=1e-9)
        if config['kind'] == 'near_singular':
            assert 0.0 < found.distance < 1e-4


@pytest.mark.parametrize('name', ['six_joint_dh', 'six_joint_dh_unit'])
def test_joints_one_and_two_share_an_axis_at_every_pose(name):
    task = robot_of(name).singularity.task
    assert task.structurally_deficient
    assert task.generic_rank == 5
    assert task.dependent_joints == ('theta1', 'theta2')


FRAME_ROWS = {
    # The golden frames follow rows (DH), operations (elementary) or joints (shape).
    system: robots[0]
    for system, robots in SYSTEMS.items()
    if system not in ('s000b_parallelogram_closed_loop',)
}


@pytest.mark.parametrize(('system', 'name'), FRAME_ROWS.items())
def test_frames_after_every_row(system, name):
    data, robot = golden(system), robot_of(name)
    compared = 0
    for config in data['configs']:
        if 'frames' in config:
            frames = ks.link_frames(robot, config['q'])[1:]
            np.testing.assert_allclose(frames, config['frames'], rtol=0, atol=ROUND_OFF)
            compared += 1
    assert compared == 5


def test_tool_velocity_along_the_path_of_document_002():
    data = json.loads((GOLDEN / 'traj_s002_tool_velocity.json').read_text())
    case = next(case for case in data['cases'] if case['name'] == 'generic_m')
    robot = ks.load_robot('rrp_elementary')
    samples = case['samples']
    q = np.array([sample['q'] for sample in samples])
    qdot = np.array([sample['qdot'] for sample in samples])
    twist = ks.twist(robot, q, qdot)
    np.testing.assert_allclose(twist[:, :3], [s['v'] for s in samples], rtol=0, atol=ROUND_OFF)
    np.testing.assert_allclose(twist[:, 3:], [s['omega'] for s in samples], rtol=0, atol=ROUND_OFF)
    position = ks.forward_kinematics(robot, q)[:, :3, 3]
    np.testing.assert_allclose(position, [s['p'] for s in samples], rtol=0, atol=ROUND_OFF)
    determinants = ks.singularity(robot, q).determinant
    np.testing.assert_allclose(
        determinants, [s['detJv'] for s in samples], rtol=0, atol=DETERMINANT
    )


@pytest.mark.parametrize(
    ('q', 'condition_number'),
    [
        ((0, -0.785, 0, -2.356, 0, 1.571, 0.785), 8.0502),
        ((0, 0.334, 0, -1.177, 0, 1.510, 0.785), 18.8608),
        ((-0.0001, 0.5690, 0.0005, -0.7782, 0, 1.3453, 0.7845), 42.2797),
        ((0, 0.3458, 0, -1.1424, 0, 1.4865, 0.785), 19.7809),
    ],
)
def test_moveit_servos_states_of_the_panda(q, condition_number):
    # moveit_servo's test states and the condition numbers it documents, of the unscaled Jacobian;
    # four decimals are printed.
    found = ks.singularity(unscaled('panda'), q)
    assert found.condition_number == pytest.approx(condition_number, abs=1e-4)
