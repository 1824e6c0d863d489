"""Tables of touched points: joint positions, and a column that names the point of each row."""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import CalibrationError
from ...formats.recordings.block import UnreadableMessage
from ...formats.recordings.open_file import TABLES, open_source
from ...formats.recordings.source import Selection
from ...kernel import Floats


@dataclass(frozen=True, eq=False)
class TouchRecording:
    """
    Touches of one file.

    Attributes
    ----------
    file
        The file.
    q : shape (N, n), rad or m
    points : N
        Names of the points touched.
    remarks
        Sentences on what was left out.
    """

    file: str
    q: Floats
    points: tuple[str, ...]
    remarks: tuple[str, ...]


def read_touches(file: Path, wanted: Selection, column: str) -> TouchRecording:
    """
    Return the joint positions of a table and the point touched at each row.

    Rows without a name are left out.

    Raises
    ------
    RecordingError
        The file cannot be read.
    CalibrationError
        It is no table, has no such column, or a named row has no number for some joint.
    """
    if file.exists() and file.suffix.lower() not in TABLES:
        raise CalibrationError(f'{file}: --same-point names a column of a table (.csv)')
    with open_source(file, wanted) as source:
        blocks = [one for one in source.blocks if not isinstance(one, UnreadableMessage)]
        remarks = [remark.text for remark in source.remarks]
    q = np.concatenate([one.positions for one in blocks])
    names = np.array(_column(file, column)[: len(q)])
    named = names != ''
    missing = np.flatnonzero(named & ~np.all(np.isfinite(q), axis=1))
    if len(missing):
        raise CalibrationError(
            f'{file}: row {missing[0]}, counted from 0, has no number for some joint'
        )
    if not np.all(named):
        left = int(np.sum(~named))
        what = 'row names no point and is' if left == 1 else 'rows name no point and are'
        remarks.append(f'{left} {what} left out')
    return TouchRecording(str(file), q[named], tuple(names[named].tolist()), tuple(remarks))


def _column(file: Path, column: str) -> list[str]:
    # The cells of the rows that the table's reader takes, empty lines being none.
    with file.open(encoding='utf-8-sig', newline='') as stream:
        first = next(line for line in stream if line.strip())
        delimiter = next((c for c in ',;\t' if c in first), ' ')
        header = [cell.strip() for cell in next(csv.reader([first], delimiter=delimiter))]
        if column not in header:
            raise CalibrationError(
                f'{file}: there is no column {column!r}; the header has {", ".join(header)}'
            )
        at = header.index(column)
        rows = (row for row in csv.reader(stream, delimiter=delimiter) if any(map(str.strip, row)))
        return [row[at].strip() if at < len(row) else '' for row in rows]
