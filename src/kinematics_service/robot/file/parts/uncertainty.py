"""The uncertainty of a robot file: how far joints and table may be off."""

from collections.abc import Mapping, Sequence

from ..text.entries import (
    checked,
    checked_list,
    checked_mapping,
    checked_number,
    choice,
    did_you_mean,
    meant_by,
)
from ..text.fault_report import Place, quoted
from ..text.yaml_document import Yaml
from .description import JointDescription, Link, Uncertainty
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

OF_POSITIONS = ('encoder_noise', 'encoder_resolution', 'backlash')
# Parameters named in a message.
MOST_NAMED = 60


def read_uncertainty(
    data: Yaml,
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
    at = quantities.top['uncertainty']
    entry = checked(UncertaintyEntry, data, at)
    of_joints = {key: _of_joints(getattr(entry, key), at[key], quantities) for key in OF_POSITIONS}
    velocities, place = None, at['velocity_noise']
    if entry.velocity_noise is not None:
        velocities = _of_joints(entry.velocity_noise, place, quantities)
        if velocities and not any(velocities):
            place.fault('is 0 for every joint: leave it out')
    known = _known(links, convention, joints) if links is not None and convention else None
    parameters = _parameters(entry.parameters, known, at['parameters'], quantities)
    factor = _factor(entry.covariance, known, at['covariance'], quantities)
    if entry.parameters is not None and entry.covariance is not None:
        at['parameters'].fault('stands beside covariance, which is of the same: give one')
    xyz, rpy = _floor(entry.floor, at['floor'], quantities)
    if not at.intact or None in quantities.types:
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
        at.fault('says that nothing is off: give at least one number above 0, or leave it out')
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


def _deviation(text: str | None, kind: Kind, at: Place, quantities: Quantities) -> float:
    value = quantities.fixed(text, kind, at, usual=False)
    if value is not None and value < 0.0:
        at.fault(f'must not be below 0, not {text}')
    return value or 0.0


def _of_joints(data: Yaml, at: Place, quantities: Quantities) -> tuple[float, ...]:
    # One number for all joints, or a list with one for each.
    types = quantities.types
    if data is None:
        return (0.0,) * len(types)
    kinds = [KIND_OF[kind] if kind else None for kind in types]
    if not isinstance(data, list):
        text = checked_number(data, at)
        if len(set(kinds) - {None}) > 1:
            at.fault(
                'one number for joints that turn and joints that slide: give a list of '
                f'{len(types)}, one for each joint'
            )
            return ()
        kind = next((one for one in kinds if one), None)
        if kind is None:
            return ()
        return (_deviation(text, kind, at, quantities),) * len(types)
    if len(data) != len(types):
        at.fault(f'{len(data)} values for {len(types)} joints')
        return ()
    return tuple(
        _deviation(checked_number(item, at[index]), kind, at[index], quantities)
        for index, (item, kind) in enumerate(zip(data, kinds, strict=True))
        if kind
    )


def _parameters(
    data: Yaml, known: Mapping[str, ArmParameter] | None, at: Place, quantities: Quantities
) -> tuple[tuple[str, float], ...]:
    found = []
    for name, item in checked_mapping(data, at, 'parameters to standard deviations').items():
        text = checked_number(item, at[name])
        if known is None:
            continue
        of_group = [one for one in known.values() if one.group == name]
        kinds = {_kind(one) for one in of_group} if name in TABLE_GROUPS else set()
        if name in known:
            kinds = {_kind(known[name])}
        elif name not in TABLE_GROUPS:
            _unknown(name, at[name], known, TABLE_GROUPS)
            continue
        elif len(kinds) > 1:
            at[name].fault(
                'one number for joints that turn and joints that slide: name the parameters'
            )
            continue
        elif not kinds:
            at[name].fault('the table has none of these')
            continue
        found.append((name, _deviation(text, kinds.pop(), at[name], quantities)))
    return tuple(found)


def _unknown(
    name: str, at: Place, known: Mapping[str, ArmParameter], groups: tuple[str, ...]
) -> None:
    accepted = (*groups, *known)
    listed = accepted[:MOST_NAMED]
    more = (f'{len(accepted) - MOST_NAMED} more',) if len(accepted) > MOST_NAMED else ()
    at.fault(
        f'{quoted(name)} is no parameter of the table'
        f'{did_you_mean(meant_by(name, accepted))}{choice((*listed, *more))}'
    )


def _factor(
    data: Yaml, known: Mapping[str, ArmParameter] | None, at: Place, quantities: Quantities
) -> tuple[tuple[str, tuple[float, ...]], ...]:
    given = checked_mapping(data, at, 'parameters to rows of L in L L^T')
    found = []
    for index, (name, item) in enumerate(given.items()):
        place = at[name]
        items = checked_list(item, place, 'a list of numbers, the row of L')
        if len(items) > index + 1:
            place.fault(
                f'{len(items)} numbers in row {index + 1} of L, which is lower triangular '
                f'(at most {index + 1})'
            )
        texts = [checked_number(one, place[k]) for k, one in enumerate(items)]
        if known is None:
            continue
        if name not in known:
            _unknown(name, place, known, ())
            continue
        kind = _kind(known[name])
        row = [quantities.fixed(text, kind, place[k], usual=False) for k, text in enumerate(texts)]
        found.append((name, tuple(value or 0.0 for value in row)))
    return tuple(found)


def _floor(data: Yaml, at: Place, quantities: Quantities) -> tuple[float, float]:
    if data is None:
        return 0.0, 0.0
    entry = checked(FloorEntry, data, at)
    return (
        _deviation(entry.xyz, 'length', at['xyz'], quantities),
        _deviation(entry.rpy, 'angle', at['rpy'], quantities),
    )
