"""
Numbers and expressions of a robot file, turned into rad and m.

"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from .description import AngleUnit, JointType, LengthUnit
from .errors import ExpressionError
from .expression_syntax import names_in
from .expressions import Affine, Expression, Scope, check_function, parse_affine
from .fault_report import FaultReport, number
from .yaml_document import Path

Kind = Literal['angle', 'length', 'number']

# Beyond a thousand kilometres or 1e6 rad there is no arm, and products of such numbers overflow.
LARGEST = 1e6
INFINITE = re.compile(r'[-+]?\.?(inf|Inf|INF)')
NOT_A_NUMBER = re.compile(r'[-+]?\.?(nan|NaN|NAN)')
WORDS_OF_YAML_1_1 = ('yes', 'no', 'on', 'off', 'Yes', 'No', 'On', 'Off', 'YES', 'NO', 'ON', 'OFF')
KIND_OF: Mapping[JointType, Kind] = {
    'revolute': 'angle',
    'prismatic': 'length',
    'helical': 'angle',
}


def why_not_finite(text: str) -> str | None:
    """
    Return why YAML's words for infinity and not-a-number may not stand here, or None.

    """
    if INFINITE.fullmatch(text):
        return f"'{text}' is accepted only in limits"
    return f"'{text}' is not a finite number" if NOT_A_NUMBER.fullmatch(text) else None


@dataclass(frozen=True)
class Units:
    """
    What the numbers of a file are written in.

    """

    angle: AngleUnit = 'rad'
    length: LengthUnit = 'm'

    def to_si(self, value: float, kind: Kind) -> float:
        """
        Return a value of the file in rad, m, or as it is.

        """
        if kind == 'angle' and self.angle == 'deg':
            return math.radians(value)
        if kind == 'length' and self.length == 'mm':
            return value / 1000.0
        return value


@dataclass(frozen=True)
class Quantities:
    """
    Everything an expression of one file may mean.

    Parameters
    ----------
    report
        Takes the faults.
    units
    constants
        Values in the file's units.
    joint_types
        By joint variable, in the order of the joints.
    unreadable
        Names whose own definition has a fault: what uses them is not judged.
    all_names_known
        False where a broken entry hides its name: no name is then called unknown.
    used
        Names met so far.

    """

    report: FaultReport
    units: Units
    constants: Mapping[str, float]
    joint_types: Mapping[str, JointType]
    unreadable: frozenset[str] = frozenset()
    all_names_known: bool = True
    used: set[str] = field(default_factory=set)

    def fixed(self, text: str | None, kind: Kind, path: Path, advice: str = '') -> float | None:
        """
        Return a constant in SI units, or None with its fault reported.

        `advice` follows the sentence that says a joint variable may not stand here.
        """
        expression = self.fixed_expression(text, kind, path, advice)
        return expression.affine.constant if expression else None

    def fixed_expression(
        self, text: str | None, kind: Kind, path: Path, advice: str = ''
    ) -> Expression | None:
        """
        Return a constant with its text, or None with its fault reported.

        """
        refused = {
            name: f'{name!r} is a joint variable, and a constant is expected here{advice}'
            for name in self.joint_types
        }
        return self._expression(text, kind, path, self._scope((), refused, kind))

    def moving(self, text: str | None, kind: Kind, path: Path, place: str) -> Expression | None:
        """
        Return an expression linear in the joint variables, or None with its fault reported.

        `place` is what the message calls the spot: `theta`, `d`, `Tx`.
        """
        scope = self._scope(tuple(self.joint_types), {}, kind)
        expression = self._expression(text, kind, path, scope)
        for variable, _ in expression.affine.coefficients if expression else ():
            joint_type = self.joint_types[variable]
            if joint_type != 'helical' and KIND_OF[joint_type] != kind:
                article = 'an angle' if kind == 'angle' else 'a length'
                self.report.fault(
                    path,
                    f'{variable!r} is {joint_type}, and {place} is {article}; a joint that both '
                    "turns and slides is 'type: helical' and stands in both",
                )
                return None
        return expression

    def function(self, text: str | None, path: Path) -> str | None:
        """
        Return the text of an expression that may be nonlinear, or None with its fault reported.

        """
        scope = self._scope(tuple(self.joint_types), {})
        if text is None or not self._judged(text, scope):
            return None
        try:
            check_function(text, scope)
        except ExpressionError as error:
            self.report.fault(path, str(error))
            return None
        return text

    def _scope(
        self, variables: tuple[str, ...], refused: Mapping[str, str], kind: Kind | None = None
    ) -> Scope:
        words = {
            word: f'{word!r} is a word in YAML 1.2, neither a number nor a truth value'
            for word in WORDS_OF_YAML_1_1
        }
        angles = frozenset(
            name for name, joint_type in self.joint_types.items() if joint_type != 'prismatic'
        )
        wanted = None if kind is None else int(kind == 'angle')
        return Scope(
            self.units.angle, self.constants, variables, {**words, **refused}, angles, wanted
        )

    def _judged(self, text: str, scope: Scope) -> bool:
        names = names_in(text)
        self.used.update(names)
        if names & self.unreadable:
            return False
        strange = names.difference(scope.known, scope.refused, ('pi',))
        return self.all_names_known or not strange

    def _expression(
        self, text: str | None, kind: Kind, path: Path, scope: Scope
    ) -> Expression | None:
        if text is None:
            return None
        if reason := why_not_finite(text):
            self.report.fault(path, reason)
            return None
        if not self._judged(text, scope):
            return None
        try:
            affine = self._in_si(parse_affine(text, scope), kind)
        except ExpressionError as error:
            self.report.fault(path, str(error))
            return None
        if not self._sized(affine, kind, path):
            return None
        return Expression(text, affine)

    def _in_si(self, affine: Affine, kind: Kind) -> Affine:
        coefficients = []
        for variable, factor in affine.coefficients:
            own = KIND_OF[self.joint_types[variable]]
            if own != kind:
                # A helical joint in d: length per angle.
                factor = self.units.to_si(factor, kind) / self.units.to_si(1.0, own)
            coefficients.append((variable, factor))
        return Affine(self.units.to_si(affine.constant, kind), tuple(coefficients))

    def _sized(self, affine: Affine, kind: Kind, path: Path) -> bool:
        if kind == 'number':
            return True
        unit = 'rad' if kind == 'angle' else 'm'
        for value in (affine.constant, *(factor for _, factor in affine.coefficients)):
            if abs(value) > LARGEST:
                message = (
                    f'{number(value)} {unit} is beyond every arm (at most {LARGEST:g} {unit})'
                )
                self.report.fault(path, message)
                return False
        return True
