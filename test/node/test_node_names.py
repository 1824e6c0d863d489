# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Names of joints, topics and nodes that do not fit: what the node says, and joint_names."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from refusal import refused
from ros_harness import BEST_EFFORT, START, STEP, Peer, change, joint_state, level_of, values_of
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

import kinematics_service as ks
from kinematics_service.errors import SettingsError
from kinematics_service.estimation.estimator import Estimator
from kinematics_service.estimation.joint_sample import JointSample
from kinematics_service.node.health import UNKNOWN, namesakes_in_words
from kinematics_service.node.parameters.settings import defaults, settings_from
from kinematics_service.node.unmatched_names import JOINT, unmatched_in_words

WARN, ERROR = 1, 2
UR = ks.load_robot('ur5e').joint_names
MANGLED = [f'tn__{k}_' for k in range(1, 6)]
# Files with quotes, mimic joints, loops, and joints that are not revolute.
PARSED = ('excavator', 'panda', 'so101', 'ur5e', 'offset_stanford_dh')
# What the node is started as, the names in messages, and the ends of the sentence about them.
UNMATCHED = {
    'default': ('puma560', [], UR, ['--robot ur10e or --robot ur3e or --robot ur5e']),
    'gripper': ('puma560', [], [*UR, 'finger'], ['or --robot ur5e']),
    'left': ('puma560', [], [f'l_{name}' for name in UR], ['--robot ur5e -p joint_prefix:=l_']),
    'prefix': ('ur5e', [], [f'arm_{name}' for name in UR], ['try -p joint_prefix:=arm_']),
    'present prefix': ('ur5e', ['joint_prefix:=l_'], UR, ['try without joint_prefix']),
    'two arms': (
        *('ur5e', [], [side + name for side in ('l_', 'r_') for name in UR]),
        ['-p joint_prefix:=l_ or -p joint_prefix:=r_', 'and 4 more'],
    ),
    'mangled': ('so101', [], MANGLED, [f'"joint_names:={MANGLED}"', 'a guess: check it']),
    'similar': (
        *('panda', [], [f'x{k}_joint{k}' for k in (2, 1, 3, 7, 6, 5, 4)]),
        ["joint_names:=['x1_joint1', 'x2_joint2', 'x3_joint3'", 'a guess: check it'],
    ),
    'another arm': ('panda', [], [f'fr3_joint{k}' for k in range(1, 8)], ['--robot fr3 or -p']),
    'hostile': ('craig_3r', [], ['x' * 100_000, '\x1b[31m\n', '$(rm)'], ["'\\x1b[31m\\n', "]),
    'none': ('craig_3r', [], [], ['nothing; expected q1, q2, q3']),
}


@pytest.fixture
def peer(ros_domain):
    """Return a node of the tests in a context of its own."""
    one = Peer()
    yield one
    one.close()


def settled(one, names):
    """Publish messages of these names and return the status after them."""
    for k in range(3):
        one.publish(joint_state(names, [0.5] * len(names), (), START + k * STEP))
    ignored = 'ignored: none of our joints'
    one.spin_until(lambda: one.counts()[ignored] == '3', 'messages')
    return one.diagnose()


@pytest.mark.parametrize('case', UNMATCHED)
def test_messages_without_a_joint_of_the_arm_are_explained(case):
    name, parameters, names, ends = UNMATCHED[case]
    robot = ks.load_robot(name)
    values = defaults(robot) | dict(one.split(':=') for one in parameters)
    settings = settings_from(values, robot)
    estimator = Estimator(settings.robot, settings.estimator)
    for k in range(3):
        stamp = START + k * STEP
        estimator.take(JointSample(names, [0.5] * len(names), (), stamp, stamp, stamp))
    text = unmatched_in_words(estimator, '/joint_states')
    assert text.startswith('3 messages on /joint_states ')
    for end in ends:
        assert end in text
    assert text.isprintable()
    assert len(text) < 1000


def test_the_diagnostics_explain_names_that_nothing_matches(arm):
    status = settled(arm('craig_3r', ['-p', 'joint_prefix:=l_']), ['q1', 'q2', 'q3'])
    assert level_of(status) == ERROR
    assert status.message.startswith('3 messages on /joint_states ')
    assert 'try without joint_prefix' in status.message


def test_the_joint_names_of_bundled_files_are_found_without_parsing_them():
    for name, file in ks.bundled_robots().items():
        found = tuple(JOINT.findall(file.read_text('utf-8')))
        assert found
        if name in PARSED:
            assert found == ks.load_robot(name).joint_names


def test_joint_names_that_are_offered_are_taken_while_the_node_runs(arm):
    one = arm('so101')
    settled(one, MANGLED)
    assert change(one, joint_names=MANGLED).successful
    poses, q = one.poses, [0.1, 0.2, 0.3, 0.4, 0.5]
    one.publish(joint_state(MANGLED, q, (), START + 100 * STEP))
    one.spin_until(lambda: poses, 'pose')
    expected = ks.forward_kinematics('so101', q)[:3, 3]
    p = poses[0].pose.position
    np.testing.assert_allclose((p.x, p.y, p.z), expected, atol=1e-12)
    assert 'name no joint' not in one.diagnose().message
    refusal = change(one, joint_prefix='left_')
    assert not refusal.successful
    assert 'empty joint_prefix' in refusal.reason
    assert change(one, joint_names=[]).successful
    assert one.counts()['missing joints'].startswith('shoulder_pan')


def test_an_arm_whose_names_stop_is_stale_and_not_unmatched(arm):
    one = arm('craig_3r', ['-p', 'joint_state_timeout:=0.05'])
    one.answer((0.1, 0.2, 0.3))
    one.publish(joint_state(['other'], [0.0], (), START))
    one.spin_until(lambda: one.diagnose().message.startswith('joint states are stale'), 'stale')


def test_messages_of_some_joints_are_counted(arm):
    one = arm('craig_3r')
    one.publish(joint_state(['q1'], [0.0], (), START))
    one.spin_until(lambda: one.counts()['waiting for other joints'] == '1', 'message')
    status = one.diagnose()
    assert level_of(status) == ERROR
    assert '(waiting for other joints: 1)' in status.message
    assert status.message.endswith(': missing q2, q3')


def test_names_beside_those_of_the_arm_are_shown_on_the_terminal_too(arm, capfd):
    one = arm('craig_3r')
    one.publish(joint_state(['q1', 'q2', 'qq3'], [0.0] * 3, (), START))
    one.spin_until(lambda: one.counts()['waiting for other joints'] == '1', 'message')
    one.node._health._answered -= 5.0
    capfd.readouterr()
    one.node._health.say()
    says = '; messages name qq3, too: '
    assert says in one.diagnose().message
    assert says in capfd.readouterr().err


@pytest.mark.parametrize(
    ('names', 'expected'), [('[]', ('q1', 'q2', 'q3')), ('[a, b, c]', ('a', 'b', 'c'))]
)
def test_joint_names_from_a_params_file(arm, tmp_path, names, expected):
    file = tmp_path / 'params.yaml'
    file.write_text(f'/**: {{ros__parameters: {{joint_names: {names}}}}}')
    one = arm('craig_3r', ['--params-file', str(file)])
    assert one.node.settings.joint_names == expected


@pytest.mark.parametrize(
    ('names', 'prefix', 'code'),
    [
        ('a', '', 'wrong-type'),
        (['a', 'b'], 'left_', 'conflict'),
        (['a', 'b', 'c'], '', 'wrong-length'),
        (['a', 'a'], '', 'duplicate-name'),
        (['a', 'b,c'], '', 'syntax'),
        (['a', ' '], '', 'syntax'),
    ],
)
def test_wrong_joint_names_are_refused_with_their_cause(names, prefix, code):
    robot = ks.load_robot('planar_2r')
    values = defaults(robot) | {'joint_names': names, 'joint_prefix': prefix}
    with refused(SettingsError, code, 'parameter joint_names', '2 different names', 'q1, q2'):
        settings_from(values, robot)


def test_a_robot_with_other_joints_is_refused_while_joint_names_hold(arm, tmp_path):
    file = tmp_path / 'arm.yaml'
    file.write_bytes(ks.bundled_robots()['planar_3r'].read_bytes())
    one = arm(str(file), ['-p', "joint_names:=['a', 'b', 'c']"])
    file.write_bytes(ks.bundled_robots()['planar_2r'].read_bytes())
    response = one.call(Trigger, '/kinematics/reload', Trigger.Request())
    assert not response.success
    assert "joint_names: ['a', 'b', 'c']" in response.message
    assert '2 different names' in response.message
    assert one.node.settings.joint_names == ('a', 'b', 'c')


def test_node_and_echo_name_the_robot_of_a_driver(process, arm, capfd):
    one = arm('puma560')
    echo = process('echo', '--once', '--timeout', '600', ready=False)
    log = []
    settled(one, UR)
    one.node._health._answered -= 5.0

    def is_explained():
        log.append(capfd.readouterr().err)
        return 'it reports: ' in echo.stderr and 'name no joint' in ''.join(log)

    one.spin_until(is_explained, 'explanation')
    for said in (echo.stderr, ''.join(log)):
        assert 'of puma560: they name shoulder_pan_joint, ' in said
        assert 'j5, j6; try --robot ur10e' in said
    assert ''.join(log).count('name no joint') == 1
    assert 'which has sent nothing; ' in echo.stderr


def test_a_driver_of_best_effort_that_runs_first_is_answered_and_logs_nothing(peer, arm, capfd):
    driver = peer.peer.create_publisher(JointState, '/joint_states', BEST_EFFORT)
    one = arm('ur5e')

    def is_answered():
        one.stamp += STEP
        driver.publish(joint_state(UR, [0.5] * 6, (), one.stamp))
        peer.executor.spin_once(timeout_sec=0.01)
        return one.poses

    one.spin_until(is_answered, 'pose')
    assert one.counts()['reliability'] == 'best effort'
    # An incompatible publisher or subscription is a line of the log at either end.
    assert 'WARN' not in capfd.readouterr().err


def test_a_remapped_node_sees_the_topic_it_was_remapped_from(arm, capfd):
    other = arm('craig_3r', ['-r', '__node:=other'], namespace='/cell')
    one = arm('craig_3r', ['-r', 'joint_states:=/robot/joint_states'])
    one.speaker('/joint_states', listeners=0)
    seen = one.peer.count_publishers
    one.spin_until(
        lambda: seen('/joint_states') and seen('/cell/other/ik/joint_states'), 'publishers'
    )
    one.node._health._answered -= 5.0
    written = ''

    def said():
        nonlocal written
        written += capfd.readouterr().err
        return 'has come on /robot/joint_states' in written

    one.spin_until(said, 'line of the log')
    assert 'try -r joint_states:=/joint_states\n' in written
    assert other.node.get_name() == 'other'


def test_two_nodes_of_one_name_name_each_other_until_one_ends(arm, capfd):
    one = arm('planar_2r')
    one.answer((0.1, 0.2))
    assert 'second node' not in one.diagnose().message
    statuses = {}

    def note(array):
        statuses[values_of(array.status[0])['robot']] = array.status[0]

    one.peer.create_subscription(DiagnosticArray, '/diagnostics', note, 10)
    other = arm('planar_3r')
    said = '/kinematics, publishes /kinematics/pose, too'

    def both_say():
        other.executor.spin_once(timeout_sec=0.0)
        one.publish(joint_state(['q1', 'q2', 'q3'], [0.1, 0.2, 0.3]))
        warned = [one for one in statuses.values() if said in one.message]
        return len(warned) == 2 and {level_of(one) for one in warned} == {WARN}

    one.spin_until(both_say, 'two warnings')
    other.close()
    one.spin_until(lambda: said not in one.diagnose().message, 'end of the warning')
    # A line of each node.
    assert capfd.readouterr().err.count(said) == 2


def test_a_publisher_whose_node_is_not_known_yet_is_waited_for(arm, monkeypatch):
    node = arm('planar_2r').node
    unknown = SimpleNamespace(node_name=UNKNOWN, node_namespace='_NODE_NAMESPACE_UNKNOWN_')
    monkeypatch.setattr(node, 'get_publishers_info_by_topic', lambda topic: [unknown])
    assert namesakes_in_words(node) == ''


def test_another_publisher_of_poses_is_named(arm):
    one = arm('planar_2r')
    player = one.other('player')
    player.create_publisher(PoseStamped, '/kinematics/pose', 10)
    one.answer((0.1, 0.2))
    one.spin_until(lambda: 'a second node, /player, pub' in one.diagnose().message, 'warning')
