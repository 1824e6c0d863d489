# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Joint states at 200 Hz beside target poses: what is lost, how old poses are, what is answered.

    python bench/targets.py [--robots panda,kinova_gen3,ur5e] [--redundancy near,clearance]
        [--rates 30,100,1000] [--seconds 5] [--kind pose]

Node, feeder of joint states, sender of targets and listener are a process each. A line for each
robot, redundancy and rate: joint states without a pose, age of the poses (ms, from the stamp to
the listener's callback), targets answered with joint positions, targets with a status, targets
that newer ones replaced, and what the node counts as lost and left out. `--kind twist` sends
target twists instead. The first line is the load of the machine.
"""

import argparse
import os
import sys
import time
from pathlib import Path

import numpy as np

from processes import JointStates, age_of, node, paced, peer, running  # isort: skip

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))

JOINT_STATES = 200.0  # Hz
AHEAD = 0.05  # of a target: joint positions in front of the arm's, rad


def positions(robot, ahead=0.0):
    """Return where the arm is now: slow sines within the limits, the same in every process."""
    limits = np.clip(robot.limits, -3.0, 3.0)
    joints = np.arange(robot.dof)
    swing = 0.2 * (limits[:, 1] - limits[:, 0]) * np.sin(0.2 * (time.time() % 1e5) + joints)
    return np.mean(limits, axis=1) + swing + ahead


def feed(options):
    """Publish joint states with the time of sending as their stamp."""
    from sensor_msgs.msg import JointState

    import kinematics_service as ks

    with peer('feeder') as node:
        publisher = node.create_publisher(JointState, 'joint_states', 100)
        while publisher.get_subscription_count() == 0:
            time.sleep(0.05)
        time.sleep(1.0)
        robot, messages = ks.load_robot(options.robots), JointStates(options.robots)
        for k in paced(JOINT_STATES):
            if k == round(JOINT_STATES * options.seconds):
                break
            publisher.publish(messages.at(positions(robot)))
        time.sleep(0.5)


def aim(options):
    """Publish targets that the arm can reach."""
    from geometry_msgs.msg import PoseStamped, TwistStamped
    from target_harness import pose_target, twist_target

    import kinematics_service as ks

    kind = {'pose': PoseStamped, 'twist': TwistStamped}[options.kind]
    with peer('aimer') as node:
        publisher = node.create_publisher(kind, f'/kinematics/target_{options.kind}', 100)
        while publisher.get_subscription_count() == 0:
            time.sleep(0.05)
        robot = ks.load_robot(options.robots)
        for _ in paced(float(options.rates)):
            if options.kind == 'twist':
                twist = 0.05 * np.sin(time.time() + np.arange(6))
                publisher.publish(twist_target(twist, robot.base_frame))
                continue
            present, wanted = (
                ks.forward_kinematics(robot, positions(robot, ahead)) for ahead in (0.0, AHEAD)
            )
            publisher.publish(pose_target(np.linalg.inv(present) @ wanted, robot.tool_frame))


class Listener:
    """Hears the poses, and what the node says of the targets and of its input."""

    def __init__(self, kind):
        import rclpy
        from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
        from geometry_msgs.msg import PoseStamped
        from rclpy.experimental import EventsExecutor
        from sensor_msgs.msg import JointState

        rclpy.init()
        self._node = rclpy.create_node('listener')
        answers = 'joint_states' if kind == 'pose' else 'joint_velocity'
        subscribe = self._node.create_subscription
        subscribe(PoseStamped, '/kinematics/pose', self._on_pose, 1000, raw=True)
        subscribe(JointState, f'/kinematics/ik/{answers}', self._on_answer, 1000, raw=True)
        subscribe(DiagnosticStatus, '/kinematics/ik/status', self._on_status, 1000)
        subscribe(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10)
        self._executor = EventsExecutor()
        self._executor.add_node(self._node)
        self.told = {}
        self.forget()

    def forget(self):
        """Begin to count."""
        self.ages, self.answers, self.statuses, self.replaced = [], 0, 0, 0

    def _on_pose(self, data):
        self.ages.append(1e3 * age_of(data))

    def _on_answer(self, data):
        self.answers += 1

    def _on_status(self, status):
        values = {pair.key: pair.value for pair in status.values}
        self.statuses += 1
        self.replaced += int(values.get('replaced', 0))

    def _on_diagnostics(self, message):
        self.told = {pair.key: pair.value for pair in message.status[0].values}

    def listen(self, seconds):
        """Listen for a while."""
        from rclpy.task import Future

        self._executor.spin_until_future_complete(Future(), timeout_sec=seconds)

    def counted(self):
        """Return what the node has counted as lost and as left out."""
        return np.array([int(self.told.get(key, 0)) for key in ('lost', 'left out')])


def one_run(listener, robot, rate, options):
    """Feed and aim for a while; return what is to be said of it."""
    listener.listen(2.0)
    listener.forget()
    before = listener.counted()
    command = [sys.executable, __file__, '--robots', robot, '--rates', str(rate)]
    command += ['--seconds', str(options.seconds), '--kind', options.kind]
    with (
        running([*command, '--role', 'aim']),
        running([*command, '--role', 'feed']) as feeder,
    ):
        while feeder.poll() is None:
            listener.listen(0.2)
    listener.listen(2.0)
    lost, left_out = listener.counted() - before
    ages = np.array(listener.ages or [np.inf])
    p50, p99 = np.percentile(ages, [50, 99])
    return (
        f'{round(JOINT_STATES * options.seconds) - len(listener.ages):6}{p50:9.2f}{p99:9.2f}'
        f'{ages.max():9.2f}{listener.answers:10}{listener.statuses:10}{listener.replaced:10}'
        f'{lost:7}{left_out:7}'
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--robots', default='panda,kinova_gen3,ur5e')
    parser.add_argument('--redundancy', default='near,clearance')
    parser.add_argument('--rates', default='30,100,1000')
    parser.add_argument('--seconds', type=float, default=5.0)
    parser.add_argument('--kind', choices=('pose', 'twist'), default='pose')
    parser.add_argument('--role', choices=('feed', 'aim'), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.role:
        {'feed': feed, 'aim': aim}[options.role](options)
        return
    print(f'load {os.getloadavg()[0]:.1f}; 200 joint states/s for {options.seconds:g} s')
    print(
        f'{"robot":12}{"redundancy":11}{"targets/s":>9}{"no pose":>8}{"p50 ms":>9}{"p99 ms":>9}'
        f'{"max ms":>9}{"answers":>10}{"statuses":>10}{"replaced":>10}{"lost":>7}{"left":>7}'
    )
    listener = Listener(options.kind)
    for robot in options.robots.split(','):
        for redundancy in options.redundancy.split(','):
            parameter = ('--ros-args', '-p', f'ik.redundancy:={redundancy}')
            listener.told = {}
            with running(node('--robot', robot, *parameter)):
                for rate in options.rates.split(','):
                    said = one_run(listener, robot, rate, options)
                    print(f'{robot:12}{redundancy:11}{rate:>9}  {said}', flush=True)


if __name__ == '__main__':
    main()
