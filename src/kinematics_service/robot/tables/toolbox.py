# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read table rows that are calls such as `Link(...)` of Corke's Robotics Toolbox."""

import re
from collections.abc import Mapping
from typing import NamedTuple

from .cells import PastedRow, plain_cell
from .pasted import blocks_of, cells_of, without_comments
from .report import TableReport
from .script import settings_of

# Matches the beginning of a call that constructs a link. The text `Link(i)` is not matched,
# because it is a column head of a table.
LINKS = r'\b(DHLink|Link|(?:Revolute|Prismatic)(?:M?DH)?)\s*\((?!\s*[ijkn]\b)'
CALL = re.compile(LINKS)
LINK = re.compile(
    rf'(?:(\w+(?:[\[(]\w+[\])])?)\s*=\s*)?{LINKS}'
    r'((?:[^()]|\((?:[^()]|\([^()]*\))*\))*)\)'
)
ROBOT = re.compile(r'\b(?:SerialLink|DHRobot)\s*\(\s*(?:\[([^\]]*)\])?')
NAME = re.compile(r'\w+(?:[\[(]\w+[\])])?')
REPEATED = re.compile(r'\)\s*for\b|[\[(][A-Za-z]\w*[\])]\s*=\s*\w*Link\(|append\(')
OPTION = re.compile(r"'(modified|standard|revolute|prismatic|[rp])'\s*,?")
VALUE = re.compile(r"(?:'(\w+)'\s*,|(\w+)\s*=)\s*((?:[^,\[(]|\[[^\]]*\]|\([^()]*\))+)")
# Elements of the vector in a call Link([...]) of MATLAB, in their order.
VECTOR = ('theta', 'd', 'a', 'alpha', 'sigma', 'offset')
LATER = re.compile(
    r'(\w+(?:[\[(]\w+[\])])?)\.(theta|d|a|alpha|offset|sigma|mdh|flip|qlim)\s*=\s*([^;\n]+)'
)
# Matches the name of the DH matrix in a call such as `SerialLink(dh)`.
OF_MATRIX = re.compile(r'\bSerialLink\s*\(\s*(\w+|(?=\[))\s*[,)\[]')
LATER_OF_LINKS = re.compile(r'\w+[\[(]\w+[\])]\.\w+\s*=\s*[^;\n]+')
# Known arguments of a link. The reader ignores the arguments for dynamics and drawing.
KNOWN = {*VECTOR, 'mdh', 'flip', 'qlim', 'name', 'mesh', 'm', 'r', 'I', 'Jm', 'G', 'B', 'Tc'}
# Matches the arguments of a call Link(...) that does not match the pattern LINK.
UNREAD = re.compile(r"\([^()]*\balpha\b'?\s*[=,]")
HEADS = ('a', 'alpha', 'd', 'theta', 'offset', 'type', 'limits')
FALSE = (None, '', '0', '0.0', 'False', 'false')


class ToolboxLinks(NamedTuple):
    """
    The links of a robot in a script, as rows of cells. The first row has the names of the columns.

    `convention` is the convention of the links, and `settings` has the robot's base, tool and
    joint offsets as text.
    """

    rows: list[PastedRow]
    convention: str
    settings: Mapping[str, str]


class _LinkCall(NamedTuple):
    line: int
    target: str  # name of the variable to which the script assigns the link, or ''
    function: str
    values: dict[str, str]

    def has(self, *keys: str) -> bool:
        return any(self.values.get(key) not in FALSE for key in keys)


def toolbox_links(text: str, report: TableReport) -> ToolboxLinks | None:
    """
    Return the links of a script, or None if it has no links.

    Raises
    ------
    RobotFileError
        The script has several robots, or its links are not written one after another.
    """
    text = without_comments(text).replace('"', "'")
    links = [_call(text, match, report) for match in LINK.finditer(text)] or _matrix_links(text)
    if not links:
        return None
    _refuse_other_orders(text, [link.target for link in links if link.target], report)
    named = {link.target: link.values for link in links}
    robot = set(re.findall(r'(\w+)\s*=\s*(?:SerialLink|DHRobot)', text))
    for target, key, value in LATER.findall(text):
        if target not in {*named, *robot}:
            message = f'{target}.{key} is set, and the text has no link {target}'
            report.refuse(message, 'unknown-name')
        named.setdefault(target, {})[key] = value
    settings = settings_of(LATER_OF_LINKS.sub('', LINK.sub('', text)), report)
    if offset := settings.get('offset'):
        cells = cells_of(re.sub(r'.*?\[|\].*', '', offset))
        if len(cells) != len(links):
            report.refuse(f'offset: {len(cells)} values for {len(links)} links', 'wrong-length')
        for link, cell in zip(links, cells):
            link.values['offset'] = cell
    always = re.search(r"SerialLink\([^;\n]*'modified'", text) is not None
    modified = {always or 'MDH' in link.function or link.has('mdh', 'modified') for link in links}
    if len(modified) > 1:
        message = 'some links are standard and some modified; write all in one way'
        report.refuse(message, 'conflict')
    rows = [PastedRow(links[0].line, HEADS), *(_row(link, report) for link in links)]
    return ToolboxLinks(rows, 'modified' if modified.pop() else 'standard', settings)


def _matrix_links(text: str) -> list[_LinkCall]:
    # Return one link for each row of the matrix `dh` in SerialLink(dh). A row has theta, d, a,
    # alpha, sigma, offset.
    match = OF_MATRIX.search(text)
    blocks = blocks_of(text) if match else []
    named = [block for block in blocks if match and block.name == match[1]]
    named = named or [block for block in blocks if len(block.rows) > 1]
    if len(named) != 1:
        return []
    return [_LinkCall(row.line, '', 'Link', dict(zip(VECTOR, row.cells))) for row in named[0].rows]


def _refuse_other_orders(text: str, targets: list[str], report: TableReport) -> None:
    robots = ROBOT.findall(text)
    if len(robots) > 1 or len(set(targets)) < len(targets):
        message = 'the text has several robots; leave the links of one in it'
        report.refuse(message, 'several-tables')
    listed = [word for word in NAME.findall(robots[0]) if word in targets] if robots else []
    places = [int(match[1]) for target in targets if (match := re.search(r'(\d+)\W?$', target))]
    apart = any(b - a != 1 for a, b in zip(places, places[1:]))
    if (listed or targets) != targets or apart:
        message = 'the links of the robot are others, or in another order; write only those'
        report.refuse(message, 'wrong-order')
    if len(CALL.findall(text)) != len(LINK.findall(text)) or UNREAD.search(LINK.sub('', text)):
        message = 'a link is not understood; close its brackets, and write its arguments by name'
        report.refuse(message, 'syntax')
    if REPEATED.search(text):
        message = 'links are made in a loop, which is not run; write each link'
        report.refuse(message, 'unsupported')


def _call(text: str, match: re.Match[str], report: TableReport) -> _LinkCall:
    line = text.count('\n', 0, match.start(2)) + 1
    values, arguments = dict.fromkeys(OPTION.findall(match[3]), '1'), OPTION.sub('', match[3])
    if vector := re.match(r'\s*\[([^\]]*)\]', arguments):
        elements = cells_of(vector[1].replace(',', ' '))
        if not 4 <= len(elements) <= len(VECTOR):
            message = f'{len(elements)} numbers; write theta d a alpha, then sigma and offset'
            report.fault(message, 'wrong-length', line)
        values |= zip(VECTOR, elements)
        arguments = arguments[vector.end() :]
    given = {matlab or python: value for matlab, python, value in VALUE.findall(arguments)}
    strange = ', '.join(given.keys() - KNOWN) or VALUE.sub('', arguments).strip(' ,.\t\n')
    if strange:
        report.fault(f'{strange!r} is not understood; write a=..., alpha=...', 'syntax', line)
    values |= {key: value.strip() for key, value in given.items()}
    return _LinkCall(line, match[1] or '', match[2], values)


def _row(link: _LinkCall, report: TableReport) -> PastedRow:
    values = link.values
    # In MATLAB, a call Link(...) gives either theta or d, the one that is constant. The other one
    # moves.
    names_theta = link.function == 'Link' and 'theta' in values and 'd' not in values
    slides = link.has('sigma', 'prismatic', 'p') or link.function.startswith('Prismatic')
    moving = 'd' if slides or names_theta else 'theta'
    if not re.fullmatch(r'0?|[A-Za-z]\w*(?:\(\d+\))?', values.get(moving, '')):
        message = f'line {link.line}: {moving} moves, so its number is not read'
        report.note(message, 'left-out')
    cells = dict.fromkeys(HEADS, '0') | values | {'limits': values.get('qlim', '')}
    cells |= {moving: '-variable' if link.has('flip') else '', 'type': 'RP'[moving == 'd']}
    return PastedRow(link.line, tuple(plain_cell(cells[head]) for head in HEADS))
