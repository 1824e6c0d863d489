"""
An audit on the screen: the verdict, the stretches, the worst moments.

"""

from rich.text import Text

from ..measures import Level
from ..printing import Output, heading, plain, table
from .auditing import Audit
from .verdict import count, seconds, verdict_of

SIGNS = {Level.OK: ('fine', 'green'), Level.WARN: ('note', 'yellow'), Level.ERROR: ('bad', 'red')}
MOST = 20


def print_summary(audit: Audit) -> None:
    """
    Print what there is to say.

    """
    out = Output()
    noun = 'sample' if audit.planned else 'message'
    out.print(
        heading(
            f'{audit.file}: {audit.what}, {count(audit.stream.messages, noun)} over '
            f'{seconds(audit.timeline.end)}, {audit.robot.name}'
        )
    )
    for sentence in verdict_of(audit).sentences:
        word, style = SIGNS[sentence.level]
        out.print(Text.assemble((f'{word}  ', style), plain(sentence.text)))
    if audit.stretches:
        rows = table('begins', 'lasts', 'level', 'worst', 'at', 'which')
        for stretch in audit.stretches[:MOST]:
            rows.add_row(
                f'{stretch.begin:.3f} s',
                seconds(stretch.seconds),
                SIGNS[stretch.level][0],
                f'{stretch.value:.3g}',
                f'{audit.timeline.t[stretch.worst]:.3f} s',
                ', '.join(one.name for one in stretch.factors) or plain(stretch.lost),
            )
        out.print(Text(''), rows)
        if len(audit.stretches) > MOST:
            out.print(Text(f'and {len(audit.stretches) - MOST:,} more'))
