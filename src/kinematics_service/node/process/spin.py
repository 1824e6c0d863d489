# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Run the executor of the nodes until a stop is requested.

For each message, `EventsExecutor` takes a fifth of the processor time of the default executor. But
its queue of events has no bound. The executor checks for a time-out, or for a request to stop,
only when the queue is empty. If rclpy comes from a Python wheel (pip), `EventsExecutor.spin()`
also keeps a processor core busy and ignores signals.
"""

import threading
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future

from ...stop_signals import StopSignal
from ..steady_time import steady_timer
from .passed_over import PassedOver

# Longest wait (s) for an event. After this time the spinner checks whether to stop, then waits
# again. `Spinner.interrupt` ends the wait at once.
STOP_CHECK_PERIOD = 0.1
# Longest duration (s) of a self-test. If the events executor fires no timer within this time, the
# default executor is used.
SELF_TEST_TIMEOUT = 1.0
# After this number of successive exceptions from the executor, the spinner assumes that the
# executor is broken, not that a message was bad, and stops.
MAX_FAILURES = 100
# Messages are skipped if an event's wait in the executor's queue is above this, s. A subscription
# keeps the messages of one second, so a process that stalled for a moment catches up without a
# loss.
MAX_QUEUE_DELAY = 2.5
# Messages are skipped if the events in the executor's queue take a processor time above this, s.
# The messages of one second at 1 kHz take less than half of this time.
MAX_QUEUE_PROCESSOR_TIME = 0.25


class _Mark(NamedTuple):
    # A task in the queue of the executor, by which the delay of the queue is measured. When the
    # task was appended, `put` was the time, s, and `worked` the processor time of the executor's
    # thread, s.
    task: Any
    put: float
    worked: float


class Spinner:
    """
    Runs the executor of some nodes. The executor can be stopped under any load, and its queue is
    bounded if `watch` is called periodically.

    Every event in the queue is handled. If messages arrive too fast, old messages are thrown away,
    and only their events are handled. The spinner never replaces the executor by a new one,
    because all events in the queue of the old executor would be lost. A service request without
    its event would stay in the middleware until the event of the next request. After that, every
    answer would be one call late.

    Parameters
    ----------
    context
        The context of the nodes.
    nodes
        The nodes to spin; errors are logged by the first node.
    left_out
        A function that is called after messages were skipped because they arrived too fast, with
        the number of messages that were thrown away.

    Attributes
    ----------
    in_order
        Whether events are handled in the order of their arrival.
    """

    def __init__(
        self,
        context: Context,
        nodes: Sequence[Node],
        left_out: Callable[[int], None] = lambda count: None,
    ) -> None:
        self._context, self._nodes, self._left_out = context, list(nodes), left_out
        self._logger = nodes[0].get_logger()
        self._executor, self.in_order = _executor_for(nodes[0], context)
        for node in nodes[1:]:
            self._executor.add_node(node)
        self._mark: _Mark | None = None
        self._passed_over: PassedOver | None = None
        self._over: Future = Future()
        self._thread = threading.get_ident()

    def spin(self, stopped: Callable[[], bool], turn: float = STOP_CHECK_PERIOD) -> bool:
        """
        Handle events until `stopped()` returns True; return False if the executor fails.

        Parameters
        ----------
        stopped
            A function that returns whether to stop; it is called again after an interrupt.
        turn
            Longest time, s, between two calls of `stopped`, unless the executor's queue of events
            never becomes empty.
        """
        failures = 0
        self._thread = threading.get_ident()
        while True:
            # A turn is one call of the executor. `interrupt` ends a turn by the future `_over`.
            # Renew this future before the call of `stopped`: if an interrupt comes after `stopped`
            # has returned False, it ends the next turn.
            self._over = Future()
            if stopped():
                return True
            try:
                self._turn(turn)
                failures = 0
            except ExternalShutdownException:
                return True
            except Exception as error:  # no message may end the node
                failures += 1
                if failures in (1, MAX_FAILURES):
                    self._logger.error(f'executor: {error!a}')
                if failures >= MAX_FAILURES:
                    return False

    def spin_once(self, timeout_sec: float) -> None:
        """Handle one event, after a wait of at most `timeout_sec` (s) for an event."""
        self._executor.spin_once(timeout_sec=timeout_sec)

    def interrupt(self) -> None:
        """End the present turn of `spin` after the running callback; any thread may call this."""
        if not self._over.done():
            self._over.set_result(None)

    def obey(self, stop: StopSignal) -> None:
        """
        Register with a stop signal, so that the signal ends the running call of the executor.

        Until the signal arrives, `watch` is called periodically.
        """
        stop.then, stop.meanwhile = self.interrupt, self.watch

    def watch(self) -> None:
        """
        Skip messages that wait for too long; a thread that does not run the executor calls this
        method.
        """
        if not self.in_order or self._passed_over is not None:
            return
        mark, now = self._mark, time.monotonic()
        worked = time.clock_gettime(time.pthread_getcpuclockid(self._thread))
        if mark is None or mark.task.done():
            self._mark = _Mark(self._executor.create_task(lambda: None), now, worked)
        elif now - mark.put > MAX_QUEUE_DELAY or worked - mark.worked > MAX_QUEUE_PROCESSOR_TIME:
            self._pass_over()

    def catch_up(self, longest: float) -> None:
        """
        Throw away old messages in the queue of the executor. Take at most `longest` (s).

        Only the thread of the executor may call this method.
        """
        if not self.in_order:
            return  # the default executor has no queue
        self._pass_over()
        end = time.monotonic() + longest
        while self._passed_over is not None and time.monotonic() < end:
            self._executor.spin_once(timeout_sec=STOP_CHECK_PERIOD)

    def _pass_over(self) -> None:
        if self._passed_over is None:
            self._passed_over = PassedOver(self._executor, self._nodes, self._has_caught_up)

    def _has_caught_up(self, left_out: int) -> None:
        self._passed_over = self._mark = None
        self._left_out(left_out)

    def close(self) -> None:
        """Remove the nodes from the executor, and shut it down."""
        for node in self._nodes:
            self._executor.remove_node(node)
        self._executor.shutdown()

    def _turn(self, longest: float) -> None:
        if not self.in_order:
            self._executor.spin_once(timeout_sec=min(longest, STOP_CHECK_PERIOD))
            return
        # Handle many events in one turn, because a return to Python after each event costs a
        # seventh more processor time per message.
        self._executor.spin_until_future_complete(self._over, timeout_sec=longest)


def _executor_for(node: Node, context: Context) -> tuple[Any, bool]:
    # Return an executor, and whether it is the events executor. The events executor is used only
    # if it passes a self-test.
    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:
        pass
    else:
        executor: Any = EventsExecutor(context=context)
        executor.add_node(node)
        if _fires_a_timer(executor, node):
            return executor, True
        executor.remove_node(node)
        executor.shutdown()
        node.get_logger().warning(
            'EventsExecutor fires no timer here; using SingleThreadedExecutor'
        )
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    return executor, False


def _fires_a_timer(executor: Any, node: Node) -> bool:
    fired = Future()
    timer = steady_timer(node, 0.001, lambda: fired.set_result(None))
    executor.spin_until_future_complete(fired, timeout_sec=SELF_TEST_TIMEOUT)
    node.destroy_timer(timer)
    return bool(fired.done())
