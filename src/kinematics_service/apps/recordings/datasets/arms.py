# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Find the arms of a dataset: which elements of its vectors are joint positions and tool poses."""

import re
from collections.abc import Sequence
from typing import NamedTuple

from ....errors import RecordingError
from ....typography import listed
from ..readers.arm_columns import MAX_LISTED, ColumnNames
from ..readers.source import Selection

# Each key has the names of the vectors that occur together in datasets of one origin: joint
# positions, joint velocities, and tool pose. A pose may be two vectors: position+orientation. Each
# value is the kind of the orientations, as in `--pose-format`. The kind applies if the elements of
# the pose vector have no names and `--pose-format` gives no kind. If the value is empty, the
# default of `--pose-format` applies.
KNOWN = {
    # Names in LeRobot datasets, and in datasets converted to LeRobot.
    ColumnNames('', 'observation.state', 'observation.velocity', 'observation.ee_pose'): '',
    ColumnNames(
        '', 'observation.state', 'observation.velocity', 'observation.cartesian_position'
    ): 'rpy',
    # Names in HDF5 files of robomimic, ALOHA and DROID.
    ColumnNames(
        '',
        'obs.robot0_joint_pos',
        'obs.robot0_joint_vel',
        'obs.robot0_eef_pos+obs.robot0_eef_quat',
    ): '',
    ColumnNames('', 'observations.qpos', 'observations.qvel', 'observations.ee_pose'): '',
    ColumnNames(
        '',
        'observation.robot_state.joint_positions',
        'observation.robot_state.joint_velocities',
        'observation.robot_state.cartesian_position',
    ): 'rpy',
    ColumnNames('', 'qpos', 'qvel', 'ee_pose'): '',
    ColumnNames('', 'q', 'qd', 'pose'): '',
}
STAMPS = ('timestamp', 'stamp', 'time')
# Part of a message such as 'state[0:6] is taken for the joints shoulder, elbow'. If no option says
# which vector holds the joint positions, a vector is assumed and this message is given.
TAKEN = 'is taken for the joints'
# Matches a name of a vector element that consists of a word and a number, such as `joint_3.pos`.
NUMBERED = re.compile(r'[a-z]*[._ ]?\d+([._ ](pos|position|angle|q))?', re.IGNORECASE)


class DatasetArm(NamedTuple):
    """
    One arm of a dataset, and how to read its columns.

    Attributes
    ----------
    label
        Name of the arm in the dataset, empty for a single arm.
    reading
        How to read the arm's columns.
    position
        Columns of the joint positions, as the value of `position=` in `--columns`. Empty if the
        user gave `--columns`.
    guessed
        The assumption about which vector has the joint positions, as a sentence; empty if an
        option names the vector.
    """

    label: str
    reading: Selection
    position: str
    guessed: str


def arms_of(header: list[str], reading: Selection, rate: float) -> tuple[DatasetArm, ...]:
    """
    Find the arms of a dataset by the names of its columns.

    Parameters
    ----------
    rate : Hz
        Rate of the rows from the description of the dataset, 0 without a description.

    Raises
    ------
    RecordingError
        The joints of the arm are ambiguous or missing.
    """
    stamp = next((name for name in STAMPS if name in header), '')
    if rate and not stamp and not reading.stamps.rate:
        reading = reading._replace(stamps=reading.stamps._replace(rate=rate))
    if reading.columns is not None:
        if stamp and 'stamp=' not in reading.columns:
            reading = reading._replace(columns=f'stamp={stamp},{reading.columns}')
        return (DatasetArm('', reading, '', ''),)
    candidates = [names for names in KNOWN if _elements(header, names.position)]
    if not candidates:
        raise RecordingError(
            f'no vector of joint positions is known among {listed(header, MAX_LISTED)}; name it '
            'with --columns position=VECTOR, or position=VECTOR[0:6] if it holds more',
            code='missing-column',
        )
    names = max(candidates, key=lambda names: _elements(header, names.pose.split('+')[0]) != [])
    if KNOWN[names] and not reading.pose_format.kind:
        reading = reading._replace(pose_format=reading.pose_format._replace(kind=KNOWN[names]))
    names = names._replace(stamp=stamp)
    parts = _parts(header, names.position, reading)
    if len(parts) > 1 and '.json' in reading.joint_format.text:
        raise RecordingError(
            'a file of --joint-format is for one arm, and the dataset has '
            f'{len(parts)}; choose one, for instance with --columns position={parts[0][1]}',
            code='ambiguous',
        )
    return tuple(
        DatasetArm(
            label,
            reading._replace(columns=_columns(header, names, part, k, len(parts))),
            part,
            f'{part.rstrip(".")} {TAKEN} {", ".join(reading.robot.joint_names)}',
        )
        for k, (label, part) in enumerate(parts)
    )


def crossed_with(arm: DatasetArm, other: DatasetArm) -> DatasetArm:
    """Return how to read the tool poses of `arm` together with the joint positions of `other`."""
    columns = arm.reading.columns or ''
    old, new = f'position={arm.position}', f'position={other.position}'
    return arm._replace(reading=arm.reading._replace(columns=columns.replace(old, new)))


def _elements(header: Sequence[str], vector: str) -> list[str]:
    return [name for name in header if name.startswith(f'{vector}.')]


def _parts(header: list[str], vector: str, reading: Selection) -> list[tuple[str, str]]:
    # Returns the label of each arm, and a text that selects the arm's joint columns among the
    # elements of `vector`: the common start of their names, or a slice such as state[0:6].
    elements, robot = _elements(header, vector), reading.robot
    first = robot.joint_names[0]
    starts = [name.removesuffix(first) for name in elements if name.endswith(first)]
    whole = [s for s in starts if all(s + joint in elements for joint in robot.joint_names)]
    if f'{vector}.{reading.joint_prefix}' in whole and reading.joint_prefix:
        return [('', f'{vector}.{reading.joint_prefix}')]
    if whole:
        labels = [start.removeprefix(f'{vector}.').strip('._') for start in whole]
        return list(zip(labels, whole))
    n, count = robot.dof, len(elements)
    if {f'{vector}.{axis}' for axis in 'xyz'} <= set(elements):
        raise RecordingError(
            f'{vector} holds {listed(elements, MAX_LISTED)}, which is a pose; name the vector '
            'of the joints with --columns position=VECTOR',
            code='missing-column',
        )
    names = [name.removeprefix(f'{vector}.') for name in elements]
    if not all(map(NUMBERED.fullmatch, names)):
        raise RecordingError(
            f'{vector} names its numbers {listed(names, MAX_LISTED)}, and the joints of '
            f'{robot.name} are {", ".join(robot.joint_names)}; if they are the same in this '
            f'order, add --columns position={vector}[0:{n}]',
            code='mismatch',
        )
    if count in (n, n + 1):  # an additional last element is a gripper
        return [('', f'{vector}[0:{n}]')]
    if count in (2 * n, 2 * n + 2):
        half = count // 2
        return [('left', f'{vector}[0:{n}]'), ('right', f'{vector}[{half}:{half + n}]')]
    raise RecordingError(
        f'{vector} has {count} numbers, and {robot.name} has {n} joints; choose them, for '
        f'instance with --columns position={vector}[0:{n}]',
        code='ambiguous',
    )


def _columns(header: list[str], names: ColumnNames, part: str, k: int, arms: int) -> str:
    # Returns the value of the option --columns that selects the columns of arm number k.
    entries = [f'stamp={names.stamp}'] if names.stamp else []
    entries.append(f'position={part}')
    slice_ = part.removeprefix(names.position)
    if _elements(header, names.velocity):
        entries.append(f'velocity={names.velocity}{slice_}')
    poses = [len(_elements(header, vector)) for vector in names.pose.split('+')]
    if all(poses):
        sizes = [count // arms for count in poses]
        vectors = zip(names.pose.split('+'), sizes)
        sliced = '+'.join(f'{vector}[{k * size}:{(k + 1) * size}]' for vector, size in vectors)
        entries.append(f'pose={names.pose if arms == 1 else sliced}')
    return ','.join(entries)
