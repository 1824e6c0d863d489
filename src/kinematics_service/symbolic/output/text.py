"""A derivation as plain text for a terminal."""

import re
from collections.abc import Sequence
from typing import Any

import sympy

from ..file_factors import DecimalPrinter
from .report import Block, Equation, Heading

# Lines of a matrix are no longer than this; spaces between its columns.
WIDEST, GAP = 150, 3


def text_of(blocks: Sequence[Block]) -> str:
    """Return plain text; matrices in columns, or where they are too wide entry by entry."""
    lines: list[str] = []
    for block in blocks:
        if isinstance(block, Heading):
            lines += ['', block.text, '=-~'[block.level - 1] * len(block.text)]
        elif isinstance(block, Equation):
            lines += _equation(_plain(block.left), block.right)
        else:
            lines.append(''.join(p if isinstance(p, str) else written(p) for p in block.parts))
    # One empty line where two matrices follow each other.
    return re.sub(r'\n{3,}', '\n\n', '\n'.join(lines)).lstrip('\n') + '\n'


def written(expression: Any) -> str:
    """Return an expression in one line."""
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
    entries = [[written(right[i, j]) for j in range(right.cols)] for i in range(right.rows)]
    widths = [max(map(len, column)) for column in zip(*entries)]
    name = f'  {left} = '
    if len(name) + sum(widths) + GAP * len(widths) + 2 <= WIDEST:
        gap = ' ' * GAP
        rows = [gap.join(e.ljust(w) for e, w in zip(row, widths)) for row in entries]
        middle = (right.rows - 1) // 2
        return [
            '',
            *(
                f'{name if i == middle else " " * len(name)}[ {row} ]'
                for i, row in enumerate(rows)
            ),
            '',
        ]
    zeros = sum(entry == '0' for row in entries for entry in row)
    lines = [f'  {left}: {right.rows} x {right.cols}, too wide for columns']
    lines += [
        f'    [{i},{j}] = {entry}'
        for i, row in enumerate(entries, 1)
        for j, entry in enumerate(row, 1)
        if entry != '0'
    ]
    return lines + ([f'    the other {zeros} are 0'] if zeros else [])
