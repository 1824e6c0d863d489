"""The command `robots`: the robots that come with the package."""

from ..printing import Output, heading, plain
from ..robot.bundled import grouped_robots
from ..robot.file.parts.description import JointDescription, RobotDescription
from ..robot.file.reader import read_robot_file

HELP = """
List the robots that come with the package, one per line; any command takes their names, and
'new NAME --from ROBOT' makes a file of one.

\b
Joints: R revolute, P prismatic, H helical, base to tool.

\b
Example:
  kinematics_service robots
"""

HEADER = ('robot', 'dof', 'joints', 'convention', 'source')
LETTERS = {'revolute': 'R', 'prismatic': 'P', 'helical': 'H'}


def joint_letters(joints: tuple[JointDescription, ...]) -> str:
    """Return the joints of an arm as letters, base to tool: RRP."""
    return ''.join(LETTERS[joint.type] for joint in joints)


def robots() -> None:
    """Run the command; `HELP` is what its user reads."""
    out = Output()
    groups = {
        title: [_row(name, read_robot_file(path)) for name, path in robots.items()]
        for title, robots in grouped_robots().items()
    }
    everything = [HEADER, *(row for rows in groups.values() for row in rows)]
    widths = [max(map(len, column)) for column in zip(*everything)]
    out.print(heading(_line(HEADER, widths, out.width)))
    for title, rows in groups.items():
        out.print('', heading(title), *(_line(row, widths, out.width) for row in rows))


def _row(name: str, about: RobotDescription) -> tuple[str, ...]:
    letters = joint_letters(about.joints)
    return name, str(len(about.joints)), letters, about.convention, _first(about.source)


def _line(row: tuple[str, ...], widths: list[int], width: int) -> str:
    *cells, source = row
    # A line that is too long is shortened at the end of the source, and nowhere else.
    room = max(width - sum(widths[:-1]) - 2 * len(cells), len(HEADER[-1]))
    known = ''.join(plain(cell).ljust(wide + 2) for cell, wide in zip(cells, widths))
    return known + plain(source if len(source) <= room else f'{source[: room - 3]}...')


def _first(source: str) -> str:
    # The first part of a source names the origin of the numbers; the others are their history.
    return source.partition(';')[0]
