"""Reported velocities against the positions of the last messages, as `audit` judges them."""

from collections import deque

import numpy as np

from ...estimation.estimator import EstimatorOutput
from ...estimation.status_text import StatusText
from ...robot.measures import Level
from ..parameters.settings import NodeSettings

# Answers kept: a second at 1 kHz.
KEPT = 1000


class RecentMotion:
    """The last answers with reported velocities, and what was found of each joint."""

    def __init__(self) -> None:
        self._answers: deque[EstimatorOutput] = deque(maxlen=KEPT)
        self._texts: dict[str, str] = {}
        self._turn = 0

    def note(self, answer: EstimatorOutput) -> None:
        """Keep an answer, if its velocities are reported."""
        if answer.velocity_source == 'message':
            self._answers.append(answer)

    def forget(self) -> None:
        """Begin anew: the arm is another, or time stepped back."""
        self._answers.clear()
        self._texts.clear()

    def status(self, settings: NodeSettings) -> StatusText | None:
        """
        Compare one joint, the next in turn, and return what is known of all; None for nothing.
        """
        # Imported when there is something to compare: the node itself needs no audit.
        from ...diagnosis.audit.reported_velocities import MotionColumns, velocity_check

        robot, names = settings.robot, settings.joint_names
        if not self._answers:
            return None
        j = self._turn % robot.dof
        self._turn += 1
        stamps = np.array([answer.stamp for answer in self._answers], dtype=np.int64)
        q, qdot = (
            np.array([getattr(answer.state, name) for answer in self._answers])
            for name in ('q', 'qdot')
        )
        states = MotionColumns(robot.dof)
        states.add(stamps, q, qdot, np.zeros(len(q), dtype=bool))
        check = velocity_check(states, j, bool(robot.continuous[j]))
        if check is not None:  # a joint at rest keeps what was found of it
            self._texts[names[j]] = check.in_words(robot.units[j])
        values = ((name, self._texts.get(name, 'not moved yet') or 'agrees') for name in names)
        wrong = [f'{name} {text}' for name, text in self._texts.items() if text]
        sentence = '; '.join(f'reported velocities of {one}' for one in wrong)
        return StatusText(
            Level.WARN if wrong else Level.OK,
            sentence or 'reported velocities agree with the positions where joints have moved',
            (('robot', robot.name), *values),
        )
