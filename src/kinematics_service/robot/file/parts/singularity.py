"""The singularity section of a robot file: task, thresholds, factors."""

from collections.abc import Sequence
from typing import Any

from ..text.entries import checked, checked_list, did_you_mean, meant_by
from ..text.expression_syntax import names_in
from ..text.fault_report import FaultReport, number, quoted
from ..text.yaml_document import Path
from .description import Factor, SingularityDescription
from .measure_table import MEASURES, Measure
from .quantities import Kind, Quantities
from .schema import FactorEntry, SingularityEntry

ROWS = ('x', 'y', 'z', 'rx', 'ry', 'rz')
# The measure of a file that names none.
USUAL = 'distance'
PATH: Path = ('singularity',)


def read_singularity(data: Any, quantities: Quantities) -> SingularityDescription | None:
    """Return the section with its defaults, or None with its faults reported."""
    if data is None:
        usual = MEASURES[USUAL]
        return SingularityDescription(None, None, USUAL, usual.warn, usual.stop, ())
    report = quantities.report
    before = report.fault_count
    entry = checked(SingularityEntry, data, PATH, report)
    intact = report.fault_count == before
    task = None
    if entry.task is not None:
        task = read_rows(entry.task, 'direction', (*PATH, 'task'), report)
    length = quantities.above_zero(entry.length, 'length', (*PATH, 'length'), usual=True)
    factors = () if entry.factors is None else _factors(entry.factors, quantities)
    if not intact:
        return None  # what has been refused would be taken for the default
    measure = MEASURES[entry.measure or USUAL]
    thresholds = _thresholds(entry, measure, quantities)
    if thresholds is None or report.fault_count > before:
        return None
    return SingularityDescription(task, length, measure.name, *thresholds, factors)


def read_rows(
    words: Sequence[str | None], noun: str, path: Path, report: FaultReport
) -> tuple[str, ...]:
    """Return rows of a Jacobian in their order, each once; `noun` is what a message calls one."""
    accepted = f'(accepted: {", ".join(ROWS)})'
    if not words:
        report.fault(path, f'is empty {accepted}')
    for index, word in enumerate(words):
        if word is not None and word not in ROWS:
            hint = did_you_mean(meant_by(word, ROWS))
            report.fault((*path, index), f'unknown {noun} {quoted(word)}{hint} {accepted}')
        elif word in words[:index]:
            report.fault((*path, index), f'{word!r} stands twice')
    return tuple(row for row in ROWS if row in words)


def _thresholds(
    entry: SingularityEntry, measure: Measure, quantities: Quantities
) -> tuple[float, float] | None:
    report = quantities.report
    kind: Kind = 'angle' if measure.unit == 'rad' else 'number'
    texts = {'warn': entry.warn, 'stop': entry.stop}
    defaults = {'warn': measure.warn, 'stop': measure.stop}
    values: dict[str, float] = {}
    for key, text in texts.items():
        path, value = (*PATH, key), defaults[key]
        if text is not None:
            value = quantities.fixed(text, kind, path, usual=False)
            if value is not None and (refusal := measure.refusal(value)):
                report.fault(path, f'a threshold of the {measure.words} {refusal}')
                continue
        elif value is None:
            message = f'the key {key!r} is missing: {measure.name} has no default threshold'
            report.fault(path, message)
        if value is not None:
            values[key] = value
    if len(values) < 2:
        return None
    warn, stop = values['warn'], values['stop']
    if not measure.ordered(warn, stop):
        word = 'below' if measure.small_is_bad else 'above'
        stated = [
            f'{key} {number(values[key])}' + (' (the default)' if text is None else '')
            for key, text in texts.items()
        ]
        report.fault(
            (*PATH, 'stop'), f'stop must be {word} warn for {measure.name}: {", ".join(stated)}'
        )
        return None
    return warn, stop


def _factors(data: Any, quantities: Quantities) -> tuple[Factor, ...]:
    report, path = quantities.report, (*PATH, 'factors')
    factors: list[Factor] = []
    for index, item in enumerate(checked_list(data, path, report, 'a list of {name, expression}')):
        place = (*path, index)
        entry = checked(FactorEntry, item, place, report)
        if entry.name in [factor.name for factor in factors]:
            report.fault((*place, 'name'), f'{quoted(entry.name)} is already a factor')
        if entry.expression is None:
            continue
        where = (*place, 'expression')
        text = quantities.function(entry.expression, where)
        if text is None:
            continue
        if not names_in(text) & set(quantities.joint_types):
            report.fault(where, 'names no joint variable: it never changes')
        factors.append(Factor(entry.name or '', text, bool(entry.approximate)))
    return tuple(factors)
