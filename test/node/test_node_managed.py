# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The node with a life cycle, as a process that a manager leads through its states."""

import contextlib

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from node_process import NodeProcess
from ros_harness import LATCHED, RELIABLE, START, STEP, Peer, joint_state
from sensor_msgs.msg import JointState
from target_harness import pose_target

import kinematics_service as ks
from kinematics_service.__main__ import main

Q = (0.1, 0.2, 0.3)
NO_TRANSITION = 254
ROBOT = """
robot: {name}
convention: standard
joints: [{{name: q1, type: revolute}}, {{name: q2, type: revolute}}]
links:
  - {{a: 1, alpha: 0, d: 0, theta: q1}}
  - {{a: {length}, alpha: 0, d: 0, theta: q2}}
"""


class Manager(Peer):
    """Leads a node through its states, and hears what it answers."""

    def __init__(self):
        super().__init__()
        self.stamp = START
        # A node that subscribes with best effort loses what comes before it knows the publisher.
        self.states = self.peer.create_publisher(JointState, '/joint_states', RELIABLE)
        self.changes = self.peer.create_client(ChangeState, '/kinematics/change_state')
        self.is_discovered = False

    def hear(self):
        """Listen to what a node publishes that has been configured."""
        self.poses = self.listen('/kinematics/pose', PoseStamped)
        self.warnings = self.listen('/kinematics/singularity/warning', DiagnosticStatus, LATCHED)
        # What is published is lost until the node has discovered a subscription: this one is the
        # last that it discovers.
        self.statuses = self.listen('/diagnostics', DiagnosticArray)
        self.spin_until(lambda: self.statuses, 'diagnostics')

    def change(self, transition):
        if not self.is_discovered:
            # The response to a new client may be lost, and a transition cannot be asked for twice:
            # ask for one that no state allows until the node answers.
            self.ask(self.changes, _change(NO_TRANSITION))
            self.is_discovered = True
        future = self.changes.call_async(_change(transition))
        self.spin_until(future.done, f'response to transition {transition}')
        return future.result().success

    @property
    def state(self):
        return self.call(GetState, '/kinematics/get_state', GetState.Request()).current_state.id

    def send(self, q=Q):
        self.spin_until(self.states.get_subscription_count, 'listeners to /joint_states')
        self.stamp += STEP
        names = [f'q{j + 1}' for j in range(len(q))]
        self.states.publish(joint_state(names, q, stamp=self.stamp))
        return self.stamp


def _change(transition):
    return ChangeState.Request(transition=Transition(id=transition))


@pytest.fixture
def started(ros_domain):
    with contextlib.ExitStack() as stack:

        def start(*arguments):
            process = NodeProcess(*arguments, '--managed', ready=False)
            stack.callback(process.kill)
            manager = stack.enter_context(contextlib.closing(Manager()))
            return process, manager

        yield start


def test_it_answers_when_it_is_active_and_is_silent_otherwise(started):
    process, manager = started('--robot', 'craig_3r')
    assert manager.state == State.PRIMARY_STATE_UNCONFIGURED
    assert manager.peer.count_publishers('/kinematics/pose') == 0
    assert not manager.change(Transition.TRANSITION_ACTIVATE)
    assert manager.change(Transition.TRANSITION_CONFIGURE)
    manager.hear()
    manager.send()
    status = manager.statuses[0].status[0]
    assert (status.level, status.message) == (DiagnosticStatus.OK, 'the node is not active')
    # A target gets the reason.
    told = manager.listen('/kinematics/ik/status', DiagnosticStatus)
    targets = manager.speaker('/kinematics/target_pose', kind=PoseStamped)
    target = pose_target(ks.forward_kinematics('craig_3r', Q), 'base_link', START)

    def answered():
        # The node may know of either after they know of it, and what is sent until then is lost.
        targets.publish(target)
        return told

    manager.spin_until(answered, 'a status')
    assert 'the node is not active' in told[0].message
    assert not manager.poses
    assert manager.change(Transition.TRANSITION_ACTIVATE)
    manager.send()
    manager.spin_until(lambda: manager.poses, 'pose')
    assert manager.change(Transition.TRANSITION_DEACTIVATE)
    manager.send()
    manager.spin_until(lambda: manager.warnings[-1].message == 'the node is not active', 'word')
    assert manager.warnings[-1].level == DiagnosticStatus.STALE
    assert manager.change(Transition.TRANSITION_ACTIVATE)
    stamp = manager.send()
    manager.spin_until(lambda: len(manager.poses) == 2, 'pose')  # none of a silent time
    assert manager.poses[-1].header.stamp.nanosec == stamp % 1_000_000_000
    # Other stamps are none that step back: the time before is forgotten.
    assert manager.change(Transition.TRANSITION_DEACTIVATE)
    assert manager.change(Transition.TRANSITION_CLEANUP)
    assert manager.change(Transition.TRANSITION_CONFIGURE)
    assert manager.change(Transition.TRANSITION_ACTIVATE)
    manager.stamp = START
    manager.send()
    manager.spin_until(lambda: len(manager.poses) == 3, 'pose')
    assert manager.change(Transition.TRANSITION_ACTIVE_SHUTDOWN)
    assert manager.state == State.PRIMARY_STATE_FINALIZED
    assert process.popen.poll() is None
    process.popen.terminate()
    assert process.wait() == 0
    assert 'stepped back' not in process.stderr


def test_a_robot_with_faults_is_not_configured_and_its_faults_are_told(started, tmp_path):
    file = tmp_path / 'arm.yaml'
    file.write_text(ROBOT.format(name='arm', length='oops'))
    process, manager = started('--robot', str(file))
    for _ in range(2):
        assert not manager.change(Transition.TRANSITION_CONFIGURE)
        assert manager.state == State.PRIMARY_STATE_UNCONFIGURED
    manager.spin_until(lambda: 'links[1].a: ' in process.stderr, 'line of the log')
    assert "'oops'" in process.stderr
    file.write_text(ROBOT.format(name='arm', length=2))
    assert manager.change(Transition.TRANSITION_CONFIGURE)
    manager.hear()
    assert manager.change(Transition.TRANSITION_ACTIVATE)
    manager.send((0.0, 0.0))
    manager.spin_until(lambda: manager.poses, 'pose')
    assert manager.poses[-1].pose.position.x == pytest.approx(3.0)
    # It is read again when it is configured again; with faults the arm before stays refused.
    assert manager.change(Transition.TRANSITION_DEACTIVATE)
    assert manager.change(Transition.TRANSITION_CLEANUP)
    file.write_text(ROBOT.format(name='arm', length=4))
    assert manager.change(Transition.TRANSITION_CONFIGURE)
    assert manager.change(Transition.TRANSITION_ACTIVATE)
    manager.send((0.0, 0.0))
    manager.spin_until(lambda: len(manager.poses) == 2, 'pose')
    assert manager.poses[-1].pose.position.x == pytest.approx(5.0)
    # A signal ends it while it is inactive.
    assert manager.change(Transition.TRANSITION_DEACTIVATE)
    process.popen.terminate()
    assert process.wait() == 0


def test_a_signal_ends_it_before_it_is_configured(started):
    process, manager = started('--robot', 'craig_3r')
    manager.spin_until(lambda: 'waiting to be configured' in process.stderr, 'start')
    process.popen.terminate()
    assert process.wait() == 0


def test_a_robot_of_a_topic_is_not_managed(capfd):
    assert main(['--managed', '--robot-description']) == 2
    assert capfd.readouterr() == (
        '',
        '--managed: a robot from a topic cannot be managed; give a robot file or a name\n',
    )
