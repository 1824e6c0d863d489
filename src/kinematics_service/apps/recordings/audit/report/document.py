# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Return the results of an audit as one JSON object."""

from collections.abc import Callable
from functools import partial

import numpy as np

from .....kernel import Floats
from .....kinematics.singularity import singularity_of
from .....kinematics.singularity_rates import measured_before
from .....kinematics.tool_state import evaluate
from .....printing import Json, attributes
from .....rigid_motion import roll_pitch_yaw
from .....robot.measures import MEASURES, Level
from .....version import __version__
from ....checking.causes import TestedCause
from ....checking.diagnosis import FrameDiagnosis
from ...plans.verdicts import PlanCheck, PlanMoment
from ...readers.block import Times
from ..auditing import Audit
from ..frames import NotCompared
from ..intervals import badness
from ..timeline import Timeline
from ..verdict import verdict_of

# Largest number of states that the document lists. A longer recording is divided into equal
# intervals, and only the first state and the state nearest to a singularity are listed of each
# interval.
MAX_ROWS = 10_000


def thinned_rows(count: int, max_rows: int, worse: Callable[[slice], Floats]) -> Times:
    """
    Return row numbers from 0 to `count` - 1: all of them, or a selection of at most `max_rows`.

    If `count` exceeds `max_rows`, divide all rows into `max_rows` / 2 equal intervals. Select two
    rows of each interval: the first row, and the row at which `worse` is largest.

    Parameters
    ----------
    worse
        A function that returns a value for each row of a slice.
    """
    if count <= max_rows:
        return np.arange(count)
    edges = np.linspace(0, count, max(max_rows // 2, 1) + 1).astype(int)
    worst = [a + int(np.argmax(worse(slice(a, b)))) for a, b in zip(edges, edges[1:])]
    return np.unique(np.concatenate([edges[:-1], worst]))


def document_of(audit: Audit) -> dict[str, Json]:
    """
    Return the audit as a dictionary that `printing.json_text` writes as JSON; units m, rad, s.
    """
    robot, timeline = audit.robot, audit.timeline
    findings = verdict_of(audit)
    rows = thinned_rows(len(timeline), MAX_ROWS, partial(badness, robot, timeline))
    return {
        'version': __version__,
        'file': audit.file,
        'kind': audit.kind,
        **attributes(audit, 'topic', 'planned'),
        'robot': robot.name,
        **attributes(robot, 'joint_names', 'base_frame', 'tool_frame'),
        **attributes(robot.singularity.thresholds, 'measure', 'warn', 'stop'),
        'level': max(finding.level for finding in findings).name,
        'verdict': [
            {'level': finding.level.name, 'code': finding.code, 'sentence': finding.text}
            for finding in findings
        ],
        'messages': {
            'total': audit.stream.messages,
            'states': len(timeline),
            'refused': sum(audit.refused.values()),
            'by_outcome': audit.counts,
            'first_refused': audit.examples,
        },
        'stream': {'rate': audit.stream.rate, **audit.stream._asdict()},
        'intervals': [
            {
                'factor': interval.factor or None,
                'factors': [
                    {
                        'name': passed.name,
                        'motion': passed.distance,
                        't': float(timeline.t[passed.row]),
                    }
                    for passed in interval.factors
                ],
                'level': interval.level.name,
                **attributes(interval, 'begin', 'end', 'stopped'),
                'duration': interval.seconds,
                'first_message': int(timeline.messages[interval.first]),
                'last_message': int(timeline.messages[interval.last]),
                'worst': {
                    'value': interval.value,
                    **_at(timeline, interval.worst),
                    'q': interval.q,
                    'lost_direction': interval.lost,
                    'joints_against_each_other': interval.fighting,
                },
            }
            for interval in audit.intervals
        ],
        'joints': audit.joints,
        'jumps': {'count': audit.jump_count, 'first': audit.jumps},
        'worst_moments': [
            {'what': moment.quantity, 'value': moment.value, **_at(timeline, moment.row)}
            for moment in audit.moments
        ],
        'warnings': [
            {
                't': float(timeline.t[warning.row]),
                'level': warning.status_text.level.name,
                'sentence': warning.status_text.sentence,
            }
            for warning in audit.timeline.warnings
        ],
        'frames': _frames(audit),
        'slowing': _slowing(audit),
        'plans': [_plan(number, check) for number, check in audit.plans.items()],
        'series': _series(audit, rows),
    }


def _at(timeline: Timeline, row: int) -> dict[str, Json]:
    return {
        't': float(timeline.t[row]),
        'stamp': int(timeline.stamps[row]),
        'message': int(timeline.messages[row]),
    }


def _slowing(audit: Audit) -> dict[str, Json] | None:
    if audit.slowing is None:
        return None
    return {
        'unknown': audit.slowing.unknown,
        'seconds': dict(audit.slowing.by_cause),
        'stretches': [
            {
                **attributes(stretch, 'begin', 'end', 'cause', 'value'),
                't': float(audit.timeline.t[stretch.worst]),
            }
            for stretch in audit.slowing.stretches
        ],
    }


def _plan(number: int, check: PlanCheck) -> dict[str, Json]:
    singularity, closure = check.singularity, check.closure
    return {
        'trajectory': number,
        'verdict': check.verdict,
        'singularity': {
            'verdict': singularity.verdict,
            'distance_asked': singularity.threshold,
            'distance_proved': singularity.lower,
            'distance_found': singularity.upper,
            **_moment(singularity.moment),
            **attributes(singularity, 'nearest_singular', 'undecided'),
            'clearances': singularity.evaluations,
        },
        'closure': None
        if closure is None
        else {
            **attributes(closure, 'verdict', 'samples'),
            'loop': closure.loop or None,
            **({} if closure.moment is None else _moment(closure.moment)),
        },
        'joints': [
            {
                **attributes(joint, 'name', 'limits', 'speed'),
                **{name: _extreme(joint, name) for name in ('least', 'greatest', 'fastest')},
            }
            for joint in check.joints
        ],
        'speeds': [
            {
                **attributes(speed, 'of', 'verdict', 'limit', 'lower', 'upper'),
                **_moment(speed.moment),
            }
            for speed in check.speeds
        ],
    }


def _extreme(joint: object, name: str) -> dict[str, Json]:
    extreme = getattr(joint, name)
    return {'value': extreme.value, **_moment(extreme.moment)}


def _moment(moment: PlanMoment) -> dict[str, Json]:
    return {'t': moment.time, 'point': moment.point, 'q': moment.q}


def _frames(audit: Audit) -> dict[str, Json] | None:
    report = audit.frames
    if report is None:
        return None
    source: dict[str, Json] = {'source': report.name, 'frame': report.frame, 'poses': report.poses}
    if isinstance(report, NotCompared):
        return {
            **source,
            'matched': 0,
            'level': Level.WARN.name,
            'code': report.code,
            'sentence': report.reason,
        }
    diagnosis = report.diagnosis
    return {
        **source,
        **attributes(report, 'considered', 'matched', 'unmatched', 'doubts', 'sentence'),
        'level': report.level.name,
        **attributes(report.limits, 'warn', 'bad'),
        **attributes(diagnosis, 'as_given', 'errors', 'undetermined'),
        **_offsets(diagnosis),
        'cause': diagnosis.cause.key if diagnosis.cause else None,
        'causes': [_cause(cause) for cause in diagnosis.causes],
        'likely': [_cause(cause) for cause in diagnosis.likely],
    }


def _cause(cause: TestedCause) -> dict[str, Json]:
    return {**attributes(cause, 'key', 'sentence', 'value', 'ratio', 'errors'), **_offsets(cause)}


def _offsets(fit: FrameDiagnosis | TestedCause) -> dict[str, Json]:
    # Write the base and tool offset between measured and computed poses, each as xyz (m) and rpy
    # (rad), as in a robot file, and as a matrix.
    poses = {'base_offset': fit.base_offset, 'tool_offset': fit.tool_offset}
    return {
        name: {'xyz': T[:3, 3], 'rpy': roll_pitch_yaw(T[:3, :3]), 'matrix': T}
        for name, T in poses.items()
    }


def _series(audit: Audit, rows: Times) -> dict[str, Json]:
    timeline = audit.timeline
    q, qdot, factors = timeline.q[rows], timeline.qdot[rows], timeline.factors[rows]
    state = evaluate(audit.robot, q, np.nan_to_num(qdot, nan=0.0))
    distance, nearest = timeline.distance[rows], timeline.nearest_singular[rows]
    singularity = singularity_of(measured_before(state, distance, nearest))
    moving = ~np.any(np.isnan(qdot), axis=1)
    signs = np.where(timeline.turned[rows], -1.0, 1.0)
    measures = {name: getattr(singularity, name) for name in MEASURES}
    time = singularity.time_to_warning
    return {
        'thinned': len(rows) < len(timeline),
        'message': timeline.messages[rows],
        'stamp': timeline.stamps[rows],
        't': timeline.t[rows],
        'q': q,
        'qdot': qdot,
        'position': state.position,
        'quaternion_xyzw': state.quaternion_xyzw * signs[:, None],
        'twist': np.where(moving[:, None], state.twist, np.nan),
        **attributes(singularity, 'distance'),
        **{name: values for name, values in measures.items() if values is not None},
        'time_to_warning': np.where(moving, np.nan if time is None else time, np.nan),
        'factor_names': audit.robot.singularity.factors.names,
        'factor_motions': factors,
        'level': [Level(int(level)).name for level in timeline.levels[rows]],
        **({} if audit.slowing is None else {'scale': audit.slowing.values[rows]}),
    }
