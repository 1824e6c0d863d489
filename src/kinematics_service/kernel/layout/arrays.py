"""
The arrays that the kernel takes: checked once, then read without any more checks.

The compiled kernel has addresses instead of this source's flat views of the same arrays;
arrays.pxd has its versions of these functions. Some read the bits of numbers as whole numbers, or
the other way round.
"""

from typing import Annotated, Any, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Bytes = npt.NDArray[np.uint8]
Vector = tuple[float, float, float]
# The same to Python, but not to the compiled kernel: the addresses of an array's numbers; of those
# or of a few that a function keeps for itself; whole numbers of 64 bits everywhere, and of 32; and
# a field that Python may set.
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
    """Raise TypeError if an object of the kernel is None."""
    if thing is None:
        raise TypeError('the kernel takes an object of its own here, not None')


def size(array: npt.NDArray[Any]) -> int:
    """Return the number of elements of an array."""
    if not isinstance(array, np.ndarray):
        raise TypeError('the kernel takes arrays')
    return array.size


def extent(array: npt.NDArray[Any], axis: int) -> int:
    """Return the number of elements of an array along an axis."""
    if not isinstance(array, np.ndarray) or array.ndim <= axis:
        raise TypeError(f'the kernel takes an array of at least {axis + 1} dimensions here')
    return array.shape[axis]


def numbers(array: Floats, count: int) -> Flat:
    """Return the numbers of an array that has at least `count`."""
    return _flat(array, count, np.float64, 'float64', False)  # type: ignore[no-any-return]


def results(array: Floats, count: int) -> Flat:
    """Return the numbers of an array that has at least `count`, to be written."""
    return _flat(array, count, np.float64, 'float64', True)  # type: ignore[no-any-return]


def whole(array: Integers, count: int) -> FlatIntegers:
    """Return the whole numbers of an array that has at least `count`."""
    return _flat(array, count, np.int64, 'int64', False)  # type: ignore[no-any-return]


def whole_results(array: Integers, count: int) -> FlatIntegers:
    """Return the whole numbers of an array that has at least `count`, to be written."""
    return _flat(array, count, np.int64, 'int64', True)  # type: ignore[no-any-return]


def octets(array: Bytes, count: int) -> FlatBytes:
    """Return the bytes of an array that has at least `count`."""
    return _flat(array, count, np.uint8, 'uint8', False)  # type: ignore[no-any-return]


def octets_to_fill(array: Bytes, count: int) -> FlatBytes:
    """Return the bytes of an array that has at least `count`, to be written."""
    return _flat(array, count, np.uint8, 'uint8', True)  # type: ignore[no-any-return]


def octets_of(data: bytes) -> FlatBytes:
    """Return the bytes of a message."""
    return np.frombuffer(data, np.uint8)


def scratch(count: int) -> Flat:
    """Return room for numbers, to be given back."""
    return np.zeros(count)


def rooms(*counts: int) -> list[Flat]:
    """Return rooms for numbers, which an object is given by its `__init__`, and gives back."""
    return [np.zeros(count) for count in counts]


def whole_rooms(*counts: int) -> list[FlatIntegers]:
    """Return the same for whole numbers."""
    return [np.zeros(count, dtype=np.int64) for count in counts]


def give_back(room: Flat) -> None:
    """Give back the memory from `scratch`."""


def let_go() -> np.errstate:
    """
    Let other threads have the interpreter's lock, until `take_back`.

    Meanwhile numpy gives no warnings, like the compiled kernel: lanes compute numbers that they do
    not use.
    """
    errors_ignored = np.errstate(all='ignore')
    errors_ignored.__enter__()
    return errors_ignored


def take_back(lock: np.errstate) -> None:
    """Take the interpreter's lock, which `let_go` returned."""
    lock.__exit__(None, None, None)


def after(numbers: Flat, place: int) -> Flat:
    """Return the numbers from an index on."""
    return numbers[place:]


def copy(to: Numbers, count: int, numbers: Numbers) -> None:
    """Write the first `count` numbers of an array into another one."""
    to[:count] = numbers[:count]  # type: ignore[assignment]


def fill(to: Numbers, count: int, number: float) -> None:
    """Write a number `count` times."""
    to[:count] = [number] * count  # type: ignore[assignment]


def dot(a: Numbers, b: Numbers, count: int) -> float:
    """Return the sum of products of `count` numbers, in their order."""
    total = 0.0
    for k in range(count):
        total += a[k] * b[k]
    return total


def whole_after(integers: FlatIntegers, place: int) -> FlatIntegers:
    """Return the whole numbers from an index on."""
    return integers[place:]


def as_whole(numbers: Flat) -> FlatIntegers:
    """Return the same bits as whole numbers."""
    return numbers.view(np.int64)


def number_at(data: Bytes, place: int) -> float:
    """Return the double whose bytes begin at an offset."""
    return float(data[place : place + 8].view(np.float64)[0])


def seconds_at(data: Bytes, place: int) -> int:
    """Return the int32 whose bytes begin at an offset."""
    return int(data[place : place + 4].view(np.int32)[0])


def nanoseconds_at(data: Bytes, place: int) -> int:
    """Return the uint32 whose bytes begin at an offset."""
    return int(data[place : place + 4].view(np.uint32)[0])


def put_number(data: Bytes, place: int, number: float) -> None:
    """Write a double's bytes at an offset."""
    data[place : place + 8].view(np.float64)[0] = number


def put_half_word(data: Bytes, place: int, number: int) -> None:
    """Write the lowest 32 bits of a whole number at an offset."""
    data[place : place + 4].view(np.uint32)[0] = number & 0xFFFFFFFF
