# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Turn rows of numbers into a recording with joint states, and with measured tool poses if the rows
have them.
"""

from collections.abc import Iterable, Iterator

import numpy as np

from ....robot.measures import Level
from .arm_columns import ArmColumns
from .block import Block, ForwardClock
from .source import MAX_POSES, PoseTrack, RecordingSource, Remark, Selection
from .table_rows import TableRows
from .tool_poses import PoseRows

# A remark warns of coarse stamps if `repeated / rows` exceeds this. Here `repeated` is the number
# of rows that have the same stamp as the row before.
REPEATED_STAMP_RATIO = 0.2


def source_of(
    columns: ArmColumns,
    selection: Selection,
    kind: str,
    total: int,
    pieces: Iterable[TableRows],
    remarks: list[Remark],
) -> RecordingSource:
    """
    Return the rows of a table or an episode as a recording.

    Parameters
    ----------
    kind, total
        Kind of file, as text, and approximate number of rows.
    pieces
        The rows. Their numbers are the joint positions, joint velocities and tool pose, in the
        order of `columns`. The iterator is read once.
    remarks
        Remarks on the file; reading may add remarks.
    """
    robot = selection.robot
    names = tuple(selection.joint_prefix + name for name in robot.joint_names)
    units = columns.joints.units(robot)
    n = len(columns.positions)
    m = n + len(columns.velocities)
    poses = PoseRows(columns.form, len(columns.poses), n)
    remarks += [Remark(Level.OK, text) for text in columns.guessed]

    def blocks() -> Iterator[Block]:
        clock, count, alike = ForwardClock(), 0, 0
        for stamps, numbers in pieces:
            q, qdot = units.positions(numbers[:, :n]), numbers[:, n:m] * units.scale[: m - n]
            if columns.poses:
                # Each measured pose keeps the joint positions of its own row. Skip a row if all of
                # its pose columns are empty. If only some are empty, the pose is invalid.
                rows = numbers[:, m:]
                known = np.any(np.isfinite(rows), axis=1)
                poses.take(stamps[known], rows[known], q[known], count + np.flatnonzero(known))
            # Use the stamps as times of receipt, because a table has no times of receipt.
            received = clock.times(stamps)
            count, alike = count + len(stamps), alike + int(np.sum(np.diff(stamps) == 0))
            yield Block(names, stamps, received, q, qdot)
        if alike > REPEATED_STAMP_RATIO * count:
            text = (
                f'{alike:,} of {count:,} rows have the stamp of the row before: --stamps 30Hz '
                'numbers rows taken at such a rate, --stamps none those of an arm at rest'
            )
            remarks.append(Remark(Level.WARN, text, 'repeated-stamps'))

    def track() -> PoseTrack | None:
        beginning = columns.names.pose
        name = f'{beginning}*' if beginning else ' '.join(columns.poses)
        return poses.track(name, '', MAX_POSES) if poses.count else None

    topic = f'{columns.names.position}*'
    return RecordingSource(kind, topic, False, total, blocks(), track, remarks)
