"""The command line: its commands, and what becomes of errors."""

import io
import os
import sys
import traceback
from collections.abc import Sequence
from typing import Annotated, Optional

import typer
import typer.core

from .. import kernel
from ..errors import KinematicsError
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
from .arguments import join_numbers, split_ros_arguments
from .options import WrongUsage

HELP = """
Pose, Jacobian, twist and singularity warning of any arm given by its Denavit-Hartenberg table.

Without a command: the ROS 2 node. It hears joint_states and answers on ~/pose, ~/jacobian,
~/twist, ~/singularity/warning and others. Arguments from --ros-args on are ROS's own.

\b
Examples:
  kinematics_service --robot puma560
  kinematics_service --robot arm.yaml --ros-args -r __ns:=/left
  kinematics_service --robot left=ur5e --robot right=ur5e
  kinematics_service check arm.yaml
  kinematics_service COMMAND --help
"""

# typer before 0.12 asks nobody whether help and errors shall stand in boxes.
typer.core.rich = None  # type: ignore[attr-defined]


class CommandGroup(typer.core.TyperGroup):
    """The commands; Ctrl-C ends each with the exit code of that signal, under every typer."""

    def invoke(self, ctx: typer.Context) -> object:  # type: ignore[override]
        """Run the command."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise typer.Exit(130) from None


app = typer.Typer(
    cls=CommandGroup,
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
        Optional[list[str]],
        typer.Option(
            metavar='[NAMESPACE=]FILE|NAME',
            help="A robot file, or a bundled robot (see 'robots'). Several times: several arms in "
            'one process, each in its own namespace.',
            show_default='puma560',
        ),
    ] = None,
    allow_unsecured: Annotated[
        bool,
        typer.Option(
            '--allow-unsecured', help='Start although ROS_SECURITY_ENABLE cannot be honoured.'
        ),
    ] = False,
    allow_mixed_ros: Annotated[
        bool,
        typer.Option(
            '--allow-mixed-ros', help='Start although two ROS installations are mixed here.'
        ),
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
        ros_commands.node(robot or [], context.obj, allow_unsecured, allow_mixed_ros)
        return
    if robot or allow_unsecured or allow_mixed_ros:
        raise WrongUsage(f"options before a command are the node's: write them after {command!r}")
    if context.obj and command not in WITH_ROS:
        raise WrongUsage(f'{command} takes no --ros-args: it needs no ROS')
    # The node logs it; who asked for it knows it.
    if VARIABLE not in os.environ and (notice := kernel.notice()):
        print(f'kinematics_service: {notice}', file=sys.stderr)


def run(argv: Sequence[str] | None = None) -> int:
    """
    Run a command line and return its exit code: 0, 1 for a failure, 2 for wrong usage.

    Parameters
    ----------
    argv
        Without the program's name; default: that of this process.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors='replace')  # rather '?' than no answer
    ours, ros = split_ros_arguments(sys.argv[1:] if argv is None else argv)
    try:
        app(join_numbers(ours), obj=ros)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 0
    except KinematicsError as error:
        return _failed(str(error))
    except ros_commands.RosMissingError as error:
        return _failed(f'kinematics_service: {error}')
    except Exception as error:
        text = ' '.join(f'{type(error).__name__}: {error}'.split())
        return _failed(f'kinematics_service: {text} (set KINEMATICS_TRACEBACK=1 for the details)')
    return 0


def _failed(sentence: str) -> int:
    if os.environ.get('KINEMATICS_TRACEBACK'):
        traceback.print_exc()
    print(sentence, file=sys.stderr)
    return 1
