"""How far the numbers of a table may be off: what a calibration begins with."""

import re

from ..text.entries import checked, checked_mapping, checked_number
from ..text.fault_report import quoted
from ..text.yaml_document import Yaml
from .convention_table import CONVENTIONS, Convention
from .description import Tolerances
from .quantities import Kind, Quantities
from .schema import TableToleranceEntry

NAME = re.compile(r'([A-Za-z]+)([1-9][0-9]{0,3})')
# Numbers of a calibration that stand in no row: extra corrections, and gear ratios of joints.
EXTRA = {'beta': 'Ry', 'b': 'Ty'}
GEAR = 'gear'
AXES = tuple(f'{kind}{axis}' for kind in 'RT' for axis in 'xyz')


def read_tolerances(
    data: Yaml, convention: Convention | None, rows: int | None, quantities: Quantities
) -> Tolerances:
    """
    Return the standard deviations in SI units, without those that have faults.

    Parameters
    ----------
    data
        The mapping as the file has it; None where there is none.
    convention, rows
        Of the table; None where that is not known.
    quantities
        What the names in expressions mean.
    """
    if data is None:
        return Tolerances()
    at, joints = quantities.top['tolerance'], len(quantities.types)
    entry = checked(TableToleranceEntry, data, at)
    length = quantities.above_zero(entry.length, 'length', at['length'])
    angle = quantities.above_zero(entry.angle, 'angle', at['angle'])
    gear = quantities.above_zero(entry.gear, 'number', at[GEAR])
    named = []
    for name, item in checked_mapping(entry.of, at['of'], 'names to numbers').items():
        here = at['of', name]
        kind = kind_of(name, convention, rows, joints)
        if kind is None:
            accepted = _accepted(convention, rows, joints)
            here.fault(f'{quoted(name)} is no number of this table (accepted: {accepted})')
            continue
        value = quantities.above_zero(checked_number(item, here), kind, here)
        if value is not None:
            named.append((name, value))
    return Tolerances(length, angle, gear, tuple(named))


def _axes_of(convention: Convention | None) -> dict[str, str]:
    # By the word before the number: the elementary motion that it belongs to.
    kinds = [convention] if convention is not None else list(CONVENTIONS.values())
    axes: dict[str, str] = {}
    for one in kinds:
        if one.product:
            axes.update({motion.quantity: motion.axis for motion in one.motions}, **EXTRA)
        else:
            axes.update({axis: axis for axis in AXES})
    return axes


def kind_of(
    name: str,
    convention: Convention | None = None,
    rows: int | None = None,
    joints: int | None = None,
) -> Kind | None:
    """Return what a named number of a table is; None if there is none of this name."""
    match = NAME.fullmatch(name)
    axes = _axes_of(convention)
    if match is None or match[1] not in (*axes, GEAR):
        return None
    most = joints if match[1] == GEAR else rows
    if most is not None and int(match[2]) > most:
        return None
    if match[1] == GEAR:
        return 'number'
    return 'angle' if axes[match[1]][0] == 'R' else 'length'


def _accepted(convention: Convention | None, rows: int | None, joints: int) -> str:
    last = 'n' if rows is None else rows
    names = [f'{word}1 to {word}{last}' for word in _axes_of(convention)]
    return ', '.join([*names, f'{GEAR}1 to {GEAR}{joints}'])
