# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Find the episodes of a dataset: file, first row and number of rows, without reading the data."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from io import BytesIO
from itertools import chain, islice, pairwise
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import numpy.typing as npt

from ....errors import RecordingError
from ..readers.plan_reader import json_of, text_of

SUFFIXES = ('.parquet', '.hdf5', '.h5', '.npz')
# Accepted names of the column that holds the episode number of each row.
NUMBERS = ('episode_index', 'episode_id', 'episode')
# Largest number of values that are read at once (2 GiB of memory). All values of an episode are
# read at once, and so are all values of a row group of a parquet file. The limit is needed because
# a small file may claim more values than fit in memory.
MAX_NUMBERS = 2**28
# Largest header, in bytes, that is read for an array in an npz file; numpy refuses headers above
# 10,000.
MAX_HEADER_BYTES = 2**14
# Largest number of episodes in one file. Large datasets are split into many files, so no file
# needs more episodes.
MAX_EPISODES = 2**20
# Largest size of a dataset's description, info.json, 1 MiB; LeRobot writes some kilobytes.
MAX_INFO_BYTES = 2**20
# Largest rate of rows, Hz. At a larger rate, stamps in whole nanoseconds would repeat.
MAX_RATE = 1e9
# Largest depth of nested lists of element names. The lists in LeRobot datasets have depth 2.
MAX_LIST_DEPTH = 8
# Name of a column in which one row holds all steps of an episode.
STEPS = 'steps'
# Name of the array in npz files that gives the end of each episode: the number of the episode's
# last row plus 1.
ENDS = 'episode_ends'


@dataclass(frozen=True)
class Episode:
    """
    An episode of a dataset: consecutive rows of a file.

    Attributes
    ----------
    file, name
        The file, and the name of the episode in the dataset.
    place
        In an HDF5 file, the group that holds the episode. `STEPS` if the file has one row for the
        whole episode, with all its steps in the column `steps`. Otherwise empty.
    first, count
        First row, and number of rows; count -1: all rows.
    rate : Hz
        Rate of the rows from the description of the dataset, 0 without a description.
    elements
        Names of the elements of each vector, by the name of its column.
    fault
        The error if the file cannot be read; otherwise None.
    """

    file: Path
    name: str
    place: str = ''
    first: int = 0
    count: int = -1
    rate: float = 0.0
    elements: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    fault: RecordingError | None = None


def is_dataset(path: Path) -> bool:
    """Return whether a file or folder is a dataset, judged by its name and content."""
    if not path.is_dir():
        return path.suffix.lower() in SUFFIXES
    if (path / 'metadata.yaml').exists():
        return False  # a bag, not a dataset
    return _info_of(path).exists() or any(_files(path))


def episodes_of(path: Path) -> Iterator[Episode]:
    """
    Yield the episodes of a dataset in order; an unreadable file is an episode with a fault.

    Raises
    ------
    RecordingError
        The description of the dataset cannot be read, or a library is missing.
    """
    if not path.is_dir():
        yield from _of_file(Episode(path, path.name))
        return
    rate, data = 0.0, path
    elements: dict[str, tuple[str, ...]] = {}
    if _info_of(path).exists():
        rate, elements = _described(_info_of(path))
        data = path / 'data'
    for file in _files(data):
        name = file.relative_to(path).as_posix()
        yield from _of_file(Episode(file, name, rate=rate, elements=elements))


def _info_of(folder: Path) -> Path:
    return folder / 'meta' / 'info.json'


def _files(folder: Path) -> Iterator[Path]:
    return (file for file in sorted(folder.rglob('*')) if file.suffix.lower() in SUFFIXES)


def _described(info: Path) -> tuple[float, dict[str, tuple[str, ...]]]:
    # Returns the rate (Hz) and the names of vector elements from LeRobot's info.json.
    content: Any = json_of(info, text_of(info, MAX_INFO_BYTES, 'leave only fps and features'))
    features = content.get('features') if isinstance(content, dict) else None
    if not isinstance(features, dict) or {*map(type, features.values())} - {dict}:
        raise RecordingError(
            f'{info}: does not describe a dataset; write "features": {{"NAME": {{"names": '
            '[...]}}, as LeRobot does',
            code='wrong-type',
        )
    rate = content.get('fps') or 0
    if type(rate) not in (int, float) or not 0 <= rate <= MAX_RATE:
        raise RecordingError(
            f'{info}: fps: {str(rate)[:40]!r} is not a rate; write the frames per second, such '
            'as 30',
            code='out-of-range' if type(rate) in (int, float) else 'wrong-type',
        )
    names = {name: _names(entry.get('names'), MAX_LIST_DEPTH) for name, entry in features.items()}
    return float(rate), {key: elements for key, elements in names.items() if elements}


def _names(names: Any, depth: int) -> tuple[str, ...]:
    # Returns element names from a list, from nested lists, or from a mapping such as `motors` or
    # `axes`.
    if isinstance(names, Mapping):
        names = [part for part in names.values() if isinstance(part, list)]
    if not isinstance(names, list) or not depth:
        return ()
    parts = (_names(part, depth - 1) if isinstance(part, list) else (str(part),) for part in names)
    return tuple(chain.from_iterable(parts))


def fault_of(file: Path, error: Exception) -> RecordingError:
    """
    Return an error that says why `file` cannot be read. `error` is the exception that occurred
    when the file was read.
    """
    if isinstance(error, RecordingError):
        if str(error).startswith(f'{file}:'):
            return error
        return RecordingError(f'{file}: {error}', code=error.code)
    if isinstance(error, FileNotFoundError):
        kinds = ', '.join(SUFFIXES)
        message = f'{file}: there is no such file; give a dataset (a folder, or {kinds})'
        return RecordingError(message, code='missing-file')
    reason = ' '.join(str(error).split())[:200] or type(error).__name__
    message = f'{file}: cannot be read ({reason}); copy it anew, or leave it out'
    return RecordingError(message, code='unreadable')


def missing_library(reason: ImportError) -> RecordingError:
    """Return the error that names a missing library (pyarrow or h5py) and how to install it."""
    return RecordingError(
        f"datasets need pyarrow and h5py ({reason}): pip install '.[dataset]' in its checkout, or "
        'pip install pyarrow h5py',
        code='missing-package',
    )


def refuse_twice(names: Iterable[str]) -> None:
    """
    Raise an error if two columns of a table have equal names.

    Raises
    ------
    RecordingError
        Two columns have the same name. The caller must add the name of the file to the message.
    """
    for name, count in Counter(names).most_common(1):
        if count > 1:
            message = f'{count} columns are named {name[:40]!r}; rename all but one'
            raise RecordingError(message, code='duplicate-name')


def refuse_to_hold(file: Path, numbers: int) -> None:
    """
    Raise an error if more than `MAX_NUMBERS` numbers of a file would be read at once.

    Raises
    ------
    RecordingError
        The count of numbers exceeds `MAX_NUMBERS`.
    """
    if numbers > MAX_NUMBERS:
        raise RecordingError(
            f'{file}: {numbers:,} numbers at once are more than {MAX_NUMBERS:,}; cut it into '
            'episodes, or groups of rows',
            code='too-large',
        )


def _of_file(whole: Episode) -> Iterator[Episode]:
    # Yields the episodes in the file of `whole`, which is an episode with all rows of the file.
    file = whole.file
    try:
        parts = list(islice(READERS[file.suffix.lower()](whole), MAX_EPISODES + 1))
        if len(parts) > MAX_EPISODES:
            message = f'{file}: has more than {MAX_EPISODES:,} episodes; cut it into several files'
            raise RecordingError(message, code='too-many')
    except ImportError as error:
        raise missing_library(error) from None
    except Exception as error:
        yield replace(whole, fault=fault_of(file, error))
        return
    yield from parts or [whole]


def _runs(whole: Episode, numbers: npt.NDArray[np.float64]) -> Iterator[Episode]:
    # Yields an episode for each run of consecutive rows whose episode numbers are equal.
    if len(faults := np.flatnonzero(~np.isfinite(numbers))):
        message = f'row {faults[0]} has no episode number; number every row'
        raise RecordingError(message, code='not-finite')
    begins = np.flatnonzero(np.diff(numbers, prepend=np.nan) != 0).tolist()
    for begin, end in zip(begins, [*begins[1:], len(numbers)]):
        name = f'{whole.name}:{numbers[begin]:.0f}'
        yield replace(whole, name=name, first=begin, count=end - begin)


def _of_parquet(whole: Episode) -> Iterator[Episode]:
    # Yields the episodes of a parquet file. If the file has a column `steps`, each row holds a
    # whole episode: the column has a list of the episode's steps. Otherwise consecutive rows with
    # equal episode numbers are an episode.
    import pyarrow.parquet as parquet
    import pyarrow.types as types

    file = whole.file
    with parquet.ParquetFile(file) as opened:
        names = opened.schema_arrow.names
        refuse_twice(names)
        if STEPS in names:
            for row in range(opened.metadata.num_rows):
                name = f'{whole.name}:{row}'
                yield replace(whole, name=name, place=STEPS, first=row, count=1)
            return
        column = next((name for name in NUMBERS if name in names), '')
        if not column:
            return
        refuse_to_hold(file, opened.metadata.num_rows)
        kind = opened.schema_arrow.field(column).type
    # Read a column of texts as a dictionary, which stores each text once. This limits the memory.
    names = [column] if types.is_string(kind) or types.is_large_string(kind) else None
    with parquet.ParquetFile(file, read_dictionary=names) as opened:
        numbers = opened.read([column])[column].combine_chunks()
    if types.is_dictionary(numbers.type):
        numbers = numbers.indices
    elif numbers.type.num_fields:  # each episode number is in a vector of length 1
        numbers = numbers.flatten()
    yield from _runs(whole, np.asarray(numbers.to_numpy(zero_copy_only=False), dtype=np.float64))


def headers_of(file: Path) -> dict[str, npt.NDArray[np.generic]]:
    """
    Return for each array in an npz file, by name, a placeholder array of the same shape and type.

    The data are not read. The elements of a placeholder have no meaning.
    """
    headers = {}
    with ZipFile(file) as packed:
        refuse_twice(packed.namelist())
        for name in packed.namelist():
            if name.endswith('.npy'):
                with packed.open(name) as stream:
                    header = BytesIO(stream.read(MAX_HEADER_BYTES))
                first = np.lib.format.read_magic(header) == (1, 0)
                read = 'read_array_header_1_0' if first else 'read_array_header_2_0'
                shape, _, kind = getattr(np.lib.format, read)(header)
                if min(shape, default=0) < 0:
                    message = f'{name} has the shape {shape}; write it anew'
                    raise RecordingError(message, code='wrong-shape')
                headers[name.removesuffix('.npy')] = np.broadcast_to(np.empty((), kind), shape)
    return headers


def _of_arrays(whole: Episode) -> Iterator[Episode]:
    file, headers = whole.file, headers_of(whole.file)
    column = next((name for name in (*NUMBERS, ENDS) if name in headers), '')
    if not column:
        return
    header = headers.pop(column)
    refuse_to_hold(file, max(header.size, header.nbytes // 8))
    counts = {len(array) for array in headers.values() if array.ndim}
    rows = max(counts, default=0)
    kinds, fits, required = 'iuf', header.size in counts, f'a number for each of {rows:,} rows'
    if column == ENDS:
        kinds, fits = 'iu', header.size <= rows
        required = f'whole numbers that rise from 1 to at most {rows:,}, the rows of other arrays'
    if header.dtype.kind not in kinds or header.shape[:1] != (header.size,) or not fits:
        message = f'{column} must be {required}, not {header.dtype} of shape {header.shape}'
        raise RecordingError(message, code='wrong-shape')
    with np.load(file, allow_pickle=False) as arrays:
        numbers = arrays[column].reshape(-1)
    if column != ENDS:
        yield from _runs(whole, np.asarray(numbers, dtype=np.float64))
        return
    edges = np.append(0, numbers.astype(np.int64))
    for k in np.flatnonzero((edges[1:] <= edges[:-1]) | (edges[1:] > rows))[:1]:
        message = f'{ENDS} must be {required}, not {edges[k]:,} and {edges[k + 1]:,}'
        raise RecordingError(message, code='wrong-order')
    if edges[-1] not in counts:
        raise RecordingError(
            f'{ENDS} ends with {edges[-1]:,} of {rows:,} rows; add the end of the last episode, '
            'or leave the rows after it out of the arrays',
            code='wrong-length',
        )
    for k, (begin, end) in enumerate(pairwise(edges.tolist())):
        yield replace(whole, name=f'{whole.name}:{k}', first=begin, count=end - begin)


def _of_hdf5(whole: Episode) -> Iterator[Episode]:
    # Yields an episode for each numbered group (demo_0, demo_1, ...) of an HDF5 file.
    import h5py

    with h5py.File(whole.file, 'r') as opened:
        for root in ('data', '/'):
            folder = opened if root == '/' else _held(opened, root)
            if not isinstance(folder, h5py.Group):
                continue
            names = [name for name in folder if isinstance(_held(folder, name), h5py.Group)]
            numbered = [name for name in names if name.rpartition('_')[2].isdecimal()]
            for name in sorted(numbered, key=lambda name: int(name.rpartition('_')[2])):
                place = f'{root}/{name}'.lstrip('/')
                yield replace(whole, name=f'{whole.name}:{place}', place=place)
            if numbered:
                return


def _held(folder: Any, name: str) -> Any:
    # Returns the member `name` of an HDF5 group. Returns None for soft and external links, because
    # they may lead to other files.
    import h5py

    return folder[name] if isinstance(folder.get(name, getlink=True), h5py.HardLink) else None


# The function that finds the episodes in a file, by the suffix of the file's name.
READERS = dict(zip(SUFFIXES, (_of_parquet, _of_hdf5, _of_hdf5, _of_arrays)))
