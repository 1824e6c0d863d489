# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read the section `singularity` of a robot file: task, measure, thresholds and factors."""

from collections.abc import Sequence

from ..text.entries import checked, checked_list, did_you_mean, meant_by
from ..text.expression_syntax import names_in
from ..text.fault_report import Place, number, quoted
from ..text.yaml_document import Yaml
from .description import Factor, SingularityDescription
from .measure_table import MEASURES, Measure, default_measure
from .quantities import Kind, Quantities
from .schema import FactorEntry, SingularityEntry

ROWS = ('x', 'y', 'z', 'rx', 'ry', 'rz')


def read_singularity(data: Yaml, quantities: Quantities) -> SingularityDescription | None:
    """
    Read the section `singularity` of a robot file. Missing keys get default values. Report faults;
    after a fault return None.
    """
    usual = default_measure(len(quantities.joint_types))
    if data is None:
        return SingularityDescription(measure=usual.name, warn=usual.warn, stop=usual.stop)
    at = quantities.top['singularity']
    entry = checked(SingularityEntry, data, at)
    intact = at.intact
    task = None
    if entry.task is not None:
        task = read_rows(entry.task, 'direction', at['task'])
    length = quantities.above_zero(entry.length, 'length', at['length'], usual=True)
    factors = () if entry.factors is None else _factors(entry.factors, at['factors'], quantities)
    if not intact:
        return None  # a default value must not replace a value with a fault
    measure = MEASURES[entry.measure or usual.name]
    thresholds = _thresholds(entry, measure, at, quantities)
    if thresholds is None or not at.intact:
        return None
    return SingularityDescription(task, length, measure.name, *thresholds, factors)


def read_rows(words: Sequence[str | None], noun: str, at: Place) -> tuple[str, ...]:
    """
    Return the names of Jacobian rows in the order x y z rx ry rz, and report faults.

    `noun` is the word that messages use for a row of the Jacobian.
    """
    accepted = f'(accepted: {", ".join(ROWS)})'
    if not words:
        at.fault(f'is empty {accepted}', 'empty')
    before: set[str | None] = set()
    for index, word in enumerate(words):
        if word is not None and word not in ROWS:
            hint = did_you_mean(meant_by(word, ROWS))
            at[index].fault(f'unknown {noun} {quoted(word)}{hint} {accepted}', 'unknown-name')
        elif word in before:
            at[index].fault(f'{word!r} is listed twice', 'duplicate-name')
        before.add(word)
    return tuple(row for row in ROWS if row in before)


def _thresholds(
    entry: SingularityEntry, measure: Measure, at: Place, quantities: Quantities
) -> tuple[float, float] | None:
    kind: Kind = 'angle' if measure.unit == 'rad' else 'number'
    texts = {'warn': entry.warn, 'stop': entry.stop}
    values: dict[str, float] = {}
    for key, text in texts.items():
        value: float | None = getattr(measure, key)
        if text is not None:
            value = quantities.fixed(text, kind, at[key], usual=False)
        elif value is None:
            message = f'the key {key!r} is missing: {measure.name} has no default threshold'
            at[key].fault(message, 'missing-key')
        if value is not None and (refusal := measure.refusal(value)):
            at[key].fault(f'a threshold of the {measure.words} {refusal}', 'out-of-range')
        elif value is not None:
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
        message = f'stop must be {word} warn for {measure.name}: {", ".join(stated)}'
        at['stop'].fault(message, 'wrong-order')
        return None
    return warn, stop


def _factors(data: Yaml, at: Place, quantities: Quantities) -> tuple[Factor, ...]:
    factors: list[Factor] = []
    for index, item in enumerate(checked_list(data, at, 'a list of {name, expression}')):
        entry = checked(FactorEntry, item, at[index])
        if entry.name in [factor.name for factor in factors]:
            message = f'{quoted(entry.name)} is already the name of a factor'
            at[index, 'name'].fault(message, 'duplicate-name')
        if entry.expression is None:
            continue
        where = at[index, 'expression']
        text = quantities.function(entry.expression, where)
        if text is None:
            continue
        if not names_in(text) & set(quantities.joint_types):
            where.fault('has no joint variable, so it never changes', 'no-effect')
        factors.append(Factor(entry.name or '', text, bool(entry.approximate)))
    return tuple(factors)
