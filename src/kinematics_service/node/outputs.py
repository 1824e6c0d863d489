# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Publish the results for every accepted joint state on the node's topics that have subscribers. Find
what must be computed for the messages.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from rclpy.event_handler import PublisherEventCallbacks, UnsupportedEventTypeError
from rclpy.node import Node
from rclpy.publisher import Publisher

from .. import kernel
from ..estimation.estimator import EstimatorOutput, StreamQuantity
from ..kernel import OutgoingMessages, OutgoingTable
from ..kinematics.singularity import measured
from .messages.content import SILENT, Built, Content, Copied, WithCovariance
from .messages.message_layout import MessageLayout
from .messages.messages import StateReport, transform_message
from .messages.output_topics import OutputTopic, topics_of
from .messages.topics import OUTPUT_QOS, overridable
from .parameters.settings import NodeSettings
from .point_states import PointStates
from .stamp_grid import StampGrid


class Channel(NamedTuple):
    """
    A topic with its publisher, and the data from which its messages are made.

    Attributes
    ----------
    listeners
        A function that returns the number of subscribers.
    publish_bytes
        A function that publishes a serialized message.
    publisher
        The publisher of the topic.
    topic
        The row of the topic in the table of topics.
    grid
        Divides time into intervals of equal length. If `content` has a period, the length is this
        period, and at most one message is published in each interval.
    content
        The content of the topic's messages.
    layout
        The positions of the stamp and the numbers in a message. None if `content` is a whole
        message.
    as_bytes
        Whether this package writes the bytes of a message itself, instead of ROS.
    """

    listeners: Callable[[], int]
    publish_bytes: Callable[[bytes], None]
    publisher: Publisher
    topic: OutputTopic
    grid: StampGrid
    content: Content = SILENT
    layout: MessageLayout | None = None
    as_bytes: bool = False

    def send(self, report: StateReport) -> None:
        """
        Publish the message for a state report, unless the report lacks the numbers of this topic.
        """
        content, layout, stamp = self.content, self.layout, report.answer.stamp
        if isinstance(content, Built):
            if self.grid.passes(stamp, content.period):
                self.publisher.publish(content.message(report))
            return
        numbers = content.of(report)
        if numbers is None or layout is None:
            return
        flat = np.asarray(numbers, dtype=np.float64).ravel()
        if self.as_bytes:
            self.publish_bytes(layout.bytes_of(stamp, flat))
        else:
            self.publisher.publish(layout.message(stamp, flat))


class ActiveTopics(NamedTuple):
    """
    The channels (topics) that have subscribers, and what must be computed for their messages.

    Attributes
    ----------
    channels
        The channels in the order of publication.
    depth
        `kernel.JACOBIAN`, or `kernel.ALL_FRAMES` if a channel needs the link frames.
    messages
        The messages that the kernel itself fills with numbers; None if it fills none.
    filled
        For each channel, its message among `messages`; None if the kernel does not fill it.
    quantities
        Classes of the quantities, such as accelerations, that the messages need besides the state.
    """

    channels: tuple[Channel, ...]
    depth: int
    messages: OutgoingMessages | None
    filled: tuple[memoryview | None, ...]
    quantities: tuple[type[StreamQuantity], ...]


def filled_by_the_kernel(
    channels: Sequence[Channel], settings: NodeSettings, depth: int
) -> tuple[OutgoingMessages | None, tuple[memoryview | None, ...]]:
    """
    Return the messages that the kernel fills with numbers, and for each channel its message among
    them, or None.
    """
    row = settings.robot.chain.single_widths[depth]
    measures = settings.robot.singularity.measure_places.width
    data, filled, uncertain = bytearray(), list[slice | None](), list[WithCovariance]()
    stamps, targets, sources = [], [], []
    for channel in channels:
        layout, content = channel.layout, channel.content
        by_the_kernel = not channel.topic.of and channel.as_bytes
        if not (by_the_kernel and layout and isinstance(content, (Copied, WithCovariance))):
            filled.append(None)
            continue
        filled.append(slice(len(data), len(data) + len(layout.data)))
        of_stamp, of_numbers = layout.offsets(len(data))
        data += layout.data
        stamps.append(of_stamp)
        targets.append(of_numbers)
        sources.append(content.sources(row, measures))
        if isinstance(content, WithCovariance):
            uncertain.append(content)
    if not data:
        return None, (None,) * len(filled)
    table = OutgoingTable(
        np.frombuffer(data, np.uint8), *map(np.concatenate, (stamps, targets, sources))
    )
    views = tuple(None if place is None else table.data[place].data for place in filled)
    errors = uncertain[0].errors if uncertain else None
    of_twist = any(content.of_motion for content in uncertain)
    of_pose = not all(content.of_motion for content in uncertain)
    return OutgoingMessages(table, errors, of_pose, of_twist), views


class Outputs:
    """
    Publishes the results for each joint state on all topics with subscribers; for other topics it
    computes nothing.

    Attributes
    ----------
    events_in_order
        Whether the executor handles events in the order of their arrival. If so, a new subscriber
        is noted before the next joint state, so subscribers are not counted at every message.
    """

    def __init__(self, node: Node, settings: NodeSettings, transport: str) -> None:
        self._node = node
        self._transport = transport
        self.events_in_order = False
        self._has_matched_events = True
        self._active: ActiveTopics | None = None
        self._points = PointStates()
        self.channels: list[Channel] = []
        self._tf: Publisher | None = None
        self.configure(settings)

    def configure(self, settings: NodeSettings) -> None:
        """Apply new settings, which change the names of frames and the labels in messages."""
        self._settings, self._active = settings, None
        self.channels = [self._configured(channel) for channel in self._offered(settings)]
        if settings.values['publish_tf'] and self._tf is None:
            # Import the type only if needed. ROS from Python wheels (pip) does not have tf2_msgs.
            from tf2_msgs.msg import TFMessage

            self._tf = self._node.create_publisher(TFMessage, '/tf', OUTPUT_QOS)

    @property
    def names(self) -> list[str]:
        """Return the full names of the topics."""
        return [channel.publisher.topic_name for channel in self.channels]

    def active(self) -> ActiveTopics:
        """Return the topics with subscribers, and what must be computed for their messages."""
        active = self._active
        if active is None or not (self.events_in_order and self._has_matched_events):
            channels = tuple(channel for channel in self.channels if channel.listeners() > 0)
            if active is None or channels != active.channels:
                active = self._active = self._subscribed(channels)
        return active

    def _subscribed(self, channels: tuple[Channel, ...]) -> ActiveTopics:
        contents = [channel.content for channel in channels]
        depth = max((content.depth for content in contents), default=kernel.JACOBIAN)
        messages, filled = filled_by_the_kernel(channels, self._settings, depth)
        quantities = dict.fromkeys(kind for content in contents for kind in content.quantities)
        return ActiveTopics(channels, depth, messages, filled, tuple(quantities))

    def publish(self, answer: EstimatorOutput, active: ActiveTopics, is_filled: bool) -> None:
        """
        Publish the results for a joint state on the active topics, pose first, and on /tf if
        `publish_tf` is set.

        Parameters
        ----------
        answer
            The arm's new state, and the quantities that `active` lists.
        active
        The channels (topics) with subscribers, as the method `active` returned them.
        is_filled
            Whether the kernel has filled `active.messages` with these results.
        """
        reports: dict[str, StateReport] = {}
        moving = answer.state.moving
        for channel, message in zip(active.channels, active.filled):
            if is_filled and message is not None:
                if moving or not channel.content.of_motion:
                    channel.publish_bytes(message.tobytes())
                continue
            of = channel.topic.of
            if of not in reports:
                reports[of] = self._report(of, answer)
            channel.send(reports[of])
        if self._tf is not None and self._settings.values['publish_tf']:
            transform = transform_message(reports.get('') or self._report('', answer))
            self._tf.publish(self._tf.msg_type(transforms=[transform]))

    def _report(self, of: str, answer: EstimatorOutput) -> StateReport:
        settings = self._settings
        if of:
            settings = settings.points[of]
            answer = self._points.answer(of, settings.robot, answer)
        else:
            answer = answer._replace(state=measured(answer.state))
        return StateReport(answer, settings)

    def _configured(self, channel: Channel) -> Channel:
        # Return the channel with content and message layout renewed for the present settings.
        # Before messages are published as bytes, their layout is checked against ROS's serializer.
        topic = channel.topic
        settings = self._settings.points[topic.of] if topic.of else self._settings
        content = topic.content(settings) or SILENT
        if isinstance(content, Built):
            return channel._replace(content=content)
        layout = MessageLayout(topic.blank(settings))
        if channel.layout is not None and channel.layout.data == layout.data:
            # Keep the old layout: its bytes are equal to those of the new layout, and the
            # serializer was already checked with it.
            return channel._replace(content=content)
        as_bytes = self._transport == 'bytes' and layout.is_official()
        if self._transport == 'bytes' and not as_bytes and channel.layout is None:
            self._node.get_logger().warning(
                f'{channel.publisher.topic_name}: the serializer of ROS writes other bytes than '
                'expected; messages are serialized one by one, which is slower'
            )
        return channel._replace(content=content, layout=layout, as_bytes=as_bytes)

    def _offered(self, settings: NodeSettings) -> list[Channel]:
        # Return the channels for the settings. Another robot file may have other topics:
        # publishers of topics that it lacks are destroyed, the others are kept.
        present = {channel.topic.name: channel for channel in self.channels}
        topics = topics_of(settings)
        for name in present.keys() - {topic.name for topic in topics}:
            self._node.destroy_publisher(present[name].publisher)
        return [present.get(topic.name) or self._channel(topic) for topic in topics]

    def _channel(self, topic: OutputTopic) -> Channel:
        def publisher_with(callbacks: PublisherEventCallbacks | None) -> Publisher:
            return self._node.create_publisher(
                topic.type, topic.name, event_callbacks=callbacks, **overridable(OUTPUT_QOS)
            )

        try:
            publisher = publisher_with(PublisherEventCallbacks(matched=self._on_listener))
        # This middleware has no events of new subscribers, so count the subscribers at every
        # message.
        except UnsupportedEventTypeError:
            self._has_matched_events = False
            publisher = publisher_with(None)
        # Use the methods of the publisher's handle, because the publisher's own methods check the
        # type of each message again.
        handle = publisher.handle
        return Channel(
            handle.get_subscription_count, handle.publish_raw, publisher, topic, StampGrid()
        )

    def _on_listener(self, event: Any) -> None:
        # Set `_active` to None, so that the subscribers are counted again before the next message
        # is published.
        self._active = None
