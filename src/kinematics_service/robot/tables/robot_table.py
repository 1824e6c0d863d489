# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Make a robot file from a pasted Denavit-Hartenberg table."""

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import PurePath

from ...errors import Fault, RobotFileError
from ...typography import DEGREE, plain_names
from ..file.parts.quantities import rounded_quarters
from ..file.reader import parse_robot
from ..file.text.expression_syntax import names_in
from ..file.translation import RobotText
from ..file.writing.writer import scalar
from .cells import PastedRow
from .heads import ANGLES, Head, find_heads, head_of, with_r, with_unit_row
from .moving_rows import ZERO, MovingRow, NumberedRow, bare, moving_rows
from .pasted import SEVERAL, plain_text, rows_of, without_comments
from .records import rows_of_records, rows_of_substitutions
from .report import TableReport
from .script import constants_of, end_lines, settings_of
from .toolbox import toolbox_links
from .units import LIMITS_TURNS, TERM, in_one_unit, in_unit, rounded

HOW = (
    'such as --columns a,alpha,d,theta (known are also offset, type, joint, limits, min, max; '
    '- for a column that is left out)'
)
MAX_CHARACTERS = 50_000  # ten times the length of a table for 128 joints
DECIMAL_COMMA = re.compile(r'(?<=\d),(?=\d)')
IN_THOUSANDS = re.compile(r'-?[1-9]\d{0,2},\d{3}')
BETWEEN = re.compile(r'\s*(?:,|;|\.\.\.?|…|\bto\b|~)\s*|\s+')
SCALED = re.compile(r'(?:(.*\*))?\s*(?:array\()?\[(.*)\]\)?\s*([*/].*)?')
# Keys of a robot file, and `pi`; these are not names of constants.
KEPT = {'base', 'tool', 'xyz', 'rpy', 'pi'}
PLACE = re.compile(r'(links|joints)\[(\d+)\](?:\.(\w+))?.*')
# Words in the pasted text that show the convention of the table.
TITLES = {
    'modified': re.compile(r'\b(?:modified|craig|mdh|proximal)\b', re.IGNORECASE),
    'standard': re.compile(r'\b(?:standard|classic|classical|distal|spong)\b', re.IGNORECASE),
}


def read_table(
    text: str,
    file: str,
    name: str,
    units: Collection[str] = (),
    convention: str | None = None,
    columns: str | None = None,
    round_angles: bool = False,
) -> RobotText:
    """
    Convert a pasted table to the text of a robot file, with notes about assumptions.

    Parameters
    ----------
    text
        Rows of a spreadsheet, of plain text, Markdown or LaTeX, a matrix, or calls of Corke's
        toolbox.
    file, name
        The name of the table's file in messages; the name of the robot.
    units
        'rad' or 'deg', and 'm' or 'mm'. A missing unit is derived from the heads and the numbers.
    convention
        'standard' or 'modified'. Default: the convention that the table shows, else standard.
    columns
        Heads, separated by commas, that replace the heads of the table; `-` leaves a column out.
        Units and subscripts i-1 in the heads of the table still apply.
    round_angles
        Whether a rounded number such as 1.5708 is replaced by the exact angle, here pi/2.

    Raises
    ------
    RobotFileError
        The table cannot be read. The message about a cell names its row and column.
    """
    report = TableReport(file)
    if len(text) > MAX_CHARACTERS:
        message = f'longer than {MAX_CHARACTERS} characters; leave only the table in it'
        report.refuse(message, 'too-large')
    plain = plain_text(text)
    script = None if columns else toolbox_links(plain, report)
    bare_text = without_comments(plain)
    constants = constants_of(bare_text, report)
    settings = script.settings if script else settings_of(bare_text, report)
    if not script and settings.get('offset', '').startswith('['):
        report.refuse('offset of the robot: write a column offset into the table', 'unsupported')
    rows = script.rows if script else _rows(plain, columns, report)
    heads, body = _headed(rows, columns, report)
    heads, khalil = with_r(heads, report)
    _refuse_unheaded(heads, body, report)
    stated = script.convention if script else khalil
    chosen = _convention(stated, heads, plain, convention, report)
    numbered = _numbered(heads, body, report)
    report.raise_faults()
    given = {*units, 'rad'} - {'deg'} if script and 'deg' not in units else set(units)
    angle, length = (
        in_one_unit(kind, given, heads, numbered, constants, plain, report)
        for kind in ('angles', 'lengths')
    )
    short: list[str] = []
    for row in numbered:
        cells = {name: row.cells[name] for name in ANGLES if row.cells.get(name)}
        if round_angles:
            row.cells.update({name: rounded(cell, angle) for name, cell in cells.items()})
        elif angle == 'rad':
            short += [digits for cell in cells.values() for digits, _ in rounded_quarters(cell)]
    if short:
        message = f'{min(short)} looks like a part of pi rounded (--round-angles reads it so)'
        report.note(message, 'rounded-pi')
    arm = moving_rows(numbered, constants, report)
    limits = [end for row in arm if row.place == 'theta' for end in _limits(row.row.cells)]
    in_degrees = angle == 'rad' and any(map(LIMITS_TURNS.fullmatch, limits))
    if in_degrees:
        message = 'limits are read in deg: in rad they would be many turns'
        report.note(message, 'assumed-unit')
    joints = [
        _joint(row, 'as deg' if in_degrees else angle, report) for row in arm if row.variable
    ]
    report.raise_faults()
    ends = '\n'.join(end_lines(plain, settings, report))
    if not script:
        _note_columns(heads, report)
    source = ''.join(c if c.isprintable() else '?' for c in PurePath(file).name)
    lines = [
        f'robot: {name}',
        f'source: {scalar(source)}',
        f'convention: {chosen}',
        f'units: {{angle: {angle}, length: {length}}}',
        *_constants(constants, arm, ends, report),
        'joints:',
        *joints,
        'links:',
        *(_link(row, angle) for row in arm),
        *([ends] if ends else []),
    ]
    written = '\n'.join([*lines, ''])
    try:
        parse_robot(written, file)
    except RobotFileError as error:
        raise RobotFileError([_in_the_table(fault, arm) for fault in error.faults]) from None
    return RobotText(written, tuple(report.notes))


def _rows(text: str, columns: str | None, report: TableReport) -> Sequence[PastedRow]:
    if records := rows_of_records(text, report):
        return records
    rows = rows_of(text, report)
    if find_heads(rows) is None and columns is None:
        return rows_of_substitutions(text, report) or rows
    return rows


def _headed(
    rows: Sequence[PastedRow], columns: str | None, report: TableReport
) -> tuple[Sequence[Head], Sequence[PastedRow]]:
    # Return the heads of the columns, and the table rows below the heads.
    at = find_heads(rows)
    if at is None and columns and rows and not re.search(r'\d', ''.join(rows[0].cells)):
        at = 0  # a first row without digits has names of columns; `columns` replaces them below
    if at is None and columns is None:
        report.refuse(f'no row has the names of the columns; give them, {HOW}', 'missing-heads')
    words: Sequence[str] = rows[at].cells if at is not None else ()
    heads: Sequence[Head] = [head_of(word) for word in words]
    body = rows if at is None else rows[at + 1 :]
    if len(heads) > 3 and all(len(row.cells) == len(heads) + 1 for row in body):
        # In a printed data frame, the first column has the names of the rows but no head.
        # Therefore insert a head for this column.
        heads, words = [Head('joint'), *heads], ['', *words]
    if any(find_heads([row]) is not None for row in body):
        report.refuse(SEVERAL, 'several-tables')
    if body and (known := with_unit_row(heads, body[0])):
        heads, body = known, body[1:]
    if columns is not None:
        words = plain_names(columns).split(',')
        given = [head_of(word) for word in words]
        # Take the quantities from `columns`. Keep the units and indices of the table's own heads,
        # unless `columns` gives others.
        padded = [*heads, *[Head('')] * len(given)]
        heads = [
            old._replace(meaning=new.meaning, unit=new.unit or old.unit) if not new.before else new
            for new, old in zip(given, padded)
        ]
    named = [k for k, head in enumerate(heads) if head.meaning == 'joint']
    heads = [Head('') if k in named[1:] else head for k, head in enumerate(heads)]
    ignored = [word for word, head in zip(words, heads) if word.strip(' -') and not head.meaning]
    for word in ignored:
        report.note(f'the column {word!r} is left out', 'left-out')
    if not body:
        report.refuse('no rows below the heads', 'empty')
    return heads, body


def _refuse_unheaded(
    heads: Sequence[Head], body: Sequence[PastedRow], report: TableReport
) -> None:
    meanings = [head.meaning for head in heads if head.meaning]
    for meaning in ('a', 'alpha', 'd', *meanings):
        if meanings.count(meaning) != 1:
            missing = meaning not in meanings
            count = 'no column is' if missing else 'several columns are'
            message = f'{count} {meaning}; give the names of the columns, {HOW}'
            report.refuse(message, 'missing-heads' if missing else 'ambiguous')
    # In tables of Khalil, the columns `before`, gamma and b can describe branches. Refuse a table
    # with branches.
    columns = list(zip(*(row.cells for row in body)))
    for head, cells in zip(heads, columns):
        counted = [str(k) for k in range(len(cells))]
        if head.meaning == 'before' and list(cells) != counted:
            message = (
                f'the links before are {", ".join(cells)}: the arm branches, which it must not'
            )
            report.refuse(message, 'branches')
        if head.meaning in ('gamma', 'b') and set(cells) - set(ZERO):
            message = f'{head.meaning} is not 0: the arm branches, which it must not'
            report.refuse(message, 'branches')


def _convention(
    stated: str, heads: Sequence[Head], text: str, given: str | None, report: TableReport
) -> str:
    before = (head.before and head.meaning in ('a', 'alpha') for head in heads)
    if any(before) or any(head.after and head.meaning in ('d', 'theta') for head in heads):
        stated = 'modified'
    named = [name for name, words in TITLES.items() if words.search(text)]
    stated = stated or (named[0] if len(named) == 1 else '')
    if stated and given and stated != given:
        report.refuse(f'--convention {given}: the table itself is {stated}', 'conflict')
    if not (stated or given):
        message = 'the standard convention is assumed (--convention modified is that of Craig)'
        report.note(message, 'assumed-convention')
    return stated or given or 'standard'


def _note_columns(heads: Sequence[Head], report: TableReport) -> None:
    words = (
        f'{head.meaning}{"(i-1)" if head.before else ""}{f" [{head.unit}]" if head.unit else ""}'
        for head in heads
    )
    report.note(f'the columns are read as {", ".join(word or "-" for word in words)}', 'columns')


def _numbered(
    heads: Sequence[Head], body: Sequence[PastedRow], report: TableReport
) -> list[NumberedRow]:
    rows = []
    pointed = any(re.search(r'\d\.\d', cell) for row in body for cell in row.cells)
    for number, (line, cells) in enumerate(body, 1):
        filled = cells[: len(heads)] if not any(cells[len(heads) :]) else cells
        if len(filled) == 1 and ' ' in filled[0]:
            report.note(f'left out: {filled[0]}', 'left-out')
            continue
        if len(filled) != len(heads):
            message = f'{len(filled)} cells for {len(heads)} heads'
            report.fault(message, 'wrong-length', line, f'row {number}')
            continue
        read = NumberedRow(line, number, {})
        for head, cell in zip(heads, filled):
            if head.meaning != 'limits' and '(' not in cell and DECIMAL_COMMA.search(cell):
                if pointed or IN_THOUSANDS.fullmatch(cell):
                    message = f'{cell!r} has a comma; write a point, or no sign'
                    read.fault(report, head.meaning, message, 'decimal-comma')
                cell = DECIMAL_COMMA.sub('.', cell)
            read.cells[head.meaning] = cell.strip('-—') and cell
        rows.append(read)
    return rows


def _constants(
    constants: Mapping[str, str], arm: Sequence[MovingRow], ends: str, report: TableReport
) -> Iterator[str]:
    # Yield the lines of the section `constants` of the robot file. The section has the constants
    # that expressions use, and the names to which the pasted text gives no value.
    texts = [ends, *chain.from_iterable(_texts(row) for row in arm)]
    used = [name for text in texts for name in sorted(names_in(text) - KEPT)]
    kept: list[str] = []
    for name, text in reversed(list(constants.items())):
        if name in used:
            used += names_in(text)
            kept.insert(0, f'  {name}: {scalar(text)}')
    known = {bare(name) for name in ('pi', *constants, *(row.variable for row in arm))}
    if letters := [name for name in dict.fromkeys(used) if bare(name) not in known]:
        names = ', '.join(letters)
        message = f'{names}: letters without a value; for numbers write it into constants'
        report.note(message, 'no-value')
    kept += [f'  {name}:' for name in letters]
    yield from ['constants:', *kept] if kept else ()


def _joint(moved: MovingRow, angle: str, report: TableReport) -> str:
    row, label = moved.row, re.sub(r'\s+', '_', moved.row.cells.get('joint', ''))
    # A label without letters, such as `0->1`, is not the name of a joint.
    named = re.search('[A-Za-z]', label)
    entry = [f'name: {scalar(label)}'] if named else [f'name: {moved.variable}']
    entry += [f'variable: {moved.variable}'] if named else []
    entry.append(f'type: {"revolute" if moved.place == "theta" else "prismatic"}')
    if ends := _limits(row.cells, angle if moved.place == 'theta' else ''):
        if len(ends) != 2 or not all(ends):
            message = 'expected two numbers, such as [-160, 160]'
            row.fault(report, 'limits', message, 'wrong-length')
        entry.append(f'limits: [{", ".join(map(scalar, ends))}]')
    return f'  - {{{", ".join(entry)}}}'


def _limits(cells: Mapping[str, str], angle: str = '') -> list[str]:
    ends = [cells.get('min', ''), cells.get('max', '')]
    if text := cells.get('limits', ''):
        text = DECIMAL_COMMA.sub('.', text) if ';' in text else text
        scaled = SCALED.fullmatch(text)
        before, inside, after = scaled.groups('') if scaled else ('', text, '')
        ends = [f'{before}{end}{after}' for end in BETWEEN.split(inside.strip('()[] '))]
    if not any(ends):
        return []
    if angle == 'as deg':
        return [TERM.sub(rf'\g<0>{DEGREE}', end) for end in ends]
    return [in_unit(end, angle) for end in ends]


def _texts(moved: MovingRow) -> list[str]:
    cells = moved.row.cells
    return [cells['a'], cells['alpha'], moved.d, moved.theta, *_limits(cells)]


def _link(moved: MovingRow, angle: str) -> str:
    texts = dict(zip(('a', 'alpha', 'd', 'theta'), _texts(moved)))
    if angle == 'deg':
        texts |= {name: texts[name].replace(DEGREE, '') for name in ('alpha', 'theta')}
    return f'  - {{{", ".join(f"{name}: {scalar(text)}" for name, text in texts.items())}}}'


def _in_the_table(fault: Fault, arm: Sequence[MovingRow]) -> Fault:
    # A fault is at a place of the generated robot file. Return this fault with the row and column
    # of the pasted table.
    where, line = fault.where, 0
    if match := PLACE.fullmatch(where):
        rows = arm if match[1] == 'links' else [row for row in arm if row.variable]
        line, number, _ = rows[int(match[2])].row
        where = f'row {number}' + (f', column {match[3]}' if match[3] else '')
    return Fault(fault.file, line, where, fault.message, fault.code)
