"""
The command `robots`: the robots that come with the package.

"""

from ..description import JointDescription
from ..robot import bundled_robots
from .printing import Output, plain, table

HELP = """
List the robots that come with the package, a line each; any command takes their names.

\b
Joints: R revolute, P prismatic, H helical, base to tool.

\b
Example:
  kinematics_service robots
"""

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
    from ..robot_file import read_robot_file

    lines = table('robot', 'dof', 'joints', 'convention', 'source')
    for name, path in bundled_robots().items():
        description = read_robot_file(path)
        lines.add_row(
            plain(name),
            str(len(description.joints)),
            joint_letters(description.joints),
            description.convention,
            plain(description.source.partition(';')[0]),
        )
    # What does not fit on a line is left out at the end of the source, and nowhere else.
    *others, source = lines.columns
    source.no_wrap, source.overflow = True, 'ellipsis'
    for column in others:
        column.min_width = max(len(str(cell)) for cell in (column.header, *column.cells))
    Output().print(lines)
