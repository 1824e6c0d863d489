"""Rows of numbers as a recording: joint states, and poses of the tool if there are some."""

from collections.abc import Iterable, Iterator

import numpy as np

from ....robot.measures import Level
from .arm_columns import ArmColumns
from .block import Block
from .source import MOST_POSES, PoseTrack, RecordingSource, Remark, Selection
from .table_rows import TableRows
from .tool_poses import PoseRows

# Of as many rows with the stamp of the one before stamps are coarser than the rows.
COARSE = 0.2


def source_of(
    columns: ArmColumns,
    wanted: Selection,
    what: str,
    total: int,
    pieces: Iterable[TableRows],
    remarks: list[Remark],
) -> RecordingSource:
    """
    Return rows as a recording.

    Parameters
    ----------
    what, total
        Kind of file, in words, and about how many rows it has.
    pieces
        The numbers of positions, velocities and poses, side by side, once.
    remarks
        Remarks on the file, which the reading may add to.
    """
    robot = wanted.robot
    names = tuple(wanted.joint_prefix + name for name in robot.joint_names)
    units = columns.joints.units(robot)
    plain = not columns.joints.text
    n = len(columns.positions)
    m = n + len(columns.velocities)
    poses = PoseRows(columns.form, len(columns.poses), n)
    remarks += [Remark(Level.OK, text) for text in columns.guessed]

    def blocks() -> Iterator[Block]:
        before: tuple[int, int] | None = None
        count = alike = 0
        for stamps, numbers in pieces:
            q, qdot = numbers[:, :n], numbers[:, n:m]
            if not plain:
                q, qdot = units.positions(q), qdot * units.scale[: m - n]
            if columns.poses:
                # Poses and joints of a row belong together, however far apart the rows are.
                # A row without any number of a pose has none; one that lacks some is refused.
                rows = numbers[:, m:]
                known = np.any(np.isfinite(rows), axis=1)
                poses.take(stamps[known], rows[known], q[known], count + np.flatnonzero(known))
            # The time of receipt is that of the measurement; if the stamps step back, time goes
            # on.
            last, passed = before or (int(stamps[0]), int(stamps[0]))
            steps = np.maximum(np.diff(stamps, prepend=last), 0)
            received = passed + np.cumsum(steps)
            before = int(stamps[-1]), int(received[-1])
            count, alike = count + len(stamps), alike + int(np.sum(np.diff(stamps) == 0))
            yield Block(names, stamps, received, q, qdot)
        if alike > COARSE * count:
            text = (
                f'{alike:,} of {count:,} rows have the stamp of the row before: --stamps 30Hz '
                'numbers rows taken at such a rate, --stamps none those of an arm at rest'
            )
            remarks.append(Remark(Level.WARN, text))

    def track() -> PoseTrack | None:
        beginning = columns.names.pose
        name = f'{beginning}*' if beginning else ' '.join(columns.poses)
        return poses.track(name, '', MOST_POSES) if poses.count else None

    topic = f'{columns.names.position}*'
    return RecordingSource(what, topic, False, total, blocks(), track, remarks)
