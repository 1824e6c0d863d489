# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
A controller that obeys `~/scale`: it asks for joint velocities and takes the share it is given.

The node answers each command with the share that may be kept. The arm here is simulated, 100 steps
a second; a real one has a driver that publishes its joint states.
"""

import sys

import numpy as np
import rclpy
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

STEP = 0.01  # s


class ScaledController(Node):
    """
    Asks for one joint motion without end, and follows it as far as it may.

    Parameters
    ----------
    names, q, wanted
        Names, positions (rad or m) and velocities (rad/s or m/s) of the joints.
    source
        Full name of the kinematics node.
    """

    def __init__(self, names, q, wanted, source='/kinematics', **options):
        super().__init__('scaled_controller', **options)
        self.names, self.q, self.wanted = names, np.array(q), np.array(wanted)
        self.share = 0.0
        self.states = self.create_publisher(JointState, 'joint_states', 10)
        self.commands = self.create_publisher(JointState, f'{source}/command', 10)
        self.create_subscription(Float64, f'{source}/scale', self.obey, 10)
        self.create_timer(STEP, self.step)

    def step(self):
        """Move by what was allowed last, and ask again."""
        qdot = self.share * self.wanted
        self.q = self.q + STEP * qdot
        self.share = 0.0  # without an answer it stands still
        now = self.get_clock().now().to_msg()
        state = JointState(name=self.names, position=self.q.tolist(), velocity=qdot.tolist())
        state.header.stamp = now
        self.states.publish(state)
        command = JointState(name=self.names, velocity=self.wanted.tolist())
        command.header.stamp = now
        self.commands.publish(command)

    def obey(self, message):
        """Take the share of the command that may be kept now."""
        self.share = message.data


if __name__ == '__main__':
    rclpy.init(args=sys.argv)
    rclpy.spin(ScaledController(['shoulder', 'elbow'], [0.0, 1.0], [0.0, -2.0]))
