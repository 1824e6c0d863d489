"""Tables of a page that leave rows out, which the JSON has."""

# Most rows of a table.
MOST = 60


def more_of(number: int) -> str:
    """Return a sentence on the rows a table leaves out; empty if there are none."""
    if number <= MOST:
        return ''
    return f'<p class="soft">{number - MOST:,} more are in the JSON.</p>\n'
