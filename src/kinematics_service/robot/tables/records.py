# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read tables whose numbers have names: dictionaries, YAML, JSON, TOML, sympy substitutions."""

import re
from collections.abc import Sequence
from typing import NamedTuple

from .cells import PastedRow, plain_cell
from .heads import head_of
from .pasted import SEVERAL, cells_of, without_comments
from .report import TableReport

PAIR = re.compile(
    r"""["']?(?<![\w.])\.?(?P<owner>[\w.]+(?:\[\w+\]|\(\w+\))?\.)?"""
    r"""(?P<key>[A-Za-z_]\w*)["']?[ \t]*(?::|=>?)[ \t]*"""
    r"""(?P<value>\[[^\[\]{}:=]*\]|"[^"\n]*"|'[^'\n]*'"""
    r"""|(?:[^,;\n{}\[\]()"']|\([^()\[\]\n]*\)|\[\w+\])*)"""
)
ITEM = re.compile(r'(?m)^[ \t]*- ')
BLOCK_LIST = re.compile(r'(?m)^([ \t]*)(\w+):[ \t]*\n((?:[ \t]*- [^\n:]*(?:\n|\Z))+)')
# Matches the signs that separate the records of two table rows, such as braces. A text between the
# numbers of two different rows has at least one of these signs.
BETWEEN_ROWS = re.compile(r'[{}()]|\[\[|(?m:^[ \t]*-[ \t])|(?m:^[ \t]*[\w"\']+:[ \t]*$)|(?m:^\[)')
OTHER_LIST = re.compile(r'\][^\[]*:\s*\[|(?m:^[ \t]*\w+:[ \t]*\n[ \t]*-[ \t])')
TOML_LISTS = re.compile(r'(?m)^\[\[([\w.]+)\]\]')
NUMBERED = re.compile(r'(alpha|theta|th|[a-z])_?(\d+)')


class _Pair(NamedTuple):
    start: int
    end: int
    owner: str
    key: str
    value: str


def rows_of_records(text: str, report: TableReport) -> list[PastedRow]:
    """
    Return the column heads and the rows of a table in which each number has a name, such as
    `alpha: 0`; [] for any other text.
    """
    text = _with_lists(text)
    pairs = _pairs(text)
    keys = [head_of(pair.key).meaning for pair in pairs]
    if 'alpha' not in keys or not {'a', 'd', 'r'} & set(keys):
        return []
    is_vector = pairs[keys.index('alpha')].value.startswith('[')
    known = [pair for pair, key in zip(pairs, keys) if key]
    rows = _vectors(text, known, report) if is_vector else _sequence(text, pairs, report)
    if len(rows) < 3 and not is_vector:
        return []
    if others := sorted({pair.key for pair, key in zip(pairs, keys) if not key}):
        report.note(f'left out: {", ".join(others)}', 'left-out')
    return rows


def rows_of_substitutions(text: str, report: TableReport) -> list[PastedRow]:
    """
    Return the column heads and the rows of a table in which an indexed name stands before each
    number, such as `alpha0: 0, a0: 0, d1: 0.75`; [] for any other text.
    """
    text = without_comments(text)
    pairs = [pair for pair in _pairs(text) if NUMBERED.fullmatch(pair.key)]
    several = sum('alpha' in pair.key for pair in pairs) > 1
    return _numbered(text, pairs, report) if several else []


def _with_lists(text: str) -> str:
    # A YAML list may have one item in each line. Return the text with such lists in brackets.
    return BLOCK_LIST.sub(
        lambda match: f'{match[1]}{match[2]}: [{", ".join(ITEM.sub("", match[3]).split())}]\n',
        without_comments(text),
    )


def _pairs(text: str) -> list[_Pair]:
    return [
        _Pair(*match.span(), match['owner'] or '', match['key'].lower(), match['value'].strip())
        for match in PAIR.finditer(text)
        if match['value'].strip()
    ]


def _row(text: str, pair: _Pair, cells: Sequence[str]) -> PastedRow:
    return PastedRow(text.count('\n', 0, pair.start) + 1, tuple(map(plain_cell, cells)))


def _vectors(text: str, pairs: Sequence[_Pair], report: TableReport) -> list[PastedRow]:
    pairs = [pair for pair in pairs if pair.value.startswith('[')]
    vectors = {pair.key: cells_of(pair.value[1:-1]) for pair in pairs}
    if len(vectors) < len(pairs):
        report.refuse(SEVERAL, 'several-tables')
    if len({len(cells) for cells in vectors.values()}) > 1:
        counts = ', '.join(f'{key} has {len(cells)}' for key, cells in vectors.items())
        report.refuse(f'vectors of different lengths: {counts}', 'wrong-length')
    body = (_row(text, pairs[0], cells) for cells in zip(*vectors.values()))
    return [PastedRow(0, tuple(vectors)), *body]


def _sequence(text: str, pairs: Sequence[_Pair], report: TableReport) -> list[PastedRow]:
    rows: list[tuple[_Pair, dict[str, str]]] = []
    end = 0
    several = len(set(TOML_LISTS.findall(text))) > 1
    for pair in pairs:
        several |= bool(rows and OTHER_LIST.search(text, end, pair.start))
        if head_of(pair.key).meaning:
            parted = not rows or BETWEEN_ROWS.search(text, end, pair.start)
            if parted or pair.owner != rows[-1][0].owner or pair.key in rows[-1][1]:
                rows.append((pair, {}))
            rows[-1][1][pair.key] = pair.value
        end = pair.end
    if several:
        report.refuse(SEVERAL, 'several-tables')
    numbers = {'a', 'r', 'alpha', 'd', 'theta'}
    rows = [row for row in rows if numbers & {head_of(key).meaning for key in row[1]}]
    heads = list(dict.fromkeys(key for _, values in rows for key in values))
    body = [_row(text, pair, [values.get(key, '') for key in heads]) for pair, values in rows]
    return [PastedRow(0, tuple(heads)), *body]


def _numbered(text: str, pairs: Sequence[_Pair], report: TableReport) -> list[PastedRow]:
    # If alpha begins at index 0, and d and theta begin at 1, the table has Craig's indices: row i
    # has alpha(i-1), a(i-1), d(i) and theta(i). If the text has no value for a quantity, its cell
    # gets the name of the quantity, such as `d2`.
    parts = (NUMBERED.sub(r'\1 \2', pair.key).split() for pair in pairs)
    by_index = {(name, int(index)): pair for (name, index), pair in zip(parts, pairs)}
    if len({(pair.key, pair.value) for pair in pairs}) > len(by_index):
        report.refuse(SEVERAL, 'several-tables')
    twists = sorted(k for name, k in by_index if name == 'alpha')
    angle = next((name for name, _ in by_index if name in ('theta', 'th', 'q')), 'q')
    before = twists[0] == 0 and not {('d', 0), (angle, 0)} & by_index.keys()
    last = '(i-1)' if before else ''
    rows = [PastedRow(0, (f'alpha{last}', f'a{last}', 'd', 'theta'))]
    for k in twists:
        places = (('alpha', k), ('a', k), ('d', k + before), (angle, k + before))
        cells = [by_index[at].value if at in by_index else f'{at[0]}{at[1]}' for at in places]
        rows.append(_row(text, by_index['alpha', k], cells))
    return rows
