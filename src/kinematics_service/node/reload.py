# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Read the robot again while the node answers, after a call of `~/reload` or a new description.

Reading and checking a file takes tens of milliseconds, so a second thread does it. A valid robot
is applied between two messages; a robot with faults changes nothing.
"""

import threading
from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from std_srvs.srv import Trigger

from ..errors import KinematicsError
from ..typography import counted
from .messages.topics import RELOAD, SERVICE_QOS
from .parameters.description_topic import LOG_PERIOD, last_of
from .parameters.node_parameters import CheckedArm, NodeParameters
from .parameters.settings import NodeSettings
from .steady_time import steady_timer

# Period of the check whether the reading thread has ended, s.
CHECK_PERIOD = 0.005


class Reload:
    """
    Answers the service `~/reload` after the robot has been read: with the robot that is now in
    force, or with the faults that were found.

    A request that arrives while the robot is being read is answered after another reading, because
    the robot's file or description may have changed since the present reading began.

    Parameters
    ----------
    node
        The node with the service.
    parameters
        The parameters of the node, which read the robot.
    apply
        A function that is called with the settings of the new arm.
    """

    def __init__(
        self, node: Node, parameters: NodeParameters, apply: Callable[[NodeSettings], None]
    ) -> None:
        self._node, self._parameters, self._apply = node, parameters, apply
        # Headers of service requests that wait for an answer. The requests in `_answered` are
        # answered when the present reading of the robot ends. The requests in `_queued` arrived
        # later and are answered after the next reading.
        self._queued: list[Any] = []
        self._answered: list[Any] = []
        # whether a thread is reading the robot, and whether it must be read again after that
        self._reading = self._again = False
        self._outcome: CheckedArm | Exception | None = None
        self._timer = steady_timer(node, CHECK_PERIOD, self._check_outcome, autostart=False)
        # How often the robot was read since the last log line, and the outcome of the last
        # reading. The next log line, when the timer `_log_pause` expires, reports this outcome.
        self._unlogged, self._outcome_in_words = 0, (True, '')
        self._log_pause = steady_timer(node, LOG_PERIOD, self._log_outcome, autostart=False)
        self._service = node.create_service(
            Trigger, RELOAD, lambda request, response: response, qos_profile=SERVICE_QOS
        )
        # Replace `send_response` of the service, so that the answer is sent only after the robot
        # has been read again. An executor sends the result of a service callback at once, and
        # `EventsExecutor` of Jazzy cannot wait for a coroutine.
        self._send = self._service.send_response
        setattr(self._service, 'send_response', self._on_request)  # noqa: B010

    def _on_request(self, response: Trigger.Response, header: Any) -> None:
        self._queued.append(header)
        self.read()

    def read(self) -> None:
        """Read the robot again, now or after the present reading has ended."""
        self._again = self._reading
        if self._reading:
            return
        self._reading = True
        self._answered, self._queued, self._outcome = self._queued, [], None
        read = self._parameters.reading_again()

        def work() -> None:
            try:
                self._outcome = read()
            except Exception as error:  # the request must get an answer
                self._outcome = error

        threading.Thread(target=work, daemon=True).start()
        self._timer.reset()

    def _check_outcome(self) -> None:
        outcome = self._outcome
        if outcome is None:
            return
        self._timer.cancel()
        self._unlogged += 1
        success, sentence = self._outcome_in_words = self._taken(outcome)
        if self._answered or self._log_pause.is_canceled():
            self._log_outcome()
        for header in self._answered:
            self._send(Trigger.Response(success=success, message=sentence), header)
        self._reading = False
        if self._again:
            self.read()

    def _log_outcome(self) -> None:
        if not self._unlogged:
            self._log_pause.cancel()
            return
        logger, (success, sentence) = self._node.get_logger(), self._outcome_in_words
        sentence += last_of(self._unlogged)
        self._unlogged = 0
        self._log_pause.reset()
        if success:
            logger.info(sentence)
            for doubt in self._parameters.settings.robot.description.warnings:
                logger.warning(str(doubt))
        else:
            logger.warning(f'the new robot is refused: {sentence}')

    def _taken(self, outcome: CheckedArm | Exception) -> tuple[bool, str]:
        try:
            if isinstance(outcome, Exception):
                raise outcome
            settings = self._parameters.take(outcome)
            self._apply(settings)
        except KinematicsError as error:
            return False, str(error)
        except Exception as error:  # the request must get an answer
            return False, f'internal error, please report it: {error!a}'
        robot = settings.robot
        return True, (
            f'{robot.description.file} is in force: robot {robot.name}, '
            f'{counted(robot.dof, "joint")}, {robot.convention}'
        )
