"""
The topics of a node that answer every accepted message: who listens, and what goes out to them.

"""

import copy
from collections.abc import Callable
from typing import Any, NamedTuple

from rclpy.event_handler import PublisherEventCallbacks, UnsupportedEventTypeError
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos_overriding_options import QoSOverridingOptions

from .. import kernel
from ..estimator import Answer
from ..kernel import Floats
from ..singularities import singularity_of
from .messages import Report, transform_message
from .settings import Settings
from .sheet import Part, sheet_of
from .stamp_grid import StampGrid
from .topics import OUTPUT_QOS, TOPICS, Topic, sample_report
from .wire_template import Template

Sends = tuple[tuple[Callable[[bytes], None], Callable[[], bytes]], ...]


class Channel(NamedTuple):
    """
    A topic with its publisher, and its template where its messages go out as patched bytes.

    Attributes
    ----------
    listeners
        Returns how many listen.
    publish_bytes
        Publishes a serialized message.
    publisher, topic, template
        The template is None where messages are built.
    grid
        Thins out a topic that not every report goes to.

    """

    listeners: Callable[[], int]
    publish_bytes: Callable[[bytes], None]
    publisher: Publisher
    topic: Topic
    grid: StampGrid
    template: Template | None = None

    def send(self, report: Report) -> None:
        """
        Publish what a report has to say on this topic, if anything.

        """
        topic, template = self.topic, self.template
        if topic.period and not self.grid.passes(report.answer.stamp, topic.period):
            return
        if template is None:
            message = topic.build(report)
            if message is not None:
                self.publisher.publish(message)
            return
        assert topic.numbers is not None
        numbers = topic.numbers(report)
        if numbers is not None:
            self.publish_bytes(template.message(report.answer.stamp, numbers))


class Heard(NamedTuple):
    """
    The channels somebody listens to, and what the kernel must compute for them.

    Attributes
    ----------
    channels
        In the order they are published.
    depth
        What the kernel must have computed.
    numbers, parts
        The sheet that the kernel fills, and in it the message of each channel, or None.
    sends
        Where the sheet has them all: for an arm at unknown velocities, and for one at known ones,
        what publishes and what returns the bytes for that.

    """

    channels: tuple[Channel, ...]
    depth: int
    numbers: Floats
    parts: tuple[Part | None, ...]
    sends: tuple[Sends, Sends] | None


class Outputs:
    """
    Publishes reports to those who listen; a topic nobody listens to costs one look.

    Attributes
    ----------
    events_in_order
        Whether the executor handles events in the order they came in: then that somebody began to
        listen is known before the next joint state is, and need not be asked for every message.

    """

    def __init__(self, node: Node, settings: Settings, transport: str) -> None:
        self._node = node
        self._transport = transport
        self.events_in_order = False
        self._told_of_listeners = True
        self._settings = settings
        self._heard: Heard | None = None
        self.channels = [self._channel(topic) for topic in TOPICS]
        self._tf: Publisher | None = None
        self.configure(settings)

    def configure(self, settings: Settings) -> None:
        """
        Take other settings: frames and labels are part of the templates.

        """
        self._settings, self._heard = settings, None
        if self._transport == 'bytes':
            sample = sample_report(settings)
            self.channels = [
                channel._replace(template=_template(channel.topic, sample))
                for channel in self.channels
            ]
        if settings.publish_tf and self._tf is None:
            from tf2_msgs.msg import TFMessage  # not among the wheels: only where it is asked for

            self._tf = self._node.create_publisher(TFMessage, '/tf', OUTPUT_QOS)

    @property
    def names(self) -> list[str]:
        """
        Return the full names of the topics.

        """
        return [channel.publisher.topic_name for channel in self.channels]

    def heard(self) -> Heard:
        """
        Return the channels somebody listens to.

        """
        heard = self._heard
        if heard is None or not (self.events_in_order and self._told_of_listeners):
            channels = tuple(channel for channel in self.channels if channel.listeners() > 0)
            if heard is None or channels != heard.channels:
                heard = self._heard = self._heard_on(channels)
        return heard

    def _heard_on(self, channels: tuple[Channel, ...]) -> Heard:
        depth = max((channel.topic.depth for channel in channels), default=kernel.JACOBIAN)
        topics = [(channel.topic, channel.template) for channel in channels]
        parts, numbers = sheet_of(topics, self._settings, depth)
        pairs = list(zip(channels, parts))
        sends = None
        if not self._settings.publish_tf and None not in parts:
            at_rest, moving = (
                tuple(
                    (channel.publish_bytes, part.data.tobytes)
                    for channel, part in pairs
                    if part is not None and (moves or not part.of_motion)
                )
                for moves in (False, True)
            )
            sends = at_rest, moving
        return Heard(channels, depth, numbers, parts, sends)

    def publish(self, answer: Answer, heard: Heard, in_sheet: bool) -> None:
        """
        Publish an answer on channels, pose first, and on /tf where that is set.

        Parameters
        ----------
        answer
            The new state.
        heard
            The channels.
        in_sheet
            Whether the sheet has been filled with this answer's numbers.

        """
        if in_sheet and heard.sends is not None:
            for publish, data in heard.sends[answer.state.moving]:
                publish(data())
            return
        settings, report = self._settings, None
        for channel, part in zip(heard.channels, heard.parts):
            if in_sheet and part is not None:
                if answer.state.moving or not part.of_motion:
                    channel.publish_bytes(part.data.tobytes())
                continue
            if report is None:
                report = Report(answer, singularity_of(answer.state), settings)
            channel.send(report)
        if settings.publish_tf:
            self._publish_tf(Report(answer, singularity_of(answer.state), settings))

    def _channel(self, topic: Topic) -> Channel:
        def publisher_with(callbacks: PublisherEventCallbacks | None) -> Publisher:
            return self._node.create_publisher(
                topic.type,
                topic.name,
                # Overrides are written into the profile that is given: each topic needs its own.
                copy.copy(OUTPUT_QOS),
                event_callbacks=callbacks,
                qos_overriding_options=QoSOverridingOptions.with_default_policies(),
            )

        try:
            publisher = publisher_with(PublisherEventCallbacks(matched=self._on_listener))
        except UnsupportedEventTypeError:  # another middleware: ask at every message
            self._told_of_listeners = False
            publisher = publisher_with(None)
        # Of the handle, not of the publisher, which looks at each message's type once more.
        handle = publisher.handle
        return Channel(
            handle.get_subscription_count, handle.publish_raw, publisher, topic, StampGrid()
        )

    def ask_who_listens(self) -> None:
        """
        Look who listens at the next message: one may have come or gone.

        """
        self._heard = None

    def _on_listener(self, event: Any) -> None:
        self.ask_who_listens()

    def _publish_tf(self, report: Report) -> None:
        from tf2_msgs.msg import TFMessage

        assert self._tf is not None
        self._tf.publish(TFMessage(transforms=[transform_message(report)]))


def _template(topic: Topic, sample: Report) -> Template | None:
    numbers, make = topic.numbers and topic.numbers(sample), topic.make
    if numbers is None or make is None:
        return None
    return Template.learn(lambda stamp, values: make(stamp, values, sample.settings), len(numbers))
