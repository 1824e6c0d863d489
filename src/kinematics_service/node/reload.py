"""
The robot read again while the node answers: by the service `~/reload`, or since a topic says so.

Reading and checking a file takes some tens of milliseconds, so it has a thread of its own. What is
right comes into force between two messages; what is wrong changes nothing.
"""

import threading
from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from std_srvs.srv import Trigger

from ..errors import KinematicsError
from ..typography import counted
from .messages.topics import RELOAD, SERVICE_QOS
from .parameters.description_topic import SILENCE, last_of
from .parameters.node_parameters import CheckedArm, NodeParameters
from .parameters.settings import NodeSettings
from .steady_time import steady_timer

# Period of the look for the end of the reading, s.
LOOK = 0.005


class Reload:
    """
    Answers `~/reload` after the robot is read: with what is in force now, or with its faults.

    Requests that come meanwhile are answered by one more reading: the robot may have been changed
    after the present one began.

    Parameters
    ----------
    node
        The node it belongs to.
    parameters
        The node's parameters, which read the robot.
    apply
        Called with the settings of the arm that has been read.
    """

    def __init__(
        self, node: Node, parameters: NodeParameters, apply: Callable[[NodeSettings], None]
    ) -> None:
        self._node, self._parameters, self._apply = node, parameters, apply
        self._asked: list[Any] = []  # headers of requests for the next reading
        self._answered: list[Any] = []  # of those that the present one answers
        self._reading = self._again = False  # whether one goes on, and another is to follow
        self._outcome: CheckedArm | Exception | None = None
        self._timer = steady_timer(node, LOOK, self._look, autostart=False)
        # After a line in the log the next one waits, for the last of all robots read meanwhile.
        self._unsaid, self._outcome_in_words = 0, (True, '')
        self._pause = steady_timer(node, SILENCE, self._say, autostart=False)
        self._service = node.create_service(
            Trigger, RELOAD, lambda request, response: response, qos_profile=SERVICE_QOS
        )
        # The executors send what a service's callback returns at once, and `EventsExecutor` of
        # Jazzy cannot wait for a coroutine: so this is what they call.
        self._send = self._service.send_response
        setattr(self._service, 'send_response', self._on_request)  # noqa: B010

    def _on_request(self, response: Trigger.Response, header: Any) -> None:
        self._asked.append(header)
        self.read()

    def read(self) -> None:
        """Read the robot again, after the present reading if there is one."""
        self._again = self._reading
        if self._reading:
            return
        self._reading = True
        self._answered, self._asked, self._outcome = self._asked, [], None
        read = self._parameters.reading_again()

        def work() -> None:
            try:
                self._outcome = read()
            except Exception as error:  # whatever it is: the request gets its answer
                self._outcome = error

        threading.Thread(target=work, daemon=True).start()
        self._timer.reset()

    def _look(self) -> None:
        outcome = self._outcome
        if outcome is None:
            return
        self._timer.cancel()
        self._unsaid += 1
        success, sentence = self._outcome_in_words = self._taken(outcome)
        if self._answered or self._pause.is_canceled():
            self._say()
        for header in self._answered:
            self._send(Trigger.Response(success=success, message=sentence), header)
        self._reading = False
        if self._again:
            self.read()

    def _say(self) -> None:
        if not self._unsaid:
            self._pause.cancel()
            return
        logger, (success, sentence) = self._node.get_logger(), self._outcome_in_words
        sentence += last_of(self._unsaid)
        self._unsaid = 0
        self._pause.reset()
        if success:
            logger.info(sentence)
            for doubt in self._parameters.settings.robot.description.warnings:
                logger.warning(str(doubt))
        else:
            logger.warning(f'the new robot is not taken: {sentence}')

    def _taken(self, outcome: CheckedArm | Exception) -> tuple[bool, str]:
        try:
            if isinstance(outcome, Exception):
                raise outcome
            settings = self._parameters.take(outcome)
            self._apply(settings)
        except KinematicsError as error:
            return False, str(error)
        except Exception as error:  # whatever it is: the request gets its answer
            return False, f'internal error, please report it: {error!a}'
        robot = settings.robot
        return True, (
            f'{robot.description.file} is in force: robot {robot.name}, '
            f'{counted(robot.dof, "joint")}, {robot.convention}'
        )
