# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Open a file of joint states of any type. The type is detected from the suffix of its name and its
first bytes.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ....errors import RecordingError
from .plan_reader import open_planned
from .source import RecordingSource, Selection
from .table_reader import TableReader

INSTALL = (
    "bags need rosbags ({reason}): pip install '.[bag]' in its checkout, or pip install rosbags"
)
BAGS = ('.mcap', '.db3', '.bag')
TABLES = ('.csv', '.tsv', '.txt')
TEXTS = ('.yaml', '.yml', '.json')
KINDS = (
    'MCAP (.mcap), rosbag2 (a directory or .db3), ROS 1 bags (.bag), tables (.csv), and planned '
    'trajectories (.yaml, .json)'
)


@contextmanager
def open_source(file: Path, selection: Selection) -> Iterator[RecordingSource]:
    """
    Open a recording or a planned trajectory.

    Raises
    ------
    RecordingError
        The file cannot be read; the message is one sentence.
    """
    if not file.exists():
        message = f'{file}: there is no such file; give one of {KINDS}'
        raise RecordingError(message, code='missing-file')
    if not (file.is_file() or file.is_dir()):
        # Refuse devices and pipes, because the file is read twice, and they can be read only once.
        message = f'{file}: is a device or a named pipe; copy its data to a file'
        raise RecordingError(message, code='not-a-file')
    suffix = file.suffix.lower()
    if file.is_dir() or suffix in BAGS or _looks_like_a_bag(file):
        if option := selection.of_tables:
            message = f'{file}: {option} is for tables, and this is a bag; leave it out'
            raise RecordingError(message, code='conflict')
        try:
            from .bag_reader import open_bag
        except ImportError as error:
            raise RecordingError(INSTALL.format(reason=error), code='missing-package') from None
        with open_bag(file, selection) as source:
            yield source
        return
    if selection.topic is not None or selection.pose_topic is not None:
        option = '--pose-topic' if selection.topic is None else '--topic'
        message = f'{file}: {option} is for bags, and this is not a bag; leave it out'
        raise RecordingError(message, code='conflict')
    if suffix in TEXTS:
        yield open_planned(file, selection)
    elif suffix in TABLES:
        yield TableReader(file, selection).source()
    else:
        ending = f'suffix {suffix}' if suffix else 'a name without suffix'
        message = f'{file}: {ending} is not accepted; give one of {KINDS}'
        raise RecordingError(message, code='unsupported')


def _looks_like_a_bag(file: Path) -> bool:
    try:
        with file.open('rb') as stream:
            head = stream.read(16)
    except OSError as error:
        message = f'{file}: cannot be read: {error.strerror}'
        raise RecordingError(message, code='unreadable') from None
    return head.startswith((b'\x89MCAP', b'#ROSBAG V2', b'SQLite format 3'))
