# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write the factors of a determinant as texts of a robot file. Compare the product of a file's
factors with the determinant.
"""

import numpy as np
import sympy
from sympy.printing.str import StrPrinter

from ....errors import DerivationError, ExpressionError
from ....robot.file.reader import parse_robot
from ....robot.file.text.expression_syntax import MAX_CHARACTERS, syntax_tree
from ....robot.robot import Robot, build_robot
from .derivation import Derivation
from .singular_set import evaluated, file_factors

# The product of a file's factors equals the determinant if their relative difference is at most
# this, the round-off of a few dozen operations.
AGREEMENT = 1e-12
POSES = 1000


class DecimalPrinter(StrPrinter):  # type: ignore[misc]
    """A printer of sympy strings that keeps decimals of the robot file as decimals."""

    def _print_Rational(self, expr: sympy.Expr) -> str:
        return decimal(expr) or f'{expr.p}/{expr.q}'


class FilePrinter(DecimalPrinter):
    """
    A printer of sympy expressions in the syntax of robot files, with products instead of powers,
    and with decimals.
    """

    def _print_Pow(self, expr: sympy.Expr, rational: bool = False) -> str:
        base, exponent = expr.as_base_exp()
        if exponent == sympy.Rational(1, 2):
            return f'sqrt({self._print(base)})'
        if exponent.is_Integer and 1 < abs(int(exponent)) <= 8:
            factor = self.parenthesize(base, 100)
            product = '*'.join([factor] * abs(int(exponent)))
            return product if exponent > 0 else f'1/({product})'
        if exponent == -1:
            return f'1/{self.parenthesize(base, 100)}'
        message = f'{expr} cannot be written in a robot file: no roots and high powers'
        raise DerivationError(message, code='unsupported')

    def _print_atan(self, expr: sympy.Expr) -> str:
        return f'atan2({self._print(expr.args[0])}, 1)'


def decimal(number: sympy.Expr) -> str | None:
    """Return a fraction as an exact decimal text, or None if it has no short decimal."""
    q = int(number.q)
    for prime in (2, 5):
        while q % prime == 0:
            q //= prime
    text = f'{float(number):.15g}'
    short = q == 1 and 'e' not in text and sympy.Rational(text) == number
    return text if short else None


def file_text(expression: sympy.Expr, degrees: bool) -> str:
    """
    Return a sympy expression as text in the syntax of robot files, with angles in degrees if
    `degrees`.

    Raises
    ------
    DerivationError
        The expression has no form in a robot file, or is too long.
    """
    if degrees:
        functions = expression.atoms(sympy.sin, sympy.cos)
        expression = expression.xreplace({f: f.func(_in_degrees(f.args[0])) for f in functions})
    text = str(FilePrinter().doprint(expression))
    if degrees and expression.has(sympy.pi):
        message = f'{text} cannot be written in a file in degrees: it contains pi'
        raise DerivationError(message, code='unsupported')
    try:
        syntax_tree(text, lambda _: None)
    except ExpressionError as error:
        limit = f'at most {MAX_CHARACTERS} characters' if len(text) > MAX_CHARACTERS else ''
        message = f'not an expression of a robot file: {error} {limit}'.strip()
        raise DerivationError(message, code=error.code) from None
    return text


def _in_degrees(angle: sympy.Expr) -> sympy.Expr:
    # Convert only the constant part of an angle from rad to degrees, because the joint variables
    # of the file are in degrees already.
    offset, moving = angle.as_independent(*angle.free_symbols, as_Add=True)
    return moving + offset * 180 / sympy.pi


def factors_to_write(derivation: Derivation) -> dict[str, str]:
    """
    Return the factors of a derivation by name, as texts of its robot file.

    A factor that the file lists keeps its name and text. Any other factor has the name of its
    singular poses (such as elbow), or its expression as name. If the expression is long, the name
    is `determinant` or `factor_` with a number.
    """
    degrees = derivation.robot.description.angle_unit == 'deg'
    texts: dict[str, str] = {}
    listed = derivation.robot.description.singularity.factors
    kept = {factor.name: factor.text for factor in listed}
    for factor in derivation.singular_set.factors:
        name = factor.name
        if name == str(factor.expression):
            name = name if len(name) <= 24 else 'determinant'
            name = name if name not in texts else f'factor_{len(texts) + 1}'
        texts[name] = kept.get(name) or file_text(factor.expression, degrees)
    return dict(sorted(texts.items(), key=lambda pair: [*kept, pair[0]].index(pair[0])))


def disagreement(derivation: Derivation, robot: Robot) -> float:
    """
    Return the largest relative difference between the product of a file's factors and the
    determinant.

    In the product, each factor has the exponent that it has in the determinant. The product may be
    the determinant times a constant. Product and determinant are compared at 1000 seeded
    configurations inside the joint limits. If the task rows are not square, the product is
    compared with the common factors of all minors.
    """
    exact = derivation.exact
    q = exact.sampler.random(POSES, within=True)
    expressions = file_factors(robot, derivation.names)
    product = reference = np.ones(len(q))
    for factor in derivation.singular_set.factors:
        named = expressions.get(factor.name)
        ratios = ((e, sympy.simplify(e / factor.expression)) for e in expressions.values())
        alike = (e for e, ratio in ratios if ratio.is_number)
        listed = next(alike, None) if named is None else named
        if listed is None:
            return float('inf')
        product = product * evaluated(listed, derivation.names, q) ** factor.power
        reference = reference * evaluated(factor.expression, derivation.names, q) ** factor.power
    if derivation.singular_set.determinant.square:
        reference = np.linalg.det(exact.sampler.arm(q).J_t)
    if not derivation.singular_set.factors:
        return 0.0
    best = int(np.argmax(np.abs(reference)))
    constant = product[best] / reference[best]
    error = np.abs(product - constant * reference)
    return float(np.max(error) / np.max(np.abs(product)))


def checked_text(derivation: Derivation, text: str) -> None:
    """
    Raise an error if the factors in a robot file's text are not those of the determinant.

    Raises
    ------
    RobotFileError
        The text is not a valid robot file.
    DerivationError
        The product of the text's factors is not the determinant.
    """
    description = parse_robot(text, derivation.robot.description.file)
    robot = build_robot(description, in_letters=True)
    error = disagreement(derivation, robot)
    if not error <= AGREEMENT:
        raise DerivationError(
            f'the product of the factors is {error:.1e} from the determinant at {POSES} poses '
            f'(at most {AGREEMENT:g}): the file is left as it was',
            code='mismatch',
        )
