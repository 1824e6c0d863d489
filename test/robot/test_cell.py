# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Cells: two arms as one chain, against each arm by itself and one tree of a peer."""

import re
from pathlib import Path

import numpy as np
import pytest
from arms import calm_poses, poses
from refusal import refused
from tolerances import ROUND_OFF

import kinematics_service as ks
from kinematics_service.errors import RobotFileError
from kinematics_service.kernel import ALL_FRAMES
from kinematics_service.kinematics.loop_links import loop_links
from kinematics_service.kinematics.tool_state import evaluate

# Of every convention, with prismatic, coupled and helical joints, in mm and deg: the arms.
ARMS = ('ur5e', 'panda', 'scara_hsr065', 'offset_stanford_shape', 'rrp_elementary', 'so101')
HELICAL = """
robot: screw
convention: modified
units: {angle: deg, length: mm}
joints:
  - {name: lift, variable: q1, type: helical}
  - {name: turn, variable: q2, type: revolute, limits: [-90, 90]}
links:
  - {a: 0, alpha: 0, d: 50 + 0.5*q1, theta: q1}
  - {a: 300, alpha: 90, d: 0, theta: q2 - 2*q1 + 30}
tool: {xyz: [0, 0, 120]}
points:
  elbow: {row: 1, xyz: [10, 0, 0]}
"""
PLACES = ('xyz: [0.1, 0.5, 0.02], rpy: [0.1, 0, -1]', 'xyz: [1.2, -0.3, 0], rpy: [0, 0.4, pi]')


def cell_file(folder, first, second, more=''):
    arms = '\n'.join(
        f'  {side}: {{robot: {arm}, joint_prefix: {side}_, {place}}}'
        for side, arm, place in zip(('left', 'right'), (first, second), PLACES)
    )
    file = folder / 'bench.yaml'
    file.write_text(f'cell: bench\n{more}arms:\n{arms}\n')
    return file


def relative_jacobian(A, JA, B, JB):
    """Return the Jacobian of frame B as seen from A, in A's axes, of the joints of both."""
    R, p = A[:3, :3].T, A[:3, :3].T @ (B[:3, 3] - A[:3, 3])
    cross = np.array([[0, -p[2], p[1]], [p[2], 0, -p[0]], [-p[1], p[0], 0]])
    mine = np.vstack([R @ JA[:3] - cross @ (R @ JA[3:]), R @ JA[3:]])
    return np.hstack([-mine, np.vstack([R @ JB[:3], R @ JB[3:]])])


@pytest.mark.parametrize(('first', 'second'), [*zip(ARMS[::2], ARMS[1::2])])
def test_two_arms_are_the_chain_from_tool_to_tool(tmp_path, first, second):
    file = cell_file(tmp_path, first, second)
    both = ks.load_robot(file)
    left, right = (ks.load_robot(f'{file}:cell:{side}') for side in ('left', 'right'))
    assert both.joint_names == (*left.joint_names, *right.joint_names)
    assert left.joint_names[0].startswith('left_')
    assert (both.base_frame, both.tool_frame) == (left.tool_frame, right.tool_frame)
    assert left.base_frame == right.base_frame == 'cell'
    q = np.hstack([poses(left)[:4], poses(right)[:4]])
    for one in q:
        of_left, of_right = one[: left.dof], one[left.dof :]
        A, B = ks.forward_kinematics(left, of_left), ks.forward_kinematics(right, of_right)
        size = ROUND_OFF * (1.0 + np.abs(A).max() + np.abs(B).max())
        np.testing.assert_allclose(
            ks.forward_kinematics(both, one), np.linalg.inv(A) @ B, rtol=0, atol=size
        )
        expected = relative_jacobian(
            A, ks.jacobian(left, of_left), B, ks.jacobian(right, of_right)
        )
        np.testing.assert_allclose(ks.jacobian(both, one), expected, rtol=0, atol=2 * size)


def test_a_cell_is_one_tree_of_a_peer(tmp_path):
    pinocchio = pytest.importorskip('pinocchio')
    both = ks.load_robot(file := cell_file(tmp_path, 'ur5e', 'panda'))
    models = []
    for side in ('left', 'right'):
        text = ks.export_urdf(ks.load_robot(f'{file}:cell:{side}'))
        # All links of the two in one tree: names of their own.
        text = re.sub('(link(?: name)?=)"(?!left_|right_)', rf'\1"{side}_', text)
        models.append(pinocchio.buildModelFromXML(text))
    model = pinocchio.appendModel(*models, 0, pinocchio.SE3.Identity())
    data = model.createData()
    random = np.random.default_rng(4)
    frames = [model.getFrameId(frame) for frame in (both.base_frame, both.tool_frame)]
    for _ in range(5):
        q, whole = random.uniform(-1.5, 1.5, both.dof), pinocchio.neutral(model)
        columns = []
        for name, value in zip(both.joint_names, q):
            joint = model.joints[model.getJointId(name)]
            place = joint.idx_q
            whole[place : place + joint.nq] = (
                value if joint.nq == 1 else (np.cos(value), np.sin(value))
            )
            columns.append(joint.idx_v)
        pinocchio.framesForwardKinematics(model, data, whole)
        A, B = (data.oMf[frame].homogeneous for frame in frames)
        np.testing.assert_allclose(
            ks.forward_kinematics(both, q), np.linalg.inv(A) @ B, rtol=0, atol=10 * ROUND_OFF
        )
        J = [
            pinocchio.computeFrameJacobian(
                model, data, whole, frame, pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
            )[:, columns]
            for frame in frames
        ]
        found = relative_jacobian(A, J[0], B, J[1])
        expected = found[:, : both.dof] + found[:, both.dof :]
        np.testing.assert_allclose(ks.jacobian(both, q), expected, rtol=0, atol=10 * ROUND_OFF)


def test_units_helical_joints_and_points(tmp_path):
    (tmp_path / 'screw.yaml').write_text(HELICAL)
    file = cell_file(tmp_path, 'screw.yaml', 'craig_3r')
    screw, q = ks.load_robot(tmp_path / 'screw.yaml'), np.array([0.3, -0.4, 0.5, 0.6, 0.7])
    both = ks.load_robot(f'{file}:right:left')
    assert both.joint_types == ('revolute',) * 3 + ('helical', 'revolute')
    np.testing.assert_allclose(both.limits[4], np.radians([-90, 90]), rtol=1e-15)
    left, right = (ks.load_robot(f'{file}:cell:{side}') for side in ('left', 'right'))
    B, A = ks.forward_kinematics(left, q[3:]), ks.forward_kinematics(right, q[:3])
    np.testing.assert_allclose(
        ks.forward_kinematics(both, q), np.linalg.inv(A) @ B, rtol=0, atol=ROUND_OFF * 10
    )
    # Of a point the joints behind it move nothing, and are none of its motion's.
    elbow = ks.load_robot(f'{file}:right:left/elbow')
    assert elbow.joint_names == ('right_q1', 'right_q2', 'right_q3', 'left_lift')
    assert elbow.tool_frame == 'left_elbow'
    base = left.description.base.motion.matrix
    expected = np.linalg.inv(A) @ base @ ks.forward_kinematics(screw, q[3:], of='elbow')
    np.testing.assert_allclose(
        ks.forward_kinematics(elbow, q[:4]), expected, rtol=0, atol=ROUND_OFF * 10
    )


TORSO = """
robot: {name}
convention: standard
joints:
  - {{name: turn, variable: t1, type: revolute}}
  - {{name: lift, variable: t2, type: prismatic, limits: [0, 0.5]}}
  - {{name: {name}_shoulder, variable: q3, type: revolute}}
  - {{name: {name}_elbow, variable: q4, type: revolute}}
links:
  - {{a: 0, alpha: 0, d: 0.3, theta: t1}}
  - {{a: 0.1, alpha: {alpha}, d: t2, theta: {theta}}}
  - {{a: 0.4, alpha: 0, d: 0, theta: q3}}
  - {{a: 0.3, alpha: 0.2, d: 0.05, theta: q4}}
"""


def test_joints_that_both_arms_stand_on_are_counted_once_and_move_nothing(tmp_path):
    # Their tables differ from the second row on, as those of a torso with two shoulders do.
    for name, alpha, theta in (('left', 'pi/2', '0.3'), ('right', '-pi/3', '-0.4')):
        (tmp_path / f'{name}.yaml').write_text(TORSO.format(name=name, alpha=alpha, theta=theta))
    file = tmp_path / 'cell.yaml'
    file.write_text(
        'cell: both\ncommon: [turn, lift]\n'
        'arms:\n  left: {robot: left.yaml}\n  right: {robot: right.yaml}\n'
    )
    both = ks.load_robot(file)
    assert both.joint_names == ('left_shoulder', 'left_elbow', 'right_shoulder', 'right_elbow')
    arms = [ks.load_robot(tmp_path / f'{name}.yaml') for name in ('left', 'right')]
    random = np.random.default_rng(0)
    for _ in range(3):
        torso, q = random.uniform(0, 0.5, 2), random.uniform(-3, 3, 4)
        A, B = (
            ks.forward_kinematics(arm, [*torso, *own]) for arm, own in zip(arms, (q[:2], q[2:]))
        )
        np.testing.assert_allclose(
            ks.forward_kinematics(both, q), np.linalg.inv(A) @ B, rtol=0, atol=ROUND_OFF * 10
        )
    # On floors that are apart the common joints matter, and are there once.
    file.write_text(file.read_text().replace('right.yaml', 'right.yaml, xyz: [0.2, 0, 0]'))
    apart = ks.load_robot(file)
    assert sorted(apart.joint_names) == sorted((*both.joint_names, 'turn', 'lift'))
    assert np.linalg.norm(ks.jacobian(apart, np.full(6, 0.2))[:, apart.joint_names.index('turn')])


def test_what_is_known_of_an_arm_is_known_of_two(tmp_path):
    both = ks.load_robot(cell_file(tmp_path, 'planar_3r', 'planar_2r'))
    q = np.array([0.3, 0.5, -0.7, 0.4, 0.9])
    T = ks.forward_kinematics(both, q)
    found = ks.inverse_kinematics(both, T, near=q + 0.05)
    assert len(found.solutions) or len(found.families)
    s = ks.singularity(both, q)
    assert s.level is ks.Level.OK
    step = 1e-6
    column = (
        ks.forward_kinematics(both, q + [0, step, 0, 0, 0])
        - ks.forward_kinematics(both, q - [0, step, 0, 0, 0])
    )[:3, 3] / (2 * step)
    np.testing.assert_allclose(ks.jacobian(both, q)[:3, 1], column, atol=1e-9)


def test_a_cell_is_read_again_when_an_arm_of_it_has_changed(tmp_path):
    (tmp_path / 'screw.yaml').write_text(HELICAL)
    file = cell_file(tmp_path, 'screw.yaml', 'craig_3r')
    before = ks.forward_kinematics(file, np.zeros(5))
    (tmp_path / 'screw.yaml').write_text(HELICAL.replace('a: 300', 'a: 3000'))
    assert np.abs(ks.forward_kinematics(file, np.zeros(5)) - before).max() > 1.0


WRONG = {
    'cell: a\narms: {}': ('arms', 'empty', ''),
    'cell: a': ('', 'missing-key', ''),
    'cell: a b\narms: {l: {robot: ur5e}}': ('cell', 'wrong-name', "'a b'"),
    'cell: a\narms: {l: {robot: ur5}}': ('arms.l.robot', 'unknown-robot', "'ur5'"),
    'cell: a\narms: {l: {robot: none.yaml}}': ('', 'missing-file', ''),
    'cell: a\narms: {l: {robot: ur5e}, r: {robot: ur10e}}': (
        'arms.r.joint_prefix',
        'duplicate-name',
        "'elbow_joint'",
    ),
    'cell: a\narms: {l: {robot: ur5e, joint_prefix: a_}, r: {robot: ur5e, joint_prefix: a_}}': (
        'arms.r.joint_prefix',
        'duplicate-name',
        "'a_elbow_joint'",
    ),
    'cell: a\ncommon: [x]\narms: {l: {robot: craig_3r}}': ('common[0]', 'unknown-name', "'x'"),
    'cell: a\narms: {cell: {robot: craig_3r}}': ('arms.cell', 'wrong-name', "'cell'"),
    'cell: a\narms: {l: {robot: craig_3r, xzy: [0, 0, 0]}}': (
        'arms.l.xzy',
        'unknown-key',
        "'xyz'?",
    ),
    'cell: a\narms: {l: {robot: craig_3r, xyz: [0, 0]}}': ('arms.l.xyz', 'wrong-length', ''),
    'cell: a\narms: {l: {robot: cell.yaml}}': ('arms.l.robot', 'unsupported', ''),
}


def fault(path):
    """Return the only fault of a cell."""
    with pytest.raises(RobotFileError) as caught:
        ks.load_robot(path)
    (found,) = caught.value.faults
    return found


@pytest.mark.parametrize('text', WRONG)
def test_a_wrong_cell_is_told(tmp_path, text):
    file = tmp_path / 'cell.yaml'
    file.write_text(text)
    where, code, word = WRONG[text]
    found = fault(file)
    assert (found.where, found.code) == (where, code)
    assert word in found.message


@pytest.mark.parametrize(
    ('ends', 'code', 'word'),
    [
        ('left:up', 'unknown-name', "'up' (known: cell, left, right)"),
        ('left:cell', 'unsupported', 'left to cell'),
        ('right:right', 'unsupported', 'right to right'),
    ],
)
def test_ends_that_are_none_are_told(tmp_path, ends, code, word):
    file = cell_file(tmp_path, 'ur5e', 'puma560')
    found = fault(f'{file}:{ends}')
    assert found.code == code
    assert word in found.message


def test_an_arm_of_a_cell_has_no_other_points_than_its_own(tmp_path):
    file = cell_file(tmp_path, 'ur5e', 'puma560')
    with refused(ks.PointError, 'unknown-name', "'hand' of ur5e", 'tool'):
        ks.load_robot(f'{file}:cell:left/hand')


@pytest.mark.parametrize(('first', 'second'), [('ur5e', 'excavator'), ('five_bar', 'ur5e')])
def test_a_relative_motion_of_closed_loops_is_refused_and_each_arm_is_there(
    tmp_path, first, second
):
    file = cell_file(tmp_path, first, second)
    closed = 'left' if first == 'five_bar' else 'right'
    found = fault(file)
    assert found.code == 'unsupported'
    assert found.message.startswith(closed)
    alone = ks.load_robot(first if first == 'five_bar' else second)
    robot = ks.load_robot(f'{file}:cell:{closed}')
    q = calm_poses(alone, 1)[0]
    np.testing.assert_allclose(
        ks.jacobian(robot, q, axes='tool'), ks.jacobian(alone, q, axes='tool'), atol=ROUND_OFF
    )


def test_loops_that_meet_the_table_behind_a_point_are_not_drawn(tmp_path):
    robot = ks.load_robot('excavator')
    pointed = Path(robot.description.file).read_text() + 'points: {stick: {row: 5}}\n'
    (tmp_path / 'pointed.yaml').write_text(pointed)
    stick = ks.load_robot(f'{cell_file(tmp_path, "ur5e", "pointed.yaml")}:cell:right/stick')
    state = evaluate(stick, calm_poses(stick, 1)[0], depth=ALL_FRAMES)
    assert len(loop_links(state)) == 1


TWO_JOINTS = """
robot: {name}
convention: standard
joints:
  - {{name: {name}_1, variable: {variable}, type: revolute}}
  - {{name: {name}_2, variable: other, type: revolute}}
links: [{{a: 1, alpha: 0, d: 0, theta: {variable}}}, {{a: 1, alpha: 0, d: 0, theta: other}}]
"""


def test_variables_of_two_arms_that_would_be_called_alike_are_told(tmp_path):
    for name, variable in (('one', 'up_q'), ('two', 'q')):
        (tmp_path / f'{name}.yaml').write_text(TWO_JOINTS.format(name=name, variable=variable))
    file = tmp_path / 'cell.yaml'
    file.write_text('cell: c\narms:\n  arm: {robot: one.yaml}\n  arm_up: {robot: two.yaml}\n')
    found = fault(file)
    assert found.code == 'duplicate-name'
    assert 'arm_up_q' in found.message
    file.write_text(file.read_text().replace('arm_up:', 'above:'))
    assert ks.load_robot(file).joint_names == ('one_1', 'one_2', 'two_1', 'two_2')


def test_robot_files_with_ends_are_told(tmp_path):
    (tmp_path / 'one.yaml').write_text(HELICAL)
    found = fault(f'{tmp_path / "one.yaml"}:a:b')
    assert found.code == 'unsupported'
    assert ':a:b' in found.message


LIMITED = HELICAL + 'speed_limits: {tool: {linear: 500}, elbow: {linear: 200, reduced: 100}}\n'


def test_speed_limits_are_those_of_what_moves(tmp_path):
    (tmp_path / 'screw.yaml').write_text(LIMITED)
    file = cell_file(tmp_path, 'screw.yaml', 'craig_3r')

    def limits(ends):
        found = ks.load_robot(f'{file}:{ends}').description.speed_limits
        return {limit.of: limit.linear for limit in found}

    assert limits('cell:left') == {'tool': 0.5, 'elbow': 0.2}
    # Of a point as the end the point's own, and none of what lies behind it.
    assert limits('cell:left/elbow') == {'tool': 0.2}
    # They are against the floor, and say nothing of the motion of one arm against another.
    assert limits('right:left') == {}


@pytest.mark.parametrize(
    'other', ['type: prismatic, limits: [0, 0.4]', 'type: revolute, limits: [0, 0.5]']
)
def test_a_common_joint_is_the_same_in_all_arms(tmp_path, other):
    for name in ('left', 'right'):
        (tmp_path / f'{name}.yaml').write_text(TORSO.format(name=name, alpha=0, theta=0))
    text = (tmp_path / 'right.yaml').read_text()
    text = text.replace('type: prismatic, limits: [0, 0.5]', other)
    if 'revolute' in other:
        text = text.replace('d: t2, theta: 0', 'd: 0, theta: t2')
    (tmp_path / 'right.yaml').write_text(text)
    file = tmp_path / 'cell.yaml'
    file.write_text(
        'cell: a\ncommon: [turn, lift]\narms: {l: {robot: left.yaml}, r: {robot: right.yaml}}'
    )
    found = fault(file)
    assert (found.where, found.code) == ('common[1]', 'mismatch')
    assert "'lift'" in found.message


def test_a_cell_of_many_arms_is_refused_before_they_are_read(tmp_path):
    file = tmp_path / 'cell.yaml'
    arms = ''.join(f'  a{k}: {{robot: none_of_these}}\n' for k in range(3000))
    file.write_text(f'cell: many\narms:\n{arms}')
    found = fault(file)
    assert (found.line, found.where, found.code) == (2, 'arms', 'too-many')
    assert '128' in found.message
