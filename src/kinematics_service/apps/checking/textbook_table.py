# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Print the DH table (or other table) of a robot file in the form of textbooks."""

from collections.abc import Callable

import numpy as np
from rich.console import RenderableType
from rich.text import Text

from ...printing import plain, table
from ...robot.file.parts.convention_table import CONVENTIONS, RowKind
from ...robot.file.parts.description import (
    DhRow,
    ElementaryMotion,
    RigidMotion,
    RobotDescription,
    ShapeRow,
)


def _denavit_hartenberg(description: RobotDescription) -> RenderableType:
    angle, length = description.angle_unit, description.length_unit
    convention = CONVENTIONS[description.convention]
    axes = {name: axis for axis, name in convention.motions}
    # In Craig's convention, row i has a and alpha of link i-1, so the heads of these columns get
    # the index (i-1).
    before = {name for _, name in convention.before_joint}
    heads = (
        f'{name}{"(i-1)" if name in before else ""} [{angle if axes[name][0] == "R" else length}]'
        for name in convention.quantities
    )
    rows = table('  i', *heads)
    for i, row in enumerate(description.links, 1):
        assert isinstance(row, DhRow)
        rows.add_row(f'  {i}', *(plain(row[name].text) for name in convention.quantities))
    return rows


def _product(description: RobotDescription) -> RenderableType:
    motions = [_motion_text(row) for row in description.links]
    return Text('  T = ' + ' '.join(motions))


def _shapes(description: RobotDescription) -> RenderableType:
    rows = table('  i', 'in', 'joint', 'out')
    for i, row in enumerate(description.links, 1):
        assert isinstance(row, ShapeRow)
        rows.add_row(
            f'  {i}',
            motion_text(row.inner),
            'fixed' if row.joint is None else _motion_text(row.joint),
            motion_text(row.outer),
        )
    return rows


def _motion_text(motion: object) -> str:
    assert isinstance(motion, ElementaryMotion)
    return plain(f'{motion.axis}({motion.argument.text})')


TABLES: dict[RowKind, Callable[[RobotDescription], RenderableType]] = {
    'quantities': _denavit_hartenberg,
    'motion': _product,
    'shape': _shapes,
}


def textbook_table(description: RobotDescription) -> RenderableType:
    """Return the table of a robot, rows from base to tool, in the units of its file."""
    return TABLES[CONVENTIONS[description.convention].rows](description)


def motion_text(motion: RigidMotion) -> str:
    """Return a constant pose as the file writes it: `identity`, `xyz ... rpy ...`, or a matrix."""
    if np.array_equal(motion.matrix, np.eye(4)):
        return 'identity'
    texts = [plain(text) for text in motion.texts]
    if len(texts) == 6:
        parts = [
            f'{key} ({", ".join(three)})'
            for key, three in (('xyz', texts[:3]), ('rpy', texts[3:]))
            if any(text != '0' for text in three)  # leave out a vector of zeros
        ]
        return ' '.join(parts)
    width = max(map(len, texts))
    rows = (texts[i : i + 4] for i in range(0, len(texts), 4))
    return '\n'.join('  '.join(text.rjust(width) for text in row) for row in rows)
