# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Report a calibration as sentences, as rows of a table, and as a document for programs."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...kernel import Floats
from ...printing import Json, attributes
from ...rigid_motion import inverse, roll_pitch_yaw
from ...robot.file.parts.parameters import TABLE_GROUPS, end_parameters
from ...typography import listed
from ..checking.errors import angle_in_words, length_in_words
from .board_views import view_document, view_sentences
from .camera import ON_TOOL
from .checking import COMPLIANCE, NAMES_IN_SENTENCE, PLACEMENT, ZEROS, in_words, not_nothing
from .identified_table import CalibratedParameter
from .result import BLOCKS, Calibration

# For a group of parameters (drifts or compliances), the first words of the report's sentence about
# the group.
OF_CONDITION = {
    PLACEMENT: 'Drifts of where the instrument stands, from the first session',
    ZEROS: 'Drifts of the zeros of the joints, from the first session',
    COMPLIANCE: 'Compliances of the joints, by the torque of the load alone',
}
# Attributes of each fitted parameter that the JSON document contains.
OF_PARAMETER = ('name', 'group', 'unit', 'correction', 'deviation', 'prior', 'identifiable')


def facts_of(result: Calibration) -> Iterator[str]:
    """
    Yield sentences on the errors of the measured poses, the noise and the identifiable parameters.
    The written robot file has these sentences as comments.
    """
    kind, row, rms = result.kind, result.row, result.rms_in_words
    yield (
        f'{rms(result.without.before)} remain (rms) where only {result.placed} are fitted; with '
        f'the calibrated table {rms(result.without.after)}'
    )
    no_better = ': no better, within two standard deviations of the difference'
    yield (
        f'The errors of held-out {kind} ({BLOCKS} blocks of rows) are '
        f'{rms(result.held_out_before)} before, {rms(result.held_out)} after'
        f'{no_better if result.no_better else ""}'
    )
    if result.outliers:
        included = result.with_outliers
        yield (
            f'With the outliers included they are {rms(included.before)} before, '
            f'{rms(included.after)} after; held out {rms(included.held_out_before)} before, '
            f'{rms(included.held_out)} after'
        )
    noise = in_words(*result.noise, result.positions)
    if result.noise_told:
        yield f'The noise, which the arm cannot explain, is {noise} for each number of a {row}'
    else:
        yield (
            f'There are too few numbers to estimate the noise: {noise} for each number of a {row} '
            'is assumed, and the deviations rest on it (--noise gives that of the instrument)'
        )
    yield (
        f'{result.known} independent combinations of the {len(result.parameters)} parameters are '
        f'identifiable from these {kind}; from any such {kind} at most {result.possible} are'
    )
    for combination in result.combinations:
        yield combination.sentence[0].upper() + combination.sentence[1:]


def sentences_of(result: Calibration) -> Iterator[str]:
    """Yield the results of a calibration, one sentence each."""
    yield from _verdict(result)
    yield from facts_of(result)
    together = {name for combination in result.combinations for name in combination.names}
    if others := [name for name in result.not_identifiable if name not in together]:
        yield f'Not identifiable: {", ".join(others)}; these mostly keep their nominal values'
    yield from _of_conditions(result)
    yield from camera_sentences(result)
    for point in result.points:
        xyz = ', '.join(f'{x:.5f}' for x in point.position)
        off = ', '.join(length_in_words(x) for x in point.deviation)
        yield (
            f'Point {point.name}, touched {point.count} times, is at {xyz} m in the base frame; '
            f'standard deviations {off}'
        )
    if result.outliers:
        yield _outliers(result)
    yield from result.remarks


def _verdict(result: Calibration) -> Iterator[str]:
    if result.accepted:
        return
    yield f'This is no calibration: {"; ".join(result.refusals)}'
    if causes := '; '.join(result.explained.sentences):
        heading = 'What explains it' if result.explained.decided else 'Tried, not decided'
        yield f'{heading}: {causes}'
    elif result.explained.tried:
        yield 'No single mistake that was tried explains it'


def _of_conditions(result: Calibration) -> Iterator[str]:
    # Yield sentences on drifts between sessions and on compliances of joints.
    for name, text in OF_CONDITION.items():
        group = [parameter for parameter in result.parameters if parameter.group == name]
        large = [parameter.name for parameter in group if not parameter.may_be_zero]
        if group:
            named = f' ({listed(large, NAMES_IN_SENTENCE)})' if large else ''
            yield (
                f'{text}, are more than two deviations from zero for {len(large)} of {len(group)} '
                f'numbers{named}; by chance one in twenty is. They are not in the robot file'
            )
    for parameter in result.parameters:
        negative = parameter.correction < -2.0 * parameter.deviation
        if parameter.group == COMPLIANCE and parameter.identifiable and negative:
            yield (
                f'{parameter.name} is negative, but no joint yields against a torque: look at the '
                'masses, at their centre (--load-at) and at --gravity'
            )


def _outliers(result: Calibration) -> str:
    rows = result.outliers
    views = result.views.seen if result.views else ()
    names = {k: f' {view.name}' for k, view in enumerate(views)}
    named = [f'{k}{names.get(k, "")} ({result.distances[k]:.0f} sigma)' for k in rows]
    noun = 'outlier is' if len(rows) == 1 else 'outliers are'
    shown = listed(named, NAMES_IN_SENTENCE)
    return f'{len(rows)} {noun} left out, counted from 0: {result.row} {shown}'


def cells_of(entry: CalibratedParameter, result: Calibration) -> tuple[str, str, str, str]:
    """
    Return the cells of a parameter for a table: name, correction, standard deviation, and whether
    the parameter is identifiable.
    """
    combined = result.known < len(result.parameters)
    alone = 'in a combination' if combined else 'not precise'
    alone = 'assumed' if entry.group in TABLE_GROUPS else alone
    known = 'identifiable' if entry.identifiable else alone
    correction = f'{"+" if entry.correction > 0.0 else ""}{entry.in_words(entry.correction)}'
    return entry.name, correction, not_nothing(entry.in_words(entry.deviation)), known


def document_of(result: Calibration, files: Sequence[str]) -> dict[str, Json]:
    """Return all results of a calibration as a dictionary for JSON, in SI units."""
    return {
        'robot': result.robot.name,
        'files': files,
        'poses': result.count,
        'positions_only': result.positions,
        **attributes(result, 'accepted', 'refusals', 'no_better', 'outliers', 'noise'),
        **attributes(result, 'known', 'possible', 'singular_values', 'covariance', 'remarks'),
        'explained': attributes(result.explained, 'decided', 'sentences'),
        'errors': result.without,
        'errors_with_outliers': result.with_outliers,
        'parameters': [
            attributes(entry, *OF_PARAMETER, 'may_be_zero') for entry in result.parameters
        ],
        'combinations': result.combinations,
        'points': [
            {**attributes(point, 'name', 'position', 'deviation'), 'touches': point.count}
            for point in result.points
        ],
        **attributes(result, 'base_offsets', 'tool_offsets', 'base_starts', 'tool_starts'),
        'frame_check': None if result.frames is None else result.frames.sentence,
        'camera': placed_camera(result),
        'images': result.views and view_document(result.views, result.left[4]),
        'sentences': list(sentences_of(result)),
    }


class PlacedThing(NamedTuple):
    """
    The pose of the camera or of the board.

    Attributes
    ----------
    name, frame
        `camera` or `board`, and the frame of the robot file that its pose is in: `tool` or `base`.
    pose : shape (4, 4)
        Pose in that frame, m.
    deviation : shape (2, 3), m and rad
        Standard deviations of the position along, and of the rotation about, the axes of `frame`.
    """

    name: str
    frame: str
    pose: Floats
    deviation: Floats

    @property
    def sentence(self) -> str:
        """Return the pose and its standard deviations as a sentence."""
        xyz = ', '.join(f'{x:.5f}' for x in self.pose[:3, 3])
        rpy = ', '.join(f'{x:.3f}' for x in np.degrees(roll_pitch_yaw(self.pose[:3, :3])))
        lengths = ', '.join(map(length_in_words, self.deviation[0].tolist()))
        angles = ', '.join(map(angle_in_words, self.deviation[1].tolist()))
        return (
            f'The {self.name} is at x, y, z {xyz} m, roll, pitch, yaw {rpy} deg in the '
            f'{self.frame} frame; standard deviations {lengths}; {angles}'
        )


def placed_camera(result: Calibration) -> tuple[PlacedThing, ...]:
    """
    Return the poses of camera and board; empty if no camera was used.

    If the poses were measured in several sets, camera and board are those of the first set.
    """
    if result.camera is None:
        return ()
    on_tool, still = ('camera', 'board') if result.camera == ON_TOOL else ('board', 'camera')
    description = result.robot.description
    tool, base = description.tool.motion.matrix, description.base.motion.matrix
    of_tool = _deviation(result, 'tool', result.tool_starts[0], tool[:3, :3].T)
    of_base = _deviation(result, 'base', inverse(result.base_starts[0]), base[:3, :3])
    return (
        PlacedThing(on_tool, 'tool', result.tool_offsets[0], of_tool),
        PlacedThing(still, 'base', inverse(result.base_offsets[0]), of_base),
    )


def _deviation(result: Calibration, end: str, behind: Floats, R: Floats) -> Floats:
    # Return the standard deviations of the pose of a camera or board, shape (2, 3): position and
    # rotation. Let F be the frame that the corrections of base or tool move: they translate F by t
    # and rotate F by w. The camera or board is fixed in F, with the pose `behind` and the position
    # p. So the corrections move the camera or board by t + w x p. R rotates this motion into the
    # axes in which the pose is written. Corrections that are not fitted are taken as exact.
    axes, columns = result.fitted_of([parameter.name for parameter in end_parameters(end, 0)])
    moved = np.eye(6)
    moved[:3, 3:] = -np.cross(np.eye(3), behind[:3, 3])
    turned = np.kron(np.eye(2), R) @ moved[:, axes]
    covariance = turned @ result.covariance[np.ix_(columns, columns)] @ turned.T
    return np.sqrt(np.diag(covariance)).reshape(2, 3)


def camera_sentences(result: Calibration) -> Iterator[str]:
    """
    Yield sentences on the poses of camera and board, and on the errors of the corners in the
    images.
    """
    yield from (thing.sentence for thing in placed_camera(result))
    if result.camera is not None:
        yield 'All errors are those of the board, as the camera sees it'
    if result.views is not None:
        yield from view_sentences(result.views, result.left[4], result.outliers)
