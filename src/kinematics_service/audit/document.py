"""
An audit as one JSON object.

"""

import dataclasses
from typing import Any

import numpy as np

from ..kernel import Floats
from ..measures import Level
from ..rigid_motion import roll_pitch_yaw
from ..version import __version__
from .auditing import Audit
from .block import Times
from .stretches import badness, watched_values
from .verdict import verdict_of

# Rows of the series at most; of longer recordings the worst ones, evenly spread.
MOST_ROWS = 10_000


def thinned_rows(worse: Floats, most: int) -> Times:
    """
    Return at most `most` rows of N: of each stretch of time the first one and the worst one.

    Parameters
    ----------
    worse : shape (N,)
        What the largest is the worst of.

    """
    if len(worse) <= most:
        return np.arange(len(worse))
    edges = np.linspace(0, len(worse), max(most // 2, 1) + 1).astype(int)
    worst = [a + int(np.argmax(worse[a:b])) for a, b in zip(edges, edges[1:])]
    return np.unique(np.concatenate([edges[:-1], worst]))


def document_of(audit: Audit) -> dict[str, Any]:
    """
    Return the audit as a dictionary for `printing.json_text`; m, rad, s.

    """
    robot, timeline = audit.robot, audit.timeline
    verdict = verdict_of(audit)
    rows = thinned_rows(badness(robot, watched_values(robot, timeline)), MOST_ROWS)
    return {
        'version': __version__,
        'file': audit.file,
        'kind': audit.what,
        'topic': audit.topic,
        'planned': audit.planned,
        'robot': robot.name,
        'joint_names': robot.joint_names,
        'base_frame': robot.base_frame,
        'tool_frame': robot.tool_frame,
        'measure': robot.thresholds.measure,
        'warn': robot.thresholds.warn,
        'stop': robot.thresholds.stop,
        'level': verdict.level.name,
        'verdict': [{'level': s.level.name, 'sentence': s.text} for s in verdict.sentences],
        'messages': {
            'total': audit.stream.messages,
            'states': len(timeline),
            'refused': sum(audit.refused.values()),
            'by_outcome': audit.counts,
            'first_refused': {
                reason: example._asdict() for reason, example in audit.examples.items()
            },
        },
        'stream': _stream(audit),
        'stretches': [
            {
                'factor': stretch.factor or None,
                'factors': [
                    {
                        'name': passed.name,
                        'distance': passed.distance,
                        't': float(timeline.t[passed.row]),
                    }
                    for passed in stretch.factors
                ],
                'level': stretch.level.name,
                'begin': stretch.begin,
                'end': stretch.end,
                'duration': stretch.seconds,
                'stopped': stretch.stopped,
                'first_message': int(timeline.messages[stretch.first]),
                'last_message': int(timeline.messages[stretch.last]),
                'worst': {
                    'value': stretch.value,
                    't': float(timeline.t[stretch.worst]),
                    'stamp': int(timeline.stamps[stretch.worst]),
                    'q': stretch.q,
                    'lost_direction': stretch.lost,
                    'joints_against_each_other': stretch.fighting,
                },
            }
            for stretch in audit.stretches
        ],
        'joints': [_joint(joint) for joint in audit.joints],
        'jumps': {'count': audit.jump_count, 'first': [jump._asdict() for jump in audit.jumps]},
        'worst_moments': [
            {
                'what': moment.what,
                'value': moment.value,
                't': float(timeline.t[moment.row]),
                'stamp': int(timeline.stamps[moment.row]),
                'message': int(timeline.messages[moment.row]),
            }
            for moment in audit.moments
        ],
        'warnings': [
            {
                't': float(timeline.t[said.row]),
                'level': said.notice.level.name,
                'sentence': said.notice.sentence,
            }
            for said in audit.timeline.said
        ],
        'frames': _frames(audit),
        'series': _series(audit, rows),
    }


def _stream(audit: Audit) -> dict[str, Any]:
    stream = {
        field.name: getattr(audit.stream, field.name) for field in dataclasses.fields(audit.stream)
    }
    stream['gaps'] = [gap._asdict() for gap in audit.stream.gaps]
    stream['orders'] = [order._asdict() for order in audit.stream.orders]
    return {'rate': audit.stream.rate, **stream}


def _joint(joint: Any) -> dict[str, Any]:
    values: dict[str, Any] = joint._asdict()
    values['check'] = None if joint.check is None else joint.check._asdict()
    return values


def _frames(audit: Audit) -> dict[str, Any] | None:
    report = audit.frames
    if report is None:
        return None
    diagnosis = report.diagnosis
    return {
        'source': report.name,
        'frame': report.frame,
        'poses': report.poses,
        'matched': report.matched,
        'sentence': diagnosis.sentence,
        'as_given': diagnosis.as_given._asdict(),
        'errors': diagnosis.errors._asdict(),
        'base_offset': offset_of(diagnosis.base_offset),
        'tool_offset': offset_of(diagnosis.tool_offset),
        'undetermined': diagnosis.undetermined,
        'causes': [
            {
                'key': cause.key,
                'sentence': cause.sentence,
                'value': cause.value,
                'ratio': cause.ratio,
                'errors': cause.errors._asdict(),
                'base_offset': offset_of(cause.base_offset),
                'tool_offset': offset_of(cause.tool_offset),
            }
            for cause in diagnosis.causes
        ],
    }


def offset_of(T: Floats) -> dict[str, Any]:
    """
    Return a pose as xyz (m) and rpy (rad), as a robot file has it.

    """
    return {'xyz': T[:3, 3], 'rpy': roll_pitch_yaw(T[:3, :3]), 'matrix': T}


def _series(audit: Audit, rows: Times) -> dict[str, Any]:
    timeline = audit.timeline
    return {
        'thinned': len(rows) < len(timeline),
        'message': timeline.messages[rows],
        'stamp': timeline.stamps[rows],
        't': timeline.t[rows],
        'q': timeline.q[rows],
        'qdot': timeline.qdot[rows],
        'position': timeline.position[rows],
        'quaternion_xyzw': timeline.quaternion_xyzw[rows],
        'twist': timeline.twist[rows],
        **{name: values[rows] for name, values in timeline.measures.items()},
        'time_to_warning': timeline.time_to_warning[rows],
        'factor_names': audit.robot.factors.names,
        'factor_distances': timeline.factors[rows],
        'level': [Level(int(level)).name for level in timeline.levels[rows]],
    }
