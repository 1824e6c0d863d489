# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Define a mistake to be tested (`Cause`), and the values of a formula with a mistake (`Variant`).
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ...arm.numbers import Floats
from ..statements.checks import QuantityCheck

WHOLE, BLOCK, COLUMN, ROW, ENTRY = 'whole', 'block', 'column', 'row', 'entry'
EVERYWHERE = (WHOLE, BLOCK, COLUMN, ROW, ENTRY)

MATRICES = ('tool', 'pose', 'row', 'general', 'rotation')
VECTORS = ('axis', 'origin', 'position', 'vector', 'reach')
POSES = ('tool', 'pose', 'row', 'general')
JACOBIAN = ('jacobian',)
ALL = (*MATRICES, *VECTORS, *JACOBIAN, 'numeric', 'det')


@dataclass(frozen=True, eq=False)
class Variant:
    """
    One mistaken version of the right formula.

    Parameters
    ----------
    sentence
        The mistake as a sentence, for the report. The report prints the sentence if the values of
        the user's formula equal `values`.
    values : shape (N, rows, columns)
        Values of the mistaken version at the N configurations.
    columns
        Indices of the columns that the mistake changes; empty: all.
    """

    sentence: str
    values: Floats
    columns: tuple[int, ...] = ()


@dataclass(frozen=True)
class Cause:
    """
    A mistake that is tested as the cause of a wrong formula; a row of the table `CAUSES`.

    Parameters
    ----------
    name
        Name in the list of tried causes.
    kinds
        Kinds of quantities (`Quantity.kind`) to which the cause applies.
    scopes
        Parts of a matrix that the cause may explain: the whole, a block, a column, a row, an
        entry.
    variants
        Function that yields the mistaken versions of the formula.
    many
        Whether the cause has a large number of mistaken versions, and one of them would fit a
        single configuration by chance. Such a cause is tried at random configurations only.
    """

    name: str
    kinds: tuple[str, ...]
    scopes: tuple[str, ...]
    variants: Callable[[QuantityCheck], Iterator[Variant]]
    many: bool = False
