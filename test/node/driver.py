"""Publish joint states of the joints in the arguments with the sensor QoS, until a signal."""

import sys

import rclpy
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState

rclpy.init()
node = rclpy.create_node('driver')
publisher = node.create_publisher(JointState, 'joint_states', qos_profile_sensor_data)


def publish():
    message = JointState(name=sys.argv[1:], position=[0.5] * len(sys.argv[1:]))
    message.header.stamp = node.get_clock().now().to_msg()
    publisher.publish(message)


node.create_timer(0.01, publish)
rclpy.spin(node)
