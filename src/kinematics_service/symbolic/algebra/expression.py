"""An expression of a robot file as a sympy expression, exactly: decimals become fractions."""

import ast
from collections.abc import Callable, Mapping
from typing import Any

import sympy

from ...robot.file.text.expression_syntax import folded, syntax_tree

HALF_TURN = sympy.Integer(180)


def exact(text: str, meanings: Mapping[str, Any], angle_unit: str = 'rad') -> Any:
    """
    Return what a text of the file says, in the file's units.

    Parameters
    ----------
    text
        An expression that the file's reader has accepted.
    meanings
        What each name stands for: symbols, or the expressions of derived constants.
    angle_unit
        'rad' or 'deg': of the trigonometric functions, as in the file.
    """
    tree = syntax_tree(text, lambda _: None)
    return folded(tree, lambda node, operands: _combined(node, operands, meanings, angle_unit))


def _combined(
    node: ast.expr, operands: list[Any], meanings: Mapping[str, Any], angle_unit: str
) -> Any:
    match node:
        case ast.Constant(value=float(number)):
            # repr is the shortest decimal of this double: 0.0254 is 127/5000, not a binary 0.0254.
            return sympy.Rational(repr(number))
        case ast.Name(id='pi'):
            return meanings.get('pi', sympy.pi)
        case ast.Name(id=name):
            return meanings[name]
        case ast.UnaryOp(op=ast.USub()):
            return -operands[0]
        case ast.UnaryOp():
            return operands[0]
        case ast.BinOp(op=operator):
            return _OPERATIONS[type(operator)](*operands)
        case ast.Call(func=ast.Name(id=name)):
            return _called(name, operands, angle_unit)
    raise TypeError(type(node).__name__)  # the reader lets nothing else through


_OPERATIONS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: lambda one, other: one + other,
    ast.Sub: lambda one, other: one - other,
    ast.Mult: lambda one, other: one * other,
    ast.Div: lambda one, other: one / other,
}


def _called(name: str, operands: list[Any], angle_unit: str) -> Any:
    if name == 'sqrt':
        return sympy.sqrt(operands[0])
    if name == 'atan2':
        angle = sympy.atan2(*operands)
        return angle * HALF_TURN / sympy.pi if angle_unit == 'deg' else angle
    angle = operands[0] * sympy.pi / HALF_TURN if angle_unit == 'deg' else operands[0]
    return {'sin': sympy.sin, 'cos': sympy.cos}[name](angle)
