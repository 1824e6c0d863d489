# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write a comparison as text with a block for each formula, or as one JSON object."""

import math
from collections.abc import Iterator

from ....errors import FormulaError
from ....printing import Json, attributes, plain
from ....typography import counted
from .causes.explanation import Explanation
from .comparison import AGREES, Comparison, Verdict

# Maximum number of wrong entries that the report lists for one formula.
MAX_ENTRIES = 12


def report(comparison: Comparison, file: str, verbose: bool = False) -> Iterator[str]:
    """
    Yield the lines of a comparison's report as text.

    Parameters
    ----------
    comparison
        The comparison to report.
    file
        The name of the file of formulas.
    verbose
        Whether to name the tested causes if no cause explains a difference.
    """
    verdicts = comparison.verdicts
    wrong = sum(verdict.status != AGREES for verdict in verdicts)
    yield f'{file} against {comparison.robot.name}: {_count(len(verdicts), wrong)}'
    yield _method(comparison)
    for unused in comparison.passed_over:
        yield f'passed over: line {unused.line}: {unused.message}'
    for verdict in verdicts:
        yield ''
        yield from _verdict(verdict, verbose)


def _count(formulas: int, wrong: int) -> str:
    if not wrong:
        return 'the formula agrees' if formulas == 1 else f'all {formulas} formulas agree'
    return f'{wrong} of {counted(formulas, "formula")} differ{"s" if wrong == 1 else ""}'


def _method(comparison: Comparison) -> str:
    if comparison.robot.chain.loops:
        return (
            'Compared as numbers at random poses at which the loops close; no causes are tested.'
        )
    lengths = ', '.join(comparison.randomised)
    randomly = f' and with random {lengths}' if lengths else ''
    return f'Compared as numbers at random poses{randomly}; each cause below was tested there.'


def _verdict(verdict: Verdict, verbose: bool) -> Iterator[str]:
    place = f'{verdict.name} (line {verdict.line})'
    size = math.prod(verdict.shape)
    if verdict.status == AGREES:
        yield f'{place} agrees'
    elif not verdict.entries or size == 1:
        yield f'{place} differs'
    else:
        yield f'{place} differs in {len(verdict.entries)} of {size} entries'
    for remark in verdict.remarks:
        yield f'  {remark}'
    yield from _entries(verdict, size)
    for cause in verdict.causes:
        yield from _cause(cause, verdict)
    if verdict.unexplained and (verdict.tried or verdict.causes):
        entries = 'it' if verdict.unexplained == size == 1 else f'{verdict.unexplained} of them'
        entries = 'them' if verdict.unexplained == len(verdict.entries) > 1 else entries
        hint = '' if verbose or not verdict.tried else ' (--verbose: which were tested)'
        yield f'  no tested cause explains {entries}{hint}'
    if verbose and verdict.tried:
        yield f'  tested: {", ".join(verdict.tried)}'


def _entries(verdict: Verdict, size: int) -> Iterator[str]:
    for entry in verdict.entries[:MAX_ENTRIES]:
        label = f', {verdict.labels[entry.row]}' if verdict.labels else ''
        where = f'({entry.row + 1},{entry.column + 1}){label}: ' if size > 1 else ''
        right = f', right is {entry.right}' if entry.right else ''
        yield f'  {where}yours is {entry.yours}{right}'
    if len(verdict.entries) > MAX_ENTRIES:
        yield f'  and {len(verdict.entries) - MAX_ENTRIES} more'


def _cause(cause: Explanation, verdict: Verdict) -> Iterator[str]:
    part = ''
    if len(cause.entries) < len(verdict.entries):
        part = ', for ' + ', '.join(f'({i + 1},{j + 1})' for i, j in cause.entries)
    yield f'  cause{part}: {cause.sentence}'
    for other in cause.also:
        yield f'    or, equally possible: {other}'


def faults_in_words(comparison: Comparison, file: str) -> list[str]:
    """Return each error of a file of formulas as `file:line:column: message`."""
    return [
        plain(f'{file}:{fault.line}:{fault.column}: {fault.message}')
        for fault in comparison.faults
    ]


def error_document(comparison: Comparison, file: str) -> dict[str, Json]:
    """Return the object that `--json` prints for a file of formulas with errors."""
    faults = [
        {'file': file, **attributes(fault, 'line', 'column', 'message', 'code')}
        for fault in comparison.faults
    ]
    message = '\n'.join(faults_in_words(comparison, file))
    return {'error': {'code': FormulaError.code, 'message': message, 'faults': faults}}


def document(comparison: Comparison, file: str) -> dict[str, Json]:
    """Return a comparison as the object that `--json` prints."""
    return {
        'robot': comparison.robot.name,
        'file': file,
        **attributes(comparison, 'agrees', 'poses'),
        'random_constants': list(comparison.randomised),
        'passed_over': [
            attributes(fault, 'line', 'message', 'code') for fault in comparison.passed_over
        ],
        'formulas': [_json(verdict) for verdict in comparison.verdicts],
    }


def _json(verdict: Verdict) -> dict[str, Json]:
    return {
        **attributes(verdict, 'name', 'line', 'status'),
        'rows': verdict.shape[0],
        'columns': verdict.shape[1],
        'remarks': list(verdict.remarks),
        'entries': [
            {
                'row': entry.row + 1,
                'column': entry.column + 1,
                'yours': entry.yours,
                'right': entry.right or None,
                'largest_difference': entry.difference,
            }
            for entry in verdict.entries
        ],
        'causes': [
            {
                'name': cause.cause,
                'sentence': cause.sentence,
                'entries': [[i + 1, j + 1] for i, j in cause.entries],
                'alternatives': list(cause.also),
            }
            for cause in verdict.causes
        ],
        'unexplained': verdict.unexplained,
        'tested': list(verdict.tried),
    }
