"""The uncertainty of a robot file: how far joints and table may be off."""

from collections.abc import Mapping, Sequence
from typing import Any

from ..text.entries import (
    checked,
    checked_list,
    checked_mapping,
    checked_number,
    choice,
    did_you_mean,
    meant_by,
)
from ..text.fault_report import quoted
from ..text.yaml_document import Path
from .description import JointDescription, JointType, Link, Uncertainty
from .parameters import (
    ENDS,
    GEARS,
    TABLE_GROUPS,
    ArmParameter,
    end_parameters,
    gear_parameters,
    placed_rows,
)
from .quantities import KIND_OF, Kind, Quantities
from .schema import FloorEntry, UncertaintyEntry

PATH: Path = ('uncertainty',)
OF_POSITIONS = ('encoder_noise', 'encoder_resolution', 'backlash')
# Parameters named in a message.
MOST_NAMED = 60


def read_uncertainty(
    data: Any,
    types: Sequence[JointType | None],
    joints: Sequence[JointDescription],
    links: Sequence[Link] | None,
    convention: str,
    quantities: Quantities,
) -> Uncertainty | None:
    """
    Return the section; None where there is none, or with its faults reported.

    Parameters
    ----------
    data
        The mapping as the file has it; None where there is none.
    types
        Of the entries in the list of joints; None where it has been refused.
    joints
        Their descriptions; fewer where some have faults.
    links
        The table, whose numbers parameters are; None where it has faults: no name is judged.
    convention
        Of the table; empty where it is not known: no name is judged.
    quantities
        What the names in expressions mean.
    """
    if data is None:
        return None
    report = quantities.report
    before = report.fault_count
    entry = checked(UncertaintyEntry, data, PATH, report)
    of_joints = {
        key: _of_joints(key, getattr(entry, key), types, quantities) for key in OF_POSITIONS
    }
    velocities = None
    if entry.velocity_noise is not None:
        velocities = _of_joints('velocity_noise', entry.velocity_noise, types, quantities)
        if velocities and not any(velocities):
            report.fault((*PATH, 'velocity_noise'), 'is 0 for every joint: leave it out')
    known = _known(links, convention, joints) if links is not None and convention else None
    parameters = _parameters(entry.parameters, known, quantities)
    factor = _factor(entry.covariance, known, quantities)
    if entry.parameters is not None and entry.covariance is not None:
        report.fault(
            (*PATH, 'parameters'), 'stands beside covariance, which is of the same: give one'
        )
    xyz, rpy = _floor(entry.floor, quantities)
    if report.fault_count > before or None in types:
        return None
    found = Uncertainty(
        of_joints['encoder_noise'],
        of_joints['encoder_resolution'],
        of_joints['backlash'],
        velocities,
        parameters,
        factor,
        xyz,
        rpy,
    )
    # What names mean that were not judged is not known.
    if known is not None and velocities is None and not found.of_pose:
        report.fault(
            PATH, 'says that nothing is off: give at least one number above 0, or leave it out'
        )
        return None
    return found


def _known(
    links: Sequence[Link], convention: str, joints: Sequence[JointDescription]
) -> dict[str, ArmParameter]:
    # By their names.
    table = [one.parameter for row in placed_rows(links, convention) for one in row]
    ends = [one for end in ENDS for one in end_parameters(end, 0)]
    return {one.name: one for one in (*table, *ends, *gear_parameters(joints))}


def _kind(one: ArmParameter) -> Kind:
    if one.group == GEARS:
        return 'number'
    return 'angle' if one.angle else 'length'


def _deviation(text: str | None, kind: Kind, path: Path, quantities: Quantities) -> float:
    value = quantities.fixed(text, kind, path, usual=False)
    if value is not None and value < 0.0:
        quantities.report.fault(path, f'must not be below 0, not {text}')
    return value or 0.0


def _of_joints(
    key: str, data: Any, types: Sequence[JointType | None], quantities: Quantities
) -> tuple[float, ...]:
    # One number for all joints, or a list with one for each.
    report, path = quantities.report, (*PATH, key)
    if data is None:
        return (0.0,) * len(types)
    kinds = [KIND_OF[kind] if kind else None for kind in types]
    if not isinstance(data, list):
        text = checked_number(data, path, report)
        if len(set(kinds) - {None}) > 1:
            report.fault(
                path,
                'one number for joints that turn and joints that slide: give a list of '
                f'{len(types)}, one for each joint',
            )
            return ()
        kind = next((one for one in kinds if one), None)
        if kind is None:
            return ()
        return (_deviation(text, kind, path, quantities),) * len(types)
    if len(data) != len(types):
        report.fault(path, f'{len(data)} values for {len(types)} joints')
        return ()
    return tuple(
        _deviation(checked_number(item, (*path, index), report), kind, (*path, index), quantities)
        for index, (item, kind) in enumerate(zip(data, kinds, strict=True))
        if kind
    )


def _parameters(
    data: Any, known: Mapping[str, ArmParameter] | None, quantities: Quantities
) -> tuple[tuple[str, float], ...]:
    report, path = quantities.report, (*PATH, 'parameters')
    given = checked_mapping(data, path, report, 'parameters to standard deviations')
    found = []
    for name, item in given.items():
        text = checked_number(item, (*path, name), report)
        if known is None:
            continue
        of_group = [one for one in known.values() if one.group == name]
        kinds = {_kind(one) for one in of_group} if name in TABLE_GROUPS else set()
        if name in known:
            kinds = {_kind(known[name])}
        elif name not in TABLE_GROUPS:
            _unknown(name, (*path, name), known, TABLE_GROUPS, quantities)
            continue
        elif len(kinds) > 1:
            report.fault(
                (*path, name),
                'one number for joints that turn and joints that slide: name the parameters',
            )
            continue
        elif not kinds:
            report.fault((*path, name), 'the table has none of these')
            continue
        found.append((name, _deviation(text, kinds.pop(), (*path, name), quantities)))
    return tuple(found)


def _unknown(
    name: str,
    path: Path,
    known: Mapping[str, ArmParameter],
    groups: tuple[str, ...],
    quantities: Quantities,
) -> None:
    accepted = (*groups, *known)
    listed = accepted[:MOST_NAMED]
    more = (f'{len(accepted) - MOST_NAMED} more',) if len(accepted) > MOST_NAMED else ()
    quantities.report.fault(
        path,
        f'{quoted(name)} is no parameter of the table'
        f'{did_you_mean(meant_by(name, accepted))}{choice((*listed, *more))}',
    )


def _factor(
    data: Any, known: Mapping[str, ArmParameter] | None, quantities: Quantities
) -> tuple[tuple[str, tuple[float, ...]], ...]:
    report, path = quantities.report, (*PATH, 'covariance')
    given = checked_mapping(data, path, report, 'parameters to rows of L in L L^T')
    found = []
    for index, (name, item) in enumerate(given.items()):
        place = (*path, name)
        items = checked_list(item, place, report, 'a list of numbers, the row of L')
        if len(items) > index + 1:
            report.fault(
                place,
                f'{len(items)} numbers in row {index + 1} of L, which is lower triangular '
                f'(at most {index + 1})',
            )
        texts = [checked_number(one, (*place, k), report) for k, one in enumerate(items)]
        if known is None:
            continue
        if name not in known:
            _unknown(name, place, known, (), quantities)
            continue
        kind = _kind(known[name])
        row = [
            quantities.fixed(text, kind, (*place, k), usual=False) for k, text in enumerate(texts)
        ]
        found.append((name, tuple(value or 0.0 for value in row)))
    return tuple(found)


def _floor(data: Any, quantities: Quantities) -> tuple[float, float]:
    path = (*PATH, 'floor')
    if data is None:
        return 0.0, 0.0
    entry = checked(FloorEntry, data, path, quantities.report)
    return (
        _deviation(entry.xyz, 'length', (*path, 'xyz'), quantities),
        _deviation(entry.rpy, 'angle', (*path, 'rpy'), quantities),
    )
