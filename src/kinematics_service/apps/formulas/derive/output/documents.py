# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write a derivation as a document in one of the output formats."""

import re
from collections.abc import Callable, Sequence

from ..derivation import Derivation
from ..path import Path
from .html import html_of
from .json_output import json_of
from .latex import formula, latex_of, left_side
from .report import Block, Equation, Heading, report_of
from .text import text_of


def document_of(
    derivation: Derivation, format: str, frame: str | None = None, path: Path | None = None
) -> str:
    """
    Return a derivation as a document.

    Parameters
    ----------
    derivation
        The derivation to write.
    format
        `json`, or a name of `WRITERS`.
    frame
        Axes of the Jacobian: `base` (default), `tool`, or the number of a frame; not for `json`.
    path
        A path q(t). If it is given, the document has the tool's velocity along the path.
    """
    if format == 'json':
        return json_of(derivation, path)
    return WRITERS[format](report_of(derivation, frame, path))


def markdown_of(blocks: Sequence[Block]) -> str:
    """Return the blocks of a report as Markdown, with formulas between dollar signs."""
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


WRITERS: dict[str, Callable[[Sequence[Block]], str]] = {
    'text': text_of,
    'markdown': markdown_of,
    'latex': latex_of,
    'html': html_of,
}
