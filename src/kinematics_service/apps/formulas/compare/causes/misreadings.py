# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the values that a formula has if its author misreads the robot's table.

A misreading is one change, such as another DH convention, a joint angle measured from another
zero, or a row left out.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations, permutations

import numpy as np
import sympy as sp

from .....robot.file.parts.convention_table import CONVENTIONS, MOVING, Convention
from ...arm.numbers import DEGREE, Floats
from ...arm.table import EYE, Table, TableRow
from ...arm.world import World
from ..statements.checks import QuantityCheck
from .variant import JACOBIAN, Variant

TURNS = ((sp.pi / 2, '+ 90 deg'), (-sp.pi / 2, '- 90 deg'), (sp.pi, '+ 180 deg'))
ZERO = sp.Integer(0)
# Kinds of quantities that contain derivatives by the joint variables: Jacobians and the
# determinant of the Jacobian.
DIFFERENTIATED = (*JACOBIAN, 'det')


def _at(check: QuantityCheck, table: Table, sentence: str) -> Variant:
    world = World(table, check.poses.values, check.poses.count)
    return Variant(sentence, check.right_of(world))


def _by_joints(check: QuantityCheck, changes: dict[sp.Symbol, sp.Expr], sentence: str) -> Variant:
    # Replace joint variables of the table by the expressions in `changes`, and return the values
    # of the quantity.
    if check.quantity.kind not in DIFFERENTIATED:
        # The quantity has no derivatives by joint variables, so evaluate it at the changed joint
        # values. A table with changed expressions would take ten times as long.
        evaluation = check.world.evaluation
        values = {variable: evaluation.of(value) for variable, value in changes.items()}
        return _with_values(check, values, sentence)
    rows = tuple(
        row
        if row.symbols.isdisjoint(changes)
        else replace(
            row.with_quantities({name: row[name].xreplace(changes) for name in MOVING}),
            argument=row.argument.xreplace(changes),
        )
        for row in check.names.table.rows
    )
    return _at(check, replace(check.names.table, rows=rows), sentence)


def other_convention(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield mistaken values of the quantity, computed as if the table followed another convention,
    such as modified instead of standard DH. Only conventions whose quantities have the same names
    (a, alpha, d, theta) are tried.
    """
    table = check.names.table
    for other in CONVENTIONS[table.convention].others:
        if check.quantity.kind == 'general':
            general = replace(table, convention=other.name)
            changed = replace(check, names=type(check.names)(general))
            sentence = f'the row is {_full_name(other)}, the robot file is {table_name(check)}'
            yield Variant(sentence, changed.right)
            continue
        rows = tuple(replace(row, convention=other.name) for row in table.rows)
        sentence = (
            f'the table was read as {_full_name(other)} DH, the robot file is {table_name(check)}'
        )
        yield _at(check, replace(table, rows=rows), sentence)


def table_name(check: QuantityCheck) -> str:
    """Return the convention of the robot file as text."""
    convention = CONVENTIONS[check.names.table.convention]
    return _full_name(convention) if convention.product else convention.name


def _full_name(convention: Convention) -> str:
    return f"{convention.name} ({convention.author}'s)" if convention.author else convention.name


def joint_zero(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield mistaken values of the quantity, computed with the zero of one joint angle shifted by 90,
    -90 or 180 deg.
    """
    for variable in check.names.table.turning:
        for turn, text in TURNS:
            sentence = f'{variable} is counted from another zero: {variable} {text} stands for it'
            yield _by_joints(check, {variable: variable + turn}, sentence)


def in_degrees(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield mistaken values of the quantity, computed as if one joint angle, or all joint angles,
    were in degrees instead of radians.
    """
    turning = check.names.table.turning
    for chosen in (turning, *([variable] for variable in turning if len(turning) > 1)):
        changes = {variable: check.poses.values[variable] * DEGREE for variable in chosen}
        names = ', '.join(map(str, chosen))
        yield _with_values(check, changes, f'{names} taken for degrees: it is in radians')


def sine_for_cosine(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield mistaken values of the quantity, computed with sine and cosine of one joint angle
    exchanged. Then yield values with sine and cosine exchanged in every sum of angles that
    contains this angle, such as sin(q1 + q2).
    """
    turning = check.names.table.turning
    for variable in turning:
        # Replace q by pi/2 - q: this exchanges sin(q) and cos(q) in every entry.
        changes = {variable: np.pi / 2 - check.poses.values[variable]}
        sentence = f'sin({variable}) and cos({variable}) are exchanged'
        yield _with_values(check, changes, sentence)
    # Negate all joint angles and add pi/2 to one joint angle. This exchanges sine and cosine of
    # each sum that contains the angle, because sin(q1 + q2) = cos(pi/2 - q1 - q2).
    for first in turning if len(turning) > 1 else ():
        changes = {variable: -check.poses.values[variable] for variable in turning}
        changes[first] = changes[first] + np.pi / 2
        yield _with_values(check, changes, f'sines and cosines of sums with {first} are exchanged')


def _with_values(check: QuantityCheck, changes: dict[sp.Symbol, Floats], sentence: str) -> Variant:
    values = {**check.poses.values, **changes}
    world = World(check.names.table, values, check.poses.count)
    return Variant(sentence, check.right_of(world))


def joint_direction(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield mistaken values of the quantity, computed with the sign of one joint variable changed.
    """
    for variable in check.names.table.variables:
        sentence = f'{variable} is counted in the other direction'
        yield _by_joints(check, {variable: -variable}, sentence)


def joint_exchange(check: QuantityCheck) -> Iterator[Variant]:
    """Yield mistaken values of the quantity, computed with two joint variables exchanged."""
    for joint, other in combinations(check.names.table.variables, 2):
        sentence = f'{joint} and {other} are exchanged'
        yield _by_joints(check, {joint: other, other: joint}, sentence)


def absolute_angles(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield mistaken values of the quantity, computed with one joint angle added to another joint
    angle, or subtracted from it. The user makes this mistake if he confuses absolute and relative
    angles.
    """
    for u, v in permutations(check.names.table.turning, 2):
        for value, text in ((u + v, f'{u} + {v}'), (u - v, f'{u} - {v}')):
            yield _by_joints(check, {u: value}, f'{text} stands where {u} belongs')


def one_row(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield mistaken values of the quantity, computed from tables with a mistake in one row: a length
    or an angle is 0 or has the wrong sign, or two lengths are exchanged.
    """
    table = check.names.table
    for i, row in enumerate(table.rows):
        where = f'row {i + 1}'
        edits: list[tuple[dict[str, sp.Expr], str]] = []
        # List the named quantities of a row with their axes, except theta, in alphabetical order.
        axes = sorted((name, axis) for axis, name in row.order.motions if name != 'theta')
        angles = [name for name, axis in axes if axis[0] == 'R']
        lengths = [name for name, axis in axes if axis[0] == 'T']
        for name in angles:
            if row[name] not in (0, sp.pi):
                edits.append(({name: -row[name]}, f'{name} of {where} has the wrong sign'))
                edits.append(({name: ZERO}, f'{name} of {where} taken for 0'))
        for name in lengths:
            if row[name] != 0:
                length = f'{name} of {where} ({row[name]})'
                edits.append(({name: ZERO}, f'{length} is left out'))
                edits.append(({name: -row[name]}, f'{length} has the wrong sign'))
        for first, second in combinations(lengths, 2):
            if row[first] != row[second]:
                exchanged = {first: row[second], second: row[first]}
                edits.append((exchanged, f'{first} and {second} of {where} are exchanged'))
        for changes, sentence in edits:
            yield _at(check, table.with_row(i, row.with_quantities(changes)), sentence)


def row_left_out(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield mistaken values of the quantity, computed from tables in which the transform of one row
    is replaced by the identity.
    """
    table = check.names.table
    for i, row in enumerate(table.rows):
        still = TableRow(row.convention, tuple((name, ZERO) for name, _ in row.quantities))
        yield _at(check, table.with_row(i, still), f'row {i + 1} is left out')


def shifted_column(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield mistaken values of the quantity, computed from tables in which one column is shifted up
    or down by one row.
    """
    table = check.names.table
    convention = CONVENTIONS[table.convention]
    joint = [name for _, name in convention.joint_motions]
    for name in (*joint, *(name for name in convention.quantities if name not in joint)):
        column = [row[name] for row in table.rows]
        for first in reversed(range(len(column) - 1)):
            up = [*column[:first], *column[first + 1 :], ZERO]
            down = [*column[:first], ZERO, *column[first:-1]]
            for shifted, direction in ((up, 'up'), (down, 'down')):
                if shifted != column:
                    rows = tuple(
                        row.with_quantities({name: value})
                        for row, value in zip(table.rows, shifted)
                    )
                    sentence = (
                        f'the {name} column of the table has slipped {direction} by one row, '
                        f'from row {first + 1} on'
                    )
                    yield _at(check, replace(table, rows=rows), sentence)


def not_inverted(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield mistaken values of the quantity, computed from tables in which a Sheth-Uicker row is
    inner * motion * outer, instead of inner * motion * inverse(outer).
    """
    table = check.names.table
    shaped = [i for i, row in enumerate(table.rows) if row.outer != EYE]
    for chosen in [*([i] for i in shaped), shaped]:
        changed = table
        for i in chosen:
            inverse = sp.ImmutableDenseMatrix(table.rows[i].outer.inv())
            changed = changed.with_row(i, replace(changed.rows[i], outer=inverse))
        if chosen:
            rows = ', '.join(str(i + 1) for i in chosen)
            sentence = (
                f'the output matrix of row {rows} is not inverted: in * joint * out instead of '
                'in * joint * inverse(out)'
            )
            yield _at(check, changed, sentence)


def missing_length(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield mistaken values of the quantity, computed with one length or one prismatic joint at 0.
    """
    table, values = check.names.table, check.poses.values
    sliding = [variable for variable in table.variables if variable not in table.turning]
    general = [sp.Symbol('a_i'), sp.Symbol('d_i')] if check.quantity.kind == 'general' else []
    for symbol in (*table.constants, *sliding, *general):
        if np.any(values[symbol] != 0.0):
            changes = {symbol: np.zeros(check.poses.count)}
            yield _with_values(check, changes, f'{symbol} is missing, as if it were 0')


def exchanged_lengths(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield mistaken values of the quantity, computed with two lengths exchanged, or with a length
    replaced by another length.
    """
    values = check.poses.values
    for length, other in combinations(check.names.table.constants, 2):
        versions = (
            ({length: other, other: length}, f'{length} and {other} are exchanged'),
            ({length: other}, f'{other} stands where {length} belongs'),
            ({other: length}, f'{length} stands where {other} belongs'),
        )
        for places, sentence in versions:
            changes = {to: values[source] for to, source in places.items()}
            yield _with_values(check, changes, sentence)


def other_joint_value(check: QuantityCheck) -> Iterator[Variant]:
    """
    Yield mistaken values of the quantity, computed with other joint values than those in the line
    `at: ...` of the formula file. One joint is at 0, 90, -90 or 180 deg, or all joint angles are
    read in degrees.
    """
    values, turning = check.poses.values, check.names.table.turning
    given = [s for s in check.names.table.variables if s.name in check.poses.chosen]
    if not given:
        return
    read = {symbol: np.radians(values[symbol]) for symbol in given if symbol in turning}
    yield _with_values(check, read, "the 'at' line is in degrees, not in radians")
    for symbol in given:
        for degrees in (0, 90, -90, 180):
            if symbol in turning and abs(values[symbol][0] - np.radians(degrees)) > 1e-9:
                position = f'{np.degrees(values[symbol][0]):g} deg'
                sentence = f'right for {symbol} = {degrees} deg, not for {symbol} = {position}'
                changes = {symbol: np.full(check.poses.count, np.radians(degrees))}
                yield _with_values(check, changes, sentence)
