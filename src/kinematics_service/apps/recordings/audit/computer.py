# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the timeline of a recording from its blocks of messages. The kernel evaluates whole
batches; the rules for the node's warnings run message by message.
"""

from collections import Counter

import numpy as np

from ....errors import JointVectorError, LoopError
from ....estimation import outcomes
from ....estimation.status_text import singularity_status, stale_status
from ....kernel import Floats, NearestSearch
from ....kinematics.singularity import singularity_of
from ....kinematics.singularity_rates import measured_in_order
from ....kinematics.tool_state import evaluate
from ....robot.measures import Level
from ....robot.robot import Robot
from ..readers.block import Block, Flags, UnreadableMessage
from .ingest import Ingest, KnownJoints
from .judging import Judge
from .timeline import PublishedWarning, Timeline, TimelineBatch

# Largest number of warnings that the timeline keeps. It bounds the memory if an arm crosses a
# threshold of the singularity measure very often.
MAX_WARNINGS = 10_000


class Computer:
    """
    Turns blocks of messages into a timeline of states, batch by batch.

    Parameters
    ----------
    robot, ingest
        The arm, and the object that passes the arm's messages through the estimator.

    Attributes
    ----------
    timeline
        The states of all blocks so far.
    """

    def __init__(self, robot: Robot, ingest: Ingest) -> None:
        self._robot, self._ingest = robot, ingest
        self._judge = Judge(robot.singularity.thresholds)
        self._search = NearestSearch(robot.singularity.arm)
        self._quaternion: Floats | None = None
        self.timeline = Timeline(robot)

    def take(self, block: Block | UnreadableMessage) -> TimelineBatch | None:
        """
        Add the states of the next block to the timeline. Return these states; None if the block
        yields no state.
        """
        return self._part(self._ingest.take(block))

    def _part(self, known: KnownJoints) -> TimelineBatch | None:
        robot, first = self._robot, len(self.timeline)
        if not len(known):
            return None
        try:
            state = evaluate(robot, known.q, np.nan_to_num(known.qdot, nan=0.0))
        except JointVectorError:
            return self._part(self._computable(known))
        state = measured_in_order(state, self._search)
        singularity, measured = singularity_of(state), state.measures
        assert measured is not None
        judged, moving, warnings = self._judge.judge(known, singularity), known.moving, []
        for k, timeout in judged.timeouts:
            stale = stale_status(robot, f'no joint state of {", ".join(timeout.missing)}')
            warnings.append(PublishedWarning(first + k, timeout.moment, stale))
        for k in judged.warnings:
            pose = evaluate(robot, known.q[k], known.qdot[k] if moving[k] else None)
            values = singularity_of(pose._replace(measures=measured[k]))
            level = Level(int(judged.levels[k]))
            text = singularity_status(robot, values, level, robot.base_frame, self._ingest.prefix)
            warnings.append(PublishedWarning(first + k, int(known.arrivals[k]), text))
        warnings.sort(key=lambda warning: (warning.row, warning.moment))
        signs = self._signs(state.quaternion_xyzw, known.fresh)
        quaternion = state.quaternion_xyzw * signs[:, None]
        self._quaternion = np.array(quaternion[-1])
        batch = TimelineBatch(first, known, state, quaternion, singularity, warnings)
        timeline = self.timeline
        timeline.append(batch, judged.levels, signs < 0.0)
        timeline.warnings += warnings[: max(0, MAX_WARNINGS - len(timeline.warnings))]
        return batch

    def _computable(self, known: KnownJoints) -> KnownJoints:
        # Removes states that cannot be computed, because large positions cause an overflow, or
        # because closed loops do not close. Counts them as refused.
        good, refused = np.ones(len(known), dtype=bool), Counter[str]()
        for k in range(len(known)):
            try:
                evaluate(self._robot, known.q[k], np.nan_to_num(known.qdot[k], nan=0.0))
            except JointVectorError as error:
                good[k] = False
                is_open = isinstance(error, LoopError)
                refused[outcomes.NOT_CLOSED if is_open else outcomes.TOO_LARGE] += 1
        self._ingest.counts[outcomes.ACCEPTED] -= refused.total()
        self._ingest.counts.update(refused)
        at = np.cumsum(good) - 1
        columns = {name: part[good] for name, part in vars(known).items() if name != 'timeouts'}
        kept = {int(at[k]): timeout for k, timeout in known.timeouts.items() if good[k]}
        return KnownJoints(**columns, timeouts=kept)

    def _signs(self, quaternions: Floats, fresh: Flags) -> Floats:
        # Returns factors 1 or -1 (N,). The node publishes the kernel's quaternion times the
        # factor. It chooses the factor that makes each quaternion nearer to the last one published
        # before.
        before = quaternions[:1] if self._quaternion is None else self._quaternion[None]
        last = np.concatenate([before, quaternions[:-1]])
        dots = np.einsum('ij,ij->i', quaternions, last)
        for k in np.flatnonzero(np.abs(dots) < 1e-9):
            # The sign of a dot product near 0 depends on the order of summation, so sum by np.dot,
            # as the estimator does.
            dots[k] = np.dot(quaternions[k], last[k])
        turns = np.where(dots < 0.0, -1.0, 1.0)
        signs = np.cumprod(turns)
        for k in np.flatnonzero(fresh | (dots == 0.0)):
            # Before state k the estimator was reset, or quaternions k - 1 and k are orthogonal. So
            # the node publishes the kernel's quaternion k unchanged, and signs[k] must be 1. If
            # signs[k] is -1, change the sign of signs[k] and of all later factors.
            signs[k:] *= signs[k]
        return np.asarray(signs, dtype=np.float64)
