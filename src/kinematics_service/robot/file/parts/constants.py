"""The constants of a robot file: names for numbers, each may use those above it."""

from collections.abc import Iterable
from typing import Any, NamedTuple

from ....errors import ExpressionError
from ..text.entries import checked_number
from ..text.expression_syntax import names_in, why_no_name
from ..text.expressions import Scope, parse_affine
from ..text.fault_report import Place, quoted, shown
from ..text.plain_expression import plain_expression
from .description import Constant
from .quantities import Units, check_finite

MAX_CONSTANTS = 256  # the table of a datasheet has a dozen


class Constants(NamedTuple):
    """The constants, the names of those that have faults, and every name they use."""

    constants: tuple[Constant, ...]
    unreadable: frozenset[str]
    used: frozenset[str]
    all_names_known: bool = True


NO_CONSTANTS = Constants((), frozenset(), frozenset())


def read_constants(data: Any, units: Units, variables: Iterable[str], at: Place) -> Constants:
    """Return the constants of a file in its order."""
    if data is None:
        return NO_CONSTANTS
    if not isinstance(data, dict):
        at.fault(f'expected a mapping of names to numbers, not {shown(data)}')
        return NO_CONSTANTS._replace(all_names_known=False)
    if len(data) > MAX_CONSTANTS:
        at.fault(f'{len(data)} constants (at most {MAX_CONSTANTS})')
        return NO_CONSTANTS._replace(all_names_known=False)
    values: dict[str, float] = {}
    constants: list[Constant] = []
    unreadable: set[str] = set()
    used: set[str] = set()
    moving = {
        name: f'{name!r} is a joint variable, and a constant is expected here'
        for name in variables
    }
    for name, value in data.items():
        if reason := why_no_name(name):
            at[name].fault(f'the name {quoted(name)} {reason}')
            continue
        text = checked_number(value, at[name])
        text = text and plain_expression(text, {*data, *moving}, units.angle, None)
        names = names_in(text or '')
        used |= names
        later = {
            other: f'{other!r} stands further down: a constant may use only those above it'
            for other in data
            if other not in values
        }
        later[name] = f'{name!r} is defined by itself'
        unreadable.add(name)
        if text is None or names & (unreadable - {name}):
            continue
        try:
            check_finite(text)
            affine = parse_affine(text, Scope(units.angle, dict(values), (), {**moving, **later}))
        except ExpressionError as error:
            at[name].fault(str(error))
            continue
        unreadable.remove(name)
        values[name] = affine.constant
        constants.append(Constant(name, text, affine.constant))
    return Constants(tuple(constants), frozenset(unreadable), frozenset(used))
