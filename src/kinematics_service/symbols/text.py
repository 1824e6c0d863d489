"""
A derivation as plain text for a terminal.

"""

import re
from collections.abc import Sequence
from typing import Any

import sympy
from sympy.printing.str import StrPrinter

from .file_factors import decimal
from .report import Block, Equation, Heading


class DecimalPrinter(StrPrinter):  # type: ignore[misc]
    """
    Sympy's own strings, with decimals where the file had decimals.

    """

    def _print_Rational(self, expr: Any) -> str:
        return decimal(expr) or f'{expr.p}/{expr.q}'


def text_of(blocks: Sequence[Block]) -> str:
    """
    Return plain text; matrices entry by entry, zeros left out.

    """
    lines: list[str] = []
    for block in blocks:
        if isinstance(block, Heading):
            lines += ['', block.text, '=-~'[block.level - 1] * len(block.text)]
        elif isinstance(block, Equation):
            lines += _equation(_plain(block.left), block.right)
        else:
            lines.append(''.join(p if isinstance(p, str) else written(p) for p in block.parts))
    return '\n'.join(lines).lstrip('\n') + '\n'


def written(expression: Any) -> str:
    """
    Return an expression in one line.

    """
    return str(DecimalPrinter().doprint(expression))


def _plain(left: str) -> str:
    if left.startswith('\\dot'):
        return 'qdot(t)'
    return re.sub(r'[\\{}]', '', left)


def _equation(left: str, right: Any) -> list[str]:
    if not isinstance(right, sympy.MatrixBase):
        return [f'  {left} = {written(right)}']
    if right.cols == 1:
        return [f'  {left} = [{", ".join(written(e) for e in right)}]']
    lines = [f'  {left}: {right.rows} x {right.cols}']
    for i in range(right.rows):
        for j in range(right.cols):
            if right[i, j] != 0:
                lines.append(f'    [{i + 1},{j + 1}] = {written(right[i, j])}')
    return lines
