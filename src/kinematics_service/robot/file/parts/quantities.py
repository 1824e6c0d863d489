# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read numbers and expressions of a robot file, and convert them to rad and m."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

from ....errors import ExpressionError
from ..text.expression_syntax import NameRefusal, names_in
from ..text.expressions import Affine, Expression, Scope, check_function, parse_affine
from ..text.fault_report import Place, number
from ..text.plain_expression import plain_expression
from .description import AngleUnit, JointType, LengthUnit

Kind = Literal['angle', 'length', 'number']

# Largest accepted number (m or rad); products of larger numbers may overflow.
LARGEST = 1e6
# Questions at the end of warnings about numbers that are implausible in the unit of the file.
DEGREES = 'are these degrees? (then: units: {angle: deg})'
RADIANS = 'are these radians? (then: units: {angle: rad})'
MILLIMETRES = 'are these millimetres? (then: units: {length: mm})'
METRES = 'are these metres? (then: units: {length: m})'
LARGEST_USUAL_LENGTH = 20.0  # m; a longer link is probably given in mm
# Largest plausible angle (rad): a whole turn, plus the round-off of two decimals.
LARGEST_USUAL_ANGLE = 2.0 * math.pi + 0.02
QUARTERS = [k * math.pi / 2.0 for k in range(1, 5)]
# In a file with degrees, a number such as 1.57 is probably in rad. This is assumed if its
# difference from pi/2, pi, 3 pi/2 or 2 pi is below this tolerance.
QUARTER_TOLERANCE = 0.005
# Matches numbers with 2 to 9 decimals, which may be rounded. Numbers with more decimals count as
# exact.
DECIMALS = re.compile(r'(?<![\w.])(\d\.(\d{2,9}))(?!\w)')

INFINITE = re.compile(r'[-+]?\.?(inf|Inf|INF)')
NOT_A_NUMBER = re.compile(r'[-+]?\.?(nan|NaN|NAN)')
WORDS_OF_YAML_1_1 = {
    word: NameRefusal(
        f'{word!r} is a word in YAML 1.2, not a number or truth value', 'not-a-number'
    )
    for word in ['yes', 'no', 'on', 'off', 'Yes', 'No', 'On', 'Off', 'YES', 'NO', 'ON', 'OFF']
}
KIND_OF: Mapping[JointType, Kind] = {
    'revolute': 'angle',
    'prismatic': 'length',
    'helical': 'angle',
}


def check_finite(text: str) -> None:
    """
    Raise an error for a text that means infinity or not-a-number in YAML.

    Raises
    ------
    ExpressionError
        The text is such a word, for example `.inf` or `nan`.
    """
    if INFINITE.fullmatch(text):
        raise ExpressionError(f"'{text}' is accepted only in limits", code='not-finite')
    if NOT_A_NUMBER.fullmatch(text):
        raise ExpressionError(f"'{text}' is not a finite number", code='not-finite')


class Units(NamedTuple):
    """The units of angles and lengths in a robot file."""

    angle: AngleUnit = 'rad'
    length: LengthUnit = 'm'

    def to_si(self, value: float, kind: Kind) -> float:
        """Convert an angle to rad, or a length to m; a plain number is unchanged."""
        if kind == 'angle' and self.angle == 'deg':
            return math.radians(value)
        if kind == 'length' and self.length == 'mm':
            return value / 1000.0
        return value


@dataclass(frozen=True)
class Quantities:
    """
    The reader of the numbers and expressions of one file.

    Parameters
    ----------
    top
        Names the whole file in fault messages. With keys, as in `top['links'][2]`, it names a part
        of the file.
    units
        The units of the file.
    constants
        The values of the constants by name, in the file's units.
    joint_types
        The types of the joint variables that expressions may contain, by variable; joints whose
        type has a fault are missing.
    types
        The type of each joint in the file's list `joints`; None if the type has a fault.
    unreadable
        Names of joints and constants whose definition has a fault. An expression with such a name
        has no value.
    all_names_known
        False if the name of a joint or constant cannot be read, because of a fault. In this case
        unknown names in expressions are not reported, because one of them may be the missing name.
    used
        Names in the expressions read so far.
    strange
        Names in the expressions read so far that the file does not define.
    letters
        Names of constants without a value. An expression with one of these names has no known
        value, so its unit is not checked.
    """

    top: Place
    units: Units
    constants: Mapping[str, float]
    joint_types: Mapping[str, JointType]
    types: Sequence[JointType | None] = ()
    unreadable: frozenset[str] = frozenset()
    all_names_known: bool = True
    used: set[str] = field(default_factory=set)
    strange: set[str] = field(default_factory=set)
    letters: frozenset[str] = frozenset()

    def fixed(
        self, text: str | None, kind: Kind, at: Place, *, usual: bool = True
    ) -> float | None:
        """
        Return the value of a constant expression in SI units. Report faults; after a fault return
        None.

        If `usual` is true, warn of an implausible length, or of an angle of more than a turn.
        """
        expression = self._read(text, kind, at, self._scope(kind), usual)
        return expression.affine.constant if expression else None

    def above_zero(
        self, text: str | None, kind: Kind, at: Place, *, usual: bool = False
    ) -> float | None:
        """Return the value of a constant expression in SI units if it is above 0, else None."""
        value = self.fixed(text, kind, at, usual=usual)
        if value is not None and value <= 0.0:
            at.fault(f'must be above 0, not {text}', 'out-of-range')
            return None
        return value

    def positions(self, texts: Sequence[str | None] | None, at: Place) -> tuple[float, ...]:
        """
        Return the positions, rad or m, of all joints whose types have no fault.

        If the file has more or fewer values than joints, report a fault and return no positions.
        """
        if texts is not None and self.types and len(texts) != len(self.types):
            at.fault(f'{len(texts)} values for {len(self.types)} joints', 'wrong-length')
            return ()
        values = [
            self.fixed(text, KIND_OF[joint_type], at[index], usual=False)
            for index, (text, joint_type) in enumerate(zip(texts or (), self.types))
            if joint_type
        ]
        return tuple(value for value in values if value is not None)

    def fixed_expression(
        self, text: str | None, kind: Kind, at: Place, advice: str = ''
    ) -> Expression | None:
        """
        Return a constant expression as text and value. Report faults; after a fault return None.

        `advice` is added to the message about a joint variable in a constant expression.
        """
        return self._read(text, kind, at, self._scope(kind, advice=advice))

    def moving(self, text: str | None, kind: Kind, at: Place, quantity: str) -> Expression | None:
        """
        Return an expression that is linear in the joint variables. Report faults; after a fault
        return None.

        `quantity` is the name of the expression in messages, such as `theta` or `Tx`.
        """
        scope = self._scope(kind, moving=True)
        expression = self._read(text, kind, at, scope, usual=False)
        for variable, _ in expression.affine.coefficients if expression else ():
            joint_type = self.joint_types[variable]
            if joint_type != 'helical' and KIND_OF[joint_type] != kind:
                article = 'an angle' if kind == 'angle' else 'a length'
                at.fault(
                    f'{variable!r} is {joint_type}, and {quantity} is {article}; a joint that '
                    "turns and slides is 'type: helical' and is in both",
                    'wrong-joint-type',
                )
                return None
        if expression:
            self._warn_of_units(expression, kind, at)
        return expression

    def function(self, text: str | None, at: Place) -> str | None:
        """
        Return the text of a valid expression, which may be nonlinear in the joint variables.

        If the expression has a fault, report the fault and return None.
        """
        scope = self._scope(None, moving=True)
        try:
            text = text and self._plain(text, scope)
            if text is None or not self._is_evaluable(text, scope):
                return None
            check_function(text, scope)
        except ExpressionError as error:
            at.fault(str(error), error.code)
            return None
        return text

    def _scope(self, kind: Kind | None, moving: bool = False, advice: str = '') -> Scope:
        refused = dict(WORDS_OF_YAML_1_1)
        for name in () if moving else self.joint_types:
            message = f'{name!r} is a joint variable; write a constant here{advice}'
            refused[name] = NameRefusal(message, 'not-constant')
        variables = tuple(self.joint_types) if moving else ()
        quantity = None if kind is None else int(kind == 'angle')
        return Scope(self.units.angle, self.constants, variables, refused, quantity)

    def _plain(self, text: str, scope: Scope) -> str:
        known = {*self.constants, *self.joint_types, *self.unreadable}
        return plain_expression(text, known, self.units.angle, scope.quantity)

    def _is_evaluable(self, text: str, scope: Scope) -> bool:
        # Return whether all names of an expression are defined without faults, so that the
        # expression can be evaluated. Otherwise check only the syntax of the expression, and
        # return False.
        names = names_in(text)
        self.used.update(names)
        strange = names.difference(scope.known, scope.refused, self.unreadable, ('pi',))
        self.strange.update(strange)
        hidden = names & self.unreadable
        if not self.all_names_known:
            hidden |= strange
        if not hidden:
            return True
        # `hidden` has names whose definitions have faults. Such a name may be a joint variable, so
        # accept all names in `hidden` as joint variables.
        varying = tuple(dict.fromkeys((*scope.variables, *sorted(hidden))))
        refused = {name: refusal for name, refusal in scope.refused.items() if name not in hidden}
        check_function(text, replace(scope, variables=varying, refused=refused, quantity=None))
        return False

    def _read(
        self, text: str | None, kind: Kind, at: Place, scope: Scope, usual: bool = True
    ) -> Expression | None:
        if text is None:
            return None
        try:
            check_finite(text)
            text = self._plain(text, scope)
            if not self._is_evaluable(text, scope):
                return None
            affine = self._in_si(parse_affine(text, scope), kind)
            _check_size(affine, kind)
        except ExpressionError as error:
            at.fault(str(error), error.code)
            return None
        expression = Expression(text, affine)
        if usual:
            self._warn_of_units(expression, kind, at)
        return expression

    def _in_si(self, affine: Affine, kind: Kind) -> Affine:
        coefficients = []
        for variable, factor in affine.coefficients:
            joint_kind = KIND_OF[self.joint_types[variable]]
            if joint_kind != kind:
                # If a length such as d contains the angle of a helical joint, the coefficient of
                # the angle is a length per angle. If an angle contains a length, the coefficient
                # of the length is an angle per length.
                factor = self.units.to_si(factor, kind) / self.units.to_si(1.0, joint_kind)
            coefficients.append((variable, factor))
        return Affine(self.units.to_si(affine.constant, kind), tuple(coefficients))

    def warn_of_length(
        self, length: float, smallest: float, largest: float, words: str, at: Place
    ) -> None:
        """
        Warn if a length, m, shows that the file probably has the wrong unit (m or mm).

        Lengths from `smallest` to `largest` are plausible. In the text `words`, {} is replaced by
        the length and its unit.
        """
        if self.units.length == 'm' and largest < length < math.inf:
            at.warn(f'{words.format(f"{number(length)} m")}: {MILLIMETRES}', 'wrong-unit')
        if self.units.length == 'mm' and 0.0 < length < smallest:
            at.warn(f'{words.format(f"{number(length * 1e3)} mm")}: {METRES}', 'wrong-unit')

    def _warn_of_units(self, expression: Expression, kind: Kind, at: Place) -> None:
        value = expression.affine.constant
        if self.letters & names_in(expression.text):
            return
        if getattr(self.units, kind, '') in ('m', 'rad') and (doubt := unit_doubt(value, kind)):
            at.warn(doubt, 'wrong-unit')
        if kind == 'angle' and self.units.angle == 'rad' and at.path[0] == 'links':
            for digits, k in rounded_quarters(expression.text):
                part = 'pi' if k == 2 else '2*pi' if k == 4 else f'{k}*pi/2'.removeprefix('1*')
                at.remark(
                    f'{digits} looks like {part} rounded: then write {part} (or --round-angles)'
                )
        if kind == 'angle' and self.units.angle == 'deg' and at.path[0] != 'known_poses':
            degrees = math.degrees(value)
            if any(abs(abs(degrees) - quarter) < QUARTER_TOLERANCE for quarter in QUARTERS):
                at.warn(f'{number(degrees)} deg: {RADIANS}', 'wrong-unit')


def unit_doubt(
    value: float,
    kind: Kind,
    longest: float = LARGEST_USUAL_LENGTH,
    degrees: str = DEGREES,
    millimetres: str = MILLIMETRES,
) -> str:
    """
    Return a warning about the unit of an implausible number (m or rad); '' for a plausible number.

    `longest` is the largest plausible length, m. The warning ends with the question `degrees` or
    `millimetres`.
    """
    if kind == 'length' and abs(value) > longest:
        return f'a length of {number(value)} m: {millimetres}'
    if kind == 'angle' and abs(value) > LARGEST_USUAL_ANGLE:
        return f'{number(value)} rad is more than a turn: {degrees}'
    return ''


def rounded_quarters(text: str) -> Iterator[tuple[str, int]]:
    """
    Find rounded multiples of pi/2, such as 1.57, in a text. Yield each number as text, and k.

    The number is k pi/2, rounded or cut off, where k is 1, 2, 3 or 4.
    """
    for digits, decimals in DECIMALS.findall(text):
        for k, quarter in enumerate(QUARTERS, 1):
            cut = math.floor(quarter * 10 ** len(decimals)) / 10 ** len(decimals)
            if float(digits) in (cut, round(quarter, len(decimals))):
                yield digits, k


def _check_size(affine: Affine, kind: Kind) -> None:
    unit = {'angle': 'rad', 'length': 'm', 'number': ''}[kind]
    for value in (affine.constant, *(factor for _, factor in affine.coefficients)):
        if unit and abs(value) > LARGEST:
            message = f'{number(value)} {unit} is too large (at most {LARGEST:g} {unit})'
            raise ExpressionError(message, code='out-of-range')
