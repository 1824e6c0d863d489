"""The node's diagnostics: once a second, its input and the outcome of each message."""

import time
from collections import Counter, deque
from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock
from rclpy.node import Node

from ...estimation.estimator import Estimator
from ...estimation.status_text import StatusText
from ..messages.messages import full_name, status_message
from ..messages.topics import DIAGNOSTICS, DIAGNOSTICS_QOS
from .best_subscription import BestSubscription
from .diagnostics import RECENT, InputState, Work, input_status

PERIOD = 1.0
# After a stall the timer makes up for its calls, some at once: a rate over a shorter time means
# nothing, so nothing is said.
SHORTEST = 0.5 * PERIOD


class Health:
    """
    Counts work and publishes the state of the input once a second.

    Attributes
    ----------
    work
        Processing times of messages since the last diagnostics.
    """

    def __init__(
        self,
        node: Node,
        estimator: Estimator,
        subscription: BestSubscription,
        frames: Callable[[], StatusText | None],
        velocity_source: Callable[[], str],
        steady: Clock,
    ) -> None:
        self.work = Work()
        self._node = node
        self._estimator = estimator
        self._subscription = subscription
        self._frames = frames
        self._velocity_source = velocity_source
        self._counts_said: Counter[str] = Counter()
        self._said = time.monotonic()
        # Times of diagnostics, s, and the number of messages lost by then.
        self._losses: deque[tuple[float, int]] = deque([(self._said, 0)])
        self._publisher = node.create_publisher(DiagnosticArray, DIAGNOSTICS, DIAGNOSTICS_QOS)
        node.create_timer(PERIOD, self.say, clock=steady)

    @property
    def topic_name(self) -> str:
        """Return the full name of the topic."""
        return str(self._publisher.topic_name)

    def _lost_of_late(self, now: float, lost: int) -> int:
        losses = self._losses
        losses.append((now, lost))
        while now - losses[0][0] > RECENT:
            losses.popleft()
        return lost - losses[0][1]

    def say(self) -> None:
        """Publish the state of the input since the last diagnostics, if anybody listens."""
        node, estimator, subscription = self._node, self._estimator, self._subscription
        now, arrival = time.monotonic(), time.monotonic_ns()
        if now - self._said < SHORTEST:
            return
        publishers = node.get_publishers_info_by_topic(subscription.topic_name)
        subscription.settle(publishers)
        lost = subscription.lost
        lost_of_late = self._lost_of_late(now, lost or 0)
        counts, work = Counter(estimator.counts), self.work
        interval, news = now - self._said, counts - self._counts_said
        self.work, self._counts_said, self._said = Work(), counts, now
        if not self._publisher.get_subscription_count():
            return
        state = InputState(
            counts=counts,
            news=news,
            interval=interval,
            age=estimator.age(arrival),
            missing=estimator.missing(arrival),
            beyond=estimator.beyond_limits(),
            disputed=estimator.disputed(arrival) if len(publishers) > 1 else (),
            publishers=sorted(
                f'{info.node_namespace.rstrip("/")}/{info.node_name}' for info in publishers
            ),
            velocity_source=self._velocity_source(),
            topic=subscription.topic_name,
            reliable=subscription.is_reliable,
            lost=lost,
            lost_of_late=lost_of_late,
            robot=estimator.robot.name,
            work=work,
        )
        message = DiagnosticArray()
        message.header.stamp = node.get_clock().now().to_msg()
        name = full_name(node)
        message.status = [status_message(f'{name}: input', input_status(state))]
        frames = self._frames()
        if frames is not None:
            message.status.append(status_message(f'{name}: frames', frames))
        self._publisher.publish(message)
