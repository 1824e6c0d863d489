"""What stands in the columns of a table: the words over them, and their units."""

import re
from collections.abc import Sequence
from typing import NamedTuple

from .pasted import PastedRow, plain_cell

WORDS = {
    'a': 'a r linklength',
    'alpha': 'alpha twist linktwist twistangle',
    'd': 'd linkoffset',
    'theta': 'theta th q jointangle',
    'offset': 'offset thetaoffset qoffset',
    'type': 'type jointtype sigma rp',
    'joint': 'joint name jointname link i j row frame axis no #',
    'limits': 'limits limit range qlim jointlimits',
    'min': 'min lower qmin thetamin lowerlimit q⁻',
    'max': 'max upper qmax thetamax upperlimit q⁺',
}
MEANINGS = {word: meaning for meaning, words in WORDS.items() for word in words.split()}
UNIT = r'(mm|cm|m|inch|in|rad|radians?|deg|degrees?|°)'
IN_HEAD = re.compile(rf'[\s\[(/,_]+(?:in\s+)?{UNIT}\s*[\])]?$')
UNIT_ALONE = re.compile(rf'[\[(]?\s*{UNIT}\s*[\])]?')
INDEXED = re.compile(r'(.+?)[ijkn]?(-1)?')


class Head(NamedTuple):
    """
    What a column holds.

    Attributes
    ----------
    meaning
        A key of `WORDS`; empty where the head is not understood.
    unit
        'rad', 'deg', 'm', 'mm', another word for a unit, or empty.
    before
        Whether its index is that of the link before, as in Craig's table.
    """

    meaning: str
    unit: str = ''
    before: bool = False


def head_of(text: str) -> Head:
    """Return what the words over a column mean: `a`, `alpha (deg)`, `a_{i-1}`, `Link twist`."""
    text = plain_cell(text).lower()
    unit = IN_HEAD.search(text)
    word = re.sub(r'[\s_.,/()\[\]]', '', text[: unit.start()] if unit else text)
    indexed = INDEXED.fullmatch(word)
    before = word not in MEANINGS and indexed is not None and indexed[2] is not None
    if word not in MEANINGS and indexed:
        word = indexed[1]
    return Head(MEANINGS.get(word, ''), _unit(unit[1]) if unit else '', before)


def find_heads(rows: Sequence[PastedRow]) -> int | None:
    """Return which row holds the heads: the first with alpha and another quantity, or None."""
    for index, row in enumerate(rows):
        meanings = {head_of(cell).meaning for cell in row.cells}
        if 'alpha' in meanings and meanings & {'a', 'd', 'theta'}:
            return index
    return None


def with_unit_row(heads: Sequence[Head], row: PastedRow) -> Sequence[Head] | None:
    """Return the heads with the units of the row below them; None where it holds others."""
    units = [UNIT_ALONE.fullmatch(cell.lower()) for cell in row.cells]
    if len(units) != len(heads) or any(cell and not unit for cell, unit in zip(row.cells, units)):
        return None
    return [
        head._replace(unit=_unit(unit[1])) if unit else head for head, unit in zip(heads, units)
    ]


def _unit(word: str) -> str:
    return 'deg' if word[:3] == 'deg' or word == '°' else 'rad' if word[:3] == 'rad' else word
