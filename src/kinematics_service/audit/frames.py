"""
The poses of a second source beside those of the recording: the frame doctor's part of an audit.

"""

from dataclasses import dataclass

import numpy as np

from ..frame_doctor import FrameDiagnosis, diagnose_frames
from ..kernel import Floats
from ..rigid_motion import rotation_vector
from ..robot import Robot
from ..tool_state import evaluate
from .block import AuditError
from .source import PoseTrack
from .timeline import Timeline

# Joint positions are taken between two messages that are at most so far apart (ns).
APART = 200_000_000
# Poses the doctor looks at; more would not tell more.
MOST = 600


@dataclass(frozen=True, eq=False)
class FrameReport:
    """
    The diagnosis, and what remains over time.

    Attributes
    ----------
    name, frame
        Where the poses come from, and the frame they are in.
    poses, matched
        How many there are, and how many have joint positions at their time.
    diagnosis
        Of the frame doctor.
    t : shape (M,), s
        Time in the recording of each matched pose.
    position, rotation : shape (M,), m and rad
        What remains with the constant offsets.

    """

    name: str
    frame: str
    poses: int
    matched: int
    diagnosis: FrameDiagnosis
    t: Floats
    position: Floats
    rotation: Floats


def frame_report(robot: Robot, timeline: Timeline, track: PoseTrack) -> FrameReport:
    """
    Return how the poses of a second source compare with the recording's.

    Raises
    ------
    AuditError
        Fewer than three of them are within the recording.

    """
    # Where stamps step back, only what goes beyond all before is used.
    stamps = timeline.stamps[:]
    rising = np.flatnonzero(stamps > np.maximum.accumulate(np.concatenate([[0], stamps[:-1]])))
    stamps = stamps[rising]
    if len(stamps) < 2:
        raise AuditError(f'{track.name}: the recording has too few states to compare with')
    right = np.clip(np.searchsorted(stamps, track.stamps), 1, len(stamps) - 1)
    left = right - 1
    gap = stamps[right] - stamps[left]
    use = (track.stamps >= stamps[left]) & (track.stamps <= stamps[right]) & (gap <= APART)
    if np.sum(use) < 3:
        raise AuditError(
            f'{track.name}: {int(np.sum(use))} of {len(track.stamps)} poses have a stamp within '
            'the recording; at least 3 are needed'
        )
    left, right, gap = left[use], right[use], gap[use]
    share = ((track.stamps[use] - stamps[left]) / gap)[:, None]
    first, second = timeline.q[rising[left]], timeline.q[rising[right]]
    step = second - first
    step = np.where(robot.continuous, (step + np.pi) % (2 * np.pi) - np.pi, step)
    q = first + share * step
    rates = step / (gap * 1e-9)[:, None]
    poses = track.poses[use]
    few = np.unique(np.linspace(0, len(q) - 1, MOST).astype(int))
    diagnosis = diagnose_frames(robot, q[few], poses[few], rates=rates[few])
    M = diagnosis.base_offset @ evaluate(robot, q).pose @ diagnosis.tool_offset
    turned = rotation_vector(poses[:, :3, :3] @ np.swapaxes(M[:, :3, :3], 1, 2))
    begin = timeline.t[rising[left]]
    return FrameReport(
        name=track.name,
        frame=track.frame,
        poses=len(track.stamps),
        matched=len(q),
        diagnosis=diagnosis,
        t=begin + share[:, 0] * (timeline.t[rising[right]] - begin),
        position=np.linalg.norm(poses[:, :3, 3] - M[:, :3, 3], axis=1),
        rotation=np.linalg.norm(turned, axis=1),
    )
