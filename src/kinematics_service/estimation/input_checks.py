"""
Check the joint states of the last seconds: stamps, jumps, speeds, velocities, mimic joints.

Stamps are compared with times of arrival, reported velocities by their integral (trapezoids) with
the positions, at the lag that fits best. Healthy lags, bursts and noise pass; doubt is no fault.
"""

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from ..kernel import LARGEST, Bytes, Floats, Integers
from ..robot.robot import Robot
from ..typography import counted
from .cdr import STAMP_AT
from .joint_state_form import JointStateForm, form_of

Flags: TypeAlias = npt.NDArray[np.bool_]

SECOND = 1_000_000_000  # ns
# Messages that are checked: number, time (ns), and size of each (bytes). Five seconds at 400 Hz,
# and at most 16 MB.
MOST_MESSAGES = 2000
WINDOW = 5 * SECOND
LARGEST_MESSAGE = 8192
# Lists of joint names that are checked at a time: some drivers on one topic.
MOST_FORMS = 8
# Fewer messages prove nothing.
FEWEST_MESSAGES = 5
# Time by stamps that passes this many times faster or slower than that of arrival is wrong.
PACE = 3.0
# A step is a jump if it exceeds, by POSITION_TOLERANCE (rad, m), the motion at three times the
# larger reported speed; without reported speeds, twice the velocity limit; without that, these
# speeds. Mimic joints and integrated velocities have the same tolerance.
POSITION_TOLERANCE = (0.02, 0.005)
SPEED_MARGIN, LIMIT_MARGIN = 3.0, 2.0
FREE_SPEED = (10.0, 2.0)
# In a longer interval (s) a joint can start and stop: reported speeds at its ends explain nothing.
START_AND_STOP = 0.05
# A speed is compared with its limit over this time (s); a noisy stamp may add a tenth.
SPEED_BASELINE, SPEED_TOLERANCE = 0.2, 1.1
# Reported velocities are compared over this time (s), if no interval is longer than the next.
VELOCITY_WINDOW, LONGEST_INTERVAL = 1.0, 0.15
# Filters of drivers delay velocities by up to this time (s); some lead by it.
MOST_LAG = 0.1
# A difference of integral and position below this share of the larger one may be a filter's.
VELOCITY_SHARE = 0.3


class InputFault(NamedTuple):
    """
    What is wrong with the joint states.

    Attributes
    ----------
    cause
        The same while the same thing is wrong: for a log that repeats itself rarely.
    sentence
        What is wrong; what to do.
    """

    cause: str
    sentence: str


@dataclass(frozen=True, eq=False)
class JointMessages:
    """
    Messages with the same joint names, N of them, each with k names.

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
    def duration(self) -> float:
        """Return the time between the first and the last arrival, s."""
        return float(self.arrivals[-1] - self.arrivals[0]) * 1e-9

    def taken(self, rows: slice | Flags) -> 'JointMessages':
        """Return some of the messages."""
        _, *columns = (getattr(self, field.name) for field in fields(self))
        return JointMessages(self.names, *(column[rows] for column in columns))


def messages_of(recent: Sequence[tuple[int, bytes]], now: int) -> list[JointMessages]:
    """Return the messages of the last `WINDOW` from times of arrival (ns) and bytes."""
    by_size = defaultdict[int, list[tuple[int, bytes]]](list)
    for arrival, data in recent:
        if now - arrival <= WINDOW:
            by_size[len(data)].append((arrival, data))
    found: list[JointMessages] = []
    for group in by_size.values():
        while group and len(found) < MOST_FORMS and (form := form_of(group[-1][1])) is not None:
            joined = b''.join(data for _, data in group)
            rows = np.frombuffer(joined, np.uint8).reshape(len(group), -1)
            ours = ((rows & form.fixed) == form.same).all(axis=1)
            if form.counts[0] == len(set(form.names)) == len(form.names):
                arrivals = np.array([arrival for arrival, _ in group])
                found.append(_messages(form, arrivals[ours], rows[ours]))
            group = [one for one, taken in zip(group, ours.tolist()) if not taken]
    return found


def _messages(form: JointStateForm, arrivals: Integers, rows: Bytes) -> JointMessages:
    sec, nanosec = (
        rows[:, at : at + 4].copy().view(kind)[:, 0].astype(np.int64)
        for at, kind in ((STAMP_AT, '<i4'), (STAMP_AT + 4, '<u4'))
    )
    q, qdot = (rows[:, part].copy().view(np.float64) for part in (form.positions, form.velocities))
    if qdot.shape != q.shape:
        qdot = np.full(q.shape, np.nan)
    return JointMessages(form.names, arrivals, sec, nanosec, q, qdot)


def input_faults(
    groups: Sequence[JointMessages],
    robot: Robot,
    names: Mapping[str, str],
    timeout: int,
    simulated: bool = False,
    reported: bool = True,
) -> list[InputFault]:
    """
    Return what is wrong with the joint states; empty if nothing was found.

    Parameters
    ----------
    groups
        Messages of some seconds, those of the same names together.
    robot, names
        The arm, and for each joint name of its file, mimic joints included, that in messages.
    timeout : ns
        Stamps that step back by more start a new time.
    simulated
        Whether time is simulated: it may pass at any rate.
    reported
        Whether velocities that messages report are used.
    """
    faults = list[InputFault]()
    ours = {names[name]: j for j, name in enumerate(robot.joint_names)}
    for group in groups:
        if ours.keys().isdisjoint(group.names):
            continue
        group = group.taken(slice(_last(np.diff(group.stamps) < -timeout), None))
        if len(group.arrivals) < FEWEST_MESSAGES:
            continue
        fault = None if is_unstamped(group) else _stamp_fault(group, simulated)
        if fault is not None:  # speeds by wrong stamps mean nothing
            faults.append(fault)
            continue
        with np.errstate(all='ignore'):  # numbers as large as doubles can be
            faults += _motion_faults(group, robot, ours, reported)
    with np.errstate(all='ignore'):
        return [*faults, *_mimic_faults(groups, robot, names)]


def is_unstamped(group: JointMessages) -> bool:
    """Return whether the last message has no stamp."""
    return bool(group.stamps[-1] == 0)


def arrival_jitter(group: JointMessages) -> str:
    """Return by how much times of arrival vary, and what that does to speeds, in words."""
    if len(group.arrivals) < FEWEST_MESSAGES:
        return ''
    # One standard deviation both ways, if it is normal; a stall counts as one interval.
    low, middle, high = np.percentile(np.diff(group.arrivals) * 1e-6, (16, 50, 84)).tolist()
    jitter = 0.5 * (high - low)
    share = f'about {jitter / middle:.1%}' if middle > jitter else 'more than 100 %'
    return f'arrival jitter of {jitter:.2g} ms in {middle:.3g} ms: speeds are off by {share}'


def _last(where: Flags) -> int:
    # Returns the index of the message after the last interval that is true; 0 if none is.
    (found,) = np.nonzero(where)
    return int(found[-1]) + 1 if len(found) else 0


# Stamps


def _stamp_fault(group: JointMessages, simulated: bool) -> InputFault | None:
    dropped, count = ~_advances(group.stamps), len(group.stamps)
    of_late = int(np.sum(group.arrivals > group.arrivals[-1] - SECOND))
    cause = _fractions(group)
    if dropped[-max(of_late, FEWEST_MESSAGES) :].mean() > 0.5:
        first = f'{group.seconds[0]}.{group.nanoseconds[0]:09d}'
        total = f'{count} messages in {group.duration:.2g} s'
        if np.all(group.stamps == group.stamps[0]):
            text = f'{total}, all with the stamp {first}; the driver must stamp each message anew'
            return InputFault('stamps stand still', text)
        remedy = cause or (
            'their stamps are not newer than that of a message before; stamp each message with '
            'the time of its measurement, and synchronize the clocks if several nodes publish'
        )
        text = f'{int(np.sum(dropped))} of {total} dropped: {remedy}'
        return InputFault('stamps do not advance', text)
    if cause and not simulated:
        return InputFault('unit of nanosec', f'stamps do not advance within a second: {cause}')
    pace = 1.0 if simulated else _pace(group)
    if pace != 1.0:
        side = f'{pace:.3g} times faster' if pace > 1.0 else f'{1.0 / pace:.3g} times slower'
        likely = 'simulated time (set use_sim_time), or a recording played at another rate'
        if abs(pace / 1000.0 - 1.0) < 0.1:
            likely = 'sec most likely holds milliseconds'
        text = f'time by stamps passes {side} than by arrival, so speeds are wrong: {likely}'
        return InputFault('pace of stamps', text)
    nanosec = int(group.nanoseconds.max())
    if nanosec >= SECOND:
        text = f'nanosec of stamps is {nanosec}, a second or more; write sec and the rest of it'
        return InputFault('range of nanosec', text)
    return None


def _advances(stamps: Integers) -> Flags:
    # Returns for each message whether its stamp is newer than all before.
    newest = np.maximum.accumulate(stamps)
    return np.append(True, stamps[1:] > newest[:-1])


def _fractions(group: JointMessages) -> str:
    # Returns what nanosec holds if it passes less than a thousandth of each second, else ''.
    gaps = np.diff(group.arrivals)
    within = gaps[np.diff(group.seconds) == 0].sum()
    most = int(group.nanoseconds.max())
    if most >= SECOND // 1000 or 2 * within < gaps.sum() or group.seconds[0] == group.seconds[-1]:
        return ''
    if most == 0:
        return 'their stamps are whole seconds; fill nanosec'
    unit = 'microseconds' if most >= SECOND // 1_000_000 else 'milliseconds'
    return f'nanosec most likely holds {unit}; write nanoseconds'


def _pace(group: JointMessages) -> float:
    # Returns stamp seconds over arrival seconds; 1 unless both halves are beyond PACE. A burst
    # after a stall is in one half only, a step of a clock as well.
    stamps = group.stamps
    begin = _last(np.diff(stamps) < 0)
    s, t = stamps[begin:], group.arrivals[begin:]
    middle = int(np.searchsorted(t, (t[0] + t[-1]) // 2))
    if len(t) < FEWEST_MESSAGES or not 0 < middle < len(t) - 1 or t[-1] - t[0] < SECOND:
        return 1.0
    first, second = (
        float(s[b] - s[a]) / float(t[b] - t[a]) for a, b in ((0, middle), (middle, -1))
    )
    if min(first, second) > PACE or (0.0 < max(first, second) < 1.0 / PACE):
        return float(s[-1] - s[0]) / float(t[-1] - t[0])
    return 1.0


# Positions and velocities


def explained_steps(robot: Robot, j: int, speeds: Floats, intervals: Floats) -> Floats:
    """
    Return the steps of joint j that are no jumps, shape (N,), rad or m.

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


class _Joint(NamedTuple):
    # One joint over time: positions without the jumps of a full turn, and reported velocities.
    robot: Robot
    j: int
    t: Floats
    q: Floats
    qdot: Floats

    @property
    def unit(self) -> str:
        return self.robot.units[self.j]

    def jumps(self) -> Floats:
        # Returns the steps that no speed explains.
        intervals = np.diff(self.t)
        # Messages that arrive or are stamped in pairs were not measured in pairs.
        intervals = np.maximum(intervals, np.median(intervals))
        steps, speeds = np.diff(self.q), np.abs(self.qdot)
        explained, by_limit = (
            explained_steps(self.robot, self.j, known, intervals)
            for known in (speeds, np.full_like(speeds, np.nan))
        )
        odd = np.abs(steps) > np.where(intervals > START_AND_STOP, by_limit, explained)
        found: Floats = steps[odd]
        return found

    def times_too_fast(self) -> float:
        # Returns the largest speed over its limit.
        largest = 0.0
        ends = np.searchsorted(self.t, self.t + SPEED_BASELINE)
        begins = np.flatnonzero(ends < len(self.t))
        ends = ends[begins]
        for path in (self.q, self.integral()):
            speeds = np.abs(path[ends] - path[begins]) / (self.t[ends] - self.t[begins])
            largest = max(largest, float(np.max(speeds, initial=0.0)))
        return largest / float(self.robot.velocity_limits[self.j])

    def integral(self) -> Floats:
        # Returns the motion by the reported velocities, 0 at the first message.
        means = 0.5 * (self.qdot[1:] + self.qdot[:-1])
        return np.append(0.0, np.cumsum(means * np.diff(self.t)))

    def contradiction(self) -> str:
        # Returns how reported velocities contradict the positions of the last second, or ''.
        late = self._replace(
            **{
                name: getattr(self, name)[self.t >= self.t[-1] - VELOCITY_WINDOW]
                for name in ('t', 'q', 'qdot')
            }
        )
        t, q, path = late.t, late.q, late.integral()
        inner = (t >= t[0] + MOST_LAG) & (t <= t[-1] - MOST_LAG)
        longest = float(np.max(np.diff(t), initial=0.0))
        if (
            inner.sum() < FEWEST_MESSAGES
            or longest > LONGEST_INTERVAL
            or not np.all(np.abs(late.qdot) <= LARGEST)
        ):
            return ''
        paths = [
            np.interp(t[inner] + lag, t, path) for lag in np.linspace(-MOST_LAG, MOST_LAG, 11)
        ]
        told, known = min(paths, key=lambda told: float(np.ptp(told - q[inner]))), q[inner]
        tolerance = POSITION_TOLERANCE[bool(self.robot.prismatic[self.j])]
        most = float(np.max(np.abs(late.qdot)))
        moved, motion, off = (float(np.ptp(path)) for path in (known, told, told - known))
        if off <= tolerance + 0.5 * longest * most + VELOCITY_SHARE * max(moved, motion):
            return ''
        if moved <= tolerance:
            return f'reach {most:.3g} {self.unit}/s while it moves by {moved:.1g} {self.unit}'
        half = len(known) // 2
        x, y = (path[half:] - np.mean(path[half:]) for path in (known, told))
        scale = float(np.dot(x, y) / np.dot(x, x)) if np.any(x) else 0.0
        if np.ptp(y - scale * x) > VELOCITY_SHARE * np.ptp(y):
            return f'differ from its positions by {off:.2g} {self.unit} in a second'
        text = f'are {scale:.3g} times what its positions say'
        if abs(scale - math.degrees(1.0)) < 2.0:
            return f'{text} (degrees?)'
        return f'{text} (the wrong sign)' if abs(scale + 1.0) < 0.1 else text


def _motion_faults(
    group: JointMessages, robot: Robot, ours: Mapping[str, int], reported: bool
) -> Iterator[InputFault]:
    unstamped = is_unstamped(group)
    if not unstamped:
        group = group.taken(_advances(group.stamps))
    times = group.arrivals if unstamped else group.stamps
    if len(times) < FEWEST_MESSAGES:
        return
    t = (times - times[0]) * 1e-9
    jumps, fast, told = dict[str, Floats](), dict[str, float](), defaultdict[str, list[str]](list)
    for k, name in enumerate(group.names):
        if name not in ours:
            continue
        j, q = ours[name], group.q[:, k]
        if robot.continuous[j]:
            steps = np.remainder(np.diff(q) + math.pi, math.tau) - math.pi
            q = np.append(0.0, np.cumsum(steps))
        qdot = group.qdot[:, k] if reported else np.full(len(q), np.nan)
        joint = _Joint(robot, j, t, q, qdot)
        found, contradiction = joint.jumps(), joint.contradiction()
        # If many steps seem to be jumps, it is the reported speed that does not explain them.
        if len(found) and not (contradiction and 4 * len(found) > len(q)):
            jumps[name] = found
        elif contradiction:
            told[contradiction].append(name)
        elif not unstamped and (times_too_fast := joint.times_too_fast()) > SPEED_TOLERANCE:
            fast[name] = times_too_fast
    if jumps:
        name, steps = max(jumps.items(), key=lambda item: float(np.max(np.abs(item[1]))))
        largest = steps[int(np.argmax(np.abs(steps)))]
        text = (
            f'{counted(sum(map(len, jumps.values())), "jump")} of {", ".join(jumps)} in '
            f'{group.duration:.2g} s that no speed explains, the largest of {name} by '
            f'{largest:+.3g} {robot.units[ours[name]]}; look for wrong values in the messages'
        )
        yield InputFault(f'jumps of {", ".join(jumps)}', text)
    for contradiction, joints in told.items():
        cause = f'reported velocities of {", ".join(joints)}'
        remedy = 'correct the driver, or set velocity_source to difference'
        yield InputFault(cause, f'{cause} {contradiction}; {remedy}')
    if fast:
        cause = ', '.join(f'{name} {times:.3g} times' for name, times in fast.items())
        text = f'faster than the velocity limit: {cause}; check units, and limits of the file'
        yield InputFault(f'speed of {", ".join(fast)}', text)


# Mimic joints


def _mimic_faults(
    groups: Sequence[JointMessages], robot: Robot, names: Mapping[str, str]
) -> Iterator[InputFault]:
    for mimic in robot.description.mimics:
        name, leader = names[mimic.name], names[mimic.leader]
        for group in groups:
            if name not in group.names or leader not in group.names:
                continue
            late = group.taken(group.arrivals > group.arrivals[-1] - SECOND)
            q, driven = (late.q[:, group.names.index(one)] for one in (name, leader))
            formula = mimic.multiplier * driven + mimic.offset
            tolerance, unit = POSITION_TOLERANCE[mimic.slides], 'm' if mimic.slides else 'rad'
            # A joint that follows late is off by less than the motion of the second.
            if np.min(np.abs(q - formula)) > tolerance + np.ptp(formula):
                text = (
                    f'{name} is {q[-1]:.4g} {unit} in the messages, but {formula[-1]:.4g} {unit} '
                    f'by its formula {mimic.multiplier:g} * {leader} + {mimic.offset:g}, which '
                    'the poses follow; correct the driver or the mimic element'
                )
                yield InputFault(f'mimic {name}', text)
