"""A derivation as Markdown with LaTeX formulas."""

import re
from collections.abc import Sequence

from .latex import formula, left_side
from .report import Block, Equation, Heading


def markdown_of(blocks: Sequence[Block]) -> str:
    """Return Markdown; formulas between dollar signs."""
    lines: list[str] = []
    for block in blocks:
        if isinstance(block, Heading):
            lines += [f'{"#" * block.level} {_escaped(block.text)}', '']
        elif isinstance(block, Equation):
            lines += ['$$', f'{left_side(block.left)} = {formula(block.right)}', '$$', '']
        else:
            parts = (_escaped(p) if isinstance(p, str) else f'${formula(p)}$' for p in block.parts)
            lines += [''.join(parts), '']
    return '\n'.join(lines)


def _escaped(text: str) -> str:
    return re.sub(r'([\\`*_<>|#$\[\]])', r'\\\1', text)
