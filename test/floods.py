# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Floods of joint states, and a client that looks what a flooded node still answers."""

import subprocess
import sys
import time

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

import kinematics_service as ks

ROBOT = 'ur5e'
PATIENCE = 120.0
# A reader that missed a message keeps the later ones until its publisher tells again what there
# is, which Fast DDS does every 3 s.
QUIET = 4.0

# What floods: as a driver sends it, with the joints of ten thousand others, with a name of 1 MB.
# The stamp is at the front of the serialized message, after its encapsulation.
FAST = """
import faulthandler, struct, sys, time, rclpy
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
kind, *names = sys.argv[1:]
names += dict(small=[], joints=[f'joint_{k}' for k in range(9_994)], name=['x' * 1_000_000])[kind]
rclpy.init()
publisher = rclpy.create_node('flood').create_publisher(JointState, 'joint_states', 100)
data = bytearray(serialize_message(JointState(name=names, position=[0.1] * len(names))))
while rclpy.ok():
    struct.pack_into('<iI', data, 4, *divmod(time.time_ns(), 1_000_000_000))
    try:
        publisher.publish(bytes(data))
    except Exception:
        break  # it was told to end
# Where the node's participant goes at the same moment, Fast DDS may never come back.
faulthandler.dump_traceback_later(10.0, exit=True)
"""


class Client:
    """Asks the node and sends it joint states, and hears what it answers."""

    def __init__(self):
        rclpy.init()
        self.node = rclpy.create_node('client')
        self.executor = rclpy.executors.SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.names = list(ks.load_robot(ROBOT).joint_names)
        self.diagnostics, self.warnings, self.poses = [], [], []
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        for kind, topic, heard, qos in (
            (DiagnosticArray, '/diagnostics', self.diagnostics, 10),
            (DiagnosticStatus, '/kinematics/singularity/warning', self.warnings, latched),
        ):
            self.node.create_subscription(kind, topic, heard.append, qos)
        self.node.create_subscription(PoseStamped, '/kinematics/pose', self._on_pose, 1000)
        # A flooded transport delivers many requests at once: room for all their answers.
        self.service = self.node.create_client(
            Trigger, '/kinematics/describe', qos_profile=QoSProfile(depth=1000)
        )
        self.publisher = self.node.create_publisher(JointState, 'joint_states', 1000)
        self.until(self.service.service_is_ready, PATIENCE)
        self.until(lambda: self.publisher.get_subscription_count() == 1, PATIENCE)

    def _on_pose(self, pose):
        self.poses.append((pose.header.stamp.sec, pose.header.stamp.nanosec))

    def close(self):
        """Go: as long as its node is there, others hear of its topics."""
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown()

    def until(self, true, seconds):
        """Listen until something is so, or for some seconds; return whether it is."""
        end = time.monotonic() + seconds
        while not (so := true()) and time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.01)
        return so

    def rest(self, seconds):
        """Listen for some seconds."""
        self.until(lambda: False, seconds)

    def drain(self):
        """Listen until no pose has come for a while: those of a flood wait in this client."""
        heard, last, end = -1, 0.0, time.monotonic() + PATIENCE
        while (now := time.monotonic()) < end:
            if heard < len(self.poses):
                heard, last = len(self.poses), now
            elif now - last > QUIET:
                return
            self.executor.spin_once(timeout_sec=0.01)

    def ask(self):
        """Call a service; return the future of its answer."""
        return self.service.call_async(Trigger.Request())

    def answered(self, seconds):
        """Ask, and return how long the answer took (s), None if it took longer."""
        begin, future = time.monotonic(), self.ask()
        return time.monotonic() - begin if self.until(future.done, seconds) else None

    def send(self, number, publisher=None):
        """Send joint states at 50 Hz; return their stamps."""
        stamps = []
        for k in range(number):
            message = JointState(name=self.names, position=[0.1 + 0.001 * k] * len(self.names))
            stamps.append(divmod(time.time_ns(), 1_000_000_000))
            message.header.stamp.sec, message.header.stamp.nanosec = stamps[-1]
            (publisher or self.publisher).publish(message)
            self.rest(0.02)
        return stamps

    def answers(self, number, publisher=None):
        """Return how many of the poses are those of the joint states sent, and how many others."""
        self.poses.clear()
        stamps = self.send(number, publisher)
        self.until(lambda: len(self.poses) >= number, QUIET)
        self.rest(0.5)
        right = len(set(stamps) & set(self.poses))
        return right, len(self.poses) - right

    def said(self, key):
        """Return a value of the last diagnostics."""
        values = self.diagnostics[-1].status[0].values if self.diagnostics else ()
        return next((pair.value for pair in values if pair.key == key), '')


def flooded(client, kind, publishers, seconds, meanwhile=lambda: None):
    """Flood the node, with a request every 0.3 s; return the futures of their answers."""
    command = [sys.executable, '-c', FAST, kind, *client.names]
    floods = [subprocess.Popen(command) for _ in range(publishers)]
    asked = []
    try:
        client.until(lambda: client.node.count_publishers('/joint_states') > publishers, 30.0)
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            asked.append(client.ask())
            client.rest(0.3)
            meanwhile()
    finally:
        # Not killed: one that dies inside the middleware's shared memory can stop those that share
        # it.
        for flood in floods:
            flood.terminate()
        for flood in floods:
            flood.wait()
    return asked
