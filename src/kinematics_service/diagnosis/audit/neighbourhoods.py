"""
Joint positions around the times of poses, gathered while the states of a recording pass by.

Only some hundred poses, and half a second around each, are kept in memory.
"""

from typing import NamedTuple

import numpy as np

from ...formats.recordings.block import LARGEST_BLOCK, Flags, Times
from ...formats.recordings.source import MOST_POSES, PoseTrack
from ...kernel import Floats
from ...robot.robot import Robot
from ..frame_check.joint_motion import WINDOW
from ..frame_check.lag import REACH
from .timeline import Timeline

# States within this time (ns) before and after a pose are kept: lags are searched in this range.
AROUND = round((REACH + 2.0 * WINDOW) * 1e9)


class Track(NamedTuple):
    """
    M poses with the joint positions at their times.

    Attributes
    ----------
    poses, stamps, t : shape (M,)
        Rows of the pose track; ns; s since the first state, a step back taking no time.
    q : shape (M, n), rad or m
        Joint positions, NaN if there are none.
    gaps : shape (M,), s
        Time between the joint states around each; 0 for positions of the same row or stamp.
    within : shape (M,)
        Whether the time of each is within the recording.
    interval : s
        The usual interval of the states, NaN if there are fewer than two.
    states_at, states : shapes (K,), ns, and (K, n), rad or m
        The states around the poses, by rising stamp.
    """

    poses: Times
    stamps: Times
    t: Floats
    q: Floats
    gaps: Floats
    within: Flags
    interval: float
    states_at: Times
    states: Floats


def joined(robot: Robot, track: PoseTrack, timeline: Timeline) -> Track:
    """Return the poses of a second source with the joint positions of a recording."""
    around = Neighbourhoods(robot, track)
    for begin in range(0, len(timeline), LARGEST_BLOCK):
        rows = slice(begin, begin + LARGEST_BLOCK)
        around.take(timeline.stamps[rows], timeline.t[rows], timeline.q[rows])
    return around.track()


class Neighbourhoods:
    """
    Takes states in the order of the recording.

    Poses with their own joint positions are taken at even steps. For others it is unknown which
    are within the recording: all are taken, and every second one is dropped each time that there
    are twice as many as are wanted.
    """

    def __init__(self, robot: Robot, track: PoseTrack) -> None:
        self._robot, self._track = robot, track
        order = np.argsort(track.stamps, kind='stable')
        if track.q is not None and len(order):
            order = order[np.unique(np.linspace(0, len(order) - 1, MOST_POSES).astype(int))]
        self._order, self._sorted = order, track.stamps[order]
        self._stride = 1
        self._first = self._latest = -1
        self._stamps, self._t = np.zeros(0, dtype=np.int64), np.zeros(0)
        self._q = np.zeros((0, robot.dof))
        self._parts: list[tuple[Times, Floats, Floats]] = []
        self._waiting = 0

    def take(self, stamps: Times, t: Floats, q: Floats) -> None:
        """Keep those of the next states that are around a pose."""
        if not len(self._order):
            return
        # If stamps step back, only states later than all before are used.
        highest = np.maximum.accumulate(np.concatenate([[self._latest], stamps[:-1]]))
        rising = stamps > highest
        part = stamps[rising], t[rising], q[rising]
        if not len(part[0]):
            return
        if self._first < 0:
            self._first = int(part[0][0])
        self._latest = int(part[0][-1])
        self._parts.append(part)
        self._waiting += len(part[0])
        if self._waiting > len(self._stamps) // 4:
            self._gather()

    def _gather(self) -> None:
        self._stamps = np.concatenate([self._stamps, *(part[0] for part in self._parts)])
        self._t = np.concatenate([self._t, *(part[1] for part in self._parts)])
        self._q = np.concatenate([self._q, *(part[2] for part in self._parts)])
        self._parts, self._waiting = [], 0
        # Up to twice as many are taken.
        while self._track.q is None and self._count_within() > 2 * MOST_POSES:
            self._stride *= 2
        keep = self._around()
        self._stamps, self._t, self._q = self._stamps[keep], self._t[keep], self._q[keep]

    def _count_within(self) -> int:
        begin, end = np.searchsorted(self._sorted[:: self._stride], [self._first, self._latest])
        return int(end - begin)

    def _around(self) -> Flags:
        # Both states of an interval are kept if it meets the time around a pose; the last state
        # may be the first of such an interval.
        wanted = self._sorted[:: self._stride]
        begins, ends = wanted - AROUND, wanted + AROUND
        left, right = self._stamps[:-1], self._stamps[1:]
        meets = np.searchsorted(ends, left) < np.searchsorted(begins, right, side='right')
        keep: Flags = np.zeros(len(self._stamps), dtype=bool)
        keep[:-1] |= meets
        keep[1:] |= meets
        keep[-1] = True
        return keep

    def track(self) -> Track:
        """Return the poses taken, with the joint positions at their times."""
        if self._parts:
            self._gather()
        order, at, stamps = (
            self._order[:: self._stride],
            self._sorted[:: self._stride],
            self._stamps,
        )
        many, enough = len(at), len(stamps) > 0
        q, gaps, within = np.full((many, self._robot.dof), np.nan), np.zeros(many), np.ones(many)
        if self._track.q is not None:
            q = self._track.q[order]
        elif enough:
            q, gaps = self._between(at)
            within = (at >= stamps[0]) & (at <= stamps[-1])
        return Track(
            poses=order,
            stamps=at,
            t=np.interp(at, stamps, self._t) if enough else np.zeros(many),
            q=q,
            gaps=gaps,
            within=within.astype(bool),
            interval=float(np.median(np.diff(stamps))) * 1e-9 if len(stamps) > 1 else np.nan,
            states_at=stamps,
            states=self._q,
        )

    def _between(self, at: Times) -> tuple[Floats, Floats]:
        # Returns joint positions (M, n) on the line between the states around each time, and the
        # time (s) between these; 0 if a state has exactly that stamp.
        stamps = self._stamps
        right = np.clip(np.searchsorted(stamps, at), 0, len(stamps) - 1)
        left = np.where(stamps[right] == at, right, np.maximum(right - 1, 0))
        gaps = np.asarray((stamps[right] - stamps[left]) * 1e-9, dtype=np.float64)
        share = np.divide((at - stamps[left]) * 1e-9, gaps, out=np.zeros(len(at)), where=gaps > 0)
        steps = self._q[right] - self._q[left]
        turned = (steps + np.pi) % (2.0 * np.pi) - np.pi
        steps = np.where(self._robot.continuous, turned, steps)
        return np.asarray(self._q[left] + share[:, None] * steps), gaps
