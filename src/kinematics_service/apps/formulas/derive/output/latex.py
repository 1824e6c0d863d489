# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write a derivation as a LaTeX file."""

from collections.abc import Sequence

import sympy
from sympy.printing.latex import LatexPrinter

from ..file_factors import decimal
from .report import Block, Equation, Heading

# The preamble shrinks matrices that are wider than the line, because one column of a six-joint
# Jacobian can fill a line.
PREAMBLE = r"""\documentclass{article}
\usepackage{amsmath,graphicx}
\usepackage[landscape,margin=15mm]{geometry}
\setcounter{MaxMatrixCols}{20}
\newsavebox{\equationbox}
\newcommand{\fitted}[1]{\sbox{\equationbox}{$\displaystyle #1$}%
  \ifdim\wd\equationbox>\linewidth\resizebox{\linewidth}{!}{\usebox{\equationbox}}%
  \else\usebox{\equationbox}\fi}
\begin{document}
"""
SPECIAL = {
    '\\': r'\textbackslash{}', '_': r'\_', '&': r'\&', '%': r'\%', '#': r'\#', '$': r'\$',
    '{': r'\{', '}': r'\}', '^': r'\^{}', '~': r'\~{}',
}  # fmt: skip


class DecimalLatexPrinter(LatexPrinter):  # type: ignore[misc]
    """A printer of sympy's LaTeX that keeps decimals of the robot file as decimals."""

    def _print_Rational(self, expr: sympy.Expr) -> str:
        return decimal(expr) or str(super()._print_Rational(expr))


def formula(expression: sympy.Expr | sympy.Matrix) -> str:
    """Return an expression as LaTeX, without delimiters."""
    return str(DecimalLatexPrinter({'mat_str': 'matrix', 'mat_delim': '['}).doprint(expression))


def left_side(left: str) -> str:
    """Return the left side of an equation as LaTeX."""
    return left.replace('det J', r'\det J').replace('base', r'\mathrm{base}')


def escaped(text: str) -> str:
    """Return plain text with the special characters of LaTeX escaped."""
    return ''.join(SPECIAL.get(c, c if ord(c) < 128 else '?') for c in text)


def latex_of(blocks: Sequence[Block]) -> str:
    """Return the blocks of a report as a LaTeX document."""
    lines = [PREAMBLE]
    for block in blocks:
        if isinstance(block, Heading):
            kind = ('section', 'subsection', 'subsubsection')[block.level - 1]
            lines.append(rf'\{kind}*{{{escaped(block.text)}}}')
        elif isinstance(block, Equation):
            right = formula(block.right)
            lines.append(rf'\noindent\fitted{{{left_side(block.left)} = {right}}}\par\medskip')
        else:
            parts = (escaped(p) if isinstance(p, str) else f'${formula(p)}$' for p in block.parts)
            lines.append(''.join(parts) + r'\par')
    return '\n'.join([*lines, r'\end{document}', ''])
