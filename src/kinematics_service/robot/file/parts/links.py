# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read the rows of a robot file's table; the convention of the file defines their form."""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import get_args

from ..text.entries import checked, checked_formula, checked_list
from ..text.expressions import Expression
from ..text.fault_report import Place, quoted
from ..text.yaml_document import ScalarNode, Yaml
from .convention_table import CONVENTIONS, MOVING, Axis, Convention, RowKind
from .description import DhRow, ElementaryMotion, Link, ShapeRow
from .motions import read_motion
from .quantities import LARGEST_USUAL_LENGTH, Kind, Quantities
from .schema import ShapeRowEntry, dh_row_entry

MAX_ROWS = 512
# Smallest plausible sum of the lengths of a table, m. If the file's unit is mm and the sum of the
# lengths is below this (10 mm), the numbers are probably in m.
MIN_USUAL_LENGTH = 0.01
ELEMENTARY = re.compile(r'\s*([RT][xyz])\s*\((.*)\)\s*', re.DOTALL)
AXES: tuple[Axis, ...] = get_args(Axis)


def read_links(
    data: Yaml, convention: Convention, at: Place, quantities: Quantities
) -> tuple[Link, ...] | None:
    """Read the rows of a chain, from base to tip. Report faults; after a fault return None."""
    items = checked_list(data, at, 'a list of the rows of the table')
    if data == []:
        at.fault('at least one row is needed', 'empty')
    if len(items) > MAX_ROWS:
        message = f'{len(items)} rows (at most {MAX_ROWS}: four for each of 128 joints)'
        at.fault(message, 'too-many')
        items = items[:MAX_ROWS]
    read_row = READERS[convention.rows]
    rows = [read_row(item, convention, at[k], quantities) for k, item in enumerate(items)]
    links = tuple(row for row in rows if row is not None)
    return links if at.intact and len(links) == len(items) else None


def likely_convention(data: Yaml) -> Convention:
    """
    Return a convention whose rows have the form of the first row in `data`.

    A row is a text, a mapping with shape matrices, or a mapping with named quantities.
    """
    first = data[0] if isinstance(data, list) and data else None
    rows: RowKind = 'quantities'
    if isinstance(first, ScalarNode):
        rows = 'motion'
    elif isinstance(first, dict) and {'in', 'out', 'joint'} & first.keys():
        rows = 'shape'
    return next(convention for convention in CONVENTIONS.values() if convention.rows == rows)


def moving_parts(row: Link) -> Iterator[tuple[Kind, str, Expression]]:
    """
    Yield elementary motions of a table row: only motions that may depend on joint variables.

    Each motion is a tuple: its kind (angle or length), its quantity or axis, and its expression.
    """
    for k, motion in enumerate(row.motions):
        place = row.names[k] if isinstance(row, DhRow) else motion.axis
        if place in MOVING or not isinstance(row, DhRow):
            yield _kind(motion.axis), place, motion.argument


def variables_of(row: Link) -> frozenset[str]:
    """Return the joint variables that move a row."""
    return frozenset(
        variable
        for _, _, expression in moving_parts(row)
        for variable, _ in expression.affine.coefficients
    )


def names_in_rows(rows: Iterable[Link]) -> frozenset[str]:
    """Return the joint variables and the passive joints that move at least one of the rows."""
    return frozenset().union(*map(variables_of, rows))


def warn_of_size(rows: Sequence[Link], quantities: Quantities) -> None:
    """Warn if the sum of all lengths in the table is implausible in the unit of the file."""
    lengths = [length for row in rows for length in _lengths(row)]
    total, words, at = sum(lengths), 'lengths of {} in all', quantities.top['links']
    if max(lengths, default=0.0) <= LARGEST_USUAL_LENGTH:
        quantities.warn_of_length(total, MIN_USUAL_LENGTH, LARGEST_USUAL_LENGTH, words, at)


def _lengths(row: Link) -> Iterator[float]:
    if isinstance(row, ShapeRow):
        for shape in (row.inner, row.outer):
            yield math.hypot(*shape.matrix[:3, 3])
        return
    for motion in row.motions:
        if not motion.turns:
            yield abs(motion.argument.affine.constant)


def check_helical(rows: Sequence[Link], quantities: Quantities) -> None:
    """
    Report a fault for each helical joint whose variable is only in angles, or only in lengths.

    A helical joint turns and slides. So its variable must be in an angle of the table, and in a
    length of the table.
    """
    places: dict[str, dict[Kind, str]] = {}
    for index, row in enumerate(rows):
        for kind, place, expression in moving_parts(row):
            for variable, _ in expression.affine.coefficients:
                places.setdefault(variable, {}).setdefault(kind, f'{place} of links[{index}]')
    for position, (variable, joint_type) in enumerate(quantities.joint_types.items()):
        by_kind = places.get(variable, {})
        if joint_type == 'helical' and len(by_kind) == 1:
            (only,) = by_kind.values()
            other = 'a length (its pitch)' if 'angle' in by_kind else 'an angle'
            message = f'{variable!r} is helical and only in {only}; write it into {other} as well'
            quantities.top['joints', position, 'type'].fault(message, 'missing-pitch')


def _dh_row(data: Yaml, convention: Convention, at: Place, quantities: Quantities) -> DhRow | None:
    names = convention.quantities
    axes = {motion.quantity: motion.axis for motion in convention.motions}
    entry = checked(dh_row_entry(names), data, at)
    may_move = ' and '.join(name for name in names if name in MOVING)
    advice = f'; in a table row only {may_move} may move'
    motions = []
    for name in names:
        text, kind = getattr(entry, name), _kind(axes[name])
        if name in MOVING:
            argument = quantities.moving(text, kind, at[name], name)
        else:
            argument = quantities.fixed_expression(text, kind, at[name], advice)
        if argument is not None:
            motions.append(ElementaryMotion(axes[name], argument))
    return DhRow(names, tuple(motions)) if len(motions) == len(names) else None


def _elementary_row(
    data: Yaml, _: Convention, at: Place, quantities: Quantities
) -> ElementaryMotion | None:
    if not isinstance(data, ScalarNode):
        noun = 'a mapping' if isinstance(data, dict) else 'a list'
        at.fault(f'expected an elementary motion such as Rz(q1), not {noun}', 'wrong-type')
        return None
    text = checked_formula(data, at)
    return None if text is None else _elementary_motion(text, at, quantities)


def _shape_row(data: Yaml, _: Convention, at: Place, quantities: Quantities) -> ShapeRow | None:
    entry = checked(ShapeRowEntry, data, at)
    joint = None
    if entry.joint is not None:
        joint = _elementary_motion(entry.joint, at['joint'], quantities)
    inner = read_motion(entry.in_, at['in'], quantities)
    outer = read_motion(entry.out, at['out'], quantities)
    if inner is None or outer is None or not at.intact:
        return None
    return ShapeRow(inner, joint, outer)


def _elementary_motion(text: str, at: Place, quantities: Quantities) -> ElementaryMotion | None:
    match = ELEMENTARY.fullmatch(text)
    if match is None:
        accepted = ', '.join(AXES)
        message = f'{quoted(text)} is not an elementary motion (accepted: {accepted}, as Rz(q1))'
        at.fault(message, 'unknown-name')
        return None
    axis = AXES[AXES.index(match[1])]
    argument = quantities.moving(match[2].strip(), _kind(axis), at, axis)
    return None if argument is None else ElementaryMotion(axis, argument)


def _kind(axis: Axis) -> Kind:
    return 'angle' if axis.startswith('R') else 'length'


READERS: dict[RowKind, Callable[[Yaml, Convention, Place, Quantities], Link | None]] = {
    'quantities': _dh_row,
    'motion': _elementary_row,
    'shape': _shape_row,
}
