"""What a caller gives beside joint positions: finite numbers that go together with them."""

import numpy as np
import numpy.typing as npt

from ..errors import ArgumentError
from ..kernel import Floats


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
