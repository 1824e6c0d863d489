# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Pass blocks of messages through the estimator of the node, and return the joint states after each
message.

A run of messages with rising stamps is computed as arrays, by the rules of the estimator. The
first and the last message of the run go through the estimator itself, to update its memory.
"""

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ....estimation import outcomes
from ....estimation.estimator import Estimator, RefusedMessage
from ....kernel import LARGEST, Floats
from ....robot.robot import Robot
from ..readers.block import Block, Flags, Times, UnreadableMessage

# Least number of successive messages with rising stamps that are computed together as arrays.
# Fewer messages go through the estimator one by one.
MIN_RUN = 8
# Error code of each reason for which the estimator refuses a message. Reports in JSON have the
# error code.
CODES = {
    outcomes.UNREADABLE: 'unreadable',
    outcomes.NOT_OURS: 'unknown-name',
    outcomes.NO_POSITION: 'empty',
    outcomes.MALFORMED: 'wrong-length',
    outcomes.DUPLICATE: 'duplicate-name',
    outcomes.NOT_FINITE: 'not-finite',
    outcomes.TOO_LARGE: 'too-large',
    outcomes.TOO_FAST: 'too-large',
    outcomes.NOT_CLOSED: 'open-loop',
    outcomes.DROPPED: 'wrong-order',
    outcomes.WAITING: 'missing-joint',
}


class JointTimeout(NamedTuple):
    """
    A time-out: the joints `missing` had no position for too long, so the node reports STALE at
    `moment` (ns, time of receipt).
    """

    moment: int
    missing: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class KnownJoints:
    """
    Joint positions and velocities after each message that completes a state of the arm.

    Attributes
    ----------
    messages : shape (N,)
        Numbers of the messages in the recording, from 0.
    stamps, arrivals : shape (N,), ns
        Stamp of the state, and time of receipt.
    q, qdot : shape (N, n), rad or m, rad/s or m/s
        Joint positions and velocities in the order of the arm's joints; a row of `qdot` is NaN if
        the velocity of a joint is unknown.
    differenced : shape (N,)
        Whether the velocity of a joint is a difference of positions.
    fresh : shape (N,)
        Whether the estimator was reset just before the message.
    timeouts : by row
        Time-outs of joints, by the row of the first state after the time-out.
    """

    messages: Times
    stamps: Times
    arrivals: Times
    q: Floats
    qdot: Floats
    differenced: Flags
    fresh: Flags
    timeouts: dict[int, JointTimeout]

    def __len__(self) -> int:
        return len(self.stamps)

    @property
    def moving(self) -> Flags:
        """Return for each state whether the velocities of all joints are known, shape (N,)."""
        return np.asarray(~np.any(np.isnan(self.qdot), axis=1))


class RefusedExample(NamedTuple):
    """
    An example for one reason to refuse messages, such as a missing joint: the first message that
    was refused for this reason. `code` is the error code of the reason.
    """

    message: int
    stamp: int
    sentence: str
    code: str


class Ingest:
    """
    Passes messages through the node's state estimator, and counts the messages that it refuses.

    Attributes
    ----------
    prefix
        Prefix of the joint names in messages.
    examples
        The first refused message for each reason.
    """

    def __init__(self, robot: Robot, estimator: Estimator) -> None:
        self.examples: dict[str, RefusedExample] = {}
        self._estimator = estimator
        self._names, self.prefix = estimator.names, estimator.settings.joint_prefix
        self._wraps = np.array(robot.continuous)
        self._message = 0
        self._started: int | None = None
        self._stale = False
        self._rows = _KnownRows(robot.dof)

    @property
    def counts(self) -> Counter[str]:
        """Return the number of messages by outcome, counted by the estimator."""
        return self._estimator.counts

    def take(self, block: Block | UnreadableMessage) -> KnownJoints:
        """Take the next block of messages, and return the joint states that its messages yield."""
        if isinstance(block, UnreadableMessage):
            self.counts[outcomes.UNREADABLE] += 1
            self._refused(0, outcomes.UNREADABLE, 0, block.reason)
            self._message += 1
            return self._rows.known()
        for begin, end in self._runs(block):
            k = begin
            while k < end:
                accepted = self._accept(block, k)
                k += 1
                if accepted and end - k >= MIN_RUN:
                    self._columns(block, k - 1, end - 1)
                    # Update the memory of the estimator by passing it the last message that
                    # `_columns` computed. Restore the counts, because `_columns` has counted this
                    # message already.
                    counts = self.counts.copy()
                    self._estimator.accept(block.sample(end - 2))
                    self.counts.clear()
                    self.counts.update(counts)
                    k = end - 1
        self._message += len(block)
        return self._rows.known()

    def _refused(self, k: int, reason: str, stamp: int, sentence: str) -> None:
        # Keeps the first refused message of each reason. Message k of the current block was
        # refused.
        example = RefusedExample(self._message + k, stamp, sentence, CODES[reason])
        self.examples.setdefault(reason, example)

    def _runs(self, block: Block) -> Iterator[tuple[int, int]]:
        # Splits the block into runs of successive messages, and yields `begin` and `end` of each
        # run: messages begin to end - 1. Message k continues the run of message k - 1 if the
        # positions of both messages are complete and the stamp of message k is later. Otherwise
        # message k begins a new run.
        count = len(block)
        columns = self._joint_columns(block)
        if columns is None:
            yield from ((k, k + 1) for k in range(count))
            return
        with np.errstate(invalid='ignore'):
            good = np.all(np.abs(block.positions[:, columns]) <= LARGEST, axis=1)
        good &= block.stamps > 0
        follows = np.zeros(count, dtype=bool)
        follows[1:] = good[1:] & good[:-1] & (np.diff(block.stamps) > 0)
        starts = [*np.flatnonzero(~follows).tolist(), count]
        yield from zip(starts, starts[1:])

    def _joint_columns(self, block: Block) -> list[int] | None:
        # Returns the column of each joint of the arm; None if a joint does not occur exactly once,
        # or if positions are missing.
        if block.positions.shape[1] != len(block.names):
            return None
        if any(block.names.count(name) != 1 for name in self._names):
            return None
        return [block.names.index(name) for name in self._names]

    def _accept(self, block: Block, k: int) -> bool:
        # Passes message k of the block through the estimator, and returns whether it accepted the
        # message.
        estimator, sample = self._estimator, block.sample(k)
        self._started = sample.arrival if self._started is None else self._started
        self._listen(sample.arrival)
        resets = estimator.counts[outcomes.RESETS]
        outcome = estimator.accept(sample)
        self._rows.reset |= estimator.counts[outcomes.RESETS] != resets
        if isinstance(outcome, RefusedMessage):
            self._refused(k, outcome.reason, sample.stamp, outcome.sentence)
            return False
        self._stale = False
        self._rows.add(
            [self._message + k],
            [outcome.stamp],
            [sample.arrival],
            outcome.q[None],
            (np.full_like(outcome.q, math.nan) if outcome.qdot is None else outcome.qdot)[None],
            [outcome.velocity_source == 'difference'],
        )
        return True

    def _listen(self, arrival: int) -> None:
        # Notes a time-out if, before the time `arrival` (ns), some joint had no new position for
        # too long. The watchdog of the node does the same.
        assert self._started is not None
        timeout = self._estimator.settings.timeout
        if self._stale or arrival - self._started <= timeout:
            return
        missing = self._estimator.joints.missing(arrival)
        if missing:
            self._stale = True
            age = self._estimator.joints.age(arrival)
            latest = self._started if math.isinf(age) else arrival - round(age * 1e9)
            moment = max(latest, self._started) + timeout
            self._rows.timeout = JointTimeout(min(moment, arrival), missing)

    def _columns(self, block: Block, first: int, end: int) -> None:
        # Adds the joint states of the block's messages with indices from `first` + 1 to `end` - 1,
        # computed as arrays. The estimator has accepted message `first`.
        settings = self._estimator.settings
        columns = self._joint_columns(block)
        assert columns is not None
        q = block.positions[first:end, columns]
        stamps, arrivals = block.stamps[first:end], block.received[first:end]
        reported = np.zeros(len(q), dtype=bool)
        qdot = np.full_like(q, math.nan)
        if settings.velocity_source != 'difference' and (
            block.velocities.shape[1] == len(block.names)
        ):
            velocities = block.velocities[first:end, columns]
            with np.errstate(invalid='ignore'):
                reported = np.all(np.abs(velocities) <= LARGEST, axis=1)
            qdot[reported] = velocities[reported]
        differenced = np.zeros(len(q), dtype=bool)
        if settings.velocity_source != 'message' and not np.all(reported[1:]):
            differences = self._differences(q, stamps, settings.timeout)
            take = ~reported[1:]
            qdot[1:][take] = differences[take]
            differenced[1:] = take & ~np.any(np.isnan(qdot[1:]), axis=1)
            qdot[np.any(np.isnan(qdot), axis=1)] = math.nan
        late = np.flatnonzero(np.diff(arrivals) > settings.timeout)
        before = self._rows.count
        for k in late.tolist():
            moment = int(arrivals[k]) + settings.timeout
            self._rows.timeouts[before + k] = JointTimeout(moment, self._names)
        self._rows.add(
            np.arange(first + 1, end) + self._message,
            stamps[1:],
            arrivals[1:],
            q[1:],
            qdot[1:],
            differenced[1:],
        )
        self.counts[outcomes.ACCEPTED] += len(q) - 1

    def _differences(self, q: Floats, stamps: Times, longest: int) -> Floats:
        # Returns velocities as backward differences of the positions, as the estimator computes
        # them.
        steps = np.diff(q, axis=0)
        far = self._wraps & (np.abs(steps) > math.pi)
        for k, j in np.argwhere(far).tolist():
            steps[k, j] = math.remainder(steps[k, j], math.tau)
        intervals = np.diff(stamps)
        with np.errstate(over='ignore'):
            differences = steps / (intervals * 1e-9)[:, None]
        differences[intervals > longest] = math.nan
        differences[~np.isfinite(differences)] = math.nan
        return np.asarray(differences)


class _KnownRows:
    """Collects the rows of a `KnownJoints`, one or several at a time."""

    def __init__(self, dof: int) -> None:
        self.timeout: JointTimeout | None = None
        self.reset = False
        whole, table = np.zeros(0, dtype=np.int64), np.zeros((0, dof))
        self._none = (whole, whole, whole, table, table, whole.astype(bool))
        self._clear()

    def _clear(self) -> None:
        self.timeouts: dict[int, JointTimeout] = {}
        self.count = 0
        self._parts: list[tuple[Any, ...]] = [self._none]
        self._fresh: list[int] = []

    def add(self, *columns: object) -> None:
        if self.timeout is not None:
            self.timeouts[self.count] = self.timeout
        if self.reset:
            self._fresh.append(self.count)
        self.timeout, self.reset = None, False
        self._parts.append(tuple(np.asarray(column) for column in columns))
        self.count += len(self._parts[-1][0])

    def known(self) -> KnownJoints:
        """Return the rows that were added since the previous call."""
        columns = (np.concatenate(column) for column in zip(*self._parts))
        messages, stamps, arrivals, q, qdot, differenced = columns
        fresh, timeouts = np.isin(np.arange(self.count), self._fresh), self.timeouts
        self._clear()
        return KnownJoints(messages, stamps, arrivals, q, qdot, differenced, fresh, timeouts)
