# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Two nodes of your own: one computes from joint states, one subscribes to a kinematics node.

`SpeedScale` subscribes to `joint_states` and publishes `~/speed_scale`: 1 far from singular poses
and 0 at the threshold `stop` of the robot file. Its subscription is best effort, so it matches
every driver, those with the sensor QoS too.

`PairedJacobians` pairs each Jacobian of a kinematics node with the pose of the same joint state.
"""

import sys

import numpy as np
import rclpy
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray

import kinematics_service as ks


class SpeedScale(Node):
    """Publishes how fast the arm may go."""

    def __init__(self, robot, **options):
        super().__init__('speed_scale', **options)
        self.robot = robot
        self.publisher = self.create_publisher(Float64, '~/speed_scale', 10)
        self.create_subscription(
            JointState, 'joint_states', self.on_joint_state, qos_profile_sensor_data
        )

    def on_joint_state(self, message):
        """Answer one message that has all joints of the arm."""
        positions = dict(zip(message.name, message.position))
        q = [positions.get(name, np.nan) for name in self.robot.joint_names]
        if not np.isfinite(q).all():
            return
        near = ks.singularity(self.robot, q)
        warn, stop = self.robot.singularity.thresholds.warn, self.robot.singularity.thresholds.stop
        scale = float(np.interp(near.distance, [stop, warn], [0.0, 1.0]))
        self.publisher.publish(Float64(data=scale))


# begin: docs/how_to/quality_of_service.md shows this class
class PairedJacobians(Node):
    """Pairs each Jacobian with the pose of the same joint state, once the next one is there."""

    def __init__(self, **options):
        super().__init__('paired_jacobians', **options)
        self.stamps, self.jacobians, self.pairs = [], [], {}
        self.create_subscription(PoseStamped, '/kinematics/pose', self.on_pose, 1000)
        self.create_subscription(Float64MultiArray, '/kinematics/jacobian', self.on_jacobian, 1000)
        self.create_subscription(Time, '/kinematics/jacobian/stamp', self.on_stamp, 1000)

    def on_pose(self, pose):
        self.keep(pose.header.stamp, pose=pose)

    def on_jacobian(self, jacobian, info):
        sent, number = info['source_timestamp'], info['publication_sequence_number']
        self.jacobians.append((sent, number, jacobian))
        self.match()

    def on_stamp(self, stamp, info):
        self.stamps.append((info['source_timestamp'], stamp))
        self.match()

    def match(self):
        # The node sends a Jacobian, then its stamp. Numbers tell if one was lost between two.
        while self.stamps and len(self.jacobians) > 1:
            (sent, stamp), (first, k, jacobian) = self.stamps[0], self.jacobians[0]
            second, m, _ = self.jacobians[1]
            if sent > second:
                del self.jacobians[0]
                continue
            del self.stamps[0]
            if sent > first and m == k + 1:
                self.keep(stamp, jacobian=jacobian)

    def keep(self, stamp, **half):
        pair = self.pairs.setdefault((stamp.sec, stamp.nanosec), {})
        pair.update(half)
        if len(pair) == 2:
            self.use(**self.pairs.pop((stamp.sec, stamp.nanosec)))

    def use(self, pose, jacobian):
        J = np.reshape(jacobian.data, (6, -1))
        self.get_logger().info(f'x = {pose.pose.position.x:.3f} m, vx = {J[0].round(3)} qdot')


# end

if __name__ == '__main__':
    rclpy.init()
    executor = SingleThreadedExecutor()
    executor.add_node(SpeedScale(ks.load_robot(sys.argv[1] if len(sys.argv) > 1 else 'ur5e')))
    executor.add_node(PairedJacobians())
    executor.spin()
