# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Generate small repairs of a user's expression: a sign, an index, a bracket, exchanged arguments.

`explanation.py` tries each repair. If a repair makes the formula right, a report names the repair
as the mistake.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations

import sympy as sp

# The path to a part of a sympy expression: the argument index at each level, outermost first.
Path = tuple[int, ...]

# Maximum number of tree nodes of an expression for which repairs are tried.
MAX_EDITED_NODES = 400
# Repairs that change several terms of a sum (or factors of a product) together are tried only if
# the sum (or product) has at most this number of terms (or factors).
MAX_COMBINED_TERMS = 7


@dataclass(frozen=True)
class Edit:
    """
    A repair of an expression: it replaces the part at `path` by `part`. A report prints `sentence`
    if the repaired formula is right.
    """

    sentence: str
    path: Path
    part: sp.Expr


@dataclass(frozen=True)
class Repair:
    """
    A kind of repair: its name in reports, and the function `edits`, which yields all repairs of
    this kind for a given expression.
    """

    name: str
    edits: Callable[[sp.Expr, tuple[sp.Symbol, ...]], Iterator[Edit]]


def places(expression: sp.Expr, path: Path = ()) -> Iterator[tuple[Path, sp.Expr]]:
    """Yield every part of an expression with its path."""
    yield path, expression
    for k, part in enumerate(expression.args):
        yield from places(part, (*path, k))


def replaced(expression: sp.Expr, path: Path, part: sp.Expr) -> sp.Expr:
    """Return an expression with the part at `path` replaced."""
    if not path:
        return part
    arguments = list(expression.args)
    arguments[path[0]] = replaced(arguments[path[0]], path[1:], part)
    return expression.func(*arguments)


def _sums(e: sp.Expr) -> Iterator[tuple[Path, sp.Expr]]:
    return ((path, part) for path, part in places(e) if part.is_Add)


def signs(e: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> Iterator[Edit]:
    """Yield edits that change the sign of the expression, or of one to three terms of a sum."""
    yield Edit('the sign of the whole is wrong', (), -e)
    for size in (1, 2, 3):
        for path, part in _sums(e):
            if len(part.args) > MAX_COMBINED_TERMS and size > 1:
                continue
            if size < len(part.args):
                for chosen in combinations(part.args, size):
                    total = part - 2 * sp.Add(*chosen)
                    text = ', '.join(_text(term) for term in chosen)
                    terms = 'term has' if size == 1 else 'terms have'
                    where = f' in {_text(part)}' if path else ''
                    yield Edit(f'the {terms} the wrong sign: {text}{where}', path, total)


def extra_terms(e: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> Iterator[Edit]:
    """
    Yield edits that remove a term of a sum or a factor of a product, or set the expression to 0.
    """
    for path, part in places(e):
        if part.is_Add:
            for term in part.args:
                yield Edit(f'the term {_text(term)} is too many', path, part - term)
        if part.is_Mul:
            for k, factor in enumerate(part.args):
                quotient = part.func(*part.args[:k], *part.args[k + 1 :])
                yield Edit(f'the factor {_text(factor)} is too many', path, quotient)
    if e != 0:
        yield Edit(f'{_text(e)} does not belong here: the entry is 0', (), sp.Integer(0))


def sine_and_cosine(e: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> Iterator[Edit]:
    """
    Yield edits that replace a sine by a cosine or a cosine by a sine, at one place or everywhere.
    """
    other = {sp.sin: sp.cos, sp.cos: sp.sin}
    for path, part in places(e):
        if part.func in other:
            right = other[part.func](*part.args)
            yield Edit(f'{part} stands where {right} belongs', path, right)
            yield Edit(f'{part} stands where -{right} belongs', path, -right)
    pairs = [part for _, part in places(e) if part.func in other]
    if len(set(pairs)) > 1:
        changes = {part: other[part.func](*part.args) for part in pairs}
        yield Edit('sines and cosines are exchanged', (), e.subs(changes, simultaneous=True))


def symbols_exchanged(e: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> Iterator[Edit]:
    """
    Yield edits that replace a symbol by another, at one place or everywhere, or exchange two
    symbols.
    """
    free = sorted(e.free_symbols, key=str)
    for old in free:
        for new in symbols:
            if old != new:
                yield Edit(f'{old} stands where {new} belongs', (), e.xreplace({old: new}))
    for path, part in places(e):
        if part.is_Symbol:
            for new in symbols:
                if new != part:
                    yield Edit(f'{part} stands where {new} belongs, at one place', path, new)
        if part.is_Pow and part.base.is_Symbol and part.exp == 2:
            for new in symbols:
                sentence = f'{part.base} stands where {new} belongs, at one place'
                yield Edit(sentence, path, part.base * new)
    for first, second in combinations(free, 2):
        changes = {first: second, second: first}
        yield Edit(f'{first} and {second} are exchanged', (), e.xreplace(changes))


def lost_lengths(e: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> Iterator[Edit]:
    """
    Yield edits that replace a part p of the expression by p + s, p - s, p + s^2 or p - s^2. The
    symbol s is, for example, a length that the user forgot.
    """
    for path, part in places(e):
        if part.is_number or (path and _at(e, path[:-1]).is_Add):
            continue
        for symbol in symbols:
            for term in (symbol, symbol**2):
                for sign, text in ((term, f'+ {term}'), (-term, f'- {term}')):
                    yield Edit(f'{text} is lost in {_text(part)}', path, part + sign)


def _at(e: sp.Expr, path: Path) -> sp.Expr:
    for k in path:
        e = e.args[k]
    return e


def angles(e: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> Iterator[Edit]:
    """
    Yield edits that add a summand to the argument of a sine, cosine or tangent.

    The summands are pi/2, -pi/2, pi, and for each symbol s also s and -s.
    """
    for path, part in places(e):
        if part.func not in (sp.sin, sp.cos, sp.tan):
            continue
        argument = part.args[0]
        changes = [term for s in symbols for term in (s, -s)] + [sp.pi / 2, -sp.pi / 2, sp.pi]
        for change in changes:
            right = part.func(argument + change)
            yield Edit(f'{part} stands where {right} belongs', path, right)


def brackets(e: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> Iterator[Edit]:
    """
    Yield edits that add a lost bracket: c1 L1 + L2 becomes c1 (L1 + L2).

    An edit multiplies some terms of a sum by a factor. The factor is a symbol, sine or cosine that
    occurs in the expression.
    """
    factors = {part for _, part in places(e) if part.func in (sp.sin, sp.cos) or part.is_Symbol}
    for path, part in _sums(e):
        if len(part.args) > MAX_COMBINED_TERMS:
            continue
        for size in range(1, len(part.args)):
            for chosen in combinations(part.args, size):
                inner = sp.Add(*chosen)
                for factor in sorted(factors, key=str):
                    total = part - inner + factor * inner
                    sentence = f'a bracket is lost: {factor} multiplies {_text(inner)}'
                    yield Edit(sentence, path, total)


def lost_plus(e: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> Iterator[Edit]:
    """
    Yield edits that split a product into a sum or a difference, in case the user forgot a sign
    between two factors.
    """
    for path, part in places(e):
        if not part.is_Mul or len(part.args) > MAX_COMBINED_TERMS:
            continue
        for size in range(1, len(part.args) // 2 + 1):
            for chosen in combinations(part.args, size):
                first = sp.Mul(*chosen)
                second = sp.Mul(*(f for f in part.args if f not in chosen))
                for total, sign in ((first + second, 'plus'), (first - second, 'minus')):
                    sentence = f'a {sign} sign is lost between {_text(first)} and {_text(second)}'
                    yield Edit(sentence, path, total)


def arguments(e: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> Iterator[Edit]:
    """
    Yield edits that exchange, negate or invert arguments of atan2, atan, asin or acos, or that
    invert a fraction.
    """
    for path, part in places(e):
        if part.func == sp.atan2:
            y, x = part.args
            versions = (
                ((-y, x), 'the first argument of atan2 has the wrong sign'),
                ((y, -x), 'the second argument of atan2 has the wrong sign'),
                ((-y, -x), 'both arguments of atan2 have the wrong sign'),
                ((x, y), 'the arguments of atan2 are exchanged'),
                ((-x, y), 'the arguments of atan2 are exchanged, and the first one is negative'),
                ((x, -y), 'the arguments of atan2 are exchanged, and the second one is negative'),
                ((-x, -y), 'the arguments of atan2 are exchanged, and both are negative'),
            )
            for pair, sentence in versions:
                right = sp.atan2(*pair)
                yield Edit(f'{sentence}: {_text(right)}', path, right)
        elif part.func in (sp.atan, sp.asin, sp.acos):
            x = part.args[0]
            versions_of_one = (
                (part.func(-x), f'the argument of {part.func} has the wrong sign'),
                (part.func(1 / x), f'the argument of {part.func} is the reciprocal'),
                (part.func(-1 / x), f'the argument of {part.func} is the negative reciprocal'),
                (sp.acos(x) if part.func == sp.asin else sp.asin(x), 'asin and acos exchanged'),
            )
            for right, sentence in versions_of_one:
                yield Edit(f'{sentence}: {_text(right)}', path, right)
    yield Edit('it is the reciprocal of what it should be', (), 1 / e)
    yield Edit('it is the negative reciprocal of what it should be', (), -1 / e)
    for path, part in places(e):
        if path and part.is_Mul and any(f.is_Pow and f.exp == -1 for f in part.args):
            yield Edit(f'{_text(part)} is upside down', path, 1 / part)


def units(e: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> Iterator[Edit]:
    """Yield edits that convert angles between deg and rad, or lengths from mm to m."""
    changed, inside = e, False
    for part in {p for _, p in places(e) if p.func in (sp.sin, sp.cos, sp.tan)}:
        number, angle = part.args[0].as_coeff_Add()
        if number != 0:
            changed = changed.subs(part, part.func(number * sp.pi / 180 + angle))
            inside = True
    if inside:
        yield Edit('a number in sin or cos is in degrees', (), changed)
    yield Edit('the result is in degrees', (), e * sp.pi / 180)
    yield Edit('the result is in radians, degrees were asked for', (), e * 180 / sp.pi)
    yield Edit('it is in mm', (), e / 1000)


def powers(e: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> Iterator[Edit]:
    """
    Yield edits that square a symbol, a sine or a cosine, or remove a square or a square root.
    """
    for path, part in places(e):
        above = _at(e, path[:-1])
        if (part.is_Symbol or part.func in (sp.sin, sp.cos)) and not above.is_Pow:
            yield Edit(f'{part} should be squared', path, part**2)
        if part.is_Pow and part.exp == 2:
            yield Edit(f'{part.base} should not be squared', path, part.base)
        if part.is_Pow and part.exp == sp.Rational(1, 2):
            yield Edit(f'the root of {_text(part.base)}', path, part.base)


def twos(e: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> Iterator[Edit]:
    """Yield edits that double or halve the expression, a product, or a term of a sum."""
    half = sp.Rational(1, 2)
    for path, part in places(e):
        if not path or part.is_Mul:
            where = f' in {_text(part)}' if path else ''
            yield Edit(f'a factor 2 is missing{where}', path, 2 * part)
            yield Edit(f'a factor 2 is too many{where}', path, half * part)
        if part.is_Add:
            for term in part.args:
                for factor, text in ((2, 'twice'), (half, 'half of')):
                    right = part - term + factor * term
                    yield Edit(f'{text} {_text(term)} belongs there', path, right)


def quarter_turns(e: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> Iterator[Edit]:
    """Yield edits of a joint angle's formula f: f + c and c - f, where c is 180, 90 or -90 deg."""
    turns = ((sp.pi, '180 deg'), (sp.pi / 2, '90 deg'), (-sp.pi / 2, '-90 deg'))
    for turn, text in turns:
        yield Edit(f'{text} must be added', (), e + turn)
        yield Edit(f'the sign is wrong and {text} must be added', (), turn - e)


EXTRA = Repair('extra term or factor', extra_terms)
EDITS = (
    Repair('sign of a term', signs),
    Repair('arguments of atan2 and its kin', arguments),
    Repair('sine for cosine', sine_and_cosine),
    Repair('a factor 2', twos),
    Repair('index of a joint or a length', symbols_exchanged),
    Repair('angle of a function', angles),
    Repair('lost bracket', brackets),
    Repair('lost plus', lost_plus),
    EXTRA,
    Repair('squares', powers),
    Repair('degrees and millimetres in an entry', units),
)
SOLUTION_EDITS = (
    *(EDITS[k] for k in (1, 0, 2, 3)),
    Repair('lost length', lost_lengths),
    *EDITS[4:],
    Repair('zero of the angle', quarter_turns),
)


@lru_cache(maxsize=1024)
def _text(e: sp.Expr) -> str:
    text = str(e)
    return text if len(text) <= 80 else f'{text[:77]}...'
