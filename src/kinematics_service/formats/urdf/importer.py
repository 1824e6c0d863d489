"""A chain of a URDF made into a robot file, and the proof that it is the same arm."""

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from ...errors import RobotFileError, UrdfError
from ...robot.file.parts.joints import MAX_JOINTS
from ...robot.file.parts.links import MAX_ROWS
from ...robot.file.text.robot_document import MAX_BYTES
from ...robot.robot import Robot, robot_from_text
from ...version import __version__
from .certificate import Certificate, certify, configurations
from .chain import UrdfChain, read_chain
from .document import XmlElement, parse_urdf, read_urdf, shown
from .points import points_text
from .quantity import as_rounded_part_of_pi
from .robot_text import robot_file_text
from .table import modified, table_of
from .tree import read_tree

# Largest error of a robot file, as a share of the arm's size; a hundred times the worst of
# thousands of random chains.
ACCEPTED = 1e-10


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
    """

    text: str
    robot: Robot
    certificate: Certificate


TableConvention = Literal['standard', 'modified']


def import_urdf(
    urdf: str | os.PathLike[str],
    base: str,
    tip: str,
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
        Links: they become the base frame and the tool frame.
    name
        Name of the robot; default: that in the URDF.
    convention
        Convention of the table.
    round_angles
        Take an angle for the part of pi whose rounding it is, `1.5708` for pi/2. The certificate
        compares with the file as it is written, and so shows what that changes.
    points
        Links that become points of the robot file; they are fixed to what the chain moves.

    Raises
    ------
    UrdfError
        The file cannot be read, is no URDF, has no such chain, or holds a joint that no robot file
        can express.
    """
    if isinstance(urdf, str) and ('<' in urdf or not urdf.strip()):
        root, origin = parse_urdf(urdf.encode('utf-8'), '<text>'), 'URDF'
    else:
        path = Path(urdf)
        root, origin = read_urdf(path), f'URDF {path.name}'
    tree = read_tree(root)
    chain = read_chain(tree, base, tip)
    for count, most, what in (
        (len(chain.variables), MAX_JOINTS, 'joints'),
        (len(chain.motions), MAX_ROWS, 'rows'),
    ):
        if count > most:
            raise UrdfError(
                f'{root.file}: the way from {shown(base)} to {shown(tip)} has {count} {what}, '
                f'and a robot file at most {most}'
            )

    def way_to(link: str) -> UrdfChain:
        if round_angles:
            return read_chain(tree, base, link, as_rounded_part_of_pi)
        return read_chain(tree, base, link)

    meant = way_to(tip)
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
    section = points_text(robot, meant, points, way_to, ACCEPTED * _size(chain))
    written = text(str(certificate)) + section
    return UrdfImport(written, _robot(root, written), certificate)


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
