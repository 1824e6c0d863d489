"""The command `robots`: the robots that come with the package."""

import sys
from pathlib import Path
from typing import Any

from ..printing import Output, attributes, heading, json_text, plain
from ..robot.bundled import grouped_robots
from ..robot.file.parts.description import JointDescription, RobotDescription
from ..robot.file.reader import read_robot_file
from .options import JsonOption, flag

# The groups that a terminal shows with --all only.
COURSE = (
    'Textbook and course arms',
    'The same arm in several tables',
    'Course arms with closed loops',
)
HEADER = ('robot', 'dof', 'joints', 'convention', 'source')
LETTERS = {'revolute': 'R', 'prismatic': 'P', 'helical': 'H'}


def joint_letters(joints: tuple[JointDescription, ...]) -> str:
    """Return the joints of an arm as letters, base to tool: RRP."""
    return ''.join(LETTERS[joint.type] for joint in joints)


def robots(
    everything: bool = flag('--all', 'Also list the arms of textbooks and courses.'),
    json: JsonOption = False,
) -> None:
    """
    List the robots that come with the package, one per line. Every command takes their names, and
    'new NAME --from ROBOT' makes a file of one.

    In a terminal it lists the machines, and --all adds the arms of textbooks and courses. In a
    file or a pipe it lists all of them.

    \b
    Joints: R revolute, P prismatic, H helical, base to tool.

    \b
    Examples:
      kinematics_service robots
      kinematics_service robots --all
      kinematics_service robots --json

    \b
    The keys of --json, of each object of the list `robots`:
      name, group, file
      dof, joints, convention        joints: the letters above
      source                         where the numbers come from
    """
    found = {
        title: [(name, path, read_robot_file(path)) for name, path in robots.items()]
        for title, robots in grouped_robots().items()
    }
    if json:
        entries = [_entry(title, *one) for title, robots in found.items() for one in robots]
        print(json_text({'robots': entries}))
        return
    out = Output()
    groups = {title: [_row(name, about) for name, _, about in found[title]] for title in found}
    listed = [*groups]
    if sys.stdout.isatty() and not everything:
        listed = [title for title in groups if title not in COURSE]
    table = [HEADER, *(row for title in listed for row in groups[title])]
    widths = [max(map(len, column)) for column in zip(*table)]
    out.print(heading(_line(HEADER, widths, out.width)))
    for title in listed:
        lines = (_line(row, widths, out.width) for row in groups[title])
        out.print('', heading(title), *lines)
    if more := sum(len(rows) for title, rows in groups.items() if title not in listed):
        out.print('', f'{more} more with --all: arms of textbooks and courses')


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
    letters = joint_letters(about.joints)
    return name, str(len(about.joints)), letters, about.convention, _first(about.source)


def _line(row: tuple[str, ...], widths: list[int], width: int) -> str:
    *cells, source = row
    # A line that is too long is shortened at the end of the source, at a comma where there is one.
    room = max(width - sum(widths[:-1]) - 2 * len(cells), len(HEADER[-1]))
    known = ''.join(plain(cell).ljust(wide + 2) for cell, wide in zip(cells, widths))
    if len(source) > room:
        source = source[: room + 1].rpartition(', ')[0] or f'{source[: room - 3]}...'
    return known + plain(source)


def _first(source: str) -> str:
    # The first part of a source names the origin of the numbers; the others are their history.
    return source.partition(';')[0]
