# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write the main formulas of a derivation as LaTeX for a notebook."""

from ..derivation import Derivation
from .latex import formula

# Maximum number of LaTeX characters of a formula, about a page. The notebook shows only the name
# of a longer formula.
MAX_CHARACTERS = 2_000


def latex_of(derivation: Derivation) -> str:
    """
    Return T, J and det J of a derivation as LaTeX. A formula longer than a page is only named.
    """
    determinant = derivation.singular_set.determinant
    left = r'\det J' if determinant.square else 'w'
    lines = []
    for name, left_side, expression in (
        ('T', 'T', derivation.T),
        ('jacobian', 'J', derivation.jacobian),
        ('singular_set.determinant.expression', left, determinant.expression),
    ):
        if expression is None:
            lines.append(rf'{left_side} &: \text{{too many minors to write out}}')
            continue
        right = formula(derivation.in_angles(expression))
        if len(right) > MAX_CHARACTERS:
            right = rf'\texttt{{derivation.{name}}}'.replace('_', r'\_')
        lines.append(f'{left_side} &= {right}')
    return '$$\\begin{aligned}' + r' \\[1ex] '.join(lines) + '\\end{aligned}$$'
