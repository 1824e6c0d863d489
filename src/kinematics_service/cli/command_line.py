"""The command line: its commands, and what becomes of errors."""

import io
import os
import pkgutil
import sys
import traceback
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer
from typer.models import CommandInfo

from .. import kernel
from ..errors import KinematicsError
from ..kernel.compiled import VARIABLE
from ..version import __version__
from .application import app
from .arguments import join_numbers, split_ros_arguments
from .options import WrongUsage
from .run_node import RosMissingError, node

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
    'export',
    'import',
    'plot',
    'robots',
    'demo',
    'echo',
    'view',
)
# Those that hand on the arguments of ROS.
WITH_ROS = ('demo', 'echo', 'view')


def _collect_commands() -> None:
    # Each file of this folder that is a command adds itself to the application.
    for module in pkgutil.iter_modules([str(Path(__file__).parent)]):
        import_module(f'.{module.name}', __package__)
    order = {name: place for place, name in enumerate(ORDER)}
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
        list[str] | None,
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
        node(robot or [], context.obj, allow_unsecured, allow_mixed_ros)
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
    except RosMissingError as error:
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
