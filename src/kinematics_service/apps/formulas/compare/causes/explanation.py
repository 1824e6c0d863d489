# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Explain wrong entries of a formula by mistakes that were tested, with a greedy set cover.

The set cover repeatedly selects the mistake that explains the largest number of wrong entries. A
mistake explains an entry only if, at all configurations, the entry computed with this mistake
equals the user's entry.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import sympy as sp

from .....robot.file.parts.convention_table import QUANTITIES
from ...arm.numbers import Floats, size_of
from ...arm.table import general_row, row_matrix
from ..arm.quantities import expression_of
from ..statements.checks import Check, Mask, QuantityCheck
from ..statements.solutions import SolutionCheck
from .causes import CAUSES
from .edits import EDITS, EXTRA, MAX_EDITED_NODES, SOLUTION_EDITS, replaced
from .variant import BLOCK, COLUMN, ENTRY, ROW, WHOLE, Cause, Variant

# A report names one cause of a wrong entry. It also lists at most this number of other causes that
# explain the same entry.
MAX_ALTERNATIVES = 3
# Terms that the user dropped are searched only if the correct entry has at most this number of
# terms.
MAX_MISSING_TERMS = 12
# A mistake that changes the whole matrix is accepted as explanation if the fraction of wrong
# entries that it leaves unexplained is at most this. Then a second mistake is searched, to explain
# the remaining wrong entries.
MAX_LEFT_RATIO = 0.34

DROPPED = 'dropped term or factor'


@dataclass(frozen=True)
class Explanation:
    """
    A mistake that explains wrong entries. A formula with this mistake has the user's values.

    Parameters
    ----------
    cause
        Name of a `Cause` in `CAUSES`, or of a `Repair`.
    sentence
        The mistake as a sentence.
    entries
        The wrong entries that the cause explains, (row, column) from 0.
    also
        Other causes that explain the same entries just as well.
    """

    cause: str
    sentence: str
    entries: tuple[tuple[int, int], ...]
    also: tuple[str, ...] = ()


@dataclass(frozen=True)
class Explained:
    """The explanations found for a wrong formula, and the names of all causes that were tried."""

    explanations: tuple[Explanation, ...]
    tried: tuple[str, ...]


def explain(check: Check) -> Explained:
    """
    Return the mistakes that explain a failed check, and the names of all mistakes that were
    tested.
    """
    tried: list[str] = []
    if isinstance(check, QuantityCheck):
        explanations = _of_matrix(check, check.right, tried)
    else:
        explanations = _repaired(check, check.right, 0, 0, tried)
    return Explained(tuple(explanations), tuple(dict.fromkeys(tried)))


def _of_matrix(check: QuantityCheck, right: Floats, tried: list[str]) -> list[Explanation]:
    wrong = ~check.agrees(check.person, right)
    whole: list[tuple[str, Variant]] = []
    candidates: list[_Candidate] = []
    for cause in CAUSES:
        if check.quantity.kind not in cause.kinds or (cause.many and check.is_one_configuration):
            continue
        tried.append(cause.name)
        for variant in cause.variants(check):
            if variant.values.shape == right.shape:
                whole += [(cause.name, variant)] if WHOLE in cause.scopes else []
                candidates += _candidates(check, cause, variant, wrong)
    complete = any((candidate.mask == wrong).all() for candidate in candidates)
    if not complete and (first := _best_whole(check, wrong, whole)) is not None:
        name, variant = first
        unexplained = ~check.agrees(check.person, variant.values)
        explanation = Explanation(name, variant.sentence, _entries(wrong & ~unexplained))
        others = _entry_by_entry(check, variant.values, unexplained, tried)
        return _if_few([explanation, *others], int(wrong.sum()))
    chosen, unexplained = _cover(candidates, wrong, check.is_one_configuration)
    return _if_few([*chosen, *_entry_by_entry(check, right, unexplained, tried)], int(wrong.sum()))


def _if_few(explanations: list[Explanation], wrong: int) -> list[Explanation]:
    # Many mistakes may fit by chance. So return no mistakes if more than max(2, wrong / 3) were
    # found, where `wrong` is the number of wrong entries.
    return explanations if len(explanations) <= max(2, wrong // 3) else []


@dataclass(frozen=True, eq=False)
class _Candidate:
    cause: str
    place: str
    variant: Variant
    mask: Mask


def _candidates(
    check: QuantityCheck, cause: Cause, variant: Variant, wrong: Mask
) -> Iterator[_Candidate]:
    agreed = check.agrees(check.person, variant.values)
    for scope in cause.scopes:
        for name, index in _parts(scope, check):
            mask = np.zeros(check.shape, dtype=bool)
            mask[index] = True
            if variant.columns and scope == COLUMN and not mask[:, variant.columns].any():
                continue
            if (mask & wrong).any() and agreed[mask].all():
                place = '' if mask.all() else f'{name}: '
                yield _Candidate(cause.name, place, variant, mask & wrong)


def _best_whole(
    check: QuantityCheck, wrong: Mask, variants: list[tuple[str, Variant]]
) -> tuple[str, Variant] | None:
    # Choose among the mistakes that change the whole matrix. Choose the mistake that leaves the
    # fewest entries unexplained. The caller then searches a second mistake for the unexplained
    # entries.
    best, least = None, int(MAX_LEFT_RATIO * wrong.sum())
    for name, variant in variants:
        count = int((~check.agrees(check.person, variant.values)).sum())
        if 0 < count <= least and wrong.sum() - count >= 2:
            best, least = (name, variant), count - 1
    return best


def _parts(scope: str, check: QuantityCheck) -> Iterator[tuple[str, sp.Expr]]:
    # Yield the name and the numpy index of every block, every column, every row or every entry of
    # the user's matrix, as `scope` says. If `scope` is WHOLE, yield only the whole matrix.
    rows, columns = check.shape
    if scope == WHOLE:
        yield '', np.s_[:]
    elif scope == BLOCK:
        if check.quantity.kind == 'jacobian' and rows == 6:
            names = ('angular', 'linear') if check.reading.angular_first else ('linear', 'angular')
            yield f'{names[0]} rows', np.s_[:3]
            yield f'{names[1]} rows', np.s_[3:]
        elif rows in (3, 4) and columns == 4:
            yield 'rotation', np.s_[:3, :3]
            yield 'position', np.s_[:3, 3]
    elif scope == COLUMN:
        yield from ((f'column {j + 1}', np.s_[:, j]) for j in range(columns))
    elif scope == ROW and rows > 1:
        yield from ((f'row {i + 1}', np.s_[i]) for i in range(rows))
    elif scope == ENTRY:
        yield from ((f'({i + 1},{j + 1})', np.s_[i, j]) for i, j in np.ndindex(rows, columns))


def _cover(
    candidates: list[_Candidate], wrong: Mask, single: bool
) -> tuple[list[Explanation], Mask]:
    # Greedy set cover: repeatedly choose the mistake that explains the largest number of wrong
    # entries that are still unexplained. If two mistakes explain equally many entries, choose the
    # first in `CAUSES`. Return the chosen mistakes and the entries that stay unexplained.
    # A chosen mistake gets a list of alternatives: other mistakes that explain the same entries. A
    # cause, such as a wrong row of the table, consists of many similar mistakes. If `single` is
    # false, the list has mistakes of other causes only. If `single` is true, the user's values are
    # known at one configuration only. One configuration may not show which of several similar
    # mistakes the user made. So the list also has mistakes of the same cause.
    unexplained = wrong.copy()
    chosen: list[Explanation] = []
    while unexplained.any() and candidates:
        counts = [int((candidate.mask & unexplained).sum()) for candidate in candidates]
        if max(counts) == 0:
            break
        best = candidates[counts.index(max(counts))]
        sentence = best.variant.sentence
        also = {
            rival.variant.sentence: f'{rival.place}{rival.variant.sentence}'
            for rival in reversed(candidates)  # if sentences are equal, keep the first
            if rival.variant.sentence != sentence
            and (rival.mask == best.mask).all()
            and (single or rival.cause != best.cause)
        }
        alternatives = tuple(reversed(also.values()))[:MAX_ALTERNATIVES]
        entries = _entries(best.mask & unexplained)
        chosen.append(Explanation(best.cause, f'{best.place}{sentence}', entries, alternatives))
        unexplained &= ~best.mask
    return chosen, unexplained


def _entries(mask: Mask) -> tuple[tuple[int, int], ...]:
    return tuple((int(i), int(j)) for i, j in np.argwhere(mask))


def _entry_by_entry(
    check: QuantityCheck, right: Floats, mask: Mask, tried: list[str]
) -> list[Explanation]:
    repairs: list[Explanation] = []
    for i, j in _entries(mask):
        terms = _missing_terms(check, right, i, j, tried)
        repairs += terms or _repaired(check, right, i, j, tried)
    return _grouped(repairs)


def _repaired(check: Check, right: Floats, i: int, j: int, tried: list[str]) -> list[Explanation]:
    expression = check.expressions[i, j]
    table = check.names.table
    size = size_of(expression)
    if size > MAX_EDITED_NODES or (not expression.free_symbols and expression.is_Rational):
        return []
    symbols = (*table.variables, *table.constants)
    if isinstance(check, QuantityCheck) and check.quantity.kind == 'general':
        symbols = tuple(sp.Symbol(f'{name}_i') for name in QUANTITIES)
    if isinstance(check, SolutionCheck):
        # The formula gives the position of one joint. Exclude the symbol of this joint: a repair
        # could replace any formula by the symbol, as in q2 = q2, which is always right.
        symbols = tuple(symbol for symbol in symbols if symbol != check.variable)
    known = sorted(expression.free_symbols - set(symbols), key=str)
    kinds = SOLUTION_EDITS if isinstance(check, SolutionCheck) else EDITS
    repairs: dict[str, str] = {}  # key: repair as a sentence; value: kind of repair
    for kind in kinds:
        tried.append(kind.name)
        for edit in kind.edits(expression, (*symbols, *known)):
            values = check.evaluation.with_part(expression, edit.path, edit.part)
            if not check.passes(values, right[:, i, j]):
                continue
            # Skip an edit that makes a whole matrix entry 0: only the repair EXTRA reports such
            # edits.
            may_vanish = kind == EXTRA or not isinstance(check, QuantityCheck)
            if not may_vanish and replaced(expression, edit.path, edit.part) == 0:
                continue
            repairs.setdefault(edit.sentence, kind.name)
            break
        if len(repairs) > MAX_ALTERNATIVES:
            break
    if not repairs:
        return []
    sentence, *others = repairs
    return [Explanation(repairs[sentence], sentence, ((i, j),), tuple(others))]


def _missing_terms(
    check: QuantityCheck, values: Floats, i: int, j: int, tried: list[str]
) -> list[Explanation]:
    # Find terms and factors of the correct entry that the user's entry lacks.
    tried.append(DROPPED)
    if check.is_one_configuration:
        if check.expressions[i, j] != 0 or check.right[0, i, j] == 0:
            return []
        sentence = f'left out: 0 stands where {check.right[0, i, j]:.6g} belongs'
        return [Explanation(DROPPED, sentence, ((i, j),))]
    exact = right_entry(check, i, j) if values is check.right else None
    terms = check.names.table.constants
    if exact is not None:
        if size_of(exact) > MAX_EDITED_NODES:
            return []
        terms = sp.Add.make_args(sp.expand(exact))
    if len(terms) > MAX_MISSING_TERMS:
        return []
    missing = values[:, i, j] - check.person[:, i, j]
    for size in (1, 2, 3):
        for chosen in combinations(terms, size):
            if size == len(terms) and check.expressions[i, j] != 0:
                continue
            if check.agrees(check.world.evaluation.of(sp.Add(*chosen)), missing):
                text = ' + '.join(str(term) for term in chosen)
                plural = 'terms are' if size > 1 else 'the term is'
                return [Explanation(DROPPED, f'{plural} dropped: {text}', ((i, j),))]
    return _missing_factor(check, terms, values, i, j)


def _missing_factor(
    check: QuantityCheck, terms: Sequence[sp.Expr], values: Floats, i: int, j: int
) -> list[Explanation]:
    if check.agrees(np.zeros_like(values[:, i, j]), values[:, i, j]):
        # The correct entry is 0. So the cause "a factor is dropped" would explain any entry of the
        # user, because the dropped factor may be 0. Do not offer this cause.
        return []
    factors = {f for term in terms for f in sp.Mul.make_args(term)}
    for factor in sorted(factors, key=str):
        value = check.world.evaluation.of(factor) * check.person[:, i, j]
        if check.agrees(value, values[:, i, j]):
            return [Explanation(DROPPED, f'the factor {factor} is dropped', ((i, j),))]
    return []


def right_entry(check: QuantityCheck, i: int, j: int) -> sp.Expr | None:
    """Return the correct expression of entry (i, j), or None if the quantity has no expression."""
    if check.quantity.kind == 'numeric':
        return None
    if check.quantity.kind == 'general':
        return row_matrix(general_row(check.names.table))[i, j]
    matrix = expression_of(check.quantity, check.names.arm, check.reading)
    if matrix is None:
        return None
    if check.quantity.kind == 'jacobian' and check.quantity.part == 'all':
        i = check.jacobian_rows[i]
    if matrix.shape == (3, 1) and check.shape == (1, 3):
        i, j = j, i
    if i >= matrix.rows or j >= matrix.cols:
        return None
    return matrix[i, j].subs(check.names.table.derived)


def _grouped(repairs: list[Explanation]) -> list[Explanation]:
    # Join explanations of different entries if they name the same mistake.
    groups: dict[tuple[str, str], Explanation] = {}
    for repair in repairs:
        first = groups.get(key := (repair.cause, repair.sentence))
        groups[key] = replace(first, entries=first.entries + repair.entries) if first else repair
    return [*groups.values()]
