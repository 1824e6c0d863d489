"""What a script or a printed robot says besides its table: constants, base, tool, offsets."""

import re
from collections.abc import Iterator, Mapping

import numpy as np

from ...errors import ExpressionError
from ...kernel import Floats
from ...rigid_motion import exact_rpy, screw
from ...robot.file.text.expressions import Scope, parse_affine
from ...robot.file.text.plain_expression import plain_expression
from ...typography import DEGREE, number_text
from .cells import plain_cell
from .moving_rows import ANGLE
from .pasted import cells_of, closing
from .report import TableReport

CONSTANT = re.compile(
    r"(?:^|;)[ \t]*([A-Za-z]\w*(?:\s*,\s*[A-Za-z]\w*)*)[ \t]*=\s*([^=;\n\[\]{}']+?)\s*(?=;|$)",
    re.M,
)
VECTOR = re.compile(r'(?:^|;)[ \t]*([A-Za-z]\w*)[ \t]*=\s*\[([^\[\];\n]*)\]', re.M)
ROBOT = re.compile(r'\b(?:SerialLink|DHRobot|super\(\)\.__init__)\s*\(')
SETTING = re.compile(r'\b\w+\.(?!mdh|flip)([a-z]\w*)[ \t]*=(?!=)[ \t]*([^;\n]+)')
OPTION = re.compile(r"'(\w+)'|(\w+)\s*=\s*(.+)", re.DOTALL)
BOXED = re.compile(r'(?m)^\W*(base|tool)\W+t\s*=\s*([^;|]*);\s*rpy/(\w+)\s*=\s*([^|\n]*)')
FACTOR = re.compile(r'(?:\w+\.)?(\w+)\s*\((.*)\)\s*', re.DOTALL)
IDENTITY = ('eye', 'SE3')
SHIFTS = ('transl', 'SE3', 'Trans', 'trans')
# What an arm of the toolbox has besides, of its looks and dynamics.
UNUSED = {
    *('name', 'comment', 'manufacturer', 'manuf', 'gravity', 'keywords', 'symbolic', 'plotopt'),
    *('modified', 'standard', 'meshdir', 'model3d', 'fast', 'ikineType', 'configs', 'ikine', 'n'),
}


def constants_of(text: str, report: TableReport) -> dict[str, str]:
    """Return the expressions that are given to names; those of joints are left out."""
    found: dict[str, str] = {}
    for names, value in CONSTANT.findall(text):
        parts = [name.strip() for name in names.split(',')]
        values = cells_of(value) if len(parts) > 1 else [value]
        if len(values) == len(parts):
            found |= zip(parts, map(plain_cell, values))
    for name, value in VECTOR.findall(text):
        first = 1 if re.search(rf'\b{name}\(\d', text) else 0
        found |= {f'{name}{k}': plain_cell(v) for k, v in enumerate(cells_of(value), first)}
    if joints := sorted(filter(ANGLE.fullmatch, found)):
        report.note(f'the values of {", ".join(joints)} are left out: joints move')
    return {name: value for name, value in found.items() if name not in joints}


def settings_of(text: str, links: Mapping[str, object], report: TableReport) -> dict[str, str]:
    """Return what a script says of its robot: `offset`, `base`, `tool`, as they are written."""
    found = dict[str, str]()
    for match in SETTING.finditer(text):
        if match[0].partition('.')[0] not in links:
            found[match[1]] = match[2]
    for match in ROBOT.finditer(text):
        found |= _options(cells_of(text[match.end() : closing(text, match.end() - 1)]))
    for key in sorted(found.keys() - UNUSED - {'offset', 'base', 'tool'}):
        report.note(f'{key} of the robot is not read: write it into the robot file')
    return {key: found[key].strip() for key in ('offset', 'base', 'tool') if key in found}


def _options(arguments: list[str]) -> dict[str, str]:
    found, key = dict[str, str](), ''
    for argument in arguments:
        option = OPTION.fullmatch(argument.strip())
        if key and key not in ('modified', 'standard'):
            found[key], key = argument, ''
        elif option and option[1]:
            key = option[1]
        elif option:
            found[option[2]] = option[3]
    return found


def end_lines(
    text: str, settings: Mapping[str, str], constants: Mapping[str, str], report: TableReport
) -> Iterator[str]:
    """Yield base and tool as lines of a robot file: those of a script, or of a printed robot."""
    values = {}
    for name, value in constants.items():
        try:
            values[name] = _value(value, values)
        except ExpressionError:
            continue
    for end in ('base', 'tool'):
        if end in settings:
            try:
                yield _line(end, _product(settings[end], values))
            except (ExpressionError, ValueError):
                report.refuse(
                    f'{end}: {settings[end]!r} is not understood: write transl(x, y, z), trotx(), '
                    'SE3.Rx(), or take it out of the text'
                )
    for end, xyz, order, angles in BOXED.findall(text):
        T = np.eye(4)
        T[:3, 3] = [float(number) for number in xyz.split(',')]
        roll, pitch, yaw = (float(word.strip(f' {DEGREE}')) for word in angles.split(','))
        turns = (('x', yaw), ('y', pitch), ('z', roll))  # xyz of the toolbox
        if order == 'zyx':
            turns = (('z', yaw), ('y', pitch), ('x', roll))
        for axis, angle in turns:
            T = T @ screw(axis, np.radians(angle), 0.0)
        report.note(f'{end} has the digits that are printed')
        yield _line(end, T)


def _value(text: str, values: Mapping[str, float]) -> float:
    plain = plain_expression(plain_cell(text), values, 'rad', None)
    return parse_affine(plain, Scope('rad', values)).constant


def _product(text: str, values: Mapping[str, float]) -> Floats:
    T, depth, start = np.eye(4), 0, 0
    for k, sign in enumerate(f'{text}*'):
        depth += (sign in '([') - (sign in ')]')
        if sign in '*@' and depth == 0:
            T = T @ _factor(text[start:k].strip(), values)
            start = k + 1
    return T


def _factor(text: str, values: Mapping[str, float]) -> Floats:
    found = FACTOR.fullmatch(text)
    name, inside = found.groups() if found else (text, '')
    cells = cells_of(inside.strip().removeprefix('[').removesuffix(']'))
    in_degrees = len(cells) > 1 and 'deg' in cells[-1]
    numbers = [_value(cell, values) for cell in (cells[:-1] if in_degrees else cells)]
    T = np.eye(4)
    axis = name[-1:].lower()
    if name in SHIFTS and len(numbers) == 3:
        T[:3, 3] = numbers
    elif name in ('Tx', 'Ty', 'Tz') and len(numbers) == 1:
        T['xyz'.index(axis), 3] = numbers[0]
    elif re.fullmatch('(?:trot|R)[xyz]', name) and len(numbers) == 1:
        return screw(axis, np.radians(numbers[0]) if in_degrees else numbers[0], 0.0)
    elif not (name in IDENTITY and numbers in ([], [4.0])):
        raise ValueError(text)
    return T


def _line(end: str, T: Floats) -> str:
    xyz = ', '.join(number_text(x) for x in np.round(T[:3, 3], 12))
    turned = np.round(np.degrees(exact_rpy(T[:3, :3])), 12)
    rpy = ', '.join(number_text(angle) + (DEGREE if angle else '') for angle in turned)
    return f'{end}: {{xyz: [{xyz}], rpy: [{rpy}]}}'
