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

# To get joint positions at the time of a measured pose, the states before and after it are
# interpolated. Default of the largest time between these two states, in median intervals of the
# states. So up to two messages in between may be lost.
GAP_INTERVALS = 3.0
# Least value of this default, s.
MIN_GAP = 0.05
# Largest value of this default, s.
MAX_GAP = 0.5
# Least number of measured poses with joint positions at their times that a comparison needs.
MIN_POSES = 3


class FrameSettings(NamedTuple):
    """
    Settings of the comparison of measured with computed tool poses.

    Attributes
    ----------
    gap : s
        Largest time between the joint states before and after a pose; None: three median intervals
        of the joint states, within 0.05 s and 0.5 s.
    limits
        Limits of the RMS differences between measured and computed poses, after constant offsets
        of base and tool: the differences at which the level becomes WARN, and ERROR.
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
        Number of measured poses, number of evenly spread poses among them that were considered,
        and number of considered poses with joint positions at their time.
    unmatched
        Why some considered poses have no joint positions, as text; empty if all have joint
        positions.
    doubts
        Remarks on implausible numbers in the measured poses, each a sentence.
    diagnosis
        Result of the frame check.
    limits
        Limits of the RMS differences between measured and computed poses, after constant offsets
        of base and tool: the differences at which the level becomes WARN, and ERROR.
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
        """Return OK, WARN or ERROR, by the size of the pose differences after constant offsets."""
        return self.limits.level(self.diagnosis)

    @property
    def sentence(self) -> str:
        """Return the result of the comparison as a sentence."""
        return self.limits.sentence(self.diagnosis)


class NotCompared(NamedTuple):
    """Poses of a second source that cannot be compared; `reason` is a sentence with a code."""

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
    found = joined(robot, track, timeline)
    use, reason = matched(found, settings.gap)
    if np.sum(use) < MIN_POSES:
        reason = reason or f'there are {len(use)} poses'
        text = f'{reason}; at least {MIN_POSES} are needed'
        return none._replace(reason=text, code='too-few')
    q, poses, stamps, motion, chosen = chosen_poses(track, found, use)
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
        t=found.t[chosen],
        position=position,
        rotation=rotation,
    )


class ChosenPoses(NamedTuple):
    """
    N evenly spread poses that a second source measured, with the joint positions at their times.

    Attributes
    ----------
    q : shape (N, n), rad or m
    poses : shape (N, 4, 4)
    stamps : shape (N,), s
        Time of each pose since the first pose of `found`.
    motion
        Times (K,), s since the first pose, and joint positions (K, n) at these times; None for
        fewer than two states.
    rows : shape (N,)
        Index of each chosen pose in the arrays of the `Track`.
    """

    q: Floats
    poses: Floats
    stamps: Floats
    motion: tuple[Floats, Floats] | None
    rows: Times


def chosen_poses(track: PoseTrack, found: Track, use: Flags) -> ChosenPoses:
    """
    Choose at most `MAX_POSES`, evenly spread, of the M poses in `found`. `use` (M,) marks the
    poses that have joint positions.
    """
    rows = np.flatnonzero(use)
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, MAX_POSES).astype(int))]
    zero, motion = found.stamps[0], None
    if len(found.states_at) > 1:
        motion = (found.states_at - zero) * 1e-9, found.states
    stamps = (found.stamps[rows] - zero) * 1e-9
    return ChosenPoses(found.q[rows], track.poses[found.poses[rows]], stamps, motion, rows)


def matched(found: Track, longest: float | None) -> tuple[Flags, str]:
    """
    Return whether each measured pose has joint positions at its time, shape (M,). Return also, as
    text, why some poses have none.

    Parameters
    ----------
    longest : s
        Largest time between the joint states before and after a pose; None: three median intervals
        of the joint states, within 0.05 s and 0.5 s.
    """
    if longest is None:
        longest = min(max(GAP_INTERVALS * found.interval, MIN_GAP), MAX_GAP)
    outside, unknown = ~found.within, found.within & ~np.all(np.isfinite(found.q), axis=1)
    apart = found.within & ~unknown & (found.gaps > longest)
    reasons = [
        f'{int(np.sum(which)):,} {words}'
        for which, words in (
            (outside, 'before the first joint state or after the last'),
            (apart, f'between joint states more than {longest:.3g} s apart (see --pose-gap)'),
            (unknown, 'in rows without joint positions'),
        )
        if np.any(which)
    ]
    use = ~(outside | unknown | apart)
    if not reasons:
        return use, ''
    return use, (
        f'{int(np.sum(~use)):,} of {len(use):,} poses have no joint positions at their time: '
        + ', '.join(reasons)
    )
