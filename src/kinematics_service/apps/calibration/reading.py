# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read measured poses with the joint positions at their times, and tables of touched points."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...errors import CalibrationError, KinematicsError
from ...estimation.estimator import Estimator, EstimatorSettings
from ...kernel import Floats
from ...rigid_motion import inverses
from ...robot.robot import Robot
from ..checking.diagnosis import CAUSE_POSES, diagnose_frames
from ..checking.errors import time_in_words
from ..checking.joint_motion import SampledMotion
from ..recordings.audit.frames import ChosenPoses, chosen_poses, matched
from ..recordings.audit.ingest import Ingest
from ..recordings.audit.neighbourhoods import joined
from ..recordings.audit.reported_velocities import MotionColumns
from ..recordings.readers.arm_columns import STAMPS
from ..recordings.readers.block import Times, UnreadableMessage
from ..recordings.readers.open_file import TABLES, open_source
from ..recordings.readers.source import RecordingSource, Selection
from ..recordings.readers.stamp_format import StampFormat, stamp_format
from ..recordings.readers.table_rows import table_of
from .boards.board import BoardFinder, SeenCorners

# The column that names the image of each row.
IMAGE = 'image'


@dataclass(frozen=True, eq=False)
class MeasuredRecording:
    """
    Measured poses of one file, with the joint positions at the times of the poses.

    Attributes
    ----------
    file
        The file.
    q : shape (N, n), rad or m
        Joint positions.
    poses : shape (N, 4, 4)
        Measured poses, m.
    kind
        How the orientations were read, such as `rpy` (see `PoseFormat`); `position` if only
        positions were measured.
    rates : shape (N, n), rad/s or m/s
        Joint velocities; zero if they are not known.
    remarks
        Sentences on what was left out or changed.
    rows : shape (N,)
        Index of the table row of each pose, from 0; None if the file is not a table.
    """

    file: str
    q: Floats
    poses: Floats
    kind: str
    rates: Floats
    remarks: tuple[str, ...]
    rows: Times | None = None

    @property
    def positions(self) -> bool:
        """Return whether the measured poses are positions alone, without orientations."""
        return self.kind == 'position'

    @property
    def measured(self) -> Floats:
        """Return the poses (N, 4, 4), or the positions (N, 3) if only positions were measured."""
        return self.poses[:, :3, 3] if self.positions else self.poses


def read_measured(
    file: Path, reading: Selection, gap: float | None, on_tool: bool
) -> MeasuredRecording:
    """
    Return the measured poses of a file, with the joint positions at the times of the poses.

    If the frame check finds a lag between poses and joint states, the joint positions are taken
    at times shifted by the lag. Poses at times without joint states are left out.

    Parameters
    ----------
    reading
        The robot, topics and columns to read, as for an audit.
    gap : s
        Largest time between the joint states before and after a pose; None: three times the usual
        time between joint states.
    on_tool
        Whether the poses are those of a board that stands still, seen by a camera on the tool.

    Raises
    ------
    RecordingError
        The file cannot be read.
    CalibrationError
        The file has no poses, or no joint positions at the times of the poses.
    """
    with open_source(file, standing_poses(file, reading)) as source:
        states = _states(source, reading)
        track = source.poses()
        remarks = [remark.text for remark in source.remarks]
    if track is None:
        advice = '--pose-topic (bags) or their columns with --columns pose=... (tables)'
        if source.pose_topics:
            advice = f'--pose-topic: poses are on {source.pose_topics}'
        message = f'{file}: no measured poses; name their topic with {advice}'
        raise CalibrationError(message, code='no-poses')
    if track.refused:
        raise CalibrationError(f'{file}: {track.name}: {track.refused}', code='refused-poses')
    pairs = joined(reading.robot, track, states)
    use, reason = matched(pairs, gap)
    if not np.any(use):
        raise CalibrationError(f'{file}: {track.name}: {reason or "no poses"}', code='no-poses')
    chosen = chosen_poses(track, pairs, use)
    total = track.total or len(track.stamps)
    if len(chosen.rows) < np.sum(use) or len(track.stamps) < total:
        remarks.append(f'{len(chosen.rows):,} of {total:,} poses are used, evenly spread')
    remarks += [*([reason] if reason else []), *track.doubts]
    q, known = chosen.q, np.ones(len(chosen.q), dtype=bool)
    rates = np.zeros_like(q)
    if chosen.motion is not None:
        motion = SampledMotion(*chosen.motion, reading.robot.continuous)
        joints = motion.at(chosen.stamps)
        rates = np.where(joints.known[:, None], joints.rates, 0.0)
        if lag := _lag_of(reading.robot, chosen, track.kind, on_tool):
            q, rates, known = motion.at(chosen.stamps + lag)
            side = 'behind' if lag < 0.0 else 'ahead of'
            far = time_in_words(abs(lag))
            remarks.append(f'the poses are {far} {side} the joint states: undone')
    rows = None if track.rows is None else track.rows[pairs.poses[chosen.rows]][known]
    return MeasuredRecording(
        str(file), q[known], chosen.poses[known], track.kind, rates[known], tuple(remarks), rows
    )


def _lag_of(robot: Robot, chosen: ChosenPoses, kind: str, on_tool: bool) -> float:
    # Return the lag (s) that the frame check finds, or 0. A pose belongs to the joint positions at
    # the time of the pose plus the lag.
    q, poses, stamps, motion = chosen.q, chosen.poses, chosen.stamps, chosen.motion
    if motion is None or kind == 'position' or len(q) < CAUSE_POSES:
        return 0.0
    poses = inverses(poses) if on_tool else poses
    try:
        cause = diagnose_frames(robot, q, poses, stamps, motion=motion, read=kind).cause
    except KinematicsError:
        return 0.0  # `calibrate` runs the same frame check again, and reports the error
    return cause.value or 0.0 if cause is not None and cause.key == 'time_lag' else 0.0


def standing_poses(file: Path, reading: Selection) -> Selection:
    """
    Return `reading`, the selection of what is read from a file. If the file is a table without
    stamps, the returned selection has the stamp format `none`, because the arm stood still in each
    row.
    """
    if file.suffix.lower() not in TABLES or not file.is_file() or reading.stamps != StampFormat():
        return reading
    heads = {head.lower() for head in table_of(file).header}
    if heads & set(STAMPS) or 'stamp=' in (reading.columns or ''):
        return reading
    return reading._replace(stamps=stamp_format('none'))


def read_positions(file: Path, reading: Selection) -> Floats:
    """
    Return the joint positions (N, n), rad or m, of a file; poses in the file are ignored.

    Raises
    ------
    RecordingError
        The file cannot be read.
    """
    with open_source(file, standing_poses(file, reading)) as source:
        return _states(source, reading).q[:]


def _states(source: RecordingSource, reading: Selection) -> MotionColumns:
    robot, settings = reading.robot, EstimatorSettings(reading.joint_prefix)
    ingest, states = Ingest(robot, Estimator(robot, settings)), MotionColumns(robot.dof)
    for known in map(ingest.take, source.blocks):
        if len(known):
            states.add(known.stamps, known.q, known.qdot, known.differenced)
    return states


def cells_beside(given: MeasuredRecording, column: str) -> list[str]:
    """
    Return the cells of a table column, one for each measured pose that was read from the table.

    Raises
    ------
    CalibrationError
        The file is not a table, the table has no such column, or a cell is empty.
    """
    if given.rows is None or Path(given.file).suffix.lower() not in TABLES:
        message = f'{given.file}: not a table, so without a column {column!r}; give a table (.csv)'
        raise CalibrationError(message, code='not-a-table')
    entries = _column(Path(given.file), column)
    cells = [entries[k] for k in given.rows.tolist()]
    if '' in cells:
        row = int(given.rows[cells.index('')])
        raise CalibrationError(
            f'{given.file}: column {column!r}: row {row}, counted from 0, is empty; fill it in',
            code='empty',
        )
    return cells


@dataclass(frozen=True, eq=False)
class TouchRecording:
    """
    The touches that one file contains.

    Attributes
    ----------
    file
        The file.
    q : shape (N, n), rad or m
        Joint positions.
    points : N
        Names of the touched points.
    approach : shape (N, n), rad/s or m/s
        Joint velocities with which the tip came to the point; None if the table has no velocities.
    remarks
        Sentences on what was left out.
    """

    file: str
    q: Floats
    points: tuple[str, ...]
    approach: Floats | None
    remarks: tuple[str, ...]


def read_touches(
    file: Path, reading: Selection, column: str, kind: str = 'point'
) -> TouchRecording:
    """
    Read a table, and return the joint positions of each row and the name that the row has in
    `column`.

    The names are those of touched points, or of other things if `kind` is not `point`, for example
    of images if it is `image`. Rows without a name are left out.

    Raises
    ------
    RecordingError
        The file cannot be read.
    CalibrationError
        The file is not a table, has no such column, or a named row lacks a joint position.
    """
    if file.exists() and file.suffix.lower() not in TABLES:
        message = f'{file}: not a table, so without a column {column!r}; give a table (.csv)'
        raise CalibrationError(message, code='not-a-table')
    with open_source(file, standing_poses(file, reading)) as source:
        blocks = [block for block in source.blocks if not isinstance(block, UnreadableMessage)]
        remarks = [remark.text for remark in source.remarks]
    q = np.concatenate([block.positions for block in blocks])
    names = np.array(_column(file, column)[: len(q)])
    named = names != ''
    came = np.concatenate([block.velocities for block in blocks])
    approach = np.nan_to_num(came[named]) if came.shape == q.shape else None
    missing = np.flatnonzero(named & ~np.all(np.isfinite(q), axis=1))
    if len(missing):
        raise CalibrationError(
            f'{file}: row {missing[0]}, counted from 0, lacks the position of a joint; fill it in',
            code='empty',
        )
    if not np.all(named):
        count = int(np.sum(~named))
        verbs = ('row names', 'is') if count == 1 else ('rows name', 'are')
        remarks.append(f'{count} {verbs[0]} no {kind} and {verbs[1]} left out')
    return TouchRecording(
        str(file), q[named], tuple(names[named].tolist()), approach, tuple(remarks)
    )


def read_images(
    file: Path, reading: Selection, folder: Path, finder: BoardFinder
) -> tuple[TouchRecording, tuple[SeenCorners | str, ...]]:
    """
    Return the rows of a table that name images, and for each image the corners of the board. If
    corners are missing in an image, a sentence with the reason takes their place.

    Raises
    ------
    RecordingError
        The table or an image cannot be read.
    CalibrationError
        The table has no column `image`, which names files of the folder; or the images are
        mirrored.
    """
    rows = read_touches(file, reading, IMAGE, IMAGE)
    files = [folder / name for name in rows.points]
    for name, image in zip(rows.points, files):
        if not image.is_file():
            message = f'{folder}: no image {name!r}; write names with their endings'
            raise CalibrationError(message, code='missing-file')
        if files.count(image) > 1:
            message = f'{file}: two rows name the image {image.name}; leave one out'
            raise CalibrationError(message, code='duplicate-name')
    seen = tuple(finder.corners_in(image) for image in files)
    if all(isinstance(view, str) for view in seen) and any(map(finder.is_mirrored_in, files)):
        raise CalibrationError(
            f'{folder}: the images or the board are mirrored; give images that are not, of a '
            'board as it is drawn',
            code='mirrored',
        )
    return replace(rows, points=tuple(image.name for image in files)), seen


def _column(file: Path, column: str) -> list[str]:
    # Return the cells of a table column. Skip empty lines, as the reader of the table does.
    table = table_of(file)
    if column not in table.header:
        message = f'{file}: no column {column!r}; the header has {", ".join(table.header)}'
        raise CalibrationError(message, code='unknown-name')
    at = table.header.index(column)
    with table.opened() as stream:
        return [row[at].strip() if at < len(row) else '' for _, row in table.cells(stream)]
