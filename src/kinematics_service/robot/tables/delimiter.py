"""The sign that separates the cells of a table, pasted or in a file."""

from collections.abc import Sequence


def delimiter_of(lines: Sequence[str]) -> str:
    """Return what separates the cells of most lines; a space stands for any white space."""
    # If a line has commas and semicolons, its commas are those of decimals.
    held = {c: sum(c in line for line in lines) for c in '|\t;,'}
    likely = max(held, key=lambda c: held[c])
    return likely if held[likely] > len(lines) / 2 else ' '
