# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Find the sign that separates the cells of a table."""

from collections.abc import Sequence


def delimiter_of(lines: Sequence[str]) -> str:
    """
    Return the sign that separates cells: the sign among `|`, tab, `;` and `,` that is in most
    lines.

    If at most half of the lines have this sign, return a space, which means any white space.
    """
    # Count the semicolon before the comma. If both are in equally many lines, the semicolon is
    # chosen, because the commas are decimal commas.
    counts = {sign: sum(sign in line for line in lines) for sign in '|\t;,'}
    likely = max(counts, key=lambda sign: counts[sign])
    return likely if counts[likely] > len(lines) / 2 else ' '
