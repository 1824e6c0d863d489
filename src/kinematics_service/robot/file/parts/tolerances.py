# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read the section `tolerance`: standard deviations of a table's numbers, for a calibration."""

import re

from ..text.entries import checked, checked_mapping, checked_number, choice
from ..text.fault_report import quoted
from ..text.yaml_document import Yaml
from .convention_table import Convention
from .description import Tolerances
from .quantities import Kind, Quantities
from .schema import TableToleranceEntry

NAME = re.compile(r'([A-Za-z]+)([1-9][0-9]{0,3})')
# Calibration parameters such as `beta2`, `b2` and `gear2` are not numbers of the table. EXTRA and
# GEAR have the names without the number. `beta2` adds a rotation about y (Ry) to row 2, and `b2`
# adds a translation along y (Ty) to row 2. `gear2` is the relative error of the gear ratio of
# joint 2.
EXTRA = {'beta': 'Ry', 'b': 'Ty'}
GEAR = 'gear'
AXES = tuple(f'{kind}{axis}' for kind in 'RT' for axis in 'xyz')


def read_tolerances(
    data: Yaml, convention: Convention, rows: int, quantities: Quantities
) -> Tolerances:
    """
    Read the section `tolerance` in SI units; report faults, and leave out values with faults.

    Parameters
    ----------
    data
        The value of the key `tolerance`; None if the file does not have the key.
    convention, rows
        The convention of the table, and its number of rows.
    quantities
        The meaning of the names in expressions.
    """
    if data is None:
        return Tolerances()
    at, joints = quantities.top['tolerance'], len(quantities.types)
    entry = checked(TableToleranceEntry, data, at)
    length = quantities.above_zero(entry.length, 'length', at['length'])
    angle = quantities.above_zero(entry.angle, 'angle', at['angle'])
    gear = quantities.above_zero(entry.gear, 'number', at[GEAR])
    last = {**dict.fromkeys(_axes_of(convention), rows), GEAR: joints}
    named = []
    for name, item in checked_mapping(entry.of, at['of'], 'names to numbers').items():
        place, match = at['of', name], NAME.fullmatch(name)
        if match is None or int(match[2]) > last.get(match[1], 0):
            accepted = tuple(f'{word}1 to {word}{index}' for word, index in last.items())
            message = f'unknown number {quoted(name)}{choice(accepted)}'
            place.fault(message, 'unknown-name')
            continue
        text = checked_number(item, place)
        value = quantities.above_zero(text, kind_of(name, convention), place)
        if value is not None:
            named.append((name, value))
    return Tolerances(length, angle, gear, tuple(named))


def _axes_of(convention: Convention) -> dict[str, str]:
    # Return a map from each word in parameter names to its elementary motion. The word `alpha`, as
    # in `alpha2`, has the elementary motion Rx.
    if convention.product:
        return {**{quantity: axis for axis, quantity in convention.motions}, **EXTRA}
    return {axis: axis for axis in AXES}


def kind_of(name: str, convention: Convention) -> Kind:
    """
    Return the kind of a calibration parameter such as `alpha2`: `angle`, `length`, or `number`.

    Only gear ratios are of the kind `number`.
    """
    word = name.rstrip('0123456789')
    if word == GEAR:
        return 'number'
    return 'angle' if _axes_of(convention)[word][0] == 'R' else 'length'
