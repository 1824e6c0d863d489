"""
The charts of the audit page: what is drawn, in which unit.

"""

import math

import numpy as np

from ..kernel import Floats
from ..measures import MEASURES
from ..measures import Level as Badness
from .auditing import Audit
from .block import Flags
from .charts import Band, Chart, Curve, Level
from .frames import FrameReport
from .stretches import watched_values

# Stretches shaded at most; more would be a grey wall.
MOST_BANDS = 400
MEASURED = {
    'manipulability': 'manipulability',
    'condition_number': 'condition number',
    'smallest_singular_value': 'smallest singular value',
    'determinant': 'determinant',
    'distance': 'distance',
}


def _end(audit: Audit) -> float:
    return float(audit.timeline.t[-1])


def _breaks(audit: Audit) -> Flags:
    timeline = audit.timeline
    breaks = timeline.silent.copy()
    steps = np.diff(timeline.t)
    longest = max(1.0, 20.0 * audit.stream.median_interval)
    breaks[1:] |= steps > longest
    return breaks


def _bands(audit: Audit) -> list[Band]:
    timeline = audit.timeline
    silent = _breaks(audit)
    # Runs of one level; each lasts to the next message, but not through a silence.
    edges = np.flatnonzero(np.diff(timeline.levels, prepend=-1) | silent)
    ends = np.append(edges[1:], len(timeline) - 1)
    bands = []
    for begin, end in zip(edges.tolist(), ends.tolist()):
        level = Badness(int(timeline.levels[begin]))
        if level != Badness.OK:
            end = end - 1 if silent[end] else end
            bands.append(Band(float(timeline.t[begin]), float(timeline.t[end]), level.name))
    if len(bands) > MOST_BANDS:
        bands = []
    quiet = np.flatnonzero(silent)
    quiet = quiet[quiet > 0][:MOST_BANDS]
    return bands + [Band(float(timeline.t[k - 1]), float(timeline.t[k]), 'gap') for k in quiet]


def measure_charts(audit: Audit) -> str:
    """
    Return the watched measure with its thresholds, and the named factors.

    """
    robot, timeline = audit.robot, audit.timeline
    measure = MEASURES[robot.thresholds.measure]
    values = watched_values(robot, timeline)
    log = bool(np.any(values > 0.0))
    levels = [
        Level(robot.thresholds.warn, f'warn {robot.thresholds.warn:g}', 'warnline'),
        Level(robot.thresholds.stop, f'stop {robot.thresholds.stop:g}'),
    ]
    name = MEASURED[measure.name]
    charts = [
        Chart(
            f'{name} to a singular pose' if measure.name == 'distance' else name,
            measure.unit,
            timeline.t,
            [Curve(name, np.where(np.isinf(values), np.nan, values), 'c0')],
            _breaks(audit),
            _bands(audit),
            levels,
            log,
            210,
            _end(audit),
        )
    ]
    factors = robot.factors.names
    if len(factors) > 1:
        curves = [
            Curve(factor, timeline.factors[:, k], f'c{k % 6}') for k, factor in enumerate(factors)
        ]
        charts.append(
            _chart(audit, 'distance to the zero of each factor', 'rad', curves, True, levels)
        )
    for other in ('smallest_singular_value', 'condition_number'):
        if other != measure.name:
            column = timeline.measures[other]
            column = np.where(np.isinf(column), np.nan, column)
            if np.any(column > 0.0):
                curve = Curve(MEASURED[other], column, 'c0')
                charts.append(_chart(audit, MEASURED[other], '', [curve], True))
    text = ''.join(chart.html() for chart in charts)
    if audit.stretches:
        text += (
            '<p class="soft">Shaded: <span class="swatch WARN">near</span> '
            '<span class="swatch ERROR">too near</span> '
            '<span class="swatch gap">nothing heard</span></p>\n'
        )
    return text


def _chart(
    audit: Audit,
    title: str,
    unit: str,
    curves: list[Curve],
    log: bool = False,
    levels: list[Level] | None = None,
    height: int = 150,
) -> Chart:
    return Chart(
        title,
        unit,
        audit.timeline.t,
        curves,
        _breaks(audit),
        _bands(audit),
        levels or [],
        log,
        height,
        _end(audit),
    )


def joint_charts(audit: Audit) -> str:
    """
    Return position and velocity of each joint, with their limits.

    """
    text = []
    for j, joint in enumerate(audit.joints):
        scale, unit = (1.0, 'm') if joint.sliding else (math.degrees(1.0), 'deg')
        q, qdot = scale * audit.timeline.q[:, j], scale * audit.timeline.qdot[:, j]
        limits = [
            Level(scale * value, f'limit {scale * value:.4g}')
            for value in (joint.lower, joint.upper)
            if math.isfinite(value)
        ]
        text.append(
            _chart(
                audit, joint.name, unit, [Curve('position', q, 'c0')], False, limits, 110
            ).html()
        )
        if np.any(np.isfinite(qdot)):
            top = scale * joint.velocity_limit
            speeds = (
                [Level(-top, f'limit {-top:.4g}'), Level(top, f'limit {top:.4g}')]
                if math.isfinite(top)
                else []
            )
            curve = Curve('velocity', qdot, 'c2 solid')
            title = f'{joint.name}, velocity'
            text.append(_chart(audit, title, f'{unit}/s', [curve], False, speeds, 110).html())
    return f'<div class="joints">{"".join(text)}</div>\n'


def tool_charts(audit: Audit) -> str:
    """
    Return position and speed of the tool.

    """
    timeline = audit.timeline
    curves = [
        Curve(name, timeline.position[:, k], f'c{k}') for k, name in enumerate(('x', 'y', 'z'))
    ]
    frame = audit.robot.base_frame
    text = _chart(audit, f'position in {frame}', 'm', curves).html()
    speeds = _norms(timeline.twist[:, :3]), np.degrees(_norms(timeline.twist[:, 3:]))
    for title, unit, values in (('speed', 'm/s', speeds[0]), ('turning', 'deg/s', speeds[1])):
        if np.any(np.isfinite(values)):
            text += _chart(audit, title, unit, [Curve(title, values, 'c0')], height=110).html()
    return text


def _norms(vectors: Floats) -> Floats:
    return np.asarray(np.linalg.norm(vectors, axis=1))


def frame_charts(audit: Audit, report: FrameReport) -> str:
    """
    Return what remains between the poses of both sources.

    """
    none = np.zeros(len(report.t), dtype=bool)
    bands, end = _bands(audit), _end(audit)
    return ''.join(
        Chart(
            title, unit, report.t, [Curve(title, values, 'c0')], none, bands, (), False, 110, end
        ).html()
        for title, unit, values in (
            ('position remaining', 'mm', 1e3 * report.position),
            ('orientation remaining', 'deg', np.degrees(report.rotation)),
        )
    )


def interval_chart(audit: Audit) -> str:
    """
    Return the intervals between the states.

    """
    timeline = audit.timeline
    steps = np.diff(timeline.stamps, prepend=timeline.stamps[:1]) * 1e-6
    if len(steps) < 3 or not np.any(steps > 0.0):
        return ''
    steps[0] = np.nan
    curve = Curve('interval', np.where(steps > 0.0, steps, np.nan), 'c0')
    none = np.zeros(len(steps), dtype=bool)
    return Chart(
        'interval of the stamps', 'ms', timeline.t, [curve], none, (), (), True, 110, _end(audit)
    ).html()
