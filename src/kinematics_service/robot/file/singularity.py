"""The singularity section of a robot file: task, thresholds, factors."""

import math
from collections.abc import Sequence
from typing import Any, get_args

from .description import Factor, Measure, SingularityDescription
from .entries import checked, checked_list, did_you_mean, meant_by
from .expression_syntax import names_in
from .fault_report import number, quoted
from .quantities import Kind, Quantities
from .schema import FactorEntry, SingularityEntry
from .yaml_document import Path

ROWS = ('x', 'y', 'z', 'rx', 'ry', 'rz')
# distance: about 6 and 2 degrees. condition_number: MoveIt Servo's lower_singularity_threshold
# and hard_stop_singularity_threshold.
DEFAULTS: dict[str, tuple[float, float]] = {
    'distance': (0.1, 0.03),
    'condition_number': (17.0, 30.0),
}
PATH: Path = ('singularity',)


def read_singularity(data: Any, quantities: Quantities) -> SingularityDescription | None:
    """Return the section with its defaults, or None with its faults reported."""
    if data is None:
        return SingularityDescription(None, None, 'distance', *DEFAULTS['distance'], ())
    report = quantities.report
    before = report.fault_count
    entry = checked(SingularityEntry, data, PATH, report)
    intact = report.fault_count == before
    task = None if entry.task is None else _task(entry.task, quantities)
    length = quantities.fixed(entry.length, 'length', (*PATH, 'length'))
    if length is not None and length <= 0.0:
        report.fault((*PATH, 'length'), f'must be above 0, not {entry.length}')
    factors = () if entry.factors is None else _factors(entry.factors, quantities)
    if not intact:
        return None  # what has been refused would be taken for the default
    measure = next(name for name in get_args(Measure) if name == (entry.measure or 'distance'))
    thresholds = _thresholds(entry, measure, quantities)
    if thresholds is None or report.fault_count > before:
        return None
    return SingularityDescription(task, length, measure, *thresholds, factors)


def _task(words: Sequence[str | None], quantities: Quantities) -> tuple[str, ...]:
    report, path = quantities.report, (*PATH, 'task')
    accepted = f'(accepted: {", ".join(ROWS)})'
    if not words:
        report.fault(path, f'is empty {accepted}')
    seen: set[str | None] = set()
    for index, word in enumerate(words):
        if word is not None and word not in ROWS:
            hint = did_you_mean(meant_by(word, ROWS))
            report.fault((*path, index), f'unknown direction {quoted(word)}{hint} {accepted}')
        elif word in seen:
            report.fault((*path, index), f'{word!r} stands twice')
        seen.add(word)
    return tuple(row for row in ROWS if row in seen)


def _thresholds(
    entry: SingularityEntry, measure: Measure, quantities: Quantities
) -> tuple[float, float] | None:
    report = quantities.report
    kind: Kind = 'angle' if measure == 'distance' else 'number'
    texts = {'warn': entry.warn, 'stop': entry.stop}
    values: dict[str, float] = {}
    for position, (key, text) in enumerate(texts.items()):
        path = (*PATH, key)
        if text is None and measure in DEFAULTS:
            values[key] = DEFAULTS[measure][position]
            continue
        if text is None:
            message = f'the key {key!r} is missing: {measure} has no default threshold'
            report.fault(path, message)
            continue
        value = quantities.fixed(text, kind, path, usual=False)
        if value is not None and _in_range(value, measure, path, quantities):
            values[key] = value
    if len(values) < 2:
        return None
    warn, stop = values['warn'], values['stop']
    ordered = warn < stop if measure == 'condition_number' else stop < warn
    if not ordered:
        word = 'above' if measure == 'condition_number' else 'below'
        stated = [
            f'{key} {number(values[key])}' + (' (the default)' if text is None else '')
            for key, text in texts.items()
        ]
        report.fault(
            (*PATH, 'stop'), f'stop must be {word} warn for {measure}: {", ".join(stated)}'
        )
        return None
    return warn, stop


def _in_range(value: float, measure: Measure, path: Path, quantities: Quantities) -> bool:
    if measure == 'distance' and not 0.0 < value <= math.pi:
        half_turn = '180 deg' if quantities.units.angle == 'deg' else 'pi'
        message = f'a distance is an angle above 0 and at most {half_turn}'
    elif measure == 'condition_number' and value <= 1.0:
        message = f'a condition number is above 1, not {number(value)}'
    elif value <= 0.0:
        message = f'must be above 0, not {number(value)}'
    else:
        return True
    quantities.report.fault(path, message)
    return False


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
        factors.append(Factor(entry.name or '', text))
    return tuple(factors)
