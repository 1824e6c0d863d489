# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Make the diagnostic status of a node's input: numbers of joint states accepted and refused, missing
joints, lost messages.
"""

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ..estimation import outcomes
from ..estimation.estimator import Estimator
from ..estimation.input_checks import JointMessages, arrival_jitter, input_faults, zeros_of
from ..estimation.joint_accelerations import JointAccelerations
from ..estimation.status_text import StatusText
from ..robot.measures import Level
from ..typography import counted
from .best_subscription import BestSubscription
from .unmatched_names import shown, unmatched_in_words

REJECTED = (
    outcomes.UNREADABLE,
    outcomes.MALFORMED,
    outcomes.DUPLICATE,
    outcomes.NOT_FINITE,
    outcomes.TOO_LARGE,
    outcomes.NOT_CLOSED,
    outcomes.TOO_FAST,
)
# Two reasons for refusing a message. The first can occur only for arms with closed loops, the
# second only if velocities are integrated. The status shows a reason only after it occurred.
RARE = (outcomes.NOT_CLOSED, outcomes.TOO_FAST)
INTERNAL_ERROR = 'internal error'
# After the loss of a message or a reset of the estimator, the status reports this event for this
# time, s.
REPORTED_TIME = 10.0
# Largest number of resets of the estimator within `REPORTED_TIME` that cause no warning. A
# recording that is played in a loop also causes resets.
MAX_RESETS = 3
LEFT_OUT = 'left out'


class InputState(NamedTuple):
    """
    The state of the node's input, joint states, from which the diagnostics are made.

    Attributes
    ----------
    counts, news
        Numbers of messages by outcome: `counts` since the start, `news` since the last
        diagnostics.
    interval : s
        Time since the last diagnostics.
    arrival : ns
        The present time of the steady clock.
    publishers
        Full names of the nodes that publish joint states.
    recent_losses, recent_resets
        Number of lost messages, and of resets of the estimator, within `REPORTED_TIME`.
    at_least
        The text `at least ` if the number of lost messages is a lower bound; otherwise empty.
    work : ns
        Processing times of messages since the last diagnostics.
    velocity_source
        Source of the joint velocities of the last state: `message`, `difference` or `none`.
    silent
        The reason why the node answers no messages; empty if it answers.
    messages
        The last messages, grouped by their joint names.
    simulated : ns
        The simulated time; 0 before the first message on /clock; None without simulated time.
    """

    counts: Counter[str]
    news: Counter[str]
    interval: float
    arrival: int
    publishers: Sequence[str]
    recent_losses: int
    recent_resets: int
    at_least: str
    work: Sequence[int]
    velocity_source: str
    silent: str
    messages: Sequence[JointMessages]
    simulated: int | None


def input_status(
    arm: Estimator, subscription: BestSubscription, state: InputState, warnings: Sequence[str]
) -> StatusText:
    """Return the diagnostic status of an arm's input, made from the state of the input."""
    level, sentence = _verdict(arm, subscription.topic_name, state, warnings)
    counts, work, delay = state.counts, state.work, arm.quantity(JointAccelerations).delay
    rate = state.news[outcomes.ACCEPTED] / state.interval if state.interval > 0.0 else 0.0
    rejected = sum(counts[reason] for reason in REJECTED)
    age, lost = arm.joints.age(state.arrival), subscription.lost
    values = [
        ('robot', arm.robot.name),
        ('topic', subscription.topic_name),
        ('input rate', f'{rate:.1f} Hz'),
        ('age', 'never heard' if math.isinf(age) else f'{age:.3f} s'),
        ('publishers', f'{len(state.publishers)}'),
        ('publisher names', ', '.join(state.publishers)),
        ('reliability', 'reliable' if subscription.is_reliable else 'best effort'),
        ('lost', 'not known' if lost is None else f'{state.at_least}{lost}'),
        ('missing joints', ', '.join(arm.joints.missing(state.arrival))),
        ('joints beyond their limits', ', '.join(arm.beyond_limits())),
        ('joints that publishers disagree about', ', '.join(_disputed(arm, state))),
        ('velocity source', state.velocity_source),
        *([('acceleration delay', f'{delay:.3g} s')] if delay else []),
        ('accepted', f'{counts[outcomes.ACCEPTED]}'),
        ('ignored: none of our joints', f'{counts[outcomes.NOT_OURS]}'),
        ('ignored: no position', f'{counts[outcomes.NO_POSITION]}'),
        ('dropped: stamp not newer', f'{counts[outcomes.DROPPED]}'),
        ('waiting for other joints', f'{counts[outcomes.WAITING]}'),
        ('not stamped', f'{counts[outcomes.NOT_STAMPED]}'),
        ('resets', f'{counts[outcomes.RESETS]}'),
        ('rejected', f'{rejected}'),
        *(
            (f'rejected: {reason}', f'{counts[reason]}')
            for reason in REJECTED
            if reason not in RARE or counts[reason]
        ),
        ('left out: came faster than answered', f'{counts[LEFT_OUT]}'),
        ('internal errors', f'{counts[INTERNAL_ERROR]}'),
        ('processing time, mean', f'{sum(work) / max(len(work), 1) * 1e-3:.0f} us'),
        ('processing time, longest', f'{max(work, default=0) * 1e-3:.0f} us'),
    ]
    return StatusText(level, sentence, tuple(values))


def _disputed(arm: Estimator, state: InputState) -> Sequence[str]:
    return arm.joints.disputed(state.arrival) if len(state.publishers) > 1 else ()


def _verdict(
    arm: Estimator, topic: str, state: InputState, warnings: Sequence[str]
) -> tuple[Level, str]:
    if state.silent:
        return Level.OK, state.silent
    if incomplete := incomplete_in_words(arm, topic, state, warnings):
        return Level.ERROR, incomplete
    if warnings:
        return Level.WARN, '; '.join(warnings)
    unstamped = ''.join(f'; {text}' for text in [unstamped_in_words(arm, state)] if text)
    if state.velocity_source == 'difference':
        return Level.OK, f'fine; velocities are differences of positions{unstamped}'
    if state.velocity_source == 'none':
        return Level.OK, f'fine, but without velocities: no twist{unstamped}'
    return Level.OK, 'fine'


def incomplete_in_words(
    arm: Estimator, topic: str, state: InputState, warnings: Sequence[str]
) -> str:
    """
    Return a text that names the joints without a position, and the reason; '' if all joints have
    a position.
    """
    missing = ', '.join(arm.joints.missing(state.arrival))
    if not missing:
        return ''
    if unmatched := unmatched_in_words(arm, topic):
        return unmatched
    if not state.counts:
        count = len(state.publishers)
        detail = counted(count, 'publisher') if count else 'no publisher'
        return f'no joint state was received on {topic} ({detail}): missing {missing}'
    text = f'joint states are stale: missing {missing}'
    if math.isinf(arm.joints.age(state.arrival)) and not state.counts[outcomes.ACCEPTED]:
        detail = ', '.join(f'{reason}: {count}' for reason, count in state.counts.items())
        text = f'no complete joint state was received on {topic} ({detail}): missing {missing}'
    expected = {*arm.names, *(mimic.name for mimic in arm.robot.description.mimics)}
    if unknown := {
        name for group in state.messages for name in group.names if name not in expected
    }:
        text += f'; messages name {shown(sorted(unknown))}, too: map them with joint_names'
    if state.counts[outcomes.NO_POSITION]:
        text += '; messages have no position: set integrate_velocities to use velocities'
    return '; '.join([text, *warnings])


def unstamped_in_words(arm: Estimator, state: InputState) -> str:
    """
    Return a warning if messages have neither stamps nor velocities; else ''.

    In this case the node computes velocities from times of arrival, so the velocities are noisy.
    """
    if not state.news[outcomes.NOT_STAMPED] or state.velocity_source == 'message':
        return ''
    return arrival_jitter(state.messages, arm.names)


def input_warnings(arm: Estimator, state: InputState) -> Iterator[str]:
    """Yield a sentence for each fault of the input."""
    disputed = _disputed(arm, state)
    if disputed:
        zeros, total = zeros_of(state.messages, disputed)
        yield (
            f'publishers disagree about {", ".join(disputed)}: '
            f'{" and ".join(dict.fromkeys(state.publishers))}'
            f'{f"; {zeros} of {total} messages report 0 for these joints" if zeros else ""}'
        )
    if beyond := arm.beyond_limits():
        yield f'beyond the limits: {", ".join(beyond)}'
    if state.recent_losses:
        yield f'{state.at_least}{state.recent_losses} messages lost within {REPORTED_TIME:g} s'
    if state.recent_resets > MAX_RESETS:
        yield (
            f'stamps stepped back by more than joint_state_timeout {state.recent_resets} times '
            f'within {REPORTED_TIME:g} s: two clocks, or a recording in a loop; synchronize the '
            'clocks of all that publish joint states'
        )
    for group in state.messages:
        period = 1e-9 * float(np.median(np.diff(group.arrivals))) if len(group.q) > 1 else 0.0
        timeout = 1e-9 * arm.settings.timeout
        if period > timeout and not set(arm.names).isdisjoint(group.names):
            yield (
                f'a joint state comes every {period:.3g} s, but joint_state_timeout is '
                f'{timeout:.3g} s: set it to {2.0 * period:.2g}'
            )
    if state.simulated == 0 and state.news[outcomes.NOT_STAMPED]:
        yield 'no twist without stamps: no /clock was received; publish it or unset use_sim_time'
    if arm.integration.seconds:
        off = 'unknown; write velocity_noise in the robot file'
        deviation = arm.integration.deviation(arm.robot)
        if deviation is not None:
            off = f'{deviation:.2g} rad or m (one standard deviation), plus offsets'
        since = f'positions are integrated from velocities for {arm.integration.seconds:.1f} s'
        yield f'{since}; their error: {off}'
    robot, settings = arm.robot, arm.settings
    names = {mimic.name: mimic.name for mimic in robot.description.mimics}
    joints = zip(robot.joint_names, arm.names)
    names |= {joint: name for joint, name in joints if name not in disputed}
    reported, simulated = settings.velocity_source != 'difference', state.simulated is not None
    yield from input_faults(state.messages, robot, names, settings.timeout, simulated, reported)


def message_warnings(state: InputState) -> Iterator[str]:
    """
    Yield a sentence for each reason why the node published no results for some joint states.

    The node has already logged each reason.
    """
    if rejected := [reason for reason in REJECTED if state.news[reason]]:
        yield f'messages rejected: {", ".join(rejected)}'
    if left_out := state.news[LEFT_OUT]:
        yield f'messages come faster than they can be answered: {left_out} left out'
    if state.news[INTERNAL_ERROR]:
        yield 'messages caused an internal error; see the log'
