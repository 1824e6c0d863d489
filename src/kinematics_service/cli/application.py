"""The application that each command's file adds its command to."""

import typer

HELP = """
Pose, Jacobian, twist and singularity warning of any arm given by its Denavit-Hartenberg table.

Without a command the ROS 2 node starts. It listens to joint_states and publishes ~/pose,
~/jacobian, ~/twist, ~/singularity/warning and others. Arguments from --ros-args on are ROS's own.

\b
Examples:
  kinematics_service --robot puma560
  kinematics_service --robot arm.yaml --ros-args -r __ns:=/left
  kinematics_service --robot left=ur5e --robot right=ur5e
  kinematics_service check arm.yaml
  kinematics_service COMMAND --help
"""

app = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    invoke_without_command=True,
    help=HELP,
    context_settings={'help_option_names': ['-h', '--help']},
)
