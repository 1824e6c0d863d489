# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Parameters: which values are refused, and that nothing is left of them.

One node serves all tests of this file that leave it as they found it.
"""

import math

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from refusal import refused
from ros_harness import Arm, Peer, change

import kinematics_service as ks
from kinematics_service.errors import SettingsError
from kinematics_service.node.node import KinematicsNode
from kinematics_service.node.parameters.settings import defaults, settings_from
from kinematics_service.node.parameters.table import PARAMETERS


@pytest.fixture(scope='module')
def unchanged(ros_domain):
    """Return an arm that every test leaves as it found it."""
    one = Arm('craig_3r')
    yield one
    one.close()


@pytest.fixture(scope='module')
def peer(ros_domain):
    """Return a peer in whose context nodes are tried."""
    one = Peer()
    yield one
    one.close()


REFUSED = {
    'joint_prefix': ['a b', 'a,b', '/arm', 5, True],
    'joint_names': [
        *('a', 5, True, [1, 2, 3], ['a', 'b'], list('abcd'), ['a', 'b', 'a']),
        *(['a', 'b', ''], ['a', 'b', ' '], ['a', 'b', 'c,d'], ['a', 'b', 'c\n']),
    ],
    'frame_prefix': ['a b', 'a,b', 'tab\t', 1.5],
    'base_frame': ['a b', '/world', 'tool0', 5],
    'tool_frame': ['a b', '/tool', 'base_link', ['tool']],
    'tool.xyz': [
        'here',
        0.1,
        True,
        [0.1],
        [0.0, 0.0, math.inf],
        [True] * 3,
        ['0', '0', '1'],
        [2e6, 0.0, 0.0],
    ],
    'tool.rpy': ['down', 3, [0.1] * 4, [math.nan] * 3],
    'jacobian_frame': ['world', '', 'Base', 1],
    'twist_frame': ['world', '', 'TOOL', 1],
    'row_order': ['angular', '', 6],
    'velocity_source': ['none', '', 2],
    'publish_rate': [-1.0, math.nan, math.inf, 1e7, 10, '10', 9.9e-4, 3e-308, 5e-324],
    'integrate_velocities': [1, 'maybe', 0.0],
    'scale.horizon': [0.0, -0.1, math.nan, math.inf, 11.0, 1],
    'scale.rise': [0.0, -1.0, math.nan, math.inf, 2],
    'scale.reduced': [True, 1, 'maybe'],
    'scale.rule': ['Servo', '', 'none', 1],
    'scale.lower_singularity_threshold': [0.0, -17.0, math.nan, 30.0, 17],
    'scale.hard_stop_singularity_threshold': [0.0, 17.0, math.inf, 30],
    'scale.leaving_singularity_threshold_multiplier': [0.0, -2.0, math.nan, 2],
    'scale.singularity_step_scale': [0.0, -0.01, math.inf, 1],
    'acceleration_window': [-0.1, math.nan, math.inf, 10.5, 1],
    'joint_state_timeout': [0.0, -1.0, math.nan, math.inf, 4000.0, 1],
    'publish_tf': [1, 'yes', 0.0],
    'publish_robot_description': [1, 'maybe', 0.0],
    'singularity.measure': ['det', '', 'determinant', 'manipulability', 3],
    'singularity.warn': [-0.1, 0.02, 1.2, 3.2, math.nan, 1],
    'singularity.stop': [-0.1, 0.1, 0.5, math.inf, 1],
    'singularity.length': [-0.1, math.nan, math.inf, 1],
    'ik.rows': ['x y up', 'x x', 'xyz', 3],
    'ik.axis': ['w', 'x y', 3],
    'ik.tolerance': [-1e-9, math.nan, 2.0, 1],
    'ik.redundancy': ['far', '', 3],
    'ik.redundancy_step': [-0.1, 1e-7, math.nan, 101.0, 1],
    'ik.target_timeout': [0.0, -1.0, math.nan, 1],
    'ik.damping': [0.0, -1.0, math.nan, 2.0, 1],
    'ik.damped_below': [0.0, math.inf, 11.0, 1],
    'ik.horizon': [0.0, math.nan, 1],
    'ik.default_rate': [0.0, -1.0, math.inf, 1],
    'ik.default_speed': [0.0, -1.0, math.inf, 1],
    'reference.position_warn': [0.0, -1.0, math.nan, 0.03, 1],
    'reference.position_stop': [0.0, math.inf, 0.003, 1],
    'reference.angle_warn': [0.0, math.nan, 0.2, 1],
    'reference.angle_stop': [0.0, 11.0, 0.001, 1],
}


def test_every_parameter_has_a_wrong_value():
    assert set(REFUSED) == {parameter.name for parameter in PARAMETERS}


@pytest.mark.parametrize('name', REFUSED)
def test_a_wrong_value_is_refused_at_run_time_with_the_reason_and_nothing_changes(unchanged, name):
    one = unchanged
    settings, old = one.node.settings, one.node.get_parameter(name).value
    for value in REFUSED[name]:
        result = change(one, **{name.replace('.', '__'): value})
        assert not result.successful, value
        assert name.partition('.')[0] in result.reason or 'Wrong parameter type' in result.reason
        assert one.node.settings is settings
        assert one.node.get_parameter(name).value == old
    one.answer((0.3, -0.4, 1.2))


@pytest.mark.parametrize('name', REFUSED)
def test_a_wrong_value_has_a_code_of_its_own(name):
    # Of values whose type ROS accepts: it refuses others before they are judged.
    robot = ks.load_robot('craig_3r')
    given = defaults(robot)
    for value in REFUSED[name]:
        if type(value) is not type(given[name]):
            continue
        with pytest.raises(SettingsError) as error:
            settings_from(given | {name: value}, robot)
        assert error.value.code != SettingsError.code, value


# Of each way to judge a value one: those of the command line are judged as those at run time are.
AT_START = {
    'joint_prefix': ('/arm', 'syntax'),
    'joint_names': ('a', 'wrong-type'),
    'base_frame': ('tool0', 'conflict'),
    'tool.xyz': (0.1, 'wrong-type'),
    'twist_frame': ('world', 'unknown-name'),
    'publish_rate': (-1.0, 'out-of-range'),
    'scale.horizon': (1, 'wrong-type'),
    'scale.rise': ('.nan', 'out-of-range'),
    'publish_tf': (1, 'wrong-type'),
    'reference.angle_stop': (0.001, 'wrong-order'),
}


@pytest.mark.parametrize('name', AT_START)
def test_a_wrong_value_is_refused_at_start_with_the_reason(peer, name):
    value, code = AT_START[name]
    given = ['--ros-args', '-p', f'{name}:={value}']
    with refused(SettingsError, code, name.partition('.')[0]) as error:
        KinematicsNode('craig_3r', context=peer.context, cli_args=given)
    assert '\n' not in str(error.value)
