# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write the HTML tables of audit pages, without empty columns and with a limited number of rows.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

from .....page import table

# Largest number of rows of an HTML table; the JSON document has all rows.
MAX_TABLE_ROWS = 60
# HTML of a cell whose number is unknown.
NOTHING = '&ndash;'


class TableColumn(NamedTuple):
    """
    A column of an HTML table. Each row of the table shows one object.

    Attributes
    ----------
    header
        Text at the head of the column.
    cell
        Function that takes the object of a row and returns the HTML of the row's cell.
    number
        Whether the cells are numbers.
    """

    header: str
    cell: Callable[[Any], str]
    number: bool = False


def table_of(columns: Sequence[TableColumn], objects: Iterable[object]) -> str:
    """Return an HTML table with a row for each object, without empty columns."""
    rows = list(objects)
    cells = [[column.cell(row) for row in rows] for column in columns]
    kept = [k for k, texts in enumerate(cells) if not rows or set(texts) - {'', NOTHING}]
    numbers = [place for place, k in enumerate(kept) if columns[k].number]
    return table([columns[k].header for k in kept], zip(*(cells[k] for k in kept)), numbers)


def first_rows(columns: Sequence[TableColumn], objects: Sequence[object]) -> str:
    """Return an HTML table of at most `MAX_TABLE_ROWS` objects, and how many more exist."""
    return table_of(columns, objects[:MAX_TABLE_ROWS]) + more_of(len(objects))


def more_of(number: int) -> str:
    """
    Return a sentence on the number of rows that an HTML table omits; empty if it shows all rows.
    """
    if number <= MAX_TABLE_ROWS:
        return ''
    return f'<p class="soft">{number - MAX_TABLE_ROWS:,} more are in the JSON.</p>\n'
