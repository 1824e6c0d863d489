# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write the section of the audit page on planned trajectories."""

import math
from html import escape

from .....page import table
from .....robot.file.parts.loop_groups import closed_together, group_in_words
from ...plans.verdicts import PlanCheck, PlanMoment, PlanVerdict
from ..auditing import Audit
from ..plan_findings import point_in_words, rounded_down, rounded_up
from .tables import MAX_TABLE_ROWS, more_of

TAGS: dict[PlanVerdict, str] = {
    'proved': '<span class="tag OK">&#10003; proved</span>',
    'refuted': '<span class="tag ERROR">&#9632; refuted</span>',
    'not decided': '<span class="tag WARN">&#9650; not decided</span>',
}
HEADERS = ('', 'verdict', 'proved', 'found', 'at', 'after point', 'joints there', 'singular pose')


def plan_section(audit: Audit) -> str:
    """Return the HTML section on planned trajectories; empty for a recording."""
    if not audit.plans:
        return ''
    rows = [row for number, plan in audit.plans.items() for row in _rows(audit, number, plan)]
    return (
        '<h2>Between the points</h2>\n'
        + table(HEADERS, rows[:MAX_TABLE_ROWS], (2, 3, 4, 5))
        + more_of(len(rows))
        + '<p class="soft">Along the polynomials of a joint trajectory controller. This is no '
        'safety function.</p>\n'
    )


def _rows(audit: Audit, number: int, plan: PlanCheck) -> list[list[str]]:
    label = f'trajectory {number}: ' if audit.trajectories > 1 else ''
    claim = plan.singularity
    pose = '' if claim.nearest_singular is None else _numbers(claim.nearest_singular.tolist())
    rows = [
        [
            f'{label}{claim.threshold:g} rad from every singular pose',
            TAGS[claim.verdict],
            f'{rounded_down(claim.lower)} rad' if claim.lower > 0.0 else '&ndash;',
            f'{rounded_up(claim.upper)} rad' if math.isfinite(claim.upper) else '&ndash;',
            *_moment(claim.moment),
            pose,
        ]
    ]
    if plan.closure is not None:
        moment = plan.closure.moment
        where = ['', '', ''] if moment is None else _moment(moment)
        name = f'{label}loops close at {plan.closure.samples:,} samples'
        if plan.closure.loop:
            closes = 'close' if closed_together(plan.closure.loop) else 'closes'
            name = f'{label}the {escape(group_in_words(plan.closure.loop))} {closes}'
        rows.append([name, TAGS[plan.closure.verdict], '', '', *where, ''])
    for joint in plan.joints:
        for verdict, words, extremes in (
            (joint.limits, 'inside its limits', (joint.least, joint.greatest)),
            (joint.speed, 'below its velocity limit', (joint.fastest,)),
        ):
            for extreme in extremes if verdict == 'refuted' else ():
                name, value = f'{label}{escape(joint.name)} {words}', f'{extreme.value:.4g}'
                rows.append([name, TAGS[verdict], '', value, *_moment(extreme.moment), ''])
    for speed in plan.speeds:
        limit = '' if speed.limit is None else f' below {speed.limit:g} m/s'
        rows.append(
            [
                f'{label}{escape(point_in_words(speed.of))}{limit}',
                '' if speed.verdict is None else TAGS[speed.verdict],
                f'{rounded_up(speed.upper)} m/s' if math.isfinite(speed.upper) else '&ndash;',
                f'{rounded_down(speed.lower)} m/s',
                *_moment(speed.moment),
                '',
            ]
        )
    return rows


def _moment(moment: PlanMoment) -> list[str]:
    return [f'{moment.time:.3f} s', f'{moment.point:,}', _numbers(moment.q.tolist())]


def _numbers(values: list[float]) -> str:
    return '&nbsp; '.join(f'{value:.4f}' for value in values)
