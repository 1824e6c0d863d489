# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Print tables and sentences that fit the terminal; in a pipe, print unbroken lines."""

import json
import math
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

from .kernel import Floats

# Types of the values that `json_text` accepts. Arrays become lists, and named tuples become
# objects.
Json: TypeAlias = (
    None | bool | int | float | str | npt.NDArray[Any] | Sequence['Json'] | Mapping[str, 'Json']
)

# Width of a line (characters) if the output is not a terminal. Then a program reads the output, so
# the width is large and lines are not broken.
UNBROKEN = 10_000
TRAILING_BLANKS = re.compile(r' +$', re.MULTILINE)
GAP = (0, 2, 0, 0)
BREAKS = re.compile(r'[^_/.-]*[_/.-]?')


class Output:
    """
    Standard output. Lines have the width of the terminal; without a terminal, lines are not
    broken.

    Text is printed without markup and highlights; colours appear only on a terminal.
    """

    def __init__(self) -> None:
        width = None if sys.stdout.isatty() or 'COLUMNS' in os.environ else UNBROKEN
        self._console = Console(width=width, markup=False, highlight=False, emoji=False)

    @property
    def width(self) -> int:
        """Return the number of characters of a line."""
        return self._console.width

    def print(self, *renderables: RenderableType) -> None:
        """Print renderables below each other, without blanks at the ends of lines."""
        with self._console.capture() as captured:
            self._console.print(*renderables, sep='\n')
        sys.stdout.write(TRAILING_BLANKS.sub('', captured.get()))


def plain(text: str) -> str:
    """Return a text without control characters, which a terminal would obey."""
    return ''.join(c if c.isprintable() or c == '\n' else '?' for c in text)


def table(*headers: str) -> Table:
    """
    Return an empty table with headers. On a narrow terminal, texts in cells are wrapped, not cut.
    """
    result = Table(box=None, padding=GAP, pad_edge=False)
    for header in headers:
        result.add_column(header, header_style='bold', overflow='fold')
    return result


def facts(rows: Iterable[tuple[str, str]]) -> Table:
    """
    Return a printable list of labels and texts. Pairs with an empty text are left out. All lines
    of a text are aligned.
    """
    result = Table.grid(padding=GAP)
    result.add_column(style='bold', no_wrap=True)
    result.add_column(overflow='fold')
    for label, text in rows:
        if text:
            result.add_row(f'  {plain(label)}', plain(text))
    return result


def heading(text: str, style: str = 'bold') -> Text:
    """Return a text in the style of a heading."""
    return Text(plain(text), style=style)


def broken_name(name: str, width: int) -> str:
    """
    Return a joint name broken after `_`, `/`, `.` or `-` into lines of at most `width` characters.

    A part between separators that is longer than `width` stays unbroken.
    """
    lines = ['']
    for part in BREAKS.findall(name):
        if len(lines[-1]) + len(part) > width and lines[-1]:
            lines.append('')
        lines[-1] += part
    return '\n'.join(lines)


def number(value: float, decimals: int = 6) -> str:
    """
    Return a number as text with `decimals` digits after the decimal point.

    If the absolute value is 10,000 or more, the text has `decimals` significant digits instead.
    """
    if not math.isfinite(value) or abs(value) >= 1e4:
        return f'{value:.{decimals}g}'
    return f'{round(float(value), decimals) + 0.0:.{decimals}f}'


def numbers(values: Floats, decimals: int = 6) -> str:
    """
    Return numbers as one line of text. Each number is padded to the width of the longest number.
    """
    texts = [number(value, decimals) for value in values]
    width = max(map(len, texts))
    return '  '.join(text.rjust(width) for text in texts)


def json_text(document: Mapping[str, Json]) -> str:
    """
    Return a document as strict JSON. Arrays become lists, named tuples become objects, and
    infinite numbers and NaN become null.
    """
    return json.dumps(_strict(document), allow_nan=False)


def _strict(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _strict(entry) for key, entry in value.items()}
    if isinstance(value, (np.ndarray, np.generic)):
        return _strict(value.tolist())
    if hasattr(value, '_asdict'):
        return _strict(value._asdict())
    if isinstance(value, (list, tuple)):
        return [_strict(entry) for entry in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value


def attributes(thing: object, *names: str) -> dict[str, Any]:
    """Return a dictionary from the attribute names `names` of an object to their values."""
    return {name: getattr(thing, name) for name in names}


@contextmanager
def working(text: str) -> Iterator[Callable[[str], None]]:
    """
    Show a status line on a terminal during the block; yield a function that changes the line.
    """
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda _: None
        return
    with console.status(text) as status:
        yield status.update
