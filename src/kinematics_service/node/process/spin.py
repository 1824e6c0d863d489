"""
The executor and the loop that turns it until it is told to stop.

`EventsExecutor` takes a fifth of the CPU of the default executor per message, but its queue of
events has no bound, it looks at neither a timeout nor a stop before that queue is empty, and in
the wheels its `spin()` burns a core and ignores signals.
"""

import threading
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from rclpy.clock import Clock, ClockType
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future

from ...stop_signals import StopSignal
from .passed_over import PassedOver

# Period of the check for the end while no event comes, where nothing interrupts the wait (s).
TURN = 0.1
# The events executor must fire a timer within this (s), or the default one is used.
SELF_TEST = 1.0
# Number of failures in a row from which on the executor is broken, and not a message.
FAILURES = 100
# Messages are given up when they have waited in the queue for longer than this (s): longer than
# the second of messages that a subscription keeps, so that a process starved for a moment catches
# up and loses none.
BACKLOG = 2.5
# They are also given up when working the queue off takes more of the processor than this (s): a
# second of messages at 1 kHz takes less than half of it.
WORK = 0.25


class _Mark(NamedTuple):
    # A task at the former end of the executor's queue, the time when it was put there, and the
    # processor time of the executor's thread by then (s).
    task: Any
    put: float
    worked: float


class Spinner:
    """
    Turns the executor of some nodes; under any load it can be stopped, and its queue is bounded as
    long as `watch` is called.

    The queue is always worked off, and only messages are left out of it. If an executor is thrown
    away with its queue, a request stays in the middleware until the event of the next one takes
    it, and so each later answer is one call late.

    Parameters
    ----------
    context
        The context of the nodes.
    nodes
        The nodes to spin; the first one's logger is used.
    left_out
        Called when messages were given up because they came faster than they could be handled,
        with the number of those that had been kept, and were thrown away unanswered.

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

    def spin(self, stopped: Callable[[], bool], turn: float = TURN) -> bool:
        """
        Handle events until `stopped()`; return False if the executor broke down.

        Parameters
        ----------
        stopped
            Whether to stop; asked again after an interrupt.
        turn
            Longest time between two such questions while the queue becomes empty, s.
        """
        failures = 0
        self._thread = threading.get_ident()
        while True:
            # An interrupt that comes after the question ends the turn that begins then.
            self._over = Future()
            if stopped():
                return True
            try:
                self._turn(turn)
                failures = 0
            except ExternalShutdownException:
                return True
            except Exception as error:  # a message that fails must not end the node
                failures += 1
                if failures in (1, FAILURES):
                    self._logger.error(f'executor: {error!a}')
                if failures >= FAILURES:
                    return False

    def spin_once(self, timeout_sec: float) -> None:
        """Handle one event, or wait for it at most this long."""
        self._executor.spin_once(timeout_sec=timeout_sec)

    def interrupt(self) -> None:
        """End the present turn after the callback that is running; from any thread."""
        if not self._over.done():
            self._over.set_result(None)

    def obey(self, stop: StopSignal) -> None:
        """Let a signal end the present turn, and the queue be watched until one comes."""
        stop.then, stop.meanwhile = self.interrupt, self.watch

    def watch(self) -> None:
        """Have the messages given up that wait for too long; from another thread."""
        if not self.in_order or self._passed_over is not None:
            return
        mark, now = self._mark, time.monotonic()
        worked = time.clock_gettime(time.pthread_getcpuclockid(self._thread))
        if mark is None or mark.task.done():
            self._mark = _Mark(self._executor.create_task(lambda: None), now, worked)
        elif now - mark.put > BACKLOG or worked - mark.worked > WORK:
            self._pass_over()

    def catch_up(self, longest: float) -> None:
        """Give up the messages that wait; by the same thread as `spin_once`, for so long (s)."""
        if not self.in_order:
            return  # without a queue of its own
        self._pass_over()
        end = time.monotonic() + longest
        while self._passed_over is not None and time.monotonic() < end:
            self._executor.spin_once(timeout_sec=TURN)

    def _pass_over(self) -> None:
        if self._passed_over is None:
            self._passed_over = PassedOver(self._executor, self._nodes, self._has_caught_up)

    def _has_caught_up(self, left_out: int) -> None:
        self._passed_over = self._mark = None
        self._left_out(left_out)

    def close(self) -> None:
        """Release the nodes."""
        for node in self._nodes:
            self._executor.remove_node(node)
        self._executor.shutdown()

    def _turn(self, longest: float) -> None:
        if not self.in_order:
            self._executor.spin_once(timeout_sec=min(longest, TURN))
            return
        # Many events a turn: to come back to Python after each costs a seventh more of the
        # processor for a message.
        self._executor.spin_until_future_complete(self._over, timeout_sec=longest)


def _executor_for(node: Node, context: Context) -> tuple[Any, bool]:
    # Returns the events executor if it works, else the default one, and whether it is the former.
    try:
        executor = _events_executor(context)
    except ImportError:
        pass
    else:
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


def _events_executor(context: Context) -> Any:
    from rclpy.experimental import EventsExecutor

    return EventsExecutor(context=context)


def _fires_a_timer(executor: Any, node: Node) -> bool:
    fired = False

    def fire() -> None:
        nonlocal fired
        fired = True

    timer = node.create_timer(0.001, fire, clock=Clock(clock_type=ClockType.STEADY_TIME))
    deadline = time.monotonic() + SELF_TEST
    while not fired and time.monotonic() < deadline:
        executor.spin_once(timeout_sec=0.01)
    node.destroy_timer(timer)
    return fired
