"""
Cells: several arms on one floor, and the motion of one arm's tool as another arm's tool sees it.

The way from one tool down its own arm, over the floor and up the other arm is a chain like any
other: the joints of the first arm come in reverse and turn the other way. So the relative motion
of two arms is an arm with the joints of both, and whatever is known of an arm is known of it.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np

from ..errors import Fault, RobotFileError, RobotNotFoundError
from ..kernel import Floats
from ..rigid_motion import inverse, screw_z
from .bundled import RobotSource, find_robot
from .conventions import table_rows
from .file.parts.convention_table import Axis
from .file.parts.description import (
    IDENTITY,
    ElementaryMotion,
    Link,
    Placement,
    RigidMotion,
    RobotDescription,
    ShapeRow,
    SingularityDescription,
)
from .file.parts.joints import MAX_JOINTS
from .file.parts.motions import pose_motion
from .file.parts.points import POINT_NAME
from .file.parts.quantities import Quantities
from .file.parts.schema import CellArmEntry, CellEntry
from .file.reader import CELL, ROBOT_NAME, read_robot_file, read_units, text_of
from .file.text.entries import checked, checked_mapping
from .file.text.expressions import Affine, Expression
from .file.text.fault_report import FaultReport, quoted
from .file.text.robot_document import read_document
from .file.translation import translator_of
from .loops import moving_variables
from .points import ending_at, moved_base

ARMS = ('arms',)
FLOOR = 'cell'
# Axes of the same joint that are this near to each other, as a share of the chain's lengths, are
# one axis: what the arms have in common is there twice, and rounded twice.
ONE_AXIS = 1e-12
# What products of motions leave where a zero is meant: no entry of a rotation, no length in m, is
# as small.
ROUND_OFF = 1e-15


@dataclass(frozen=True)
class Cell:
    """
    Arms on one floor.

    Attributes
    ----------
    name
        Of the file.
    frame
        The frame that their bases are given in.
    arms
        What each arm's file says, its base in that frame, its joints named as in messages.
    file
        The path as the user gave it.
    sha256
        Of the text of the file.
    parts
        The files of the arms.
    """

    name: str
    frame: str
    arms: Mapping[str, RobotDescription]
    file: str
    sha256: str
    parts: tuple[str, ...]

    def described(self, base: str = '', tip: str = '') -> RobotDescription:
        """
        Return an arm of the cell, or the motion of one arm's tool as seen from another's.

        Parameters
        ----------
        base
            The frame of the cell, or an arm, whose tool is the base frame then, or a point of an
            arm such as `left/elbow`. Default: the first arm; the frame where there is no other.
        tip
            An arm or a point of it. Default: the first arm that is not at the base.

        Raises
        ------
        RobotFileError
            There is no such arm, or its loops are closed.
        PointError
            The arm has no such point.
        """
        names = [self.frame, *self.arms]
        base = base or names[len(names) > 2]
        start = _arm_of(base, names, self.file)
        others = [arm for arm in self.arms if arm != start]
        tip = tip or (others or [start])[0]
        end = _arm_of(tip, names, self.file)
        if end == self.frame or start == end:
            _refuse(self.file, f'from {base} to {tip} is no motion of one arm against another')
        if start == self.frame:
            found = self._of(tip, end)
            return self._found(found, f'{self.name}_{tip}')
        found = relative_motion(self._of(base, start), self._of(tip, end), (start, end))
        return self._found(found, f'{self.name}_{base}_{tip}')

    def _found(self, description: RobotDescription, name: str) -> RobotDescription:
        return replace(
            description,
            name=name.replace('/', '_'),
            file=self.file,
            sha256=self.sha256,
            parts=self.parts,
        )

    def _of(self, name: str, arm: str) -> RobotDescription:
        _, _, point = name.partition('/')
        description = self.arms[arm]
        if not point:
            return description
        ended = ending_at(description, point)
        # Frames of several arms stand beside each other: each has its arm's name before it.
        return replace(ended, tool=Placement(f'{arm}_{ended.tool.frame}', ended.tool.motion))


def _arm_of(name: str, known: Sequence[str], file: str) -> str:
    arm = name.partition('/')[0]
    if arm not in known:
        _refuse(file, f'{name!r} is not in this cell: it has {", ".join(known)}')
    return arm


def _refuse(file: str, message: str) -> NoReturn:
    raise RobotFileError((Fault(file, 0, '', message),))


def is_cell(source: RobotSource) -> bool:
    """
    Return whether a file is that of a cell.

    Raises
    ------
    RobotFileError
        It cannot be read.
    """
    file = str(source.file)
    return not translator_of(file) and CELL.search(text_of(file)) is not None


def cell_of(name: str) -> Cell | None:
    """
    Return the cell of a name that stands for a whole one, None for anything else.

    Raises
    ------
    RobotFileError
        With all faults of the file of a cell.
    """
    try:
        source = find_robot(name)
        whole = is_cell(source) and not (source.base or source.tip)
    except (RobotNotFoundError, RobotFileError):
        return None  # what is wrong is said where the robot is read
    return read_cell(source.file) if whole else None


def read_robot(source: RobotSource) -> RobotDescription:
    """
    Return what a robot file, a file that is translated into one, or a cell says.

    Raises
    ------
    RobotFileError
        With all faults of the file.
    KinematicsError
        It cannot be translated; there is no such point.
    """
    if is_cell(source):
        return read_cell(source.file).described(source.base, source.tip)
    file = str(source.file)
    if (source.base or source.tip) and not translator_of(file):
        _refuse(file, f'has one arm, {source.base}:{source.tip} are ends of URDFs and of cells')
    return read_robot_file(file, source.base, source.tip)


def read_cell(path: Path) -> Cell:
    """
    Return what the file of a cell says.

    Raises
    ------
    RobotFileError
        With all faults of the file, or of an arm's.
    """
    file = str(path)
    text = text_of(file)
    document = read_document(text, file)
    report = FaultReport(document)
    entry = checked(CellEntry, document.data, (), report)
    if entry.cell is not None and not ROBOT_NAME.fullmatch(entry.cell):
        report.fault(
            ('cell',), f'{quoted(entry.cell)} is not a name of letters, digits and underscores'
        )
    frame = entry.frame or FLOOR
    quantities = Quantities(report, read_units(entry.units, report), {}, {})
    given = checked_mapping(entry.arms, ARMS, report, 'names to {robot, joint_prefix, xyz, rpy}')
    placed = {
        name: _read_arm(name, data, frame, path.parent, quantities) for name, data in given.items()
    }
    if 'arms' in document.data and not given:
        report.fault(ARMS, 'a cell has at least one arm')
    arms = {name: arm for name, arm in placed.items() if arm is not None}
    common = tuple(name for name in entry.common or () if name)
    _check_names(arms, common, report)
    report.raise_faults()
    return Cell(
        entry.cell or '',
        frame,
        {name: arm.description for name, arm in arms.items()},
        file,
        hashlib.sha256(text.encode()).hexdigest(),
        tuple(arm.file for arm in arms.values()),
    )


class _PlacedArm(NamedTuple):
    file: str
    description: RobotDescription


def _read_arm(
    name: str, data: object, frame: str, folder: Path, quantities: Quantities
) -> _PlacedArm | None:
    report, path = quantities.report, (*ARMS, name)
    before = report.fault_count
    if name == frame or not POINT_NAME.fullmatch(name):
        report.fault(
            path,
            f'{quoted(name)} is no name of an arm: letters, digits and single underscores between '
            f'them, a letter first, and not {frame}, which is the frame of the cell',
        )
    entry = checked(CellArmEntry, data, path, report)
    motion = pose_motion(entry.xyz, entry.rpy, path, quantities)
    if entry.robot is None or motion is None or report.fault_count > before:
        return None
    try:
        source = find_robot(entry.robot)
        source = source._replace(file=folder / source.file)  # which may be absolute
        if is_cell(source):
            report.fault((*path, 'robot'), f'{source.file} is a cell itself: give one arm')
            return None
        arm = read_robot(source)
    except RobotNotFoundError as error:
        report.fault((*path, 'robot'), str(error))
        return None
    prefix = entry.joint_prefix or ''
    arm = moved_base(arm, motion.matrix, frame)
    arm = replace(
        arm,
        joints=tuple(replace(joint, name=prefix + joint.name) for joint in arm.joints),
        tool=Placement(f'{name}_{arm.tool.frame}', arm.tool.motion),
        known_poses=(),
    )
    return _PlacedArm(str(source.file), arm)


def _check_names(
    arms: Mapping[str, _PlacedArm], common: Sequence[str], report: FaultReport
) -> None:
    names = {name: {joint.name for joint in arm.description.joints} for name, arm in arms.items()}
    for first, second in combinations(names, 2):
        twice = sorted((names[first] & names[second]).difference(common))
        if twice:
            report.fault(
                (*ARMS, second, 'joint_prefix'),
                f'{first} and {second} both have a joint {quoted(twice[0])}: give each arm a '
                "joint_prefix of its own, or name the joint in 'common' if it moves both",
            )
    for index, name in enumerate(common):
        theirs = [
            replace(joint, variable='', unused=False)
            for arm in arms.values()
            for joint in arm.description.joints
            if joint.name == name
        ]
        if any(one != theirs[0] for one in theirs):
            report.fault(
                ('common', index),
                f'{quoted(name)} is not the same joint in all arms: type, limits or speeds differ',
            )
        if sum(name in joints for joints in names.values()) < 2:
            known = ', '.join(sorted(set().union(*names.values())))
            report.fault(
                ('common', index), f'{quoted(name)} is no joint of two arms (joints: {known})'
            )


# About and along z.
SCREW: tuple[Axis, Axis] = ('Rz', 'Tz')


class _JointChain(NamedTuple):
    # Constant motions with screws about z between them, one fewer: angle and length of each are
    # linear in the variables, without constants.
    motions: Sequence[Floats]
    screws: 'Sequence[tuple[Affine, Affine]]'

    def reverse(self) -> '_JointChain':
        return _JointChain(
            [inverse(motion) for motion in reversed(self.motions)],
            [(_negative(theta), _negative(d)) for theta, d in reversed(self.screws)],
        )


def _negative(affine: Affine) -> Affine:
    return Affine(0.0, tuple((name, -factor) for name, factor in affine.coefficients))


def _chain(description: RobotDescription, variables: Mapping[str, str]) -> _JointChain:
    # From the frame of the cell to the tool, its variables called by other names.
    motions, screws = [description.base.motion.matrix], []
    for row in table_rows(description):
        motions[-1] = motions[-1] @ row.before @ screw_z(row.theta.constant, row.d.constant)
        if row.theta.coefficients or row.d.coefficients:
            screws.append((_renamed(row.theta, variables), _renamed(row.d, variables)))
            motions.append(row.after)
        else:
            motions[-1] = motions[-1] @ row.after
    motions[-1] = motions[-1] @ description.tool.motion.matrix
    return _JointChain(motions, screws)


def _renamed(affine: Affine, variables: Mapping[str, str]) -> Affine:
    return Affine(0.0, tuple((variables[name], factor) for name, factor in affine.coefficients))


def relative_motion(
    first: RobotDescription, second: RobotDescription, names: tuple[str, str]
) -> RobotDescription:
    """
    Return the arm whose base is the tool of one arm, and whose tool is that of another.

    Its joints are those that move one against the other, the first arm's before the second's. Its
    Jacobian is in the axes of the first tool.

    Parameters
    ----------
    first, second
        Their bases in one frame. Joints of the same name are the same joint.
    names
        Of the arms, for variables and messages.

    Raises
    ------
    RobotFileError
        An arm has closed loops, or nothing moves the two against each other.
    """
    variables: dict[str, str] = {}  # by the joint's name
    chains: list[_JointChain] = []
    for name, arm in zip(names, (first, second)):
        if arm.loops:
            _refuse(arm.file, f'{name} has closed loops: a relative motion takes arms without')
        for joint in arm.joints:
            variables.setdefault(joint.name, f'{name}_{joint.variable}')
        chains.append(_chain(arm, {one.variable: variables[one.name] for one in arm.joints}))
    chain = _joined(chains[0].reverse(), chains[1])
    if not chain.screws:
        _refuse(first.file, f'no joint moves the tool of {names[1]} against that of {names[0]}')
    links = tuple(_links(chain))
    joints = {variables[one.name]: one for one in (*first.joints, *second.joints)}
    moving = moving_variables(first, links)
    if len(moving) > MAX_JOINTS:
        _refuse(first.file, f'{len(moving)} joints move the two arms (at most {MAX_JOINTS})')
    return replace(
        first,
        source='; '.join(dict.fromkeys(arm.source for arm in (first, second) if arm.source)),
        convention='shape',
        angle_unit='rad',
        length_unit='m',
        constants=(),
        joints=tuple(
            replace(joint, variable=variable, unused=False)
            for variable, joint in joints.items()
            if variable in moving
        ),
        links=links,
        base=Placement(first.tool.frame, _as_matrix(chain.motions[0])),
        tool=Placement(second.tool.frame, _as_matrix(chain.motions[-1])),
        points=(),
        singularity=SingularityDescription(None, None, 'distance', None, None, ()),
        uncertainty=None,
        known_poses=(),
        speed_limits=(),
        warnings=(*first.warnings, *second.warnings),
        remarks=(),
    )


def _joined(first: _JointChain, second: _JointChain) -> _JointChain:
    # One after the other, without what the first does and the second takes back: the joints that
    # both arms stand on.
    motions = [*first.motions[:-1], first.motions[-1] @ second.motions[0], *second.motions[1:]]
    screws = [*first.screws, *second.screws]
    size = sum(float(np.linalg.norm(motion[:3, 3])) for motion in motions)
    k = len(first.screws)
    while 0 < k < len(screws):
        here, there, between = screws[k - 1], screws[k], motions[k]
        # A motion that takes the axis to itself, or turns it round, changes places with a screw.
        round_z = between[2, 2] < 0.0
        undone = there == (here if round_z else tuple(map(_negative, here)))
        parallel = np.abs(between[:2, 2]).max() <= ONE_AXIS
        same = not here[0].coefficients or np.abs(between[:2, 3]).max() <= ONE_AXIS * size
        if not (undone and parallel and same):
            break
        motions[k - 1 : k + 2] = [motions[k - 1] @ motions[k] @ motions[k + 1]]
        del screws[k - 1 : k + 1]
        k -= 1
    return _JointChain(motions, screws)


def _links(chain: _JointChain) -> 'Sequence[Link]':
    # Of Sheth and Uicker's rows, T = in * joint * inverse(out): the constant motions are any.
    links: list[Link] = []
    for k, screw in enumerate(chain.screws):
        after = IDENTITY
        if k < len(chain.screws) - 1:
            after = _as_matrix(inverse(chain.motions[k + 1]))
        moves = [
            ElementaryMotion(axis, Expression(_text(affine), affine))
            for axis, affine in zip(SCREW, screw)
            if affine.coefficients
        ]
        links += [ShapeRow(IDENTITY, move, IDENTITY) for move in moves[:-1]]
        links.append(ShapeRow(IDENTITY, moves[-1], after))
    return links


def _text(affine: Affine) -> str:
    terms = [
        f'{"-" if factor < 0.0 else "+"} '
        + (name if abs(factor) == 1.0 else f'{abs(factor)!r}*{name}')
        for name, factor in affine.coefficients
    ]
    return ' '.join(terms).removeprefix('+ ').replace('- ', '-', 1 if terms[0][0] == '-' else 0)


def _as_matrix(motion: Floats) -> RigidMotion:
    # Without the last digit, which products have rounded: right angles are seen to be right.
    numbers = [0.0 if abs(x) < ROUND_OFF else float(f'{x:.15g}') for x in motion.ravel()]
    return RigidMotion(np.reshape(numbers, (4, 4)), tuple(map(repr, numbers)))
