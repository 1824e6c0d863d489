# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Describe a derivation by a list of headings, sentences and equations. Each output format writes
this list.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import sympy

from ..closed_loops import MAX_VARIABLES
from ..derivation import Derivation
from ..family import Family
from ..path import Path
from ..singular_set import FamilyCrossing, SingularFactor

# A factor of the determinant is long if its number of operations exceeds this constant. If a long
# factor is irreducible, the report says so.
LONG_EXPRESSION_OPERATIONS = 60


@dataclass(frozen=True)
class Heading:
    """A heading; level 1 is the title."""

    text: str
    level: int


@dataclass(frozen=True)
class Sentence:
    """A sentence; in its `parts`, texts and sympy expressions alternate."""

    parts: tuple[str | sympy.Expr, ...]


@dataclass(frozen=True)
class Equation:
    """
    A symbol and its expression; `left` is the symbol in LaTeX, such as `J`, `T_{01}` or `z_{1}`.
    """

    left: str
    right: sympy.Expr | sympy.Matrix


# Text that follows a statement if the statement is not proved for the whole family of singular
# poses.
SAMPLED = ' (at sampled poses)'
# Texts that say whether a crossing of families is inside the joint limits; the key None means
# unknown.
IN_BRACKETS = {
    True: '',
    False: ' (outside the joint limits)',
    None: ' (whether inside the joint limits is not decided)',
}

Block = Heading | Sentence | Equation


def report_of(
    derivation: Derivation, frame: str | None = None, path: Path | None = None
) -> tuple[Block, ...]:
    """
    Return a derivation as blocks: headings, sentences and equations.

    Parameters
    ----------
    derivation
        The derivation to report.
    frame
        Axes of the Jacobian: `base` (default), `tool`, or the number of a frame.
    path
        A path q(t). If it is given, the report has the tool's velocity along the path.
    """
    blocks = [*_frames(derivation), *_loops(derivation)]
    blocks += _jacobian(derivation, frame or 'base')
    if derivation.loops:
        blocks += _closed_determinant(derivation)
    else:
        blocks += [*_determinant(derivation), *_singular(derivation)]
    if path is not None:
        blocks += _path(path)
    return tuple(blocks)


def say(*parts: str | sympy.Expr) -> Sentence:
    """Return a Sentence block from texts and sympy expressions."""
    return Sentence(parts)


def _frames(derivation: Derivation) -> Iterator[Block]:
    robot = derivation.robot
    angle, length = 'rad', robot.description.length_unit
    yield Heading(f'{robot.name}: exact kinematics', 1)
    yield say(f'Source: {robot.source}')
    yield say(f'Joint variables in {angle} or {length}; lengths are symbols, in {length}.')
    numbers = {name: value for name, value in derivation.lengths.items() if value is not None}
    if numbers:
        given = ', '.join(f'{name} = {value:.12g}' for name, value in numbers.items())
        yield say(f'Numbers of the file: {given}')
    if letters := robot.description.letters:
        yield say(f'Letters without a value: {letters}; ranks are those of generic values')
    if derivation.angles:
        yield say(
            'Matrices are written in angles with the offsets of the table in them; determinant '
            'and factors in these, then in joint variables.'
        )
        for theta, angle in derivation.angles.items():
            yield Equation(sympy.latex(theta), angle)
    yield Heading('Frames', 2)
    yield say(
        'T_i,k is frame k in frame i, and T the tool in the base frame; R and p are its rotation '
        'and its position. A matrix that is one of those above is named, not written again.'
    )
    named = [(f'T_{{{k - 1},{k}}}', T) for k, T in enumerate(derivation.row_transforms, 1)]
    named += [(f'T_{{base,{k}}}', T) for k, T in enumerate(derivation.frames)]
    yield from _once([(k, derivation.in_angles(T)) for k, T in (*named, ('T', derivation.T))])
    for k, (z, o) in enumerate(zip(derivation.z, derivation.o), 1):
        yield Equation(f'z_{{{k}}}', derivation.in_angles(z))
        yield Equation(f'o_{{{k}}}', derivation.in_angles(o))


def _once(matrices: Sequence[tuple[str, sympy.Matrix]]) -> Iterator[Block]:
    # Yield each matrix once. If a matrix equals the identity or an earlier matrix, yield a
    # sentence that says so.
    shown: dict[sympy.Matrix, str] = {sympy.ImmutableMatrix(sympy.eye(4)): 'the identity'}
    for left, matrix in matrices:
        known = shown.setdefault(sympy.ImmutableMatrix(matrix), left)
        if known == left:
            yield Equation(left, matrix)
        else:
            yield say(f'{_in_words(left)} is {_in_words(known)}.')


def _in_words(left: str) -> str:
    return left.replace('{', '').replace('}', '')


def _loops(derivation: Derivation) -> Iterator[Block]:
    q = _listed(derivation.variables)
    for loop in derivation.loops:
        psi = _listed(loop.passive)
        yield Heading(f'Loop {loop.name}', 2)
        yield say(f'The passive joints {psi} follow from')
        for equation in loop.equations:
            yield Equation('0', equation)
        yield say(f'Coupling K = d({psi})/d({q}) = -(d Phi/d({psi}))^-1 d Phi/d({q}):')
        yield Equation('K', loop.coupling)
        yield say(f'Determinant det d Phi/d({psi}); the loop is flat where it is 0:')
        yield Equation('D', loop.determinant)


def _listed(symbols: Sequence[sympy.Symbol]) -> str:
    return ', '.join(map(str, symbols))


def _jacobian(derivation: Derivation, frame: str) -> Iterator[Block]:
    yield Heading('Jacobian', 2)
    axes = frame if frame in ('base', 'tool') else f'frame {frame}'
    yield say(f'Rows vx vy vz wx wy wz of the origin of the tool, axes of {axes}.')
    if derivation.loops:
        joints = _listed(derivation.names.variables)
        yield say(f'By {joints}, each by itself; J is this times [1; K], with the K of all loops.')
        yield Equation('J_{open}', derivation.in_angles(derivation.jacobian_open))
    else:
        yield Equation('J', derivation.in_angles(derivation.jacobian_in(frame)))
    if derivation.coupling is not None and not derivation.loops:
        yield say('Joints move several rows: J = J_open C, with the rows moved by C q.')
        yield Equation('C', derivation.coupling)
    same = [name for name, terms in derivation.methods.items() if not terms]
    yield say(f'Found {len(derivation.methods)} ways; difference exactly zero: {", ".join(same)}.')
    for name, terms in derivation.methods.items():
        if terms:
            yield say(f'{name} differs in {terms} terms (a rounded matrix in the file?)')
    if derivation.loops:
        return
    worst = derivation.central_difference
    yield say(f'Central differences of T at a random pose differ by {worst:.1e}.')


def _closed_determinant(derivation: Derivation) -> Iterator[Block]:
    rows = ' '.join(derivation.robot.singularity.task.rows)
    yield Heading('Determinant', 2)
    if not derivation.singular_set.determinant.square:
        yield say(f'The task {rows} is not square: there is no determinant of the arm.')
    elif derivation.determinant is None:
        yield say(
            f'The determinant of the arm, rows {rows}, is that of these rows of J. It is not '
            f'multiplied out: that is done of {MAX_VARIABLES} joints and passive ones at most. '
            f'Here are {len(derivation.names.variables)}.'
        )
    else:
        yield say(f'Of the arm, rows {rows}; it is singular where it is 0:')
        yield Equation('det J', derivation.determinant)


def _determinant(derivation: Derivation) -> Iterator[Block]:
    singular_set = derivation.singular_set
    determinant = singular_set.determinant
    yield Heading('Determinant', 2)
    yield say(
        f'Task rows: {" ".join(determinant.rows)}; rank {singular_set.generic_rank} in general.'
    )
    if singular_set.special:
        yield say(f'{singular_set.special[0].upper()}{singular_set.special[1:]}.')
    if singular_set.dependent:
        joints = ' and '.join(singular_set.dependent)
        yield say(
            f'Structural: {joints} depend on each other at every pose, so the determinant is 0 '
            'for every q. That says nothing about a pose: what follows is about '
            f'columns {", ".join(determinant.columns)}.'
        )
    elif determinant.identically_zero:
        yield say('Structural: the determinant is 0 for every q.')
    if determinant.expression is None:
        yield say('Too many minors to write out: lock joints to get a smaller arm.')
        return
    left = 'det J' if determinant.square else 'w'
    if not determinant.square:
        yield say(
            f'Not square: w is the product of the singular values, the root of the sum of '
            f'{determinant.minors} squared minors; factors common to all of them stand in front.'
        )
    yield say(f'Computed in {determinant.view}, which does not change it.')
    yield from _in_both(derivation, left, determinant.expression)
    if not singular_set.factors and determinant.minors > 1:
        text = 'With lengths as letters the minors have no common factor.'
        if not determinant.split:
            text = 'No common factor of the minors was found; that there is none is not proved.'
        yield say(f'{text} Lock a joint for the reduced arm.')


def _in_both(derivation: Derivation, left: str, expression: sympy.Expr) -> Iterator[Block]:
    # Write the expression in the angles theta. If theta differs from the joint variable q, write
    # it also in q.
    in_angles = derivation.in_angles(expression)
    yield Equation(left, in_angles)
    if in_angles != expression:
        yield Equation(left, expression)


def _singular(derivation: Derivation) -> Iterator[Block]:
    singular_set = derivation.singular_set
    yield Heading('Singular set', 2)
    if singular_set.determinant.expression is None:
        return
    if not singular_set.factors and singular_set.complete:
        constant = singular_set.determinant.minors == 1
        yield say(f'Empty: the {"determinant is a constant" if constant else "rank never falls"}.')
    for factor in singular_set.factors:
        yield from _family(derivation, factor)
    if singular_set.crossings:
        yield Heading('Where families meet', 3)
    for crossing in singular_set.crossings:
        names = ' and '.join(map(_short, crossing.names))
        yield say(f'{names}: {_crossing(crossing)}')
    for zeros in singular_set.remainder_zeros or ():
        place = ' and '.join(f'{name} = 0' for name in zeros.names)
        yield say(f'Singular too where {place}: {_crossing(zeros)}')
    if singular_set.remainder_zeros is None and singular_set.determinant.minors > 1:
        yield say('Singular too where what is left of the minors vanishes as a whole:')
        yield from _in_both(derivation, '0', singular_set.determinant.remainder)


def _crossing(crossing: FamilyCrossing) -> str:
    if crossing.rank is None:
        return 'no pose was found; that they do not meet is not proved'
    sampled = SAMPLED if crossing.sampled else ''
    return f'rank {crossing.rank}{sampled}{IN_BRACKETS[crossing.within_limits]}'


def _short(name: str) -> str:
    return name if len(name) <= 40 else 'the irreducible factor'


def _family(derivation: Derivation, factor: SingularFactor) -> Iterator[Block]:
    yield Heading(_short(factor.name), 3)
    yield from _in_both(derivation, '0', factor.expression)
    if sympy.count_ops(factor.expression) > LONG_EXPRESSION_OPERATIONS and factor.irreducible:
        yield say(
            'It is irreducible: with its lengths as letters it has no real factors with '
            'fractions as coefficients.'
        )
    if not factor.irreducible:
        yield say('Whether it factors further was not found out.')
    if factor.power > 1:
        yield say(f'It stands {factor.power} times in the product.')
    yield from _solutions(derivation, factor.family)
    yield from _effects(factor)


def _solutions(derivation: Derivation, family: Family) -> Iterator[Block]:
    theta = family.variable and derivation.in_angles(family.variable)
    if theta is not None and theta != family.variable:
        (theta,) = theta.free_symbols
        offset = derivation.angles[theta] - family.variable
        for solution in family.solutions:
            yield Equation(sympy.latex(theta), derivation.in_angles(solution) + offset)
    for solution in family.solutions:
        yield Equation(sympy.latex(family.variable), solution)
    if family.condition is not None:
        yield say('exists if and only if ', derivation.in_angles(family.condition))
    if family.free:
        free = map(derivation.in_angles, family.free)
        parts = [part for e in free for part in (e, ' and ')][:-1]
        yield say('Every value of it where ', *parts, ' vanish together.')


def _effects(factor: SingularFactor) -> Iterator[Block]:
    if factor.rank is None:
        yield say('No pose was found on it with the lengths of the file.')
        return
    if factor.within_limits is None:
        yield say('Whether a pose of it is inside the joint limits is not decided.')
    elif not factor.within_limits:
        yield say('No pose of it is inside the joint limits.')
    seen = dict.fromkeys(factor.sampled, SAMPLED)
    yield say(f'Rank there: {factor.rank}{seen.get("rank", "")}.')
    if factor.special:
        yield say(f'{factor.special[0].upper()}{factor.special[1:]}.')
    if factor.lost:
        yield say(f'Lost: {factor.lost}{seen.get("lost", "")}.')
    if factor.idle:
        yield say(f'Joints: {factor.idle}{seen.get("idle", "")}.')


def _path(path: Path) -> Iterator[Block]:
    yield Heading('Along the path', 2)
    yield Equation('q(t)', path.q)
    yield Equation('\\dot{q}(t)', path.qdot)
    yield Equation('v(t)', path.v)
    yield Equation('\\omega(t)', path.omega)
    crossings, (start, end) = path.crossings, path.span
    times = 'once' if len(crossings) == 1 else f'{len(crossings)} times'
    yield say(f'Meets the singular set {times} between {start:g} and {end:g} s.')
    for crossing in crossings:
        remark = ' (touches)' if crossing.touches else ''
        until = f' to {crossing.until:.6f}' if crossing.until > crossing.time else ''
        yield say(f't = {crossing.time:.6f}{until} s: {_short(crossing.name)}{remark}')
