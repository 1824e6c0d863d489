"""
Check the joint states of the last seconds: stamps, jumps, speeds, velocities, mimic joints.

Stamps are compared with times of arrival. Reported velocities are integrated by trapezoids and
compared with the positions at the lag that fits best. Lags, bursts and noise of healthy drivers
pass. Each sentence begins with the kind of fault, up to a colon.
"""

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view

from ..kernel import LARGEST, Floats, Integers
from ..robot.robot import Robot
from .cdr import STAMP_AT
from .joint_state_form import form_of

Flags: TypeAlias = npt.NDArray[np.bool_]

SECOND = 1_000_000_000  # ns
# Messages that are kept for the checks, a second at 1 kHz, and the size of each in bytes: together
# 8 MB.
MESSAGE_LIMIT = 1000
SIZE_LIMIT = 8192
# Messages of this time are checked (ns): ten of a driver that sends two a second.
WINDOW = 5 * SECOND
# Lists of joint names that are checked at a time: some drivers on one topic.
FORM_LIMIT = 8
# Fewer messages prove nothing: two intervals are in each half of the time.
MESSAGE_MINIMUM = 5
# If each message comes twice, half of them are dropped, or a few more by chance: no fault.
DROPPED_SHARE = 0.6
# Time by stamps may pass this many times faster or slower than time of arrival.
PACE = 3.0
# Ratios of units that are mistaken for each other, and how exactly the pace has to be one of them.
UNITS = {
    1e3: 'sec most likely holds milliseconds',
    1e-3: 'nanosec most likely holds microseconds',
    1e-6: 'nanosec most likely holds milliseconds',
}
UNIT_TOLERANCE = 0.1
# A step is a jump if it exceeds, by POSITION_TOLERANCE (rad, m), SPEED_MARGIN times the motion at
# the larger reported speed, else LIMIT_MARGIN times that at the velocity limit, else that at
# FREE_SPEED (rad/s, m/s). Mimic joints and integrated velocities have the same tolerance.
POSITION_TOLERANCE = (0.02, 0.005)
SPEED_MARGIN = 3.0
LIMIT_MARGIN = 2.0
FREE_SPEED = (10.0, 2.0)
# In a longer interval (s) a joint can start and stop: reported speeds at its ends explain nothing.
START_AND_STOP = 0.05
# A speed is compared with its limit over this time (s), in which jitter of stamps adds a tenth.
SPEED_BASELINE = 0.2
SPEED_TOLERANCE = 1.1
# Reported velocities are compared over this time (s), if no interval exceeds INTERVAL_LIMIT (s).
VELOCITY_WINDOW = 1.0
INTERVAL_LIMIT = 0.15
# Filters of drivers delay velocities by up to this time (s); commanded velocities lead by it.
LAG_LIMIT = 0.1
# Integral and position may differ by this much of the larger one: filters do more than delay.
VELOCITY_SHARE = 0.3


class JointMessages(NamedTuple):
    """
    N messages with the same k joint names.

    Attributes
    ----------
    arrivals, seconds, nanoseconds : shape (N,)
        Time of arrival, steady clock, ns; the two numbers of the stamp.
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
        """Return the stamps, ns."""
        return self.seconds * SECOND + self.nanoseconds

    @property
    def duration(self) -> str:
        """Return the time between the first and the last arrival, in words."""
        return f'{1e-9 * float(self.arrivals[-1] - self.arrivals[0]):.2g} s'

    def taken(self, rows: slice | Flags) -> 'JointMessages':
        """Return some of the messages."""
        return JointMessages._make([self.names, *(column[rows] for column in self[1:])])

    def newest(self, timeout: int) -> 'JointMessages':
        """Return those after the last stamp that stepped back by more than the timeout (ns)."""
        return self.taken(slice(_last(np.diff(self.stamps) < -timeout), None))


def messages_of(recent: Sequence[tuple[int, bytes]], now: int) -> list[JointMessages]:
    """Return the messages of the last `WINDOW` from times of arrival (ns) and bytes."""
    by_size = defaultdict[int, list[tuple[int, bytes]]](list)
    for arrival, data in recent:
        if now - arrival <= WINDOW:
            by_size[len(data)].append((arrival, data))
    found, forms = list[JointMessages](), 0
    for group in by_size.values():
        while group and forms < FORM_LIMIT and (form := form_of(group[-1][1])) is not None:
            forms += 1
            rows = np.frombuffer(b''.join(data for _, data in group), np.uint8)
            rows = rows.reshape(len(group), -1)
            alike = ((rows & form.fixed) == form.same).all(axis=1)
            arrivals = np.array([arrival for arrival, _ in group])[alike]
            group = [one for one, is_alike in zip(group, alike.tolist()) if not is_alike]
            stamp, q, qdot = (
                rows[alike, part].copy().view(kind)
                for part, kind in (
                    (slice(STAMP_AT, STAMP_AT + 8), '<i4,<u4'),
                    (form.positions, '<f8'),
                    (form.velocities, '<f8'),
                )
            )
            if q.shape[1] == len(set(form.names)) == len(form.names):
                sec, nanosec = (stamp[name][:, 0].astype(np.int64) for name in ('f0', 'f1'))
                qdot = qdot if qdot.shape == q.shape else np.full(q.shape, np.nan)
                found.append(JointMessages(form.names, arrivals, sec, nanosec, q, qdot))
    return found


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
        Messages of some seconds, those of the same names together.
    robot, names
        The arm, and for the joints to be checked, mimic joints included, the names in messages.
    timeout : ns
        Stamps that step back by more start a new time.
    simulated
        Whether time is simulated: it may pass at any rate.
    reported
        Whether velocities that messages report are used.
    """
    faults = list[str]()
    ours = {names[name]: j for j, name in enumerate(robot.joint_names) if name in names}
    with np.errstate(all='ignore'):  # numbers as large as doubles can be
        for group in groups:
            group = group.newest(timeout)
            if ours.keys().isdisjoint(group.names) or len(group.q) < MESSAGE_MINIMUM:
                continue
            fault = _stamp_fault(group, simulated) if group.stamps[-1] else ''
            # Speeds by wrong stamps mean nothing.
            faults += [fault] if fault else _motion_faults(group, robot, ours, reported)
        return [*faults, *_mimic_faults(groups, robot, names)]


def arrival_jitter(groups: Sequence[JointMessages], names: Sequence[str]) -> str:
    """Return what times of arrival in place of stamps mean for speeds, in words."""
    text = 'no stamps: speeds are differences over times of arrival'
    for group in groups:
        if len(group.q) >= MESSAGE_MINIMUM and not set(names).isdisjoint(group.names):
            # Half the width of two thirds of all intervals: one standard deviation, if normal.
            low, middle, high = np.percentile(np.diff(group.arrivals) * 1e-6, (16, 50, 84))
            jitter = 0.5 * float(high - low)
            text += f'; an arrival jitter of {jitter:.2g} ms in {middle:.3g} ms '
            text += f'makes them wrong by about {100.0 * jitter / middle:.1f} %'
    return text


def _last(where: Flags) -> int:
    # Returns the index of the message after the last interval that is true; 0 if none is.
    return int(np.flatnonzero(np.append(True, where))[-1])


# Stamps


def _stamp_fault(group: JointMessages, simulated: bool) -> str:
    # Returns what is wrong with the stamps, the first that applies; '' if nothing was found.
    dropped, total = ~_advances(group.stamps), f'{len(group.q)} messages in {group.duration}'
    of_late = int(np.sum(group.arrivals > group.arrivals[-1] - SECOND))
    fraction, pace = _fraction(group), 1.0 if simulated else _pace(group)
    largest = int(group.nanoseconds.max())
    if np.ptp(group.stamps) == 0:
        stamp = f'{group.seconds[0]}.{group.nanoseconds[0]:09d}'
        return f'{total}, all with the stamp {stamp}: the driver must stamp each message anew'
    if dropped[-max(of_late, MESSAGE_MINIMUM) :].mean() > DROPPED_SHARE:
        why = fraction or (
            'their stamps are not newer than that of a message before; stamp each message with '
            'the time of its measurement; if several nodes publish, synchronize their clocks'
        )
        return f'{int(np.sum(dropped))} of {total} dropped: {why}'
    if fraction:
        return f'stamps hardly advance within a second: {fraction}'
    if pace != 1.0:
        side = f'{pace:.1f} times faster' if pace > 1.0 else f'{1.0 / pace:.1f} times slower'
        likely = 'is it simulated (set use_sim_time), or a recording at another rate?'
        for ratio, unit in UNITS.items():
            likely = unit if abs(pace / ratio - 1.0) < UNIT_TOLERANCE else likely
        return f'time by stamps is wrong: it passes {side} than time of arrival; {likely}'
    if largest >= SECOND:
        return f'nanosec of stamps is a second or more: {largest}; it must be below {SECOND}'
    return ''


def _advances(stamps: Integers) -> Flags:
    # Returns for each message whether its stamp is newer than all before.
    return np.append(True, stamps[1:] > np.maximum.accumulate(stamps)[:-1])


def _fraction(group: JointMessages) -> str:
    # Returns what nanosec holds if it passes less than a thousandth of each second, else ''.
    gaps, largest = np.diff(group.arrivals), int(group.nanoseconds.max())
    within = gaps[np.diff(group.seconds) == 0].sum()
    if largest >= SECOND // 1000 or 2 * within < gaps.sum() or np.ptp(group.seconds) == 0:
        return ''
    if largest == 0:
        return 'their stamps are whole seconds; fill nanosec'
    unit = 'microseconds' if largest >= SECOND // 1_000_000 else 'milliseconds'
    return f'nanosec most likely holds {unit}; write nanoseconds'


def _pace(group: JointMessages) -> float:
    # Returns seconds of stamps over seconds of arrival, 1 unless both halves are beyond PACE: a
    # burst after a stall and a step of a clock are in one half.
    begin = _last(np.diff(group.stamps) < 0)
    s, t = group.stamps[begin:], group.arrivals[begin:]
    middle = int(np.searchsorted(t, (t[0] + t[-1]) // 2))
    if len(t) < MESSAGE_MINIMUM or not 0 < middle < len(t) - 1 or t[-1] - t[0] < SECOND // 2:
        return 1.0
    at = [0, middle, -1]
    paces = np.diff(s[at]) / np.diff(t[at])
    off = paces.min() > PACE or paces.max() < 1.0 / PACE
    return float((s[-1] - s[0]) / (t[-1] - t[0])) if off else 1.0


# Positions and velocities


def explained_steps(robot: Robot, j: int, speeds: Floats, intervals: Floats) -> Floats:
    """
    Return the largest steps of joint j that its speed explains, shape (N,), rad or m.

    Parameters
    ----------
    speeds : shape (N + 1,), rad/s or m/s
        Reported at the ends of the intervals, none negative; NaN if not reported.
    intervals : shape (N,), s
        Between messages.
    """
    sliding = bool(robot.prismatic[j])
    reported = SPEED_MARGIN * np.fmax(speeds[1:], speeds[:-1])
    limit = LIMIT_MARGIN * float(robot.velocity_limits[j])
    otherwise = limit if math.isfinite(limit) else FREE_SPEED[sliding]
    explained: Floats = np.where(np.isnan(reported), otherwise, reported) * intervals
    return explained + POSITION_TOLERANCE[sliding]


def _jumps(robot: Robot, j: int, t: Floats, q: Floats, qdot: Floats) -> Floats:
    # Returns the steps that no speed explains. Messages that are stamped or arrive in pairs were
    # not measured in pairs: no interval is shorter than the median.
    intervals, steps = np.diff(t), np.diff(q)
    if np.max(np.abs(steps)) <= POSITION_TOLERANCE[bool(robot.prismatic[j])]:
        return steps[:0]
    usual = float(np.median(intervals))
    intervals = np.maximum(intervals, usual)
    near = min(math.ceil(LAG_LIMIT / usual), len(t))  # messages by which reported speeds may lag
    speeds = sliding_window_view(np.pad(np.abs(qdot), near, 'edge'), 2 * near + 1).max(axis=1)
    by_speed, by_limit = (
        explained_steps(robot, j, known, intervals) for known in (speeds, np.nan * speeds)
    )
    odd = np.abs(steps) > np.where(intervals > START_AND_STOP, by_limit, by_speed)
    jumps: Floats = steps[odd]
    return jumps


def _integral(t: Floats, qdot: Floats) -> Floats:
    return np.append(0.0, np.cumsum(0.5 * (qdot[1:] + qdot[:-1]) * np.diff(t)))


def _speed(t: Floats, q: Floats) -> float:
    # Returns the largest mean speed over SPEED_BASELINE.
    ends = np.searchsorted(t, t + SPEED_BASELINE)
    begins = np.flatnonzero(ends < len(t))
    ends = ends[begins]
    return float(np.max(np.abs(q[ends] - q[begins]) / (t[ends] - t[begins]), initial=0.0))


def _contradiction(t: Floats, q: Floats, qdot: Floats, tolerance: float, unit: str) -> str:
    # Returns how reported velocities contradict the positions of the last second, or ''.
    late = t >= t[-1] - VELOCITY_WINDOW
    t, q, qdot = t[late], q[late], qdot[late]
    inner = (t >= t[0] + LAG_LIMIT) & (t <= t[-1] - LAG_LIMIT)
    longest, fastest = float(np.max(np.diff(t), initial=0.0)), float(np.max(np.abs(qdot)))
    if inner.sum() < MESSAGE_MINIMUM or longest > INTERVAL_LIMIT or math.isnan(fastest):
        return ''
    lags, path, q = np.linspace(-LAG_LIMIT, LAG_LIMIT, 11), _integral(t, qdot), q[inner]
    off = min(float(np.ptp(np.interp(t[inner] + lag, t, path) - q)) for lag in lags)
    path = path[inner]
    moved, motion = float(np.ptp(q)), float(np.ptp(path))
    if off <= tolerance + 0.5 * longest * fastest + VELOCITY_SHARE * max(moved, motion):
        return ''
    if moved <= tolerance:
        return f'up to {fastest:.3g} {unit}/s of a joint that moves by {moved:.1g} {unit}'
    # The latest half may have the cause alone.
    x, y = (path[len(q) // 2 :] - np.mean(path[len(q) // 2 :]) for path in (q, path))
    scale = float(np.dot(x, y) / max(np.dot(x, x), np.finfo(float).tiny))
    if np.ptp(y - scale * x) > VELOCITY_SHARE * np.ptp(y):
        return f'off by {off:.2g} {unit} within a second'
    text = f'{scale:.3g} times what its positions say'
    if abs(scale - math.degrees(1.0)) < 2.0:
        return f'{text} (degrees?)'
    return f'{text} (the wrong sign)' if abs(scale + 1.0) < 0.1 else text


def _motion_faults(
    group: JointMessages, robot: Robot, ours: Mapping[str, int], reported: bool
) -> Iterator[str]:
    places = {name: group.names.index(name) for name in ours if name in group.names}
    known, told = (
        np.all(np.abs(values[:, list(places.values())]) <= LARGEST, axis=1)
        for values in (group.q, group.qdot)
    )
    # The estimator uses all velocities of a message or none.
    group = group._replace(qdot=np.where(reported & told[:, None], group.qdot, np.nan))
    unstamped = group.stamps[-1] == 0
    group = group.taken(known & (unstamped | _advances(group.stamps)))
    times = group.arrivals if unstamped else group.stamps
    if len(times) < MESSAGE_MINIMUM:
        return
    t, count, largest = 1e-9 * (times - times[0]), 0, (0.0, '')
    jumping, fast, contrary = list[str](), list[str](), defaultdict[str, list[str]](list)
    for name, k in places.items():
        j, q, qdot = ours[name], group.q[:, k], group.qdot[:, k]
        if robot.continuous[j]:
            q = np.unwrap(q)
        unit, limit = robot.units[j], float(robot.velocity_limits[j])
        tolerance = POSITION_TOLERANCE[bool(robot.prismatic[j])]
        contradiction = _contradiction(t, q, qdot, tolerance, unit)
        # Speeds that contradict the positions explain no step.
        jumps = _jumps(robot, j, t, q, np.nan * qdot if contradiction else qdot)
        speed = 0.0 if unstamped else _speed(t, q if np.isnan(qdot).any() else _integral(t, qdot))
        if len(jumps):
            jumping.append(name)
            count += len(jumps)
            step = float(jumps[np.argmax(np.abs(jumps))])
            largest = max(largest, (abs(step), f'{name} by {step:+.3g} {unit}'))
        elif contradiction:
            contrary[contradiction].append(name)
        elif speed > SPEED_TOLERANCE * limit:
            fast.append(f'{name} {speed / limit:.3g} times at {speed:.3g} {unit}/s')
    if jumping:
        yield (
            f'positions jump: {count} steps of {", ".join(jumping)} in {group.duration} are too '
            f'large for any speed, the largest of {largest[1]}; look for wrong messages'
        )
    if contrary:
        each = '; '.join(f'of {", ".join(names)} {text}' for text, names in contrary.items())
        remedy = 'correct the driver, or set velocity_source to difference'
        yield f'reported velocities contradict the positions: {each}; {remedy}'
    if fast:
        yield f'beyond the velocity limit: {", ".join(fast)}; check units and robot file'


# Mimic joints


def _mimic_faults(
    groups: Sequence[JointMessages], robot: Robot, names: Mapping[str, str]
) -> Iterator[str]:
    for name, leader, multiplier, offset, slides in robot.description.mimics:
        pair = names[name], names.get(leader, '')
        for group in groups:
            if not set(pair) <= set(group.names):
                continue
            late = group.taken(group.arrivals > group.arrivals[-1] - SECOND)
            q, driven = (late.q[:, group.names.index(one)] for one in pair)
            formula = multiplier * driven + offset
            # A joint that follows late is off by less than the motion of the second.
            if np.min(np.abs(q - formula)) > POSITION_TOLERANCE[slides] + np.ptp(formula):
                unit = 'm' if slides else 'rad'
                yield (
                    f'mimic joint {pair[0]} differs from its formula: {q[-1]:.4g} {unit} in the '
                    f'messages, {multiplier:g} * {pair[1]} + {offset:g} = {formula[-1]:.4g} '
                    f'{unit} in the poses; correct the driver or the mimic element'
                )
