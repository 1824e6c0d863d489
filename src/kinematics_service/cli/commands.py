"""All commands, found in the files of this folder, and the options of the node."""

import os
import pkgutil
import sys
from importlib import import_module
from pathlib import Path
from typing import Annotated, Optional

import typer
from typer.models import CommandInfo

from .. import kernel
from ..kernel.compiled import VARIABLE
from ..version import __version__
from .application import app
from .node import MIXED_ROS, ROBOT, UNSECURED, NodeOptions, start_node
from .options import WrongUsage

__all__ = ['app']

# The commands in the order of the help; one that does not stand here comes after them.
ORDER = (
    'check',
    'new',
    'fk',
    'ik',
    'jacobian',
    'compare',
    'derive',
    'audit',
    'calibrate',
    'export',
    'import',
    'plot',
    'robots',
    'demo',
    'echo',
    'view',
)
# Those that hand on the arguments of ROS.
WITH_ROS = ('calibrate', 'demo', 'echo', 'view')


def _collect_commands() -> None:
    # Each file of this folder that is a command adds itself to the application.
    for module in pkgutil.iter_modules([str(Path(__file__).parent)]):
        import_module(f'.{module.name}', __package__)
    order = {name: index for index, name in enumerate(ORDER)}
    app.registered_commands.sort(key=lambda one: order.get(_name_of(one), len(ORDER)))


def _name_of(command: CommandInfo) -> str:
    # What a user writes.
    return str(command.name or getattr(command.callback, '__name__', ''))


_collect_commands()


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
