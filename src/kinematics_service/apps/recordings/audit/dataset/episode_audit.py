# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Audit the episodes of a dataset one by one. Each arm of an episode gives one row of the table of
results.
"""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .....errors import KinematicsError
from .....kernel import Integers
from .....output_file import new_file
from .....rigid_motion import rotation_vector
from .....robot.measures import Level
from .....typography import counted
from ....checking.errors import Errors, PoseLimit, angle_in_words, length_in_words
from ....checking.other_robots import explains, left_by, other_robot
from ...datasets.arms import DatasetArm, arms_of, crossed_with
from ...datasets.episodes import Episode
from ...datasets.open_episode import open_episode
from ...datasets.vectors import Columns, columns_of_episode
from ...readers.source import PoseTrack, RecordingSource, Selection
from ..auditing import Audit, AuditSettings, audit
from ..findings import Finding
from ..frames import FrameReport
from ..joints import look_like_degrees
from ..report.audit_runs import failed_by, no_frames
from ..verdict import verdict_of
from .continuity import break_findings
from .labels import labels_of_arms

# The base frame in which the poses were measured may differ from the base frame of the robot file.
# A finding is made if the distance between the origins of the two frames exceeds this (m).
BASE_TOLERANCE = 0.01
# A finding is made if the rotation from the robot file's base frame to the base frame of the
# measured poses exceeds this (rad).
BASE_ANGLE_TOLERANCE = 0.02
# A limit that no difference between measured and computed poses exceeds. If it is given as the
# largest acceptable difference, no cause of a difference is searched.
ANY_REMAINDER = PoseLimit(math.inf, math.inf)

# Recordings that combine the measured tool poses of one arm with the joint positions of another
# arm. Each has the label of the arm whose joints it uses.
Crossed = Sequence[tuple[str, RecordingSource]]


class EpisodeWork(NamedTuple):
    """
    Settings of the audit of an episode.

    Attributes
    ----------
    reading, settings
        How to read the joint columns, and the settings of the audit of a recording.
    failures
        Words of `--fail-on`: the kinds of findings that fail the episode. None: the default of
        `--fail-on`.
    labels
        The folder for files with labels of all rows, such as the distance to singular poses; None:
        no labels are written.
    clearance
        Whether the labels contain the clearance: a radius (rad) around the joint positions within
        which it is proved that no pose is singular.
    """

    reading: Selection
    settings: AuditSettings
    failures: tuple[str, ...] | None
    labels: Path | None = None
    clearance: bool = False


class EpisodeRow(NamedTuple):
    """
    The result for one arm in one episode.

    Attributes
    ----------
    name, arm
        Names of the episode and of the arm; the arm is empty for a single arm.
    rows, seconds
        Number of rows of the episode, and time (s) from the first to the last row.
    failed
        Whether the episode meets a condition of `--fail-on`, or cannot be judged.
    error, code
        The reason why the episode cannot be judged, and its code; empty if it was judged.
    disagrees
        Whether measured and computed tool poses differ by at least the limit of WARN.
    findings
        Findings, the worst first.
    """

    name: str
    arm: str
    rows: int
    seconds: float
    failed: bool
    error: str
    code: str
    disagrees: bool
    findings: tuple[Finding, ...]

    @property
    def level(self) -> Level:
        """
        Return the worst level (OK, WARN, ERROR) of the findings; ERROR if the episode cannot be
        judged.
        """
        return Level.ERROR if self.error else self.findings[0].level


class EpisodeBatch(NamedTuple):
    """
    Episodes that one process audits. Successive episodes are usually in the same data file.

    In the episodes that `sought` marks, the cause of a difference between measured and computed
    tool poses is searched even if the difference is small. The cause of a large difference is
    searched only in the first `max_searches` episodes that have a large difference.
    """

    work: EpisodeWork
    max_searches: int
    episodes: tuple[Episode, ...]
    sought: tuple[bool, ...]


def rows_of_batch(batch: EpisodeBatch) -> list[list[EpisodeRow]]:
    """
    Return for each episode the rows of the result table, one row for each arm. An unreadable
    episode has one row, with the error message.
    """
    frames, rows, remaining = batch.work.settings.frames, [], batch.max_searches
    for episode, sought in zip(batch.episodes, batch.sought):
        fine = frames.fine if sought else frames.limits.warn if remaining > 0 else ANY_REMAINDER
        settings = batch.work.settings._replace(frames=frames._replace(fine=fine))
        work = batch.work._replace(settings=settings)
        rows.append(_rows(work, episode))
        remaining -= any(row.disagrees for row in rows[-1])
    return rows


def _rows(work: EpisodeWork, episode: Episode) -> list[EpisodeRow]:
    # Returns a table row for each arm of an episode.
    try:
        columns = columns_of_episode(episode)
        arms = arms_of(columns.header, work.reading, episode.rate)
        rows = [_row(work, episode, columns, arm, arms) for arm in arms]
        if work.labels is not None:
            file = labels_file(work.labels, episode)
            labels = labels_of_arms(episode.file, columns, arms, work.clearance)
            _write_labels(file, np.arange(len(columns)) + episode.first, labels)
    except KinematicsError as error:
        return [EpisodeRow(episode.name, '', 0, 0.0, True, str(error), error.code, False, ())]
    return rows


def _row(
    work: EpisodeWork,
    episode: Episode,
    columns: Columns,
    arm: DatasetArm,
    arms: Sequence[DatasetArm],
) -> EpisodeRow:
    source = open_episode(episode, columns, arm)
    robot = work.reading.robot
    finished = audit(source, robot, episode.name, work.settings)
    findings = [*_rows_at_fault(finished), *_breaks(finished)]
    if missing := no_frames(finished, work.failures):
        findings.append(Finding(Level.ERROR, missing))
    disagrees = False
    if isinstance(finished.frames, FrameReport):
        disagrees = finished.frames.level > Level.OK
        crossed = [
            (other.label, open_episode(episode, columns, crossed_with(arm, other)))
            for other in arms
            if other is not arm
        ]
        if work.settings.frames.fine != ANY_REMAINDER:
            findings += _frames(finished, finished.frames, source, crossed)
    # Put findings of level ERROR first, then WARN. Within a level keep the order of the list, in
    # which findings about causes, such as missing frames, precede findings about effects.
    findings = sorted([*findings, *verdict_of(finished)], key=lambda finding: -finding.level)
    failed, end = failed_by(finished, work.failures), finished.timeline.end
    return EpisodeRow(
        episode.name, arm.label, len(columns), end, failed, '', '', disagrees, tuple(findings)
    )


def _rows_at_fault(finished: Audit) -> Iterator[Finding]:
    # Report every frame (table row) that gives no state of the arm. In a recording a few messages
    # without a state are usual, but in a dataset each frame without a state is a fault.
    if refused := dict(finished.refused):
        reasons = ', '.join(f'{reason} ({number:,})' for reason, number in refused.items())
        text = f'{counted(sum(refused.values()), "frame")} without a pose: {reasons}.'
        yield Finding(Level.WARN, text)
    if look_like_degrees(finished.joints):
        yield Finding(
            Level.ERROR,
            'The joints are no radians: say what they are, --joint-format deg, percent (of the '
            "limits), or FILE.json with the arm's calibration or the dataset's statistics.",
        )


def _breaks(finished: Audit) -> Iterator[Finding]:
    timeline = finished.timeline
    stamps = np.diff(timeline.stamps[:])
    # If the stamps have a gap, another finding reports the gap. Evenly spaced stamps do not prove
    # that no frame is missing, because stamps may be computed from row numbers. So search the
    # joint positions for missing, repeated and outlying frames.
    if len(stamps) and np.max(stamps) < 1.5 * np.median(stamps):
        q = timeline.q[:]
        wraps = np.array(finished.robot.continuous)
        yield from break_findings(np.where(wraps, np.unwrap(q, axis=0), q), timeline.t[:])


def _frames(
    finished: Audit, report: FrameReport, source: RecordingSource, crossed: Crossed
) -> Iterator[Finding]:
    track, diagnosis = source.poses(), report.diagnosis
    cause = diagnosis.cause
    if cause is not None:
        if cause.key == 'time_lag' and cause.value is not None:
            frames = abs(cause.value) / finished.stream.median_interval
            yield Finding(Level.ERROR, f'The lag is {frames:.3g} frames.')
        return
    if diagnosis.errors.within(report.limits.warn):
        yield from _base(report)
    elif track is not None:
        yield from _others(finished, report, track, crossed)


def _base(report: FrameReport) -> Iterator[Finding]:
    X = report.diagnosis.base_offset
    if report.diagnosis.undetermined:
        return
    far = float(np.linalg.norm(X[:3, 3]))
    turned = float(np.linalg.norm(rotation_vector(X[:3, :3])))
    if far > BASE_TOLERANCE or turned > BASE_ANGLE_TOLERANCE:
        x, y, z = (length_in_words(float(number)) for number in X[:3, 3])
        yield Finding(
            Level.WARN,
            f'The poses are given in another base frame: that of the robot file is at {x}, {y}, '
            f'{z} in it, turned by {angle_in_words(turned)}.',
        )


def _others(
    finished: Audit, report: FrameReport, track: PoseTrack, crossed: Crossed
) -> Iterator[Finding]:
    # Yields a finding in two cases. The measured poses fit the joint positions of another arm of
    # the dataset. Or they fit the joint positions of this arm with another robot model.
    if track.q is None:
        return
    robot, errors, limit = finished.robot, report.diagnosis.errors, report.limits.warn
    tried: list[tuple[str, Errors | None]] = []
    for label, source in crossed:
        for _ in source.blocks:
            pass  # only read to the end: then source.poses() is complete
        theirs = source.poses()
        if theirs is not None and theirs.q is not None and theirs.q.shape == track.q.shape:
            tried.append((f'the {label} arm', left_by(robot, theirs.q, track.poses)))
    model = other_robot(robot, errors, track.q, track.poses, limit)
    if model is not None:
        tried.append((f'the robot {model.name}', model.left))
    good = [(whose, residual) for whose, residual in tried if explains(residual, errors, limit)]
    if good:
        whose, residual = min(good, key=lambda pair: pair[1].position_rms)
        text = f'The poses are those of {whose}: with its joints {residual.in_words()} remain.'
        yield Finding(Level.ERROR, text)


def _write_labels(file: Path, rows: Integers, labels: dict[str, Any]) -> None:
    import pyarrow as pa
    import pyarrow.parquet as parquet

    file.parent.mkdir(parents=True, exist_ok=True)
    with new_file(file) as made:
        parquet.write_table(pa.table({'row': pa.array(rows), **labels}), made)


def labels_file(folder: Path, episode: Episode) -> Path:
    """Return the path of the file with the labels of an episode."""
    name, _, part = episode.name.partition(':')
    stem = str(Path(name).with_suffix(''))
    return folder / (f'{stem}/{part.replace("/", "_")}.parquet' if part else f'{stem}.parquet')
