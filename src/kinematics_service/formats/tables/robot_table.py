"""A robot file from a table of Denavit and Hartenberg in one of the forms people have."""

import csv
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import PurePath

from ...errors import Fault, RobotFileError
from ...robot.file.parts.quantities import LONG, TURN
from ...robot.file.reader import parse_robot
from ...robot.file.text.expression_syntax import names_in
from ...robot.file.translation import RobotText
from ...robot.file.writing.writer import scalar
from ...typography import DEGREE, plain_names
from .heads import Head, find_heads, head_of, with_unit_row
from .moving_rows import MovingRow, NumberedRow, moving_rows
from .pasted import PastedRow, rows_of
from .report import TableReport
from .toolbox import ToolboxLinks, toolbox_links

HOW = (
    'such as --columns a,alpha,d,theta (known are also offset, type, joint, limits, min, max; '
    '- for a column that is left out)'
)
NUMBER = re.compile(r'(?<![\w.])(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?')
DECIMAL_COMMA = re.compile(r'(?<=\d),(?=\d)')
IN_THOUSANDS = re.compile(r'-?[1-9]\d{0,2},\d{3}')
BETWEEN = re.compile(r'\s*(?:,|;|\.\.\.?|…|\bto\b|~)\s*|\s+')
SCALED = re.compile(r'(?:(.*\*))?\s*(?:array\()?\[(.*)\]\)?\s*([*/].*)?')
PLACE = re.compile(r'(links|joints)\[(\d+)\](?:\.(\w+))?.*')
BASE_OR_TOOL = re.compile(r"[.'(,│]\s*(base|tool)'?\s*[=,│]")
# What is an angle, what a length; the units of each, and from where on the first is not meant.
KINDS = {
    'angles': (('alpha', 'theta', 'offset'), ('rad', 'deg'), TURN),
    'lengths': (('a', 'd'), ('m', 'mm'), LONG),
}


def read_table(
    text: str,
    file: str,
    name: str,
    units: Collection[str] = (),
    convention: str | None = None,
    columns: str | None = None,
) -> RobotText:
    """
    Return a robot file that says what a table says, and what had to be assumed.

    Parameters
    ----------
    text
        Rows of a spreadsheet, of a text, of Markdown or LaTeX, a matrix, or calls of Corke's
        toolbox.
    file, name
        Of the text, for messages; of the robot.
    units
        Of 'rad' or 'deg', 'm' or 'mm'; of the others heads and numbers decide.
    convention
        'standard' or 'modified'; None: as the table says, else standard.
    columns
        Heads with commas between them, in the place of those of the table; `-` leaves one out.

    Raises
    ------
    RobotFileError
        The table cannot be read; what is wrong in a cell is said with its row and column.
    """
    report = TableReport(file)
    plain = plain_names(text.replace('\r\n', '\n').replace('\r', '\n'))
    script = toolbox_links(plain, report)
    constants = script.constants if script else {}
    heads, body = _headed(script.rows if script else _pasted(plain, report), columns, report)
    chosen = _convention(heads, script, convention, report)
    rows = _numbered(heads, body, report)
    report.raise_faults()
    if found := BASE_OR_TOOL.search(plain if script else plain.partition('└')[2]):
        report.note(f'{found[1]} is not read: write it into the robot file')
    units = units if 'deg' in units or not script else {'rad', *units}
    angle, length = (_unit(kind, units, heads, rows, constants, report) for kind in KINDS)
    arm = moving_rows(rows, constants, report)
    joints = [_joint(row, report) for row in arm if row.variable]
    report.raise_faults()
    source = ''.join(c if c.isprintable() else '?' for c in PurePath(file).name)
    lines = [
        f'robot: {name}',
        f'source: {scalar(source)}',
        f'convention: {chosen}',
        f'units: {{angle: {angle}, length: {length}}}',
        *_constants(constants, arm),
        'joints:',
        *joints,
        'links:',
        *(_link(row, angle) for row in arm),
    ]
    written = '\n'.join([*lines, ''])
    try:
        parse_robot(written, file)
    except RobotFileError as error:
        raise RobotFileError([_in_the_table(fault, arm) for fault in error.faults]) from None
    return RobotText(written, tuple(report.notes))


def _pasted(text: str, report: TableReport) -> Sequence[PastedRow]:
    try:
        return rows_of(text)
    except csv.Error as error:
        report.refuse(f'cannot be read as a table: {error}')


def _headed(
    rows: Sequence[PastedRow], columns: str | None, report: TableReport
) -> tuple[Sequence[Head], Sequence[PastedRow]]:
    # What the columns hold, and the rows below the heads.
    at = find_heads(rows)
    if at is None and columns is None:
        report.refuse(f'no row says what the columns hold: say it, {HOW}')
    words = rows[at or 0].cells if columns is None else plain_names(columns).split(',')
    heads: Sequence[Head] = [head_of(word) for word in words]
    body = rows if at is None else rows[at + 1 :]
    if body and (known := with_unit_row(heads, body[0])):
        heads, body = known, body[1:]
    for word, head in zip(words, heads):
        if word.strip(' -') and not head.meaning:
            report.note(f'the column {word!r} is left out')
    meanings = [head.meaning for head in heads if head.meaning]
    for meaning in ('a', 'alpha', 'd', *meanings):
        if meanings.count(meaning) != 1:
            count = 'no column is' if meaning not in meanings else 'several columns are'
            report.refuse(f'{count} {meaning}: say what the columns hold, {HOW}')
    if not body:
        report.refuse('there are no rows below the heads')
    return heads, body


def _convention(
    heads: Sequence[Head], script: ToolboxLinks | None, given: str | None, report: TableReport
) -> str:
    before = any(head.before and head.meaning in ('a', 'alpha') for head in heads)
    said = script.convention if script else 'modified' if before else None
    if said and given and said != given:
        report.refuse(f'--convention {given}: the table itself is {said}')
    if not (said or given):
        report.note('the standard convention is assumed (--convention modified is that of Craig)')
    return said or given or 'standard'


def _numbered(
    heads: Sequence[Head], body: Sequence[PastedRow], report: TableReport
) -> list[NumberedRow]:
    rows = []
    pointed = any(re.search(r'\d\.\d', cell) for row in body for cell in row.cells)
    for number, (line, cells) in enumerate(body, 1):
        filled = [*cells]
        while len(filled) > len(heads) and not filled[-1]:
            filled.pop()
        if len(filled) != len(heads):
            message = f'{len(filled)} cells, and the heads are {len(heads)}'
            report.fault(message, line, f'row {number}')
            continue
        read = NumberedRow(line, number, {})
        for head, cell in zip(heads, filled):
            if head.meaning != 'limits' and '(' not in cell and DECIMAL_COMMA.search(cell):
                if pointed or IN_THOUSANDS.fullmatch(cell):
                    where = f'row {number}, column {head.meaning}'
                    report.fault(f'{cell!r}: write it with a point, or without', line, where)
                cell = DECIMAL_COMMA.sub('.', cell)
            read.cells[head.meaning] = cell.strip('-—') and cell
        rows.append(read)
    return rows


def _unit(
    kind: str,
    given: Collection[str],
    heads: Sequence[Head],
    rows: Sequence[NumberedRow],
    constants: Mapping[str, str],
    report: TableReport,
) -> str:
    meanings, accepted, most = KINDS[kind]
    said = {head.unit for head in heads if head.meaning in meanings or head.unit in accepted}
    said = (said | set(given).intersection(accepted)) - {''}
    if strange := sorted(said.difference(accepted)):
        report.refuse(f'{kind} in {strange[0]}: write them in {" or ".join(accepted)}')
    if len(said) > 1:
        report.refuse(f'{kind} in {" and in ".join(sorted(said))}: write them in one')
    if said:
        return said.pop()
    cells = [row.cells.get(meaning, '') for row in rows for meaning in meanings]
    cells += [constants.get(name, '') for cell in cells for name in names_in(cell)]
    # A part of a product, such as 26.45*0.0254, is not as long as the whole.
    plain = ' '.join(cell for cell in cells if not re.search('[*/]', cell))
    largest = max(map(float, NUMBER.findall(plain)), default=0.0)
    if accepted[1] == 'deg' and any(DEGREE in cell for cell in cells):
        unit, why = 'deg', ', as the degree signs say'
    elif any('pi' in names_in(cell) for cell in cells) or largest <= most:
        unit, why = accepted[0], ''
    else:
        unit, why = accepted[1], f': {largest:g} {accepted[0]} are not meant'
    report.note(f'{kind} are taken to be in {unit}{why} (--units says otherwise)')
    return unit


def _constants(constants: Mapping[str, str], arm: Sequence[MovingRow]) -> Iterator[str]:
    # Those that are used, by others too.
    cells = [item for row in arm for item in row.row.cells.items()]
    used = {name for key, text in cells if key != 'type' for name in names_in(text)}
    kept: list[str] = []
    for name, text in reversed(list(constants.items())):
        if name in used:
            used |= names_in(text)
            kept.insert(0, f'  {name}: {scalar(text)}')
    yield from ['constants:', *kept] if kept else ()


def _joint(moved: MovingRow, report: TableReport) -> str:
    row, label = moved.row, re.sub(r'\s+', '_', moved.row.cells.get('joint', ''))
    named = label and not label.isdecimal()
    entry = [f'name: {scalar(label) if named else moved.variable}']
    entry += [f'variable: {moved.variable}'] if named else []
    entry.append(f'type: {"revolute" if moved.place == "theta" else "prismatic"}')
    if ends := _limits(row.cells):
        if len(ends) != 2 or not all(ends):
            where = f'row {row.number}, column limits'
            report.fault('two numbers are expected, such as [-160, 160]', row.line, where)
        entry.append(f'limits: [{", ".join(map(scalar, ends))}]')
    return f'  - {{{", ".join(entry)}}}'


def _limits(cells: Mapping[str, str]) -> list[str]:
    text = cells.get('limits', '')
    if not text:
        ends = [cells.get('min', ''), cells.get('max', '')]
        return ends if any(ends) else []
    text = DECIMAL_COMMA.sub('.', text) if ';' in text else text
    scaled = SCALED.fullmatch(text)
    before, inside, after = scaled.groups('') if scaled else ('', text, '')
    return [f'{before}{end}{after}' for end in BETWEEN.split(inside.strip('()[] '))]


def _link(moved: MovingRow, angle: str) -> str:
    cells = moved.row.cells
    texts = {'a': cells['a'], 'alpha': cells['alpha'], 'd': moved.d, 'theta': moved.theta}
    if angle == 'deg':
        texts |= {name: texts[name].replace(DEGREE, '') for name in ('alpha', 'theta')}
    return f'  - {{{", ".join(f"{name}: {scalar(text)}" for name, text in texts.items())}}}'


def _in_the_table(fault: Fault, arm: Sequence[MovingRow]) -> Fault:
    # The same fault at its place in the table.
    found = PLACE.fullmatch(fault.where)
    if not found:
        return Fault(fault.file, 0, fault.where, fault.message)
    rows = arm if found[1] == 'links' else [row for row in arm if row.variable]
    row = rows[int(found[2])].row
    where = f'row {row.number}' + (f', column {found[3]}' if found[3] else '')
    return Fault(fault.file, row.line, where, fault.message)
