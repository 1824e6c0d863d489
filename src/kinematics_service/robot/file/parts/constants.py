# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read the constants of a robot file: numbers, or expressions of constants defined above them."""

import zlib
from collections.abc import Iterable
from typing import NamedTuple

from ....errors import ExpressionError
from ....typography import number_text
from ..text.entries import checked_mapping, checked_number, is_null
from ..text.expression_syntax import NameRefusal, names_in, why_no_name
from ..text.expressions import Scope, parse_affine
from ..text.fault_report import Place, quoted
from ..text.plain_expression import plain_expression
from ..text.yaml_document import Yaml
from .description import Constant
from .quantities import Units, check_finite

MAX_CONSTANTS = 256  # a datasheet has about ten constants


class Constants(NamedTuple):
    """
    The constants of a robot file. `constants` has the constants without faults, and `unreadable`
    the names of the constants with faults. `used` has all names in the expressions of constants.
    """

    constants: tuple[Constant, ...]
    unreadable: frozenset[str]
    used: frozenset[str]
    all_names_known: bool = True


NO_CONSTANTS = Constants((), frozenset(), frozenset())


def read_constants(data: Yaml, units: Units, variables: Iterable[str], at: Place) -> Constants:
    """Read the constants of a robot file in the order of the file, and report their faults."""
    if data is None:
        return NO_CONSTANTS
    given = checked_mapping(data, at, 'names to numbers')
    if len(given) > MAX_CONSTANTS:
        at.fault(f'{len(given)} constants (at most {MAX_CONSTANTS})', 'too-many')
    if not at.intact:
        return NO_CONSTANTS._replace(all_names_known=False)
    values: dict[str, float] = {}
    constants: list[Constant] = []
    unreadable: set[str] = set()
    used: set[str] = set()
    moving = {
        name: NameRefusal(f'{name!r} is a joint variable; write a constant here', 'not-constant')
        for name in variables
    }
    for name, value in given.items():
        if reason := why_no_name(name):
            at[name].fault(f'the name {quoted(name)} {reason.message}', reason.code)
            continue
        if is_null(value):
            values[name] = _stand_in(name, units)
            constants.append(Constant(name, number_text(values[name]), values[name], letter=True))
            continue
        text = checked_number(value, at[name])
        text = text and plain_expression(text, {*given, *moving}, units.angle, None)
        names = names_in(text or '')
        used |= names
        later = {
            other: NameRefusal(
                f'{other!r} comes later; write its line above this one', 'wrong-order'
            )
            for other in given
            if other not in values
        }
        later[name] = NameRefusal(f'{name!r} is defined by itself; write a number', 'circular')
        unreadable.add(name)
        if text is None or names & (unreadable - {name}):
            continue
        try:
            check_finite(text)
            affine = parse_affine(text, Scope(units.angle, dict(values), (), {**moving, **later}))
        except ExpressionError as error:
            at[name].fault(str(error), error.code)
            continue
        unreadable.remove(name)
        values[name] = affine.constant
        constants.append(Constant(name, text, affine.constant))
    return Constants(tuple(constants), frozenset(unreadable), frozenset(used))


def _stand_in(name: str, units: Units) -> float:
    # Return a substitute value, 0.2 to 0.8 m in the unit of the file, for a constant without a
    # value. The value is computed from a hash of the name, so that two constants have different
    # values.
    fraction = zlib.crc32(name.encode()) / 2**32
    return (0.2 + 0.6 * fraction) * (1000.0 if units.length == 'mm' else 1.0)
