"""
The names of a robot file as sympy symbols, and what units its expressions are in.

Lengths stay in the file's unit and joint angles are in rad, so that a Jacobian column of a `deg`
file is per rad like every other.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import sympy

from ...errors import DerivationError
from ...robot.file.parts.description import (
    RigidMotion,
    RobotDescription,
    ShapeRow,
)
from ...robot.file.text.expression_syntax import names_in
from .expression import exact


@dataclass(frozen=True)
class Names:
    """
    What the names of a file mean.

    Attributes
    ----------
    variables
        A symbol a joint, in the order of the Jacobian's columns; rad, or the file's length unit.
    lengths
        The constants that stay symbols.
    values
        The value of each of them, in the file's units.
    meanings
        What stands for each name of the file: a symbol, or the expression of a constant that is
        made of others or turns up in an angle.
    angle_unit
        'rad' or 'deg'.
    """

    variables: tuple[Any, ...]
    lengths: tuple[Any, ...]
    values: Mapping[Any, float]
    meanings: Mapping[str, Any]
    angle_unit: str

    def expression(self, text: str) -> Any:
        """Return what a text says, in the file's units."""
        return exact(text, self.meanings, self.angle_unit)

    def angle(self, text: str) -> Any:
        """Return a constant angle, rad."""
        return self._in_rad(self.expression(text))

    def affine(self, text: str, is_angle: bool) -> tuple[Any, dict[Any, Any]]:
        """Return the constant part, and the factor of each joint variable."""
        expression = sympy.expand(self.expression(text))
        factors = {
            symbol: factor
            for symbol in self.variables
            if (factor := expression.coeff(symbol)) != 0
        }
        rest = expression.subs(dict.fromkeys(factors, 0))
        return (self._in_rad(rest) if is_angle else rest), factors

    def _in_rad(self, angle: Any) -> Any:
        return angle * sympy.pi / 180 if self.angle_unit == 'deg' else angle


def names_of(description: RobotDescription, locked: Mapping[str, str] | None = None) -> Names:
    """
    Return the names of a robot file.

    Parameters
    ----------
    description
        The file.
    locked
        Joint variables that do not move, with the expression that stands in their place.
    """
    locked = dict(locked or {})
    known = [joint.variable for joint in description.joints]
    for name in locked:
        if name not in known:
            raise DerivationError(
                f'no joint variable {name!r} to lock (known: {", ".join(known)})'
            )
    in_angles = _names_in_angles(description)
    meanings: dict[str, Any] = {}
    values: dict[Any, float] = {}
    for constant in description.constants:
        derived = exact(constant.text, meanings, description.angle_unit)
        if constant.value == 0.0 or constant.name in in_angles or derived.free_symbols:
            meanings[constant.name] = derived
            continue
        symbol = sympy.Symbol(constant.name, real=True)
        meanings[constant.name] = symbol
        values[symbol] = constant.value
    variables = []
    for name in known:
        if name in locked:
            meanings[name] = exact(locked[name], meanings, description.angle_unit)
        else:
            symbol = sympy.Symbol(name, real=True)
            meanings[name] = symbol
            variables.append(symbol)
    if not variables:
        raise DerivationError('every joint is locked')
    return Names(tuple(variables), tuple(values), values, meanings, description.angle_unit)


def _names_in_angles(description: RobotDescription) -> set[str]:
    # Constants used as an angle take their value: only lengths are kept as symbols.
    texts: list[str] = []

    def motion(given: RigidMotion) -> None:
        texts.extend(_rotation_texts(given))

    for link in description.links:
        texts += [one.argument.text for one in link.motions if one.turns]
        if isinstance(link, ShapeRow):
            motion(link.inner)
            motion(link.outer)
    motion(description.base.motion)
    motion(description.tool.motion)
    found = set().union(*(names_in(text) for text in texts))
    # The constants that a constant is made of are used as an angle, too.
    for constant in reversed(description.constants):
        if constant.name in found:
            found |= names_in(constant.text)
    return found


def _rotation_texts(motion: RigidMotion) -> tuple[str, ...]:
    if len(motion.texts) == 6:
        return motion.texts[3:]
    return tuple(text for k, text in enumerate(motion.texts) if k % 4 != 3 and k < 12)
