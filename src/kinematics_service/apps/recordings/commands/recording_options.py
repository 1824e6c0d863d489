# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Define the options of commands that read recordings: which topics or columns are read, and in which
units their numbers are.
"""

from typing import Annotated, NamedTuple, Optional

from ....cli.options import WrongUsage, named
from ....errors import RecordingError
from ....robot.robot import Robot
from ...checking.pose_format import PoseFormat, pose_format
from ..readers.joint_format import JointFormat
from ..readers.source import Selection
from ..readers.stamp_format import StampFormat, stamp_format

TopicOption = Annotated[
    Optional[str], named('--topic', 'Topic of a bag; needed if it has several.', 'TOPIC')
]
ColumnsOption = Annotated[
    Optional[str],
    named(
        '--columns',
        'Beginnings of the column names: stamp=, position=, velocity=, pose= (or '
        'pose=pos_+quat_); or columns by number (position=2-7), or elements of a vector '
        '(position=state[0:6]).',
        'KEY=START,...',
    ),
]
PrefixOption = Annotated[
    str, named('--joint-prefix', 'Prefix before the joint names of the robot file.', 'TEXT')
]
FormatOption = Annotated[
    Optional[str],
    named(
        '--pose-format',
        'Pose columns: m or mm, rad or deg, xyzw, wxyz, rotvec, rpy, matrix, position, or '
        'angles by their axes (xyz: that stand still; ZYX: that move); for instance mm,deg,ZYX; '
        'or a maker: kuka, fanuc, abb, staubli, kawasaki, ur, leica, faro.',
        'WORDS',
    ),
]
JointsOption = Annotated[
    Optional[str],
    named(
        '--joint-format',
        'Joint columns: rad, deg, turns, m, mm, percent of the limits, ticks a turn and '
        'their zero (4096@2048), a joint of its own (elbow=4096@2048), or a file with a '
        'calibration or statistics (.json).',
        'WORDS',
    ),
]
StampsOption = Annotated[
    Optional[str],
    named(
        '--stamps',
        'Unit of the stamps (s, ms, us, ns), or the rate of rows without stamps (30Hz); '
        'none: the arm stands still in each row.',
        'UNIT|RATE|none',
    ),
]


class TableWords(NamedTuple):
    """
    Values of the options --columns, --pose-format, --joint-format and --stamps; None if not given.
    """

    columns: str | None
    pose_format: str | None
    joint_format: str | None
    stamps: str | None


def given_selection(
    robot: Robot, topic: str | None, pose_topic: str | None, prefix: str, table: TableWords
) -> Selection:
    """
    Convert option values to a `Selection`: the topics or columns to read, and the units and
    formats of their numbers.
    """
    option = ''
    try:
        joints = JointFormat(table.joint_format or '')
        joints.units(robot)
        option = '--pose-format: '
        form = PoseFormat() if table.pose_format is None else pose_format(table.pose_format)
        option = '--stamps: '
        stamps = StampFormat() if table.stamps is None else stamp_format(table.stamps)
    except RecordingError as error:
        raise WrongUsage(f'{option}{error}') from None
    return Selection(robot, topic, pose_topic, table.columns, prefix, form, joints, stamps)
