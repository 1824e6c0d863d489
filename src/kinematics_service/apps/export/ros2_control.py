# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write an arm as an ament package for ros2_control: a plugin for `kinematics_interface`.

The package has the header of `export --cpp`, and the files in the folder `ros2_package`. In these
files, placeholders such as @ROBOT@ are replaced by texts about the arm. The plugin knows the base,
the tool and the points of the robot file as links.
"""

from collections.abc import Iterator
from html import escape
from importlib.resources import files
from pathlib import Path

from ...errors import KinematicsError
from ...output_file import write_file
from ...robot.loops import moving_variables
from ...robot.robot import Robot
from ...version import __version__
from .header import filled, function_ends, header_of, quoted

# Names of the template files in the folder `ros2_package`, without their ending `.in`.
TEMPLATES = ('package.xml', 'plugin.xml', 'CMakeLists.txt', 'src/plugin.cpp')


def write_package(robot: Robot, folder: Path) -> str:
    """
    Write an ament package with a plugin for an arm into a folder, and return the package's name.

    If the folder already has this package, its files are replaced. Only `package.xml` stays as it
    is, because users edit this file.

    Raises
    ------
    KinematicsError
        The folder has other files, it cannot be written, or no header can be made of the arm.
    """
    package = package_name(robot)
    texts = package_files(robot)
    try:
        written = folder / 'package.xml'
        if written.exists() and f'<name>{package}</name>' in written.read_text(encoding='utf-8'):
            del texts['package.xml']
        elif folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise KinematicsError(
                f'{folder}: exists and is not the package {package}; give a new or empty folder'
            )
        for name, text in texts.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            write_file(folder / name, text)
    except OSError as error:
        raise KinematicsError(f'{folder}: cannot be written: {error.strerror}') from None
    return package


def package_files(robot: Robot) -> dict[str, str]:
    """
    Return the text of each file of an arm's package, by the path in the package.

    Raises
    ------
    KinematicsError
        No header can be made of the arm.
    """
    package, links = package_name(robot), list(_links(robot))
    values = {
        'PACKAGE': package,
        'ROBOT': robot.name,
        'DOF': str(robot.dof),
        'ABOUT': f'{robot.name}, made by kinematics_service {__version__}',
        'LINK_NAMES': ', '.join(name for name, _ in links),
        'LINKS': ',\n'.join(f'  {{{quoted(name)}, {fields}}}' for name, fields in links),
        'ENTRIES': ', '.join(f'{{{joint}, {row}}}' for joint, row in _entries(robot)),
    }
    in_xml = {key: escape(value) for key, value in values.items()}
    texts = {f'include/{package}/{robot.name}.hpp': header_of(robot, cpp=True)}
    for name in TEMPLATES:
        template = files(__package__).joinpath('ros2_package', f'{name}.in')
        given = in_xml if name.endswith('.xml') else values
        texts[name] = filled(template.read_text(encoding='utf-8'), given)
    return texts


def package_name(robot: Robot) -> str:
    """Return the name of an arm's package; names of packages have no capital letters."""
    return f'kinematics_interface_{robot.name.lower()}'


def _links(robot: Robot) -> Iterator[tuple[str, str]]:
    # Yield a link for the base, for the tool and for each point. Each link has a name, and a text
    # with the other values of the struct `Link` in plugin.cpp.
    yield robot.base_frame, '0, nullptr'
    yield robot.tool_frame, f'{robot.rows}, arm::jacobian'
    ends = function_ends(robot)
    for point in robot.description.points:
        yield point.name, f'{point.row}, arm::jacobian{ends[point.name]}'


def _entries(robot: Robot) -> Iterator[tuple[int, int]]:
    # Yield all pairs (joint, row) of a joint and a row of the table that the joint moves, directly
    # or by a closed loop.
    links = robot.description.links
    for row in range(1, robot.rows + 1):
        moving = moving_variables(robot.description, links[row - 1 : row])
        yield from ((j, row) for j, name in enumerate(robot.variables) if name in moving)
