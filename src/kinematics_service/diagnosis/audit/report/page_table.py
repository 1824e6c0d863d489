"""Tables of the audit page."""

from collections.abc import Iterable, Sequence

# Most rows of a table.
MOST = 60


def table(headers: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int]) -> str:
    """
    Return a table; cells are HTML already, those of the columns `numbers` are aligned to the
    right.
    """

    def cells(tag: str, row: Sequence[str]) -> str:
        return ''.join(
            f'<{tag}{" class=n" if k in numbers else ""}>{cell}</{tag}>'
            for k, cell in enumerate(row)
        )

    body = ''.join(f'<tr>{cells("td", row)}</tr>\n' for row in rows)
    head = f'<thead><tr>{cells("th", headers)}</tr></thead>\n' if any(headers) else ''
    return f'<div class="wide"><table>{head}<tbody>{body}</tbody></table></div>\n'


def more_of(number: int) -> str:
    """Return a sentence on the rows a table leaves out; empty if there are none."""
    if number <= MOST:
        return ''
    return f'<p class="soft">{number - MOST:,} more are in the JSON.</p>\n'
