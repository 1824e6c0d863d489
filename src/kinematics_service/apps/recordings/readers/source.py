"""The content of a recording or a planned trajectory, from any kind of file."""

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

# Number of poses of a track that are compared; more would not tell more.
MOST_POSES = 600


class PoseTrack(NamedTuple):
    """
    Poses of the tool from a second source.

    Attributes
    ----------
    name
        The topic or the columns of the poses.
    frame
        The frame they are given in, empty if it is unknown.
    stamps : shape (M,), ns
    poses : shape (M, 4, 4)
    q : shape (M, n), rad or m
        Joint positions of the same rows, in the order of the arm; None if poses and joints have
        only their time in common.
    refused
        A sentence why the poses cannot be used; empty if they can.
    doubts
        Numbers beyond what a pose can have, each a sentence.
    total
        Number of poses of the source; these may be some of them, evenly spread. 0: just these.
    kind
        Of their orientations, one of `pose_format.KINDS`; empty if they are matrices already.
    rows : shape (M,)
        The row of a table that each is in, counted from 0; None where they are of no table.
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
        """Return whether they are positions alone, their orientation being the identity."""
        return self.kind == 'position'


class Selection(NamedTuple):
    """
    The parts of a file to read: topics by name, or columns by the beginnings of their names, and
    what the numbers of these mean.
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
        """Return the option that is given and is for tables alone; empty if none is."""
        given = {
            '--columns': self.columns is not None,
            '--pose-format': self.pose_format != PoseFormat(),
            '--joint-format': self.joint_format != JointFormat(),
            '--stamps': self.stamps != StampFormat(),
        }
        return next((name for name, is_given in given.items() if is_given), '')


class Remark(NamedTuple):
    """A remark on a file itself: `level` OK, WARN, or ERROR if it is damaged."""

    level: Level
    text: str


@dataclass(frozen=True, eq=False)
class RecordingSource:
    """
    An open file.

    Attributes
    ----------
    what
        Kind of file, in words.
    topic
        The topic or the columns of the joint states.
    planned
        Whether it is a planned trajectory rather than a recording.
    total
        Number of messages as far as the file tells, for a progress bar.
    blocks
        The joint states, once.
    poses
        Returns the second source of the tool pose when the blocks are read; None without any.
    remarks
        Remarks on the file itself, complete when the blocks are read.
    plans
        The planned trajectories, complete when the blocks are read.
    pose_topics
        The topics of a bag that may hold poses; empty without any.
    """

    what: str
    topic: str
    planned: bool
    total: int | None
    blocks: Iterator[Block | UnreadableMessage]
    poses: Callable[[], PoseTrack | None] = lambda: None
    remarks: list[Remark] = field(default_factory=list)
    plans: list[PlannedTrajectory] = field(default_factory=list)
    pose_topics: str = ''
