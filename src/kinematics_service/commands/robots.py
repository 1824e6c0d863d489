"""
The command `robots`: the robots that come with the package.

"""

from rich.text import Text

from ..description import JointDescription
from ..robot import bundled_robots
from .printing import console, plain, table

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
    from ..robot_file import read_robot_file

    lines = table('robot', 'dof', 'joints', 'convention', 'source')
    for column in lines.columns:
        column.no_wrap = True
    lines.columns[-1].overflow = 'ellipsis'
    for name, path in bundled_robots().items():
        description = read_robot_file(path)
        lines.add_row(
            plain(name),
            str(len(description.joints)),
            joint_letters(description.joints),
            description.convention,
            Text(plain(description.source.splitlines()[0] if description.source else '')),
        )
    console().print(lines)
