# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Collect measured poses of a running robot, and interpolate the joint positions at the time of each
pose.
"""

from bisect import bisect_right
from collections import deque
from collections.abc import Sequence
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from ...kernel import Floats
from ...robot.robot import Robot
from ..recordings.readers.block import Flags

SECOND = 1_000_000_000  # ns
# If the joint states before and after a pose are more than this time (0.1 s, in ns) apart, the
# measured pose is left out.
MAX_GAP = SECOND // 10
# Largest number of joint states in memory: about four seconds at 500 Hz.
STATES = 2048
# Largest number of measured poses in memory that wait for a joint state with a later stamp.
MAX_AHEAD = STATES // 8
# Two measured poses are taken as one pose if each joint moved less than this angle (rad) between
# them. For a prismatic joint, the value is multiplied by the characteristic length.
MIN_CHANGE = 0.02
# Largest number of poses, matched with joint positions, that are kept.
MAX_POSES = 2000


class CollectedPoses(NamedTuple):
    """
    Joint positions and joint velocities (N, n) at N measured poses (N, 4, 4), and the stamps of
    the poses (N,), ns.
    """

    q: Floats
    rates: Floats
    poses: Floats
    stamps: tuple[int, ...]

    def at(self, rows: slice | Flags) -> 'CollectedPoses':
        """Return the poses with the given indices, and their joint positions, rates and stamps."""
        q, rates, poses = (values[rows] for values in self[:3])
        return CollectedPoses(q, rates, poses, tuple(np.array(self.stamps)[rows].tolist()))

    def followed_by(self, other: 'CollectedPoses') -> 'CollectedPoses':
        """Return the poses of `self`, followed by the poses of `other`."""
        q, rates, poses = (np.concatenate(pair) for pair in zip(self[:3], other[:3]))
        return CollectedPoses(q, rates, poses, (*self.stamps, *other.stamps))


def table_of(poses: CollectedPoses, joint_names: Sequence[str]) -> str:
    """
    Return collected poses as CSV text that `calibrate` reads: stamps (s), joint positions,
    matrices.
    """
    names = ['stamp', *(f'position.{name}' for name in joint_names)]
    lines = [','.join([*names, *(f'pose.{k}' for k in range(16))])]
    for stamp, q, pose in zip(poses.stamps, poses.q.tolist(), poses.poses):
        seconds, nanoseconds = divmod(stamp, SECOND)
        numbers = ','.join(map(repr, [*q, *pose.ravel().tolist()]))
        lines.append(f'{seconds}.{nanoseconds:09d},{numbers}')
    return '\n'.join([*lines, ''])


class _MatchedPose(NamedTuple):
    stamp: int
    q: Floats
    rates: Floats
    pose: Floats

    @property
    def speed(self) -> float:
        return float(np.max(np.abs(self.rates)))


class PoseCollector:
    """
    Matches each measured pose with the joint states before and after it, and keeps poses at
    different joint positions.

    While the arm stands still, only the pose with the lowest joint speed is kept.

    Parameters
    ----------
    robot
        The arm.
    max_poses
        Largest number of poses kept. If there are more, every second pose is dropped, so that
        early and late poses stay.

    Attributes
    ----------
    unmatched
        Number of poses without a joint state shortly before and after them.
    different
        Number of poses whose joint positions differed from those of the previous pose. Poses that
        were dropped later are counted.
    """

    def __init__(self, robot: Robot, max_poses: int = MAX_POSES) -> None:
        self.unmatched = self.different = 0
        self._max_poses = max_poses
        self._scales = robot.singularity.task.column_scales
        self._states: deque[tuple[int, Floats]] = deque(maxlen=STATES)
        self._ahead: deque[tuple[int, Floats]] = deque(maxlen=MAX_AHEAD)
        self._pairs: list[_MatchedPose] = []

    def __len__(self) -> int:
        return len(self._pairs)

    def note_state(self, stamp: int, q: Floats) -> None:
        """
        Store joint positions (n,) with their stamp, ns. Then match the waiting poses that have
        earlier stamps than these joint positions.

        If the stamp is not later than the previous stamp, the clock was reset. Then all stored
        joint positions and all waiting poses are dropped first.
        """
        if self._states and stamp <= self._states[-1][0]:
            self._states.clear()
            self._ahead.clear()
        self._states.append((stamp, q.copy()))
        while self._ahead and self._ahead[0][0] < stamp:
            self._match(*self._ahead.popleft())

    def note_pose(self, stamp: int, pose: Floats) -> None:
        """
        Match a pose (4, 4) with the joint positions before and after its stamp, ns, or store the
        pose until these joint positions arrive.
        """
        if self._states and stamp < self._states[-1][0]:
            self._match(stamp, pose)
        else:
            if len(self._ahead) == MAX_AHEAD:
                self.unmatched += 1
            self._ahead.append((stamp, pose))

    def collected(self) -> CollectedPoses:
        """Return the poses kept so far, with their joint positions."""
        pairs = self._pairs
        return CollectedPoses(
            np.array([pair.q for pair in pairs]),
            np.array([pair.rates for pair in pairs]),
            np.array([pair.pose for pair in pairs]),
            tuple(pair.stamp for pair in pairs),
        )

    def taken(self) -> CollectedPoses:
        """
        Return all kept poses except the last, and remove them from the collector. The last pose
        may still be replaced by one with a lower joint speed.
        """
        poses = self.collected().at(slice(-1))
        del self._pairs[:-1]
        return poses

    def _match(self, stamp: int, pose: Floats) -> None:
        states = self._states
        k = bisect_right(states, stamp, key=itemgetter(0))
        # If all joint states in memory are newer than the pose, k is 0, and the pose has no match.
        if not 0 < k < len(states) or states[k][0] - states[k - 1][0] > MAX_GAP:
            self.unmatched += 1
            return
        (before, q), (after, later) = states[k - 1], states[k]
        rates = (later - q) / (after - before)
        self._keep(_MatchedPose(stamp, q + rates * (stamp - before), SECOND * rates, pose))

    def _keep(self, pair: _MatchedPose) -> None:
        pairs = self._pairs
        if pairs and np.max(np.abs((pair.q - pairs[-1].q) / self._scales)) < MIN_CHANGE:
            if pair.speed < pairs[-1].speed:
                pairs[-1] = pair
            return
        pairs.append(pair)
        self.different += 1
        if len(pairs) > self._max_poses:
            del pairs[1::2]
