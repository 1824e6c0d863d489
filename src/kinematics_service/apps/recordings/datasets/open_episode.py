# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Open an episode of a dataset as a recording."""

from collections.abc import Iterator

import numpy as np

from ....robot.measures import Level
from ..readers.arm_columns import arm_columns
from ..readers.block import LARGEST_BLOCK, Times
from ..readers.source import RecordingSource, Remark
from ..readers.stamp_format import MAX_EPOCH_TIME, UNITS, StampFormat, unit_of
from ..readers.stored_columns import spans
from ..readers.table_rows import TableRows
from ..readers.table_source import source_of
from .arms import DatasetArm
from .episodes import Episode
from .vectors import Columns

# Offset that is added to the stamps of an episode, ns. The offset is needed because an episode may
# begin at stamp 0, which would mean unstamped.
STAMP_OFFSET = 1_000_000_000


def open_episode(episode: Episode, columns: Columns, arm: DatasetArm) -> RecordingSource:
    """
    Return one arm of an episode as a recording.

    Raises
    ------
    RecordingError
        Columns of the arm are missing.
    """
    selected = arm_columns(episode.file, columns.header, arm.reading)
    numbers = columns.chosen([*selected.positions, *selected.velocities, *selected.poses])
    stamps = _stamps(columns, selected.stamp, selected.stamps)

    def pieces() -> Iterator[TableRows]:
        for rows in spans(len(numbers), LARGEST_BLOCK):
            yield TableRows(stamps[rows], numbers[rows])

    remarks = [Remark(Level.OK, arm.guessed)] if arm.guessed else []
    return source_of(selected, arm.reading, 'episode', len(numbers), pieces(), remarks)


def _stamps(columns: Columns, column: str, form: StampFormat) -> Times:
    if not column:
        return form.of_rows(0, len(columns))
    times = columns.chosen([column])[:, 0]
    digits = UNITS[form.unit or unit_of(float(np.nanmax(times, initial=0.0)))]
    # Treat negative times, and times after the year 2096, as invalid: the stamp of their row
    # becomes 0, which means unstamped.
    known = (times >= 0.0) & (times * 10.0 ** (digits - 9) < MAX_EPOCH_TIME)
    nanoseconds = np.rint(np.where(known, times, 0.0) * 10.0**digits)
    return np.where(known, nanoseconds.astype(np.int64) + STAMP_OFFSET, 0)
