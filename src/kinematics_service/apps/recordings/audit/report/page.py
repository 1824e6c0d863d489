# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write an audit as one HTML page that needs no other file.

The script page.js shows the values of all charts at the time under the pointer. The script reads
the values from the SVG paths.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from html import escape

from .....estimation import outcomes
from .....page import document, resource, table
from .....robot.measures import MEASURES
from .....typography import counted
from .....version import __version__
from ..auditing import Audit
from ..findings import Finding, seconds
from ..intervals import Interval
from ..joints import JointReport
from ..reported_velocities import VelocityCheck
from ..verdict import judged_in_words, verdict_of
from .page_charts import interval_chart, joint_charts, measure_charts, slowing_chart, tool_charts
from .page_frames import frame_section
from .page_header import Provenance, header
from .page_plans import plan_section
from .tables import MAX_TABLE_ROWS, NOTHING, TableColumn, first_rows, more_of, table_of

SIGNS = {'OK': '&#10003; OK', 'WARN': '&#9650; WARN', 'ERROR': '&#9632; ERROR'}


def page_of(audit: Audit, origin: Provenance | None = None) -> str:
    """
    Return the page of an audit as HTML. If `origin` is given, the page begins with the names and
    checksums of recording and robot file, and the date.
    """
    title = f'Audit of {audit.file.rpartition("/")[2]}'
    body = [
        f'<h1>{escape(title)}</h1>\n{header(audit, origin)}{_introduction(audit)}',
        _verdict(verdict_of(audit)),
        *(section(audit) for section in SECTIONS),
        f'<p class="soft">kinematics_service {__version__}. Computed as the node computes, from '
        f'{escape(audit.file)}.</p>\n',
    ]
    return document(title, body, script=resource(__package__, 'page.js'))


def _introduction(audit: Audit) -> str:
    robot, stream = audit.robot, audit.stream
    rate = f', {stream.rate:.4g} messages a second' if stream.rate and not audit.planned else ''
    count = counted(stream.messages, 'sample' if audit.planned else 'message')
    return (
        f'<p class="soft">{escape(audit.kind)}, {escape(audit.topic)}: {count} over '
        f'{seconds(audit.timeline.end)}{rate}. Robot {escape(robot.name)}, '
        f'{escape(robot.tool_frame)} in {escape(robot.base_frame)}.</p>\n'
    )


def _verdict(findings: Sequence[Finding]) -> str:
    first, *others = findings
    items = ''.join(f'<li>{_tag(other.level.name)} {escape(other.text)}</li>' for other in others)
    listed = f'<ul>{items}</ul>' if items else ''
    worst = max(finding.level for finding in findings)
    return (
        f'<section class="verdict {worst.name}"><p class="first">'
        f'{_tag(first.level.name)} {escape(first.text)}</p>{listed}</section>\n'
    )


def _tag(level: str) -> str:
    return f'<span class="tag {level}">{SIGNS[level]}</span>'


def _at(audit: Audit, row: int) -> str:
    return f'{audit.timeline.t[row]:.3f} s'


def _singularities(audit: Audit) -> str:
    measure = MEASURES[audit.robot.singularity.thresholds.measure]
    worst = f'worst {measure.name.replace("_", " ")}{f", {measure.unit}" if measure.unit else ""}'
    text = f'<h2>Near singularities</h2>\n{measure_charts(audit)}'
    if not audit.intervals:
        none = f'<p>None of the {judged_in_words(audit)} judged is near a singularity.</p>\n'
        return text + none
    columns = (
        TableColumn('begins', lambda span: f'{span.begin:.3f} s', True),
        TableColumn('lasts', lambda span: seconds(span.seconds), True),
        TableColumn(
            'time at ERROR', lambda span: seconds(span.stopped) if span.stopped else '', True
        ),
        TableColumn('level', lambda span: _tag(span.level.name)),
        TableColumn('which', partial(_factors, audit)),
        TableColumn(worst, lambda span: f'{span.value:.3g}', True),
        TableColumn('at', lambda span: _at(audit, span.worst), True),
        TableColumn('tool motion lost there', lambda span: escape(span.lost)),
        TableColumn('joints against each other', lambda span: escape(span.fighting)),
    )
    return text + first_rows(columns, audit.intervals)


def _factors(audit: Audit, interval: Interval) -> str:
    names = (
        f'{escape(passage.name)}: {passage.distance:.3g} rad at {_at(audit, passage.row)}'
        for passage in interval.factors
    )
    return '<br>'.join(names).replace(' ', '&nbsp;') or '(the robot file names no factors)'


def _moments(audit: Audit) -> str:
    columns = (
        TableColumn('what', lambda moment: escape(moment.quantity)),
        TableColumn('value', lambda moment: escape(moment.value), True),
        TableColumn('at', lambda moment: _at(audit, moment.row), True),
        TableColumn('message', lambda moment: f'{audit.timeline.messages[moment.row]:,}', True),
        TableColumn('joints there', lambda moment: _pose(audit, moment.row)),
    )
    return '<h2>Worst moments</h2>\n' + table_of(columns, audit.moments)


def _pose(audit: Audit, row: int) -> str:
    values = audit.timeline.q[row].tolist()
    return '&nbsp; '.join(
        f'{value:.4f}&nbsp;m' if slides else f'{math.degrees(value):.1f}&deg;'
        for value, slides in zip(values, audit.robot.prismatic)
    )


def _joints(audit: Audit) -> str:
    columns = (
        TableColumn('joint', lambda joint: escape(joint.name)),
        TableColumn('range', lambda joint: _span(joint, joint.least, joint.greatest)),
        TableColumn('limits', lambda joint: _span(joint, joint.lower, joint.upper)),
        TableColumn('beyond (messages)', lambda joint: _some(joint.beyond), True),
        TableColumn('at the limit', lambda joint: _some(joint.touching), True),
        TableColumn('fastest', lambda joint: _speed(joint, joint.fastest), True),
        TableColumn('its limit', lambda joint: _speed(joint, joint.velocity_limit, 'none'), True),
        TableColumn('above (messages)', lambda joint: _some(joint.too_fast), True),
        TableColumn('velocity error, rms', lambda joint: _error(joint, 'rms'), True),
        TableColumn('worst', lambda joint: _error(joint, 'worst'), True),
        TableColumn('lag, scale', lambda joint: _lag_and_scale(joint.check), True),
    )
    text = '<h2>Joints</h2>\n' + table_of(columns, audit.joints)
    if any(joint.check is not None for joint in audit.joints):
        text += (
            '<p class="soft">Velocity error: reported velocity minus the difference of the '
            'positions over its interval.</p>\n'
        )
    elif not audit.planned:
        text += '<p class="soft">No reported velocities to compare with the positions.</p>\n'
    return text + joint_charts(audit)


def _shown(joint: JointReport, value: float) -> str:
    if not math.isfinite(value):
        return NOTHING
    return f'{value:.4g}m' if joint.sliding else f'{math.degrees(1.0) * value:.4g}&deg;'


def _span(joint: JointReport, low: float, high: float) -> str:
    if not (math.isfinite(low) or math.isfinite(high)):
        return 'none'
    return f'{_shown(joint, low)} to {_shown(joint, high)}'.replace(' ', '&nbsp;')


def _some(number: int) -> str:
    return f'{number:,}' if number else ''


def _speed(joint: JointReport, speed: float, otherwise: str = NOTHING) -> str:
    return f'{_shown(joint, speed)}/s' if math.isfinite(speed) else otherwise


def _error(joint: JointReport, field: str) -> str:
    return NOTHING if joint.check is None else f'{_shown(joint, getattr(joint.check, field))}/s'


def _lag_and_scale(check: VelocityCheck | None) -> str:
    if check is None:
        return ''
    lag = f'{1e3 * check.lag:+.3g} ms' if check.lag else ''
    factor = '' if check.scale == 1.0 else f'&times; {check.scale:.3g}'
    return f'{lag} {factor}'.strip()


def _slowing(audit: Audit) -> str:
    slowing = audit.slowing
    if slowing is None:
        return ''
    text = f'<h2>Where it would have been slowed</h2>\n{slowing_chart(audit, slowing.values)}'
    columns = (
        TableColumn('begins', lambda stretch: f'{stretch.begin:.3f} s', True),
        TableColumn('lasts', lambda stretch: seconds(stretch.seconds), True),
        TableColumn('cause', lambda stretch: escape(stretch.cause)),
        TableColumn('least scale', lambda stretch: f'{stretch.value:.3g}', True),
        TableColumn('at', lambda stretch: _at(audit, stretch.worst), True),
        TableColumn('joints there', lambda stretch: _pose(audit, stretch.worst)),
    )
    if slowing.stretches:
        text += first_rows(columns, slowing.stretches)
    return text + (
        '<p class="soft">The share of the velocities that ks.scale keeps. It is no safety '
        'function.</p>\n'
    )


def _stream(audit: Audit) -> str:
    if audit.planned:
        return ''
    stream = audit.stream
    rows = [
        ['messages', f'{stream.messages:,}'],
        ['that made a state', f'{len(audit.timeline):,}'],
    ]
    rows += [
        [escape(reason), f'{number:,}']
        for reason, number in audit.counts.items()
        if number and reason != outcomes.ACCEPTED
    ]
    rows += [
        ['usual interval of the stamps', f'{1e3 * stream.median_interval:.4g} ms'],
        ['longest', seconds(stream.longest_interval)],
        ['stamp repeated', f'{stream.repeated:,}'],
        ['stamp stepping back', f'{stream.backwards:,}'],
        ['plain repetitions', f'{stream.identical:,}'],
        ['from stamp to recording, median', f'{1e3 * stream.delay_median:.4g} ms'],
        ['longest', seconds(max(stream.delay_longest, 0.0))],
    ]
    text = '<h2>Messages</h2>\n' + table(['', ''], rows, (1,))
    if audit.examples:
        first = (
            TableColumn('first one without a state', lambda item: escape(item[0])),
            TableColumn('message', lambda item: f'{item[1].message:,}', True),
            TableColumn('', lambda item: escape(item[1].sentence)),
        )
        text += table_of(first, audit.examples.items())
    if stream.gaps:
        gaps = (
            TableColumn('gap before message', lambda gap: f'{gap.message:,}', True),
            TableColumn('lasts', lambda gap: seconds(gap.seconds), True),
            TableColumn('after the stamp', lambda gap: f'{gap.after * 1e-9:.3f} s', True),
        )
        text += table_of(gaps, stream.gaps[:MAX_TABLE_ROWS]) + more_of(stream.gap_count)
    return text + interval_chart(audit)


SECTIONS: tuple[Callable[[Audit], str], ...] = (
    plan_section,
    _singularities,
    _moments,
    _joints,
    _slowing,
    tool_charts,
    frame_section,
    _stream,
)
