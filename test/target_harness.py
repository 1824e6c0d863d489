# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Targets for a node under test, and all that it says about them."""

import math

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped, TwistStamped
from ros_harness import SECOND
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

# Stands for the arm's own base frame.
BASE = '<base>'


def pose_target(T, frame=BASE, stamp=0):
    """Return a pose (4, 4) as a message."""
    message = PoseStamped()
    message.header.frame_id = frame
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, SECOND)
    position, orientation = message.pose.position, message.pose.orientation
    position.x, position.y, position.z = map(float, T[:3, 3])
    w = math.sqrt(max(0.0, 1.0 + T[0, 0] + T[1, 1] + T[2, 2])) / 2.0
    assert w > 0.1, 'choose another pose: this conversion is the simple one'
    orientation.w = w
    orientation.x = float(T[2, 1] - T[1, 2]) / (4.0 * w)
    orientation.y = float(T[0, 2] - T[2, 0]) / (4.0 * w)
    orientation.z = float(T[1, 0] - T[0, 1]) / (4.0 * w)
    return message


def twist_target(twist, frame=BASE):
    """Return a twist (6,) as a message."""
    message = TwistStamped()
    message.header.frame_id = frame
    linear, angular = message.twist.linear, message.twist.angular
    linear.x, linear.y, linear.z, angular.x, angular.y, angular.z = map(float, twist)
    return message


class Targets:
    """An arm under test with all that it says about targets."""

    def __init__(self, arm):
        self.arm = arm
        self.joint_states = arm.hear('ik/joint_states', JointState)
        self.solutions = arm.hear('ik/solutions', Float64MultiArray)
        self.velocities = arm.hear('ik/joint_velocity', JointState)
        self.statuses = arm.hear('ik/status', DiagnosticStatus)
        self._publishers = {
            kind: arm.peer.create_publisher(kind, arm.topic(name), 10)
            for kind, name in ((PoseStamped, 'target_pose'), (TwistStamped, 'target_twist'))
        }
        for publisher in self._publishers.values():
            arm.spin_until(lambda p=publisher: p.get_subscription_count() == 1, 'listener')

    def ask(self, message):
        """Send a target and return the status that answers it."""
        if message.header.frame_id == BASE:
            message.header.frame_id = self.arm.robot.base_frame
        heard = len(self.statuses)
        self._publishers[type(message)].publish(message)
        self.arm.spin_until(lambda: len(self.statuses) > heard, 'status of a target')
        return self.statuses[-1]

    def settle(self):
        """Return when everything the node has sent so far is here."""
        for _ in range(20):
            self.arm.executor.spin_once(timeout_sec=0.005)
