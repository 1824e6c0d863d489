# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Check the type and size of numpy arrays once, so that the kernel can then read and write the arrays
without further checks.

In plain Python the functions return flat views of the arrays. The compiled kernel uses addresses
instead; arrays.pxd has the compiled versions of the functions. Some functions read the bits of a
double as an integer, or write the bits of an integer.
"""

from typing import Annotated, Any, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Bytes = npt.NDArray[np.uint8]
Vector = tuple[float, float, float]
# Types that the compiler distinguishes and plain Python does not. Flat, FlatIntegers, FlatBytes:
# addresses of the numbers of an array. Numbers, WholeNumbers: an address, or a small array on the
# stack of a function. Nanoseconds and Int32: integers of 64 and 32 bits on every machine. Public:
# a field that Python can set.
Flat = Floats
FlatIntegers = Integers
FlatBytes = Bytes
Numbers = Floats | list[float]
WholeNumbers = Integers | list[int]
Nanoseconds = int
Int32 = int
Field = TypeVar('Field')
Public: TypeAlias = Annotated[Field, 'public']


def _flat(array: Any, count: int, kind: type, name: str, written: bool) -> Any:
    fits = isinstance(array, np.ndarray) and array.dtype == kind and array.dtype.isnative
    fits = fits and array.flags.c_contiguous and array.flags.aligned
    if not fits or written and not array.flags.writeable:
        raise TypeError(f'the kernel takes an array of {name} here, aligned and in C order')
    if array.size < count:
        raise TypeError('an array is shorter than the kernel needs it')
    return array.reshape(-1)


def given(thing: object) -> None:
    """Raise TypeError if `thing` is None, because the kernel needs an object of a kernel class."""
    if thing is None:
        raise TypeError('the kernel takes an object of its own here, not None')


def size(array: Floats | Integers | Bytes) -> int:
    """Return the number of elements of an array."""
    if not isinstance(array, np.ndarray):
        raise TypeError('the kernel takes arrays')
    return array.size


def extent(array: Floats | Integers | Bytes, axis: int) -> int:
    """Return the number of elements of an array along `axis`."""
    if not isinstance(array, np.ndarray) or array.ndim <= axis:
        raise TypeError(f'the kernel takes an array of at least {axis + 1} dimensions here')
    return array.shape[axis]


def numbers(array: Floats, count: int) -> Flat:
    """Check that an array has at least `count` float64 numbers; return a flat view for reading."""
    return _flat(array, count, np.float64, 'float64', False)  # type: ignore[no-any-return]


def results(array: Floats, count: int) -> Flat:
    """Check that an array has at least `count` float64 numbers; return a flat view for writing."""
    return _flat(array, count, np.float64, 'float64', True)  # type: ignore[no-any-return]


def whole(array: Integers, count: int) -> FlatIntegers:
    """Check that an array has at least `count` int64 numbers; return a flat view for reading."""
    return _flat(array, count, np.int64, 'int64', False)  # type: ignore[no-any-return]


def whole_results(array: Integers, count: int) -> FlatIntegers:
    """Check that an array has at least `count` int64 numbers; return a flat view for writing."""
    return _flat(array, count, np.int64, 'int64', True)  # type: ignore[no-any-return]


def octets(array: Bytes, count: int) -> FlatBytes:
    """Check that an array has at least `count` bytes; return a flat view for reading."""
    return _flat(array, count, np.uint8, 'uint8', False)  # type: ignore[no-any-return]


def octets_to_fill(array: Bytes, count: int) -> FlatBytes:
    """Check that an array has at least `count` bytes; return a flat view for writing."""
    return _flat(array, count, np.uint8, 'uint8', True)  # type: ignore[no-any-return]


def octets_of(data: bytes) -> FlatBytes:
    """Return a flat view for reading the bytes of a message."""
    return np.frombuffer(data, np.uint8)


def scratch(count: int) -> Flat:
    """Return scratch memory for `count` float64 numbers; the caller frees it by `give_back`."""
    return np.zeros(count)


def rooms(*counts: int) -> list[Flat]:
    """
    Return a list of arrays of zeros, one array for each length in `counts`.

    Call this function only in the constructor of a kernel class, and store each array in an
    attribute. The compiled kernel frees the arrays together with the object.
    """
    return [np.zeros(count) for count in counts]


def whole_rooms(*counts: int) -> list[FlatIntegers]:
    """
    Return a list of arrays of integer zeros, one array for each length in `counts`.

    Call this function only in the constructor of a kernel class, and store each array in an
    attribute. The compiled kernel frees the arrays together with the object.
    """
    return [np.zeros(count, dtype=np.int64) for count in counts]


def give_back(room: Flat) -> None:
    """Free memory that `scratch` returned."""


def without_lock() -> np.errstate:
    """
    Return a context in which the compiled kernel releases the interpreter's lock, so that other
    threads run.

    In plain Python this context releases no lock. It switches off numpy's warnings, so that plain
    Python gives no warnings, like the compiled kernel.
    """
    return np.errstate(all='ignore')


def after(numbers: Flat, place: int) -> Flat:
    """Return the part of `numbers` that begins at index `place`, without copying."""
    return numbers[place:]


def copy(to: Numbers, count: int, numbers: Numbers) -> None:
    """Copy the first `count` numbers of `numbers` to the beginning of the array `to`."""
    to[:count] = numbers[:count]  # type: ignore[assignment]


def fill(to: Numbers, count: int, number: float) -> None:
    """Set the first `count` numbers of `to` to `number`."""
    to[:count] = [number] * count  # type: ignore[assignment]


def dot(a: Numbers, b: Numbers, count: int) -> float:
    """
    Return the scalar product of the first `count` numbers of a and b, summed from the first number
    on.
    """
    total = 0.0
    for k in range(count):
        total += a[k] * b[k]
    return total


def whole_after(integers: FlatIntegers, place: int) -> FlatIntegers:
    """Return the part of `integers` that begins at index `place`, without copying."""
    return integers[place:]


def as_whole(numbers: Flat) -> FlatIntegers:
    """Return a view of the bits of doubles as int64 integers."""
    return numbers.view(np.int64)


def number_at(data: Bytes, place: int) -> float:
    """Return the double that begins at byte `place` of a message."""
    return float(data[place : place + 8].view(np.float64)[0])


def seconds_at(data: Bytes, place: int) -> int:
    """Return the int32 that begins at byte `place` of a message: the seconds of a stamp."""
    return int(data[place : place + 4].view(np.int32)[0])


def nanoseconds_at(data: Bytes, place: int) -> int:
    """Return the uint32 that begins at byte `place` of a message: the nanoseconds of a stamp."""
    return int(data[place : place + 4].view(np.uint32)[0])


def put_number(data: Bytes, place: int, number: float) -> None:
    """Write the double `number` into a message from byte `place` on."""
    data[place : place + 8].view(np.float64)[0] = number


def put_half_word(data: Bytes, place: int, number: int) -> None:
    """Write the lowest 32 bits of the integer `number` into a message from byte `place` on."""
    data[place : place + 4].view(np.uint32)[0] = number & 0xFFFFFFFF
