"""What is read of a recording or a planned trajectory, whatever kind of file it is."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from ...kernel import Floats
from ...robot.measures import Level
from ...robot.robot import Robot
from .block import Block, Times, UnreadableMessage
from .pose_format import PoseFormat

# Poses of a track that are compared; more would not tell more.
MOST_POSES = 600


class PoseTrack(NamedTuple):
    """
    Poses of the tool from a second source.

    Attributes
    ----------
    name
        Topic or columns they come from.
    frame
        The frame they are given in, empty where nothing says so.
    stamps : shape (M,), ns
    poses : shape (M, 4, 4)
    q : shape (M, n), rad or m
        Joint positions of the same rows, in the order of the arm; None where poses and joints have
        only their time in common.
    refused
        Why the poses cannot be used, a sentence; empty where they can.
    doubts
        Numbers beyond what a pose can have, each a sentence.
    total
        How many poses the source has; these may be some of them, evenly spread. 0: just these.
    """

    name: str
    frame: str
    stamps: Times
    poses: Floats
    q: Floats | None = None
    refused: str = ''
    doubts: tuple[str, ...] = ()
    total: int = 0


class Selection(NamedTuple):
    """What to read of a file: topics by name, or columns by what they begin with."""

    robot: Robot
    topic: str | None = None
    pose_topic: str | None = None
    columns: str | None = None
    joint_prefix: str = ''
    pose_format: PoseFormat = PoseFormat()


class Remark(NamedTuple):
    """What is to be said of a file itself: `level` OK, WARN, or ERROR where it is damaged."""

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
        Topic or columns the joint states come from.
    planned
        Whether it is a planned trajectory rather than a recording.
    total
        Number of messages as far as the file tells, for a progress bar.
    blocks
        The joint states, once.
    poses
        Returns the second source of the tool pose when the blocks are read; None without any.
    remarks
        What is to be said of the file itself, complete when the blocks are read.
    """

    what: str
    topic: str
    planned: bool
    total: int | None
    blocks: Iterator[Block | UnreadableMessage]
    poses: Callable[[], PoseTrack | None] = lambda: None
    remarks: list[Remark] = field(default_factory=list)
