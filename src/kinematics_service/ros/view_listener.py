"""
What the live view hears: joint states, and what a node says of them.

The node's pose, frames, Jacobian, twist, distance and level are shown as it publishes them. What
it does not publish with every message (the time to the threshold, the lost direction, the joint
axes) comes from the same joint states by the same functions. Without a node everything does.
"""

import os
import time
from dataclasses import replace
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseArray, PoseStamped, TwistStamped
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray

from ..estimator import Answer, Estimator, EstimatorSettings
from ..kernel import Floats
from ..measures import Level
from ..rigid_motion import rotation_of_quaternion
from ..robot import Robot
from ..singularities import singularity_of
from ..view.observation import Observation, observation_of
from .heard import Heard
from .messages import sample_of, stamp_of, time_message
from .node_facts import NodeFacts, ask_node
from .readings import LayoutError, matrix_of, velocity_of, warned_of
from .spin import Spinner
from .topics import JOINT_STATES, JOINT_STATES_QOS, OUTPUT_QOS, WARNING, WARNING_QOS

# Older than this (s) nothing is shown as live.
FRESH = 1.0
# Where messages come faster than they can be taken, the page still moves (s).
LONGEST_CATCHING_UP = 0.2
# A node that is not there is asked for so often (s).
ASK_AGAIN = 2.0
# Only the last message of a topic is shown.
LAST_QOS = QoSProfile(depth=5, reliability=ReliabilityPolicy.RELIABLE)


class ViewListener:
    """
    A node that hears an arm for the view, and publishes its sliders when it is told to.

    Parameters
    ----------
    context
        Where the node lives; `close` leaves it open.
    source
        Full name of the kinematics node.

    """

    def __init__(self, context: Context, source: str) -> None:
        self.source = '/' + source.strip('/')
        self._node = Node(
            f'kinematics_view_{os.getpid()}',
            context=context,
            start_parameter_services=False,
            enable_rosout=False,
        )
        self._spinner = Spinner(context, [self._node])
        self._facts: NodeFacts | None = None
        self._asked = -ASK_AGAIN
        self._robot: Robot | None = None
        self._estimator: Estimator | None = None
        self._answer: Answer | None = None
        self._arrival = 0.0
        self._joint_states = 0
        self._publisher: Any = None
        self._subscription: Any = None
        self._mismatch = ''

        def hear(topic: str, kind: Any, qos: QoSProfile) -> Heard:
            return Heard(self._node, f'{self.source}/{topic}', kind, qos)

        self._pose = hear('pose', PoseStamped, LAST_QOS)
        self._jacobian = hear('jacobian', Float64MultiArray, LAST_QOS)
        self._frames = hear('link_frames', PoseArray, LAST_QOS)
        self._twist = hear('twist', TwistStamped, LAST_QOS)
        self._distance = hear('singularity/distance', Float64, LAST_QOS)
        self._warning = Heard(
            self._node, WARNING.replace('~', self.source), DiagnosticStatus, WARNING_QOS
        )
        self._outputs = (
            self._pose,
            self._jacobian,
            self._frames,
            self._twist,
            self._distance,
            self._warning,
        )

    def close(self) -> None:
        """
        Destroy the node.

        """
        self._spinner.close()
        self._node.destroy_node()

    def listen(self, seconds: float) -> None:
        """
        Hear what comes for so long, and longer where more has come already: old news is no news.

        """
        deadline = time.monotonic() + seconds
        while (left := deadline - time.monotonic()) > 0.0:
            self._spinner.spin_once(timeout_sec=left)
        while time.monotonic() < deadline + LONGEST_CATCHING_UP:
            before = self._heard_so_far
            self._spinner.spin_once(timeout_sec=0.0)
            if self._heard_so_far == before:
                return
        self._spinner.start_anew()

    @property
    def _heard_so_far(self) -> int:
        return self._joint_states + sum(heard.count for heard in self._outputs)

    def ask(self, patience: float) -> NodeFacts | None:
        """
        Return what the node says of itself, waiting so many seconds; None where there is none.

        """
        self._asked = time.monotonic()
        self._facts = ask_node(self._node, self._spinner, self.source, patience) or self._facts
        return self._facts

    def show(self, robot: Robot) -> None:
        """
        Hear the joint states of this arm from now on.

        """
        self._robot = robot
        self._subscribe()

    def _subscribe(self) -> None:
        robot, facts = self._robot, self._facts
        assert robot is not None
        namespace = self.source.rpartition('/')[0]
        topic, prefix = f'{namespace}/{JOINT_STATES}', ''
        if facts is not None:
            self._mismatch = facts.mismatch(robot)
            topic, prefix = facts.joint_states, facts.prefix(robot)
            robot = facts.judged(robot)
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
        self._estimator = Estimator(robot, EstimatorSettings(joint_prefix=prefix))
        self._names = [prefix + name for name in robot.joint_names]
        self._subscription = self._node.create_subscription(
            JointState, topic, self._take, JOINT_STATES_QOS
        )

    def _take(self, message: JointState) -> None:
        assert self._estimator is not None
        self._joint_states += 1
        received = stamp_of(message) or self._node.get_clock().now().nanoseconds
        sample = sample_of(message, received, time.monotonic_ns())
        try:
            answer = self._estimator.take(sample)
        except Exception as error:  # nothing a robot sends may end the view
            self._node.get_logger().error(f'joint state: {error!a}')
            return
        if isinstance(answer, Answer):
            self._answer, self._arrival = answer, time.monotonic()

    @property
    def other_robot(self) -> str:
        """
        Return the robot of the node where it is not the one that is shown; otherwise empty.

        """
        return self._facts.robot if self._mismatch and self._facts is not None else ''

    @property
    def _live(self) -> bool:
        return self._answer is not None and time.monotonic() - self._arrival < FRESH

    @property
    def _node_live(self) -> bool:
        return not self._mismatch and self._pose.count > 0 and self._pose.age < FRESH

    @property
    def status(self) -> str:
        """
        Return in a line where the picture comes from.

        """
        if self._mismatch:
            return self._mismatch
        topic = JOINT_STATES if self._subscription is None else self._subscription.topic_name
        if not self._live:
            return f'sliders: nothing comes on {topic}'
        if not self._node_live:
            return f'live from {topic}; no node {self.source} answers'
        return f'live from {self.source}, {self._pose.rate():.0f} Hz'

    def observation(self) -> Observation | None:
        """
        Return the newest observation; None while no joint states come.

        """
        if self._facts is None and time.monotonic() - self._asked > ASK_AGAIN:
            if self._warning.count > 0 and self.ask(0.5) is not None:
                self._subscribe()
            self._asked = time.monotonic()
        if not self._live or self._mismatch:
            return None
        assert self._answer is not None
        state = self._answer.state
        seen = observation_of(state, singularity_of(state))
        return self._as_the_node_says(seen) if self._node_live else seen

    def _as_the_node_says(self, seen: Observation) -> Observation:
        values: dict[str, Any] = {}
        axes = self._facts.axes if self._facts is not None else ('base', 'base')
        pose = _matrix(self._pose.message.pose)
        values['pose'] = pose
        if self._frames.age < FRESH and self._frames.count:
            frames = np.array([_matrix(one) for one in self._frames.message.poses])
            if frames.shape == seen.frames.shape:
                values['frames'] = frames
        if self._jacobian.age < FRESH and self._jacobian.count:
            J = _six_rows(self._jacobian.message)
            if J is not None and J.shape == seen.jacobian.shape:
                values['jacobian'] = _to_base(J, pose) if axes[0] == 'tool' else J
        if self._twist.age < FRESH and self._twist.count:
            heard = velocity_of(self._twist.message)
            twist = np.concatenate([heard.linear, heard.angular])
            values['twist'] = _to_base(twist[:, None], pose)[:, 0] if axes[1] == 'tool' else twist
        if self._distance.age < FRESH and self._distance.count:
            distance = float(self._distance.message.data)
            values['singularity'] = replace(seen.singularity, distance=distance)
        if self._warning.count:
            level = warned_of(self._warning.message).level
            if level in Level.__members__ and level != Level.STALE.name:
                values['level'] = Level[level]
        return replace(seen, **values)

    def publish(self, q: Floats) -> str:
        """
        Publish joint positions; return why not where somebody else does already.

        """
        assert self._subscription is not None
        topic = self._subscription.topic_name
        if self._publisher is None or self._publisher.topic_name != topic:
            if self._publisher is not None:
                self._node.destroy_publisher(self._publisher)
            self._publisher = self._node.create_publisher(JointState, topic, OUTPUT_QOS)
        if self._node.count_publishers(topic) > 1:
            return f'another publisher speaks on {topic}'
        message = JointState(name=self._names, position=q.tolist())
        message.header.stamp = time_message(self._node.get_clock().now().nanoseconds)
        self._publisher.publish(message)
        return ''


def _matrix(pose: Any) -> Floats:
    p, o = pose.position, pose.orientation
    T = np.eye(4)
    T[:3, :3] = rotation_of_quaternion((o.x, o.y, o.z, o.w))
    T[:3, 3] = p.x, p.y, p.z
    return T


def _six_rows(message: Any) -> Floats | None:
    # Linear rows first, whatever the order is.
    try:
        matrix = matrix_of(message)
    except LayoutError:
        return None
    order = {name: k for k, name in enumerate(matrix.rows)}
    wanted = ('vx', 'vy', 'vz', 'wx', 'wy', 'wz')
    if set(order) != set(wanted):
        return None
    return matrix.values[[order[name] for name in wanted]]


def _to_base(six_rows: Floats, pose: Floats) -> Floats:
    R = pose[:3, :3]
    return np.concatenate([R @ six_rows[:3], R @ six_rows[3:]])
