# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Print an audit on the screen: the verdict and the intervals."""

from typing import NamedTuple

from rich.text import Text

from .....printing import Output, heading, plain, table
from .....robot.measures import Level
from .....typography import counted
from ..auditing import Audit
from ..findings import Finding, seconds
from ..verdict import verdict_of

STYLES = {Level.OK: 'green', Level.WARN: 'yellow', Level.ERROR: 'red'}
MAX_INTERVALS = 20


class Summary(NamedTuple):
    """The printed part of an audit: a heading, sentences, and the intervals as rows of a table."""

    heading: str
    sentences: tuple[Finding, ...]
    intervals: tuple[tuple[str, ...], ...]
    more: int


def summary_of(audit: Audit) -> Summary:
    """Return the printed part of an audit, which is small enough to send between processes."""
    noun = 'sample' if audit.planned else 'message'
    return Summary(
        f'{audit.file}: {audit.kind}, {counted(audit.stream.messages, noun)} over '
        f'{seconds(audit.timeline.end)}, {audit.robot.name}',
        verdict_of(audit),
        tuple(
            (
                f'{interval.begin:.3f} s',
                seconds(interval.seconds),
                interval.level.name,
                f'{interval.value:.3g}',
                f'{audit.timeline.t[interval.worst]:.3f} s',
                ', '.join(passage.name for passage in interval.factors) or interval.lost,
            )
            for interval in audit.intervals[:MAX_INTERVALS]
        ),
        max(len(audit.intervals) - MAX_INTERVALS, 0),
    )


def print_summary(summary: Summary) -> None:
    """Print the summary of an audit on the screen."""
    out = Output()
    out.print(heading(summary.heading))
    for sentence in summary.sentences:
        level = sentence.level
        out.print(Text.assemble((f'{level.name}  ', STYLES[level]), plain(sentence.text)))
    if summary.intervals:
        rows = table('begins', 'lasts', 'level', 'worst', 'at', 'which')
        for *cells, names in summary.intervals:
            rows.add_row(*cells, plain(names))
        out.print(Text(''), rows)
        if summary.more:
            out.print(Text(f'and {summary.more:,} more'))
