"""An audit on the screen: the verdict, the stretches, the worst moments."""

from typing import NamedTuple

from rich.text import Text

from ....printing import Output, heading, plain, table
from ....robot.measures import Level
from ..auditing import Audit
from ..findings import Finding, count, seconds
from ..verdict import verdict_of

STYLES = {Level.OK: 'green', Level.WARN: 'yellow', Level.ERROR: 'red'}
MOST = 20


class Summary(NamedTuple):
    """The printed part of an audit: a heading, sentences, and the stretches as rows of a table."""

    heading: str
    sentences: tuple[Finding, ...]
    stretches: tuple[tuple[str, ...], ...]
    more: int


def summary_of(audit: Audit) -> Summary:
    """Return the printed part of an audit, small enough to send between processes."""
    noun = 'sample' if audit.planned else 'message'
    return Summary(
        f'{audit.file}: {audit.what}, {count(audit.stream.messages, noun)} over '
        f'{seconds(audit.timeline.end)}, {audit.robot.name}',
        verdict_of(audit).sentences,
        tuple(
            (
                f'{stretch.begin:.3f} s',
                seconds(stretch.seconds),
                stretch.level.name,
                f'{stretch.value:.3g}',
                f'{audit.timeline.t[stretch.worst]:.3f} s',
                ', '.join(one.name for one in stretch.factors) or stretch.lost,
            )
            for stretch in audit.stretches[:MOST]
        ),
        max(len(audit.stretches) - MOST, 0),
    )


def print_summary(summary: Summary) -> None:
    """Print a summary."""
    out = Output()
    out.print(heading(summary.heading))
    for sentence in summary.sentences:
        level = sentence.level
        out.print(Text.assemble((f'{level.name}  ', STYLES[level]), plain(sentence.text)))
    if summary.stretches:
        rows = table('begins', 'lasts', 'level', 'worst', 'at', 'which')
        for *cells, which in summary.stretches:
            rows.add_row(*cells, plain(which))
        out.print(Text(''), rows)
        if summary.more:
            out.print(Text(f'and {summary.more:,} more'))
