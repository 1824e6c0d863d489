# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Show the messages of a running node, on a terminal or as lines for a program."""

import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rclpy.context import Context
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from rich.console import Console, Group
from rich.text import Text

from ...errors import LayoutError
from ...node.process import session
from ...node.process.no_messages import why_no_messages
from ...node.process.spin import Spinner
from ...node.steady_time import steady_timer
from ...printing import json_text
from ...stop_signals import StopSignal
from .echo_topics import ECHO_TOPICS, diagnostics_of
from .live_table import coloured, live
from .standard_output import StandardOutput

# If no message comes for this time (s), `echo` prints the likely reason.
SILENCE_TIMEOUT = 5.0
# Period (s) at which `echo` checks whether messages still come.
CHECK_PERIOD = 0.5
# Width (characters) of lines if the output is not a terminal. It is so large that no line is
# broken.
UNBROKEN_WIDTH = 10_000
SEPARATOR = '---'


def run_echo(
    name: str, node: str, once: bool, as_json: bool, timeout: float | None, ros_args: Sequence[str]
) -> int:
    """
    Show the messages of a topic of a node until a signal.

    Parameters
    ----------
    name
        A name of `ECHO_TOPICS`; another name means diagnostics.
    node
        Full name of the node; the leading slash may be missing.
    once
        Whether to stop after the first message.
    as_json
        Whether to print each message as a JSON object in one line.
    timeout
        Time after which to stop if no message has arrived, s; None: never.
    ros_args
        ROS arguments, `--ros-args` included.

    Returns
    -------
    0 after a signal, after one message with `once`, or if the reader of the output has ended; 1 if
    no message arrived in time; 2 for wrong usage.
    """
    if not session.is_name('--node', node, session.NODE_NAMES):
        return session.WRONG_USAGE
    source = f'/{node.strip("/")}'

    def work(context: Context, stop: StopSignal) -> int:
        listener = session.helper_node(f'kinematics_echo_{os.getpid()}', context)
        echo = _Echo(listener, source, name, once, as_json, timeout)
        spinner = Spinner(context, [listener])
        spinner.obey(stop)
        with echo.shown():
            is_intact = spinner.spin(lambda: stop.came or not context.ok() or echo.over)
        spinner.close()
        session.destroy(listener)
        return session.SUCCESS if is_intact and not echo.in_vain else session.FAULT

    return session.run_session(ros_args, work)


class _Echo:
    # Subscribes to a topic, and writes the received messages to the output.

    def __init__(
        self, node: Node, source: str, name: str, once: bool, as_json: bool, timeout: float | None
    ) -> None:
        self.in_vain = False
        diagnostics = diagnostics_of(source)
        self._node, self._echoed = node, ECHO_TOPICS.get(name, diagnostics)
        self._once, self._as_json, self._timeout = once, as_json, timeout
        self._output = StandardOutput()
        self._live = self._output.is_terminal and not once and not as_json
        then = None if self._live else self._write
        self._latest = self._echoed.subscribed_by(node, source, then)
        self._diagnostics = diagnostics.subscribed_by(node, source)
        self._explained = False

    @property
    def over(self) -> bool:
        """
        Return whether `echo` must stop: the one message of `--once` was shown, the time-out has
        passed, or the reader of the output has ended.
        """
        return (self._once and self._latest.count > 0) or self.in_vain or self._output.closed

    @property
    def _silent(self) -> bool:
        expected = not (self._echoed.is_rare and self._latest.count > 0)
        return expected and self._latest.age >= SILENCE_TIMEOUT

    @contextmanager
    def shown(self) -> Iterator[None]:
        """Show the received messages while the `with` block runs."""
        if self._timeout is not None:
            steady_timer(self._node, self._timeout, self._give_up)
        if not self._live:
            steady_timer(self._node, CHECK_PERIOD, self._watch)
            yield
            return
        with live(self._node, self._screen, whole=False):
            yield

    def _write(self, message: bytes) -> None:
        if self._once and self._latest.count > 1:
            return
        decoded = deserialize_message(message, self._echoed.type)
        try:
            if self._as_json:
                self._output.line(json_text(self._echoed.document(decoded)))
                return
            columns, is_terminal = shutil.get_terminal_size().columns, self._output.is_terminal
            lines = self._echoed.lines(decoded, columns if is_terminal else UNBROKEN_WIDTH)
        except LayoutError as error:
            self.in_vain = self._once
            session.tell(f'{self._latest.topic}: {error}')
            return
        self._output.line(*lines, *([] if self._once else [SEPARATOR]))

    def _watch(self) -> None:
        # Print the likely reason for missing messages to standard error, once for each period
        # without messages. A timer calls this function if `echo` shows no live screen.
        if not self._silent:
            self._explained = False
            return
        if not self._explained:
            self._explained = True
            session.tell(self._why_silent())

    def _why_silent(self) -> str:
        topic = self._echoed.awaited or self._latest.topic
        diagnostics = self._diagnostics.message
        # Use the first status of the node's diagnostics, which reports whether the node receives
        # joint states.
        report = diagnostics.status[0].message if diagnostics else ''
        return why_no_messages(self._node, topic, self._echoed.answers, report)

    def _give_up(self) -> None:
        # Stop at the time-out if no message has come. Print the likely reason, unless the reason
        # has been printed before.
        if self._latest.count > 0 or self.in_vain:
            return
        if not self._explained:
            session.tell(self._why_silent())
        self.in_vain = True
        session.tell(f'gave up after {self._timeout:g} s without a message')

    def _screen(self, console: Console) -> Group:
        latest = self._latest
        title, lines = f'{latest.topic}   no message yet', []
        if latest.message is not None:
            title = f'{latest.topic}   {latest.rate():.1f} Hz   {latest.age:.1f} s ago'
            try:
                lines = self._echoed.lines(latest.message, console.width)
            except LayoutError as error:
                lines = [str(error)]
        level = lines[0].partition(' ')[0] if lines else ''
        texts = [coloured(line, level) for line in lines]
        if self._silent:
            texts.append(Text(self._why_silent(), style='bold'))
        headline = Text(f'{title}   Ctrl-C ends it', 'bold', no_wrap=True, overflow='ellipsis')
        return Group(headline, *texts)
