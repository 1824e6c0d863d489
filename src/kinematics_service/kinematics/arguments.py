"""What a caller gives beside joint positions: numbers that go together with them, and rows."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ..errors import ArgumentError
from ..kernel import Floats
from ..robot.task import ROW_NAMES


def finite_rows(
    refusal: type[ArgumentError], name: str, given: npt.ArrayLike, count: int
) -> Floats:
    """
    Return an argument, shape (..., count).

    Raises
    ------
    ArgumentError
        Of the type of `refusal`: it is of another shape, or not of finite numbers.
    """
    try:
        array = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.ndim == 0 or array.shape[-1] != count or not np.isfinite(array).all():
        raise refusal(
            f'{name} must be finite numbers of shape (..., {count}), not of {array.shape}',
            name,
            [(count,)],
            array.shape,
        )
    return array


def not_together(
    refusal: type[ArgumentError],
    names: tuple[str, str],
    shapes: tuple[tuple[int, ...], tuple[int, ...]],
    expected: tuple[int, ...],
) -> ArgumentError:
    """Return the refusal of the second of two arguments: leading dimensions do not fit."""
    one, other = shapes
    return refusal(
        f'{" and ".join(names)} have shapes {one} and {other}, which do not go together',
        names[1],
        [expected],
        other,
    )


def check_positive(refusal: type[ArgumentError], name: str, value: float) -> None:
    """Raise an ArgumentError of the type of `refusal` unless a number is finite and above 0."""
    if not 0.0 < value < np.inf:
        raise refusal(f'{name} must be a positive number, not {value}', name, ['above 0'], value)


def rows_in_order(
    refusal: type[ArgumentError], rows: Sequence[str], known: tuple[str, ...] = ROW_NAMES
) -> tuple[str, ...]:
    """Return rows by the order of the known ones, or raise an ArgumentError of the type given."""
    if not rows or set(rows) - set(known):
        sentence = f'rows must be some of {" ".join(known)}, not {" ".join(rows)!r}'
        raise refusal(sentence, 'rows', known, rows)
    return tuple(name for name in known if name in rows)
