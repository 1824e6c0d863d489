"""
The topics of a node that answer every accepted message: who listens, and what goes out to them.

"""

import copy
from collections.abc import Callable
from typing import NamedTuple

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos_overriding_options import QoSOverridingOptions

from .. import kernel
from .messages import Report, transform_message
from .settings import Settings
from .stamp_grid import StampGrid
from .topics import OUTPUT_QOS, TOPICS, Topic, sample_report
from .wire_template import Template


class Channel(NamedTuple):
    """
    A topic with its publisher, and its template where its messages go out as patched bytes.

    Attributes
    ----------
    listeners
        Returns how many listen.
    publisher, topic, template
        The template is None where messages are built.
    grid
        Thins out a topic that not every report goes to.

    """

    listeners: Callable[[], int]
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
            self.publisher.publish(template.message(report.answer.stamp, numbers))


class Outputs:
    """
    Publishes reports to those who listen; a topic nobody listens to costs one look.

    """

    def __init__(self, node: Node, settings: Settings, transport: str) -> None:
        self._node = node
        self._transport = transport
        self.channels = [_channel(node, topic) for topic in TOPICS]
        self._tf: Publisher | None = None
        self.configure(settings)

    def configure(self, settings: Settings) -> None:
        """
        Take other settings: frames and labels are part of the templates.

        """
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

    def heard(self) -> list[Channel]:
        """
        Return the channels somebody listens to.

        """
        return [channel for channel in self.channels if channel.listeners() > 0]

    def publish(self, report: Report, heard: list[Channel]) -> None:
        """
        Publish a report on channels, pose first, and on /tf where that is set.

        """
        for channel in heard:
            channel.send(report)
        if report.settings.publish_tf:
            self._publish_tf(report)

    def _publish_tf(self, report: Report) -> None:
        from tf2_msgs.msg import TFMessage

        assert self._tf is not None
        self._tf.publish(TFMessage(transforms=[transform_message(report)]))


def _channel(node: Node, topic: Topic) -> Channel:
    publisher = node.create_publisher(
        topic.type,
        topic.name,
        # Overrides are written into the profile that is given: each topic needs its own.
        copy.copy(OUTPUT_QOS),
        qos_overriding_options=QoSOverridingOptions.with_default_policies(),
    )
    # Of the handle, not of the publisher: asked for every topic at every message.
    return Channel(publisher.handle.get_subscription_count, publisher, topic, StampGrid())


def _template(topic: Topic, sample: Report) -> Template | None:
    numbers, make = topic.numbers and topic.numbers(sample), topic.make
    if numbers is None or make is None:
        return None
    return Template.learn(lambda stamp, values: make(stamp, values, sample.settings), len(numbers))


def depth_of(heard: list[Channel]) -> int:
    """
    Return what the kernel must compute for channels.

    """
    return max((channel.topic.depth for channel in heard), default=kernel.JACOBIAN)
