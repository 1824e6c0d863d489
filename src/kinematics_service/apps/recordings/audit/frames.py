# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compare tool poses that a second source measured with the poses computed from the recorded joint
positions (frame check).
"""

from typing import NamedTuple

import numpy as np

from ....errors import KinematicsError
from ....kernel import Floats
from ....kinematics.tool_state import evaluate
from ....rigid_motion import apart
from ....robot.measures import Level
from ....robot.robot import Robot
from ...checking.diagnosis import FINE, FrameDiagnosis, diagnose_frames
from ...checking.errors import PoseLimit
from ...checking.judgement import FrameLimits
from ..readers.block import Flags, Times
from ..readers.source import MAX_POSES, PoseTrack
from .neighbourhoods import Track, joined
from .timeline import Timeline

# The option --pose-gap is the largest accepted time between the joint states before and after a
# measured pose. The default is GAP_INTERVALS times the median interval between joint states, so
# that one or two lost messages do no harm. MIN_GAP and MAX_GAP bound the default.
GAP_INTERVALS = 3.0
# Least default (s) of --pose-gap, the largest accepted time between the joint states before and
# after a measured pose.
MIN_GAP = 0.05
# Largest default (s) of --pose-gap, the largest accepted time between the joint states before and
# after a measured pose.
MAX_GAP = 0.5
# Least number of poses for a comparison. A measured pose counts only if the joint positions at its
# time are known.
MIN_POSES = 3


class FrameSettings(NamedTuple):
    """
    Settings of the comparison of measured with computed tool poses.

    Attributes
    ----------
    gap : s
        Largest time between the joint states before and after a pose. None: three times the median
        interval between joint states, but at least 0.05 s and at most 0.5 s.
    limits
        Limits of the RMS difference that remains between measured and computed poses after the
        best constant offsets of base and tool were fitted: one for WARN, one for ERROR.
    fine
        If the RMS pose differences are at most this, the cause of the differences is not searched.
    """

    gap: float | None = None
    limits: FrameLimits = FrameLimits()
    fine: PoseLimit = FINE


class FrameReport(NamedTuple):
    """
    The diagnosis of the frame check, and the pose differences over time.

    Attributes
    ----------
    name, frame
        Name of the second source (topic or columns), and the frame in which it gives its poses.
    poses, considered, matched
        Numbers of poses. `poses`: all measured poses. `considered`: measured poses that were
        considered, evenly spread in time order. `matched`: considered poses with known joint
        positions.
    unmatched
        Why some considered poses have no joint positions, as text; empty if all have joint
        positions.
    doubts
        Remarks on implausible numbers in the measured poses, each a sentence.
    diagnosis
        Result of the frame check.
    limits
        Limits of the RMS difference that remains between measured and computed poses after the
        best constant offsets of base and tool were fitted: one for WARN, one for ERROR.
    t : shape (M,), s
        Time in the recording of each compared pose.
    position, rotation : shape (M,), m and rad
        Differences between measured and computed poses that remain after the best constant offsets
        of base and tool.
    """

    name: str
    frame: str
    poses: int
    considered: int
    matched: int
    unmatched: str
    doubts: tuple[str, ...]
    diagnosis: FrameDiagnosis
    limits: FrameLimits
    t: Floats
    position: Floats
    rotation: Floats

    @property
    def level(self) -> Level:
        """
        Return ERROR if the diagnosis names a cause. If not, compare the pose differences that
        remain after fitted constant offsets with the limits: OK, WARN or ERROR.
        """
        return self.limits.level(self.diagnosis)

    @property
    def sentence(self) -> str:
        """Return the result of the comparison as a sentence."""
        return self.limits.sentence(self.diagnosis)


class NotCompared(NamedTuple):
    """
    Measured poses that cannot be compared with computed poses. `reason` is a sentence, `code` the
    code of the error.
    """

    name: str
    frame: str
    poses: int
    reason: str
    code: str = 'unreadable'


def frames_of(
    robot: Robot, track: PoseTrack, timeline: Timeline, settings: FrameSettings
) -> FrameReport | NotCompared:
    """
    Compare tool poses that a second source measured with the poses computed from the recorded
    joint positions. Return the report, or the reason why a comparison is not possible.
    """
    none = NotCompared(track.name, track.frame, track.total or len(track.stamps), track.refused)
    if track.refused:
        return none
    if track.positions:
        text = 'positions without orientations are for calibrate alone'
        return none._replace(reason=text, code='unsupported')
    pairs = joined(robot, track, timeline)
    use, reason = matched(pairs, settings.gap)
    if np.sum(use) < MIN_POSES:
        reason = reason or f'there are {len(use)} poses'
        text = f'{reason}; at least {MIN_POSES} are needed'
        return none._replace(reason=text, code='too-few')
    q, poses, stamps, motion, chosen = chosen_poses(track, pairs, use)
    limit = settings.limits.explained
    try:
        diagnosis = diagnose_frames(
            robot, q, poses, stamps, motion, limit=limit, read=track.kind, fine=settings.fine
        )
    except KinematicsError as error:
        return none._replace(reason=str(error), code=error.code)
    M = diagnosis.base_offset @ evaluate(robot, q).pose @ diagnosis.tool_offset
    position, rotation = apart(poses, M)
    return FrameReport(
        name=track.name,
        frame=track.frame,
        poses=none.poses,
        considered=len(use),
        matched=int(np.sum(use)),
        unmatched=reason,
        doubts=track.doubts,
        diagnosis=diagnosis,
        limits=settings.limits,
        t=pairs.t[chosen],
        position=position,
        rotation=rotation,
    )


class ChosenPoses(NamedTuple):
    """
    N measured poses with the joint positions at their times.

    Attributes
    ----------
    q : shape (N, n), rad or m
        Joint positions at the times of the poses.
    poses : shape (N, 4, 4)
        Measured tool poses.
    stamps : shape (N,), s
        Time of each pose since the first measured pose.
    motion
        Times (K,), s since the first measured pose, and joint positions (K, n) at these times;
        None for fewer than two joint states.
    rows : shape (N,)
        Index of each chosen pose in the arrays of the `Track` from which it was chosen.
    """

    q: Floats
    poses: Floats
    stamps: Floats
    motion: tuple[Floats, Floats] | None
    rows: Times


def chosen_poses(track: PoseTrack, pairs: Track, use: Flags) -> ChosenPoses:
    """
    Choose at most `MAX_POSES` of the usable poses, evenly spread by index.

    `pairs` has M measured poses. A pose is usable if the joint positions at its time are known.
    `use` (M,) is true for usable poses.
    """
    rows = np.flatnonzero(use)
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, MAX_POSES).astype(int))]
    zero, motion = pairs.stamps[0], None
    if len(pairs.states_at) > 1:
        motion = (pairs.states_at - zero) * 1e-9, pairs.states
    stamps = (pairs.stamps[rows] - zero) * 1e-9
    return ChosenPoses(pairs.q[rows], track.poses[pairs.poses[rows]], stamps, motion, rows)


def matched(pairs: Track, longest: float | None) -> tuple[Flags, str]:
    """
    Return whether each measured pose has joint positions at its time, shape (M,). Return also, as
    text, why some poses have none.

    Parameters
    ----------
    longest : s
        Largest time between the joint states before and after a pose. None: three times the median
        interval between joint states, but at least 0.05 s and at most 0.5 s.
    """
    if longest is None:
        longest = min(max(GAP_INTERVALS * pairs.interval, MIN_GAP), MAX_GAP)
    outside, unknown = ~pairs.within, pairs.within & ~np.all(np.isfinite(pairs.q), axis=1)
    apart = pairs.within & ~unknown & (pairs.gaps > longest)
    reasons = [
        f'{int(np.sum(mask)):,} {words}'
        for mask, words in (
            (outside, 'before the first joint state or after the last'),
            (apart, f'between joint states more than {longest:.3g} s apart (see --pose-gap)'),
            (unknown, 'in rows without joint positions'),
        )
        if np.any(mask)
    ]
    use = ~(outside | unknown | apart)
    if not reasons:
        return use, ''
    return use, (
        f'{int(np.sum(~use)):,} of {len(use):,} poses have no joint positions at their time: '
        + ', '.join(reasons)
    )
