"""Reads a robot file: one YAML file, one robot; see `description` for what comes out."""

import hashlib
import os
import re
import stat
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple, NoReturn

from ...errors import Fault, RobotFileError
from .parts.constants import Constants, read_constants
from .parts.convention_table import CONVENTIONS, Convention
from .parts.description import (
    ElementaryMotion,
    JointType,
    Link,
    PassiveJoint,
    Placement,
    RobotDescription,
)
from .parts.joints import (
    joint_type_of,
    names_given,
    read_joint,
    read_joint_entries,
    read_variables,
)
from .parts.known_poses import read_known_poses
from .parts.links import check_helical, likely_convention, read_links, variables_of, warn_of_size
from .parts.loops import moving_loops, read_loops, read_passive
from .parts.motions import read_placement
from .parts.points import read_points
from .parts.quantities import Quantities, Units
from .parts.schema import JointEntry, RobotEntry, UnitsEntry
from .parts.singularity import read_singularity
from .parts.speed_limits import read_speed_limits
from .parts.tolerances import read_tolerances
from .parts.uncertainty import read_uncertainty
from .text.entries import checked
from .text.fault_report import FaultReport, Place, quoted, shown
from .text.plain_expression import known_names_in
from .text.robot_document import MAX_BYTES, read_document
from .text.yaml_document import Yaml, texts_in
from .translation import MAX_BYTES as MOST_TRANSLATED
from .translation import RobotText, translator_of

# What a path may lead to besides files and folders; reading it might wait for ever.
KINDS: Sequence[tuple[Callable[[int], bool], str]] = (
    (stat.S_ISFIFO, 'a named pipe'),
    (stat.S_ISSOCK, 'a socket'),
    (stat.S_ISCHR, 'a device'),
    (stat.S_ISBLK, 'a device'),
)
# A cell has this key where a robot file has `robot`.
CELL = re.compile(r'^cell\s*:', re.MULTILINE)
ROBOT_NAME = re.compile(r'[A-Za-z0-9_]+')


def read_robot_file(
    path: str | os.PathLike[str], base: str = '', tip: str = ''
) -> RobotDescription:
    """
    Return what a robot file says, or a file that is translated into one.

    Parameters
    ----------
    base, tip
        The links at which the arm begins and ends in a file that is translated; empty: chosen.

    Raises
    ------
    RobotFileError
        With all faults of the file, one a line; also where it cannot be read at all.
    KinematicsError
        It cannot be translated.
    """
    file = os.fspath(path)
    translate = translator_of(file)
    content = _content(file, MOST_TRANSLATED if translate else MAX_BYTES)
    if translate:
        return described(translate(content, file, base, tip), file, content)
    description = parse_robot(_decoded(content, file), file)
    return replace(description, sha256=hashlib.sha256(content).hexdigest())


def robot_file_text(path: str | os.PathLike[str], base: str = '', tip: str = '') -> str:
    """Return the text of a robot file, or that into which a file is translated; as above."""
    file = os.fspath(path)
    translate = translator_of(file)
    content = _content(file, MOST_TRANSLATED if translate else MAX_BYTES)
    if translate:
        return translate(content, file, base, tip).text
    text = _decoded(content, file)
    if CELL.search(text):
        refuse(file, 'is a cell: give the robot file of one of its arms')
    return text


def text_of(file: str) -> str:
    """
    Return the text of a file of our own.

    Raises
    ------
    RobotFileError
        It cannot be read.
    """
    return _decoded(_content(file, MAX_BYTES), file)


def described(translated: RobotText, file: str, content: bytes) -> RobotDescription:
    """Return what a robot says that was translated from the content of a file."""
    # The reader's own doubts and remarks have lines and keys of a text that nobody sees.
    return replace(
        parse_robot(translated.text, file),
        warnings=translated.doubts,
        mimics=translated.mimics,
        remarks=translated.remarks,
        sha256=hashlib.sha256(content).hexdigest(),
    )


def _content(file: str, most: int) -> bytes:
    try:
        _check_kind(file)
        with open(file, 'rb') as stream:
            # One byte more than is accepted: enough to refuse, also where a file never ends.
            return stream.read(most + 1)
    except RobotFileError:
        raise  # which is a ValueError, too
    except FileNotFoundError:
        refuse(file, 'no such file')
    except IsADirectoryError:
        refuse(file, 'is a directory: give the robot file itself')
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        refuse(file, f'cannot be read: {reason}')


def _decoded(content: bytes, file: str) -> str:
    try:
        return content.decode('utf-8-sig')
    except UnicodeDecodeError as error:
        if len(content) > MAX_BYTES:
            refuse(file, f'larger than {MAX_BYTES // 1024} KiB: not a robot file')
        refuse(file, 'is not UTF-8 text', content.count(b'\n', 0, error.start) + 1)


def parse_robot(text: str, file: str) -> RobotDescription:
    """
    Return what the text of a robot file says.

    Parameters
    ----------
    text
        YAML; a byte order mark has been taken off.
    file
        Its path, for messages.

    Raises
    ------
    RobotFileError
        With all faults of the text, one a line.
    """
    document = read_document(text, file)
    top = Place(FaultReport(document))
    data = _mapping(document.data, top)
    entry = checked(RobotEntry, data, top)
    check_name(entry.robot, top['robot'])
    units = read_units(entry.units, top['units'])
    names = _names(entry, data, units, top)
    quantities = names.quantities

    joints = [
        joint
        for index, (item, variable) in enumerate(zip(names.joints, names.variables, strict=True))
        if (joint := read_joint(item, variable, top['joints', index], quantities))
    ]
    convention = CONVENTIONS.get(entry.convention or '')
    links = _links(entry, data, convention, names)
    rows = None if links is None else len(links)
    base, tool = _ends(entry, quantities)
    points = read_points(entry.points, rows, (base, tool), quantities)
    loops = read_loops(entry.loops, names.passive, links, points, convention, quantities)
    singularity = read_singularity(entry.singularity, names.driven)
    uncertainty = read_uncertainty(
        entry.uncertainty, joints, links, entry.convention or '', quantities
    )
    if uncertainty and loops:
        top['uncertainty'].fault('is not carried through closed loops: leave it out')
    speed_limits = read_speed_limits(entry.speed_limits, points, quantities)
    known_poses = read_known_poses(entry.known_poses, joints, quantities)
    tolerances = read_tolerances(entry.tolerance, convention, rows, quantities)

    top.report.raise_faults()
    if not (entry.robot and convention and links and base and tool and singularity):
        # Every part that is missing has a fault; were one forgotten, this is the safe end.
        refuse(file, 'is incomplete')
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


def _check_kind(file: str) -> None:
    mode = os.stat(file).st_mode
    kind = next((name for is_kind, name in KINDS if is_kind(mode)), None)
    if kind:
        refuse(file, f'is {kind}: give the robot file itself')


def refuse(file: str, message: str, line: int = 0, where: str = '') -> NoReturn:
    """Raise the error of one fault, or of a file as a whole."""
    raise RobotFileError((Fault(file, line, where, message),))


def read_units(data: Yaml, at: Place) -> Units:
    """Return the units of the numbers of a file; rad and m where it does not say."""
    if data is None:
        return Units()
    entry = checked(UnitsEntry, data, at)
    return Units('deg' if entry.angle == 'deg' else 'rad', 'mm' if entry.length == 'mm' else 'm')


def _mapping(data: Yaml, top: Place) -> dict[str, Yaml]:
    if isinstance(data, dict):
        return data
    keys = ', '.join(RobotEntry.required)
    top.fault(f'expected a mapping with the keys {keys}, not {shown(data)}')
    top.report.raise_faults()
    return {}


def check_name(name: str | None, at: Place) -> None:
    """Report a name that no robot, or cell, may have."""
    if name is not None and not ROBOT_NAME.fullmatch(name):
        at.fault(f'{quoted(name)} is not a name of letters, digits and underscores')


class _FileNames(NamedTuple):
    """
    What expressions of the file may name: constants, variables of joints, passive joints.

    Attributes
    ----------
    joints, variables
        For each joint its entry, and its variable, None where it is not understood.
    passive
        The joints that loops move.
    driven, quantities
        Readers of numbers: of the joints alone, and of passive ones as well.
    """

    joints: Sequence[JointEntry]
    variables: Sequence[str | None]
    passive: Sequence[PassiveJoint]
    constants: Constants
    driven: Quantities
    quantities: Quantities


def _names(entry: RobotEntry, data: dict[str, Yaml], units: Units, top: Place) -> _FileNames:
    joints = read_joint_entries(entry.joints, top['joints']) if 'joints' in data else []
    types = [joint_type_of(joint) for joint in joints]
    constant_names = tuple(entry.constants) if isinstance(entry.constants, dict) else ()
    variables = read_variables(joints, constant_names, top['joints'])
    moving = [variable for variable in variables if variable]
    passive = read_passive(entry.loops, [*constant_names, *moving], top['loops'])
    moving += [joint.name for joint in passive]
    constants = read_constants(entry.constants, units, moving, top['constants'])
    items = entry.joints if joints and isinstance(entry.joints, list) else []
    driven = _quantities(top, units, constants, items, types, variables)
    with_passive = {**driven.joint_types, **{joint.name: joint.type for joint in passive}}
    quantities = replace(driven, joint_types=with_passive) if passive else driven
    return _FileNames(joints, variables, passive, constants, driven, quantities)


def _quantities(
    top: Place,
    units: Units,
    constants: Constants,
    items: Sequence[Yaml],
    types: Sequence[JointType | None],
    variables: Sequence[str | None],
) -> Quantities:
    known = {}
    hidden = set(constants.unreadable)
    all_names_known = bool(items) and constants.all_names_known
    values = {constant.name: constant.value for constant in constants.constants}
    letters = frozenset(constant.name for constant in constants.constants if constant.letter)
    for item, joint_type, variable in zip(items, types, variables, strict=True):
        if variable and joint_type:
            known[variable] = joint_type
        elif variable is None:
            # The expressions may call it anything.
            all_names_known = False
        keys = set(item) if isinstance(item, dict) else set()
        if not (variable and joint_type and keys <= set(JointEntry.keys())):
            hidden |= names_given(item)
    hidden -= known.keys() | values.keys()
    found = Quantities(
        top, units, values, known, types, frozenset(hidden), all_names_known, set(constants.used)
    )
    return replace(found, letters=letters)


def _links(
    entry: RobotEntry, data: dict[str, Yaml], convention: Convention | None, names: _FileNames
) -> tuple[Link, ...] | None:
    if 'links' not in data:
        return None
    quantities = names.quantities
    # Rows are judged also where the convention is not known: by what they look like.
    at, judged = quantities.top['links'], convention or likely_convention(entry.links)
    links = read_links(entry.links, judged, at, quantities)
    check_helical(links or (), quantities)
    _check_movement(names, data, links)
    warn_of_size(links or (), quantities)
    return links


def _ends(entry: RobotEntry, quantities: Quantities) -> tuple[Placement | None, Placement | None]:
    base = read_placement(entry.base, quantities.top['base'], 'base_link', quantities)
    tool = read_placement(entry.tool, quantities.top['tool'], 'tool0', quantities)
    if base and tool and base.frame == tool.frame:
        quantities.top['tool', 'frame'].fault(f'{quoted(tool.frame)} is also the base frame')
    return base, tool


def _check_movement(
    names: _FileNames, data: dict[str, Yaml], links: Sequence[Link] | None
) -> None:
    # Every joint moves a row, or says that it moves none.
    quantities = names.quantities
    joints, rows = quantities.top['joints'], _names_in_rows(data['links'], links, quantities)
    if not rows:
        return
    moving = frozenset().union(*rows)
    in_loops = moving_loops(data.get('loops'), quantities.joint_types.keys())
    listed = data.get('joints')
    items = listed if isinstance(listed, list) else []
    for index, (item, entry, variable) in enumerate(zip(items, names.joints, names.variables)):
        if variable is None or joint_type_of(entry) is None:
            continue
        called = {variable} if links is not None else names_given(item)
        if not called & (moving | in_loops) and not entry.unused:
            joints[index].fault(
                f"{quoted(variable)} moves no row of links: add its row, or say 'unused: true'"
            )
        if variable in moving and entry.unused and links is not None:
            row = next(i for i, inside in enumerate(rows) if variable in inside)
            joints[index, 'unused'].fault(f'{quoted(variable)} moves links[{row}]: it is used')


def _names_in_rows(
    data: Yaml, links: Sequence[Link] | None, quantities: Quantities
) -> list[frozenset[str]]:
    # None where there are no rows, which has been said, or where a name may be among those that
    # are not understood.
    if links is not None:
        return [variables_of(row) for row in links]
    if quantities.strange or not quantities.all_names_known or not isinstance(data, list):
        return []
    known = quantities.joint_types.keys()
    return [known_names_in(text, known) for text in texts_in(data)]


def _remark(entry: RobotEntry, names: _FileNames, links: Sequence[Link]) -> None:
    top = names.quantities.top
    if not entry.source:
        top['source'].remark('is not given: say where the numbers come from')
    for constant in names.constants.constants:
        if constant.name not in names.quantities.used:
            top['constants', constant.name].warn('is never used')
    for index, row in enumerate(links):
        if not variables_of(row) and not isinstance(row, ElementaryMotion):
            top['links', index].remark('no joint moves this row: it is fixed')
