# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Check the JointState messages of the last seconds for wrong stamps, jumps of positions, excessive
speeds, wrong velocities and wrong mimic joints.

Stamps are compared with times of arrival; the module `motion_checks` checks the motions. Lags,
bursts and noise of healthy drivers are not faults. Each fault is reported as a sentence that
begins with the kind of fault and a colon.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..kernel import LARGEST, Floats, Integers
from ..robot.robot import Robot
from . import motion_checks
from .cdr import SECOND
from .joint_state_columns import Flags, columns_of
from .motion_checks import POSITION_TOLERANCE, SAMPLE_MINIMUM

# Largest number of messages that are kept for the checks: one second at 1 kHz.
MESSAGE_LIMIT = 1000
# Largest size of a message that is checked, bytes. The kept messages take at most 8 MB.
SIZE_LIMIT = 8192
# Age up to which messages are checked, ns. In 5 s a driver of 2 Hz sends ten messages.
WINDOW = 5 * SECOND
# Largest number of different lists of joint names among the checked messages. It is small, because
# a topic has few drivers, and each driver sends one list.
FORM_LIMIT = 8
# The pace is the time between two stamps divided by the time between the arrivals of the same two
# messages. A pace above PACE or below 1 / PACE is a fault.
PACE = 3.0
MICROSECONDS = 'nanosec most likely holds microseconds; write nanoseconds'
MILLISECONDS = 'nanosec most likely holds milliseconds; write nanoseconds'
# Most likely cause of a wrong pace. Each key is a pace: time between two stamps divided by the
# time between the arrivals of the same two messages.
PACE_CAUSES = {1e3: 'sec most likely holds milliseconds', 1e-3: MICROSECONDS, 1e-6: MILLISECONDS}
# Relative tolerance of a pace: the time between two stamps divided by the time between the
# arrivals of the same two messages. If a key of PACE_CAUSES agrees with the measured pace within
# the tolerance, the warning names the cause of the key. Jitter of stamps changes the pace by less
# than the tolerance, because the pace is measured over half a second or more.
PACE_TOLERANCE = 0.1
# Likely causes if the field nanosec of stamps has too small numbers. For example, nanosec stays
# below 1000 if it holds milliseconds. The likely cause is the value of the first key that exceeds
# every nanosec in the stamps of several seconds.
NANOSEC_CAUSES = {
    1: 'their stamps are whole seconds; fill nanosec',
    SECOND // 1_000_000: MILLISECONDS,
    SECOND // 1000: MICROSECONDS,
    SECOND // 100: 'nanosec most likely counts steps of 100 ns; write nanoseconds',
    SECOND // 10: 'nanosec most likely counts steps of 10 ns; write nanoseconds',
}
# A measured speed may exceed the velocity limit by this factor, because jitter of stamps adds 10 %
# to a speed averaged over SPEED_BASELINE.
SPEED_TOLERANCE = 1.1
# A mimic joint lags behind the joint that it follows by an unknown time. The two joints are
# compared at each of these lags, s. The lags are 0.02 s apart, so the nearest one differs from the
# true lag by at most 0.01 s. At 1 rad/s this is 0.01 rad, half of POSITION_TOLERANCE.
MIMIC_LAGS = np.linspace(0.0, 0.5, 26)


class JointMessages(NamedTuple):
    """
    N JointState messages with equal lists of k joint names, as arrays.

    Attributes
    ----------
    arrivals, seconds, nanoseconds : shape (N,)
        Time of arrival (steady clock), ns; the two fields of the stamp, s and ns.
    q, qdot : shape (N, k), rad or m, rad/s or m/s
        NaN in `qdot` if the messages report no velocities.
    """

    names: tuple[str, ...]
    arrivals: Integers
    seconds: Integers
    nanoseconds: Integers
    q: Floats
    qdot: Floats

    @property
    def stamps(self) -> Integers:
        """Return the stamps of the messages, shape (N,), ns."""
        return self.seconds * SECOND + self.nanoseconds

    @property
    def duration(self) -> str:
        """Return the time between the first and the last arrival as text, with its unit."""
        return f'{1e-9 * float(self.arrivals[-1] - self.arrivals[0]):.2g} s'

    def taken(self, rows: slice | Flags) -> 'JointMessages':
        """Return the messages whose indices `rows` selects."""
        return JointMessages._make([self.names, *(column[rows] for column in self[1:])])

    def newest(self, timeout: int) -> 'JointMessages':
        """
        Return the messages since the last reset of the clock. A reset is a step of the stamps back
        by more than `timeout` (ns).
        """
        return self.taken(slice(_last(np.diff(self.stamps) < -timeout), None))


def messages_of(recent: Sequence[tuple[int, bytes]], now: int) -> list[JointMessages]:
    """
    Return the messages of the last `WINDOW` ns, grouped by joint names.

    `recent` has the time of arrival (ns) and the bytes of each message; `now` is the present time
    (ns).
    """
    groups, waiting = list[JointMessages](), [pair for pair in recent if now - pair[0] <= WINDOW]
    for _ in range(FORM_LIMIT):
        if not waiting:
            break
        size = len(waiting[-1][1])
        arrivals, raws = zip(*(pair for pair in waiting if len(pair[1]) == size))
        waiting = [pair for pair in waiting if len(pair[1]) != size]
        if (columns := columns_of(raws)) is None:
            continue
        alike, names, q, qdot = columns.alike, columns.names, columns.positions, columns.velocities
        waiting = [*(pair for pair, same in zip(zip(arrivals, raws), alike) if not same), *waiting]
        if q.shape[1] == len(set(names)) == len(names):
            qdot = qdot if qdot.shape == q.shape else np.full(q.shape, np.nan)
            stamps = columns.seconds, columns.nanoseconds
            group = JointMessages(names, np.array(arrivals, dtype=np.int64), *stamps, q, qdot)
            groups.append(group.taken(alike))
    return groups


def input_faults(
    groups: Sequence[JointMessages],
    robot: Robot,
    names: Mapping[str, str],
    timeout: int,
    simulated: bool = False,
    reported: bool = True,
) -> list[str]:
    """
    Return a sentence for each fault of the joint states that was found.

    Parameters
    ----------
    groups
        Messages of some seconds, grouped by joint names.
    robot, names
        The arm, and for each joint to check, including mimic joints, its name in messages.
    timeout : ns
        If a stamp steps back by more than this, the clock was reset, and earlier messages are
        ignored.
    simulated
        Whether ROS time is simulated. If it is, stamps may advance at any rate.
    reported
        Whether the estimator uses the velocities of messages.
    """
    faults, offsets = list[str](), dict[str, float]()
    ours = {names[name]: j for j, name in enumerate(robot.joint_names) if name in names}
    with np.errstate(all='ignore'):  # suppress warnings: huge numbers in messages overflow
        for group in groups:
            group = group.newest(timeout)
            if ours.keys().isdisjoint(group.names) or len(group.q) < SAMPLE_MINIMUM:
                continue
            fault = _stamp_fault(group, simulated) if group.stamps[-1] else ''
            if group.stamps[-1] and not simulated:
                offsets[group.names[0]] = float(np.median(group.stamps - group.arrivals))
            # Motions are not checked if stamps are wrong, because speeds depend on the stamps.
            faults += [fault] if fault else _motion_faults(group, robot, ours, reported)
        apart = 1e-9 * float(np.ptp([*offsets.values()])) if offsets else 0.0
        if not faults and apart > 1e-9 * timeout:
            faults.append(
                f'stamps of messages with {" and ".join(offsets)} are {apart:.3g} s apart: '
                'synchronize the clocks of their publishers, or find what is late'
            )
        return [*faults, *_mimic_faults(groups, robot, names)]


def arrival_jitter(groups: Sequence[JointMessages], names: Sequence[str]) -> str:
    """
    Return a sentence on the errors of joint speeds that are computed from times of arrival. Jitter
    of the arrivals causes these errors.
    """
    text = 'no stamps: speeds are differences over times of arrival'
    for group in groups:
        if len(group.q) >= SAMPLE_MINIMUM and not set(names).isdisjoint(group.names):
            # Half the range of the middle 68 % of the intervals is the standard deviation if the
            # intervals are normally distributed.
            low, middle, high = np.percentile(np.diff(group.arrivals) * 1e-6, (16, 50, 84))
            jitter = 0.5 * float(high - low)
            text += f'; an arrival jitter of {jitter:.2g} ms in {middle:.3g} ms '
            text += f'makes them wrong by about {100.0 * jitter / middle:.1f} %'
    return text


def zeros_of(groups: Sequence[JointMessages], names: Sequence[str]) -> tuple[int, int]:
    """
    Return two counts (zeros, total) of messages that contain at least one joint of `names`.

    `total` counts all these messages. `zeros` counts only messages in which the joints of `names`
    are all at position 0.
    """
    values = [group.q[:, np.isin(group.names, names)] for group in groups]
    values = [q for q in values if q.shape[1]]
    return sum(int(np.sum(np.all(q == 0.0, axis=1))) for q in values), sum(map(len, values))


def _last(where: Flags) -> int:
    # `where` has a flag for each interval between two messages. Returns the index of the message
    # after the last interval with a true flag, or 0 if no flag is true.
    return int(np.flatnonzero(np.append(True, where))[-1])


# The next functions check the stamps.


def _stamp_fault(group: JointMessages, simulated: bool) -> str:
    # Returns a sentence about the first fault of the stamps that is found, or ''.
    late = group.arrivals > group.arrivals[-1] - SECOND
    late[-SAMPLE_MINIMUM:] = True
    if np.ptp(group.stamps[late]) == 0:
        frozen = group.taken(slice(int(np.argmax(group.stamps == group.stamps[-1])), None))
        stamp = f'{frozen.seconds[0]}.{frozen.nanoseconds[0]:09d}'
        total = f'{len(frozen.q)} messages in {frozen.duration}'
        return f'{total}, all with the stamp {stamp}: the driver must stamp each message anew'
    total, largest = f'{len(group.q)} messages in {group.duration}', int(group.nanoseconds.max())
    dropped, cause = ~_advances(group.stamps), _cause_of_nanosec(group)
    # The estimator drops messages whose stamps do not advance. If it drops most messages of the
    # last second, leave out copies that a relay has sent, and count again.
    if 2 * np.sum(dropped & late) > np.sum(late):
        late &= ~(dropped & _came_twice(group))
    if 2 * np.sum(dropped & late) > np.sum(late):
        reason = cause or (
            'their stamps are not newer than that of a message before; stamp each message with '
            'the time of its measurement; if several nodes publish, synchronize their clocks'
        )
        return f'{int(np.sum(dropped))} of {total} dropped: {reason}'
    if cause:
        return f'stamps hardly advance within a second: {cause}'
    if (pace := 1.0 if simulated else _pace(group)) != 1.0:
        side = f'{pace:.1f} times faster' if pace > 1.0 else f'{1.0 / pace:.1f} times slower'
        likely = 'is it simulated (set use_sim_time), or a recording at another rate?'
        for ratio, cause in PACE_CAUSES.items():
            likely = cause if abs(pace / ratio - 1.0) < PACE_TOLERANCE else likely
        return f'time by stamps is wrong: it passes {side} than time of arrival; {likely}'
    if largest >= SECOND:
        return f'nanosec of stamps is a second or more: {largest}; it must be below {SECOND}'
    return ''


def _advances(stamps: Integers) -> Flags:
    # Returns for each message whether its stamp is newer than all earlier stamps.
    return np.append(True, stamps[1:] > np.maximum.accumulate(stamps)[:-1])


def _came_twice(group: JointMessages) -> Flags:
    # Returns for each message whether exactly one other message has equal stamp and numbers. A
    # relay of the topic sends such copies.
    columns = zip(group.stamps, group.q, group.qdot)
    messages = [b''.join(value.tobytes() for value in row) for row in columns]
    counts = Counter(messages)
    return np.array([counts[message] == 2 for message in messages])


def _cause_of_nanosec(group: JointMessages) -> str:
    # Returns the likely cause if nanosec in the stamps has too small numbers, else ''. The cause
    # is the value of the first key in NANOSEC_CAUSES that exceeds every nanosec in the stamps.
    # Also returns '' if all stamps have equal sec, or if sec mostly changes from message to
    # message, because nothing can then be said about nanosec.
    gaps = np.diff(group.arrivals)
    within = gaps[np.diff(group.seconds) == 0].sum()
    if 2 * within < gaps.sum() or np.ptp(group.seconds) == 0:
        return ''
    largest = group.nanoseconds.max()
    return next((cause for bound, cause in NANOSEC_CAUSES.items() if largest < bound), '')


def _pace(group: JointMessages) -> float:
    # Returns the pace of the messages since the stamps last stepped back: (last stamp - first
    # stamp) / (last arrival - first arrival). Returns 1 if the pace is right in the first or in
    # the second half of the messages. A pace that is wrong in only one half comes from a burst of
    # messages or a step of a clock, and is not a fault.
    begin = _last(np.diff(group.stamps) < 0)
    s, t = group.stamps[begin:], group.arrivals[begin:]
    middle = int(np.searchsorted(t, (t[0] + t[-1]) // 2))
    if len(t) < SAMPLE_MINIMUM or not 0 < middle < len(t) - 1 or t[-1] - t[0] < SECOND // 2:
        return 1.0
    at = [0, middle, -1]
    paces = np.diff(s[at]) / np.diff(t[at])
    off = paces.min() > PACE or paces.max() < 1.0 / PACE
    return float((s[-1] - s[0]) / (t[-1] - t[0])) if off else 1.0


# The next functions check the motions of joints.


def _motion_faults(
    group: JointMessages, robot: Robot, ours: Mapping[str, int], reported: bool
) -> Iterator[str]:
    places = {name: group.names.index(name) for name in ours if name in group.names}
    sizes = [np.abs(values[:, list(places.values())]) for values in (group.q, group.qdot)]
    known, usable = (np.all(values <= LARGEST, axis=1) for values in sizes)
    # Replace all velocities of a message by NaN if one of its velocities is not usable, because
    # the estimator uses either all velocities of a message or none.
    group = group._replace(qdot=np.where(reported & usable[:, None], group.qdot, np.nan))
    unstamped = group.stamps[-1] == 0
    group = group.taken(known & (unstamped | _advances(group.stamps)))
    times = group.arrivals if unstamped else group.stamps
    if len(times) < SAMPLE_MINIMUM:
        return
    t, steps = 1e-9 * (times - times[0]), dict[str, Floats]()
    fast, contrary = list[str](), list[str]()
    joints, columns = [ours[name] for name in places], list(places.values())
    every_q, every_qdot = group.q[:, columns], group.qdot[:, columns]
    turns = np.array(robot.continuous)[joints]
    every_q[:, turns] = np.unwrap(every_q[:, turns], axis=0)
    tolerances = np.array(POSITION_TOLERANCE)[robot.prismatic[joints].astype(int)]
    paths = np.where(
        np.isnan(every_qdot).any(axis=0), every_q, motion_checks.integral(t, every_qdot)
    )
    speeds = np.zeros(len(joints)) if unstamped else motion_checks.largest_speed(t, paths)
    limits = robot.velocity_limits[joints]
    looked_at = motion_checks.suspects(t, every_q, every_qdot, tolerances)
    for k in np.flatnonzero(looked_at | (speeds > SPEED_TOLERANCE * limits)):
        name, j, q, qdot = list(places)[k], joints[k], every_q[:, k], every_qdot[:, k]
        unit, limit, speed = robot.units[j], float(limits[k]), float(speeds[k])
        text = motion_checks.contradiction(t, q, qdot, float(tolerances[k]), unit)
        # If the reported velocities contradict the positions, do not use them in the search for
        # jumps.
        jumps = motion_checks.jumps(robot, j, t, q, np.nan * qdot if text else qdot)
        if len(jumps):
            steps[name] = np.diff(q)[jumps]
        elif text:
            contrary.append(f'that of {name} is {text}')
        elif speed > SPEED_TOLERANCE * limit:
            fast.append(f'{name} at {speed:.3g} {unit}/s, {speed / limit:.3g} times its limit')
    if steps:
        largest = {name: float(jumps[np.argmax(np.abs(jumps))]) for name, jumps in steps.items()}
        name = max(largest, key=lambda name: abs(largest[name]))
        yield (
            f'positions jump: {sum(map(len, steps.values()))} steps of {", ".join(steps)} in '
            f'{group.duration} are too large for any speed, the largest of {name} by '
            f'{largest[name]:+.3g} {robot.units[ours[name]]}; look for wrong messages'
        )
    if contrary:
        remedy = 'correct the driver, or set velocity_source to difference'
        yield f'reported velocities contradict the positions: {"; ".join(contrary)}; {remedy}'
    if fast:
        yield f'beyond the velocity limit: {", ".join(fast)}; check units and robot file'


# The next functions check mimic joints.


def _mimic_faults(
    groups: Sequence[JointMessages], robot: Robot, names: Mapping[str, str]
) -> Iterator[str]:
    for name, leader, multiplier, offset, slides in robot.description.mimics:
        pair = names[name], names.get(leader, '')
        for group in groups:
            if not set(pair) <= set(group.names):
                continue
            q, driven = (group.q[:, group.names.index(joint)] for joint in pair)
            formula, t = multiplier * driven + offset, 1e-9 * (group.arrivals - group.arrivals[0])
            # Evaluate the formula of the mimic joint at earlier times, because the mimic joint may
            # lag behind the joint that it follows.
            past = [np.interp(t - lag, t, formula) for lag in MIMIC_LAGS]
            if min(np.median(np.abs(q - lagged)) for lagged in past) > POSITION_TOLERANCE[slides]:
                unit = 'm' if slides else 'rad'
                factor = {1.0: '', -1.0: '-'}.get(multiplier, f'{multiplier:g} * ')
                shift = f' {"-" if offset < 0.0 else "+"} {abs(offset):g}' if offset else ''
                yield (
                    f'mimic joint {pair[0]} differs from its formula: {q[-1]:.4g} {unit} in the '
                    f'messages, {factor}{pair[1]}{shift} = {formula[-1]:.4g} '
                    f'{unit} in the poses; correct the driver or the mimic element'
                )
