# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The robot from a topic with its URDF, at the start of the node and while it runs."""

import math
import signal
import time

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from node_process import processor_seconds
from refusal import refused
from ros_harness import LATCHED, RELIABLE, START, STEP, Arm, Peer, joint_state
from std_msgs.msg import Float64, Float64MultiArray, String
from std_srvs.srv import Trigger
from tolerances import ROUND_OFF

from kinematics_service.__main__ import main
from kinematics_service.errors import SettingsError
from kinematics_service.node.parameters import description_topic

TOPIC = '/robot_description'
Q = (0.3, 0.7)
LIMIT = '<limit lower="-2" upper="2" effort="1" velocity="1"/>'
# What a node may take of the processor from a description to the first Jacobian (s).
AT_ONCE = 2.0
# What the executor may take of the processor for one event (s): the atlas of 14 joints takes 0.9.
GAP = 0.3


def urdf(L1=0.5, L2=0.4, limit=LIMIT, more=''):
    """Return a planar arm with two fingers at its end, link by link."""
    joint = '<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/>{}</joint>'
    z = '<axis xyz="0 0 1"/>'
    return ''.join(
        [
            '<robot name="planar">',
            *(f'<link name="{name}"/>' for name in ('base', 'upper', 'lower', 'tool', 'camera')),
            joint.format('q1', 'revolute', 'base', 'upper', z + limit),
            joint.format(
                'q2', 'revolute', 'upper', 'lower', f'{z}{limit}<origin xyz="{L1} 0 0"/>'
            ),
            joint.format('flange', 'fixed', 'lower', 'tool', f'<origin xyz="{L2} 0 0"/>'),
            joint.format('mount', 'fixed', 'upper', 'camera', '<origin xyz="0 0 0.1"/>'),
            more,
            '</robot>',
        ]
    )


def serial_urdf(joints):
    """Return an arm of so many revolute joints, their axes in turn."""
    axes, links = ('1 0 0', '0 1 0', '0 0 1'), [f'l{k}' for k in range(joints + 1)]
    return ''.join(
        [
            '<robot name="serial">',
            *(f'<link name="{name}"/>' for name in links),
            *(
                f'<joint name="j{k}" type="revolute"><parent link="l{k}"/>'
                f'<child link="l{k + 1}"/><origin xyz="0.0{1 + k % 7} 0.0{1 + k % 4} 0.1" '
                f'rpy="0.{k % 9} 0.{k % 5} 0"/><axis xyz="{axes[k % 3]}"/>{LIMIT}</joint>'
                for k in range(joints)
            ),
            '</robot>',
        ]
    )


def place(q, L1=0.5, L2=0.4):
    a, ab = q[0], q[0] + q[1]
    return [L1 * math.cos(a) + L2 * math.cos(ab), L1 * math.sin(a) + L2 * math.sin(ab), 0.0]


def is_at(pose, where):
    position = pose.pose.position
    found = [position.x, position.y, position.z]
    return np.allclose(found, where, rtol=0, atol=ROUND_OFF)


@pytest.fixture
def peer(ros_domain):
    one = Peer()
    yield one
    one.close()


@pytest.fixture
def described(ros_domain):
    """Return a function that starts a node beside a publisher of these descriptions."""
    open_now = []

    def start(*texts, robot=f'topic:{TOPIC}', parameters=()):
        context = Peer()
        open_now.append(context)
        publisher = context.peer.create_publisher(String, TOPIC, LATCHED)
        for text in texts:
            publisher.publish(String(data=text))
        one = Arm(robot, [word for one in parameters for word in ('-p', one)])
        open_now.append(one)
        return one, publisher

    yield start
    for one in reversed(open_now):
        one.close()


def answer_of(peer, robot):
    """Return the first Jacobian of a node that runs in another process."""
    jacobians = peer.listen('/kinematics/jacobian', Float64MultiArray)
    states = peer.speaker('/joint_states')
    stamp = START

    def came():
        nonlocal stamp
        stamp += STEP
        states.publish(joint_state(['q1', 'q2'], Q, stamp=stamp))
        return bool(jacobians)

    peer.spin_until(came, 'Jacobian')
    return np.reshape(jacobians[0].data, (6, 2))


def test_a_node_waits_for_its_robot_and_answers_at_once(peer, process):
    running = process('--robot-description', '--tip', 'tool', ready=False)
    peer.spin_until(lambda: f'the robot from {TOPIC}' in running.stderr, 'waiting')
    before = processor_seconds(running.popen.pid)
    publisher = peer.peer.create_publisher(String, TOPIC, LATCHED)
    publisher.publish(String(data=urdf()))
    running.wait_until_ready()
    J = answer_of(peer, running)
    assert processor_seconds(running.popen.pid) - before < AT_ONCE
    x, y, _ = place(Q)
    np.testing.assert_allclose(J[:2, 0], [-y, x], rtol=0, atol=ROUND_OFF)
    assert 'planar: 2 joints, standard, base to tool' in running.stderr
    running.popen.send_signal(signal.SIGINT)
    assert running.wait() == 0


def test_a_signal_ends_a_node_that_waits(peer, process):
    running = process('--robot-description', 'arm/description', ready=False)
    peer.spin_until(lambda: 'the robot from /arm/description' in running.stderr, 'waiting')
    running.popen.send_signal(signal.SIGTERM)
    assert running.wait() == 0
    assert 'Traceback' not in running.stderr


def test_links_may_be_the_ends_of_the_chain_and_other_tips_are_named(described, capfd):
    described(urdf())
    logged = capfd.readouterr().err
    assert 'and their joints: camera (1)' in logged
    source = f'topic:{TOPIC}:base:camera'
    assert f'write {source}' in logged
    described(urdf(), robot=source)
    assert '1 joint, standard, base to camera' in capfd.readouterr().err


def test_a_new_description_is_taken_over_and_the_stream_goes_on(described, capfd):
    one, publisher = described(urdf())
    assert is_at(one.answer(Q), place(Q))
    sent = len(one.poses)
    publisher.publish(String(data=urdf(L1=0.8)))
    while not is_at(one.answer(Q), place(Q, L1=0.8)):
        sent += 1
    assert len(one.poses) == sent + 1  # every joint state has its answer
    assert one.node.settings.robot.description.sha256
    assert f'topic:{TOPIC} is in force: robot planar' in capfd.readouterr().err


def test_a_wrong_description_changes_nothing(described, capfd):
    one, publisher = described(urdf())
    assert is_at(one.answer(Q), place(Q))
    settings = one.node.settings
    logged = ''

    def is_refused():
        nonlocal logged
        logged += capfd.readouterr().err
        return 'the new robot is refused' in logged

    for wrong, words in (
        ('', 'XML: no element found'),
        ('robot: r', 'XML: syntax error'),
        (urdf(limit='<limit lower="1" upper="-1"/>'), "<joint name='q1'>: the lower limit"),
        (urdf(more='<joint name="q3" type="fixed"/>'), "<joint name='q3'>: "),
    ):
        logged = ''
        one.node._reload._log_pause.cancel()  # each refusal has its line
        publisher.publish(String(data=wrong))
        one.spin_until(is_refused, 'refusal')
        assert words in logged
        assert one.node.settings is settings
    assert is_at(one.answer(Q), place(Q))
    # The next right one is taken.
    publisher.publish(String(data=urdf(L2=0.3)))
    one.spin_until(lambda: one.node.settings is not settings, 'the new robot')
    assert is_at(one.answer(Q), place(Q, L2=0.3))


def test_the_same_description_again_is_nothing_new(described):
    one, publisher = described(urdf())
    reads = []
    take = one.node._own_parameters.take
    one.node._own_parameters.take = lambda read: (reads.append(read), take(read))[1]
    for text in (urdf(), urdf(), urdf(L1=0.7)):
        publisher.publish(String(data=text))
    one.spin_until(lambda: one.node.settings.robot.description.links[0]['a'].text == '0.7', 'L1')
    assert len(reads) == 1


def test_what_comes_while_one_is_read_is_read_then(described):
    one, publisher = described(urdf())
    for k in range(1, 6):
        publisher.publish(String(data=urdf(L1=0.1 * k)))
    one.spin_until(lambda: is_at(one.answer(Q), place(Q, L1=0.5)), 'the last robot')
    result = one.call(Trigger, '/kinematics/reload', Trigger.Request())
    assert result.success, result.message
    assert result.message.startswith(f'topic:{TOPIC} is in force')


def test_descriptions_that_change_all_the_time_are_said_once(described, capfd):
    one, publisher = described(urdf())
    for k in range(1, 6):
        publisher.publish(String(data=urdf(L1=0.1 * k)))
        settings = one.node.settings
        one.spin_until(lambda before=settings: one.node.settings is not before, 'new robot')
    pause, heard = one.node._reload._log_pause, []
    pause.timer_period_ns = 100_000_000  # 0.1 s from now on
    pause.reset()

    def said(words):
        heard.append(capfd.readouterr().err)
        return words in ''.join(heard)

    one.spin_until(lambda: said('the last of 4 '), 'line of the others')
    assert ''.join(heard).count('is in force') == 2


def test_of_two_publishers_the_last_counts_and_both_are_told(described, capfd):
    one, _ = described(urdf())
    other = one.peer.create_publisher(String, TOPIC, LATCHED)
    one.spin_until(lambda: one.node.count_publishers(TOPIC) == 2, 'second publisher')
    other.publish(String(data=urdf(L2=0.9)))
    one.spin_until(lambda: is_at(one.answer(Q), place(Q, L2=0.9)), 'the second description')
    assert f'2 publishers on {TOPIC}: ' in capfd.readouterr().err


def test_a_bad_first_description_is_told_and_a_right_one_awaited(peer, capfd):
    publisher = peer.peer.create_publisher(String, TOPIC, LATCHED)
    publisher.publish(String(data='<robot name="r"/>'))
    node, logged, reasons = peer.other('waiting'), [], []
    peer.executor.remove_node(node)

    def correct():
        logged.append(capfd.readouterr().err)
        if 'the robot is refused' in logged[-1]:
            publisher.publish(String(data=urdf()))
        return False

    waiting = description_topic.DescriptionTopic(node, f'topic:{TOPIC}')
    assert waiting.first_robot(correct, reasons.append).dof == 2
    peer.executor.add_node(node)
    assert f'topic:{TOPIC}: ' in ''.join(logged)
    assert '<link>' in ''.join(logged)
    assert 'the robot is refused' in reasons[-1]


def waiting_sentence(peer, capfd, monkeypatch, topic=TOPIC):
    """Return what a node says that waits and has heard nothing."""
    monkeypatch.setattr(description_topic, 'LOG_PERIOD', 1.0)
    node = peer.other('waiting')
    peer.executor.remove_node(node)
    waiting = description_topic.DescriptionTopic(node, f'topic:{topic}')
    heard = ''

    def told():
        nonlocal heard
        heard += capfd.readouterr().err
        return 'transient_local' in heard

    with pytest.raises(description_topic.StoppedWaiting):
        waiting.first_robot(told, lambda reason: None)
    peer.executor.add_node(node)
    return heard


def test_a_node_that_hears_nothing_says_what_to_do(peer, capfd, monkeypatch):
    said = waiting_sentence(peer, capfd, monkeypatch)
    assert f'no publisher of {TOPIC} ' in said
    assert 'ros2 run robot_state_publisher robot_state_publisher arm.urdf' in said


def test_a_node_that_hears_nothing_names_who_speaks_elsewhere(peer, capfd, monkeypatch):
    peer.peer.create_publisher(String, '/left/robot_description', LATCHED)
    said = waiting_sentence(peer, capfd, monkeypatch)
    assert 'others here: /left/robot_description' in said
    assert '--robot-description /left/robot_description' in said


def test_a_publisher_that_keeps_nothing_for_late_ones_is_named(peer, capfd, monkeypatch):
    peer.peer.create_publisher(String, TOPIC, RELIABLE)
    said = waiting_sentence(peer, capfd, monkeypatch)
    assert 'by peer with durability volatile' in said


def test_a_node_does_not_publish_the_description_it_hears(described):
    with refused(SettingsError, 'conflict', 'publish_robot_description'):
        described(urdf(), parameters=['publish_robot_description:=true'])


def test_a_name_that_no_topic_can_have_is_refused(ros_domain, capfd):
    assert main(['--robot-description', '/a b']) == 1
    assert "parameter robot: '/a b' " in capfd.readouterr().err


def test_the_executor_builds_nothing_of_a_newer_description(described, capfd):
    one, publisher = described(urdf())
    one.answer(Q)
    publisher.publish(String(data=serial_urdf(14)))
    longest = 0.0
    while one.node.settings.robot.dof != 14:
        begin = time.thread_time()
        one.executor.spin_once(timeout_sec=0.1)
        longest = max(longest, time.thread_time() - begin)
    assert longest < GAP


def test_an_arm_of_sixty_joints_answers(arm, tmp_path, capfd):
    file = tmp_path / 's60.urdf'
    file.write_text(serial_urdf(60))
    one = arm(str(file))
    said = 'watches condition_number'
    assert said in capfd.readouterr().err
    jacobians = one.hear('jacobian', Float64MultiArray)
    distances = one.hear('singularity/distance', Float64)
    one.answer([0.3] * 60)
    one.spin_until(lambda: jacobians, 'Jacobian')
    assert len(jacobians[0].data) == 6 * 60
    assert not distances


def test_a_urdf_1_2_with_spaces_in_names_is_answered_and_doubted(arm, tmp_path, capfd):
    path = tmp_path / 'arm.urdf'
    text = urdf(limit=LIMIT.replace('"2"', '"180"').replace('"-2"', '"-180"'))
    turned = '<origin quat_xyzw="0 0 0.7071 0.7071"/>'
    for old, new in (
        ('<robot ', '<robot version="1.2" '),
        ('"q1"', '"Revolute 1"'),
        ('"q2"', '"Revolute 2"'),
        ('effort', 'jerk="9" torque="1" effort'),
        ('<child link="upper"/>', f'<child link="upper"/>{turned}'),
    ):
        text = text.replace(old, new)
    path.write_text(text)
    one, logged = arm(str(path)), capfd.readouterr().err
    for words in ('are these degrees?', "'Revolute 1'>: limits of 28.6479 ", "'torque'"):
        assert words in logged
    poses, jacobians = one.poses, one.hear('jacobian', Float64MultiArray)
    one.publish(joint_state(['Revolute 2', 'Revolute 1'], Q[::-1], stamp=START))
    one.spin_until(lambda: poses and jacobians, 'answers')
    assert jacobians[0].layout.dim[1].label == 'Revolute 1,Revolute 2'
    assert is_at(poses[0], place((Q[0] + math.pi / 2, Q[1])))
