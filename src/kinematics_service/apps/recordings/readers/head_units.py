# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Split column names into name and unit: `q1_deg`, `q3 [mm]`, `time (ms)`, `q[0]`."""

import re
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

from ....errors import RecordingError

# Words that are recognized as each unit in a column name, in small letters.
UNITS = {
    'rad': 'rad rads radian radians',
    'deg': 'deg degs degree degrees ° º',
    'm': 'm meter meters metre metres',
    's': 's sec secs second seconds',
    'us': 'us µs μs',
    '': '- 1 wxyz xyzw',
}
WORDS = {word: unit for unit, words in UNITS.items() for word in words.split()}
RATE = re.compile(r'(.+?)(?:[/_ ]s|/sec|\*?s\^?-1|ps)')
IN_BRACKETS = re.compile(r'(.*?\S)[\s_]*[\[(]\s*([^\[\]()]*?)\s*[\])]')
BEHIND = re.compile(
    r'(.*?[^\s_.])[\s_.]+((?:rad|deg|degrees|radians|m|mm|cm)(?:(?:[/_ ]s|ps)|)|sec|s|ms|us|ns)',
    re.IGNORECASE,
)


class HeadUnits(NamedTuple):
    """
    Column names without their units, in the order of the table. `heads` maps these names to the
    original names, and `units` maps them to the units.
    """

    names: list[str]
    heads: Mapping[str, str]
    units: Mapping[str, str]

    def unit(self, names: Sequence[str], accepted: Collection[str], where: str) -> str:
        """
        Return the unit that the names of several columns give, which must be the same for all.
        Return '' if the names give no unit.

        Raises
        ------
        RecordingError
            The columns have different units, or a unit that is not in `accepted`.
        """
        columns = {self.units.get(name, ''): name for name in names}
        if len(columns) > 1:
            pair = ' and '.join(repr(self.heads[name]) for name in list(columns.values())[:2])
            raise RecordingError(
                f'{where}: columns {pair} have different units; write both in one unit',
                code='mixed-units',
            )
        (unit,) = columns or ['']
        if unit and unit not in accepted:
            raise RecordingError(
                f'{where}: column {self.heads[names[0]]!r}: {unit!r} is not one of '
                f'{", ".join(accepted)}; rename the column, and give its unit by an option',
                code='unknown-unit',
            )
        return unit


def units_of_heads(header: Sequence[str], joints: Collection[str]) -> HeadUnits:
    """
    Split column names into names and units. If a column name ends in the name of a joint, it is
    not split.
    """
    parted = [(head, '') if head.endswith(tuple(joints)) else _parted(head) for head in header]
    names = [name for name, _ in parted]
    # Keep a whole column name if its name without unit is not unique, as for `q1_deg` and
    # `q1_rad`.
    kept = [
        (name, unit) if names.count(name) == 1 else (head, '')
        for head, (name, unit) in zip(header, parted)
    ]
    heads = {name: head for head, (name, _) in zip(header, kept)}
    return HeadUnits(list(heads), heads, {name: unit for name, unit in kept if unit})


def _parted(head: str) -> tuple[str, str]:
    match = IN_BRACKETS.fullmatch(head) or BEHIND.fullmatch(head)
    if match is None:
        return head, ''
    name, word = match[1], match[2].lower()
    if word.isdecimal():
        return f'{name}.{word}', ''
    rate = RATE.fullmatch(word)
    unit, of = (rate[1], '/s') if rate else (word, '')
    return name, WORDS.get(unit, unit) + of
