"""
The topics of a node that answer every accepted message: subscribers, and the messages for them.
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
from .messages.content import SILENT, Built, Content, Copied, WithCovariance, flat
from .messages.message_layout import MessageLayout
from .messages.messages import StateReport, transform_message
from .messages.output_topics import OutputTopic, topics_of
from .messages.topics import OUTPUT_QOS, overridable
from .parameters.settings import NodeSettings
from .point_states import PointStates
from .stamp_grid import StampGrid


class Channel(NamedTuple):
    """
    A topic with its publisher, and the sources of its messages.

    Attributes
    ----------
    listeners
        Returns the number of subscribers.
    publish_bytes
        Publishes a serialized message.
    publisher, topic
        The publisher, and the row of the topic.
    grid
        Thins out a topic that not every report goes to.
    content, layout
        The content of its messages and its place; no layout if messages are built as a whole.
    as_bytes
        Whether its messages go out as bytes that are filled here.
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
        """Publish a report's message on this topic, if it has one."""
        content, layout, stamp = self.content, self.layout, report.answer.stamp
        if isinstance(content, Built):
            if self.grid.passes(stamp, content.period):
                self.publisher.publish(content.message(report))
            return
        numbers = content.of(report)
        if numbers is None or layout is None:
            return
        if self.as_bytes:
            self.publish_bytes(layout.bytes_of(stamp, flat(numbers)))
        else:
            self.publisher.publish(layout.message(stamp, flat(numbers)))


class ActiveTopics(NamedTuple):
    """
    The channels with subscribers, and what the kernel must compute for them.

    Attributes
    ----------
    channels
        In the order they are published.
    depth
        What the kernel must have computed.
    messages
        The messages that the kernel fills; None for none.
    filled
        For each channel its message among them, or None.
    quantities
        The kinds of quantities that every answer needs besides.
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
    Return the messages whose numbers the kernel copies, and for each channel its own, or None.
    """
    row, measures = (
        settings.robot.chain.single_widths[depth],
        settings.robot.singularity.measure_places.width,
    )
    data, filled = bytearray(), list[slice | None]()
    stamps, targets, sources = [], [], []
    uncertain = []
    for channel in channels:
        layout, content = channel.layout, channel.content
        by_the_kernel = not channel.topic.of and channel.as_bytes
        if not (by_the_kernel and layout and isinstance(content, (Copied, WithCovariance))):
            filled.append(None)
            continue
        begin = len(data)
        data += layout.data
        filled.append(slice(begin, len(data)))
        of_stamp, of_numbers = layout.offsets(begin)
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
    of_twist = any(one.of_motion for one in uncertain)
    of_pose = not all(one.of_motion for one in uncertain)
    return OutgoingMessages(table, errors, of_pose, of_twist), views


class Outputs:
    """
    Publishes reports to subscribers; a topic without subscribers costs one look.

    Attributes
    ----------
    events_in_order
        Whether the executor handles events in the order of their arrival: then a new subscriber is
        known before the next joint state, and the node need not ask at every message.
    """

    def __init__(self, node: Node, settings: NodeSettings, transport: str) -> None:
        self._node = node
        self._transport = transport
        self.events_in_order = False
        self._told_of_listeners = True
        # Topics whose layout differs from that of ROS's serializer.
        self._told_of: set[str] = set()
        self._settings = settings
        self._active: ActiveTopics | None = None
        self._points = PointStates()
        self.channels: list[Channel] = []
        self._tf: Publisher | None = None
        self.configure(settings)

    def configure(self, settings: NodeSettings) -> None:
        """Apply other settings: frames and labels are part of the messages."""
        self._settings, self._active = settings, None
        self._official: dict[tuple[Any, bytes], bool] = {}
        self.channels = [self._configured(channel) for channel in self._offered(settings)]
        if settings.publish_tf and self._tf is None:
            # The wheels lack it: imported only if it is asked for.
            from tf2_msgs.msg import TFMessage

            self._tf = self._node.create_publisher(TFMessage, '/tf', OUTPUT_QOS)

    @property
    def names(self) -> list[str]:
        """Return the full names of the topics."""
        return [channel.publisher.topic_name for channel in self.channels]

    def active(self) -> ActiveTopics:
        """Return the channels with subscribers."""
        active = self._active
        if active is None or not (self.events_in_order and self._told_of_listeners):
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
        Publish an answer on channels, pose first, and on /tf if that is set.

        Parameters
        ----------
        answer
            The new state.
        active
            The channels.
        is_filled
            Whether the kernel has filled the messages with this answer.
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
        if self._settings.publish_tf:
            self._publish_tf(reports.get('') or self._report('', answer))

    def _report(self, of: str, answer: EstimatorOutput) -> StateReport:
        settings = self._settings
        if of:
            settings = settings.points[of]
            answer = self._points.answer(of, settings.robot, answer)
        else:
            answer = answer._replace(state=measured(answer.state))
        return StateReport(answer, settings)

    def _configured(self, channel: Channel) -> Channel:
        # Adds the layout for the settings in force, which is checked if messages go out as bytes.
        topic = channel.topic
        settings = self._settings.points[topic.of] if topic.of else self._settings
        content = topic.content(settings) or SILENT
        if isinstance(content, Built):
            return channel._replace(content=content)
        layout = MessageLayout(topic.blank(settings))
        if channel.layout is not None and channel.layout.data == layout.data:
            return channel._replace(content=content)  # it has been checked
        as_bytes = self._transport == 'bytes'
        if as_bytes and not self._is_official(topic.type, layout):
            as_bytes = False
            if topic.name not in self._told_of:
                self._told_of.add(topic.name)
                self._node.get_logger().warning(
                    f'{channel.publisher.topic_name}: the serializer of ROS writes other bytes '
                    'than expected; messages are serialized one by one, which is slower'
                )
        return channel._replace(content=content, layout=layout, as_bytes=as_bytes)

    def _is_official(self, kind: Any, layout: MessageLayout) -> bool:
        form = kind, layout.data  # all scalars have the same
        if form not in self._official:
            self._official[form] = layout.is_official()
        return self._official[form]

    def _offered(self, settings: NodeSettings) -> list[Channel]:
        # Another robot file may offer other topics; publishers of those that stay are kept.
        known = {channel.topic.name: channel for channel in self.channels}
        topics = topics_of(settings)
        for name in known.keys() - {topic.name for topic in topics}:
            self._node.destroy_publisher(known[name].publisher)
        return [known.get(topic.name) or self._channel(topic) for topic in topics]

    def _channel(self, topic: OutputTopic) -> Channel:
        def publisher_with(callbacks: PublisherEventCallbacks | None) -> Publisher:
            return self._node.create_publisher(
                topic.type, topic.name, event_callbacks=callbacks, **overridable(OUTPUT_QOS)
            )

        try:
            publisher = publisher_with(PublisherEventCallbacks(matched=self._on_listener))
        except UnsupportedEventTypeError:  # another middleware: ask at every message
            self._told_of_listeners = False
            publisher = publisher_with(None)
        # The method of the handle: that of the publisher checks each message's type once more.
        handle = publisher.handle
        return Channel(
            handle.get_subscription_count, handle.publish_raw, publisher, topic, StampGrid()
        )

    def ask_who_listens(self) -> None:
        """Count subscribers at the next message: one may have come or gone."""
        self._active = None

    def _on_listener(self, event: Any) -> None:
        self.ask_who_listens()

    def _publish_tf(self, report: StateReport) -> None:
        assert self._tf is not None
        self._tf.publish(self._tf.msg_type(transforms=[transform_message(report)]))
