# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read a script that defines a robot: constants, base pose, tool pose, and joint offsets."""

import re
from collections.abc import Iterator, Mapping

from ...typography import DEGREE
from ..file.writing.writer import scalar
from .cells import plain_cell
from .moving_rows import ANGLE, ZERO
from .pasted import cells_of
from .report import TableReport

CONSTANT = re.compile(
    r"(?:^|;)[ \t]*([A-Za-z]\w*(?:\s*,\s*[A-Za-z]\w*)*)[ \t]*=\s*([^=;\n\[\]{}']+?)\s*(?=;|$)",
    re.M,
)
VECTOR = re.compile(r'(?:^|;)[ \t]*([A-Za-z]\w*)[ \t]*=\s*\[([^\[\];\n]*)\]', re.M)
# Matches text that sets the base, tool, offset or limits of a robot: `R.base = ...`, `'offset',
# ...` or `tool=...`.
SETTING = re.compile(
    r"(?:[.'(]|,\s*)(base|tool|offset|qlim)'?\s*(?:=|,)\s*"
    r'((?:[^,;\n()\[\]]|\((?:[^()]|\([^()]*\))*\)|\[[^\]]*\])+)'
)
BOXED = re.compile(r'(?m)^\W*(base|tool)\W+t\s*=\s*([^;|]*);\s*rpy/(\w+)\s*=\s*([^|\n]*)')
SHIFT = re.compile(r'(?:transl|(?:\w+\.)?SE3(?:\.Trans)?)\s*\(\s*\[?([^\[\]]*?)\]?\s*\)')
ALONG = re.compile(r'(?:\w+\.)?SE3\.T([xyz])\s*\((.*)\)')
TURN = re.compile(
    r"(?:trot|(?:\w+\.)?SE3\.R)([xyz])\s*\(([^,]*?)(?:,\s*(?:unit\s*=\s*)?('deg'))?\s*\)"
)


def constants_of(text: str, report: TableReport) -> dict[str, str]:
    """
    Return the constants of a script: a dictionary from names, except names of joints, to the
    assigned expressions.
    """
    constants: dict[str, str] = {}
    for names, value in CONSTANT.findall(text):
        values = cells_of(value) if ',' in names else [value]
        constants |= zip(re.split(r'\s*,\s*', names), map(plain_cell, values))
    for name, value in VECTOR.findall(text):
        first = 1 if re.search(rf'\b{name}\(\d', text) else 0
        constants |= {f'{name}{k}': plain_cell(v) for k, v in enumerate(cells_of(value), first)}
    if joints := sorted(filter(ANGLE.fullmatch, constants)):
        report.note(f'the values of {", ".join(joints)} are left out: joints move', 'left-out')
    return {name: value for name, value in constants.items() if name not in joints}


def settings_of(text: str, report: TableReport) -> dict[str, str]:
    """
    Return a dictionary from `offset`, `base` and `tool` to the expressions that a script gives for
    them.
    """
    settings = {key: value.strip() for key, value in SETTING.findall(text)}
    if settings.pop('qlim', ''):
        message = 'qlim of the robot is not read; write limits into the robot file'
        report.note(message, 'left-out')
    return settings


def end_lines(text: str, settings: Mapping[str, str], report: TableReport) -> Iterator[str]:
    """
    Yield the lines `base` and `tool` of a robot file. The poses of base and tool are read from a
    script, or from the text that Corke's toolbox prints for a robot.
    """
    for end in ('base', 'tool'):
        if end in settings:
            placement = _placement(settings[end])
            if placement is None:
                fault = (
                    f'{end}: {settings[end]!r} is not understood; write transl(x, y, z)*trotx(a)'
                )
                report.refuse(f'{fault}, or write {end} into the robot file', 'syntax')
            yield _line(end, *placement)
    for end, xyz, order, angles in BOXED.findall(text):
        # In Corke's toolbox, the order xyz means R = Rx(yaw) Ry(pitch) Rz(roll). The text lists
        # roll first, which is the angle about z. A robot file lists the angle about x first. So
        # reverse the order of the angles.
        rpy = angles.replace(' ', '').split(',')[:: -1 if order == 'xyz' else 1]
        if order == 'xyz' and sum(re.search('[1-9a-z]', angle) is not None for angle in rpy) > 1:
            message = f'{end}: rpy/xyz has several angles; write {end} into the robot file'
            report.refuse(message, 'unsupported')
        report.note(f'{end} has the digits that are printed', 'printed-digits')
        yield _line(end, xyz.split(','), rpy)


def _placement(text: str) -> tuple[list[str], list[str]] | None:
    # Return xyz and rpy of an expression that multiplies translations and at most one rotation at
    # the end. Return None for another expression.
    xyz, rpy = ['0'] * 3, ['0'] * 3
    for factor in re.split(r'\s*[*@]\s*(?=[A-Za-z])', text.strip()):
        shift, along, turn = (form.fullmatch(factor) for form in (SHIFT, ALONG, TURN))
        cells = list(map(plain_cell, cells_of(shift[1]))) if shift else []
        if rpy != ['0'] * 3:
            return None
        if len(cells) == 3 and xyz == ['0'] * 3:
            xyz = cells
        elif along and xyz['xyz'.index(along[1])] == '0':
            xyz['xyz'.index(along[1])] = plain_cell(along[2])
        elif turn:
            rpy['xyz'.index(turn[1])] = plain_cell(turn[2]) + (DEGREE if turn[3] else '')
        elif not re.fullmatch(r'eye\(4\)|(?:\w+\.)?SE3\(\)', factor):
            return None
    return xyz, rpy


def _line(end: str, *placed: list[str]) -> str:
    cells = [[cell.strip() for cell in part] for part in placed]
    plain = [
        ['0' if cell.strip(DEGREE) in ZERO else scalar(cell) for cell in part] for part in cells
    ]
    xyz, rpy = map(', '.join, plain)
    return f'{end}: {{xyz: [{xyz}], rpy: [{rpy}]}}'
