# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Find the sign that separates the cells of a table."""

from collections.abc import Sequence


def delimiter_of(lines: Sequence[str]) -> str:
    """
    Return the sign that separates cells: among `|`, tab, `;` and `,` the sign that the largest
    number of lines contains.

    If no more than half of the lines contain it, return a space, which means any white space.
    """
    # If equally many lines contain semicolons and commas, `max` chooses the semicolon, which comes
    # first in the string: the commas are then decimal commas.
    counts = {sign: sum(sign in line for line in lines) for sign in '|\t;,'}
    likely = max(counts, key=lambda sign: counts[sign])
    return likely if counts[likely] > len(lines) / 2 else ' '
