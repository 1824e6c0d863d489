# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write a derivation as plain text for a terminal."""

import re
from collections.abc import Iterator, Sequence

import sympy

from ..file_factors import DecimalPrinter
from .report import Block, Equation, Heading

# Maximum number of characters in a row of a matrix. A wider matrix is printed entry by entry.
MAX_WIDTH = 150
COLUMN_GAP = 3  # spaces between two columns of a matrix


def text_of(blocks: Sequence[Block]) -> str:
    """
    Return the blocks of a report as plain text. A matrix is written in columns, a wide matrix
    entry by entry.
    """
    lines: list[str] = []
    for block in blocks:
        if isinstance(block, Heading):
            lines += ['', block.text, '=-~'[block.level - 1] * len(block.text)]
        elif isinstance(block, Equation):
            left = block.left.replace('\\dot{q}', 'qdot')
            lines += _equation(re.sub(r'[\\{}]', '', left), block.right)
        else:
            lines.append(''.join(p if isinstance(p, str) else written(p) for p in block.parts))
    # Keep one empty line between two matrices.
    return re.sub(r'\n{3,}', '\n\n', '\n'.join(lines)).lstrip('\n') + '\n'


def written(expression: sympy.Expr | sympy.Matrix) -> str:
    """Return an expression or matrix as text in one line."""
    return str(DecimalPrinter().doprint(expression))


def _equation(left: str, right: sympy.Expr) -> list[str]:
    if not isinstance(right, sympy.MatrixBase):
        return [f'  {left} = {written(right)}']
    if right.cols == 1:
        return [f'  {left} = [{", ".join(written(e) for e in right)}]']
    entries = [[written(right[i, j]) for j in range(right.cols)] for i in range(right.rows)]
    widths = [max(map(len, column)) for column in zip(*entries)]
    name = f'  {left} = '
    if len(name) + sum(widths) + COLUMN_GAP * len(widths) + 2 > MAX_WIDTH:
        head = f'  {left}: {right.rows} x {right.cols}, too wide for columns'
        return [head, *_one_by_one(entries)]
    rows = [(' ' * COLUMN_GAP).join(map(str.ljust, row, widths)) for row in entries]
    begins = [' ' * len(name)] * right.rows
    begins[(right.rows - 1) // 2] = name
    return ['', *(f'{begin}[ {row} ]' for begin, row in zip(begins, rows)), '']


def _one_by_one(entries: Sequence[Sequence[str]]) -> Iterator[str]:
    for i, row in enumerate(entries, 1):
        yield from (f'    [{i},{j}] = {e}' for j, e in enumerate(row, 1) if e != '0')
    if zeros := sum(row.count('0') for row in entries):
        yield f'    the other {zeros} are 0'
