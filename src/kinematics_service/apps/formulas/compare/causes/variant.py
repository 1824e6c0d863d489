"""
A tested cause: its name, the parts it may explain, and the values of a mistaken formula.
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
        The mistake in words, if the person's formula equals it.
    values : shape (N, rows, columns)
    columns
        The only columns it is about; empty: all.
    """

    sentence: str
    values: Floats
    columns: tuple[int, ...] = ()


@dataclass(frozen=True)
class Cause:
    """
    A row of the table of causes.

    Parameters
    ----------
    name
        For the list of what was tried.
    kinds
        Kinds of quantities it applies to.
    scopes
        Parts of a matrix it may explain: the whole, a block, a column, a row, an entry.
    variants
        Its mistaken versions.
    many
        Whether it is tried at random poses only. A cause of many versions would fit a single
        configuration by chance.
    """

    name: str
    kinds: tuple[str, ...]
    scopes: tuple[str, ...]
    variants: Callable[[QuantityCheck], Iterator[Variant]]
    many: bool = False
