"""
An audit as one page that needs nothing else.

Its script, page.js, shows the values at one time in all plots, which it reads back from their
paths.
"""

import math
from collections.abc import Callable
from html import escape

from ....estimation.estimator import ACCEPTED
from ....page import MOST, document, more_of, resource, table
from ....robot.measures import MEASURES
from ....version import __version__
from ..auditing import Audit
from ..findings import count, seconds
from ..verdict import AuditVerdict, judged_in_words, verdict_of
from .page_charts import interval_chart, joint_charts, measure_charts, tool_charts
from .page_frames import frame_section
from .page_header import Provenance, header
from .page_plans import plan_section

SIGNS = {'OK': '&#10003; fine', 'WARN': '&#9650; WARN', 'ERROR': '&#9632; ERROR'}


def page_of(audit: Audit, origin: Provenance | None = None) -> str:
    """Return the page as HTML, with files, sums and date at its head if an origin is given."""
    title = f'Audit of {audit.file.rpartition("/")[2]}'
    verdict = verdict_of(audit)
    body = [
        f'<h1>{escape(title)}</h1>\n{header(audit, origin)}{_introduction(audit)}',
        _verdict(verdict),
        *(section(audit) for section in SECTIONS),
        f'<p class="soft">kinematics_service {__version__}. Computed as the node computes, from '
        f'{escape(audit.file)}.</p>\n',
    ]
    return document(title, body, script=resource(__package__, 'page.js'))


def _introduction(audit: Audit) -> str:
    robot, stream = audit.robot, audit.stream
    rate = f', {stream.rate:.4g} messages a second' if stream.rate and not audit.planned else ''
    what = count(stream.messages, 'sample' if audit.planned else 'message')
    return (
        f'<p class="soft">{escape(audit.what)}, {escape(audit.topic)}: {what} over '
        f'{seconds(audit.timeline.end)}{rate}. Robot {escape(robot.name)}, '
        f'{escape(robot.tool_frame)} in {escape(robot.base_frame)}.</p>\n'
    )


def _verdict(verdict: AuditVerdict) -> str:
    first, *others = verdict.sentences
    items = ''.join(
        f'<li>{_tag(sentence.level.name)} {escape(sentence.text)}</li>' for sentence in others
    )
    listed = f'<ul>{items}</ul>' if items else ''
    return (
        f'<section class="verdict {verdict.level.name}"><p class="first">'
        f'{_tag(first.level.name)} {escape(first.text)}</p>{listed}</section>\n'
    )


def _tag(level: str) -> str:
    return f'<span class="tag {level}">{SIGNS[level]}</span>'


def _at(audit: Audit, row: int) -> str:
    return f'{audit.timeline.t[row]:.3f} s'


def _singularities(audit: Audit) -> str:
    measure = MEASURES[audit.robot.thresholds.measure]
    unit = f', {measure.unit}' if measure.unit else ''
    text = ['<h2>Near singularities</h2>\n', measure_charts(audit)]
    if not audit.stretches:
        none = f'<p>None of the {judged_in_words(audit)} judged is near a singularity.</p>\n'
        return ''.join([*text, none])
    rows = []
    for stretch in audit.stretches[:MOST]:
        names = '<br>'.join(
            f'{escape(one.name)}: {one.distance:.3g} rad at {_at(audit, one.row)}'.replace(
                ' ', '&nbsp;'
            )
            for one in stretch.factors
        )
        rows.append(
            [
                f'{stretch.begin:.3f} s',
                seconds(stretch.seconds),
                seconds(stretch.stopped) if stretch.stopped else '',
                _tag(stretch.level.name),
                names or '(the robot file names no factors)',
                f'{stretch.value:.3g}',
                _at(audit, stretch.worst),
                escape(stretch.lost),
                escape(stretch.fighting),
            ]
        )
    headers = [
        'begins',
        'lasts',
        'time at stop',
        'level',
        'which',
        f'worst {measure.name.replace("_", " ")}{unit}',
        'at',
        'tool motion lost there',
        'joints against each other',
    ]
    text.append(table(headers, rows, (0, 1, 2, 5, 6)))
    return ''.join(text) + more_of(len(audit.stretches))


def _moments(audit: Audit) -> str:
    rows = [
        [
            escape(moment.what),
            escape(moment.value),
            _at(audit, moment.row),
            f'{audit.timeline.messages[moment.row]:,}',
            _pose(audit, moment.row),
        ]
        for moment in audit.moments
    ]
    headers = ['what', 'value', 'at', 'message', 'joints there']
    return '<h2>Worst moments</h2>\n' + table(headers, rows, (1, 2, 3))


def _pose(audit: Audit, row: int) -> str:
    turning = [kind != 'prismatic' for kind in audit.robot.joint_types]
    values = audit.timeline.q[row].tolist()
    return '&nbsp; '.join(
        f'{math.degrees(value):.1f}&deg;' if turns else f'{value:.4f}&nbsp;m'
        for value, turns in zip(values, turning)
    )


def _joints(audit: Audit) -> str:
    rows = []
    for joint in audit.joints:
        scale, unit = (1.0, 'm') if joint.sliding else (math.degrees(1.0), '&deg;')

        def shown(value: float, scale: float = scale, unit: str = unit) -> str:
            return f'{scale * value:.4g}{unit}' if math.isfinite(value) else '&ndash;'

        check = joint.check
        compared = '&ndash;' if check is None else f'{shown(check.rms)}/s'
        lag = '' if check is None or not check.lag else f'{1e3 * check.lag:+.3g} ms'
        factor = '' if check is None or check.scale == 1.0 else f'&times; {check.scale:.3g}'
        rows.append(
            [
                escape(joint.name),
                f'{shown(joint.least)} to {shown(joint.greatest)}'.replace(' ', '&nbsp;'),
                f'{shown(joint.lower)} to {shown(joint.upper)}'.replace(' ', '&nbsp;')
                if math.isfinite(joint.upper) or math.isfinite(joint.lower)
                else 'none',
                f'{joint.beyond:,}' if joint.beyond else '',
                f'{joint.touching:,}' if joint.touching else '',
                f'{shown(joint.fastest)}/s' if math.isfinite(joint.fastest) else '&ndash;',
                f'{shown(joint.velocity_limit)}/s'
                if math.isfinite(joint.velocity_limit)
                else 'none',
                f'{joint.too_fast:,}' if joint.too_fast else '',
                compared,
                '&ndash;' if check is None else f'{shown(check.worst)}/s',
                f'{lag} {factor}'.strip(),
            ]
        )
    headers = [
        'joint',
        'range',
        'limits',
        'beyond (messages)',
        'at the limit',
        'fastest',
        'its limit',
        'above (messages)',
        'velocity error, rms',
        'worst',
        'lag, scale',
    ]
    text = '<h2>Joints</h2>\n' + table(headers, rows, tuple(range(3, 11)))
    if any(joint.check is not None for joint in audit.joints):
        text += (
            '<p class="soft">Velocity error: reported velocity minus the difference of the '
            'positions over its interval.</p>\n'
        )
    if all(joint.check is None for joint in audit.joints) and not audit.planned:
        text += '<p class="soft">No reported velocities to compare with the positions.</p>\n'
    return text + joint_charts(audit)


def _tool(audit: Audit) -> str:
    return '<h2>Tool</h2>\n' + tool_charts(audit)


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
        if number and reason != ACCEPTED
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
        first = [
            [escape(reason), f'{one.message:,}', escape(one.sentence)]
            for reason, one in audit.examples.items()
        ]
        text += table(['first one without a state', 'message', ''], first, (1,))
    if stream.gaps:
        gaps = [
            [f'{gap.message:,}', seconds(gap.seconds), f'{gap.after * 1e-9:.3f} s']
            for gap in stream.gaps[:MOST]
        ]
        text += table(['gap before message', 'lasts', 'after the stamp'], gaps, (0, 1, 2))
        text += more_of(stream.gap_count)
    if len(stream.orders) > 1:
        orders = [
            [f'{one.first:,}', f'{one.messages:,}', escape(', '.join(one.joints))]
            for one in stream.orders[:MOST]
        ]
        text += table(['first message', 'messages', 'joints in this order'], orders, (0, 1))
    return text + interval_chart(audit)


SECTIONS: tuple[Callable[[Audit], str], ...] = (
    plan_section,
    _singularities,
    _moments,
    _joints,
    _tool,
    frame_section,
    _stream,
)
