# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Find the sign that separates the cells of a table."""

from collections.abc import Sequence


def delimiter_of(lines: Sequence[str]) -> str:
    """
    Return the sign that is in more than half of the lines, `|`, tab, `;` or `,`, else a space. The
    space means any white space.
    """
    # The semicolon comes before the comma, so that the semicolon is chosen if both signs are in
    # equally many lines. In this case the commas are decimal commas.
    counts = {sign: sum(sign in line for line in lines) for sign in '|\t;,'}
    likely = max(counts, key=lambda sign: counts[sign])
    return likely if counts[likely] > len(lines) / 2 else ' '
