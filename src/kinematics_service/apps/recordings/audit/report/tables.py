"""Tables of the pages of audits, without empty columns and with a limited number of rows."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

from .....page import table

# Largest number of rows of a table; the JSON has all.
MAX_TABLE_ROWS = 60
# Cell of an unknown number.
NOTHING = '&ndash;'


class TableColumn(NamedTuple):
    """A column: header, HTML of the cell for the thing of a row, whether it holds numbers."""

    header: str
    cell: Callable[[Any], str]
    number: bool = False


def table_of(columns: Sequence[TableColumn], found: Iterable[object]) -> str:
    """Return a table with a row for each thing, without empty columns."""
    things = list(found)
    cells = [[column.cell(one) for one in things] for column in columns]
    kept = [k for k, own in enumerate(cells) if not things or set(own) - {'', NOTHING}]
    numbers = [place for place, k in enumerate(kept) if columns[k].number]
    return table([columns[k].header for k in kept], zip(*(cells[k] for k in kept)), numbers)


def more_of(number: int) -> str:
    """Return a sentence on the omitted rows of a table, empty without omitted rows."""
    if number <= MAX_TABLE_ROWS:
        return ''
    return f'<p class="soft">{number - MAX_TABLE_ROWS:,} more are in the JSON.</p>\n'
