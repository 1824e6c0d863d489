# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The yardstick: what a plain rclpy node costs that does no mathematics at all.

    python bench/plain_node.py [--topics pose,twist,jacobian,scalar] [--namespace left]
    python bench/plain_node.py --relay [--executor events]
    python bench/plain_node.py --bytes [--topics pose]

For every JointState it publishes the same topics as the node, built in Python as tutorials show,
with constant numbers, on rclpy's default executor. With `--relay` it answers one PoseStamped that
was built at the start, with the stamp of the JointState. With `--bytes` it neither reads what
comes nor writes anything new: constant bytes go out for every message, which is what rclpy and
the middleware cost by themselves.
"""

import argparse
import signal
from array import array

import rclpy
from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.serialization import serialize_message
from rclpy.task import Future
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray, MultiArrayDimension

POSITION, QUATERNION = (0.3, -0.2, 0.5), (0.5, -0.5, 0.5, 0.5)
TWIST = (0.1, -0.2, 0.3, -0.4, 0.5, -0.6)
SCALAR = 0.0625


def pose(message):
    built = PoseStamped()
    built.header.stamp = message.header.stamp
    built.header.frame_id = 'base_link'
    position, orientation = built.pose.position, built.pose.orientation
    position.x, position.y, position.z = POSITION
    orientation.x, orientation.y, orientation.z, orientation.w = QUATERNION
    return built


def twist(message):
    built = TwistStamped()
    built.header.stamp = message.header.stamp
    built.header.frame_id = 'base_link'
    linear, angular = built.twist.linear, built.twist.angular
    linear.x, linear.y, linear.z, angular.x, angular.y, angular.z = TWIST
    return built


def jacobian(message):
    n = len(message.name)
    built = Float64MultiArray()
    built.layout.dim = [
        MultiArrayDimension(label='vx,vy,vz,wx,wy,wz', size=6, stride=6 * n),
        MultiArrayDimension(label=','.join(message.name), size=n, stride=n),
    ]
    built.data = array('d', bytes(8 * 6 * n))
    return built


def scalar(message):
    return Float64(data=SCALAR)


TOPICS = {
    'pose': ('~/pose', PoseStamped, pose),
    'twist': ('~/twist', TwistStamped, twist),
    'jacobian': ('~/jacobian', Float64MultiArray, jacobian),
    'scalar': ('~/singularity/manipulability', Float64, scalar),
}


class PlainNode(Node):
    def __init__(self, topics, namespace):
        super().__init__('kinematics', namespace=namespace)
        self.outputs = [
            (self.create_publisher(kind, name, 100), build)
            for name, kind, build in (TOPICS[topic] for topic in topics)
        ]
        self.create_subscription(JointState, 'joint_states', self.answer, 100)

    def answer(self, message):
        for publisher, build in self.outputs:
            publisher.publish(build(message))


class Relay(Node):
    def __init__(self, namespace):
        super().__init__('kinematics', namespace=namespace)
        self.publisher = self.create_publisher(PoseStamped, '~/pose', 100)
        self.built = pose(JointState())
        self.create_subscription(JointState, 'joint_states', self.answer, 100)

    def answer(self, message):
        self.built.header.stamp = message.header.stamp
        self.publisher.publish(self.built)


class Bytes(Node):
    def __init__(self, topics, namespace):
        super().__init__('kinematics', namespace=namespace)
        names = [f'joint_{k}' for k in range(6)]
        self.outputs = [
            (
                self.create_publisher(kind, name, 100),
                serialize_message(build(JointState(name=names))),
            )
            for name, kind, build in (TOPICS[topic] for topic in topics)
        ]
        self.create_subscription(JointState, 'joint_states', self.answer, 100, raw=True)

    def answer(self, data):
        for publisher, constant in self.outputs:
            publisher.publish(constant)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--topics', default=','.join(TOPICS), help='of ' + ', '.join(TOPICS))
    parser.add_argument('--relay', action='store_true', help='one pose, built at the start')
    parser.add_argument('--bytes', action='store_true', help='constant bytes, nothing read')
    parser.add_argument('--executor', choices=('default', 'events'), default='default')
    parser.add_argument('--namespace', default='')
    arguments = parser.parse_args()
    signal.signal(signal.SIGINT, signal.default_int_handler)
    rclpy.init()
    topics = arguments.topics.split(',')
    if arguments.relay:
        node = Relay(arguments.namespace)
    else:
        node = (Bytes if arguments.bytes else PlainNode)(topics, arguments.namespace)
    try:
        if arguments.executor == 'default' and not arguments.bytes:
            executor = SingleThreadedExecutor()
            executor.add_node(node)
            executor.spin()
        else:
            from rclpy.experimental import EventsExecutor

            executor = EventsExecutor()
            executor.add_node(node)
            never = Future()
            while rclpy.ok():  # its spin() burns a core in these wheels
                executor.spin_until_future_complete(never, timeout_sec=0.1)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
