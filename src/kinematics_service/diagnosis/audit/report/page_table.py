"""Tables of the audit page."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

# Most rows of a table.
MOST = 60


class Column(NamedTuple):
    """A column: its header, the HTML of its cell for what a row is of, whether it is a number."""

    header: str
    cell: Callable[[Any], str]
    number: bool = False


def table_of(columns: Sequence[Column], found: Iterable[object]) -> str:
    """Return a table with a row for each thing that was found."""
    rows = ([column.cell(one) for column in columns] for one in found)
    numbers = [k for k, column in enumerate(columns) if column.number]
    return table([column.header for column in columns], rows, numbers)


def table(headers: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int]) -> str:
    """
    Return a table; cells are HTML already, those of the columns `numbers` are aligned to the
    right.
    """

    def cells(tag: str, row: Sequence[str]) -> str:
        return ''.join(
            f'<{tag}{" class=n" if k in numbers else ""}>{cell}</{tag}>'
            for k, cell in enumerate(row)
        )

    body = ''.join(f'<tr>{cells("td", row)}</tr>\n' for row in rows)
    head = f'<thead><tr>{cells("th", headers)}</tr></thead>\n' if any(headers) else ''
    return f'<div class="wide"><table>{head}<tbody>{body}</tbody></table></div>\n'


def more_of(number: int) -> str:
    """Return a sentence on the rows a table leaves out; empty if there are none."""
    if number <= MOST:
        return ''
    return f'<p class="soft">{number - MOST:,} more are in the JSON.</p>\n'
