# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The running node of an arm with closed loops: driven joints in, and pose, J, twist out."""

import json

import numpy as np
import parallel_machines as machines
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from arms import other_branch_text, without_known_poses
from diagnostic_msgs.msg import DiagnosticStatus
from folders import GOLDEN
from geometry_msgs.msg import PoseStamped, TwistStamped
from ros_harness import LATCHED, level_of, values_of
from std_msgs.msg import Float64, Float64MultiArray
from tolerances import ROUND_OFF

import kinematics_service as ks
from kinematics_service.node.process.runner import arms_from

CONFIGS = json.loads((GOLDEN / 's000b_x_general_loop.json').read_text())['configs']
KINDS = {
    'pose': PoseStamped,
    'jacobian': Float64MultiArray,
    'twist': TwistStamped,
    'singularity/determinant': Float64,
}
# Digits of a number in a warning.
PRINTED = 1e-6


def determinant_of(warning):
    return float(values_of(warning)['determinant'])


def near_to(config):
    return pytest.approx(config['task_det'], rel=PRINTED)


def xyz(vector):
    return [vector.x, vector.y, vector.z]


@pytest.mark.parametrize(('branch', 'transport'), [(1, 'bytes'), (-1, 'bytes'), (1, 'messages')])
def test_the_general_loop_of_the_source_document_through_the_node(arm, tmp_path, branch):
    file = tmp_path / 'branch.yaml'
    text = other_branch_text() if branch < 0 else without_known_poses('four_bar_arm')
    file.write_text(text + 'singularity: {warn: 0.3}\n')
    one = arm(str(file))
    heard = {name: one.hear(name, kind) for name, kind in KINDS.items()}
    warnings = one.hear('singularity/warning', DiagnosticStatus, LATCHED)
    configs = [config for config in CONFIGS if config['branch'] == branch]
    assert len(configs) > 10
    for config in configs:
        one.send(config['q'], config['qdot'])
    one.spin_until(lambda: all(len(m) == len(configs) for m in heard.values()), 'answers')
    for k, config in enumerate(configs):
        pose, J, twist, determinant = (messages[k] for messages in heard.values())
        T = np.array(config['T'])
        np.testing.assert_allclose(xyz(pose.pose.position), T[:3, 3], rtol=0, atol=ROUND_OFF)
        found = np.reshape(J.data, (6, 3))
        np.testing.assert_allclose(found, config['J'], rtol=0, atol=10 * ROUND_OFF)
        found = [*xyz(twist.twist.linear), *xyz(twist.twist.angular)]
        np.testing.assert_allclose(found, config['twist'], rtol=0, atol=10 * ROUND_OFF)
        assert determinant.data == pytest.approx(config['task_det'], abs=ROUND_OFF)
    # The warning of the one that is nearest to singular, after one that is far.
    sizes = [config['sv_task'][-1] for config in configs]
    far, near = configs[int(np.argmax(sizes))], configs[int(np.argmin(sizes))]
    one.send(far['q'])
    one.spin_until(lambda: len(heard['pose']) > len(configs), 'pose')
    one.send(near['q'])
    one.spin_until(lambda: warnings and determinant_of(warnings[-1]) == near_to(near), 'warning')
    assert level_of(warnings[-1]) > 0
    values = values_of(warnings[-1])
    # det d Phi / d psi of the document: L3 L4 sin psi2.
    flat = 0.38 * 0.17 * np.sin(near['passive_psi2'])
    assert values['factor'] == 'four_bar'
    assert float(values['factor_value']) == pytest.approx(flat, rel=PRINTED)


def test_the_warning_names_the_loop_that_is_nearly_flat(arm):
    one = arm('four_bar_arm')
    warnings = one.hear('singularity/warning', DiagnosticStatus, LATCHED)
    q = [0.0, np.pi / 2, -np.pi / 2 + 0.02]
    one.send(q)
    one.spin_until(lambda: warnings, 'warning')
    values = {entry.key: entry.value for entry in warnings[-1].values}
    assert warnings[-1].level == DiagnosticStatus.ERROR
    assert values['factor'] == 'four_bar'
    found = ks.singularity(ks.load_robot('four_bar_arm'), q)
    assert float(values['factor_value']) == pytest.approx(found.factors.values[0], rel=1e-6)


def test_a_machine_whose_loops_are_closed_together_through_the_node(arm, tmp_path):
    file = tmp_path / 'delta.yaml'
    file.write_text(without_known_poses('flexpicker') + 'singularity: {warn: 0.5}\n')
    one = arm(str(file))
    heard = {name: one.hear(name, kind) for name, kind in KINDS.items()}
    warnings = one.hear('singularity/warning', DiagnosticStatus, LATCHED)
    places = np.array([[0.0, 0.0, -0.9], [0.3, 0.5, -1.1], [-0.2, 0.1, -1.0]])
    for k, place in enumerate(places):
        q = machines.delta_joints(place)
        qdot = np.array([0.3, -0.2, 0.5])
        one.send(q.tolist(), qdot.tolist())
        one.spin_until(lambda n=k + 1: all(len(m) >= n for m in heard.values()), str(place))
        pose, J, twist, _ = (messages[k] for messages in heard.values())
        expected = machines.delta_jacobian(place, q)
        np.testing.assert_allclose(xyz(pose.pose.position), place, rtol=0, atol=ROUND_OFF)
        found = np.reshape(J.data, (6, 3))[:3]
        np.testing.assert_allclose(found, expected, rtol=0, atol=10 * ROUND_OFF)
        found = xyz(twist.twist.linear)
        np.testing.assert_allclose(found, expected @ qdot, rtol=0, atol=10 * ROUND_OFF)
    one.send([1.5, 1.5, -1.0])
    one.spin_until(lambda: warnings and level_of(warnings[-1]) > 0, 'warning')
    assert values_of(warnings[-1])['factor'] == 'arm1 + arm2 + arm3'


CELL = """
cell: packing
arms:
  left: {robot: planar_2r, joint_prefix: left_}
  delta: {robot: flexpicker, joint_prefix: delta_, xyz: [0.5, 0.4, 1.5]}
"""


def test_a_cell_with_a_delta_has_a_node_for_each_arm_and_none_between(tmp_path):
    file = tmp_path / 'cell.yaml'
    file.write_text(CELL)
    assert [arm.namespace for arm in arms_from([str(file)])] == ['/left', '/delta']


def test_positions_at_which_the_loop_does_not_close_are_refused(arm, tmp_path):
    text = without_known_poses('five_bar')
    text = text.replace('[0, 2*pi/3]', '[0, pi]').replace('distal: 0.4', 'distal: 0.3')
    file = tmp_path / 'short.yaml'
    file.write_text(text.replace('psi1: -1.27, psi2: 1.27', 'psi1: -1.51, psi2: 1.51'))
    one = arm(str(file))
    poses = one.hear('pose', PoseStamped)
    one.send([2.0, 1.2])
    one.spin_until(lambda: poses, 'pose')
    one.send([3.1, 0.1])
    one.send([2.0, 1.1])
    one.spin_until(lambda: len(poses) > 1, 'pose after the refusal')
    one.spin_until(lambda: one.counts().get('rejected: loop does not close') == '1', 'count')
    assert len(poses) == 2
