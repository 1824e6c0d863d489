# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Find the joint that moves each row of a table, and whether it turns or slides."""

import re
from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple

from ..file.text.expression_syntax import names_in
from .cells import is_quarter
from .report import TableReport

ORDER = 'is the order of the heads another one? (--columns)'
MARK = '@'  # stands for the row's own variable in a cell, until the variable has a name
# Match names without a number, such as `theta` or `q_i`. In a row, such a name means the joint
# variable of this row.
OWN = {
    'theta': re.compile(r'\b(?:theta|th|q|var|variable)(?:_?[ijn])?\b'),
    'd': re.compile(r'\b(?:d|q|s|var|variable)(?:_?[ijn])?\b'),
}
ANGLE = re.compile(r'(?:theta|th|t|phi|psi|q|joint|j)_?\d+', re.IGNORECASE)
# Matches the names in column d that are joint variables. Other names in this column are constant
# lengths.
SLIDING = re.compile(r'[dqs]\w*', re.IGNORECASE)
# Matches an angle such as pi/2 or 1.5708, but not 1.57. An angle in column a or d is a mistake.
AN_ANGLE = re.compile(r'(?:\d+\*)?pi(?:/\d+)?|\d\.\d{4,}')
# Matches numbers in column theta that are probably lengths in m, not angles.
IN_METRES = re.compile(r'-?[01]?\.\d{1,2}')
LENGTH = re.compile(r'[adlhb]_?\d+', re.IGNORECASE)
# Matches a name with a star, which marks a joint variable: `theta3* - 90` means theta3 - 90.
STARRED = re.compile(r'\b(?!pi\b)([A-Za-z]\w*)\s*\*+\s*(?=(?P<sign>-)|[+]|$)')
TYPES = {
    **dict.fromkeys(('r', 'rot', 'rotary', 'revolute', 'rotational', '0'), 'theta'),
    **dict.fromkeys(('p', 'prismatic', 'linear', 'sliding', 'translational', '1'), 'd'),
    **dict.fromkeys(('f', 'fixed', '2'), ''),
}
NOT_A_JOINT = re.compile(
    r'(?:\w+\s*(?:->|-|to)\s*)?(?:tool|tcp|ee|g|end[-_ ]?effector|flange|hand|gripper)',
    re.IGNORECASE,
)
ZERO = ('', '0', '0.', '0.0', '0.00', '0.000', '0.0000', '0.000000', '-0.0')


class NumberedRow(NamedTuple):
    """A table row: its line in the text, its number from 1 on, and its cells by quantity."""

    line: int
    number: int
    cells: dict[str, str]

    def fault(self, report: TableReport, column: str, message: str, code: str) -> None:
        """Report a fault of the cell in a column of this row."""
        report.fault(message, code, self.line, f'row {self.number}, column {column}')


class MovingRow(NamedTuple):
    """
    A table row: its expressions d and theta, its joint variable, and the quantity that moves.

    `variable` is the joint variable of the row. It is empty if the row has no joint variable, or
    if an earlier row has the same variable.
    `place` is the quantity that moves, 'd' or 'theta', or '' for a fixed row.
    """

    row: NumberedRow
    d: str
    theta: str
    variable: str
    place: str


def without_stars(
    rows: Sequence[NumberedRow], constants: Collection[str], report: TableReport
) -> set[str]:
    """
    In some tables a star marks the joint variables, such as `theta1*`. Remove the stars in the
    cells d and theta; return the names that had a star.
    """
    stars = [
        (row, place, star)
        for row in rows
        for place in OWN
        for star in STARRED.finditer(row.cells.setdefault(place, ''))
        if star[1] not in constants
    ]
    # A star may mark a joint variable or mean a product: `q2*-1` is q2 - 1 or q2 times -1. If
    # every star is before a minus sign, the meaning is unknown, so report a fault.
    if stars and all(star[0].endswith('*') and star['sign'] for _, _, star in stars):
        row, place, _ = stars[0]
        message = f'{row.cells[place]}: a product, or a variable with its star? Write it without *'
        row.fault(report, place, message, 'ambiguous')
    for row, place, star in stars:
        row.cells[place] = row.cells[place].replace(star[0], f'{star[1]} ').strip()
    if stars:
        report.note('a star marks the variable of a joint', 'star')
    return {star[1] for _, _, star in stars}


def moving_rows(
    rows: Sequence[NumberedRow], constants: Collection[str], report: TableReport
) -> list[MovingRow]:
    """
    Return each table row with the joint variable that moves the row. Report faults and
    assumptions.
    """
    starred = without_stars(rows, constants, report)
    constants = {*constants, *_lengths(rows, constants, starred, report)}
    joints = [row for row in rows if not NOT_A_JOINT.fullmatch(row.cells.get('joint', ''))]
    taken = {name for row in rows for place in OWN for name in _moving(row, place, constants)}
    filled = all(row.cells['theta'] and row.cells['d'] for row in joints)
    alone, named = filled and not taken and 'type' not in rows[0].cells, bool(taken - {MARK})
    if alone:
        message = 'theta has only numbers: each joint turns, and they are its offsets'
        report.note(message, 'offsets')
    arm: list[MovingRow] = []
    for row in rows:
        usual = '' if row not in joints else 'theta' if alone else None
        place = _place(row, constants, usual, named)
        if place is None:
            message = f'unknown type {row.cells["type"]!r} (accepted: R, P, fixed)'
            row.fault(report, 'type', message, 'unknown-name')
            continue
        known = [before.variable for before in arm if before.variable]
        free = f'q{len(known) + 1}'
        names = _moving(row, place, constants) if place else frozenset()
        new = sorted(name for name in names - {MARK} if bare(name) not in map(bare, known))
        if len(new) > 1 and len(angles := list(filter(ANGLE.fullmatch, new))) == 1:
            # Only one name in the cell looks like an angle. The other names are constants without
            # a value.
            new = angles
        free = f'joint_{free}' if free in taken else free
        variable = free if place and (MARK in names or not names) else new[0] if new else ''
        moved = _moved(row, place, variable, constants)
        arm.append(moved)
        for column, message, code in _faults(moved, new, MARK in names, named):
            row.fault(report, column, message, code)
    _judge_fixed(arm, joints, report)
    return arm


def sum_of(variable: str, constant: str) -> str:
    """Return the sum of a variable and a constant expression as text, such as `q1 - pi/2`."""
    term = constant.removeprefix('-')
    if constant in ZERO:
        return variable
    if re.search('[-+]', re.sub(r'\([^()]*\)', '', term)):
        return f'{variable} + ({constant})'
    return f'{variable} {"-" if constant.startswith("-") else "+"} {term}'


def _lengths(
    rows: Sequence[NumberedRow], known: Collection[str], starred: set[str], report: TableReport
) -> set[str]:
    # Return the names in column d that are constant lengths, not variables. The name d2 is a
    # length if the joint in the row of d2 turns, or if a joint of the table has the variable
    # theta2. If the table marks variables by stars, a name without a star is a length.
    turning = {name for row in rows for name in _moving(row, 'theta', known)}
    numbers = {_number(name) for name in turning}
    lengths = set[str]()
    for row in rows:
        names = _moving(row, 'd', known) - {MARK} - turning
        turns = _moving(row, 'theta', known) or (starred and not names & starred)
        slides = not turns and not NOT_A_JOINT.fullmatch(row.cells.get('joint', ''))
        if 'type' in row.cells:
            slides = TYPES.get(row.cells['type'].lower()) == 'd'
        lengths |= {name for name in names if not slides or (_number(name) or '-') in numbers}
        if slides and names - lengths and row is rows[-1] and lengths and not starred:
            hint = f'{min(names)} may slide, or be the length of a tool: write {min(names)}* if it'
            message = f'{hint} slides; if not, tool into the column joint'
            row.fault(report, 'd', message, 'ambiguous')
    return lengths


def _number(name: str) -> str:
    return re.sub(r'.*?(\d*)$', r'\1', name)


def _marked(row: NumberedRow, place: str, constants: Collection[str]) -> str:
    cell = row.cells.get(place, '')
    return OWN[place].sub(lambda match: match[0] if match[0] in constants else MARK, cell)


def _moving(row: NumberedRow, place: str, constants: Collection[str]) -> frozenset[str]:
    # Return the names of joint variables in a cell; MARK stands for the variable of the row
    # itself.
    text = _marked(row, place, constants)
    names = names_in(text).difference(constants, ('pi',))
    slides = TYPES.get(row.cells.get('type', '').lower()) == 'd'
    moving = {name for name in names if place == 'theta' or slides or SLIDING.fullmatch(name)}
    return frozenset(moving | {MARK} if MARK in text else moving)


def bare(name: str) -> str:
    """Return a name without underscores, so that `theta_1` and `theta1` compare equal."""
    return name.replace('_', '')


def _place(row: NumberedRow, known: Collection[str], usual: str | None, named: bool) -> str | None:
    # Return the quantity in which the row's variable is: 'd', 'theta', or '' for a fixed row.
    # Return None if the row's cell in the column `type` has an unknown word.
    if 'type' in row.cells:
        return TYPES.get(row.cells['type'].lower())
    if usual is not None:
        return usual
    if _moving(row, 'theta', known):
        return 'theta'
    # An empty cell in column d means that the joint slides. But if the table names its variables,
    # an empty cell is a missing number.
    if _moving(row, 'd', known) or not (row.cells['d'] or named):
        return 'd'
    return '' if row.cells['theta'] else 'theta'


def _moved(row: NumberedRow, place: str, variable: str, constants: Collection[str]) -> MovingRow:
    texts = {'d': row.cells['d'], 'theta': row.cells['theta']}
    if place:
        text = _marked(row, place, constants).replace(MARK, variable)
        if not _moving(row, place, constants):
            text = sum_of(variable, text)
        texts[place] = sum_of(text, row.cells.get('offset', ''))
        if place == 'd':
            texts['theta'] = texts['theta'] or '0'
    return MovingRow(row, texts['d'], texts['theta'], variable, place)


def _faults(
    moved: MovingRow, new: Sequence[str], marked: bool, named: bool
) -> Iterator[tuple[str, str, str]]:
    cells = moved.row.cells
    unnamed = named and moved.place == 'theta' and not cells['theta'] and 'type' not in cells
    texts = {**cells, 'd': moved.d, 'theta': '' if unnamed else moved.theta}
    for column in ('a', 'alpha', 'd', 'theta'):
        if not texts[column]:
            yield column, 'the cell is empty; write 0, or the number of merged cells', 'empty'
    if len(new) + marked > 1:
        message = f'{" and ".join(new)}: which moves this row? Write numbers for the others'
        yield moved.place, message, 'ambiguous'
    elif moved.place == 'theta' and new and LENGTH.fullmatch(new[0]):
        yield 'theta', f'{new[0]} is the name of a length; {ORDER}', 'wrong-column'
    for column in ('a', 'alpha'):
        if wrong := next(filter(ANGLE.fullmatch, names_in(cells[column])), None):
            yield column, f'{wrong} is the name of a joint; {ORDER}', 'wrong-column'
    for column in ('a', 'd'):
        text = cells[column].strip('-')
        if AN_ANGLE.fullmatch(text) and ('pi' in text or is_quarter(text)):
            yield column, f'{text} is an angle; {ORDER}', 'wrong-column'
    if cells.get('offset', '') not in ZERO:
        if not moved.place:
            yield 'offset', 'no joint moves this row; write 0', 'no-effect'
        elif cells[moved.place] not in (*ZERO, moved.variable) and not marked:
            yield 'offset', f'{moved.place} has a number as well; write one of the two', 'conflict'


def _judge_fixed(
    arm: Sequence[MovingRow], joints: Sequence[NumberedRow], report: TableReport
) -> None:
    # A row without a joint variable of its own is one of three cases. The row is fixed, or the
    # joint of an earlier row also moves this row, or the table's author forgot the variable. In
    # the first two cases add a note to the report, in the third case a fault.
    rows = [moved.row for moved in arm if not moved.place and 'type' not in moved.row.cells]
    fixed = [row for row in rows if row in joints]
    moving = [moved.variable for moved in arm if moved.variable]
    numbers = [int(number) for number in map(_number, moving) if number]
    skipped = any(b - a != 1 for a, b in zip(numbers, numbers[1:]))
    for row, *_, variable, place in arm:
        if place and not variable and (shared := row.cells[place]) in moving:
            if skipped:
                message = f'{shared} again, and a number is left out: which is it?'
                row.fault(report, place, message, 'duplicate-name')
            report.note(f'row {row.number} is moved by {shared}, as a row above is', 'coupled-row')
    for row, *_ in arm if all(place == 'd' for *_, place in arm) else ():
        turn = row.cells['theta']
        if IN_METRES.fullmatch(turn) and not is_quarter(turn.strip('-')):
            row.fault(report, 'theta', f'{turn} is a length; {ORDER}', 'wrong-column')
    for row in fixed:
        if row is arm[-1].row or not skipped and len(fixed) < len(moving):
            report.note(f'row {row.number} is fixed: it has no variable', 'fixed-row')
        else:
            name, cell = f'q{row.number}', row.cells['theta']
            hint = f'{cell} without a variable; write {sum_of(name, cell)} if a joint turns there'
            message = f'{hint}, or a column type with R, P and fixed'
            row.fault(report, 'theta', message, 'missing-variable')
