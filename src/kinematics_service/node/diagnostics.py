"""
The state of the input as a DiagnosticArray: the messages received, their outcomes, missing joints.
"""

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..estimation import estimator
from ..estimation.input_checks import JointMessages, arrival_jitter, input_faults, zeros_of
from ..estimation.joint_accelerations import JointAccelerations
from ..estimation.status_text import StatusText
from ..robot.measures import Level
from ..typography import counted
from .best_subscription import BestSubscription
from .unmatched_names import shown, unmatched_in_words

REJECTED = (
    estimator.UNREADABLE,
    estimator.MALFORMED,
    estimator.DUPLICATE,
    estimator.NOT_FINITE,
    estimator.TOO_LARGE,
    estimator.NOT_CLOSED,
    estimator.TOO_FAST,
)
# Shown only if counted: reasons of few arms or settings.
RARE = (estimator.NOT_CLOSED, estimator.TOO_FAST)
INTERNAL_ERROR = 'internal error'
# Time for which a loss is warned of, s.
RECENT = 10.0
# More steps back of stamps within `RECENT` are a fault: a recording restarts less often.
RESET_LIMIT = 3
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


class InputState(NamedTuple):
    """
    What was heard since the last diagnostics.

    Attributes
    ----------
    counts, news
        Messages by outcome: all, and those since the last diagnostics.
    interval : s
        Time since the last diagnostics.
    arrival : ns
        Now, steady clock.
    publishers
        Full names of the nodes that publish joint states.
    lost_of_late, resets_of_late
        Messages lost, and resets, within `RECENT`.
    at_least
        `at least `, to be put before the numbers of lost messages; empty if they are exact.
    work
        Processing times.
    velocity_source
        Source of the velocities of the last state.
    silent
        Why nothing is answered; empty if it is.
    messages
        The last ones, those of the same names together.
    simulated : ns
        The simulated time, 0 before any was received; None if time is not simulated.
    """

    counts: Counter[str]
    news: Counter[str]
    interval: float
    arrival: int
    publishers: Sequence[str]
    lost_of_late: int
    resets_of_late: int
    at_least: str
    work: Work
    velocity_source: str
    silent: str
    messages: Sequence[JointMessages]
    simulated: int | None


def input_status(
    arm: estimator.Estimator,
    subscription: BestSubscription,
    heard: InputState,
    warnings: Sequence[str],
) -> StatusText:
    """Return level, sentence and values of the input of an arm."""
    level, sentence = _verdict(arm, subscription.topic_name, heard, warnings)
    counts, work, delay = heard.counts, heard.work, arm.quantity(JointAccelerations).delay
    rate = heard.news[estimator.ACCEPTED] / heard.interval if heard.interval > 0.0 else 0.0
    rejected = sum(counts[reason] for reason in REJECTED)
    age, lost = arm.age(heard.arrival), subscription.lost
    values = [
        ('robot', arm.robot.name),
        ('topic', subscription.topic_name),
        ('input rate', f'{rate:.1f} Hz'),
        ('age', 'never heard' if math.isinf(age) else f'{age:.3f} s'),
        ('publishers', f'{len(heard.publishers)}'),
        ('publisher names', ', '.join(heard.publishers)),
        ('reliability', 'reliable' if subscription.is_reliable else 'best effort'),
        ('lost', 'not known' if lost is None else f'{heard.at_least}{lost}'),
        ('missing joints', ', '.join(arm.missing(heard.arrival))),
        ('joints beyond their limits', ', '.join(arm.beyond_limits())),
        ('joints that publishers disagree about', ', '.join(_disputed(arm, heard))),
        ('velocity source', heard.velocity_source),
        *([('acceleration delay', f'{delay:.3g} s')] if delay else []),
        ('accepted', f'{counts[estimator.ACCEPTED]}'),
        ('ignored: none of our joints', f'{counts[estimator.NOT_OURS]}'),
        ('ignored: no position', f'{counts[estimator.NO_POSITION]}'),
        ('dropped: stamp not newer', f'{counts[estimator.DROPPED]}'),
        ('waiting for other joints', f'{counts[estimator.WAITING]}'),
        ('not stamped', f'{counts[estimator.NOT_STAMPED]}'),
        ('resets', f'{counts[estimator.RESETS]}'),
        ('rejected', f'{rejected}'),
        *(
            (f'rejected: {reason}', f'{counts[reason]}')
            for reason in REJECTED
            if reason not in RARE or counts[reason]
        ),
        ('left out: came faster than answered', f'{counts[LEFT_OUT]}'),
        ('internal errors', f'{counts[INTERNAL_ERROR]}'),
        ('processing time, mean', f'{work.mean * 1e-3:.0f} us'),
        ('processing time, longest', f'{work.longest * 1e-3:.0f} us'),
    ]
    return StatusText(level, sentence, tuple(values))


def _disputed(arm: estimator.Estimator, heard: InputState) -> Sequence[str]:
    return arm.disputed(heard.arrival) if len(heard.publishers) > 1 else ()


def _verdict(
    arm: estimator.Estimator, topic: str, heard: InputState, warnings: Sequence[str]
) -> tuple[Level, str]:
    if heard.silent:
        return Level.OK, heard.silent
    if incomplete := incomplete_in_words(arm, topic, heard, warnings):
        return Level.ERROR, incomplete
    if warnings:
        return Level.WARN, '; '.join(warnings)
    unstamped = ''.join(f'; {text}' for text in [unstamped_in_words(arm, heard)] if text)
    if heard.velocity_source == 'difference':
        return Level.OK, f'fine; velocities are differences of positions{unstamped}'
    if heard.velocity_source == 'none':
        return Level.OK, f'fine, but without velocities: no twist{unstamped}'
    return Level.OK, 'fine'


def incomplete_in_words(
    arm: estimator.Estimator, topic: str, heard: InputState, warnings: Sequence[str]
) -> str:
    """Return which joints have no position, and why; empty if all have one."""
    missing = ', '.join(arm.missing(heard.arrival))
    if not missing:
        return ''
    if unmatched := unmatched_in_words(arm, topic):
        return unmatched
    if not heard.counts:
        count = len(heard.publishers)
        why = counted(count, 'publisher') if count else 'no publisher'
        return f'no joint state was received on {topic} ({why}): missing {missing}'
    text = f'joint states are stale: missing {missing}'
    if math.isinf(arm.age(heard.arrival)) and not heard.counts[estimator.ACCEPTED]:
        why = ', '.join(f'{reason}: {count}' for reason, count in heard.counts.items())
        text = f'no complete joint state was received on {topic} ({why}): missing {missing}'
    known = {*arm.names, *(one.name for one in arm.robot.description.mimics)}
    if unknown := {name for one in heard.messages for name in one.names if name not in known}:
        text += f'; messages name {shown(sorted(unknown))}, too: joint_names maps other names'
    if heard.counts[estimator.NO_POSITION]:
        text += '; messages have no position: integrate_velocities counts on from velocities'
    return '; '.join([text, *warnings])


def unstamped_in_words(arm: estimator.Estimator, heard: InputState) -> str:
    """Return what speeds mean if messages have neither stamps nor velocities; '' if they have."""
    if not heard.news[estimator.NOT_STAMPED] or heard.velocity_source == 'message':
        return ''
    return arrival_jitter(heard.messages, arm.names)


def input_warnings(arm: estimator.Estimator, heard: InputState) -> list[str]:
    """Return what is wrong with the input, in sentences."""
    settings, robot, disputed = arm.settings, arm.robot, _disputed(arm, heard)
    names = {one.name: one.name for one in robot.description.mimics}
    joints = zip(robot.joint_names, arm.names)
    names |= {joint: name for joint, name in joints if name not in disputed}
    reported = settings.velocity_source != 'difference'
    simulated = heard.simulated is not None
    return [
        *_warnings(arm, heard),
        *input_faults(heard.messages, robot, names, settings.timeout, simulated, reported),
    ]


def _warnings(arm: estimator.Estimator, heard: InputState) -> Iterator[str]:
    if disputed := _disputed(arm, heard):
        zeros, total = zeros_of(heard.messages, disputed)
        yield (
            f'publishers disagree about {", ".join(disputed)}: '
            f'{" and ".join(dict.fromkeys(heard.publishers))}'
            f'{f"; {zeros} of {total} messages report 0 for these joints" if zeros else ""}'
        )
    if beyond := arm.beyond_limits():
        yield f'beyond the limits: {", ".join(beyond)}'
    if heard.lost_of_late:
        yield f'{heard.at_least}{heard.lost_of_late} messages lost within {RECENT:g} s'
    if heard.resets_of_late > RESET_LIMIT:
        yield (
            f'stamps stepped back by more than joint_state_timeout {heard.resets_of_late} times '
            f'within {RECENT:g} s: two clocks, or a recording in a loop; synchronize the clocks '
            'of all that publish joint states'
        )
    for group in heard.messages:
        every = 1e-9 * float(np.median(np.diff(group.arrivals))) if len(group.q) > 1 else 0.0
        timeout = 1e-9 * arm.settings.timeout
        if every > timeout and not set(arm.names).isdisjoint(group.names):
            yield (
                f'a joint state comes every {every:.3g} s, but joint_state_timeout is '
                f'{timeout:.3g} s: set it to {2.0 * every:.2g}'
            )
    if heard.simulated == 0 and heard.news[estimator.NOT_STAMPED]:
        yield 'no twist without stamps: no /clock was received; publish it or unset use_sim_time'
    if arm.integration.seconds:
        off = 'how far is not known: the robot file has no velocity_noise'
        deviation = arm.integration.deviation(arm.robot)
        if deviation is not None:
            off = f'{deviation:.2g} rad or m (one standard deviation), and more by offsets'
        since = f'positions are counted on from velocities for {arm.integration.seconds:.1f} s'
        yield f'{since}; off by: {off}'


def message_warnings(heard: InputState) -> Iterator[str]:
    """Return what happened to single messages, in sentences; each was logged at once."""
    if rejected := [reason for reason in REJECTED if heard.news[reason]]:
        yield f'messages rejected: {", ".join(rejected)}'
    if left_out := heard.news[LEFT_OUT]:
        yield f'messages come faster than they can be answered: {left_out} left out'
    if heard.news[INTERNAL_ERROR]:
        yield 'messages caused an internal error; see the log'
