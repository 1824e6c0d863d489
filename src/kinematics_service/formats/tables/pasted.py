"""A table cut into rows of cells: of a spreadsheet, a text, Markdown, LaTeX, or a matrix."""

import csv
import re
from collections.abc import Iterator
from typing import NamedTuple

from ..recordings.table_rows import delimiter_of

MATRIX = re.compile(r'\s*(?:\w+\s*=\s*)?(?:[\w.]+\()?\[(.*)\][^\[\]|]*', re.DOTALL)
ROW_OF_MATRIX = re.compile(r'(?:;|\],)[ \t]*\n?')
RULE = re.compile(r'[-+=:|\s┌┬┐├┼┤─]*')  # a line between rows
LATEX_ONLY = re.compile(
    r'(?<!\\)%.*|\\(?:begin|end)\{\w+\*?\}(?:\[\w\])?(?:\{(?:[^{}]|\{[^{}]*\})*\})*'
    r'|\\(?:hline|toprule|midrule|bottomrule|centering)|\\(?:cline|caption|label)\{[^{}]*\}'
)
MERGED = re.compile(r'\\multi(?:column\{(\d+)\}|row\{\d+\})\{[^{}]*\}\{([^{}]*)\}')
# What a cell of LaTeX or Markdown holds, and what it means.
PLAIN = tuple(
    (re.compile(pattern), plain)
    for pattern, plain in (
        (r'\\[dt]?frac\{(\\?\w+)\}\{(\w+)\}', r'\1/\2'),
        (r'\\[dt]?frac\{([^{}]*)\}\{([^{}]*)\}', r'(\1)/(\2)'),
        (r'\^\s*\{?\s*\\circ\s*\}?|\\(?:text)?degree', '°'),
        (r'\^\s*\{?\s*(?:\*|\\ast|\\star)\s*\}?', ''),  # marks the joint's variable
        (r'\\(?:text|math)\w*\{([^{}]*)\}', r'\1'),
        (r'\\(?:cdot|times)\b', '*'),
        (r'\\(?:left|right|quad|[,;:! ])', ' '),
        (r'\\(?=[A-Za-z])|[${}]', ''),
        (r'(?<=\d)\s*(?=pi\b)', '*'),
    )
)


class PastedRow(NamedTuple):
    """The cells of a row, and its line in the text."""

    line: int
    cells: tuple[str, ...]


def plain_cell(text: str) -> str:
    """Return a cell without marks of LaTeX and Markdown; `q1*`, a variable, is `q1`."""
    for pattern, plain in PLAIN:
        text = pattern.sub(plain, text)
    return text.strip(' \t\n*`"\'')


def rows_of(text: str) -> list[PastedRow]:
    """
    Return the rows of a table that hold anything, lines between them left out.

    Raises
    ------
    csv.Error
        Quotes or characters that no table has.
    """
    # Tables of programs in boxes end with their last line.
    text = text.partition('└')[0].replace('│', '|')
    if matrix := MATRIX.fullmatch(text):
        text = re.sub(r'[\[\]]', '', ROW_OF_MATRIX.sub('\n', matrix[1]))
    rows = _latex(text) if '&' in text and '\\\\' in text else _lines(text)
    plain = (PastedRow(line, tuple(map(plain_cell, cells))) for line, cells in rows)
    return [row for row in plain if any(row.cells)]


def _latex(text: str) -> Iterator[PastedRow]:
    line = 1
    for row in re.split(r'\\\\(?:\[[^\]]*\])?', LATEX_ONLY.sub('', text)):
        before = row[: len(row) - len(row.lstrip())]
        merged = MERGED.sub(lambda found: found[2] + '&' * (int(found[1] or 1) - 1), row)
        if '&' in merged:
            yield PastedRow(line + before.count('\n'), tuple(merged.split('&')))
        line += row.count('\n')


def _lines(text: str) -> Iterator[PastedRow]:
    lines = {n: line for n, line in enumerate(text.splitlines(), 1) if not RULE.fullmatch(line)}
    delimiter = delimiter_of(list(lines.values()))
    if delimiter != ' ':
        bare = (line.strip().removeprefix('|').removesuffix('|') for line in lines.values())
        cells_of = bare if delimiter == '|' else lines.values()
        reader = csv.reader(cells_of, delimiter=delimiter, skipinitialspace=True)
        numbers = list(lines)
        yield from (PastedRow(numbers[reader.line_num - 1], tuple(cells)) for cells in reader)
        return
    # Cells such as `q1 + 90` hold spaces: then more than one is between the columns.
    narrow, wide = (
        [PastedRow(n, tuple(re.split(gap, line.strip()))) for n, line in lines.items()]
        for gap in (r'\s+', r'\s{2,}')
    )
    yield from min((narrow, wide), key=_unevenness)


def _unevenness(rows: list[PastedRow]) -> tuple[bool, int]:
    lengths = {len(row.cells) for row in rows}
    return max(lengths, default=0) < 3, len(lengths)
