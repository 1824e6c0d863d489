"""The commands: their names, what they are for, and the options of the node."""

import os
import sys
from typing import Annotated

import typer

from .. import kernel
from ..kernel.compiled import VARIABLE
from ..version import __version__
from . import (
    audit,
    check,
    compare,
    derive,
    export,
    fk,
    ik,
    import_urdf,
    jacobian,
    new,
    plot,
    robots,
    ros_commands,
    view,
)
from .node import MIXED_ROS, ROBOT, UNSECURED, NodeOptions, start_node
from .options import WrongUsage

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
app.command(short_help='Check robot files and print what they say.', help=check.HELP)(check.check)
app.command(short_help='Write a robot file to begin with.', help=new.HELP)(new.new)
app.command(short_help='Print the pose of the tool.', help=fk.HELP)(fk.fk)
app.command(short_help='Find joint positions for a pose of the tool.', help=ik.HELP)(ik.ik)
app.command(short_help='Print the Jacobian and the twist of the tool.', help=jacobian.HELP)(
    jacobian.jacobian
)
app.command(short_help='Compare your own formulas with the right ones.', help=compare.HELP)(
    compare.compare
)
app.command(short_help='Derive the kinematics exactly.', help=derive.HELP)(derive.derive)
app.command(short_help='Judge a recording or a planned trajectory.', help=audit.HELP)(audit.audit)
app.command(short_help='Write a robot as URDF.', help=export.HELP)(export.export)
app.command('import', short_help='Make a robot file from a URDF.', help=import_urdf.HELP)(
    import_urdf.import_urdf
)
app.command(short_help='Draw a pose, a path, a map or the workspace.', help=plot.HELP)(plot.plot)
app.command(short_help='List the bundled robots.', help=robots.HELP)(robots.robots)
app.command(short_help='Show the node at work without a robot.', help=ros_commands.DEMO_HELP)(
    ros_commands.demo
)
app.command(short_help='Print what a running node says.', help=ros_commands.ECHO_HELP)(
    ros_commands.echo
)
app.command(short_help='Show the arm live on a web page.', help=view.HELP)(view.view)

WITH_ROS = ('demo', 'echo', 'view')


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f'kinematics_service {__version__}')
        raise typer.Exit()


@app.callback()
def _node(
    context: typer.Context,
    robot: Annotated[
        list[str] | None,
        typer.Option(
            ROBOT,
            metavar='[NAMESPACE=]FILE|NAME',
            help="A robot file, or a bundled robot (see 'robots'). Repeat it to run several "
            'arms in one process, each in its own namespace.',
            show_default='puma560',
        ),
    ] = None,
    allow_unsecured: Annotated[
        bool,
        typer.Option(UNSECURED, help='Start although ROS_SECURITY_ENABLE cannot be honoured.'),
    ] = False,
    allow_mixed_ros: Annotated[
        bool,
        typer.Option(MIXED_ROS, help='Start although two ROS installations are mixed here.'),
    ] = False,
    version: Annotated[
        bool,
        typer.Option(
            '--version', help='Print the version.', callback=_print_version, is_eager=True
        ),
    ] = False,
) -> None:
    command = context.invoked_subcommand
    if command is None:
        options = NodeOptions(robot or [], allow_unsecured, allow_mixed_ros)
        raise typer.Exit(start_node(options, context.obj))
    if robot or allow_unsecured or allow_mixed_ros:
        raise WrongUsage(f"options before a command are the node's: write them after {command!r}")
    if context.obj and command not in WITH_ROS:
        raise WrongUsage(f'{command} takes no --ros-args: it needs no ROS')
    # The node logs this itself, and a user who set the variable knows it.
    if VARIABLE not in os.environ and (notice := kernel.notice()):
        print(f'kinematics_service: {notice}', file=sys.stderr)
