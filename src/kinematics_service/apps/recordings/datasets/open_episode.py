"""An episode of a dataset as a recording."""

from collections.abc import Iterator

import numpy as np

from ....robot.measures import Level
from ..readers.arm_columns import arm_columns
from ..readers.block import LARGEST_BLOCK, Times
from ..readers.source import RecordingSource, Remark
from ..readers.stamp_format import LATEST, UNITS, StampFormat, unit_of
from ..readers.table_rows import TableRows
from ..readers.table_source import source_of
from .arms import DatasetArm
from .episodes import Episode
from .vectors import Columns

# The stamps of an episode begin with 0, which is no stamp: they are taken this much later, ns.
LATER = 1_000_000_000


def open_episode(episode: Episode, columns: Columns, arm: DatasetArm) -> RecordingSource:
    """
    Return one arm of an episode as a recording.

    Raises
    ------
    RecordingError
        Columns of the arm are missing.
    """
    own = arm_columns(episode.file, columns.header, arm.reading)
    numbers = columns.chosen([*own.positions, *own.velocities, *own.poses])
    stamps = _stamps(columns, own.stamp, own.stamps)

    def pieces() -> Iterator[TableRows]:
        for begin in range(0, len(numbers), LARGEST_BLOCK):
            rows = slice(begin, begin + LARGEST_BLOCK)
            yield TableRows(stamps[rows], numbers[rows])

    remarks = [Remark(Level.OK, arm.guessed)] if arm.guessed else []
    return source_of(own, arm.reading, 'episode', len(numbers), pieces(), remarks)


def _stamps(columns: Columns, column: str, form: StampFormat) -> Times:
    if not column:
        return form.of_rows(0, len(columns))
    found = columns.chosen([column])[:, 0]
    digits = UNITS[form.unit or unit_of(float(np.nanmax(found, initial=0.0)))]
    # What is no time of this century is no stamp.
    known = (found >= 0.0) & (found * 10.0 ** (digits - 9) < LATEST)
    nanoseconds = np.rint(np.where(known, found, 0.0) * 10.0**digits)
    return np.where(known, nanoseconds.astype(np.int64) + LATER, 0)
