# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Audit an open file: turn its blocks of joint states into a timeline and findings."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import numpy as np

from ....errors import RecordingError
from ....estimation import outcomes
from ....estimation.estimator import Estimator, EstimatorSettings
from ....kernel import Floats
from ....robot.measures import MEASURES, Level
from ....robot.robot import Robot
from ..plans.verdicts import PlanCheck
from ..readers.block import Block
from ..readers.source import RecordingSource, Remark
from ..readers.stored_columns import spans
from .computer import Computer
from .frames import FrameReport, FrameSettings, NotCompared, frames_of
from .ingest import Ingest, RefusedExample
from .intervals import Interval, badness, intervals_of, watched_at
from .joints import JointReport, Jump, joint_reports, jumps_of
from .planned import PlanSettings, checks_of
from .slowing import Slowing, SlowingSettings, slowing_of
from .stream import Stream, StreamWatch
from .timeline import Timeline, TimelineBatch

# If no message names a joint of the arm, the error lists at most this number of joint names from
# the messages.
MAX_NAMES = 12


class WorstMoment(NamedTuple):
    """
    The state of a recording at which a quantity, such as the tool speed, is worst: name of the
    quantity, row of the state in the timeline, and value as text.
    """

    quantity: str
    row: int
    value: str


@dataclass(frozen=True, eq=False)
class Audit:
    """
    All results about a recording.

    Attributes
    ----------
    file, kind, topic, planned, remarks
        Properties of the file. `file` is its name and `kind` its type, such as a bag; the others
        are as in `RecordingSource`.
    counts, examples
        Number of messages by outcome (accepted, or a reason of refusal), and the first refused
        message for each reason.
    moments
        For each quantity, such as tool speed, the state at which it is worst.
    frames
        Comparison of the computed tool poses with tool poses that another device measured (the
        second source), or the reason why no comparison was possible. None if the file has no
        measured poses.
    trajectories, plans
        The number of planned trajectories, and their checks, by trajectory number from 1.
    plan_settings
        The requested limits for planned trajectories: least distance to singular poses, and
        largest speed.
    slowing
        Where `ks.scale`, the function that slows motions near singular poses, would have slowed
        the motion; None if this was not requested.
    """

    robot: Robot
    file: str
    kind: str
    topic: str
    planned: bool
    remarks: tuple[Remark, ...]
    counts: dict[str, int]
    examples: dict[str, RefusedExample]
    stream: Stream
    timeline: Timeline
    intervals: tuple[Interval, ...]
    joints: tuple[JointReport, ...]
    jump_count: int
    jumps: tuple[Jump, ...]
    moments: tuple[WorstMoment, ...]
    frames: FrameReport | NotCompared | None
    trajectories: int = 0
    plans: Mapping[int, PlanCheck] = field(default_factory=dict)
    plan_settings: PlanSettings = PlanSettings()
    slowing: Slowing | None = None

    @property
    def refused(self) -> dict[str, int]:
        """Return how many messages gave no state of the arm, by the reason of their refusal."""
        other = (outcomes.ACCEPTED, outcomes.NOT_STAMPED, outcomes.RESETS, outcomes.NOT_OURS)
        return {reason: n for reason, n in self.counts.items() if n and reason not in other}

    @property
    def damaged(self) -> bool:
        """Return whether a checksum of the recording is wrong."""
        return any(remark.level == Level.ERROR for remark in self.remarks)


class AuditSettings(NamedTuple):
    """
    Settings of an audit.

    Attributes
    ----------
    estimator
        Settings of the state estimator, which turns messages into joint positions and velocities.
    frames
        Settings of the comparison with tool poses that a second source measured.
    plans
        Settings of the check of plans.
    slowing
        Settings of `ks.scale`, the function that slows motions near singular poses. None: do not
        compute where it would have slowed the motion.
    """

    estimator: EstimatorSettings = EstimatorSettings()
    frames: FrameSettings = FrameSettings()
    plans: PlanSettings = PlanSettings()
    slowing: SlowingSettings | None = None


DEFAULT = AuditSettings()


def audit(
    source: RecordingSource,
    robot: Robot,
    file: str,
    settings: AuditSettings = DEFAULT,
    progress: Callable[[int], None] = lambda messages: None,
    write: Callable[[TimelineBatch], None] | None = None,
) -> Audit:
    """
    Return the audit of an open recording or planned trajectory.

    Parameters
    ----------
    progress
        A function that is called with the number of messages, or of checked plans, since its last
        call.
    write
        A function that writes each batch of computed states to a file; None: no file is written.

    Raises
    ------
    RecordingError
        No message gives a state of the arm, the file is damaged, or a setting applies only to
        plans.
    """
    plan_settings, prefix = settings.plans, settings.estimator.joint_prefix
    if not source.planned and plan_settings.speeds_requested:
        raise RecordingError(
            f'{file}: --speed-limit and --speed-of are for plans, and this is a recording; leave '
            'them out',
            code='conflict',
        )
    estimator = Estimator(robot, settings.estimator)
    ingest, watch = Ingest(robot, estimator), StreamWatch(estimator.names)
    computer, names = Computer(robot, ingest), dict[str, None]()
    for block in source.blocks:
        batch = computer.take(block)
        watch.take(block)
        if isinstance(block, Block) and len(names) < MAX_NAMES:
            names.update(dict.fromkeys(block.names))
        if batch is not None and write is not None:
            write(batch)
        progress(len(block))
    timeline = computer.timeline
    if not len(timeline):
        raise _without_states(f'{file}: {source.topic}', estimator, ingest, tuple(names))
    jump_count, jumps = jumps_of(robot, timeline)
    joints = joint_reports(robot, timeline)
    track, frames = source.poses(), None
    if track is not None:
        frames = frames_of(robot, track, timeline, settings.frames)
    plans = checks_of(robot, source, prefix, plan_settings, progress)
    return Audit(
        robot=robot,
        file=file,
        kind=source.kind,
        topic=source.topic,
        planned=source.planned,
        remarks=tuple(source.remarks),
        counts=dict(ingest.counts),
        examples=ingest.examples,
        stream=watch.stream(),
        timeline=timeline,
        intervals=intervals_of(robot, timeline),
        joints=joints,
        jump_count=jump_count,
        jumps=jumps,
        moments=tuple(_moments(robot, timeline, joints, jumps)),
        frames=frames,
        trajectories=len(source.plans),
        plans=plans,
        plan_settings=plan_settings,
        slowing=settings.slowing and slowing_of(robot, timeline, settings.slowing),
    )


def _without_states(
    where: str, estimator: Estimator, ingest: Ingest, names: tuple[str, ...]
) -> RecordingError:
    # Returns the error about a recording in which no message gives a state of the arm. `where`
    # names the file and its topic.
    robot, joints = estimator.robot, ', '.join(estimator.names)
    if not ingest.counts:
        return RecordingError(f'{where}: has no messages; record it anew', code='empty')
    if ingest.counts[outcomes.NOT_OURS] == sum(ingest.counts.values()):
        shown = ', '.join(names[:MAX_NAMES]) or 'nothing'
        return RecordingError(
            f'{where}: no message names a joint of {robot.name} ({joints}); they name {shown}',
            code='missing-joint',
        )
    reasons = ', '.join(f'{n} {reason}' for reason, n in ingest.counts.items() if n)
    example = next((e.sentence for e in ingest.examples.values() if e.sentence), '')
    example = f' (for instance: {example})' if example else ''
    return RecordingError(
        f'{where}: no message gives a pose of {robot.name}: {reasons}{example}', code='no-states'
    )


def _moments(
    robot: Robot, timeline: Timeline, joints: tuple[JointReport, ...], jumps: tuple[Jump, ...]
) -> Iterator[WorstMoment]:
    worst, _ = _largest(len(timeline), partial(badness, robot, timeline))
    value = watched_at(robot, timeline, worst)
    measure = MEASURES[robot.singularity.thresholds.measure]
    shown = measure.farther(value) or f'{value:.3g}'
    yield WorstMoment(f'nearest to a singularity ({measure.words})', worst, shown)
    for quantity, column, unit in (
        ('fastest tool motion', timeline.speed, 'm/s'),
        ('fastest tool rotation', timeline.turning, 'rad/s'),
    ):
        row, value = _largest(len(column), column.__getitem__)
        if value > 0.0:
            yield WorstMoment(quantity, row, f'{value:.3g} {unit}')
    for j, joint in enumerate(joints):
        yield from _moments_of_joint(timeline, j, joint)
    if jumps:
        largest = max(jumps, key=lambda jump: abs(jump.step))
        quantity = f'largest jump ({largest.joint})'
        yield WorstMoment(quantity, largest.row, f'{largest.step:+.3g}')


def _moments_of_joint(timeline: Timeline, j: int, joint: JointReport) -> Iterator[WorstMoment]:
    unit, name = 'm' if joint.sliding else 'rad', joint.name
    if joint.beyond:
        q = timeline.q.columns[j]
        row, value = _largest(
            len(q), lambda rows: np.maximum(joint.lower - q[rows], q[rows] - joint.upper)
        )
        yield WorstMoment(f'{name} farthest beyond its limit', row, f'{value:.3g} {unit}')
    if joint.too_fast:
        row, _ = _largest(len(timeline), lambda rows: np.abs(timeline.qdot.columns[j][rows]))
        quantity = f'{name} above its velocity limit of {joint.velocity_limit:.3g}'
        yield WorstMoment(quantity, row, f'{joint.fastest:.3g} {unit}/s')
    check = joint.check
    if check is not None and check.worst > 0.1 * check.speed:
        quantity = f'{name}: reported velocity farthest from its positions'
        yield WorstMoment(quantity, check.row, f'{check.worst:.3g} {unit}/s')


def _largest(count: int, values_of: Callable[[slice], Floats]) -> tuple[int, float]:
    # Returns the first of `count` rows at which `values_of` is largest, and this value. NaN is
    # ignored; the value is -inf if all values are NaN.
    row, largest = 0, -math.inf
    for rows in spans(count):
        values = values_of(rows)
        known = np.where(np.isnan(values), -np.inf, values)
        k = int(np.argmax(known))
        if known[k] > largest:
            row, largest = rows.start + k, float(known[k])
    return row, largest
