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


def facts_of(found: Calibration) -> Iterator[str]:
    """
    Yield sentences on the errors of the measured poses, the noise and the identifiable parameters.
    The written robot file has these sentences as comments.
    """
    kind, row, rms = found.kind, found.row, found.rms_in_words
    yield (
        f'{rms(found.without.before)} remain (rms) where only {found.placed} are fitted; with the '
        f'calibrated table {rms(found.without.after)}'
    )
    no_better = ': no better, within two standard deviations of the difference'
    yield (
        f'The errors of held-out {kind} ({BLOCKS} blocks of rows) are '
        f'{rms(found.held_out_before)} before, {rms(found.held_out)} after'
        f'{no_better if found.no_better else ""}'
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
    for one in found.combinations:
        yield one.sentence[0].upper() + one.sentence[1:]


def sentences_of(found: Calibration) -> Iterator[str]:
    """Yield the results of a calibration, one sentence each."""
    yield from _verdict(found)
    yield from facts_of(found)
    together = {name for one in found.combinations for name in one.names}
    if others := [name for name in found.not_identifiable if name not in together]:
        yield f'Not identifiable: {", ".join(others)}; these mostly keep their nominal values'
    yield from _of_conditions(found)
    yield from camera_sentences(found)
    for point in found.points:
        xyz = ', '.join(f'{x:.5f}' for x in point.position)
        off = ', '.join(length_in_words(x) for x in point.deviation)
        yield (
            f'Point {point.name}, touched {point.count} times, is at {xyz} m in the base frame; '
            f'standard deviations {off}'
        )
    if found.outliers:
        yield _outliers(found)
    yield from found.remarks


def _verdict(found: Calibration) -> Iterator[str]:
    if found.accepted:
        return
    yield f'This is no calibration: {"; ".join(found.refusals)}'
    causes = '; '.join(found.explained.sentences)
    if causes:
        how = 'What explains it' if found.explained.decided else 'Tried, not decided'
        yield f'{how}: {causes}'
    elif found.explained.tried:
        yield 'No single mistake that was tried explains it'


def _of_conditions(found: Calibration) -> Iterator[str]:
    # Yield sentences on drifts between sessions and on compliances of joints.
    for group, words in OF_CONDITION.items():
        own = [one for one in found.parameters if one.group == group]
        beyond = [one.name for one in own if not one.may_be_zero]
        if own:
            named = f' ({listed(beyond, NAMES_IN_SENTENCE)})' if beyond else ''
            yield (
                f'{words}, are more than two deviations from zero for {len(beyond)} of {len(own)} '
                f'numbers{named}; by chance one in twenty is. They are not in the robot file'
            )
    for one in found.parameters:
        if one.group == COMPLIANCE and one.identifiable and one.correction < -2.0 * one.deviation:
            yield (
                f'{one.name} is negative, but no joint yields against a torque: look at the '
                'masses, at their centre (--load-at) and at --gravity'
            )


def _outliers(found: Calibration) -> str:
    rows = found.outliers
    names = {k: f' {one.name}' for k, one in enumerate(found.views.seen if found.views else ())}
    named = [f'{k}{names.get(k, "")} ({found.distances[k]:.0f} sigma)' for k in rows]
    what = 'outlier is' if len(rows) == 1 else 'outliers are'
    shown = listed(named, NAMES_IN_SENTENCE)
    return f'{len(rows)} {what} left out, counted from 0: {found.row} {shown}'


def cells_of(one: CalibratedParameter, found: Calibration) -> tuple[str, str, str, str]:
    """
    Return the cells of a parameter for a table: name, correction, standard deviation, and whether
    the parameter is identifiable.
    """
    combined = found.known < len(found.parameters)
    alone = 'in a combination' if combined else 'not precise'
    alone = 'assumed' if one.group in TABLE_GROUPS else alone
    known = 'identifiable' if one.identifiable else alone
    correction = f'{"+" if one.correction > 0.0 else ""}{one.in_words(one.correction)}'
    return one.name, correction, not_nothing(one.in_words(one.deviation)), known


def document_of(found: Calibration, files: Sequence[str]) -> dict[str, Json]:
    """Return all results of a calibration as a dictionary for JSON, in SI units."""
    return {
        'robot': found.robot.name,
        'files': files,
        'poses': found.count,
        'positions_only': found.positions,
        **attributes(found, 'accepted', 'refusals', 'no_better', 'outliers', 'noise'),
        **attributes(found, 'known', 'possible', 'singular_values', 'covariance', 'remarks'),
        'explained': attributes(found.explained, 'decided', 'sentences'),
        'errors': found.without,
        'errors_with_outliers': found.with_outliers,
        'parameters': [attributes(one, *OF_PARAMETER, 'may_be_zero') for one in found.parameters],
        'combinations': found.combinations,
        'points': [
            {**attributes(one, 'name', 'position', 'deviation'), 'touches': one.count}
            for one in found.points
        ],
        **attributes(found, 'base_offsets', 'tool_offsets', 'base_starts', 'tool_starts'),
        'frame_check': None if found.frames is None else found.frames.sentence,
        'camera': placed_camera(found),
        'images': found.views and view_document(found.views, found.left[4]),
        'sentences': list(sentences_of(found)),
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


def placed_camera(found: Calibration) -> tuple[PlacedThing, ...]:
    """
    Return the poses of camera and board; empty if no camera was used.

    If the poses were measured in several sets, camera and board are those of the first set.
    """
    if found.camera is None:
        return ()
    on_tool, still = ('camera', 'board') if found.camera == ON_TOOL else ('board', 'camera')
    description = found.robot.description
    tool, base = description.tool.motion.matrix, description.base.motion.matrix
    of_tool = _deviation(found, 'tool', found.tool_starts[0], tool[:3, :3].T)
    of_base = _deviation(found, 'base', inverse(found.base_starts[0]), base[:3, :3])
    return (
        PlacedThing(on_tool, 'tool', found.tool_offsets[0], of_tool),
        PlacedThing(still, 'base', inverse(found.base_offsets[0]), of_base),
    )


def _deviation(found: Calibration, end: str, behind: Floats, R: Floats) -> Floats:
    # Return the standard deviations of the pose of a camera or board, shape (2, 3): position and
    # rotation. The corrections of base or tool translate a frame by t and rotate it by w. In this
    # frame, the camera or board has the pose `behind`, with the position p. So the corrections
    # move the camera or board by t + w x p. R rotates this motion into the axes in which the pose
    # is written. Corrections that are not fitted are taken as exact.
    own, columns = found.fitted_of([one.name for one in end_parameters(end, 0)])
    moved = np.eye(6)
    moved[:3, 3:] = -np.cross(np.eye(3), behind[:3, 3])
    turned = np.kron(np.eye(2), R) @ moved[:, own]
    covariance = turned @ found.covariance[np.ix_(columns, columns)] @ turned.T
    return np.sqrt(np.diag(covariance)).reshape(2, 3)


def camera_sentences(found: Calibration) -> Iterator[str]:
    """
    Yield sentences on the poses of camera and board, and on the errors of the corners in the
    images.
    """
    yield from (one.sentence for one in placed_camera(found))
    if found.camera is not None:
        yield 'All errors are those of the board, as the camera sees it'
    if found.views is not None:
        yield from view_sentences(found.views, found.left[4], found.outliers)
