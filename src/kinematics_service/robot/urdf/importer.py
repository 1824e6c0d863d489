# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Make a robot file from a chain of a URDF, and measure how exactly the poses of both agree."""

import os
import re
from dataclasses import dataclass, replace
from pathlib import Path, PurePath
from typing import Literal

import numpy as np

from ...errors import Fault, RobotFileError, UrdfError
from ...version import __version__
from ..file.parts.description import MimicFormula
from ..file.parts.joints import MAX_JOINTS
from ..file.parts.links import MAX_ROWS
from ..file.text.fault_report import quoted
from ..file.text.robot_document import MAX_BYTES
from ..file.translation import RobotText
from ..robot import Robot, robot_from_text
from .certificate import Certificate, certify, configurations
from .chain import UrdfChain, read_chain
from .document import XmlElement, parse_urdf, read_urdf, refuse
from .doubts import chain_doubts, chain_remarks
from .ends import chain_ends
from .robot_text import printable_source, robot_file_text
from .table import modified, table_of
from .tree import UrdfTree, read_tree

# Largest accepted error of a robot file's poses, relative to the arm's size. The value is 100
# times the largest error that was seen in thousands of random chains.
MAX_RELATIVE_ERROR = 1e-10
MAX_NAME_LENGTH = 256  # characters; a robot file refuses names that are longer
REFUSED_IN_JOINTS = ','  # a comma separates joint names in the label of a Jacobian message
REFUSED_IN_FRAMES = r'\s'


@dataclass(frozen=True)
class UrdfImport:
    """
    The result of the import of a URDF chain: a robot file, its robot, and warnings.

    Parameters
    ----------
    text
        The robot file; its `source` and its first lines have the certificate.
    robot
        The robot that `text` describes.
    certificate
        The largest differences between the tool poses of the robot and of the URDF.
    doubts
        Warnings about three things: parts of the URDF that are not read, numbers that are probably
        not in m or rad, and other possible tips.
    mimics
        Joints of the chain that mimic other joints.
    remarks
        Sentences about limits that a robot file cannot have, and about angles that look rounded.
    """

    text: str
    robot: Robot
    certificate: Certificate
    doubts: tuple[Fault, ...]
    mimics: tuple[MimicFormula, ...]
    remarks: tuple[str, ...]


TableConvention = Literal['standard', 'modified']


def import_urdf(
    urdf: str | os.PathLike[str],
    base: str = '',
    tip: str = '',
    name: str = '',
    convention: TableConvention = 'standard',
    round_angles: bool = False,
) -> UrdfImport:
    """
    Convert a chain of a URDF to the text of a robot file, with warnings and a certificate.

    The certificate has the largest differences between the tool poses of the robot file and those
    of the URDF.

    Parameters
    ----------
    urdf
        Path of the file, or its text, such as the parameter `robot_description` of
        robot_state_publisher. A str with a `<` is a text.
    base, tip
        Links that become the base frame and the tool frame. Default: the root, and the hand or the
        end of the longest chain of moving joints.
    name
        Name of the robot; default: that in the URDF.
    convention
        Convention of the table.
    round_angles
        Replace rounded fractions of pi by exact angles: `1.5708` becomes pi/2. Remove the noise of
        CAD programs from axes: `2e-08 0 -1` becomes `0 0 -1`. The certificate shows how much these
        replacements change the tool poses.

    Raises
    ------
    UrdfError
        The file cannot be read, is not a URDF, has no chain from `base` to `tip`, or has a joint
        that a robot file cannot express.
    """
    if not isinstance(urdf, str | os.PathLike):
        refuse('urdf', f'must be a path or a text, not {type(urdf).__name__}', 'wrong-type')
    if isinstance(urdf, str) and ('<' in urdf or not urdf.strip()):
        root, origin = parse_urdf(urdf.encode('utf-8'), '<text>'), 'URDF'
    else:
        path = Path(urdf)
        root, origin = read_urdf(path), f'URDF {path.name}'
    return _imported(root, origin, base, tip, name, convention, round_angles)


def urdf_as_robot_file(content: bytes, file: str, base: str, tip: str) -> RobotText:
    """
    Return the text of a robot file for a chain of a URDF, given the bytes of the URDF.

    Parameters
    ----------
    content, file
        The bytes of the URDF, and the name of its file for messages.
    base, tip
        Links that become the base frame and the tool frame; '' if the import chooses them.

    Raises
    ------
    UrdfError
        The errors that `import_urdf` raises.
    """
    root = parse_urdf(content, file)
    imported = _imported(root, f'URDF {PurePath(file).name}', base, tip)
    return RobotText(imported.text, imported.doubts, imported.mimics, imported.remarks)


def _imported(
    root: XmlElement,
    origin: str,
    base: str,
    tip: str,
    name: str = '',
    convention: TableConvention = 'standard',
    round_angles: bool = False,
) -> UrdfImport:
    tree = read_tree(root)
    base, tip, choices = chain_ends(tree, base, tip)
    try:
        chain = read_chain(tree, base, tip)
    except UrdfError as error:
        messages = [error.fault.message, *(choice.message for choice in choices)]
        raise UrdfError(replace(error.fault, message='; '.join(messages))) from None
    _check_names(tree, chain)
    for count, limit, noun in (
        (len(chain.variables), MAX_JOINTS, 'joints'),
        (len(chain.motions), MAX_ROWS, 'rows'),
    ):
        if count > limit:
            message = (
                f'the chain from {quoted(base)} to {quoted(tip)} has {count} {noun}, '
                f'and a robot file at most {limit}'
            )
            refuse(root.file, message, 'too-many')

    rounded = read_chain(tree, base, tip, rounds=True)
    table_chain = rounded if round_angles else chain
    table = table_of(table_chain)
    if convention == 'modified':
        table = modified(table)
    name = name or re.sub(r'\W', '_', chain.robot, flags=re.ASCII) or 'robot'
    poses = configurations(chain, 2)
    known = list(zip(poses, table_chain.poses(poses)))

    def source(certificate: str) -> str:
        return f'{origin}, robot {chain.robot!r}, {base} to {tip}; {certificate}'

    def text(certificate: str) -> str:
        head = (
            f'# Made from a URDF by kinematics_service {__version__}; in rad and m.\n'
            f'# {certificate.capitalize()}.\n'
        )
        return head + robot_file_text(chain, table, convention, name, source(certificate), known)

    robot = _robot(root, text('not yet measured'))
    certificate = certify(chain, robot)
    worst = max(certificate.position_error, certificate.rotation_error)
    size = 1.0 + sum(float(np.linalg.norm(motion.before[:3, 3])) for motion in chain.motions)
    if worst > MAX_RELATIVE_ERROR * size and not round_angles:
        message = f'the table is not exact enough to be written: {certificate}'
        refuse(root.file, message, 'inexact')
    written = text(str(certificate))
    _refuse_large(root, written)
    doubts = chain_doubts(tree, chain, robot.description.warnings)
    # `robot` was made from a text without the certificate. Put the certificate into the field
    # `source`, so that `robot` is equal to the robot in the text `written`.
    certified = printable_source(source(str(certificate)))
    description = replace(robot.description, source=certified)
    robot = replace(robot, source=certified, description=description)
    return UrdfImport(
        *(written, robot, certificate),
        (*choices, *doubts),
        chain.mimics,
        chain_remarks(tree, table_chain, rounded),
    )


def _check_names(tree: UrdfTree, chain: UrdfChain) -> None:
    joints = [(tree.joints[variable.name], REFUSED_IN_JOINTS) for variable in chain.variables]
    links = [(tree.links[link], REFUSED_IN_FRAMES) for link in (chain.base, chain.tip)]
    for element, refused in (*joints, *links):
        name = element.attributes['name']
        if not name.isprintable() or re.search(refused, name) or len(name) > MAX_NAME_LENGTH:
            forbidden = 'commas' if refused == REFUSED_IN_JOINTS else 'white space'
            element.refuse(
                f'the name of a {element.tag} must not have {forbidden}, control characters, or '
                f'more than {MAX_NAME_LENGTH} characters; rename it',
                'wrong-name',
            )


def _refuse_large(root: XmlElement, text: str) -> None:
    if len(text.encode('utf-8')) > MAX_BYTES:
        message = f'larger than the {MAX_BYTES // 1024} KiB that one may have'
        refuse(_as_robot_file(root), message, 'too-large')


def _robot(root: XmlElement, text: str) -> Robot:
    _refuse_large(root, text)
    try:
        return robot_from_text(text, _as_robot_file(root))
    except RobotFileError as error:
        first, *others = error.faults
        message = '\n'.join([first.message, *map(str, others)])
        raise UrdfError(replace(first, message=message)) from None


def _as_robot_file(root: XmlElement) -> str:
    return f'{root.file}, as a robot file'
