# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Convert an expression of a robot file into an exact sympy expression: decimals become fractions.
"""

import operator
from collections.abc import Callable, Mapping

import sympy

from .....robot.file.text.expression_syntax import evaluated, syntax_tree


def exact(text: str, meanings: Mapping[str, sympy.Expr], angle_unit: str = 'rad') -> sympy.Expr:
    """
    Return the sympy expression of a text, in the units of the robot file.

    Parameters
    ----------
    text
        An expression that the reader of robot files has accepted.
    meanings
        The meaning of each name: a symbol, or the expression of a derived constant.
    angle_unit
        'rad' or 'deg': the unit that trigonometric functions in the text use.
    """
    known, operations = {'pi': sympy.pi, **meanings}, _OPERATIONS[angle_unit]

    def worth(symbol: float | str, operands: list[sympy.Expr]) -> sympy.Expr:
        if isinstance(symbol, float):
            # Convert the shortest decimal of the double, which repr gives: 0.0254 becomes
            # 127/5000, not a binary fraction.
            return sympy.Rational(repr(symbol))
        return operations[symbol](*operands) if operands else known[symbol]

    return evaluated(syntax_tree(text, lambda _: None), worth)


_IN_RAD: dict[str, Callable[..., sympy.Expr]] = {
    '+': operator.add,
    '-': operator.sub,
    '*': operator.mul,
    '/': operator.truediv,
    'neg': operator.neg,
    'sqrt': sympy.sqrt,
    'sin': sympy.sin,
    'cos': sympy.cos,
    'atan2': sympy.atan2,
}
_OPERATIONS: dict[str, dict[str, Callable[..., sympy.Expr]]] = {
    'rad': _IN_RAD,
    'deg': {
        **_IN_RAD,
        'sin': lambda angle: sympy.sin(angle * sympy.pi / 180),
        'cos': lambda angle: sympy.cos(angle * sympy.pi / 180),
        'atan2': lambda y, x: sympy.atan2(y, x) * 180 / sympy.pi,
    },
}
