"""The episodes of a dataset, without their numbers: where each begins in which file."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from io import BytesIO
from itertools import chain
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import numpy.typing as npt

from ....errors import RecordingError
from ..readers.plan_reader import json_of, text_of

INSTALL = (
    "datasets need pyarrow and h5py ({reason}): pip install '.[dataset]' in its checkout, or pip "
    'install pyarrow h5py'
)
PARQUET, ARRAYS = ('.parquet',), ('.npz',)
HDF5 = ('.hdf5', '.h5')
SUFFIXES = (*PARQUET, *HDF5, *ARRAYS)
# Columns that number the episodes of a file.
NUMBERS = ('episode_index', 'episode_id', 'episode')
# Numbers of an episode, or of a group of rows in a parquet file, that are read (2 GiB): a small
# file may say that it holds what fills any memory.
MOST_NUMBERS = 2**28
# Bytes of an array's header in an npz file that are read; numpy refuses headers above 10,000.
MOST_HEADER_BYTES = 2**14
# Episodes of a file: a larger dataset has them in many files.
MAX_EPISODES = 2**20
# Bytes of a description, 1 MiB: LeRobot writes some kilobytes.
MAX_INFO_BYTES = 2**20
# Frames a second: stamps are whole nanoseconds.
LARGEST_RATE = 1e9
# Lists of names within each other: LeRobot has two.
MAX_LIST_DEPTH = 8
# The column of files with an episode in each row: its steps.
STEPS = 'steps'
# The array of npz files that holds the row behind the last one of each episode.
ENDS = 'episode_ends'


# Numbers of episodes (E,); their first rows, and the row behind the last one (E + 1,).
Labels = npt.NDArray[np.float64]
Edges = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Episode:
    """
    Consecutive rows of a file.

    Attributes
    ----------
    file, name
        The file, and the name of the episode in the dataset.
    place
        The group of an HDF5 file, `STEPS` for a row with steps, else empty.
    first, count
        Rows; count -1: all.
    rate : Hz
        Of the rows as the dataset says it, 0 if it does not.
    elements
        Names of the elements of vectors, by column.
    fault
        Why the file cannot be read; empty if it can.
    """

    file: Path
    name: str
    place: str = ''
    first: int = 0
    count: int = -1
    rate: float = 0.0
    elements: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    fault: str = ''


def is_dataset(path: Path) -> bool:
    """Return whether a file or folder is a dataset, by its name and what it holds."""
    if not path.is_dir():
        return path.suffix.lower() in SUFFIXES
    if (path / 'metadata.yaml').exists():
        return False  # a bag
    return _info_of(path).exists() or any(_files(path))


def episodes_of(path: Path) -> Iterator[Episode]:
    """
    Yield the episodes of a dataset in their order; a file that cannot be read is one, too.

    Raises
    ------
    RecordingError
        What the folder says of itself cannot be read, or a library is missing.
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
    # The rate and the names of elements, as LeRobot's info.json has them.
    content: Any = json_of(info, text_of(info, MAX_INFO_BYTES, 'leave only fps and features'))
    features = content.get('features') if isinstance(content, dict) else None
    if not isinstance(features, dict) or {*map(type, features.values())} - {dict}:
        raise RecordingError(
            f'{info}: is no description of a dataset: write "features": {{"NAME": {{"names": '
            '[...]}}, as LeRobot does'
        )
    rate = content.get('fps') or 0
    if type(rate) not in (int, float) or not 0 <= rate <= LARGEST_RATE:
        raise RecordingError(
            f'{info}: fps: {str(rate)[:40]!r} is no rate; write the frames a second, such as 30'
        )
    names = {name: _names(one.get('names'), MAX_LIST_DEPTH) for name, one in features.items()}
    return float(rate), {key: one for key, one in names.items() if one}


def _names(names: Any, deepest: int) -> tuple[str, ...]:
    # A list, or lists within each other or by what they are: motors, axes.
    if isinstance(names, Mapping):
        names = [part for part in names.values() if isinstance(part, list)]
    if not isinstance(names, list) or not deepest:
        return ()
    parts = (_names(one, deepest - 1) if isinstance(one, list) else (str(one),) for one in names)
    return tuple(chain.from_iterable(parts))


def fault_of(file: Path, error: Exception) -> str:
    """Return why a file cannot be read: damaged, it can make a reader raise any exception."""
    if isinstance(error, RecordingError):
        return str(error) if str(error).startswith(f'{file}:') else f'{file}: {error}'
    if isinstance(error, FileNotFoundError):
        return f'{file}: there is no such file'
    reason = ' '.join(str(error).split())[:200] or type(error).__name__
    return f'{file}: cannot be read: copy it anew, or leave it out ({reason})'


def refuse_twice(names: Iterable[str]) -> None:
    """
    Refuse columns of which two have the same name.

    Raises
    ------
    RecordingError
        It names the column, not the file.
    """
    for name, count in Counter(names).most_common(1):
        if count > 1:
            raise RecordingError(f'{count} columns are named {name[:40]!r}: rename all but one')


def refuse_to_hold(file: Path, numbers: int) -> None:
    """
    Refuse what is too large to be read at once.

    Raises
    ------
    RecordingError
        There are more than `MOST_NUMBERS`.
    """
    if numbers > MOST_NUMBERS:
        raise RecordingError(
            f'{file}: {numbers:,} numbers at once are more than {MOST_NUMBERS:,}: cut it into '
            'episodes, or groups of rows'
        )


def _of_file(whole: Episode) -> Iterator[Episode]:
    # The episodes of a file, of which one is given that is all of it.
    file, name = whole.file, whole.name
    suffix = file.suffix.lower()
    steps, labels, edges, groups = 0, np.zeros(0), np.zeros(1, dtype=np.int64), list[str]()
    try:
        if suffix in PARQUET:
            steps, labels, edges = _of_parquet(file)
        elif suffix in HDF5:
            groups = _groups(file)
        else:
            labels, edges = _of_arrays(file)
        if max(steps, len(labels)) > MAX_EPISODES:
            raise RecordingError(
                f'{file}: has more than {MAX_EPISODES:,} episodes: cut it into several files'
            )
    except ImportError as error:
        raise RecordingError(INSTALL.format(reason=error)) from None
    except Exception as error:
        yield replace(whole, fault=fault_of(file, error))
        return
    if not (steps or groups or len(labels)):
        yield whole
    for place in groups:
        yield replace(whole, name=f'{name}:{place}', place=place)
    for row in range(steps):
        yield replace(whole, name=f'{name}:{row}', place=STEPS, first=row, count=1)
    for label, first, end in zip(labels.tolist(), edges.tolist(), edges[1:].tolist()):
        yield replace(whole, name=f'{name}:{label:.0f}', first=first, count=end - first)


def _runs(numbers: npt.NDArray[np.float64]) -> tuple[Labels, Edges]:
    if len(faults := np.flatnonzero(~np.isfinite(numbers))):
        raise RecordingError(f'row {faults[0]} has no number of its episode: number every row')
    begins = np.flatnonzero(np.diff(numbers, prepend=np.nan) != 0)
    return numbers[begins], np.append(begins, len(numbers))


def _of_parquet(file: Path) -> tuple[int, Labels, Edges]:
    # The number of rows with steps, or the runs of rows with the same number of the episode.
    import pyarrow.parquet as parquet
    import pyarrow.types as types

    with parquet.ParquetFile(file) as opened:
        names = opened.schema_arrow.names
        refuse_twice(names)
        if STEPS in names:
            return int(opened.metadata.num_rows), *_runs(np.zeros(0))
        column = next((name for name in NUMBERS if name in names), '')
        if not column:
            return 0, *_runs(np.zeros(0))
        refuse_to_hold(file, opened.metadata.num_rows)
        kind = opened.schema_arrow.field(column).type
    # A name that all rows repeat is held once.
    names = [column] if types.is_string(kind) or types.is_large_string(kind) else None
    with parquet.ParquetFile(file, read_dictionary=names) as opened:
        numbers = opened.read([column])[column].combine_chunks()
    if types.is_dictionary(numbers.type):
        numbers = numbers.indices
    elif numbers.type.num_fields:  # vectors of one
        numbers = numbers.flatten()
    return 0, *_runs(np.asarray(numbers.to_numpy(zero_copy_only=False), dtype=np.float64))


def headers_of(file: Path) -> dict[str, npt.NDArray[np.generic]]:
    """Return arrays of the shapes and types of those in an npz file, which take no memory."""
    headers = {}
    with ZipFile(file) as packed:
        refuse_twice(packed.namelist())
        for name in packed.namelist():
            if name.endswith('.npy'):
                with packed.open(name) as stream:
                    header = BytesIO(stream.read(MOST_HEADER_BYTES))
                first = np.lib.format.read_magic(header) == (1, 0)
                read = 'read_array_header_1_0' if first else 'read_array_header_2_0'
                shape, _, kind = getattr(np.lib.format, read)(header)
                if min(shape, default=0) < 0:
                    raise RecordingError(f'{name} has the shape {shape}: write it anew')
                headers[name.removesuffix('.npy')] = np.broadcast_to(np.empty((), kind), shape)
    return headers


def _of_arrays(file: Path) -> tuple[Labels, Edges]:
    headers = headers_of(file)
    column = next((name for name in (*NUMBERS, ENDS) if name in headers), '')
    if not column:
        return _runs(np.zeros(0))
    own = headers.pop(column)
    refuse_to_hold(file, max(own.size, own.nbytes // 8))
    counts = {len(array) for array in headers.values() if array.ndim}
    rows = max(counts, default=0)
    kinds, fits, wanted = 'iuf', own.size in counts, f'a number for each of {rows:,} rows'
    if column == ENDS:
        kinds, fits = 'iu', own.size <= rows
        wanted = f'whole numbers that rise from 1 to at most {rows:,}, the rows of other arrays'
    if own.dtype.kind not in kinds or own.shape[:1] != (own.size,) or not fits:
        raise RecordingError(f'{column} must be {wanted}, not {own.dtype} of shape {own.shape}')
    with np.load(file, allow_pickle=False) as arrays:
        numbers = arrays[column].reshape(-1)
    if column != ENDS:
        return _runs(np.asarray(numbers, dtype=np.float64))
    edges = np.append(0, numbers.astype(np.int64))
    for k in np.flatnonzero((edges[1:] <= edges[:-1]) | (edges[1:] > rows))[:1]:
        raise RecordingError(f'{ENDS} must be {wanted}, not {edges[k]:,} and {edges[k + 1]:,}')
    if edges[-1] not in counts:
        raise RecordingError(
            f'{ENDS} ends with {edges[-1]:,} of {rows:,} rows: add the end of the last episode, '
            'or leave the rows after it out of the arrays'
        )
    return np.arange(len(numbers), dtype=np.float64), edges


def _groups(file: Path) -> list[str]:
    # The groups of an HDF5 file that are episodes: demo_0, demo_1 ...
    import h5py

    with h5py.File(file, 'r') as opened:
        for root in ('data', '/'):
            folder = opened if root == '/' else _held(opened, root)
            if not isinstance(folder, h5py.Group):
                continue
            names = [one for one in folder if isinstance(_held(folder, one), h5py.Group)]
            numbered = [one for one in names if one.rpartition('_')[2].isdecimal()]
            if numbered:
                ordered = sorted(numbered, key=lambda one: int(one.rpartition('_')[2]))
                return [f'{root}/{one}'.lstrip('/') for one in ordered]
    return []


def _held(folder: Any, name: str) -> Any:
    # Links are not followed: they may lead to other files.
    import h5py

    return folder[name] if isinstance(folder.get(name, getlink=True), h5py.HardLink) else None
