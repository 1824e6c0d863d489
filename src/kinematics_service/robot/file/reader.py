# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read a robot file, which is a YAML file for one robot, and return a `RobotDescription`."""

import hashlib
import os
import re
import stat
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, NoReturn

from ...errors import Fault, RobotFileError
from .parts.constants import Constants, read_constants
from .parts.convention_table import CONVENTIONS, Convention
from .parts.description import (
    ElementaryMotion,
    Link,
    PassiveJoint,
    Placement,
    RobotDescription,
)
from .parts.joints import JointHead, read_joint, read_joint_heads
from .parts.known_poses import read_known_poses
from .parts.links import (
    MAX_ROWS,
    check_helical,
    likely_convention,
    read_links,
    variables_of,
    warn_of_size,
)
from .parts.loops import names_in_loops, read_loops, read_passive
from .parts.motions import read_placement
from .parts.points import read_points
from .parts.quantities import Quantities, Units
from .parts.schema import RobotEntry, UnitsEntry
from .parts.singularity import read_singularity
from .parts.speed_limits import read_speed_limits
from .parts.tolerances import read_tolerances
from .parts.uncertainty import read_uncertainty
from .text.entries import checked
from .text.fault_report import FaultReport, Place, quoted, shown
from .text.plain_expression import known_names_in
from .text.robot_document import MAX_BYTES, read_document
from .text.yaml_document import Yaml, texts_in
from .translation import MAX_BYTES as MAX_TRANSLATED_BYTES
from .translation import RobotText, translator_of

# Types of paths that are not regular files, with their names in messages. The reader refuses these
# paths, because reading a directory fails, and reading a pipe or a device might never end.
KINDS = {
    stat.S_IFDIR: 'a directory',
    stat.S_IFIFO: 'a named pipe',
    stat.S_IFSOCK: 'a socket',
    stat.S_IFCHR: 'a device',
    stat.S_IFBLK: 'a device',
}
NO_SUCH_FILE = (
    'no such file; give a robot file or a bundled robot (kinematics_service robots lists them)'
)
# Matches the key `cell` in the file of a cell. The file of a robot has the key `robot` instead.
CELL = re.compile(r'^cell\s*:', re.MULTILINE)
ROBOT_NAME = re.compile(r'[A-Za-z0-9_]+')


def read_robot_file(
    path: str | os.PathLike[str], base: str = '', tip: str = ''
) -> RobotDescription:
    """
    Read the description of a robot from a robot file, or from a URDF, which is translated first.

    Parameters
    ----------
    base, tip
        The first and last link of the arm in a URDF; '' if the translator chooses them.

    Raises
    ------
    RobotFileError
        The file cannot be read, or has faults; the message has one line for each fault.
    KinematicsError
        The translation of a URDF fails.
    """
    file = os.fspath(path)
    content = _content(file)
    if translate := translator_of(file):
        return described(translate(content, file, base, tip), file, content)
    description = parse_robot(_decoded(content, file), file)
    return replace(description, sha256=hashlib.sha256(content).hexdigest())


def robot_file_text(path: str | os.PathLike[str], base: str = '', tip: str = '') -> str:
    """
    Return the text of a robot file. If the file is a URDF, return its translation to a robot file.
    """
    file = os.fspath(path)
    if translate := translator_of(file):
        return translate(_content(file), file, base, tip).text
    text = text_of(file)
    if CELL.search(text):
        refuse(file, 'is a cell; give the robot file of one of its arms', 'unsupported')
    return text


def text_of(file: str) -> str:
    """
    Return the text of a file in UTF-8 as it is, without a translation of URDF.

    Raises
    ------
    RobotFileError
        The file cannot be read, or is not UTF-8.
    """
    return _decoded(_content(file), file)


def described(translated: RobotText, file: str, content: bytes) -> RobotDescription:
    """
    Return the description of a robot from the translated text of another format, such as URDF.
    """
    # Replace the warnings of `parse_robot` by those of the translator. The warnings of
    # `parse_robot` name lines and keys of the translated text, which the user does not see.
    return replace(
        parse_robot(translated.text, file),
        warnings=translated.doubts,
        mimics=translated.mimics,
        remarks=translated.remarks,
        sha256=hashlib.sha256(content).hexdigest(),
    )


def _content(file: str) -> bytes:
    max_bytes = MAX_TRANSLATED_BYTES if translator_of(file) else MAX_BYTES
    try:
        kind = KINDS.get(stat.S_IFMT(os.stat(file).st_mode))
        if kind is None:
            with open(file, 'rb') as stream:
                # A file may be endless, so read at most one byte more than the largest accepted
                # size. If this byte exists, the caller refuses the file.
                return stream.read(max_bytes + 1)
        reason, code = f'is {kind}; give the robot file itself', 'not-a-file'
    except FileNotFoundError:
        reason, code = NO_SUCH_FILE, 'missing-file'
    except (OSError, ValueError) as error:
        cause = error.strerror if isinstance(error, OSError) else error
        reason, code = f'cannot be read: {cause}', 'unreadable'
    return refuse(file, reason, code)


def _decoded(content: bytes, file: str) -> str:
    try:
        return content.decode('utf-8-sig')
    except UnicodeDecodeError as error:
        if len(content) > MAX_BYTES:
            refuse(file, f'larger than {MAX_BYTES // 1024} KiB: not a robot file', 'too-large')
        line = content.count(b'\n', 0, error.start) + 1
        refuse(file, 'is not UTF-8 text; save the file as UTF-8', 'not-utf8', line)


def parse_robot(text: str, file: str) -> RobotDescription:
    """
    Parse the text of a robot file into the description of the robot.

    Parameters
    ----------
    text
        YAML without a byte order mark.
    file
        The path of the file, for messages.

    Raises
    ------
    RobotFileError
        The text has faults; the message has one line for each fault.
    """
    document = read_document(text, file)
    top = Place(FaultReport(document))
    data = document.data
    if not isinstance(data, dict):
        keys = ', '.join(RobotEntry.required)
        message = f'expected a mapping with the keys {keys}, not {shown(data)}'
        refuse(file, message, 'wrong-type', top.line)
    entry = checked(RobotEntry, data, top)
    check_name(entry.robot, top['robot'])
    units = read_units(entry.units, top['units'])
    names = _names(entry, data, units, top)
    quantities = names.quantities

    joints = [
        joint
        for index, head in enumerate(names.heads)
        if (joint := read_joint(head, top['joints', index], quantities))
    ]
    # If the convention is missing or unknown, read the rows with a convention that fits their
    # form. So all faults of the rows are reported.
    convention = CONVENTIONS.get(entry.convention or '') or likely_convention(entry.links)
    links = _links(entry, data, convention, names)
    rows = len(entry.links) if isinstance(entry.links, list) else MAX_ROWS
    base, tool = _ends(entry, quantities)
    points = read_points(entry.points, rows, (base, tool), quantities)
    loops = read_loops(entry.loops, names.passive, links, points, convention, quantities)
    singularity = read_singularity(entry.singularity, names.driven)
    uncertainty = read_uncertainty(entry.uncertainty, joints, links, convention.name, quantities)
    if uncertainty and loops:
        message = 'is not propagated through closed loops; leave it out'
        top['uncertainty'].fault(message, 'unsupported')
    speed_limits = read_speed_limits(entry.speed_limits, points, quantities)
    known_poses = read_known_poses(entry.known_poses, joints, quantities)
    tolerances = read_tolerances(entry.tolerance, convention, rows, quantities)

    top.report.raise_faults()
    if not (entry.robot and entry.convention and links and base and tool and singularity):
        # This line never runs. If a part is missing, a fault was reported, and `raise_faults`
        # above has raised an error. mypy needs the check.
        refuse(file, 'is incomplete', 'missing-key')
    _remark(entry, names, links)
    return RobotDescription(
        name=entry.robot,
        source=entry.source or '',
        convention=convention.name,
        angle_unit=units.angle,
        length_unit=units.length,
        constants=names.constants.constants,
        joints=tuple(joints),
        links=links,
        base=base,
        tool=tool,
        points=points,
        singularity=singularity,
        uncertainty=uncertainty,
        known_poses=known_poses,
        warnings=top.report.warnings(),
        remarks=top.report.remarks(),
        file=file,
        tolerances=tolerances,
        loops=loops,
        speed_limits=speed_limits,
    )


def refuse(file: str, message: str, code: str, line: int = 0, where: str = '') -> NoReturn:
    """Raise RobotFileError with one fault, at a line and key or for the whole file."""
    raise RobotFileError((Fault(file, line, where, message, code),))


def read_units(data: Yaml, at: Place) -> Units:
    """Read the units of angles and lengths in a robot file; by default rad and m."""
    if data is None:
        return Units()
    entry = checked(UnitsEntry, data, at)
    return Units('deg' if entry.angle == 'deg' else 'rad', 'mm' if entry.length == 'mm' else 'm')


def check_name(name: str | None, at: Place) -> None:
    """Report a fault if the name of a robot or cell has a character that is not allowed."""
    if name is not None and not ROBOT_NAME.fullmatch(name):
        message = f'{quoted(name)} is not a name of letters, digits and underscores'
        at.fault(message, 'wrong-name')


class _FileNames(NamedTuple):
    """
    The joints, passive joints and constants of a robot file, and two objects that read
    expressions.

    Attributes
    ----------
    heads
        The name, variable and type of each joint.
    passive
        The passive joints of each loop.
    driven, quantities
        The two objects that read expressions. `quantities` accepts the names of joints, passive
        joints and constants. `driven` refuses the names of passive joints; it reads the section
        `singularity`.
    """

    heads: Sequence[JointHead]
    passive: Sequence[tuple[PassiveJoint, ...]]
    constants: Constants
    driven: Quantities
    quantities: Quantities


def _names(entry: RobotEntry, data: dict[str, Yaml], units: Units, top: Place) -> _FileNames:
    constant_names = tuple(entry.constants) if isinstance(entry.constants, dict) else ()
    heads = []
    if 'joints' in data:
        heads = read_joint_heads(entry.joints, constant_names, top['joints'])
    moving = [head.variable for head in heads if head.variable]
    passive = read_passive(entry.loops, [*constant_names, *moving], top['loops'])
    moving += [joint.name for joints in passive for joint in joints]
    constants = read_constants(entry.constants, units, moving, top['constants'])
    known = {head.variable: head.type for head in heads if head.variable and head.type}
    values = {constant.name: constant.value for constant in constants.constants}
    hidden = constants.unreadable.union(*(head.hidden for head in heads))
    driven = Quantities(
        *(top, units, values, known, [head.type for head in heads]),
        unreadable=hidden - known.keys() - values.keys(),
        # If the variable of a joint has a fault, an unknown name in an expression may be this
        # variable.
        all_names_known=bool(heads)
        and constants.all_names_known
        and all(head.variable for head in heads),
        used=set(constants.used),
        letters=frozenset(constant.name for constant in constants.constants if constant.letter),
    )
    of_loops = {joint.name: joint.type for joints in passive for joint in joints}
    quantities = replace(driven, joint_types={**known, **of_loops, **known})
    return _FileNames(heads, passive, constants, driven, quantities)


def _links(
    entry: RobotEntry, data: dict[str, Yaml], convention: Convention, names: _FileNames
) -> tuple[Link, ...] | None:
    if 'links' not in data:
        return None
    quantities = names.quantities
    links = read_links(entry.links, convention, quantities.top['links'], quantities)
    check_helical(links or (), quantities)
    _check_movement(entry, names, links)
    warn_of_size(links or (), quantities)
    return links


def _ends(entry: RobotEntry, quantities: Quantities) -> tuple[Placement | None, Placement | None]:
    base = read_placement(entry.base, quantities.top['base'], 'base_link', quantities)
    tool = read_placement(entry.tool, quantities.top['tool'], 'tool0', quantities)
    if base and tool and base.frame == tool.frame:
        message = f'{quoted(tool.frame)} is also the base frame; rename one of them'
        quantities.top['tool', 'frame'].fault(message, 'duplicate-name')
    return base, tool


def _check_movement(entry: RobotEntry, names: _FileNames, links: Sequence[Link] | None) -> None:
    # Report each joint that moves no row but is not marked `unused: true`, and each joint that
    # moves a row but is marked `unused: true`.
    quantities = names.quantities
    joints, known = quantities.top['joints'], quantities.joint_types.keys()
    if links is not None:
        rows = [variables_of(row) for row in links]
    elif quantities.strange or not quantities.all_names_known or not isinstance(entry.links, list):
        return  # an unknown name may be the variable of any joint, so no joint is certainly unused
    else:
        rows = [known_names_in(text, known) for text in texts_in(entry.links)]
    moving = frozenset().union(*rows)
    moving_loops = names_in_loops(entry.loops, known)
    for index, (joint, _, variable, hidden) in enumerate(names.heads if rows else ()):
        if variable not in known:
            continue
        if not {variable, *hidden} & (moving | moving_loops) and not joint.unused:
            message = f"{quoted(variable)} moves no row of links; add its row, or 'unused: true'"
            joints[index].fault(message, 'unused-joint')
        if variable in moving and joint.unused and links is not None:
            row = next(i for i, inside in enumerate(rows) if variable in inside)
            message = f'{quoted(variable)} moves links[{row}]; delete unused'
            joints[index, 'unused'].fault(message, 'conflict')


def _remark(entry: RobotEntry, names: _FileNames, links: Sequence[Link]) -> None:
    top = names.quantities.top
    if not entry.source:
        top['source'].remark('is missing; write where the numbers come from')
    for constant in names.constants.constants:
        if constant.name not in names.quantities.used:
            top['constants', constant.name].warn('is never used', 'unused-constant')
    for index, row in enumerate(links):
        if not variables_of(row) and not isinstance(row, ElementaryMotion):
            top['links', index].remark('no joint moves this row: it is fixed')
