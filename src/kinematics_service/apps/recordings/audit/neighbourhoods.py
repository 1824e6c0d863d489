# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Interpolate the joint positions of a recording at the times of measured tool poses.

Only states within `WINDOW_AROUND_POSES` of a pose's time are kept in memory.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ....kernel import Floats
from ....robot.robot import Robot
from ...checking.joint_motion import WINDOW
from ...checking.lag import REACH
from ..readers.block import LARGEST_BLOCK, Flags, Times
from ..readers.source import MAX_POSES, PoseTrack
from ..readers.stored_columns import spans
from .reported_velocities import MotionColumns

# Joint states within this time (ns) of a measured pose are kept in memory. The frame check shifts
# the pose in time by at most REACH (s), and fits lines to the joint states in a window of length
# WINDOW (s) around the shifted time. So it needs no joint state farther away.
WINDOW_AROUND_POSES = round((REACH + 2.0 * WINDOW) * 1e9)


class Track(NamedTuple):
    """
    M measured tool poses, and the joint positions at their times.

    Attributes
    ----------
    poses, stamps, t : shape (M,)
        Indices of the poses in the `PoseTrack`, their stamps (ns), and their times (s since the
        first joint state).
    q : shape (M, n), rad or m
        Joint positions at the times of the poses, NaN if they are unknown.
    gaps : shape (M,), s
        Time between the joint states before and after each pose. 0 if no interpolation is needed:
        a joint state has the same stamp, or the recording is a table and joint positions and pose
        are in the same row.
    within : shape (M,)
        Whether the time of each pose lies between the first and the last joint state.
    interval : s
        Median time between the joint states around the poses, NaN for fewer than 2 states.
    states_at, states : shapes (K,), ns, and (K, n), rad or m
        Stamps and positions of the K joint states near the poses, by rising stamp.
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


def joined(robot: Robot, track: PoseTrack, states: MotionColumns) -> Track:
    """
    Return tool poses that a second source measured, with the joint positions at their times.

    In a table whose rows have both joint positions and a pose, at most `MAX_POSES` evenly spread
    poses are returned. Otherwise every second pose is dropped, again and again, until at most
    `2 * MAX_POSES` poses lie between the first and the last joint state.
    """
    order = np.argsort(track.stamps, kind='stable')
    if track.q is not None and len(order):
        order = order[np.unique(np.linspace(0, len(order) - 1, MAX_POSES).astype(int))]
    elif len(states):
        last = max(int(np.max(states.stamps[rows])) for rows in spans(len(states), LARGEST_BLOCK))
        ends = int(states.stamps[0]), last
        while np.subtract(*np.searchsorted(track.stamps[order], ends)[::-1]) > 2 * MAX_POSES:
            order = order[::2]
    at = track.stamps[order]
    stamps, t, states_q = (np.concatenate(column) for column in zip(*_around(states, at)))
    many, enough = len(at), len(stamps) > 0
    q, gaps, within = np.full((many, robot.dof), np.nan), np.zeros(many), np.ones(many, dtype=bool)
    if track.q is not None:
        q = track.q[order]
    elif enough:
        q, gaps = _between(robot, stamps, states_q, at)
        within = (at >= stamps[0]) & (at <= stamps[-1])
    return Track(
        poses=order,
        stamps=at,
        t=np.interp(at, stamps, t) if enough else np.zeros(many),
        q=q,
        gaps=gaps,
        within=within,
        interval=float(np.median(np.diff(stamps))) * 1e-9 if len(stamps) > 1 else np.nan,
        states_at=stamps,
        states=states_q,
    )


def _around(states: MotionColumns, at: Times) -> Iterator[tuple[Times, Floats, Floats]]:
    # Yields stamps, times and joint positions of the states near the times `at` (ns), piece by
    # piece. Two successive states are kept if the interval between them overlaps the window of
    # `WINDOW_AROUND_POSES` around a time of `at`. The last state of a piece is passed on to the
    # next piece.
    begins, ends = at - WINDOW_AROUND_POSES, at + WINDOW_AROUND_POSES
    none = slice(0, 0)
    last, keep = (states.stamps[none], states.t[none], states.q[none]), np.zeros(0, dtype=bool)
    for rows in spans(len(states), LARGEST_BLOCK):
        stamps = states.stamps[rows]
        # Stamps may step back. Keep a state only if its stamp is later than every earlier stamp
        # in the recording.
        before = last[0] if len(last[0]) else np.array([-1])
        highest = np.maximum.accumulate(np.concatenate([before, stamps[:-1]]))
        rising = np.flatnonzero(stamps > highest)
        new = stamps[rising], states.t[rows][rising], states.q[rows][rising]
        part = [np.concatenate(pair) for pair in zip(last, new)]
        left, right = part[0][:-1], part[0][1:]
        meets = np.searchsorted(ends, left) < np.searchsorted(begins, right, side='right')
        keep = np.append(keep, np.zeros(len(rising), dtype=bool))
        keep[:-1] |= meets
        keep[1:] |= meets
        stamps, t, q = (column[:-1][keep[:-1]] for column in part)
        yield stamps, t, q
        last, keep = (part[0][-1:], part[1][-1:], part[2][-1:]), keep[-1:]
    yield last


def _between(robot: Robot, stamps: Times, q: Floats, at: Times) -> tuple[Floats, Floats]:
    # Returns joint positions (M, n) at the times `at` (M,), interpolated linearly between the
    # states before and after each time. Returns also the interval between the two states, (M,), s.
    # The interval is 0 if a state has exactly the requested stamp: no interpolation is needed.
    right = np.clip(np.searchsorted(stamps, at), 0, len(stamps) - 1)
    left = np.where(stamps[right] == at, right, np.maximum(right - 1, 0))
    gaps = np.asarray((stamps[right] - stamps[left]) * 1e-9, dtype=np.float64)
    fraction = np.divide((at - stamps[left]) * 1e-9, gaps, out=np.zeros(len(at)), where=gaps > 0)
    steps = q[right] - q[left]
    turned = (steps + np.pi) % (2.0 * np.pi) - np.pi
    steps = np.where(robot.continuous, turned, steps)
    return np.asarray(q[left] + fraction[:, None] * steps), gaps
