"""The rows of a robot file's table, by its convention."""

import math
import re
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeAlias, get_args

from .description import Axis, DhRow, ElementaryMotion, ShapeRow
from .entries import checked, checked_list, checked_word
from .expressions import Expression
from .fault_report import number, quoted
from .motions import read_motion
from .quantities import LONG, METRES, MILLIMETRES, Kind, Quantities
from .schema import DhRowEntry, ShapeRowEntry
from .yaml_document import Path, ScalarNode

MAX_ROWS = 512
SHORT = 0.01  # m: no arm is as short
PATH: Path = ('links',)
ELEMENTARY = re.compile(r'\s*([A-Za-z]+)\s*\((.*)\)\s*', re.DOTALL)
AXES: tuple[Axis, ...] = get_args(Axis)

Row: TypeAlias = DhRow | ElementaryMotion | ShapeRow


def read_links(data: Any, convention: str, quantities: Quantities) -> tuple[Row, ...] | None:
    """Return the rows base to tool, or None with their faults reported."""
    report = quantities.report
    before = report.fault_count
    items = checked_list(data, PATH, report, 'a list of the rows of the table')
    if data == []:
        report.fault(PATH, 'at least one row is needed')
    if len(items) > MAX_ROWS:
        message = f'{len(items)} rows (at most {MAX_ROWS}: four for each of 128 joints)'
        report.fault(PATH, message)
        items = items[:MAX_ROWS]
    read_row = ROW_OF[convention]
    rows = [read_row(item, (*PATH, index), quantities) for index, item in enumerate(items)]
    found = tuple(row for row in rows if row is not None)
    return found if report.fault_count == before and len(found) == len(items) else None


def likely_convention(data: Any) -> str:
    """Return the convention whose rows look like those of a list."""
    first = data[0] if isinstance(data, list) and data else None
    if isinstance(first, ScalarNode):
        return 'elementary'
    if isinstance(first, dict) and {'in', 'out', 'joint'} & first.keys():
        return 'shape'
    return 'standard'


def moving_parts(row: Row) -> Iterator[tuple[Kind, str, Expression]]:
    """Yield what may move in a row: angle or length, its place in words, its expression."""
    match row:
        case DhRow():
            yield 'angle', 'theta', row.theta
            yield 'length', 'd', row.d
        case ElementaryMotion():
            yield _kind(row.axis), row.axis, row.argument
        case ShapeRow(joint=ElementaryMotion() as joint):
            yield _kind(joint.axis), joint.axis, joint.argument


def variables_of(row: Row) -> frozenset[str]:
    """Return the joint variables that move a row."""
    return frozenset(
        variable
        for _, _, expression in moving_parts(row)
        for variable, _ in expression.affine.coefficients
    )


def warn_of_size(rows: Sequence[Row], quantities: Quantities) -> None:
    """Warn where the lengths of a table together are hardly meant in the file's unit."""
    lengths = [length for row in rows for length in _lengths(row)]
    total, report = sum(lengths), quantities.report
    if quantities.units.length == 'm' and total > LONG and max(lengths) <= LONG:
        report.warn(PATH, f'lengths of {number(total)} m in all: {MILLIMETRES}')
    if quantities.units.length == 'mm' and 0.0 < total < SHORT:
        report.warn(PATH, f'lengths of {number(total * 1e3)} mm in all: {METRES}')


def _lengths(row: Row) -> Iterator[float]:
    match row:
        case DhRow():
            yield abs(row.a.affine.constant)
            yield abs(row.d.affine.constant)
        case ElementaryMotion():
            if _kind(row.axis) == 'length':
                yield abs(row.argument.affine.constant)
        case ShapeRow():
            for motion in (row.inner, row.outer):
                yield math.hypot(*motion.matrix[:3, 3])


def check_helical(rows: Sequence[Row], quantities: Quantities) -> None:
    """Report helical joints that only turn, or only slide."""
    places: dict[str, dict[Kind, str]] = {}
    for index, row in enumerate(rows):
        for kind, place, expression in moving_parts(row):
            for variable, _ in expression.affine.coefficients:
                places.setdefault(variable, {}).setdefault(kind, f'{place} of links[{index}]')
    for position, (variable, joint_type) in enumerate(quantities.joint_types.items()):
        found = places.get(variable, {})
        if joint_type == 'helical' and len(found) == 1:
            (only,) = found.values()
            other = 'a length (its pitch)' if 'angle' in found else 'an angle'
            quantities.report.fault(
                ('joints', position, 'type'),
                f'{variable!r} is helical and stands only in {only}: it must stand in {other} too',
            )


def _dh_row(data: Any, path: Path, quantities: Quantities) -> DhRow | None:
    entry = checked(DhRowEntry, data, path, quantities.report)
    advice = ': in a table row only d and theta may move'
    a = quantities.fixed_expression(entry.a, 'length', (*path, 'a'), advice)
    alpha = quantities.fixed_expression(entry.alpha, 'angle', (*path, 'alpha'), advice)
    d = quantities.moving(entry.d, 'length', (*path, 'd'), 'd')
    theta = quantities.moving(entry.theta, 'angle', (*path, 'theta'), 'theta')
    if a is None or alpha is None or d is None or theta is None:
        return None
    return DhRow(a, alpha, d, theta)


def _elementary_row(data: Any, path: Path, quantities: Quantities) -> ElementaryMotion | None:
    if not isinstance(data, ScalarNode):
        what = 'a mapping' if isinstance(data, dict) else 'a list'
        message = f'expected an elementary motion such as Rz(q1), not {what}'
        quantities.report.fault(path, message)
        return None
    text = checked_word(data, path, quantities.report)
    return None if text is None else _elementary_motion(text, path, quantities)


def _shape_row(data: Any, path: Path, quantities: Quantities) -> ShapeRow | None:
    report = quantities.report
    before = report.fault_count
    entry = checked(ShapeRowEntry, data, path, report)
    joint = None
    if entry.joint is not None:
        joint = _elementary_motion(entry.joint, (*path, 'joint'), quantities)
    inner = read_motion(entry.in_, (*path, 'in'), quantities)
    outer = read_motion(entry.out, (*path, 'out'), quantities)
    if inner is None or outer is None or report.fault_count > before:
        return None
    return ShapeRow(inner, joint, outer)


def _elementary_motion(text: str, path: Path, quantities: Quantities) -> ElementaryMotion | None:
    accepted = ', '.join(AXES)
    found = ELEMENTARY.fullmatch(text)
    axis = next((name for name in AXES if found and name == found[1]), None)
    if found is None or axis is None:
        message = f'{quoted(text)} is not an elementary motion (accepted: {accepted}, as Rz(q1))'
        quantities.report.fault(path, message)
        return None
    argument = quantities.moving(found[2].strip(), _kind(axis), path, axis)
    return None if argument is None else ElementaryMotion(axis, argument)


def _kind(axis: Axis) -> Kind:
    return 'angle' if axis.startswith('R') else 'length'


ROW_OF: dict[str, Callable[[Any, Path, Quantities], Row | None]] = {
    'standard': _dh_row,
    'modified': _dh_row,
    'elementary': _elementary_row,
    'shape': _shape_row,
}
