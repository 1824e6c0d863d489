"""
What to write instead of `pi` in a file whose angles are degrees.

An angle of pi is 180 there, but `pi` may also be meant as the number 3.14. Which of the two is
told as one checks units: pi and the joint angles have the power 1 of an angle, numbers 0; a
product adds the powers, a quotient subtracts them, a sum needs the same on both sides. Where the
power of the whole is that of its place, 180 is right for every `pi`; where it is not, nothing is
advised.
"""

import ast
import math
from collections.abc import Collection
from typing import NamedTuple

from .expression_syntax import names_in, operands_of, postorder

HALF_TURN = 180.0
LONGEST = 80  # characters of an advice
DIGITS = 12  # what a person would type; 180/7 is better left as it is


class _Part(NamedTuple):
    # Of a node: its power of angle, None where the units do not fit; its value with pi as 180,
    # None where names or functions stand; whether pi stands in it.
    power: float | None
    value: float | None
    has_pi: bool


class _Piece(NamedTuple):
    # A largest part of pi and numbers alone: where its text stands, and its value.
    start: int
    end: int
    value: float


def advice_on_pi(text: str, tree: ast.expr, angles: Collection[str], wanted: int | None) -> str:
    """
    Return the sentence on an expression with `pi` in a file of degrees.

    Parameters
    ----------
    text
        The expression.
    tree
        Its syntax; positions are those of the text.
    angles
        Names of the variables that are angles.
    wanted
        1 where an angle is expected, 0 for a length or a ratio, None where either may stand.
    """
    whole, pieces = _read(tree, angles)
    if pieces and whole.power in ((0, 1) if wanted is None else (wanted,)):
        first = pieces[0]
        shown, value = text[first.start : first.end], _typed(first.value)
        if value is None:
            shown, value = 'pi', f'{HALF_TURN:g}'
        instead = _rewritten(text, pieces)
        # A constant with pi may be an angle or, say, the way a wheel rolls in a turn.
        unsure = wanted is None and whole.power == 1 and not names_in(text) & set(angles)
        if len(instead) + len(shown) <= LONGEST:
            where = 'here, if it is an angle' if unsure else 'here'
            return f"{shown} is {value} {where}: write {instead} (the file has 'angle: deg')"
    return (
        f"'pi' is not accepted in a file with 'angle: deg': an angle of pi is {HALF_TURN:g} here, "
        f'the number is {math.pi!r}'
    )


def _read(tree: ast.expr, angles: Collection[str]) -> tuple[_Part, list[_Piece]]:
    # A machine with a stack instead of recursion: no nesting can exhaust it.
    parts: list[tuple[_Part, ast.expr]] = []
    pieces: list[_Piece] = []
    for node in postorder(tree):
        first = len(parts) - len(operands_of(node))
        operands, parts = parts[first:], parts[:first]
        part = _part(node, [operand for operand, _ in operands], angles)
        if part.value is None:
            pieces += [_piece(*operand) for operand in operands if _is_piece(operand[0])]
        parts.append((part, node))
    whole = parts[0]
    if _is_piece(whole[0]):
        pieces.append(_piece(*whole))
    return whole[0], sorted(pieces)


def _is_piece(part: _Part) -> bool:
    return part.has_pi and part.value is not None


def _piece(part: _Part, node: ast.expr) -> _Piece:
    assert part.value is not None
    assert node.end_col_offset is not None
    return _Piece(node.col_offset, node.end_col_offset, part.value)


def _part(node: ast.expr, operands: list[_Part], angles: Collection[str]) -> _Part:
    match node:
        case ast.Constant(value=float(number)):
            return _Part(0, number, False)
        case ast.Name(id='pi'):
            return _Part(1, HALF_TURN, True)
        case ast.Name(id=name):
            return _Part(int(name in angles), None, False)
    has_pi = any(operand.has_pi for operand in operands)
    return _Part(_power(node, operands), _value(node, operands), has_pi)


def _power(node: ast.expr, operands: list[_Part]) -> float | None:
    powers = [operand.power for operand in operands]
    if any(power is None for power in powers):
        return None
    known = [power for power in powers if power is not None]
    match node:
        case ast.UnaryOp():
            return known[0]
        case ast.BinOp(op=ast.Mult()):
            return known[0] + known[1]
        case ast.BinOp(op=ast.Div()):
            return None if operands[1].value == 0.0 else known[0] - known[1]
        case ast.BinOp():
            return _same(operands)
        case ast.Call(func=ast.Name(id='sqrt')):
            return known[0] / 2
        case ast.Call(func=ast.Name(id='atan2')):
            return None if _same(operands) is None else 1
        case ast.Call():
            # A number inside sin() is an angle: the file says its unit.
            return 0 if known[0] == 1 or not operands[0].has_pi else None
    return None


def _same(operands: list[_Part]) -> float | None:
    # Zero is zero in any unit.
    powers = {operand.power for operand in operands if operand.value != 0.0}
    return powers.pop() if len(powers) == 1 else 0 if not powers else None


def _value(node: ast.expr, operands: list[_Part]) -> float | None:
    values = [operand.value for operand in operands if operand.value is not None]
    if len(values) < len(operands):
        return None
    match node:
        case ast.UnaryOp(op=ast.USub()):
            return -values[0]
        case ast.UnaryOp():
            return values[0]
        case ast.BinOp(op=ast.Add()):
            return values[0] + values[1]
        case ast.BinOp(op=ast.Sub()):
            return values[0] - values[1]
        case ast.BinOp(op=ast.Mult()):
            return values[0] * values[1]
        case ast.BinOp(op=ast.Div()):
            return values[0] / values[1] if values[1] else None
    return None


def _typed(value: float) -> str | None:
    text = f'{value + 0.0:.{DIGITS}g}'
    exact = math.isclose(float(text), value, rel_tol=1e-14, abs_tol=0.0)
    return text if exact and len(text) < DIGITS and 'e' not in text else None


def _rewritten(text: str, pieces: list[_Piece]) -> str:
    parts, at = [], 0
    for piece in pieces:
        old = text[piece.start : piece.end]
        new = _typed(piece.value) or _with_180(old)
        parts += [text[at : piece.start], new]
        at = piece.end
    return ''.join([*parts, text[at:]]).strip()


def _with_180(text: str) -> str:
    # In a piece stand numbers, operators and pi: no other name has these letters.
    return text.replace('pi', f'{HALF_TURN:g}')
