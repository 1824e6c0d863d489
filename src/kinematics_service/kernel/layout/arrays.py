"""
Check numpy arrays once, so that the kernel can read and write them without further checks.

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
# The compiled kernel distinguishes the following types; plain Python does not.
# Flat, FlatIntegers, FlatBytes: addresses of the numbers of an array. Numbers, WholeNumbers: an
# address, or a small array on the stack of a function. Nanoseconds and Int32: integers of 64 and
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
    """Return a flat view to read an array of at least `count` float64 numbers."""
    return _flat(array, count, np.float64, 'float64', False)  # type: ignore[no-any-return]


def results(array: Floats, count: int) -> Flat:
    """Return a flat view to write an array of at least `count` float64 numbers."""
    return _flat(array, count, np.float64, 'float64', True)  # type: ignore[no-any-return]


def whole(array: Integers, count: int) -> FlatIntegers:
    """Return a flat view to read an array of at least `count` int64 numbers."""
    return _flat(array, count, np.int64, 'int64', False)  # type: ignore[no-any-return]


def whole_results(array: Integers, count: int) -> FlatIntegers:
    """Return a flat view to write an array of at least `count` int64 numbers."""
    return _flat(array, count, np.int64, 'int64', True)  # type: ignore[no-any-return]


def octets(array: Bytes, count: int) -> FlatBytes:
    """Return a flat view to read an array of at least `count` bytes."""
    return _flat(array, count, np.uint8, 'uint8', False)  # type: ignore[no-any-return]


def octets_to_fill(array: Bytes, count: int) -> FlatBytes:
    """Return a flat view to write an array of at least `count` bytes."""
    return _flat(array, count, np.uint8, 'uint8', True)  # type: ignore[no-any-return]


def octets_of(data: bytes) -> FlatBytes:
    """Return a flat view to read the bytes of a message."""
    return np.frombuffer(data, np.uint8)


def scratch(count: int) -> Flat:
    """Return memory for `count` numbers; `give_back` frees it."""
    return np.zeros(count)


def rooms(*counts: int) -> list[Flat]:
    """Return an array of zeros for each count; the object that stores them frees them."""
    return [np.zeros(count) for count in counts]


def whole_rooms(*counts: int) -> list[FlatIntegers]:
    """Return an array of integer zeros for each count; the object that stores them frees them."""
    return [np.zeros(count, dtype=np.int64) for count in counts]


def give_back(room: Flat) -> None:
    """Free the memory from `scratch`."""


def let_go() -> np.errstate:
    """
    Release the interpreter's lock, so that other threads can run until `take_back`.

    In plain Python this function only switches off numpy's warnings until `take_back`. Lanes may
    compute invalid numbers that are not used, and the compiled kernel gives no warnings either.
    """
    errors_ignored = np.errstate(all='ignore')
    errors_ignored.__enter__()
    return errors_ignored


def take_back(lock: np.errstate) -> None:
    """Acquire the interpreter's lock again; `lock` is what `let_go` returned."""
    lock.__exit__(None, None, None)


def after(numbers: Flat, place: int) -> Flat:
    """Return the part of `numbers` that begins at index `place`, without copying."""
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
    """Return the part of `integers` that begins at index `place`, without copying."""
    return integers[place:]


def as_whole(numbers: Flat) -> FlatIntegers:
    """Return the bits of doubles as integers."""
    return numbers.view(np.int64)


def number_at(data: Bytes, place: int) -> float:
    """Return the double that begins at byte `place` of the data."""
    return float(data[place : place + 8].view(np.float64)[0])


def seconds_at(data: Bytes, place: int) -> int:
    """Return the int32 that begins at byte `place` of the data: the seconds of a stamp."""
    return int(data[place : place + 4].view(np.int32)[0])


def nanoseconds_at(data: Bytes, place: int) -> int:
    """Return the uint32 that begins at byte `place` of the data: the nanoseconds of a stamp."""
    return int(data[place : place + 4].view(np.uint32)[0])


def put_number(data: Bytes, place: int, number: float) -> None:
    """Write a double to the data from byte `place` on."""
    data[place : place + 8].view(np.float64)[0] = number


def put_half_word(data: Bytes, place: int, number: int) -> None:
    """Write the lowest 32 bits of an integer to the data from byte `place` on."""
    data[place : place + 4].view(np.uint32)[0] = number & 0xFFFFFFFF
