# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""`calibrate-live` as a process: a virtual arm with errors, and poses of it from elsewhere."""

import json
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from calibrated_arms import measured_arm, truly
from geometry_msgs.msg import PoseStamped
from ros_harness import Peer
from target_harness import pose_target

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.demo.virtual_arm import RATE, TimedJointState, VirtualArm

NOISE = 5e-5
DEADLINE = 90.0
# Joint states, every fifth of which has a pose.
ENOUGH = 350


class Measured:
    """A virtual arm that moves, and poses of the true arm at the stamps of its joint states."""

    def __init__(self, arm, poses):
        self.arm, self.with_poses = arm, poses
        self.peer = Peer()
        self.poses = self.peer.peer.create_publisher(
            PoseStamped, '/kinematics/reference_pose', 100
        )
        self.virtual = VirtualArm(self.peer.peer, arm.robot.joint_names, self.moments())
        self.random = np.random.default_rng(2)

    def moments(self):
        speeds = np.array([0.9, 0.7, 1.1, 1.3, 0.8, 1.2])
        start = time.time_ns()
        k = 0
        while True:
            t = k / RATE
            q = [0.2, -1.2, 1.3, -1.0, 1.0, 0.3] + 1.1 * np.sin(speeds * t + np.arange(6))
            stamp = start + round(t * 1e9)
            if self.with_poses and k % 5 == 0:
                pose = truly(self.arm, q[None])[0]
                pose[:3, 3] += NOISE * self.random.normal(size=3)
                if 1.0 + np.trace(pose[:3, :3]) > 0.1:  # the conversion of the test is simple
                    self.poses.publish(pose_target(pose, 'tracker', stamp))
            yield TimedJointState(t, stamp, q, None)
            k += 1


class Live:
    """`python -m kinematics_service calibrate-live` as a process, its lines as they come."""

    def __init__(self, *arguments):
        self.lines = []
        self.popen = subprocess.Popen(
            [sys.executable, '-m', 'kinematics_service', 'calibrate-live', *map(str, arguments)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self):
        for line in self.popen.stdout:
            self.lines.append(line.rstrip('\n'))

    def said(self, words):
        return any(words in line for line in list(self.lines))

    def end(self):
        code = self.popen.wait(DEADLINE)
        self.reader.join(DEADLINE)
        return code, '\n'.join(self.lines), self.popen.stderr.read()


@pytest.fixture
def live(ros_domain):
    started = []

    def start(*arguments):
        started.append(Live(*arguments))
        return started[-1]

    yield start
    for one in started:
        one.popen.kill()
        one.popen.communicate()


@pytest.fixture
def measured(request, ros_domain):
    """Return a moving arm, with poses unless a test asks for none."""
    one = Measured(measured_arm('ur5e', 1), getattr(request, 'param', True))
    yield one
    # What logs say is decided by the first context of a process that is open.
    one.peer.close()


@pytest.mark.slow
def test_a_running_robot_is_calibrated_and_ctrl_c_ends_the_collecting(live, measured, tmp_path):
    output, document = tmp_path / 'mine.yaml', tmp_path / 'found.json'
    one = live(
        *(
            '--robot',
            'ur5e',
            '--seconds',
            600,
            '--output',
            output,
            '--json',
            document,
            '--fix',
            'lag',
        )
    )
    measured.peer.spin_until(lambda: measured.virtual.heard, 'listener', DEADLINE)
    measured.virtual.start()
    measured.peer.spin_until(
        lambda: one.said('; more poses refine'), 'that all is identified', DEADLINE
    )
    # As many poses as tell the rest with some room, however fast they came.
    measured.peer.spin_until(lambda: measured.virtual.sent > ENOUGH, 'more poses', DEADLINE)
    assert one.lines[0].startswith('collecting ')
    assert '/joint_states' in one.lines[0]
    assert '/kinematics/reference_pose' in one.lines[0]
    assert one.said(' of 30 combinations are identified')
    # Of the last fit: how many others came before it is a matter of the machine.
    for words, named in (
        ('identified', {'a2', 'alpha3', 'theta4'}),
        ('not yet, or not', {'theta1', 'd2', 'd3', 'd4'}),
    ):
        told = [line for line in one.lines if line.startswith(f'  {words}')]
        assert named <= set(told[-1].partition(': ')[2].split(', '))
    one.popen.send_signal(signal.SIGINT)
    code, out, err = one.end()
    assert (code, err) == (0, '')
    assert 'a pose that identifies more: ' in out or '30 of 30' in out
    assert f'wrote {output}; next: ' in out
    found = json.loads(document.read_text())
    assert found['known'] == found['possible'] == 30
    assert found['errors']['held_out']['position_rms'] < 5 * NOISE
    # At poses where it never was the calibrated arm is where the true one is.
    robot = ks.load_robot(output)
    q = [0.2, -1.2, 1.3, -1.0, 1.0, 0.3] + np.random.default_rng(5).uniform(-1, 1, (50, 6))
    X, Y = np.array(found['base_offsets'][0]), np.array(found['tool_offsets'][0])
    off = X @ ks.forward_kinematics(robot, q) @ Y - truly(measured.arm, q)
    assert np.sqrt(3 * np.mean(off[:, :3, 3] ** 2)) < 2e-4


@pytest.mark.slow
@pytest.mark.parametrize('measured', [False], indirect=True, ids=['no poses'])
def test_the_time_ends_the_collecting_and_too_few_poses_are_a_sentence(live, measured):
    one = live('--robot', 'ur5e', '--seconds', 6)
    measured.peer.spin_until(lambda: measured.virtual.heard, 'listener', DEADLINE)
    measured.virtual.start()
    measured.peer.spin_until(lambda: one.popen.poll() is not None, 'the end', DEADLINE)
    code, out, err = one.end()
    assert code == 1
    assert '/kinematics/reference_pose' in out.splitlines()[1]
    assert 'no pose of /kinematics/reference_pose' in err


@pytest.mark.parametrize(('option', 'topic'), [('--topic', 'a b'), ('--pose-topic', '9/x')])
def test_a_topic_that_is_none_is_one_sentence(ros_domain, capfd, option, topic):
    assert main(['calibrate-live', '--robot', 'ur5e', '--seconds', '3', option, topic]) == 2
    out, err = capfd.readouterr()
    assert (out, err.count('\n')) == ('', 1)
    assert f'{option} {topic}: ' in err


def test_a_robot_that_is_none_is_the_same_sentence_with_and_without_ros(ros_domain, capfd):
    main(['calibrate-live', '--robot', 'nosuch'])
    told = capfd.readouterr().err.splitlines()[-1].partition('--robot: ')[2]
    assert main(['--robot', 'nosuch']) == 1
    assert capfd.readouterr() == ('', f'{told}\n')
