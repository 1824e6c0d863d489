"""A calibration in plain sentences, in rows of a table, and as a document for programs."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ...printing import attributes
from ...rigid_motion import roll_pitch_yaw
from ...robot.file.parts.parameters import ENDS, TABLE_GROUPS, end_parameters
from ...typography import listed
from ..checking.errors import length_in_words
from .board_views import view_document
from .checking import COMPLIANCE, NAMES_IN_SENTENCE, PLACEMENT, ZEROS, in_words, value_in_words
from .identified_table import CalibratedParameter
from .placed_camera import camera_sentences, placed_camera
from .result import BLOCKS, Calibration

OF_CONDITION = {
    PLACEMENT: 'Drifts of where the instrument stands, from the first session',
    ZEROS: 'Drifts of the zeros of the joints, from the first session',
    COMPLIANCE: 'Compliances of the joints, by the torque of the load alone',
}
# Behind the held-out errors, before and after.
NO_BETTER = ': no better, within two standard deviations of the difference'
# What a document says of a parameter.
OF_PARAMETER = (
    *('name', 'group', 'unit', 'correction', 'deviation', 'prior'),
    *('identifiable', 'may_be_zero'),
)


def sentences_of(found: Calibration) -> Iterator[str]:
    """Yield what was found, one sentence each."""
    yield from _verdict(found)
    kind, row, rms = found.kind, found.row, found.rms_in_words
    yield (
        f'{rms(found.before)} remain (rms) where only {found.placed} are fitted; with the '
        f'calibrated table {rms(found.after)}'
    )
    yield (
        f'The errors of held-out {kind} ({BLOCKS} blocks of rows) are '
        f'{rms(found.held_out_before)} before, {rms(found.held_out)} after'
        f'{NO_BETTER if found.no_better else ""}'
    )
    if found.outliers:
        every = found.with_outliers
        yield (
            f'With the outliers included they are {rms(every.before)} before, '
            f'{rms(every.after)} after; held out {rms(every.held_out_before)} before, '
            f'{rms(every.held_out)} after'
        )
    noise = in_words(*found.noise, found.positions)
    if found.noise_told:
        yield f'The noise, which the arm cannot explain, is {noise} for each number of a {row}'
    else:
        yield (
            f'There are too few numbers to estimate the noise: {noise} for each number of a {row} '
            'is assumed, and the deviations rest on it (--noise gives that of the instrument)'
        )
    yield (
        f'{found.known} independent combinations of the {len(found.parameters)} parameters are '
        f'identifiable from these {kind}; from any such {kind} at most {found.possible} are'
    )
    yield from _of_conditions(found)
    yield from camera_sentences(found)
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
    if others := [name for name in found.not_identifiable if name not in together]:
        yield f'Not identifiable: {", ".join(others)}; these mostly keep their nominal values'
    if found.outliers:
        yield _outliers(found)
    yield from _starts(found)
    yield from found.remarks


def _verdict(found: Calibration) -> Iterator[str]:
    if found.accepted:
        return
    yield f'This is no calibration: {"; ".join(found.refusals)}'
    if found.explained.decided:
        yield f'What explains it: {found.explained.sentences[0]}'
    elif found.explained.sentences:
        yield f'Tried, not decided: {"; ".join(found.explained.sentences)}'
    elif found.explained.tried:
        yield 'No single mistake that was tried explains it'


def _of_conditions(found: Calibration) -> Iterator[str]:
    # Drifts from session to session, and compliances.
    for group, words in OF_CONDITION.items():
        own = [one for one in found.parameters if one.group == group]
        beyond = [one.name for one in own if not one.may_be_zero]
        if own:
            named = f' ({listed(beyond, NAMES_IN_SENTENCE)})' if beyond else ''
            yield (
                f'{words}, are more than two deviations from zero for {len(beyond)} of {len(own)} '
                f'numbers{named}; by chance one in twenty is. The robot file has none of them'
            )
    for one in found.parameters:
        if one.group == COMPLIANCE and one.identifiable and one.correction < -2.0 * one.deviation:
            yield (
                f'{one.name} is negative, but no joint yields against a torque: look at the '
                'masses, at their centre (--load-at) and at --gravity'
            )


def _starts(found: Calibration) -> Iterator[str]:
    named = {one.name for one in found.parameters}
    frames = (
        'frame 0 of the table, in the frame of the poses',
        "the tool in the last row's frame",
    )
    for end, starts, frame in zip(ENDS, (found.base_starts, found.tool_starts), frames):
        for k, T in enumerate(starts):
            own = {one.name for one in end_parameters(end, k)} & named
            if own:
                xyz = ' '.join(f'{x:.5f}' for x in T[:3, 3])
                rpy = ' '.join(f'{x:.3f}' for x in np.degrees(roll_pitch_yaw(T[:3, :3])))
                yield (
                    f'Corrections of the {min(own).partition(".")[0]} are along its axes, and '
                    f'begin at {xyz} m, roll pitch yaw {rpy} deg: {frame}'
                )


def _outliers(found: Calibration) -> str:
    rows = found.outliers
    images = () if found.views is None else found.views.seen
    names = {k: f'{k} {images[k].name}' if images else f'{k}' for k in rows}
    named = [f'{names[k]} ({found.distances[k]:.0f} sigma)' for k in rows]
    what = 'outlier is' if len(rows) == 1 else 'outliers are'
    shown = listed(named, NAMES_IN_SENTENCE)
    return f'{len(rows)} {what} left out, counted from 0: {found.row} {shown}'


def cells_of(one: CalibratedParameter, found: Calibration) -> tuple[str, str, str, str]:
    """Return name, correction, deviation and whether it is identifiable, as cells of a table."""
    combined = found.known < len(found.parameters)
    alone = 'in a combination' if combined else 'not precise'
    alone = 'assumed' if one.group in TABLE_GROUPS else alone
    known = 'identifiable' if one.identifiable else alone
    return one.name, *_numbers(one.correction, one.deviation, one.unit), known


def _numbers(value: float, deviation: float, unit: str) -> tuple[str, str]:
    sign = '+' if value > 0.0 else ''
    return f'{sign}{value_in_words(value, unit)}', not_nothing(value_in_words(deviation, unit))


def not_nothing(words: str) -> str:
    """Return a deviation or an error in words, where round-off is small and not 0."""
    return f'below 1e-6 {words[2:]}' if words.startswith('0 ') else words


def document_of(found: Calibration, files: Sequence[str]) -> dict[str, Any]:
    """Return everything as a document, in SI units."""
    return {
        'robot': found.robot.name,
        'files': files,
        'poses': found.count,
        'positions_only': found.positions,
        **attributes(found, 'accepted', 'refusals'),
        'explained': attributes(found.explained, 'decided', 'sentences'),
        'outliers': found.outliers,
        'errors': found.without,
        'errors_with_outliers': found.with_outliers,
        **attributes(found, 'noise', 'known', 'possible', 'singular_values'),
        **attributes(found, 'no_better'),
        'parameters': [attributes(one, *OF_PARAMETER) for one in found.parameters],
        'covariance': found.covariance,
        'combinations': [
            attributes(one, 'names', 'determined', 'coefficients', 'sentence')
            for one in found.combinations
        ],
        'points': [
            {**attributes(one, 'name', 'position', 'deviation'), 'touches': one.count}
            for one in found.points
        ],
        **attributes(found, 'base_offsets', 'tool_offsets', 'base_starts', 'tool_starts'),
        'frame_check': None if found.frames is None else found.frames.sentence,
        'camera': [
            attributes(one, 'name', 'frame', 'pose', 'deviation') for one in placed_camera(found)
        ],
        'images': found.views and view_document(found.views, found.left[4]),
        'remarks': found.remarks,
        'sentences': list(sentences_of(found)),
    }
