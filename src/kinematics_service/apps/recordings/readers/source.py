# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define the types of an open recording or planned trajectory. All file types use these types."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from ....kernel import Floats
from ....robot.measures import Level
from ....robot.robot import Robot
from ...checking.pose_format import PoseFormat
from .between_points import PlannedTrajectory
from .block import Block, Times, UnreadableMessage
from .joint_format import JointFormat
from .stamp_format import StampFormat

# Largest number of measured poses that are compared with computed poses. More poses would hardly
# change the result.
MAX_POSES = 600


class PoseTrack(NamedTuple):
    """
    M poses of the tool, measured by a second source.

    Attributes
    ----------
    name
        The topic, or the columns, from which the poses were read.
    frame
        The frame in which the poses are given, empty if it is unknown.
    stamps : shape (M,), ns
    poses : shape (M, 4, 4)
    q : shape (M, n), rad or m
        If a table has poses and joint positions in the same rows: the joint positions of each row,
        in the order of the arm's joints. None if poses and joints are matched by time.
    refused
        The reason why the poses cannot be used, a sentence; empty if they can.
    doubts
        Remarks on implausible numbers in the poses, each a sentence.
    total
        Number of all poses of the source, if `poses` has only an evenly spread part of them. 0 if
        `poses` has all poses.
    kind
        How the source writes orientations, one of `pose_format.KINDS`; empty for matrices.
    rows : shape (M,)
        Row of each pose in its table, from 0; None without a table.
    """

    name: str
    frame: str
    stamps: Times
    poses: Floats
    q: Floats | None = None
    refused: str = ''
    doubts: tuple[str, ...] = ()
    total: int = 0
    kind: str = ''
    rows: Times | None = None

    @property
    def positions(self) -> bool:
        """
        Return whether the source gives only positions. Then the rotation of each pose is the
        identity.
        """
        return self.kind == 'position'


class Selection(NamedTuple):
    """
    Which topics or columns of a file are read, for which arm, and the units and formats of their
    numbers.
    """

    robot: Robot
    topic: str | None = None
    pose_topic: str | None = None
    columns: str | None = None
    joint_prefix: str = ''
    pose_format: PoseFormat = PoseFormat()
    joint_format: JointFormat = JointFormat()
    stamps: StampFormat = StampFormat()

    @property
    def of_tables(self) -> str:
        """
        Return the name of the first given option that applies only to tables, such as `--columns`;
        empty if none is given.
        """
        given = {
            '--columns': self.columns is not None,
            '--pose-format': self.pose_format != PoseFormat(),
            '--joint-format': self.joint_format != JointFormat(),
            '--stamps': self.stamps != StampFormat(),
        }
        return next((name for name, is_given in given.items() if is_given), '')


class Remark(NamedTuple):
    """
    A remark on a file, not on the motion in it. `level` is ERROR if the file is damaged, otherwise
    OK or WARN. `code` is the code of the fault; empty without a fault.
    """

    level: Level
    text: str
    code: str = ''


@dataclass(frozen=True, eq=False)
class RecordingSource:
    """
    An open recording or plan.

    Attributes
    ----------
    kind
        The type of the file, as text.
    topic
        The topic or the columns of the joint states.
    planned
        Whether the file is a planned trajectory and not a recording.
    total
        Number of messages according to the index of the file, for a progress bar. None if unknown.
    blocks
        The joint states; the iterator can be read only once.
    poses
        A function that returns the tool poses that a second source measured, or None if the file
        has none. Call it after all blocks were read.
    remarks
        Remarks on the file itself, complete after all blocks were read.
    plans
        The planned trajectories, complete after all blocks were read.
    pose_topics
        Names of the bag's topics that have poses, as text; empty without such topics.
    """

    kind: str
    topic: str
    planned: bool
    total: int | None
    blocks: Iterator[Block | UnreadableMessage]
    poses: Callable[[], PoseTrack | None] = lambda: None
    remarks: list[Remark] = field(default_factory=list)
    plans: list[PlannedTrajectory] = field(default_factory=list)
    pose_topics: str = ''
