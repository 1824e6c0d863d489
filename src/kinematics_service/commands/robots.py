"""
The command `robots`: the robots that come with the package.

"""

from ..bundle import bundled_robots
from ..description import JointDescription
from ..printing import Output, heading, plain
from ..robot_file import read_robot_file

HELP = """
List the robots that come with the package, a line each; any command takes their names.

\b
Joints: R revolute, P prismatic, H helical, base to tool.

\b
Example:
  kinematics_service robots
"""

HEADER = ('robot', 'dof', 'joints', 'convention', 'source')
LETTERS = {'revolute': 'R', 'prismatic': 'P', 'helical': 'H'}


def joint_letters(joints: tuple[JointDescription, ...]) -> str:
    """
    Return the joints of an arm as letters, base to tool: RRP.

    """
    return ''.join(LETTERS[joint.type] for joint in joints)


def robots() -> None:
    """
    Run the command; `HELP` is what its user reads.

    """
    out = Output()
    rows = [HEADER]
    for name, path in bundled_robots().items():
        about = read_robot_file(path)
        letters = joint_letters(about.joints)
        rows.append(
            (name, str(len(about.joints)), letters, about.convention, _first(about.source))
        )
    widths = [max(map(len, column)) for column in zip(*rows)]
    # What does not fit on a line is left out at the end of the source, and nowhere else.
    room = max(out.width - sum(widths[:-1]) - 2 * len(widths[:-1]), len(HEADER[-1]))
    for i, (*cells, source) in enumerate(rows):
        known = ''.join(plain(cell).ljust(width + 2) for cell, width in zip(cells, widths))
        cut = source if len(source) <= room else f'{source[: room - 3]}...'
        line = known + plain(cut)
        out.print(line if i else heading(line))


def _first(source: str) -> str:
    # The first part of a source is where the numbers are from; the others are their history.
    return source.partition(';')[0]
