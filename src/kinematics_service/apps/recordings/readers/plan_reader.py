# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read planned joint trajectories from text files or messages."""

import json
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ....errors import RecordingError
from ....kernel import Floats
from ....robot.file.text.entries import choice, did_you_mean, meant_by
from ....robot.file.text.yaml_reader import YamlError
from ....robot.measures import Level
from .between_points import MAX_STEP, PlannedTrajectory, sampled
from .block import LARGEST_BLOCK, SECOND, Block, Times
from .source import RecordingSource, Remark, Selection
from .stored_columns import spans
from .yaml_values import MAX_VALUES, Values, read_documents

# Pause between the stamps of successive trajectories of one topic, ns. It is longer than any
# time-out of joint states, so the audit treats the trajectories as separate motions.
PAUSE = 3_600 * SECOND
# Stamp of the first sample of a plan, ns. It is not 0, because a stamp of 0 means unstamped.
FIRST_STAMP = SECOND
MAX_FILE_BYTES = 64 * 1024 * 1024
# Largest total number of samples of the trajectories in a file. With this number, the evaluation
# takes a minute. But each segment between two points has at least 4 samples, even if the total is
# then larger.
MAX_FILE_SAMPLES = 500_000
# If the motion of a joint between two samples exceeds this (rad or m), a remark gives the motion.
COARSE_STEP = 10 * MAX_STEP
# Accepted keys of a JointTrajectoryPoint.
POINT_KEYS = ('positions', 'velocities', 'accelerations', 'effort', 'time_from_start')
SINGULAR = {'positions': 'position', 'velocities': 'velocity', 'accelerations': 'acceleration'}


def open_planned(file: Path, selection: Selection) -> RecordingSource:
    """
    Open a JointTrajectory in YAML, as `ros2 topic echo` prints it, or in JSON.

    Raises
    ------
    RecordingError
        The file holds no trajectory; the message is one sentence.
    """
    text = text_of(file, MAX_FILE_BYTES, 'write it as a bag')
    documents = _documents(file, text)
    trajectories = [trajectory for document in documents for trajectory in _trajectories(document)]
    if not trajectories:
        raise RecordingError(
            f'{file}: has no JointTrajectory; write joint_names, and points with positions, '
            'time_from_start, and perhaps velocities and accelerations',
            code='missing-key',
        )
    planned = [_planned(trajectory, str(file)) for trajectory in trajectories]
    several = f'{len(planned)} trajectories in a row'
    remarks = [Remark(Level.OK, several)] if len(planned) > 1 else []
    return RecordingSource(
        'planned trajectory',
        'points',
        True,
        None,
        blocks_of_trajectories(planned, selection, str(file), remarks),
        plans=planned,
        remarks=remarks,
    )


def text_of(file: Path, largest: int, instead: str) -> str:
    """
    Return the text of a file of at most `largest` bytes. If the file is larger, the error gives
    the advice `instead`.

    Raises
    ------
    RecordingError
        The file cannot be read, has more than `largest` bytes, is empty, or is not UTF-8.
    """
    try:
        with file.open('rb') as stream:
            data = stream.read(largest + 1)
    except OSError as error:
        message = f'{file}: cannot be read: {error.strerror}'
        raise RecordingError(message, code='unreadable') from None
    if len(data) > largest:
        message = f'{file}: is larger than {largest / 2**20:g} MiB; {instead}'
        raise RecordingError(message, code='too-large')
    try:
        text = data.decode('utf-8-sig')
    except UnicodeDecodeError:
        message = f'{file}: is not UTF-8 text; save it as UTF-8'
        raise RecordingError(message, code='encoding') from None
    if not text.strip():
        raise RecordingError(f'{file}: the file is empty', code='empty')
    return text


def json_of(file: Path, text: str) -> Values:
    """
    Return the content of the JSON text of a file, with at most `MAX_VALUES` values.

    Raises
    ------
    RecordingError
        The text is not JSON, has a key twice, or more than `MAX_VALUES` values.
    """
    if text.count(',') > MAX_VALUES:
        message = f'{file}: has more than {MAX_VALUES:,} values; write it as a bag'
        raise RecordingError(message, code='too-many')
    try:
        content: Values = json.loads(text, object_pairs_hook=_mapping)
        return content
    except RecursionError:
        message = f'{file}: is not valid JSON: nested too deeply'
        raise RecordingError(message, code='too-deep') from None
    except RecordingError as error:
        raise RecordingError(f'{file}: {error}', code=error.code) from None
    except ValueError as error:
        raise RecordingError(f'{file}: is not valid JSON: {error}', code='syntax') from None


def _documents(file: Path, text: str) -> list[Values]:
    if file.suffix.lower() == '.json' or text.lstrip().startswith('{'):
        return [json_of(file, text)]
    try:
        return read_documents(text)
    except YamlError as error:
        raise RecordingError(f'{file}:{error}', code='syntax') from None


def _mapping(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    # Raise an error if a key occurs twice, because json.loads would silently take its last value.
    mapping = dict(pairs)
    if len(mapping) < len(pairs):
        twice, _ = Counter(key for key, _ in pairs).most_common(1)[0]
        message = f'the key {twice[:40]!a} occurs twice; delete one'
        raise RecordingError(message, code='duplicate-key')
    return mapping


def _trajectories(document: Values, depth: int = 0) -> Iterator[Mapping[str, Values]]:
    # Yields each JointTrajectory in a message. The message is a JointTrajectory, or contains some,
    # as RobotTrajectory, DisplayTrajectory and action goals do.
    if depth > 8:
        return
    if isinstance(document, Mapping):
        if 'points' in document and 'joint_names' in document:
            yield document
        else:
            for value in document.values():
                yield from _trajectories(value, depth + 1)
    elif isinstance(document, list):
        for value in document:
            yield from _trajectories(value, depth + 1)


def _planned(data: Mapping[str, Values], where: str) -> PlannedTrajectory:
    points: Any = data['points'] or []
    joints = data['joint_names'] or []
    if not isinstance(points, list) or not all(isinstance(point, dict) for point in points):
        raise RecordingError(f'{where}: points must be a list of points', code='wrong-type')
    if not isinstance(joints, list):
        raise RecordingError(f'{where}: joint_names must be a list of names', code='wrong-type')
    # Refuse unknown keys, because a misspelt key would change the plan silently.
    for k, point in enumerate(points):
        for key in map(str, point):
            if key not in POINT_KEYS:
                hint = did_you_mean(meant_by(key, POINT_KEYS)) + choice(POINT_KEYS)
                message = f'{where}: points[{k}]: unknown key {key[:60]!r}{hint}'
                raise RecordingError(message, code='unknown-key')
    times = [_seconds(point.get('time_from_start'), k, where) for k, point in enumerate(points)]
    names = tuple(map(str, joints))
    return _trajectory(names, times, lambda key: [point.get(key) or [] for point in points], where)


def trajectory_of_message(message: Any) -> PlannedTrajectory:
    """Convert a JointTrajectory message to a planned trajectory."""
    names = tuple(map(str, message.joint_names))
    points = message.points
    times = [point.time_from_start.sec + point.time_from_start.nanosec * 1e-9 for point in points]
    return _trajectory(
        names, times, lambda key: [getattr(point, key) for point in points], 'a trajectory'
    )


def _trajectory(
    names: tuple[str, ...], times: list[float], rows: Callable[[str], list[Any]], where: str
) -> PlannedTrajectory:
    # Makes a trajectory from the times of its points. The function `rows` returns, for a key such
    # as 'positions', a list with a row of numbers for each point.
    if not times:
        raise RecordingError(f'{where}: points: the list is empty; add points', code='empty')
    positions, velocities, accelerations = (
        _table(rows(key), names, key, where) for key in SINGULAR
    )
    if positions is None:
        message = f'{where}: points: positions are missing; add one position for each joint'
        raise RecordingError(message, code='missing-key')
    planned = PlannedTrajectory(names, np.array(times), positions, velocities, accelerations)
    late = np.flatnonzero(np.diff(planned.times) <= 0.0)
    if len(late):
        raise RecordingError(
            f'{where}: points[{late[0] + 1}]: time_from_start is not later than that of '
            f'points[{late[0]}]; let the times rise',
            code='wrong-order',
        )
    if planned.times[0] < 0.0 or planned.times[-1] > 1e6:
        message = f'{where}: time_from_start must be within 0 and 1e6 s'
        raise RecordingError(message, code='out-of-range')
    return planned


def _table(rows: Sequence[Any], names: tuple[str, ...], key: str, where: str) -> Floats | None:
    if not any(len(row) for row in rows if isinstance(row, (list, np.ndarray))):
        return None
    for k, row in enumerate(rows):
        count = len(row) if isinstance(row, (list, np.ndarray)) else 0
        if count != len(names):
            # Refuse a plan in which only some points have velocities (or accelerations). If the
            # check ignored the velocities, it would prove a statement about another motion.
            raise RecordingError(
                f'{where}: points[{k}]: {key} has {count} numbers; give {len(names)}, one for '
                f'each joint{"" if key == "positions" else ", or leave it out at all points"}',
                code='wrong-length',
            )
        # Refuse true, false and texts, which numpy would convert to numbers.
        if isinstance(row, list) and not {type(value) for value in row} <= {int, float}:
            message = f'{where}: points[{k}]: {key} must be numbers'
            raise RecordingError(message, code='not-a-number')
    try:
        table = np.array(rows, dtype=np.float64)
    except OverflowError:
        table = np.full(1, np.inf)
    if not np.all(np.isfinite(table)):
        raise RecordingError(f'{where}: {key} must be finite numbers', code='not-finite')
    return table


def _seconds(time: Any, k: int, where: str) -> float:
    if isinstance(time, Mapping):
        parts = (time.get('sec', time.get('secs', 0)), time.get('nanosec', time.get('nsecs', 0)))
    else:
        parts = (time, 0)
    if {type(part) for part in parts} <= {int, float} and all(abs(p) < 1e18 for p in parts):
        return float(parts[0]) + float(parts[1]) * 1e-9
    message = f'{where}: points[{k}]: time_from_start must be sec and nanosec, or seconds'
    raise RecordingError(message, code='wrong-type')


def blocks_of_trajectories(
    plans: Iterable[PlannedTrajectory], selection: Selection, where: str, remarks: list[Remark]
) -> Iterator[Block]:
    """
    Yield blocks of joint states sampled from the motions that joint_trajectory_controller makes
    from planned trajectories.

    Between two points, the motion is a polynomial of time: linear if the points have only
    positions, cubic if they also have velocities, quintic if they also have accelerations. A
    trajectory of one point does not move. The number of samples is limited. If a joint therefore
    moves more than 0.1 rad or m between two samples, a remark gives the largest such motion.

    Raises
    ------
    RecordingError
        A trajectory lacks a joint of the arm.
    """
    begin, remaining = FIRST_STAMP, MAX_FILE_SAMPLES
    coarsest = MAX_STEP
    ours = [selection.joint_prefix + name for name in selection.robot.joint_names]
    for planned in plans:
        missing = [name for name in ours if name not in planned.names]
        if missing:
            raise RecordingError(
                f'{where}: the trajectory does not move {", ".join(missing)} of '
                f'{selection.robot.name}; its joints are {", ".join(planned.names) or "none"}',
                code='missing-joint',
            )
        times, positions, velocities = sampled(planned, remaining)
        remaining = max(remaining - len(times), 0)
        if len(times) > 1:
            coarsest = max(coarsest, float(np.max(np.abs(np.diff(positions, axis=0)))))
        stamps: Times = begin + np.rint(times * 1e9).astype(np.int64)
        for span in spans(len(stamps), LARGEST_BLOCK):
            yield Block(
                planned.names, stamps[span], stamps[span], positions[span], velocities[span]
            )
        begin = int(stamps[-1]) + PAUSE
    if coarsest > COARSE_STEP:
        remarks.append(
            Remark(
                Level.WARN,
                f'The motion is sampled coarsely: joints move up to {coarsest:.2g} rad or m from '
                'one sample to the next, and what is said of samples is not said of all of it',
            )
        )
