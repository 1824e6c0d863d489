"""A chain of a URDF made into a robot file, and the proof that it is the same arm."""

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
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
from .document import XmlElement, parse_urdf, read_urdf
from .doubts import chain_doubts, chain_remarks
from .ends import chain_ends
from .points import points_text
from .robot_text import robot_file_text
from .table import modified, table_of
from .tree import UrdfTree, read_tree

# Largest error of a robot file, as a share of the arm's size; a hundred times the worst of
# thousands of random chains.
ACCEPTED = 1e-10
LONGEST_NAME = 256  # of a robot file
# The label of a Jacobian joins joint names by commas.
NOT_IN_JOINTS, NOT_IN_FRAMES = ',', r'\s'


@dataclass(frozen=True)
class UrdfImport:
    """
    The result of the import of a chain.

    Parameters
    ----------
    text
        The robot file; its `source` and its first lines hold the certificate.
    robot
        The robot of that text.
    certificate
        How exact it is.
    doubts
        Parts that are not read, numbers that are hardly in m or rad, and other possible tips.
    mimics
        Joints of the chain that follow others.
    remarks
        Limits that a robot file has no place for, and angles that are rounded.
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
    points: Sequence[str] = (),
) -> UrdfImport:
    """
    Return the robot file of a chain of a URDF.

    Parameters
    ----------
    urdf
        Path of the file; or its text, such as the parameter `robot_description` of
        robot_state_publisher. A str with a `<` is a text.
    base, tip
        Links: they become the base frame and the tool frame. Default: the root, and the hand or
        the end of the longest chain of moving joints.
    name
        Name of the robot; default: that in the URDF.
    convention
        Convention of the table.
    round_angles
        Take an angle for the part of pi whose rounding it is, `1.5708` for pi/2, and an axis
        without the noise of a CAD program, `2e-08 0 -1` for `0 0 -1`. The certificate compares
        with the file as it is written, and so shows what that changes.
    points
        Links that become points of the robot file; they are fixed to what the chain moves.

    Raises
    ------
    UrdfError
        The file cannot be read, is no URDF, has no such chain, or holds a joint that no robot file
        can express.
    """
    if not isinstance(urdf, str | os.PathLike):
        raise UrdfError(f'urdf must be a path or a text, not {type(urdf).__name__}')
    if isinstance(urdf, str) and ('<' in urdf or not urdf.strip()):
        root, origin = parse_urdf(urdf.encode('utf-8'), '<text>'), 'URDF'
    else:
        path = Path(urdf)
        root, origin = read_urdf(path), f'URDF {path.name}'
    return _imported(root, origin, base, tip, name, convention, round_angles, points)


def urdf_as_robot_file(content: bytes, file: str, base: str, tip: str) -> RobotText:
    """
    Return the robot file of a chain of a URDF, from the bytes of that.

    Parameters
    ----------
    file
        Where they come from, for messages.
    base, tip
        As of `import_urdf`.

    Raises
    ------
    UrdfError
        As `import_urdf`.
    """
    root = parse_urdf(content, file)
    found = _imported(root, f'URDF {PurePath(file).name}', base, tip)
    return RobotText(found.text, found.doubts, found.mimics, found.remarks)


def _imported(
    root: XmlElement,
    origin: str,
    base: str,
    tip: str,
    name: str = '',
    convention: TableConvention = 'standard',
    round_angles: bool = False,
    points: Sequence[str] = (),
) -> UrdfImport:
    tree = read_tree(root)
    base, tip, choices = chain_ends(tree, base, tip)
    try:
        chain = read_chain(tree, base, tip)
    except UrdfError as error:
        messages = [str(error), *(choice.message for choice in choices)]
        raise UrdfError('; '.join(messages)) from None
    _check_names(tree, chain)
    for count, most, what in (
        (len(chain.variables), MAX_JOINTS, 'joints'),
        (len(chain.motions), MAX_ROWS, 'rows'),
    ):
        if count > most:
            raise UrdfError(
                f'{root.file}: the way from {quoted(base)} to {quoted(tip)} has {count} {what}, '
                f'and a robot file at most {most}'
            )

    rounded = read_chain(tree, base, tip, rounds=True)
    meant = rounded if round_angles else chain
    table = table_of(meant)
    if convention == 'modified':
        table = modified(table)
    name = name or re.sub(r'\W', '_', chain.robot, flags=re.ASCII) or 'robot'
    poses = configurations(chain, 2)
    known = list(zip(poses, meant.poses(poses)))

    def text(certificate: str) -> str:
        source = f'{origin}, robot {chain.robot!r}, {base} to {tip}; {certificate}'
        head = (
            f'# Made from a URDF by kinematics_service {__version__}; in rad and m.\n'
            f'# {certificate.capitalize()}.\n'
        )
        return head + robot_file_text(chain, table, convention, name, source, known)

    robot = _robot(root, text('not yet measured'))
    certificate = certify(chain, robot)
    _judge(certificate, chain, round_angles)
    way_to = partial(read_chain, tree, base, rounds=round_angles)
    section = points_text(robot, meant, points, way_to, ACCEPTED * _size(chain))
    written = text(str(certificate)) + section
    doubts = chain_doubts(tree, chain, robot.description.warnings)
    return UrdfImport(
        *(written, _robot(root, written), certificate),
        (*choices, *doubts),
        chain.mimics,
        chain_remarks(tree, meant, rounded),
    )


def _check_names(tree: UrdfTree, chain: UrdfChain) -> None:
    joints = [(tree.joints[variable.name], NOT_IN_JOINTS) for variable in chain.variables]
    links = [(tree.links[link], NOT_IN_FRAMES) for link in (chain.base, chain.tip)]
    for element, refused in (*joints, *links):
        name = element.attributes['name']
        if not name.isprintable() or re.search(refused, name) or len(name) > LONGEST_NAME:
            what = 'commas' if refused == NOT_IN_JOINTS else 'white space'
            element.refuse(
                f'a robot file takes no {element.tag} whose name has {what}, control characters, '
                f'or more than {LONGEST_NAME} characters: rename it'
            )


def _robot(root: XmlElement, text: str) -> Robot:
    file = f'{root.file}, as a robot file'
    if len(text.encode('utf-8')) > MAX_BYTES:
        raise UrdfError(f'{file}: larger than the {MAX_BYTES // 1024} KiB that one may have')
    try:
        return robot_from_text(text, file)
    except RobotFileError as error:
        raise UrdfError(str(error)) from None


def _size(chain: UrdfChain) -> float:
    return 1.0 + sum(float(np.linalg.norm(motion.before[:3, 3])) for motion in chain.motions)


def _judge(certificate: Certificate, chain: UrdfChain, round_angles: bool) -> None:
    worst = max(certificate.position_error, certificate.rotation_error)
    if worst > ACCEPTED * _size(chain) and not round_angles:
        raise UrdfError(f'the table is not exact enough to be written: {certificate}')
