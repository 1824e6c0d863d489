# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `robots`: list the bundled robots."""

from pathlib import Path
from typing import Any

from ..printing import Output, attributes, heading, json_text, plain
from ..robot.bundled import grouped_robots
from ..robot.file.parts.description import JointDescription, RobotDescription
from ..robot.file.reader import read_robot_file
from .options import JsonOption

HEADER = ('robot', 'dof', 'joints', 'convention', 'source')


def joint_letters(joints: tuple[JointDescription, ...]) -> str:
    """Return the joint types of an arm as letters, from base to tool, such as RRP."""
    return ''.join(joint.type[0].upper() for joint in joints)


def robots(
    json: JsonOption = False,
) -> None:
    """
    List the robots that come with the package, one per line. Every command accepts these names,
    and 'new NAME --from ROBOT' copies the file of a robot.

    \b
    Joints: R revolute, P prismatic, H helical, base to tool.

    \b
    Examples:
      kinematics_service robots
      kinematics_service robots --json

    \b
    The keys of --json, of each object of the list `robots`:
      name, group, file
      dof, joints, convention        joints: the letters above
      source                         where the numbers come from
    """
    bundled = {
        title: [(name, path, read_robot_file(path)) for name, path in robots.items()]
        for title, robots in grouped_robots().items()
    }
    if json:
        entries = [_entry(title, *robot) for title, robots in bundled.items() for robot in robots]
        print(json_text({'robots': entries}))
        return
    out = Output()
    groups = {title: [_row(name, about) for name, _, about in bundled[title]] for title in bundled}
    table = [HEADER, *(row for rows in groups.values() for row in rows)]
    widths = [max(map(len, column)) for column in zip(*table)]
    out.print(heading(_line(HEADER, widths, out.width)))
    for title, rows in groups.items():
        out.print('', heading(title), *(_line(row, widths, out.width) for row in rows))


def _entry(title: str, name: str, file: Path, about: RobotDescription) -> dict[str, Any]:
    return {
        'name': name,
        'group': title,
        'file': str(file),
        'dof': len(about.joints),
        'joints': joint_letters(about.joints),
        **attributes(about, 'convention', 'source'),
    }


def _row(name: str, about: RobotDescription) -> tuple[str, ...]:
    # Show only the first part of the key `source`, which names the origin of the numbers, because
    # other parts describe later changes.
    letters = joint_letters(about.joints)
    return name, str(len(about.joints)), letters, about.convention, about.source.partition(';')[0]


def _line(row: tuple[str, ...], widths: list[int], width: int) -> str:
    *cells, source = row
    # If a source is too long for the column, cut it at the last comma that fits, or else at the
    # width of the column.
    room = max(width - sum(widths[:-1]) - 2 * len(cells), len(HEADER[-1]))
    line = ''.join(plain(cell).ljust(wide + 2) for cell, wide in zip(cells, widths))
    if len(source) > room:
        source = source[: room + 1].rpartition(', ')[0] or f'{source[: room - 3]}...'
    return line + plain(source)
