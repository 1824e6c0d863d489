# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Read the numbers of an episode as named columns, with one column for each element of a vector.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ....errors import RecordingError
from ....kernel import Floats
from . import episodes
from .episodes import Episode

if TYPE_CHECKING:
    import pyarrow as pa

# A vector is read only if it has at most this number of elements. Larger vectors are images or
# similar data.
MAX_ELEMENTS = 128
# Largest depth of groups in an HDF5 file, because the time of h5py grows with the depth squared.
MAX_GROUP_DEPTH = 32
# Physical type of texts in parquet files. Columns of texts are not read, because a text may have
# any length.
TEXT_TYPE = 'BYTE_ARRAY'
# Number of row groups of parquet files that stay in memory. They stay because the next episode may
# need their rows.
CACHED_ROW_GROUPS = 2


class Columns(NamedTuple):
    """Columns of numbers of an episode: their names, and their numbers as arrays (N,)."""

    header: list[str]
    columns: list[Floats]

    def __len__(self) -> int:
        return len(self.columns[0])

    def chosen(self, names: Sequence[str]) -> Floats:
        """Return the numbers (N, k) of the columns with these names."""
        return np.column_stack([self.columns[self.header.index(name)] for name in names])


def columns_of_episode(episode: Episode) -> Columns:
    """
    Return the numeric columns of an episode; each element of a vector is a column.

    Raises
    ------
    RecordingError
        The file cannot be read, or lacks numbers.
    """
    if episode.fault:
        raise episode.fault
    try:
        read = READERS[episode.file.suffix.lower()]
        columns = taken_apart(read(episode), episode.elements)
    except ImportError as error:
        raise episodes.missing_library(error) from None
    except Exception as error:
        raise episodes.fault_of(episode.file, error) from None
    if not columns.header or not len(columns):
        message = f'{episode.file}: {episode.name}: has no rows of numbers'
        raise RecordingError(message, code='empty')
    return columns


def taken_apart(vectors: Mapping[str, Floats], elements: Mapping[str, Sequence[str]]) -> Columns:
    """
    Split each vector (N, k) into k columns.

    The name of a column consists of the vector's name, a dot, and the element's name, such as
    `state.elbow`. If the elements have no names, their numbers from 0 are used, such as `state.0`.

    Parameters
    ----------
    elements
        Names of the elements, by the name of the vector.
    """
    header: list[str] = []
    columns: list[Floats] = []
    for name, numbers in vectors.items():
        if numbers.ndim == 1:
            header.append(name)
            columns.append(numbers)
            continue
        given = elements.get(name, ())
        names = [element.removesuffix('.pos').removesuffix('.position') for element in given]
        if len(names) != numbers.shape[1] or len(set(names)) < len(names):
            names = list(map(str, range(numbers.shape[1])))
        header += [f'{name}.{element}' for element in names]
        columns += list(numbers.T)
    episodes.refuse_twice(header)
    return Columns(header, columns)


def vectors_of_table(table: 'pa.RecordBatch | pa.Table') -> dict[str, Floats]:
    """
    Return the numeric columns of an Arrow table or batch of N rows as arrays, by column name.

    A column of numbers becomes an array (N,), a column of lists of k numbers an array (N, k).
    """
    import pyarrow as pa

    if isinstance(table, pa.RecordBatch):
        table = pa.Table.from_batches([table])
    table = _without_structs(table)
    episodes.refuse_twice(table.column_names)
    arrays = {name: _numbers(table[name]) for name in table.column_names}
    return {name: numbers for name, numbers in arrays.items() if numbers is not None}


def _numbers(column: Any) -> Floats | None:
    import pyarrow as pa
    import pyarrow.compute as compute
    import pyarrow.types as types

    array = column.combine_chunks()
    known = np.asarray(array.is_valid())
    lists, size = _is_list(array.type), 1
    while _is_list(array.type):
        if len(compute.list_value_length(array).drop_null().unique()) > 1:
            return None
        # Take the size of the vectors from their type, because no row shows the size if all rows
        # lack the vector.
        size *= array.type.list_size if types.is_fixed_size_list(array.type) else 0
        array = array.flatten()
    if not (types.is_floating(array.type) or types.is_integer(array.type)):
        return None
    if types.is_float16(array.type):
        array = array.cast(pa.float32())
    numbers = np.asarray(array.to_numpy(zero_copy_only=False), dtype=np.float64)
    if not lists:
        return numbers
    count = int(np.sum(known))
    size = len(numbers) // count if count else size
    if not 0 < size <= MAX_ELEMENTS:
        return None
    # The array `numbers` has no entries for rows without a vector, so fill these rows with NaN.
    rows = np.full((len(known), size), np.nan)
    rows[known] = numbers.reshape(count, size)
    return rows


def _is_list(kind: Any) -> bool:
    import pyarrow.types as types

    return bool(types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind))


def _of_parquet(episode: Episode) -> dict[str, Floats]:
    import pyarrow as pa
    import pyarrow.parquet as parquet

    file = str(episode.file)
    with parquet.ParquetFile(file) as opened:
        metadata = opened.metadata
        sizes = [metadata.row_group(k).num_rows for k in range(metadata.num_row_groups)]
    count = sum(sizes) if episode.count < 0 else episode.count
    begins = np.cumsum([0, *sizes])
    end = episode.first + count
    cuts = []
    for k, begin in enumerate(begins[:-1].tolist()):
        low, high = max(episode.first, begin), min(end, begin + sizes[k])
        if low < high:
            part = _row_group(file, episode.file.stat().st_mtime_ns, k, episode.place)
            cuts.append(part.slice(low - begin, high - low))
            episodes.refuse_to_hold(episode.file, sum(len(cut) * cut.num_columns for cut in cuts))
    table = pa.concat_tables(cuts)
    if episode.place == episodes.STEPS:
        table = _steps_of(table[episodes.STEPS].combine_chunks())
    return vectors_of_table(table)


def _steps_of(row: Any) -> Any:
    # Returns the steps of an episode as a table. `row` holds a list of steps, or a list of numbers
    # for each column.
    import pyarrow as pa

    if not pa.types.is_struct(row.type):
        return pa.Table.from_struct_array(row.flatten())
    table = _without_structs(pa.Table.from_struct_array(row))
    return pa.table({name: table[name].combine_chunks().flatten() for name in table.column_names})


def _without_structs(table: Any) -> Any:
    import pyarrow as pa

    while any(pa.types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    return table


@lru_cache(maxsize=CACHED_ROW_GROUPS)
def _row_group(file: str, changed: int, k: int, place: str) -> Any:
    # Reads row group k of a parquet file. Reads only columns that may hold numbers, so that
    # pictures are not read.
    import pyarrow.parquet as parquet

    with parquet.ParquetFile(file) as opened:
        names = [field.name for field in opened.schema_arrow if _may_be_numbers(field.type)]
        group = opened.metadata.row_group(k)
        chunks = [group.column(j) for j in range(group.num_columns)]
        read = (place,) if place else names
        begins = tuple(f'{name}.' for name in read)
        selected = [
            chunk
            for chunk in chunks
            if f'{chunk.path_in_schema}.'.startswith(begins) and chunk.physical_type != TEXT_TYPE
        ]
        episodes.refuse_to_hold(Path(file), sum(chunk.num_values for chunk in selected))
        return opened.read_row_group(k, columns=[chunk.path_in_schema for chunk in selected])


def _may_be_numbers(kind: Any) -> bool:
    import pyarrow.types as types

    while _is_list(kind):
        kind = kind.value_type
    if types.is_struct(kind):
        return any(_may_be_numbers(kind.field(k).type) for k in range(kind.num_fields))
    return bool(types.is_floating(kind) or types.is_integer(kind))


def _of_hdf5(episode: Episode) -> dict[str, Floats]:
    import h5py

    with h5py.File(episode.file, 'r') as opened:
        datasets: list[tuple[str, Any]] = []

        def take(name: str, part: Any) -> None:
            if name.count('/') > MAX_GROUP_DEPTH:
                raise RecordingError(
                    f'{episode.file}: more than {MAX_GROUP_DEPTH} groups are within each other; '
                    'move the numbers to an outer group',
                    code='too-deep',
                )
            if isinstance(part, h5py.Dataset) and part.ndim and part.dtype.kind in 'iuf':
                if part.external or part.is_virtual:
                    raise RecordingError(
                        f'{episode.file}: the numbers of {part.name} are in other files, '
                        'which are not read; copy them into this file',
                        code='unsupported',
                    )
                datasets.append((name.replace('/', '.'), part))

        opened[episode.place or '/'].visititems(take)
        episodes.refuse_twice(name for name, _ in datasets)
        return _alike(episode.file, dict(datasets), dict(datasets).__getitem__)


def _of_arrays(episode: Episode) -> dict[str, Floats]:
    arrays = _arrays(episode.file, episode.file.stat().st_mtime_ns)
    end = None if episode.count < 0 else episode.first + episode.count
    return {name: numbers[episode.first : end] for name, numbers in arrays.items()}


@lru_cache(maxsize=1)
def _arrays(file: Path, changed: int) -> dict[str, Floats]:
    with np.load(file, allow_pickle=False) as arrays:
        return _alike(file, episodes.headers_of(file), arrays.__getitem__)


# The function that reads the numbers of an episode, by the suffix of the file's name.
READERS = dict(zip(episodes.SUFFIXES, (_of_parquet, _of_hdf5, _of_hdf5, _of_arrays)))


def _alike(file: Path, arrays: Mapping[str, Any], read: Callable[[str], Any]) -> dict[str, Floats]:
    # Returns the arrays of numbers, (N,) or (N, k), of a file. N is the number of rows that most
    # of its arrays have. Arrays with another number of rows, and vectors of more than
    # MAX_ELEMENTS, are left out.
    small = {
        name: array
        for name, array in arrays.items()
        if array.ndim and array.dtype.kind in 'iuf' and np.prod(array.shape[1:]) <= MAX_ELEMENTS
    }
    counts = [len(array) for array in small.values()]
    usual = max(counts, key=counts.count, default=0)
    small = {name: array for name, array in small.items() if len(array) == usual}
    # Count the numbers that reading unpacks. HDF5 unpacks whole chunks, and a chunk may be larger
    # than the array.
    parts = [(array.shape, getattr(array, 'chunks', None) or ()) for array in small.values()]
    episodes.refuse_to_hold(file, sum(max(map(math.prod, part)) for part in parts))
    return {
        name: np.asarray(read(name), dtype=np.float64).reshape(
            array.shape[:1] + (-1,) * (array.ndim > 1)
        )
        for name, array in small.items()
    }
