"""A calibration in plain sentences, in rows of a table, and as a document for programs."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from ..frame_check.errors import Errors, angle_in_words, length_in_words, time_in_words
from .calibration import BLOCKS, CalibratedParameter, Calibration
from .checking import in_words
from .parameters import GEARS, LAG, TABLE_GROUPS

# Outliers named in a sentence.
MOST_NAMED = 8


def kind_of(found: Calibration) -> str:
    """Return what was measured, in a word."""
    if found.points:
        return 'touches'
    return 'positions' if found.positions else 'poses'


def sentences_of(found: Calibration) -> Iterator[str]:
    """Yield what was found, one sentence each."""

    def rms(errors: Errors) -> str:
        return in_words(errors.position_rms, errors.rotation_rms, found.positions)

    fitted = 'tip and points' if found.points else 'base and tool'
    yield (
        f'With {fitted} fitted alone {rms(found.before)} remain (rms); with the calibrated '
        f'table {rms(found.after)}'
    )
    yield (
        f'Of {kind_of(found)} held out, over {BLOCKS} blocks of rows: '
        f'{rms(found.held_out_before)} before, {rms(found.held_out)} after'
    )
    row = 'touch' if found.points else 'pose'
    noise = in_words(found.noise.position, found.noise.rotation, found.positions)
    yield f'What the arm cannot explain is {noise} for each number of a {row}'
    kind = kind_of(found)
    yield (
        f'These {kind} tell {found.known} directions of the {len(found.parameters)} parameters; '
        f'any such {kind} could tell {found.possible}'
    )
    for point in found.points:
        xyz = ', '.join(f'{x:.5f}' for x in point.position)
        off = ', '.join(length_in_words(x) for x in point.deviation)
        yield (
            f'Point {point.name}, touched {point.count} times, is at {xyz} m in the base frame; '
            f'standard deviations {off}'
        )
    for one in found.combinations:
        yield one.sentence[0].upper() + one.sentence[1:]
    together = {name for one in found.combinations for name in one.names}
    if untold := [name for name in found.untold if name not in together]:
        yield f'Too little is told of {", ".join(untold)}: they mostly stay as they were'
    if found.outliers:
        yield _outliers(found)
    yield from found.remarks


def _outliers(found: Calibration) -> str:
    rows = found.outliers[:MOST_NAMED]
    named = ', '.join(f'{k} ({found.distances[k]:.0f} sigma)' for k in rows)
    more = len(found.outliers) - len(rows)
    row = 'touch' if found.points else 'pose'
    what = 'outlier is' if len(found.outliers) == 1 else 'outliers are'
    rest = f' and {more} more' if more else ''
    return f'{len(found.outliers)} {what} left out, counted from 0: {row} {named}{rest}'


def cells_of(one: CalibratedParameter) -> tuple[str, str, str, str]:
    """Return name, correction, deviation and whether the poses tell it, as cells of a table."""
    words: Callable[[float], str] = angle_in_words if one.angle else length_in_words
    if one.group == LAG.group:
        words = time_in_words
    elif one.group == GEARS:
        words = _share
    sign = '+' if one.correction > 0.0 else ''
    told = 'told' if one.told else 'by its prior' if one.group in TABLE_GROUPS else 'together'
    return one.name, f'{sign}{words(one.correction)}', not_nothing(words(one.deviation)), told


def not_nothing(words: str) -> str:
    """Return a deviation or an error in words, where round-off is small and not 0."""
    return f'below 1e-6 {words[2:]}' if words.startswith('0 ') else words


def _share(value: float) -> str:
    return f'{100.0 * value:.3g} %'


def _unit(one: CalibratedParameter) -> str:
    return {LAG.group: 's', GEARS: ''}.get(one.group, 'rad' if one.angle else 'm')


def document_of(found: Calibration, files: Sequence[str]) -> dict[str, Any]:
    """Return everything as a document, in SI units."""
    return {
        'robot': found.robot.name,
        'files': list(files),
        'poses': found.count,
        'positions_only': found.positions,
        'outliers': list(found.outliers),
        'errors': {
            name: dict(getattr(found, name)._asdict())
            for name in ('as_given', 'before', 'after', 'held_out_before', 'held_out')
        },
        'noise': dict(found.noise._asdict()),
        'known': found.known,
        'possible': found.possible,
        'singular_values': found.singular_values,
        'parameters': [
            {
                'name': one.name,
                'group': one.group,
                'unit': _unit(one),
                'correction': one.correction,
                'deviation': one.deviation,
                'prior': one.prior,
                'told': one.told,
            }
            for one in found.parameters
        ],
        'covariance': found.covariance,
        'combinations': [
            {
                'names': list(one.names),
                'determined': one.determined,
                'coefficients': list(one.coefficients),
                'sentence': one.sentence,
            }
            for one in found.combinations
        ],
        'points': [
            {
                'name': one.name,
                'position': list(one.position),
                'deviation': list(one.deviation),
                'touches': one.count,
            }
            for one in found.points
        ],
        'base_offsets': found.base_offsets,
        'tool_offsets': found.tool_offsets,
        'frame_check': None if found.frames is None else found.frames.sentence,
        'remarks': list(found.remarks),
        'sentences': list(sentences_of(found)),
    }
