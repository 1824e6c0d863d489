"""
A node of one's own on the estimator: how fast a controller may go, by the distance to singular.

It hears `joint_states` and publishes `~/speed_scale`, 1 far from singular poses and 0 at the
threshold `stop` of the robot file. The estimator merges messages by joint name and refuses bad
ones; this file only says what follows from a state.
"""

import sys
import time

import numpy as np
import rclpy
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

import kinematics_service as ks

# Not part of the public interface: what is not named in kinematics_service may move.
from kinematics_service.estimation.estimator import Estimator, EstimatorSettings, RefusedMessage
from kinematics_service.estimation.joint_sample import JointSample


class SpeedScale(Node):
    """Publishes how fast the arm may go."""

    def __init__(self, robot, **options):
        super().__init__('speed_scale', **options)
        self.robot = robot
        self.estimator = Estimator(robot, EstimatorSettings())
        self.publisher = self.create_publisher(Float64, '~/speed_scale', 10)
        self.create_subscription(JointState, 'joint_states', self.hear, 100)

    def hear(self, message):
        """Answer one message."""
        stamp = message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec
        outcome = self.estimator.take(
            JointSample(
                names=message.name,
                positions=message.position,
                velocities=message.velocity,
                stamp=stamp,
                received=self.get_clock().now().nanoseconds,
                arrival=time.monotonic_ns(),
            )
        )
        if isinstance(outcome, RefusedMessage):
            if outcome.sentence:
                self.get_logger().warning(outcome.sentence, throttle_duration_sec=5.0)
            return
        near = ks.singularity(self.robot, outcome.state.q, outcome.state.qdot)
        warn, stop = self.robot.thresholds.warn, self.robot.thresholds.stop
        scale = float(np.interp(near.distance, [stop, warn], [0.0, 1.0]))
        self.publisher.publish(Float64(data=scale))


if __name__ == '__main__':
    rclpy.init()
    rclpy.spin(SpeedScale(ks.load_robot(sys.argv[1] if len(sys.argv) > 1 else 'ur5e')))
