"""Tables of the pages of audits: without empty columns, and without rows that the JSON has."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

from .....page import table

# Most rows of a table.
MOST = 60
# Cell of a number that is not known.
NOTHING = '&ndash;'


class TableColumn(NamedTuple):
    """A column: its header, the HTML of its cell for what a row is of, whether it is a number."""

    header: str
    cell: Callable[[Any], str]
    number: bool = False


def table_of(columns: Sequence[TableColumn], found: Iterable[object]) -> str:
    """Return a table with a row for each thing that was found, without empty columns."""
    things = list(found)
    cells = [[column.cell(one) for one in things] for column in columns]
    kept = [k for k, own in enumerate(cells) if not things or set(own) - {'', NOTHING}]
    numbers = [place for place, k in enumerate(kept) if columns[k].number]
    return table([columns[k].header for k in kept], zip(*(cells[k] for k in kept)), numbers)


def more_of(number: int) -> str:
    """Return a sentence on the rows a table leaves out; empty if there are none."""
    if number <= MOST:
        return ''
    return f'<p class="soft">{number - MOST:,} more are in the JSON.</p>\n'
