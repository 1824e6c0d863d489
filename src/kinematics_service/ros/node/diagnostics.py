"""
The state of the input as a DiagnosticArray: the messages received, their outcomes, missing joints.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from ...estimation import estimator
from ...estimation.status_text import StatusText
from ...robot.measures import Level

REJECTED = (
    estimator.UNREADABLE,
    estimator.MALFORMED,
    estimator.DUPLICATE,
    estimator.NOT_FINITE,
    estimator.TOO_LARGE,
    estimator.NOT_CLOSED,
)
INTERNAL_ERROR = 'internal error'
# Time for which a loss is warned of, s.
RECENT = 10.0
LEFT_OUT = 'left out'


@dataclass
class Work:
    """Processing times since the last diagnostics, in ns."""

    count: int = 0
    total: int = 0
    longest: int = 0

    def add(self, nanoseconds: int) -> None:
        """Count one message."""
        self.count += 1
        self.total += nanoseconds
        if nanoseconds > self.longest:
            self.longest = nanoseconds

    @property
    def mean(self) -> float:
        """Return the mean time, 0 if nothing was processed."""
        return self.total / self.count if self.count else 0.0


@dataclass(frozen=True)
class InputState:
    """
    The data that the diagnostics are made of.

    Attributes
    ----------
    counts, news
        Number of messages by outcome: since the start, and since the last diagnostics.
    interval
        Seconds since the last diagnostics.
    age
        Age in seconds of the oldest joint position, inf if a joint has none.
    missing, beyond, disputed
        Names of joints that are stale, that are beyond their limits, and about which publishers
        disagree.
    publishers
        Names of the nodes that publish joint states.
    velocity_source
        Source of the velocities of the last answer.
    topic, robot
        Resolved name of the input topic, name of the arm.
    reliable
        Whether lost messages are sent again.
    lost, lost_of_late
        Messages that were published and not received: since the first one was received, None if
        the middleware does not number them; and within the last `RECENT` seconds.
    acceleration_delay
        By how much the last joint accelerations were late, s; 0 where nobody asked for them.
    work
        Processing times.
    silent
        Why nothing is answered; empty where messages are.
    integrated, deviation
        Seconds for which positions have been counted on from velocities, and the standard
        deviation (rad or m) that came of it, None where it is not known.
    """

    counts: Mapping[str, int]
    news: Mapping[str, int]
    interval: float
    age: float
    missing: Sequence[str]
    beyond: Sequence[str]
    disputed: Sequence[str]
    publishers: Sequence[str]
    velocity_source: str
    topic: str
    robot: str
    reliable: bool = True
    lost: int | None = None
    lost_of_late: int = 0
    acceleration_delay: float = 0.0
    work: Work = field(default_factory=Work)
    silent: str = ''
    integrated: float = 0.0
    deviation: float | None = None


def input_status(state: InputState) -> StatusText:
    """Return level, sentence and values of the input."""
    level, sentence = _verdict(state)
    rate = state.news.get(estimator.ACCEPTED, 0) / state.interval if state.interval > 0.0 else 0.0
    rejected = sum(state.counts.get(reason, 0) for reason in REJECTED)
    values = [
        ('robot', state.robot),
        ('topic', state.topic),
        ('input rate', f'{rate:.1f} Hz'),
        ('age', 'never heard' if math.isinf(state.age) else f'{state.age:.3f} s'),
        ('publishers', f'{len(state.publishers)}'),
        ('publisher names', ', '.join(state.publishers)),
        ('reliability', 'reliable' if state.reliable else 'best effort'),
        ('lost', 'not known' if state.lost is None else f'{state.lost}'),
        ('missing joints', ', '.join(state.missing)),
        ('joints beyond their limits', ', '.join(state.beyond)),
        ('joints that publishers disagree about', ', '.join(state.disputed)),
        ('velocity source', state.velocity_source),
        *(
            (('acceleration delay', f'{state.acceleration_delay:.3g} s'),)
            if state.acceleration_delay
            else ()
        ),
        ('accepted', f'{state.counts.get(estimator.ACCEPTED, 0)}'),
        ('ignored: none of our joints', f'{state.counts.get(estimator.NOT_OURS, 0)}'),
        ('ignored: no position', f'{state.counts.get(estimator.NO_POSITION, 0)}'),
        ('dropped: stamp not newer', f'{state.counts.get(estimator.DROPPED, 0)}'),
        ('waiting for other joints', f'{state.counts.get(estimator.WAITING, 0)}'),
        ('not stamped', f'{state.counts.get(estimator.NOT_STAMPED, 0)}'),
        ('resets', f'{state.counts.get(estimator.RESETS, 0)}'),
        ('rejected', f'{rejected}'),
        *(
            (f'rejected: {reason}', f'{state.counts.get(reason, 0)}')
            for reason in REJECTED
            if reason != estimator.NOT_CLOSED or state.counts.get(reason, 0)  # of few arms
        ),
        ('left out: came faster than answered', f'{state.counts.get(LEFT_OUT, 0)}'),
        ('internal errors', f'{state.counts.get(INTERNAL_ERROR, 0)}'),
        ('processing time, mean', f'{state.work.mean * 1e-3:.0f} us'),
        ('processing time, longest', f'{state.work.longest * 1e-3:.0f} us'),
    ]
    return StatusText(level, sentence, tuple(values))


def _verdict(state: InputState) -> tuple[Level, str]:
    if state.silent:
        return Level.OK, state.silent
    if state.missing:
        if math.isinf(state.age) and not state.counts.get(estimator.ACCEPTED, 0):
            who = f'{len(state.publishers)} publishers' if state.publishers else 'no publisher'
            return (
                Level.ERROR,
                f'no joint state was received on {state.topic} ({who}): missing '
                f'{", ".join(state.missing)}',
            )
        return Level.ERROR, f'joint states are stale: missing {", ".join(state.missing)}'
    warnings = tuple(_warnings(state))
    if warnings:
        return Level.WARN, '; '.join(warnings)
    if state.velocity_source == 'difference':
        return Level.OK, 'fine; velocities are differences of positions'
    if state.velocity_source == 'none':
        return Level.OK, 'fine, but without velocities: no twist'
    return Level.OK, 'fine'


def _warnings(state: InputState) -> Iterator[str]:
    if state.disputed:
        yield (
            f'publishers disagree about {", ".join(state.disputed)}: '
            f'{" and ".join(dict.fromkeys(state.publishers))}'
        )
    if state.beyond:
        yield f'beyond the limits: {", ".join(state.beyond)}'
    rejected = [reason for reason in REJECTED if state.news.get(reason, 0)]
    if rejected:
        yield f'messages rejected: {", ".join(rejected)}'
    if state.lost_of_late:
        yield f'{state.lost_of_late} messages lost within {RECENT:g} s'
    if state.integrated:
        off = 'how far is not known: the robot file has no velocity_noise'
        if state.deviation is not None:
            off = f'{state.deviation:.2g} rad or m (one standard deviation), and more by offsets'
        since = f'positions are counted on from velocities for {state.integrated:.1f} s'
        yield f'{since}; off by: {off}'
    left_out = state.news.get(LEFT_OUT, 0)
    if left_out:
        yield f'messages come faster than they can be answered: {left_out} left out'
    if state.news.get(INTERNAL_ERROR, 0):
        yield 'messages caused an internal error; see the log'
