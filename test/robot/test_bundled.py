# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The bundled robots: every file is sound, and the source documents' arms do what the documents say.
"""

import copy
import dataclasses
import json
import math
import pickle
import re

import numpy as np
import pytest
from arms import BUNDLED, LOOPED, poses, robot_of
from tolerances import ROUND_OFF

import kinematics_service as ks
from kinematics_service.rigid_motion import rotation_vector

every_robot = pytest.mark.parametrize('name', [*BUNDLED, *LOOPED])

DOCUMENTS = (
    'anthropomorphic_3r',
    'parallelogram_left',
    'parallelogram_right',
    'spherical_rrp',
    'craig_3r',
    'rrp_elementary',
    'offset_stanford_shape',
    'offset_stanford_dh',
    'offset_stanford_printed',
    'six_joint_dh',
    'six_joint_dh_unit',
)


def test_every_document_has_its_arms():
    assert set(DOCUMENTS) <= set(BUNDLED)
    assert list(BUNDLED) == sorted(BUNDLED)


@every_robot
def test_a_bundled_file_is_sound(name):
    path, robot = ks.bundled_robots()[name], robot_of(name)
    assert path.stem == robot.name == name
    assert robot.description.warnings == ()
    assert len(robot.source) > 20
    assert len(robot.description.known_poses) >= 3
    text = path.read_text(encoding='utf-8')
    assert text.isascii()
    assert '\t' not in text
    # No names of files nobody else has, no numbers of a list of errata; comments are copied too.
    for inner in (r'\bE\d\.\d', r'\.txt\b', r'_[0-9a-f]{12,}\b', r'\(lines? \d', r'document 00'):
        assert not re.search(inner, text), inner
    # Where it is from comes first: `robots` cuts what does not fit.
    assert len(robot.source.partition(';')[0]) <= 200


def test_known_poses_hold():
    for robot in map(robot_of, (*BUNDLED, *LOOPED)):
        _check_known_poses(robot)


def _check_known_poses(robot):
    for known in robot.description.known_poses:
        found, expected = ks.forward_kinematics(robot, known.q), known.motion.matrix
        apart = np.linalg.norm(found[:3, 3] - expected[:3, 3])
        angle = np.linalg.norm(rotation_vector(expected[:3, :3].T @ found[:3, :3]))
        assert apart <= known.tolerance_xyz
        assert angle <= known.tolerance_rpy


@pytest.mark.parametrize('name', ['craig_3r', 'rrp_elementary', 'six_joint_dh', 'flexpicker'])
def test_what_a_robot_says_goes_into_json(name):
    robot = robot_of(name)
    said = {
        'name': robot.name,
        'source': robot.source,
        'joints': robot.joint_names,
        'types': robot.joint_types,
        'limits': [
            [x if math.isfinite(x) else None for x in row] for row in robot.limits.tolist()
        ],
        'task': robot.singularity.task.rows,
        'length': robot.singularity.task.length,
        'reach': robot.singularity.task.reach,
        'generic_rank': robot.singularity.task.generic_rank,
        'dependent_joints': robot.singularity.task.dependent_joints,
        'thresholds': [robot.singularity.thresholds.warn, robot.singularity.thresholds.stop],
        'factors': {factor.name: factor.text for factor in robot.description.singularity.factors},
        'known_poses': [known.q for known in robot.description.known_poses],
        'frames': [robot.base_frame, robot.tool_frame],
    }
    again = json.loads(json.dumps(said, allow_nan=False))
    assert again['source'] == robot.source


FACTORED = (
    *('anthropomorphic_3r', 'craig_3r', 'planar_2r', 'planar_3r', 'puma560', 'rrp_elementary'),
    *('offset_stanford_dh', 'offset_stanford_printed', 'offset_stanford_shape'),
    *('parallelogram_left', 'parallelogram_right', 'scara_hsr065', 'spherical_rrp'),
    *('ur10e', 'ur3e', 'ur5e'),
)


@pytest.mark.parametrize('name', FACTORED)
def test_the_factors_of_the_file_are_those_of_its_determinant(name):
    # det = c times the product of the factors, each to a whole power: linear in logarithms.
    robot = robot_of(name)
    measures = ks.singularity(robot, np.random.default_rng(3).uniform(-2.5, 2.5, (50, robot.dof)))
    logs = np.log(np.abs(np.column_stack([measures.factors.values, np.full(50, math.e)])))
    det = np.log(np.abs(measures.determinant))
    powers = np.linalg.lstsq(logs, det, rcond=None)[0]
    np.testing.assert_allclose(powers[:-1], np.rint(powers[:-1]), atol=1e-9)
    assert np.all(powers[:-1] > 0.5)
    np.testing.assert_allclose(logs @ powers, det, atol=1e-9)


def test_both_chains_of_the_parallelogram_are_one_arm():
    left, right = robot_of('parallelogram_left'), robot_of('parallelogram_right')
    q = poses(left, 100)
    for number in (ks.forward_kinematics, ks.jacobian):
        np.testing.assert_allclose(number(left, q), number(right, q), rtol=0, atol=ROUND_OFF)


def test_the_repaired_table_of_document_003_is_the_arm_of_its_shape_matrices():
    shape, table = robot_of('offset_stanford_shape'), robot_of('offset_stanford_dh')
    q = poses(shape, 100)
    for number in (ks.forward_kinematics, ks.jacobian):
        np.testing.assert_allclose(number(shape, q), number(table, q), rtol=0, atol=ROUND_OFF)


def test_the_printed_table_of_document_003_is_another_arm():
    # Axes 4 and 6 pass each other n apart in the printed table; in the right one they meet.
    n = constants(robot_of('offset_stanford_printed'))['n']
    for name, expected in (('offset_stanford_printed', n), ('offset_stanford_dh', 0.0)):
        robot = robot_of(name)
        q = np.random.default_rng(0).uniform(0.3, 1.2, (20, 6))
        frames = ks.link_frames(robot, q)
        # Standard table: axis i is the z axis of frame i - 1.
        o4, z4 = frames[:, 3, :3, 3], frames[:, 3, :3, 2]
        o6, z6 = frames[:, 5, :3, 3], frames[:, 5, :3, 2]
        normal = np.cross(z4, z6)
        apart = np.abs(np.sum((o6 - o4) * normal, axis=1)) / np.linalg.norm(normal, axis=1)
        np.testing.assert_allclose(apart, expected, rtol=0, atol=ROUND_OFF)


def test_the_so101_stretched_is_at_its_elbow_and_points_its_gripper():
    # Its links are bent: stretched, the axes of shoulder, elbow and wrist are in one plane.
    robot = robot_of('so101')
    q = np.array([0.4, 0.2, math.atan2(52, 1349) - math.atan2(11257, 2800), 0.3, -0.5])
    found = ks.singularity(robot, q)
    assert found.factors.names == ('elbow',)
    assert found.factors.estimates[0] < ROUND_OFF
    assert found.rank == 4
    assert found.level == ks.Level.ERROR
    axes = ks.link_frames(robot, q)[1:4, :3, 3]  # origins of axes 2, 3 and 4
    upper, lower = np.diff(axes, axis=0)
    assert np.linalg.norm(np.cross(upper, lower)) < ROUND_OFF
    # Five joints: a position and the direction of the gripper, as a person types them.
    q[2] = 0.2
    target = np.round(ks.forward_kinematics(robot, q), 7)
    target[:3, :3] = ks.forward_kinematics(robot, q)[:3, :3]
    result = ks.inverse_kinematics(robot, target, near=q)
    assert result.status == 'solved'
    assert np.max(np.abs(result[0].q - q)) < 1e-4


def constants(robot):
    return {constant.name: constant.value for constant in robot.description.constants}


def sin(*angles):
    return np.sin(sum(angles))


def cos(*angles):
    return np.cos(sum(angles))


def parallelogram(c, q):
    shoulder = c['L1'] * cos(q[2]) - c['L5'] * cos(q[1])
    return c['L1'] * c['L5'] * sin(q[2], -q[1]) * shoulder


def stanford(c, q):
    boom = c['l'] + c['m'] + q[2]
    return -boom * (c['a'] + boom * cos(q[1])) * sin(q[4])


def printed(c, q):
    boom = c['l'] + c['m'] + q[2]
    wrist = boom * (c['a'] + boom * sin(q[1])) * sin(q[4])
    return wrist - c['a'] * c['n'] * sin(q[3]) * cos(q[3]) * cos(q[4])


def universal(c, q):
    shoulder = c['a2'] * cos(q[1]) + c['a3'] * cos(q[1], q[2]) + c['d5'] * sin(q[1], q[2], q[3])
    return c['a2'] * c['a3'] * shoulder * sin(q[2]) * sin(q[4])


# det(J_t) by hand, c the constants of the file.
DETERMINANTS = {
    'anthropomorphic_3r': lambda c, q: (
        -c['L2'] * c['L3'] * sin(q[2]) * (c['L2'] * cos(q[1]) + c['L3'] * cos(q[1], q[2]))
    ),
    'parallelogram_left': parallelogram,
    'parallelogram_right': parallelogram,
    'spherical_rrp': lambda c, q: -(q[2] ** 2) * sin(q[1]),
    'craig_3r': lambda c, q: (
        c['L2'] * c['L3'] * sin(q[2]) * (c['L1'] + c['L2'] * cos(q[1]) + c['L3'] * cos(q[1], q[2]))
    ),
    'rrp_elementary': lambda c, q: -cos(q[1]) * (c['a2'] + q[2]) ** 2,
    'offset_stanford_shape': stanford,
    'offset_stanford_dh': stanford,
    'offset_stanford_printed': printed,
    'planar_2r': lambda c, q: c['L1'] * c['L2'] * sin(q[1]),
    'planar_3r': lambda c, q: c['L1'] * c['L2'] * sin(q[1]),
    'scara_hsr065': lambda c, q: c['L1'] * c['L2'] * sin(q[1]),
    'ur3e': universal,
    'ur5e': universal,
    'ur10e': universal,
    'puma560': lambda c, q: (
        c['a2']
        * (c['a3'] * sin(q[2]) + c['d4'] * cos(q[2]))
        * (c['a2'] * cos(q[1]) + c['a3'] * cos(q[1], q[2]) - c['d4'] * sin(q[1], q[2]))
        * sin(q[4])
    ),
}


@pytest.mark.parametrize('name', DETERMINANTS)
def test_determinant_by_its_closed_form(name):
    robot = robot_of(name)
    q = poses(robot, 300)
    expected = DETERMINANTS[name](constants(robot), q.T)
    np.testing.assert_allclose(
        ks.singularity(robot, q).determinant, expected, rtol=0, atol=ROUND_OFF
    )


@pytest.mark.parametrize('name', ['six_joint_dh', 'six_joint_dh_unit'])
def test_document_004_is_judged_by_what_is_left_of_its_determinant(name):
    # det J is zero at every pose. Without the doubled column sqrt(det(J5^T J5)) =
    # |a3 a4 sin th4| sqrt(Rh^2 + sin^2(th3 + th4 + th5)); the double counts sqrt(2) times.
    robot = robot_of(name)
    c, q = constants(robot), poses(robot, 300)
    th3, th4, th5 = q.T[2:5]
    Rh = c['a3'] * cos(th3) + c['a4'] * cos(th3, th4) - c['d6'] * sin(th3, th4, th5)
    left = np.abs(c['a3'] * c['a4'] * np.sin(th4)) * np.hypot(Rh, sin(th3, th4, th5))
    found = ks.singularity(robot, q)
    assert np.all(found.determinant == 0.0)
    np.testing.assert_allclose(found.manipulability, math.sqrt(2) * left, rtol=0, atol=ROUND_OFF)


def test_example_of_document_004():
    robot = robot_of('six_joint_dh_unit')
    q = np.radians([0, 0, 90, 0, -90, 0])
    columns = [
        [2, 0, 0, 0, 0, 1],
        [2, 0, 0, 0, 0, 1],
        [-3, 0, 0, 0, -1, 0],
        [-2, 0, 0, 0, -1, 0],
        [-1, 0, 0, 0, -1, 0],
        [0, 0, 0, 0, 0, 1],
    ]
    np.testing.assert_allclose(ks.jacobian(robot, q).T, columns, rtol=0, atol=ROUND_OFF)
    assert ks.singularity(robot, q).rank == 3


def test_moving_out_by_a2_is_not_singular_in_document_002():
    # The document lists d3 = +a2 among its singular poses; only d3 = -a2 is one.
    robot = robot_of('rrp_elementary')
    a2 = constants(robot)['a2']
    assert ks.singularity(robot, [0.2, 1 / 3, a2]).rank == 3
    assert ks.singularity(robot, [0.2, 1 / 3, -a2]).rank == 1
    assert ks.singularity(robot, [0.2, math.pi / 2, 0.1]).rank == 2


def test_the_tip_on_the_first_axis_is_singular_in_document_001():
    # q3 = -q2 +- acos(-(L1 + L2 cos q2) / L3): the set the document's conclusion leaves out.
    robot = robot_of('craig_3r')
    c = constants(robot)
    q2 = np.linspace(-math.pi, math.pi, 401)
    cosine = -(c['L1'] + c['L2'] * np.cos(q2)) / c['L3']
    q2, cosine = q2[np.abs(cosine) < 0.999], cosine[np.abs(cosine) < 0.999]
    for sign in (1, -1):
        q = np.stack([np.full_like(q2, 0.4), q2, -q2 + sign * np.arccos(cosine)], axis=-1)
        found = ks.singularity(robot, q)
        assert np.all(found.distance == 0.0)
        # What is lost is the motion across the arm plane.
        across = np.array([-math.sin(0.4), math.cos(0.4), 0, 0, 0, 0])
        np.testing.assert_allclose(np.abs(found.lost_direction @ across), 1.0, atol=1e-9)


def test_a_robot_is_judged_by_its_own_chain():
    robot, other = robot_of('ur5e'), robot_of('puma560')
    with pytest.raises(TypeError, match='not that of its singularity model'):
        dataclasses.replace(robot, chain=other.chain)
    for copied in (pickle.loads(pickle.dumps(robot)), copy.deepcopy(robot)):
        assert copied.singularity.chain is copied.chain
