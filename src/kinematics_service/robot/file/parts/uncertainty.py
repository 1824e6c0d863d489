# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read the section `uncertainty` of a robot file: standard deviations of joints and table."""

from collections.abc import Mapping, Sequence

from ..text import entries
from ..text.fault_report import Place, quoted
from ..text.yaml_document import Yaml
from .description import JointDescription, Link, Uncertainty
from .parameters import GEARS, TABLE_GROUPS, ArmParameter, uncertain_parameters
from .quantities import KIND_OF, Kind, Quantities
from .schema import FloorEntry, UncertaintyEntry

OF_POSITIONS = ('encoder_noise', 'encoder_resolution', 'backlash')
# Largest number of parameters that an error message lists.
MAX_LISTED = 60


def read_uncertainty(
    data: Yaml,
    joints: Sequence[JointDescription],
    links: Sequence[Link] | None,
    convention: str,
    quantities: Quantities,
) -> Uncertainty | None:
    """
    Read the section `uncertainty`; report faults, and return None if it is missing or has faults.

    Parameters
    ----------
    data
        The value of the key `uncertainty`; None if the file does not have the key.
    joints
        The joints without faults.
    links
        The rows of the table; None if they have faults.
    convention
        The name of the convention of the table.
    quantities
        The meaning of the names in expressions.
    """
    if data is None:
        return None
    at = quantities.top['uncertainty']
    entry = entries.checked(UncertaintyEntry, data, at)
    if links is None or len(joints) < len(quantities.types):
        return None  # names of parameters cannot be checked if a joint or a row has a fault
    kinds = [KIND_OF[joint.type] for joint in joints]
    noise, resolution, backlash = (
        _of_joints(getattr(entry, key), kinds, at[key], quantities) for key in OF_POSITIONS
    )
    velocities, place = None, at['velocity_noise']
    if entry.velocity_noise is not None:
        velocities = _of_joints(entry.velocity_noise, kinds, place, quantities)
        if velocities and not any(velocities):
            place.fault('is 0 for each joint; leave it out', 'no-effect')
    known = uncertain_parameters(links, convention, joints)
    parameters = _parameters(entry.parameters, known, at['parameters'], quantities)
    factor = _factor(entry.covariance, known, at['covariance'], quantities)
    if entry.parameters is not None and entry.covariance is not None:
        message = 'parameters and covariance exclude each other; write one'
        at['parameters'].fault(message, 'conflict')
    floor = entries.checked(FloorEntry, {} if entry.floor is None else entry.floor, at['floor'])
    xyz = _deviation(floor.xyz, 'length', at['floor', 'xyz'], quantities)
    rpy = _deviation(floor.rpy, 'angle', at['floor', 'rpy'], quantities)
    if not at.intact:
        return None
    section = Uncertainty(noise, resolution, backlash, velocities, parameters, factor, xyz, rpy)
    if velocities is None and not section.of_pose:
        at.fault('all numbers are 0; write one above 0, or leave the section out', 'no-effect')
        return None
    return section


def _kind(parameter: ArmParameter) -> Kind:
    if parameter.group == GEARS:
        return 'number'
    return 'angle' if parameter.angle else 'length'


def _deviation(text: str | None, kind: Kind, at: Place, quantities: Quantities) -> float:
    value = quantities.fixed(text, kind, at, usual=False)
    if value is not None and value < 0.0:
        at.fault(f'must be 0 or more, not {text}', 'out-of-range')
    return value or 0.0


def _of_joints(
    data: Yaml, kinds: Sequence[Kind], at: Place, quantities: Quantities
) -> tuple[float, ...]:
    # Return one number for each joint: a standard deviation, an encoder step, or a backlash. The
    # file gives one number for all joints, or a list. If the key is missing, the numbers are 0.
    if data is None:
        return (0.0,) * len(kinds)
    if not isinstance(data, list):
        text = entries.checked_number(data, at)
        if len(set(kinds)) > 1:
            at.fault(
                'one number cannot be rad and m, for joints that turn and joints that slide; '
                f'write a list of {len(kinds)}, one for each joint',
                'ambiguous',
            )
            return ()
        return (_deviation(text, kinds[0], at, quantities),) * len(kinds)
    if len(data) != len(kinds):
        at.fault(f'{len(data)} values for {len(kinds)} joints', 'wrong-length')
    return tuple(
        _deviation(entries.checked_number(item, at[index]), kind, at[index], quantities)
        for index, (item, kind) in enumerate(zip(data, kinds))
    )


def _parameters(
    data: Yaml, known: Mapping[str, ArmParameter], at: Place, quantities: Quantities
) -> tuple[tuple[str, float], ...]:
    given = entries.checked_mapping(data, at, 'parameters to standard deviations')
    deviations = []
    for name, item in given.items():
        text = entries.checked_number(item, at[name])
        group = [parameter for parameter in known.values() if parameter.group == name]
        chosen = [known[name]] if name in known else group if name in TABLE_GROUPS else []
        kinds = {_kind(parameter) for parameter in chosen}
        if len(kinds) == 1:
            deviations.append((name, _deviation(text, kinds.pop(), at[name], quantities)))
        elif kinds:
            message = 'one number cannot be rad and m; write the parameters one by one'
            at[name].fault(message, 'ambiguous')
        elif name in TABLE_GROUPS:
            at[name].fault('the table has no parameter in this group; delete it', 'no-effect')
        else:
            _unknown(name, at[name], known, TABLE_GROUPS)
    return tuple(deviations)


def _unknown(
    name: str, at: Place, known: Mapping[str, ArmParameter], groups: tuple[str, ...]
) -> None:
    accepted = (*groups, *known)
    listed = accepted[:MAX_LISTED]
    more = (f'{len(accepted) - MAX_LISTED} more',) if len(accepted) > MAX_LISTED else ()
    at.fault(
        f'unknown parameter {quoted(name)}'
        f'{entries.did_you_mean(entries.meant_by(name, accepted))}'
        f'{entries.choice((*listed, *more))}',
        'unknown-name',
    )


def _factor(
    data: Yaml, known: Mapping[str, ArmParameter], at: Place, quantities: Quantities
) -> tuple[tuple[str, tuple[float, ...]], ...]:
    given = entries.checked_mapping(data, at, 'parameters to rows of L in L L^T')
    rows = []
    for index, (name, item) in enumerate(given.items()):
        place = at[name]
        items = entries.checked_list(item, place, 'a list of numbers, the row of L')
        if len(items) > index + 1:
            place.fault(
                f'{len(items)} numbers in row {index + 1} of L, which is lower triangular '
                f'(at most {index + 1})',
                'wrong-length',
            )
        texts = [entries.checked_number(element, place[k]) for k, element in enumerate(items)]
        if name not in known:
            _unknown(name, place, known, ())
            continue
        kind = _kind(known[name])
        row = [quantities.fixed(text, kind, place[k], usual=False) for k, text in enumerate(texts)]
        rows.append((name, tuple(value or 0.0 for value in row)))
    return tuple(rows)
