"""
The executor and the loop that turns it until a signal.

`EventsExecutor` takes a fifth of the CPU of the default executor per message, but in the wheels
its `spin()` burns a core and ignores signals, while `spin_once(timeout_sec=...)` works.
"""

import time
from collections.abc import Callable
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future

# A signal is noticed after this at the latest (s).
TURN = 0.1
# The events executor must fire a timer within this (s), or the default one is used.
SELF_TEST = 1.0
# So many failures of the executor in a row mean that it is broken, not that a message was.
FAILURES = 100


def new_executor(node: Node, context: Context) -> Any:
    """
    Return an executor that spins `node`: the events executor where it works, else the default.

    """
    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:
        executor: Any = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        return executor
    executor = EventsExecutor(context=context)
    executor.add_node(node)
    if _fires_a_timer(executor, node):
        return executor
    executor.remove_node(node)
    executor.shutdown()
    node.get_logger().warning('EventsExecutor fires no timer here; using SingleThreadedExecutor')
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    return executor


def keeps_order(executor: Any) -> bool:
    """
    Return whether an executor handles events in the order they come in.

    """
    return type(executor).__name__ == 'EventsExecutor'


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


def spin(executor: Any, node: Node, stopped: Callable[[], bool]) -> bool:
    """
    Turn the executor until `stopped()`; return False where it broke down.

    """
    failures = 0
    never = Future()
    while not stopped():
        try:
            if keeps_order(executor):
                # Many events a turn, without coming back to Python between them.
                executor.spin_until_future_complete(never, timeout_sec=TURN)
            else:
                executor.spin_once(timeout_sec=TURN)
            failures = 0
        except ExternalShutdownException:
            return True
        except Exception as error:  # a message that cannot even be taken must not end the node
            failures += 1
            if failures in (1, FAILURES):
                node.get_logger().error(f'executor: {error!a}')
            if failures >= FAILURES:
                return False
    return True
