# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Read the files of cells (several arms in one frame), and describe relative motions of two arms.

The motion of one arm's tool relative to another arm's tool is described as one arm with the joints
of both arms. So every function that takes an arm accepts a relative motion.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

from ..errors import RobotFileError, RobotNotFoundError
from .bundled import RobotSource, find_robot
from .file.parts.description import Placement, RobotDescription
from .file.parts.motions import pose_motion
from .file.parts.points import POINT_NAME
from .file.parts.quantities import Quantities
from .file.parts.schema import CellArmEntry, CellEntry
from .file.reader import CELL, check_name, read_robot_file, read_units, refuse, text_of
from .file.text.entries import checked, checked_mapping
from .file.text.fault_report import FaultReport, Place, quoted
from .file.text.robot_document import read_document
from .file.text.yaml_document import Yaml
from .file.translation import translator_of
from .points import ending_at, moved_base
from .relative_motion import relative_motion

FLOOR = 'cell'
MAX_ARMS = 128  # limits the time to read the file of a cell; 128 arms take half a second


@dataclass(frozen=True)
class Cell:
    """
    Several arms whose bases are placed in one frame.

    Attributes
    ----------
    name
        The name of the cell.
    frame
        The name of the frame in which the bases are given.
    arms
        The description of each arm, by name. The base of each arm is given in the frame of the
        cell. The name of a joint begins with the `joint_prefix` of its arm, as in JointState
        messages.
    file
        The path as the user gave it.
    sha256
        The SHA-256 checksum of the file, in hexadecimal digits.
    parts
        The paths of the robot files of the arms.
    """

    name: str
    frame: str
    arms: Mapping[str, RobotDescription]
    file: str
    sha256: str
    parts: tuple[str, ...]

    def described(self, base: str = '', tip: str = '') -> RobotDescription:
        """
        Return one arm of the cell, or the motion of one arm's tool relative to another arm's tool.

        Parameters
        ----------
        base
            The base frame: the frame of the cell, the tool of an arm, or a point of an arm such as
            `left/elbow`. Default: the tool of the first arm, or the frame of the cell if the cell
            has only one arm.
        tip
            An arm (its tool), or a point of an arm. Default: the tool of the first arm that `base`
            does not name.

        Raises
        ------
        RobotFileError
            The cell has no arm of this name, or an arm of a relative motion has closed loops.
        PointError
            The arm has no point of this name.
        """
        names = [self.frame, *self.arms]
        base = base or names[len(names) > 2]
        start = _arm_of(base, names, self.file)
        others = [arm for arm in self.arms if arm != start]
        tip = tip or (others or [start])[0]
        end = _arm_of(tip, names, self.file)
        if end == self.frame or start == end:
            message = f'from {base} to {tip} is not a motion of one arm against another'
            refuse(self.file, message, 'unsupported')
        if start == self.frame:
            return self._renamed(self._arm(tip, end), f'{self.name}_{tip}')
        motion = relative_motion(self._arm(base, start), self._arm(tip, end), (start, end))
        return self._renamed(motion, f'{self.name}_{base}_{tip}')

    def _renamed(self, description: RobotDescription, name: str) -> RobotDescription:
        return replace(
            description,
            name=name.replace('/', '_'),
            file=self.file,
            sha256=self.sha256,
            parts=self.parts,
        )

    def _arm(self, name: str, arm: str) -> RobotDescription:
        _, _, point = name.partition('/')
        description = self.arms[arm]
        if not point:
            return description
        ended = ending_at(description, point)
        # Add the name of the arm to the name of the point's frame, because two arms may have
        # points of the same name.
        return replace(ended, tool=Placement(f'{arm}_{ended.tool.frame}', ended.tool.motion))


def _arm_of(name: str, known: Sequence[str], file: str) -> str:
    arm = name.partition('/')[0]
    if arm not in known:
        refuse(file, f'unknown arm {name!r} (known: {", ".join(known)})', 'unknown-name')
    return arm


def is_cell(source: RobotSource) -> bool:
    """
    Return whether a robot file describes a cell (several arms in one frame), not a single arm.

    Raises
    ------
    RobotFileError
        The file cannot be read.
    """
    file = str(source.file)
    return not translator_of(file) and CELL.search(text_of(file)) is not None


def cell_of(name: str) -> Cell | None:
    """
    Return the cell (several arms in one frame) that a robot argument names, or None.

    `name` is a path or a bundled name. The result is None if `name` refers to a single arm, or if
    no robot of this name can be read.

    Raises
    ------
    RobotFileError
        The file of a cell has faults; the error lists all of them.
    """
    try:
        source = find_robot(name)
        whole = is_cell(source) and not (source.base or source.tip)
    except (RobotNotFoundError, RobotFileError):
        # Ignore the error here. The caller then reads the name as a single arm, and gets the same
        # error.
        return None
    return read_cell(source.file) if whole else None


def read_robot(source: RobotSource) -> RobotDescription:
    """
    Read the description of an arm from a robot file, a URDF, or a cell.

    Raises
    ------
    RobotFileError
        The file has faults; the error lists all of them.
    KinematicsError
        A URDF cannot be converted to a robot file, or the arm has no point `source.base` or
        `source.tip`.
    """
    if is_cell(source):
        return read_cell(source.file).described(source.base, source.tip)
    file = str(source.file)
    if (source.base or source.tip) and not translator_of(file):
        message = f'is one arm; leave out :{source.base}:{source.tip}, ends of a URDF or cell'
        refuse(file, message, 'unsupported')
    return read_robot_file(file, source.base, source.tip)


def read_cell(path: Path) -> Cell:
    """
    Read the file of a cell and the robot files of its arms.

    Raises
    ------
    RobotFileError
        The file of the cell or of an arm has faults; the error lists all of them.
    """
    file = str(path)
    text = text_of(file)
    document = read_document(text, file)
    top = Place(FaultReport(document))
    entry = checked(CellEntry, document.data, top)
    check_name(entry.cell, top['cell'])
    frame = entry.frame or FLOOR
    quantities = Quantities(top, read_units(entry.units, top['units']), {}, {})
    given = checked_mapping(entry.arms, top['arms'], 'names to {robot, joint_prefix, xyz, rpy}')
    if len(given) > MAX_ARMS:
        top['arms'].fault(f'{len(given):,} arms (at most {MAX_ARMS})', 'too-many')
        top.report.raise_faults()
    placed = {
        name: _read_arm(name, data, frame, path.parent, quantities) for name, data in given.items()
    }
    if isinstance(document.data, dict) and 'arms' in document.data and not given:
        top['arms'].fault('at least one arm is needed', 'empty')
    arms = {name: arm for name, arm in placed.items() if arm is not None}
    common = tuple(name for name in entry.common or () if name)
    _check_names(arms, common, top)
    top.report.raise_faults()
    return Cell(
        entry.cell or '',
        frame,
        arms,
        file,
        hashlib.sha256(text.encode()).hexdigest(),
        tuple(arm.file for arm in arms.values()),
    )


def _read_arm(
    name: str, data: Yaml, frame: str, folder: Path, quantities: Quantities
) -> RobotDescription | None:
    at = quantities.top['arms', name]
    if name == frame or not POINT_NAME.fullmatch(name):
        at.fault(
            f'{quoted(name)} cannot be the name of an arm; write a letter, then letters, digits '
            f'and single underscores, and not {frame}, which is the frame of the cell',
            'wrong-name',
        )
    entry = checked(CellArmEntry, data, at)
    motion = pose_motion(entry, at, quantities)
    if entry.robot is None or motion is None or not at.intact:
        return None
    try:
        source = find_robot(entry.robot)
        # Join a relative path to the folder of the cell. An absolute path stays unchanged.
        source = source._replace(file=folder / source.file)
        if is_cell(source):
            at['robot'].fault(f'{source.file} is a cell; give one arm', 'unsupported')
            return None
        arm = read_robot(source)
        if arm.letters:
            message = f'{arm.letters}: no value in {source.file}; write it there'
            at['robot'].fault(message, 'no-value')
            return None
    except RobotNotFoundError as error:
        at['robot'].fault(str(error), error.code)
        return None
    prefix = entry.joint_prefix or ''
    arm = moved_base(arm, motion.matrix, frame)
    return replace(
        arm,
        joints=tuple(replace(joint, name=prefix + joint.name) for joint in arm.joints),
        tool=Placement(f'{name}_{arm.tool.frame}', arm.tool.motion),
        known_poses=(),
    )


def _check_names(arms: Mapping[str, RobotDescription], common: Sequence[str], top: Place) -> None:
    names = {name: {joint.name for joint in arm.joints} for name, arm in arms.items()}
    for first, second in combinations(names, 2):
        twice = sorted((names[first] & names[second]).difference(common))
        if twice:
            top['arms', second, 'joint_prefix'].fault(
                f'{first} and {second} both have a joint {quoted(twice[0])}; give each arm its '
                "own joint_prefix, or write the joint into 'common' if it moves both",
                'duplicate-name',
            )
    for index, name in enumerate(common):
        shared = [
            replace(joint, variable='', unused=False)
            for arm in arms.values()
            for joint in arm.joints
            if joint.name == name
        ]
        if any(joint != shared[0] for joint in shared):
            message = f'{quoted(name)} differs between the arms in type, limits or speed'
            top['common', index].fault(message, 'mismatch')
        if sum(name in joints for joints in names.values()) < 2:
            known = ', '.join(sorted(set().union(*names.values())))
            message = f'{quoted(name)} is not a joint of two arms (joints: {known})'
            top['common', index].fault(message, 'unknown-name')
