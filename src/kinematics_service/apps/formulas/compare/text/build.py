# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Build a sympy expression or matrix from the tree of a formula; only known operations are accepted.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import TypeAlias

import sympy as sp

from .....errors import FormulaError
from .....robot.file.text.expression_syntax import folded
from ...arm.table import inverse_pose
from .syntax import LARGE_MATRIX, MAX_MATRIX_ENTRIES, PARTS, Node
from .tokens import FormulaToken

Value: TypeAlias = sp.Expr | sp.ImmutableDenseMatrix
Lookup: TypeAlias = Callable[[FormulaToken], Value]
ReadNumber: TypeAlias = Callable[[str, FormulaToken], Value]

# Limits of the numbers, powers and nested function calls in a formula, because a formula beyond
# these limits would take minutes.
MAX_DIGITS = 40
MAX_EXPONENT = 24
MAX_NUMBER_BITS = 4096
MAX_POWER = 1000
MAX_CALL_DEPTH = 12
LARGE_NUMBER = f'the number has more than {MAX_NUMBER_BITS} bits; write a smaller one'
# A rounded multiple of pi/12 with at least this many decimals, such as 1.5708, is read as the
# exact multiple.
MIN_PI_DECIMALS = 4
TWELFTHS = tuple(k for k in range(1, 49) if k % 12 == 0 or k <= 24)


def build(node: Node, lookup: Lookup, read: ReadNumber) -> Value:
    """
    Return the expression or matrix of a formula's tree.

    Parameters
    ----------
    node
        The tree of the formula.
    lookup
        Function that returns the value of a name.
    read
        Function that returns the value of a number, for example `number`.

    Raises
    ------
    FormulaError
        Shapes do not fit, a name is unknown, or a number is out of bounds.
    """
    return folded(node, PARTS, lambda part, parts: _combined(part, parts, lookup, read))


def _combined(node: Node, parts: list[Value], lookup: Lookup, read: ReadNumber) -> Value:
    if node.kind == 'number':
        return read(node.text, node.at)
    if node.kind == 'name':
        return lookup(node.at)
    if node.kind == 'matrix':
        return _stacked(node, parts)
    if node.kind == 'call':
        return _real(node, _called(node, parts))
    parts = [_unwrapped(part) for part in parts]
    try:
        value = _OPERATIONS[node.kind](node, *parts)
    except FormulaError:
        raise
    except (sp.ShapeError, ValueError, TypeError, NotImplementedError) as error:
        reason = str(error) or type(error).__name__
        message = f'{node.at.written!r} cannot be computed here: {reason}'
        raise node.at.fault(message, 'unsupported') from None
    _refuse_large(node, value)
    return _real(node, value) if node.kind == '^' else value


def _refuse_large(node: Node, value: Value) -> None:
    # Refuse large numbers early, because each repeated squaring doubles the number of digits.
    for entry in value if is_matrix(value) else (value,):
        for factor in sp.Mul.make_args(entry):
            if factor.is_Rational and _bits(factor) > MAX_NUMBER_BITS:
                raise node.at.fault(LARGE_NUMBER, 'too-large')
            if factor.is_Pow and factor.exp.is_Rational and abs(factor.exp) > MAX_POWER:
                message = f'the power is higher than {MAX_POWER}; write a lower one'
                raise node.at.fault(message, 'too-large')


def _bits(number: Value) -> int:
    return int(number.p).bit_length() + int(number.q).bit_length()


def _real(node: Node, value: Value) -> Value:
    if not is_matrix(value) and value.has(sp.I):
        name = node.text or node.at.written
        raise node.at.fault(f'{name} is not a real number here; check its argument', 'not-real')
    return value


def is_matrix(value: Value) -> bool:
    """Return whether a value is a matrix, not a scalar."""
    return isinstance(value, sp.MatrixBase)


def number(text: str, at: FormulaToken) -> Value:
    """
    Return an exact number: decimals become fractions, and rounded multiples of pi become exact.

    Raises
    ------
    FormulaError
        The number has too many digits or too large an exponent.
    """
    mantissa, _, exponent = text.lower().partition('e')
    if len(mantissa) > MAX_DIGITS or len(exponent) > 3 or abs(int(exponent or 0)) > 60:
        message = f'the number has more than {MAX_DIGITS} digits, or is beyond 1e60; round it'
        raise at.fault(message, 'too-large')
    digits = len(mantissa.partition('.')[2])
    if digits >= MIN_PI_DECIMALS and not exponent:
        for k in TWELFTHS:
            multiple = sp.pi * k / 12
            rounded, cut = f'{float(multiple):.{digits}f}', f'{float(multiple):.16f}'
            if mantissa in (rounded, cut[: len(rounded)]):
                return multiple
    return sp.Rational(text)


def _unwrapped(value: Value) -> Value:
    return value[0, 0] if is_matrix(value) and value.shape == (1, 1) else value


def _stacked(node: Node, parts: list[Value]) -> Value:
    if sum(len(part) if is_matrix(part) else 1 for part in parts) > MAX_MATRIX_ENTRIES:
        raise node.at.fault(LARGE_MATRIX, 'too-large')
    rows, at = [], 0
    for length in node.rows:
        blocks = [part if is_matrix(part) else sp.Matrix([[part]]) for part in parts[at:][:length]]
        if len({block.rows for block in blocks}) > 1:
            heights = ', '.join(str(block.rows) for block in blocks)
            message = f'the blocks of a row have {heights} rows; write blocks of one height'
            raise node.at.fault(message, 'wrong-shape')
        rows.append(sp.Matrix.hstack(*blocks))
        at += length
    if len({row.cols for row in rows}) > 1:
        widths = ', '.join(str(row.cols) for row in rows)
        message = f'the rows of the matrix have {widths} entries; write rows of one length'
        raise node.at.fault(message, 'wrong-shape')
    return sp.ImmutableDenseMatrix(sp.Matrix.vstack(*rows))


def _added(node: Node, *terms: Value) -> Value:
    if not any(map(is_matrix, terms)):
        return sp.Add(*terms)  # one call, because adding term by term takes quadratic time
    total, *others = terms
    for other in others:
        if is_matrix(total) != is_matrix(other):
            message = f'{node.at.written!r} between a matrix and a number; write two matrices'
            raise node.at.fault(message, 'wrong-shape')
        if total.shape != other.shape:
            sizes = f'{_size(total)} and {_size(other)}'
            message = f'{node.at.written!r} between matrices of {sizes}; write one size'
            raise node.at.fault(message, 'wrong-shape')
        total += other
    return total


def _size(matrix: Value) -> str:
    return f'{matrix.rows} x {matrix.cols}'


def _multiplied(node: Node, left: Value, right: Value) -> Value:
    if is_matrix(left) and is_matrix(right) and left.cols != right.rows:
        if left.cols == right.cols and right.rows == 1:
            right = right.T  # read R [a, 0, 0] as R [a, 0, 0]^T
        else:
            sizes = f'{_size(left)} and {_size(right)}'
            message = f'a product of matrices of {sizes}'
            advice = 'write as many columns as the next has rows'
            raise node.at.fault(f'{message}; {advice}', 'wrong-shape')
    return left * right


def _divided(node: Node, numerator: Value, divisor: Value) -> Value:
    if is_matrix(divisor):
        message = 'division by a matrix; multiply by its inverse, as in A*inv(B)'
        raise node.at.fault(message, 'unsupported')
    if divisor == 0:
        raise node.at.fault('division by zero', 'division-by-zero')
    return numerator / divisor


def _powered(node: Node, base: Value, exponent: Value) -> Value:
    if is_matrix(base):
        if exponent != -1 or base.rows != base.cols:
            message = 'only a square matrix has a power, ^-1; write T_23 for frame 3 in frame 2'
            raise node.at.fault(message, 'unsupported')
        return _inverse(node, base)
    if not (exponent.is_Rational and abs(exponent) <= MAX_EXPONENT and exponent.q <= 4):
        message = f'an exponent must be a number of at most {MAX_EXPONENT}'
        raise node.at.fault(message, 'out-of-range')
    if base == 0 and exponent < 0:
        raise node.at.fault('division by zero', 'division-by-zero')
    bits = _bits(base) if base.is_Rational else 1
    if bits * abs(exponent) > MAX_NUMBER_BITS:
        raise node.at.fault(LARGE_NUMBER, 'too-large')
    return base**exponent


def _crossed(node: Node, left: Value, right: Value) -> Value:
    if is_matrix(left) and is_matrix(right):
        if len(left) != 3 or len(right) != 3:
            message = f'a cross product of {_size(left)} and {_size(right)}; both must be 3 x 1'
            raise node.at.fault(message, 'wrong-shape')
        return left.reshape(3, 1).cross(right.reshape(3, 1))
    return left * right  # `\times` between numbers, as in `2 \times 3`, is a product


def _transposed(node: Node, value: Value) -> Value:
    return value.T if is_matrix(value) else value


def _inverse(node: Node, matrix: Value) -> Value:
    if not is_matrix(matrix):
        return 1 / matrix
    if matrix.rows == matrix.cols == 4 and matrix.row(3) == sp.Matrix([[0, 0, 0, 1]]):
        # Invert the matrix as a pose, without symbolic elimination. If the rotation part is not
        # orthogonal, the inverse is wrong, and the comparison reports a difference.
        return sp.ImmutableDenseMatrix(inverse_pose(matrix))
    if matrix.rows != matrix.cols or matrix.rows > 4:
        message = f'the inverse of a matrix of {_size(matrix)}; write a square one, at most 4 x 4'
        raise node.at.fault(message, 'wrong-shape')
    determinant = matrix.det(method='berkowitz')
    if determinant == 0:
        message = 'the matrix has determinant 0, so no inverse; check its entries'
        raise node.at.fault(message, 'division-by-zero')
    return matrix.adjugate() / determinant


_OPERATIONS: dict[str, Callable[..., Value]] = {
    '+': _added,
    '*': _multiplied,
    '/': _divided,
    '^': _powered,
    'x': _crossed,
    "'": _transposed,
    'neg': lambda node, value: -value,
    'deg': lambda node, value: value * sp.pi / 180,
}

_OF_MATRICES: dict[str, Callable[..., Value]] = {
    'cross': _crossed,
    'inv': _inverse,
    'transpose': _transposed,
    'simplify': lambda node, value: value,
}
_OF_SYMPY = ('sin', 'cos', 'tan', 'asin', 'acos', 'atan', 'atan2', 'sqrt')
_SCALAR: dict[str, Callable[..., Value]] = {
    **{name: getattr(sp, name) for name in _OF_SYMPY},
    'sind': lambda x: sp.sin(x * sp.pi / 180),
    'cosd': lambda x: sp.cos(x * sp.pi / 180),
    'tand': lambda x: sp.tan(x * sp.pi / 180),
    'atan2d': lambda y, x: sp.atan2(y, x) * 180 / sp.pi,
    'abs': sp.Abs,
    **dict.fromkeys(('sign', 'sgn'), sp.sign),
    **dict.fromkeys(('rad', 'radians', 'deg2rad'), lambda x: x * sp.pi / 180),
}


@lru_cache(maxsize=65536)
def _functions_inside(value: Value) -> int:
    inside = max(map(_functions_inside, value.args), default=0)
    return inside + bool(value.is_Function)


def _called(node: Node, arguments: list[Value]) -> Value:
    if node.text == 'cross' and not all(map(is_matrix, arguments)):
        message = 'cross: an argument is a number; write two vectors of 3 entries'
        raise node.at.fault(message, 'wrong-shape')
    if node.text in _OF_MATRICES:
        return _OF_MATRICES[node.text](node, *arguments)
    arguments = [_unwrapped(argument) for argument in arguments]
    if any(map(is_matrix, arguments)):
        message = f'{node.text}: the argument is a matrix; write a number'
        raise node.at.fault(message, 'wrong-shape')
    if max(map(_functions_inside, arguments)) >= MAX_CALL_DEPTH:
        message = f'functions are nested more than {MAX_CALL_DEPTH} deep; compare a part of it'
        raise node.at.fault(message, 'too-deep')
    value = _SCALAR[node.text.replace('arc', 'a')](*arguments)
    if not value.is_finite and value.is_number:
        raise node.at.fault(f'{node.text} is not finite here; check its argument', 'not-finite')
    return value
