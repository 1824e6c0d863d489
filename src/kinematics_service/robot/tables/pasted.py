# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Cut a pasted table (spreadsheet, plain text, Markdown, LaTeX, matrix) into rows of cells."""

import csv
import html
import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from ...typography import plain_names
from .cells import PastedRow, plain_cell
from .delimiter import delimiter_of
from .heads import MEANINGS, find_heads
from .report import TableReport

BARS = str.maketrans(dict.fromkeys('│┃║┆┊╎', '|'))
# Matches a line of signs between two rows, such as `-----` or `+---+`.
RULE = re.compile(r'[-+=:|_\s\u2500-\u257f]*')
# Matches the lines for base and tool in the printed table of a robot of Corke's toolbox.
ENDS = re.compile(r'(?m)^\W*(?:base|tool)\s*\|(?:\s*t\s*=[^|\n]*)?\s*\|?\s*$')
LATEX_ONLY = re.compile(
    r'(?<!\\)%.*|\\(?:begin|end)\{\w+\*?\}(?:\[\w\])?(?:\{(?:[^{}]|\{[^{}]*\})*\})*'
    r'|\\(?:hline|toprule|midrule|bottomrule|centering)|\\(?:cline|caption|label)\{[^{}]*\}'
)
MERGED = re.compile(r'\\multi(?:column\{(\d+)\}|row\{\d+\})\{[^{}]*\}\{([^{}]*)\}')
COMMENT = re.compile(r'(?m)(^|\s|(?<=[;,\])]))(?:#+|%+|//+)(?=\s*[\w(\[]).*$')
# Matches a line that has only a comment.
REMARK = re.compile(r'(?m)^\s*(?:#+|%+|//+)\s*(?=[\w\\(]).*$')
OPENED = '([{'
# Matches the white space between a head and its unit, as in `a [m] d [m]`.
UNIT_BEHIND = re.compile(r'(?<=\w)[ \t]+(?=[\[(](?:mm|cm|m|rad|deg|°)[\])])')
ROW_END = re.compile(r'(;\s*|(?<![,;\s])[ \t]*\n\s*)')
SEVERAL = 'the text has several tables; leave one in it'
NAMED = re.compile(r'([A-Za-z_]\w*)(?:\[\w*\])*\s*[=:(]+\s*(?:[\w.]+\(\s*)?$')


class ScriptMatrix(NamedTuple):
    """A matrix in a script: the variable to which it is assigned ('' if none) and its rows."""

    name: str
    rows: list[PastedRow]


def plain_text(text: str) -> str:
    """
    Return a pasted text with ASCII signs, and with names such as `theta1` for Greek letters and
    indices.

    In an HTML table, the tags between two cells become a bar, `|`.
    """
    text = html.unescape(text.replace('\r\n', '\n').replace('\r', '\n')).translate(BARS)
    text = re.sub(r'(?i)\s*</?t[dh][^>]*>\s*(?:<t[dh][^>]*>)?', '|', text)
    return plain_names(re.sub(r'(?i)<tr[^>]*>\s*\|?', '', text).replace('\\_', '_'))


def without_comments(text: str) -> str:
    """Return a script without its comments."""
    return COMMENT.sub(r'\1', text)


def rows_of(text: str, report: TableReport) -> list[PastedRow]:
    """Return the rows of a pasted table, without empty rows and lines such as `-----`."""
    # Do not read the text after the lower left corner of a box that is drawn around the table.
    text = ENDS.sub('', re.split('[└┗╚╰]', text, maxsplit=1)[0])
    if '&' in text and '\\\\' in text:
        return _plain(_latex(text))
    blocks = blocks_of(text)
    tables = [block for block in blocks if len(block.rows) > 1]
    if len(tables) > 1:
        names = [f'{table.name or "one"} in line {table.rows[0].line}' for table in tables]
        report.refuse(f'{SEVERAL} ({", ".join(names)})', 'several-tables')
    lines = [] if tables else _read_lines(text, report)
    if not tables and (len(blocks) != 1 or find_heads(lines) is not None):
        return lines
    return [*remark_heads(text), *(tables or blocks)[0].rows]


def remark_heads(text: str) -> list[PastedRow]:
    """
    Return a row of heads from a comment such as `# theta, a, d, alpha of each joint`, else [].
    """
    for match in REMARK.finditer(text):
        words = re.findall(r'[a-z]+', match[0].lower())
        heads = [word for word in words if MEANINGS.get(word) in ('a', 'alpha', 'd', 'theta')]
        if len(set(heads)) == len(heads) > 2:
            return [PastedRow(text.count('\n', 0, match.start()) + 1, tuple(heads))]
    return []


def blocks_of(text: str) -> list[ScriptMatrix]:
    """
    Return the matrices in a script or text.

    A matrix has one of two forms. In `[1, 2, 3], [4, 5, 6]`, each row is in brackets. In
    `[1 2 3; 4 5 6]`, all rows are in one pair of brackets. In the second form, a row ends at `;`
    or at the end of the line.
    """
    text = re.sub(r'\.\.\.[ \t]*\n', ' ', without_comments(text))
    blocks: list[ScriptMatrix] = []
    inner: dict[int, list[PastedRow]] = {}
    for start, end, parent in _groups(text):
        line = text.count('\n', 0, start) + 1
        named = NAMED.search(text[max(0, start - 80) : start])
        name = named[1] if named else ''
        if start in inner:
            blocks.append(ScriptMatrix(name, inner[start]))
            continue
        parts = ROW_END.split(text[start + 1 : end])
        rows = [
            PastedRow(line + ''.join(parts[:k]).count('\n'), tuple(cells_of(parts[k])))
            for k in range(0, len(parts), 2)
            if parts[k].strip()
        ]
        if text[start] == '[' and any(part.strip() for part in parts[2::2]):
            if min(len(row.cells) for row in rows) > 2:
                blocks.append(ScriptMatrix(name, _plain(rows)))
        elif len(cells := cells_of(text[start + 1 : end])) > 2 and (parent >= 0 or not name):
            inner.setdefault(parent, []).extend(_plain([PastedRow(line, tuple(cells))]))
    alone = inner.pop(-1, None)
    return [*blocks, ScriptMatrix('', alone)] if alone else blocks


def cells_of(text: str) -> list[str]:
    """Return the elements of a list, split at commas; without commas, split at white space."""
    depth, at = 0, [-1]
    for k, sign in enumerate(text):
        depth += (sign in OPENED) - (sign in ')]}')
        if sign == ',' and depth == 0:
            at.append(k)
    if len(at) > 1:
        cells = [text[i + 1 : j] for i, j in zip(at, [*at[1:], len(text)])]
        return cells if cells[-1].strip() else cells[:-1]
    packed = re.sub(r'\s*([*/])\s*|(?<=\S)\s+([-+])\s+', r'\1\2', text.strip())
    return re.split(r'\s+', packed) if packed else []


def _groups(text: str) -> Iterator[tuple[int, int, int]]:
    # Yield three indices for each pair of brackets: its begin, its end, and the begin of the
    # surrounding pair, or -1. Brackets of function calls are left out. Inner pairs come first.
    opened: list[tuple[int, bool]] = []
    for k, sign in enumerate(text):
        if sign in OPENED:
            opened.append((k, sign != '{' and re.match(r'\w', text[k - 1 : k]) is not None))
        elif sign in ')]}' and opened:
            start, called = opened.pop()
            if not called:
                yield start, k, next((begin for begin, call in reversed(opened) if not call), -1)


def _plain(rows: Iterable[PastedRow]) -> list[PastedRow]:
    plain = (PastedRow(line, tuple(map(plain_cell, cells))) for line, cells in rows)
    return [row for row in plain if any(row.cells)]


def _latex(text: str) -> Iterator[PastedRow]:
    line = 1
    for row in re.split(r'\\\\(?:\[[^\]]*\])?', LATEX_ONLY.sub('', text)):
        before = row[: len(row) - len(row.lstrip())]
        merged = MERGED.sub(lambda match: match[2] + '&' * (int(match[1] or 1) - 1), row)
        if '&' in merged:
            yield PastedRow(line + before.count('\n'), tuple(merged.split('&')))
        line += row.count('\n')


def _read_lines(text: str, report: TableReport) -> list[PastedRow]:
    # Remove all comments, except a comment with the column heads of the table.
    kept = []
    for line in text.split('\n'):
        bare = re.sub(r'^\s*(?:#+|%+|//+)\s*(?=[\w\\(])', '', line)
        if bare != line and find_heads(_plain(_lines(bare, delimiter_of([bare])))) is None:
            bare = ''
        kept.append(without_comments(bare))
    text = '\n'.join(kept)
    filled = [line for line in kept if not RULE.fullmatch(line)]
    try:
        rows = _plain(_lines(text, delimiter_of(filled)))
        aligned = _plain(_lines(text, ' ')) if find_heads(rows) is None else rows
        return rows if find_heads(aligned) is None else aligned
    except csv.Error as error:
        report.refuse(f'cannot be read as a table: {error}', 'syntax')


def _lines(text: str, delimiter: str) -> Iterator[PastedRow]:
    lines = {n: line for n, line in enumerate(text.splitlines(), 1) if not RULE.fullmatch(line)}
    if delimiter != ' ':
        bars = (line.strip().removeprefix('|').removesuffix('|') for line in lines.values())
        cut = bars if delimiter == '|' else lines.values()
        reader, numbers = csv.reader(cut, delimiter=delimiter, skipinitialspace=True), list(lines)
        yield from (PastedRow(numbers[reader.line_num - 1], tuple(cells)) for cells in reader)
        return
    # Cells such as `q1 + 90` contain spaces. Cut the lines in three ways: at every space, at two
    # or more spaces, or at spaces that are not around an operator. Use the way in which the number
    # of cells varies least from row to row.
    lines = {n: UNIT_BEHIND.sub('', re.sub(r',\s+', ',', line)) for n, line in lines.items()}
    packed = {n: re.sub(r'(?<=\w)\s+([-+*/])\s+(?=\w)', r'\1', line) for n, line in lines.items()}
    ways = [
        [PastedRow(n, tuple(re.split(gap, line.strip()))) for n, line in texts.items()]
        for gap, texts in ((r'\s+', lines), (r'\s{2,}', lines), (r'\s+', packed))
    ]
    counts = [{len(row.cells) for row in rows} for rows in ways]
    yield from ways[min(range(3), key=lambda k: (max(counts[k], default=0) < 3, len(counts[k])))]
