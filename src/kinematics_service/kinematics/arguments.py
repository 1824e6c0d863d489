# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Check arguments of public functions: arrays of numbers, seeds, row names, and shapes that broadcast
together.
"""

import contextlib
import math
from collections.abc import Iterable, Sequence
from numbers import Integral, Real
from typing import SupportsFloat, SupportsIndex

import numpy as np
import numpy.typing as npt

from ..errors import ArgumentError, Shape
from ..kernel import Floats
from ..robot.task import ROW_NAMES


def numbers_of(
    name: str,
    given: npt.ArrayLike | None,
    refusal: type[ArgumentError] = ArgumentError,
    expected: Sequence[Shape] = ('(...)',),
    shapes: str = '',
) -> Floats:
    """
    Return the argument `given`, called `name`, as a new float64 array, or raise an error of the
    class `refusal`.

    `shapes` is a text with the expected shapes for the error sentence. It is needed if the
    argument may have leading dimensions.
    """
    try:
        return np.array(given, dtype=np.float64, order='C')
    except (TypeError, ValueError, OverflowError):
        shapes = shapes or ' or '.join(map(str, expected))
        sentence = f'{name} must be numbers of shape {shapes}, not {given!r:.80}'
        raise refusal(sentence, name, expected, code='not-a-number') from None


def seed_of(seed: SupportsIndex) -> int:
    """Return a random seed as an int, or raise an ArgumentError if it is not a whole number."""
    if not isinstance(seed, Integral) or seed < 0:
        code = 'out-of-range' if isinstance(seed, Integral) else 'wrong-type'
        raise ArgumentError.refused('seed', 'a whole number from 0 on', seed, code=code)
    return int(seed)


def finite_rows(
    refusal: type[ArgumentError],
    name: str,
    given: npt.ArrayLike,
    count: int,
    q_shape: tuple[int, ...] | None = None,
) -> Floats:
    """
    Return an argument as an array of finite numbers, shape (..., count).

    If `q_shape` is given, the leading dimensions of the argument must fit those of joint positions
    with this shape.

    Raises
    ------
    ArgumentError
        The argument has another shape, or a number is not finite. The error has the class
        `refusal`.
    """
    array = numbers_of(name, given, refusal, [(count,)], f'(..., {count})')
    if array.ndim == 0 or array.shape[-1] != count:
        raise refusal.wrong_shape(name, array.shape, [(count,)], f'(..., {count})')
    finite = np.isfinite(array).all(axis=-1)
    if not finite.all():
        sentence = f'{name} must be finite, not {array[~finite][0].tolist()}'
        raise refusal(sentence, name, [(count,)], array.shape, code='not-finite')
    if q_shape is not None:
        shape_together(refusal, ('q', name), q_shape, array.shape, (count,))
    return array


def finite_vector(
    refusal: type[ArgumentError], name: str, given: npt.ArrayLike, components: Sequence[str]
) -> Floats:
    """
    Return an argument as an array with a finite number for each of `components`, or raise an error
    of the class `refusal`.
    """
    shape = (len(components),)
    vector = numbers_of(name, given, refusal, [shape])
    if vector.shape == shape and np.isfinite(vector).all():
        return vector
    numbers = f'{len(components)} finite numbers ({", ".join(components)})'
    code = 'wrong-shape' if vector.shape != shape else 'not-finite'
    sentence = f'{name} must be {numbers}, not {vector.tolist()}'
    raise refusal(sentence, name, [shape], vector.shape, code=code)


def shape_together(
    refusal: type[ArgumentError],
    names: tuple[str, str],
    shape: tuple[int, ...],
    other: tuple[int, ...],
    expected: tuple[int, ...],
    count: int = 1,
) -> tuple[int, ...]:
    """
    Return the leading dimensions of two array arguments after broadcasting.

    The first shape `shape` is (..., n). The last `count` dimensions of `other` must be equal to
    the last `count` dimensions of `expected`. If the shapes do not fit, the function raises an
    ArgumentError of the class `refusal`.
    """
    if other[-count:] == expected[-count:]:
        with contextlib.suppress(ValueError):
            return np.broadcast_shapes(shape[:-1], other[:-count])
    sentence = f'{" and ".join(names)} have shapes {shape} and {other}, which do not go together'
    raise refusal(sentence, names[1], [expected], other, code='mismatch')


def number_or_nan(value: SupportsFloat) -> float:
    """
    Return `value` as a float; NaN, which fails every comparison with a limit, if it is not a
    number.
    """
    if isinstance(value, float):  # test the usual type first, because this test is faster
        return value
    try:
        return float(value) if isinstance(value, Real) else math.nan
    except OverflowError:
        return math.inf


def check_positive(refusal: type[ArgumentError], name: str, value: float) -> None:
    """Raise an ArgumentError of the class `refusal` unless `value` is finite and above 0."""
    if not 0.0 < number_or_nan(value) < math.inf:
        sentence = f'{name} must be a positive number, not {value}'
        raise refusal(sentence, name, ['above 0'], value, code='out-of-range')


def rows_in_order(
    refusal: type[ArgumentError], rows: Sequence[str], known: tuple[str, ...] = ROW_NAMES
) -> tuple[str, ...]:
    """
    Return the row names `rows` in the order of `known`, or raise an ArgumentError of the class
    `refusal`.
    """
    names = list(map(str, rows)) if isinstance(rows, Iterable) else [str(rows)]
    if not names or set(names) - set(known):
        sentence = f'rows must be some of {" ".join(known)}, not {" ".join(names)!r}'
        raise refusal(sentence, 'rows', known, rows, code='unknown-name' if names else 'empty')
    return tuple(name for name in known if name in names)
