# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find the units of the angles and lengths in a table. The column heads or the cells show the units,
for example by a degree sign or by pi. Otherwise the size of the numbers decides.
"""

import math
import re
from collections.abc import Collection, Mapping, Sequence
from decimal import Decimal

from ...typography import DEGREE, number_text
from ..file.parts.quantities import LARGEST_USUAL_ANGLE, LARGEST_USUAL_LENGTH, rounded_quarters
from ..file.text.expression_syntax import names_in
from ..urdf.quantity import angle_of, as_rounded_part_of_pi
from .cells import is_quarter
from .heads import Head
from .moving_rows import ZERO, NumberedRow
from .report import TableReport

# Words in the pasted text that show the units of its numbers.
WORDS = {
    'deg': re.compile(r'\bdegrees?\b(?!\(| of freedom)', re.IGNORECASE),
    'rad': re.compile(r'\bradians?\b(?!\()', re.IGNORECASE),
    'mm': re.compile(r'\bmm\b|\bmillimet(?:er|re)s?\b', re.IGNORECASE),
    'm': re.compile(r'\bmet(?:er|re)s?\b', re.IGNORECASE),
}
# For angles, and for lengths: the columns of the table that have them, the two accepted units, and
# the largest plausible number in the first unit.
KINDS = {
    'angles': (('alpha', 'theta', 'offset'), ('rad', 'deg'), LARGEST_USUAL_ANGLE),
    'lengths': (('a', 'd'), ('m', 'mm'), LARGEST_USUAL_LENGTH),
}
IN_MM = {'mm': Decimal(1), 'cm': Decimal(10), 'm': Decimal(1000), 'in': Decimal('25.4')}
NUMBER = re.compile(r'(?<![\w.])(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?')
MARKED = re.compile(rf'({NUMBER.pattern})\s*\*?\s*(mm|cm|m|inch|in|rad(?:ians?)?)\b')
# Matches a number without a unit. The number is a term of a sum, not a factor.
TERM = re.compile(rf'(?<![*/])(?<![*/]\s){NUMBER.pattern}(?!\s*(?:[*/{DEGREE}\w(.]))')
DEGREE_DECIMALS = 9  # degrees are rounded to this number of decimals: 29.999999999999996 to 30
# Matches a joint limit of 30 or more. The unit of such a limit must be degrees, because 30 rad
# would be almost five turns.
LIMITS_TURNS = re.compile(r'-?(?:[3-9]\d|\d{3,})(?:\.\d*)?')


def in_one_unit(
    kind: str,
    given: Collection[str],
    heads: Sequence[Head],
    rows: Sequence[NumberedRow],
    constants: Mapping[str, str],
    text: str,
    report: TableReport,
) -> str:
    """
    Choose one unit for all angles, or all lengths, of a table. Convert the cells to this unit, and
    return the unit.
    """
    meanings, accepted, _ = KINDS[kind]
    stated = {head.meaning: head.unit for head in heads if head.meaning in meanings and head.unit}
    requested = set(given).intersection(accepted)
    chosen = {*stated.values(), *requested}
    if requested and len(chosen) > 1:
        message = f'{kind} in {" and in ".join(sorted(chosen))}; write them in one unit'
        report.refuse(message, 'conflict')
    cells = [(row, name) for row in rows for name in meanings if row.cells.get(name)]
    if len(chosen) == 1 and chosen <= set(accepted):
        (unit,) = chosen
    elif chosen:
        unit = accepted[kind == 'lengths']
        message = f'{kind} in {" and ".join(sorted(chosen))} are written in {unit}'
        report.note(message, 'converted-unit')
    else:
        texts = [
            ' '.join([cell, *(constants.get(name, '') for name in sorted(names_in(cell)))])
            for cell in (row.cells[name] for row, name in cells)
        ]
        unit = _likely_unit(kind, texts, text, report)
    for row, name in cells:
        cell_unit, cell = stated.get(name, unit if len(chosen) < 2 else ''), row.cells[name]
        if cell_unit != unit and TERM.search(cell) and cell not in ZERO:
            if not cell_unit:
                row.fault(report, name, 'no unit; write it into the heads', 'missing-unit')
            cell = TERM.sub(rf'\g<0>{DEGREE if cell_unit == "deg" else cell_unit}', cell)
        row.cells[name] = in_unit(cell, unit)
    return unit


def _likely_unit(kind: str, texts: Sequence[str], whole: str, report: TableReport) -> str:
    # Choose the unit by marks in the cells: degree signs, the name pi, or unit words. If the cells
    # have no marks, choose the unit by the size of the numbers.
    _, (small, large), limit = KINDS[kind]
    words = {unit: match[0] for unit, pattern in WORDS.items() if (match := pattern.search(whole))}
    marks = words if len(words.keys() & {small, large}) == 1 else dict[str, str]()
    plain: list[str] = []
    for text in texts:
        units = ['m' if unit == 'm' else 'mm' for _, unit in MARKED.findall(text)]
        if kind == 'angles':
            units = ['deg'] * (DEGREE in text) + ['rad'] * ('pi' in names_in(text))
        marks |= dict.fromkeys(units, text.strip())
        # Compare only terms of sums, not factors, because in 26.45*0.0254 the factor 26.45 is
        # larger than the product.
        if 'rad' not in units:
            plain += [number for number in TERM.findall(text) if float(number)]
    plain.sort(key=float)
    is_large = bool(plain) and float(plain[-1]) > limit
    if kind == 'angles' and is_large and (quarters := list(filter(is_quarter, plain))):
        marks.setdefault('rad', quarters[0])
    other = marks.get(small if is_large else large)
    number = plain[-1 if is_large else 0] if plain else ''
    if number and other:
        report.refuse(
            f'{number} and {other}: which unit has {number}? Write --units {small} or --units '
            f'{large} for numbers without a sign or pi',
            'ambiguous',
        )
    unit = large if is_large or (large in marks and small not in marks) else small
    reason = f', because {float(number):g} {small} would be too large' if is_large else ''
    if unit == 'deg' and not is_large:
        reason = ', because of the degree signs'
    message = f'{kind} are read in {unit}{reason} (--units changes it)'
    report.note(message, 'assumed-unit')
    return unit


def in_unit(cell: str, unit: str) -> str:
    """
    Return the text of a cell in which numbers with a unit, such as `350 mm`, are converted to
    `unit`. The name pi in an angle, such as `pi/2`, means that the angle is in rad.
    """
    if unit == 'deg':
        cell = re.sub(r'\bpi\b', '180', cell.replace(DEGREE, ''))
    cell = re.sub(r'(\bpi\b[^*/]*?)\s*\b(?:rad|radians?)\b', r'\1', cell)

    def number(match: re.Match[str]) -> str:
        if match[2].startswith('rad'):
            value = float(match[1])
            return number_text(math.degrees(value)) if unit == 'deg' else match[1]
        in_mm = Decimal(match[1]) * IN_MM[match[2][:2]]
        return number_text(float(in_mm if unit == 'mm' else in_mm / 1000))

    return MARKED.sub(number, cell)


def rounded(cell: str, unit: str) -> str:
    """
    Return the text of an angle, in which rounded numbers are replaced: `1.5708` becomes `pi/2`.

    Fractions of pi replace rounded numbers in rad. If `unit` is deg, the numbers are instead
    rounded to DEGREE_DECIMALS decimals.
    """

    def part(match: re.Match[str]) -> str:
        if unit == 'deg':
            return number_text(round(float(match[0]), DEGREE_DECIMALS))
        quarters = [k * math.pi / 2.0 for _, k in rounded_quarters(match[0])]
        text = angle_of(*quarters or [as_rounded_part_of_pi(match[0])]).text
        return text if 'pi' in text else match[0]

    return TERM.sub(part, cell)
