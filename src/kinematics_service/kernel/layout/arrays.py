"""
Access to numpy arrays: each function checks an array once, and the kernel reads it without checks.

In plain Python the functions return flat views of the arrays. The compiled kernel uses addresses
instead, and its versions of these functions are in arrays.pxd. Some functions read the bits of a
double as an integer, or write those of an integer.
"""

from typing import Annotated, Any, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Bytes = npt.NDArray[np.uint8]
Vector = tuple[float, float, float]
# Types that only the compiled kernel distinguishes from the ones above.
# Flat, FlatIntegers, FlatBytes: addresses of the numbers of an array. Numbers, WholeNumbers: such
# an address or a small array on the stack of a function. Nanoseconds and Int32: integers of 64 and
# 32 bits on every machine. Public: a field that Python can set.
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
    """Raise TypeError if the argument is None: the kernel needs an object of its own."""
    if thing is None:
        raise TypeError('the kernel takes an object of its own here, not None')


def size(array: Floats | Integers | Bytes) -> int:
    """Return the number of elements of an array."""
    if not isinstance(array, np.ndarray):
        raise TypeError('the kernel takes arrays')
    return array.size


def extent(array: Floats | Integers | Bytes, axis: int) -> int:
    """Return the number of elements of an array along an axis."""
    if not isinstance(array, np.ndarray) or array.ndim <= axis:
        raise TypeError(f'the kernel takes an array of at least {axis + 1} dimensions here')
    return array.shape[axis]


def numbers(array: Floats, count: int) -> Flat:
    """Return the numbers of an array, at least `count`, to be read."""
    return _flat(array, count, np.float64, 'float64', False)  # type: ignore[no-any-return]


def results(array: Floats, count: int) -> Flat:
    """Return the numbers of an array, at least `count`, to be written."""
    return _flat(array, count, np.float64, 'float64', True)  # type: ignore[no-any-return]


def whole(array: Integers, count: int) -> FlatIntegers:
    """Return the integers of an array, at least `count`, to be read."""
    return _flat(array, count, np.int64, 'int64', False)  # type: ignore[no-any-return]


def whole_results(array: Integers, count: int) -> FlatIntegers:
    """Return the integers of an array, at least `count`, to be written."""
    return _flat(array, count, np.int64, 'int64', True)  # type: ignore[no-any-return]


def octets(array: Bytes, count: int) -> FlatBytes:
    """Return the bytes of an array, at least `count`, to be read."""
    return _flat(array, count, np.uint8, 'uint8', False)  # type: ignore[no-any-return]


def octets_to_fill(array: Bytes, count: int) -> FlatBytes:
    """Return the bytes of an array, at least `count`, to be written."""
    return _flat(array, count, np.uint8, 'uint8', True)  # type: ignore[no-any-return]


def octets_of(data: bytes) -> FlatBytes:
    """Return the bytes of a message."""
    return np.frombuffer(data, np.uint8)


def scratch(count: int) -> Flat:
    """Return memory for `count` numbers; `give_back` frees it."""
    return np.zeros(count)


def rooms(*counts: int) -> list[Flat]:
    """Return rows of numbers for the fields of an object; the object frees them at its end."""
    return [np.zeros(count) for count in counts]


def whole_rooms(*counts: int) -> list[FlatIntegers]:
    """Return rows of integers for the fields of an object; the object frees them at its end."""
    return [np.zeros(count, dtype=np.int64) for count in counts]


def give_back(room: Flat) -> None:
    """Free the memory from `scratch`."""


def let_go() -> np.errstate:
    """
    Release the interpreter's lock, so that other threads run until `take_back`.

    Until then numpy gives no warnings, like the compiled kernel: lanes may compute numbers that
    nothing reads.
    """
    errors_ignored = np.errstate(all='ignore')
    errors_ignored.__enter__()
    return errors_ignored


def take_back(lock: np.errstate) -> None:
    """Acquire the interpreter's lock again; `lock` is what `let_go` returned."""
    lock.__exit__(None, None, None)


def after(numbers: Flat, place: int) -> Flat:
    """Return the row of numbers that begins at index `place`."""
    return numbers[place:]


def copy(to: Numbers, count: int, numbers: Numbers) -> None:
    """Write the first `count` of `numbers` to the beginning of `to`."""
    to[:count] = numbers[:count]  # type: ignore[assignment]


def fill(to: Numbers, count: int, number: float) -> None:
    """Set the first `count` numbers of `to` to a number."""
    to[:count] = [number] * count  # type: ignore[assignment]


def dot(a: Numbers, b: Numbers, count: int) -> float:
    """Return the scalar product of two rows of `count` numbers, summed in their order."""
    total = 0.0
    for k in range(count):
        total += a[k] * b[k]
    return total


def whole_after(integers: FlatIntegers, place: int) -> FlatIntegers:
    """Return the row of integers that begins at index `place`."""
    return integers[place:]


def as_whole(numbers: Flat) -> FlatIntegers:
    """Return the bits of doubles as integers."""
    return numbers.view(np.int64)


def number_at(data: Bytes, place: int) -> float:
    """Return the double at an offset in bytes."""
    return float(data[place : place + 8].view(np.float64)[0])


def seconds_at(data: Bytes, place: int) -> int:
    """Return the int32 at an offset in bytes."""
    return int(data[place : place + 4].view(np.int32)[0])


def nanoseconds_at(data: Bytes, place: int) -> int:
    """Return the uint32 at an offset in bytes."""
    return int(data[place : place + 4].view(np.uint32)[0])


def put_number(data: Bytes, place: int, number: float) -> None:
    """Write a double at an offset in bytes."""
    data[place : place + 8].view(np.float64)[0] = number


def put_half_word(data: Bytes, place: int, number: int) -> None:
    """Write the lowest 32 bits of an integer at an offset in bytes."""
    data[place : place + 4].view(np.uint32)[0] = number & 0xFFFFFFFF
