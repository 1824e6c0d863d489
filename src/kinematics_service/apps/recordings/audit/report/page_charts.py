# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Draw the charts of the audit page, each with its unit."""

import math
from collections.abc import Callable, Iterator
from functools import lru_cache, partial
from itertools import islice

import numpy as np

from .....kernel import Floats
from .....robot.measures import MEASURES, Level
from ...readers.block import Flags
from ...readers.stored_columns import Column, spans
from ..auditing import Audit
from ..curves import Curve, curve_of
from ..frames import FrameReport
from ..intervals import watched_values
from ..timeline import stretches_of
from .charts import Band, Chart, LevelLine

# A function that returns the values of a curve for a slice of rows.
Values = Callable[[slice], Floats]

# Largest number of intervals with WARN or ERROR that a chart shades. If there are more, none is
# shaded, because the shading would hide the curve.
MAX_BANDS = 400
# Condition numbers have no upper bound, so a chart draws them only up to this many times the
# threshold of ERROR. Larger condition numbers are drawn at the upper edge.
CLIP_RATIO = 100.0


def _breaks(audit: Audit, rows: slice) -> Flags:
    timeline = audit.timeline
    breaks: Flags = np.array(timeline.silent[rows])
    begin = max(rows.start - 1, 0)
    steps = np.diff(timeline.t[begin : rows.stop])
    longest = max(1.0, 20.0 * audit.stream.median_interval)
    breaks[begin + 1 - rows.start :] |= steps > longest
    return breaks


def _curve(audit: Audit, name: str, style: str, values: Values) -> Curve:
    timeline = audit.timeline

    def pieces() -> Iterator[tuple[Floats, Floats, Flags]]:
        for rows in spans(len(timeline)):
            yield timeline.t[rows], values(rows), _breaks(audit, rows)

    return curve_of(name, style, timeline.end, pieces())


def _scaled(column: Column[np.float64], scale: float) -> Values:
    return lambda rows: scale * column[rows]


@lru_cache(maxsize=1)
def _bands(audit: Audit) -> list[Band]:
    timeline, rows = audit.timeline, list(spans(len(audit.timeline)))
    runs = stretches_of((timeline.levels[span], _breaks(audit, span)) for span in rows)
    bad = list(islice((run for run in runs if run.label != Level.OK), MAX_BANDS + 1))
    quiet = (k for span in rows for k in np.flatnonzero(_breaks(audit, span)) + span.start if k)
    shown = [(run.first, run.until, Level(run.label).name) for run in bad]
    shown = shown if len(bad) <= MAX_BANDS else []
    shown += [(k - 1, k, 'gap') for k in islice(quiet, MAX_BANDS)]
    t = timeline.t
    return [Band(float(t[begin]), float(t[end]), style) for begin, end, style in shown]


def measure_charts(audit: Audit) -> str:
    """
    Return charts of singularity measures over time.

    The first chart shows the measure to which the robot file's thresholds apply. If the robot file
    has several singular factors, the second chart shows the factors. Further charts show other
    singularity measures.
    """
    robot, timeline = audit.robot, audit.timeline
    thresholds = robot.singularity.thresholds
    measure = MEASURES[thresholds.measure]
    levels = [
        LevelLine(thresholds.warn, f'WARN {thresholds.warn:g}', 'warnline'),
        LevelLine(thresholds.stop, f'ERROR {thresholds.stop:g}'),
    ]
    curve = _curve(audit, measure.words, 'c0', partial(watched_values, robot, timeline))
    title = measure.long or measure.words
    log = bool(np.any(curve.values > 0.0))
    clip = CLIP_RATIO * thresholds.stop if not measure.small_is_bad else math.inf
    charts = [Chart(title, measure.unit, [curve], levels=levels, log=log, clip=clip, height=210)]
    factors = robot.singularity.factors.names
    if len(factors) > 1:
        curves = [
            _curve(audit, factor, f'c{k % 6}', timeline.factors.columns[k].__getitem__)
            for k, factor in enumerate(factors)
        ]
        zeros = 'joint motion to the zero of each factor, by first order'
        charts.append(Chart(zeros, 'rad', curves, levels=levels, log=True))
    for name, column in timeline.measures.items():
        if name != measure.name:
            other = MEASURES[name]
            curve = _curve(audit, other.words, 'c0', column.__getitem__)
            if np.any(curve.values > 0.0):
                clip = math.inf if other.small_is_bad else CLIP_RATIO * (other.stop or math.inf)
                charts.append(Chart(other.words, other.unit, [curve], log=True, clip=clip))
    text = ''.join(_html(audit, chart) for chart in charts)
    if audit.intervals:
        text += (
            '<p class="soft">Shaded: <span class="swatch WARN">WARN</span> '
            '<span class="swatch ERROR">ERROR</span> '
            '<span class="swatch gap">no messages</span></p>\n'
        )
    return text


def slowing_chart(audit: Audit, values: Column[np.float64]) -> str:
    """
    Return a chart of the factor (0 to 1) by which `ks.scale` would have multiplied the velocity.
    """
    curve = _curve(audit, 'scale', 'c0', values.__getitem__)
    return _html(audit, Chart('scale', '', [curve], height=110))


def _html(audit: Audit, chart: Chart) -> str:
    # Returns the HTML of a chart, with time axis and shaded intervals of the recording added.
    return chart._replace(bands=_bands(audit), end=audit.timeline.end).html()


def joint_charts(audit: Audit) -> str:
    """Return charts of position and velocity of each joint, with the limits."""
    text = []
    timeline = audit.timeline
    for j, joint in enumerate(audit.joints):
        scale, unit = (1.0, 'm') if joint.sliding else (math.degrees(1.0), 'deg')
        limits = _limits(scale, joint.lower, joint.upper)
        curve = _curve(audit, 'position', 'c0', _scaled(timeline.q.columns[j], scale))
        text.append(_html(audit, Chart(joint.name, unit, [curve], levels=limits, height=110)))
        curve = _curve(audit, 'velocity', 'c2 solid', _scaled(timeline.qdot.columns[j], scale))
        if len(curve.values):
            limits = _limits(scale, -joint.velocity_limit, joint.velocity_limit)
            title = f'{joint.name}, velocity'
            chart = Chart(title, f'{unit}/s', [curve], levels=limits, height=110)
            text.append(_html(audit, chart))
    return f'<div class="joints">{"".join(text)}</div>\n'


def _limits(scale: float, *values: float) -> list[LevelLine]:
    return [
        LevelLine(scale * value, f'limit {scale * value:.4g}')
        for value in values
        if math.isfinite(value)
    ]


def tool_charts(audit: Audit) -> str:
    """Return the section of the page with charts of position and speed of the tool."""
    timeline = audit.timeline
    curves = [
        _curve(audit, name, f'c{k}', timeline.position.columns[k].__getitem__)
        for k, name in enumerate(('x', 'y', 'z'))
    ]
    frame = audit.robot.base_frame
    text = '<h2>Tool</h2>\n' + _html(audit, Chart(f'position in {frame}', 'm', curves))
    for title, unit, values in (
        ('speed', 'm/s', timeline.speed.__getitem__),
        ('turning', 'deg/s', lambda rows: np.degrees(timeline.turning[rows])),
    ):
        curve = _curve(audit, title, 'c0', values)
        if len(curve.values):
            text += _html(audit, Chart(title, unit, [curve], height=110))
    return text


def frame_charts(audit: Audit, report: FrameReport) -> str:
    """
    Return charts of the differences between measured and computed poses that remain after constant
    offsets of base and tool.
    """
    none, end = np.zeros(len(report.t), dtype=bool), audit.timeline.end
    return ''.join(
        _html(
            audit,
            Chart(
                title, unit, [curve_of(title, 'c0', end, [(report.t, values, none)])], height=110
            ),
        )
        for title, unit, values in (
            ('position remaining', 'mm', 1e3 * report.position),
            ('orientation remaining', 'deg', np.degrees(report.rotation)),
        )
    )


def interval_chart(audit: Audit) -> str:
    """Return a chart of the time between successive stamps of the messages."""
    timeline = audit.timeline
    if len(timeline) < 3:
        return ''

    def pieces() -> Iterator[tuple[Floats, Floats, Flags]]:
        for rows in spans(len(timeline)):
            before = timeline.stamps[max(rows.start - 1, 0)]
            steps = np.diff(timeline.stamps[rows], prepend=before) * 1e-6
            none = np.zeros(len(steps), dtype=bool)
            yield timeline.t[rows], np.where(steps > 0.0, steps, np.nan), none

    curve = curve_of('interval', 'c0', timeline.end, pieces())
    if not len(curve.values):
        return ''
    title = 'interval of the stamps'
    return Chart(title, 'ms', [curve], (), (), True, 110, timeline.end).html()
