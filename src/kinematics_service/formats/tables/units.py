"""The unit of the angles and of the lengths of a table: said, marked, or told by their size."""

import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from decimal import Decimal

from ...robot.file.parts.quantities import LONG, QUARTERS, TURN, rounded_quarters
from ...robot.file.text.expression_syntax import names_in
from ...typography import DEGREE, number_text
from ..urdf.quantity import angle_of, as_rounded_part_of_pi
from .heads import Head
from .moving_rows import ZERO, NumberedRow
from .report import TableReport

# What is an angle, what a length; the units of each, and the largest number of the first unit.
KINDS = {
    'angles': (('alpha', 'theta', 'offset'), ('rad', 'deg'), TURN),
    'lengths': (('a', 'd'), ('m', 'mm'), LONG),
}
IN_MM = {'mm': Decimal(1), 'cm': Decimal(10), 'm': Decimal(1000), 'in': Decimal('25.4')}
NUMBER = re.compile(r'(?<![\w.])(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?')
MARKED = re.compile(rf'({NUMBER.pattern})\s*\*?\s*(mm|cm|m|inch|in|rad(?:ians?)?)\b')
# A number that is a term of its own, without a mark of its unit.
TERM = re.compile(rf'(?<![*/])(?<![*/]\s){NUMBER.pattern}(?!\s*(?:[*/{DEGREE}\w(.]))')
DEGREE_DECIMALS = 9  # 29.999999999999996 is 30
LIMITS_TURNS = re.compile(r'-?(?:[3-9]\d|\d{3,})(?:\.\d*)?')  # limits of 30 rad are in degrees


def in_one_unit(
    kind: str,
    given: Collection[str],
    heads: Sequence[Head],
    rows: Sequence[NumberedRow],
    constants: Mapping[str, str],
    report: TableReport,
) -> str:
    """Return the unit of all angles, or of all lengths, and write their cells in it."""
    meanings, accepted, largest = KINDS[kind]
    said = {head.meaning: head.unit for head in heads if head.meaning in meanings and head.unit}
    chosen = {*said.values(), *set(given).intersection(accepted)}
    if set(given).intersection(accepted) and len(chosen) > 1:
        report.refuse(f'{kind} in {" and in ".join(sorted(chosen))}: write them in one')
    cells = [(row, name) for row in rows for name in meanings if row.cells.get(name)]
    texts = [_with_constants(row.cells[name], constants) for row, name in cells]
    if len(chosen) == 1 and chosen <= set(accepted):
        (unit,) = chosen
    elif chosen:
        unit = accepted[kind == 'lengths' and chosen != {'m', 'inch'}]
    elif kind == 'angles':
        unit = _angle_unit(texts, report)
    else:
        unit = _length_unit(texts, largest, report)
    if len(chosen) > 1:
        report.note(f'{kind} in {" and ".join(sorted(chosen))} are written in {unit}')
    for row, name in cells:
        own = said.get(name, unit if len(chosen) < 2 else '')
        row.cells[name] = _in_unit(row, name, own, unit, report)
    return unit


def _with_constants(cell: str, constants: Mapping[str, str]) -> str:
    return ' '.join([cell, *(constants.get(name, '') for name in sorted(names_in(cell)))])


def _plain(texts: Sequence[str]) -> Iterator[str]:
    # Numbers whose unit nothing tells. A factor, as in 26.45*0.0254, is shorter than the product.
    for text in texts:
        if 'pi' not in names_in(text):
            yield from (found for found in TERM.findall(text) if float(found))


def _angle_unit(texts: Sequence[str], report: TableReport) -> str:
    plain = sorted(_plain(texts), key=float)
    in_degrees = next((text for text in texts if DEGREE in text), '').strip()
    in_radians = next((text for text in texts if 'pi' in names_in(text)), '').strip()
    in_radians = in_radians or next((one for one in plain if is_quarter(one)), '')
    if plain and float(plain[-1]) > TURN:
        other, number = in_radians, plain[-1]
    else:
        other, number = in_degrees, plain[0] if plain else ''
    if other and number and number != other:
        report.refuse(
            f'{number} beside {other}: which unit has {number}? --units deg takes plain numbers '
            'in degrees, --units rad in radians; signs and parts of pi are read as they are'
        )
    if in_degrees and not in_radians:
        unit, why = 'deg', ', as the degree signs say'
    elif plain and float(plain[-1]) > TURN:
        unit, why = 'deg', f': {float(plain[-1]):g} rad are not meant'
    else:
        unit, why = 'rad', ''
    report.note(f'angles are taken to be in {unit}{why} (--units says otherwise)')
    return unit


def is_quarter(number: str) -> bool:
    """Return whether a number is a quarter turn in radians, as far as its digits go."""
    return '.' in number and as_rounded_part_of_pi(number) in QUARTERS


def _length_unit(texts: Sequence[str], largest: float, report: TableReport) -> str:
    marks = {unit[:2] for text in texts for _, unit in MARKED.findall(text)}
    numbers = list(_plain([text for text in texts if not re.search('[*/]', text)]))
    plain = [float(number) for number in numbers]
    if marks and plain:
        report.refuse(
            f'{numbers[0]} beside a length in {min(marks)}: which unit has {numbers[0]}? --units '
            'm or --units mm says that of plain numbers'
        )
    if marks:
        return 'm' if marks == {'m'} else 'mm'
    unit, why = 'm', ''
    if plain and max(plain) > largest:
        unit, why = 'mm', f': {max(plain):g} m are not meant'
    report.note(f'lengths are taken to be in {unit}{why} (--units says otherwise)')
    return unit


def _in_unit(row: NumberedRow, name: str, own: str, unit: str, report: TableReport) -> str:
    cell = row.cells[name]
    if own != unit and TERM.search(cell) and cell not in ZERO:
        if not own:
            report.fault('no unit is said: write it into the heads', row.line, f'column {name}')
        cell = TERM.sub(lambda found: f'{found[0]}{DEGREE if own == "deg" else own}', cell)
    return in_unit(cell, unit)


def in_unit(cell: str, unit: str) -> str:
    """Return a cell whose numbers with marks, such as `350 mm` or `pi/2`, are in a unit."""
    if unit == 'deg':
        cell = re.sub(r'\bpi\b', '180', cell.replace(DEGREE, ''))
    cell = re.sub(r'(\bpi\b[^*/]*?)\s*\b(?:rad|radians?)\b', r'\1', cell)

    def number(found: re.Match[str]) -> str:
        if found[2].startswith('rad'):
            value = float(found[1])
            return number_text(math.degrees(value)) if unit == 'deg' else found[1]
        in_mm = Decimal(found[1]) * IN_MM[found[2][:2]]
        return number_text(float(in_mm if unit == 'mm' else in_mm / 1000))

    return MARKED.sub(number, cell)


def rounded(cell: str, unit: str) -> str:
    """Return an angle whose numbers such as 1.5708 are the parts of pi that they round."""

    def part(found: re.Match[str]) -> str:
        if unit == 'deg':
            return number_text(round(float(found[0]), DEGREE_DECIMALS))
        quarters = [k * math.pi / 2.0 for _, k in rounded_quarters(found[0])]
        text = angle_of(*quarters or [as_rounded_part_of_pi(found[0])]).text
        return text if 'pi' in text else found[0]

    return TERM.sub(part, cell)
