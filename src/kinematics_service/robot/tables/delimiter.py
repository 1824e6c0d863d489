"""Find the sign that separates the cells of a table."""

from collections.abc import Sequence


def delimiter_of(lines: Sequence[str]) -> str:
    """Return the separator of cells in most lines; a space stands for any white space."""
    # The semicolon comes before the comma: lines with both have decimal commas.
    counts = {sign: sum(sign in line for line in lines) for sign in '|\t;,'}
    likely = max(counts, key=lambda sign: counts[sign])
    return likely if counts[likely] > len(lines) / 2 else ' '
