# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read the column heads of a table: the quantity and the unit of each column."""

import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from .cells import PastedRow, plain_cell
from .report import TableReport

WORDS = {
    'a': 'a linklength length',
    'r': 'r',  # depending on the book, `r` is a (along x) or d (along z)
    'alpha': 'alpha alph twist linktwist twistangle',
    'd': 'd linkoffset',
    'theta': 'theta th thet q jointangle',
    'offset': 'offset thetaoffset qoffset thoffset angleoffset',
    'type': 'type jointtype rp',
    'sigma': 'sigma',
    'joint': 'joint joints name jointname link links i j k n row rows frame frames axis no nr # '
    'id index',
    'limits': 'limits limit range qlim jointlimits jointlimit qlimits',
    'min': 'min lower qmin thetamin thmin limitmin q-',
    'max': 'max upper qmax thetamax thmax limitmax q+',
    'before': 'before ant antecedent',
    'gamma': 'gamma',
    'b': 'b',
}
MEANINGS = {word: meaning for meaning, words in WORDS.items() for word in words.split()}
UNIT = r'(mm|cm|m|inch|in|rad|radians?|deg|degrees?|°)'
IN_HEAD = re.compile(rf'[\s\[(/,_]+(?:in\s+)?{UNIT}\s*[\])]?$')
UNIT_ALONE = re.compile(rf'[\[(]?\s*{UNIT}\s*[\])]?')
INDEX = re.compile(r'[\[({]\s*([ijkn])\s*([-+]\s*1)?\s*[\])}]')
INDEXED = re.compile(r'(.+?)[ijkn]?([-+]1)?')
MINIMUM = re.compile(r'(?:^|[^a-z])(?:min|minimum|lower|lb)(?:[^a-z]|$)')
MAXIMUM = re.compile(r'(?:^|[^a-z])(?:max|maximum|upper|ub)(?:[^a-z]|$)')
ANGLES, LENGTHS = ('alpha', 'theta', 'offset'), ('a', 'd')


class Head(NamedTuple):
    """
    The head of a column: its quantity, its unit and its subscript.

    Attributes
    ----------
    meaning
        A key of `WORDS`; '' if the head is not understood.
    unit
        'rad', 'deg', 'm', 'mm', another word for a unit, or '' if the head has no unit.
    before
        Whether the head has the subscript i-1, such as a_{i-1} in Craig's table.
    after
        Whether the head has the subscript i+1. A table with the heads a_i, alpha_i, d_{i+1},
        theta_{i+1} is like Craig's table, which has a_{i-1}, alpha_{i-1}, d_i, theta_i.
    """

    meaning: str
    unit: str = ''
    before: bool = False
    after: bool = False


def head_of(text: str) -> Head:
    """
    Return the quantity, unit and subscript of a head such as `a`, `alpha (deg)`, `a_{i-1}` or
    `Link twist`.
    """
    text = INDEX.sub(r'\1\2', plain_cell(text).strip('*').lower())
    match = IN_HEAD.search(text)
    unit = _unit(match[1]) if match else ''
    text = text[: match.start()] if match else text
    for meaning, pattern in (('min', MINIMUM), ('max', MAXIMUM)):
        if pattern.search(text):
            return Head(meaning, unit)
    whole, *parts = [head for phrase in _phrases(text) if (head := _meaning(phrase))]
    if whole.meaning:
        return whole._replace(unit=unit)
    # Interpret the parts of a text such as `Joint angle theta` or `d (link offset)`. If the parts
    # mean different quantities, the head is not understood.
    heads = {head.meaning: head for head in parts if head.meaning}
    if len(heads) > 1:
        heads.pop('joint', None)
    return next(iter(heads.values()))._replace(unit=unit) if len(heads) == 1 else Head('', unit)


def _phrases(text: str) -> Iterable[str]:
    outside = re.sub(r'[\[(].*?[\])]', ' ', text)
    words = re.split(r'[\s,:=]+', outside.strip(' ,:='))
    inside = re.findall(r'[\[(](.*?)[\])]', text)
    return text, outside, *inside, ' '.join(words[:-1]), words[-1]


def _meaning(phrase: str) -> Head:
    word = re.sub(r'[\s_.,/()\[\]]', '', phrase)
    indexed = INDEXED.fullmatch(word)
    if word in MEANINGS or not indexed:
        return Head(MEANINGS.get(word, ''))
    return Head(MEANINGS.get(indexed[1], ''), '', indexed[2] == '-1', indexed[2] == '+1')


def find_heads(rows: Sequence[PastedRow]) -> int | None:
    """
    Return the index of the row with the column heads; None if no row has heads.

    This row is the first row with a head for alpha and for another quantity of a DH table.
    """
    for index, row in enumerate(rows):
        meanings = {head_of(cell).meaning for cell in row.cells}
        if 'alpha' in meanings and meanings & {'a', 'd', 'r', 'theta', 'offset'}:
            return index
    return None


def with_unit_row(heads: Sequence[Head], row: PastedRow) -> Sequence[Head] | None:
    """
    Return the column heads with units added. The units are the cells of `row`, the row below the
    heads. If a cell is not a unit, return None.
    """
    units = [UNIT_ALONE.fullmatch(cell.lower()) for cell in row.cells]
    if len(units) != len(heads) or any(cell and not unit for cell, unit in zip(row.cells, units)):
        return None
    return [
        head._replace(unit=_unit(unit[1])) if unit else head for head, unit in zip(heads, units)
    ]


def with_r(heads: Sequence[Head], report: TableReport) -> tuple[Sequence[Head], str]:
    """
    Replace the head `r`, which means a or d depending on the book. Return the heads, and the
    convention of the table ('' if unknown).

    In tables of Khalil and Dombre, d is along x and r along z; in other books r means a.
    """
    meanings = [head.meaning for head in heads]
    heads = [head._replace(meaning='type') if head.meaning == 'sigma' else head for head in heads]
    if 'r' not in meanings or 'd' not in meanings:
        return heads, ''
    r, d = (heads[meanings.index(name)] for name in ('r', 'd'))
    khalil = {'r': 'd', 'd': 'a', 'a': 'before'}
    of_khalil = {'sigma', 'gamma', 'b', 'before', 'a'} & set(meanings)
    if of_khalil or (d.before and not r.before):
        message = 'the letters are those of Khalil: d is along x (a here), r along z (d here)'
        report.note(message, 'khalil')
        heads = [head._replace(meaning=khalil.get(head.meaning, head.meaning)) for head in heads]
        return heads, 'modified'
    if r.before and not d.before:
        return [head._replace(meaning='a') if head is r else head for head in heads], ''
    words = [meaning or '-' for meaning in meanings]
    columns, others = (','.join(names.get(x, x) for x in words) for names in (khalil, {'r': 'a'}))
    return report.refuse(
        f'columns d and r: for a table of Khalil (d along x, r along z) write --columns {columns} '
        f'--convention modified; for others (r is a, along x) --columns {others}',
        'ambiguous',
    )


def _unit(word: str) -> str:
    return 'deg' if word[:3] == 'deg' or word == '°' else 'rad' if word[:3] == 'rad' else word
