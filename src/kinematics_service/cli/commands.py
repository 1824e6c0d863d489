# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define all commands, and the options of the node. The file of a command is loaded at its use."""

import difflib
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from inspect import cleandoc
from typing import Annotated, Any, Optional

import typer
import typer.core

from .. import kernel
from ..app_modules import has_app
from ..kernel.compiled import VARIABLE
from ..version import __version__
from .node import MANAGED, MIXED_ROS, ROBOT, UNSECURED, NodeOptions, start_node
from .options import WrongUsage, flag, named, option

# The commands in groups, in the order of the help. The file of a command is in this folder or in
# the folder `commands` of an app. The file has a function with the name of the command (_ for -).
# The parameters of the function are the arguments and options of the command. The docstring of the
# function is the help.
GROUPS = {
    'Start': {
        'demo': 'Show the node at work without a robot.',
        'robots': 'List the bundled robots.',
        'new': 'Write a robot file from a table, or an example.',
        'check': 'Check robot files and print what they say.',
    },
    'Ask': {
        'fk': 'Print the pose of the tool.',
        'ik': 'Find joint positions for a pose of the tool.',
        'jacobian': 'Print the Jacobian and the twist of the tool.',
    },
    'Live': {
        'echo': 'Print what a running node says.',
        'set': 'Set a parameter of a running node.',
        'reload': 'Let a running node read its robot file again.',
        'view': 'Show the arm live on a web page.',
    },
    'Study': {
        'derive': 'Derive the kinematics exactly.',
        'compare': 'Compare your own formulas with the right ones.',
        'plot': 'Draw a pose, a path, a map or the workspace.',
    },
    'Judge': {'audit': 'Judge a recording or a planned trajectory.'},
    'Calibrate': {
        'calibrate': "Identify an arm's numbers from measured poses.",
        'calibrate-touch': 'The same from points that the tip of the tool touched.',
        'calibrate-zeros': 'Find the zeros of joints with a printed sheet.',
        'calibrate-camera': 'Calibrate arm and camera by a board.',
        'calibrate-live': 'Calibrate a running robot.',
        'calibrate-propose': 'Propose the poses to measure next.',
    },
    'Convert': {
        'import': 'Make a robot file from a URDF or a factory calibration.',
        'export': 'Write a robot as URDF, C++, C or ROS 2 plugin.',
    },
}
COMMANDS = {name: words for group in GROUPS.values() for name, words in group.items()}
# Width of the longest command name. Names are padded to this width, so that all groups are
# aligned.
NAME_WIDTH = max(map(len, COMMANDS))
# Options that --help hides and --help-all shows.
RARE_OPTIONS = {
    '--allow-host', '--allow-mixed-ros', '--allow-unsecured', '--anyway', '--axis',
    '--clearance', '--fix', '--frames', '--gravity', '--install-completion',
    '--joint-prefix', '--labels', '--load', '--load-at', '--managed', '--own', '--points',
    '--pose-gap', '--pose-stop', '--pose-warn', '--reduced', '--seed', '--servo', '--sessions',
    '--show-completion', '--speed-of', '--stop', '--tolerance', '--velocity-source',
    '--verbose', '--warn', '--workers',
}  # fmt: skip
# For each command of an app, the folder of the app in `apps`. Other commands belong to the core.
APPS = {
    'check': 'checking',
    'compare': 'formulas',
    'derive': 'formulas',
    'audit': 'recordings',
    **{name: 'calibration' for name in COMMANDS if name.startswith('calibrate')},
    'plot': 'pictures',
    'demo': 'demo',
    'echo': 'demo',
    'view': 'pictures',
    'export': 'export',
}
for _command, _app in APPS.items():
    if not has_app(_app):
        del COMMANDS[_command]
# Largest width of a help text, in columns.
WIDE = {'max_content_width': 100}
# Names of the Python functions that run the commands `import` and `set`. A function cannot have
# the name `import`, a keyword of Python. A function `set` would hide the built-in type `set`.
RENAMED = {'import': 'import_urdf', 'set': 'set_parameter'}
# Commands that take ROS arguments.
WITH_ROS = ('calibrate-live', 'demo', 'echo', 'reload', 'set', 'view')
# Commands whose first argument is a robot; they accept the robot by --robot as well.
ROBOT_FIRST = ('check', 'compare', 'derive', 'export', 'plot')
# For each command, the option that gets the first argument if the user writes the argument without
# an option.
FIRST_OPTION = {
    **dict.fromkeys(('demo', 'fk', 'ik', 'jacobian', 'view'), ROBOT),
    'import': '--urdf',
}
# Texts in typer's messages about wrong values, each with the text that replaces it.
TYPER_WORDS = {
    'Value error, ': '',
    'Input should be a valid integer, unable to parse string as an integer': 'not a whole number',
    'Input should be a valid number, unable to parse string as a number': 'not a number',
    'Input should be ': 'not ',
}

# Print help and errors without boxes. This assignment is needed because typer before 0.12 has no
# setting for it.
typer.core.rich = None  # type: ignore[attr-defined]


def short_help(words: str) -> str:
    """
    Return the help of a command up to and including its first paragraph of examples.

    If the help has no examples, return the whole help.
    """
    parts = words.split('\n\n')
    examples = (k for k, part in enumerate(parts) if part.lstrip('\b\n').startswith('Example'))
    return '\n\n'.join(parts[: next(examples, len(parts)) + 1])


def show_everything(command: Any) -> None:
    """
    Change a command, or the group of commands, so that its help shows details and rare options.
    """
    command.help = command.whole_help
    for parameter in command.params:
        parameter.hidden = False


def _print_everything(context: typer.Context, is_given: bool) -> None:
    if is_given and not context.resilient_parsing:
        show_everything(context.command)
        print(context.get_help())
        raise typer.Exit()


def _with_help_all(
    help_all: Annotated[
        bool,
        named(
            '--help-all',
            'Show all options and details, and exit.',
            is_eager=True,
            expose_value=False,
            callback=_print_everything,
        ),
    ] = False,
) -> None:
    """Do nothing. typer makes the option `--help-all` from the parameter of this function."""


def with_short_help(command: Any) -> Any:
    """Return the command with a short help and the option `--help-all`."""
    command.whole_help = cleandoc(command.help or '')
    command.help = short_help(command.whole_help)
    for parameter in command.params:
        parameter.hidden = not RARE_OPTIONS.isdisjoint(parameter.opts)
    alone = typer.Typer(add_completion=False)
    alone.command()(_with_help_all)
    command.params += typer.main.get_command(alone).params
    return command


# The arguments of the methods have the type Any, because some versions of typer have their own
# copies of click's classes.
class CommandGroup(typer.core.TyperGroup):
    """
    The group of all commands, with equal behaviour in every version of typer.

    Ctrl-C ends each command with the exit code of the signal. The error for an unknown command
    lists all commands.
    """

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of the commands in the order of the help."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Load the file of a command, and return the command; None for an unknown name."""
        if cmd_name not in COMMANDS:
            return None
        name = RENAMED.get(cmd_name, cmd_name.replace('-', '_'))
        module = import_module(f'{home_of(cmd_name)}.{name}')
        alone = typer.Typer(add_completion=False, rich_markup_mode=None)
        command = getattr(module, name)
        words = f'{cleandoc(command.__doc__ or "")}\n{getattr(module, "HELP_ENDS", "")}'
        # The command `set` takes values such as -1, which look like options.
        settings = {**WIDE, 'ignore_unknown_options': cmd_name == 'set'}
        alone.command(cmd_name, help=words, context_settings=settings)(command)
        return with_short_help(typer.main.get_command(alone))

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the list of commands in groups, without loading the files of the commands."""
        for group, commands in GROUPS.items():
            rows = [
                (name.ljust(NAME_WIDTH), words)
                for name, words in commands.items()
                if name in COMMANDS
            ]
            if rows:
                with formatter.section(group):
                    formatter.write_dl(rows)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """
        Return the name and the object of the command that the first argument names, and the other
        arguments.
        """
        name, others = args[0], args[1:]
        if name not in COMMANDS and not name.startswith('-'):
            near = difflib.get_close_matches(name, COMMANDS, n=1)
            suggestion = f', did you mean {near[0]!r}?' if near else ''
            ctx.fail(f'unknown command {name!r}{suggestion} (commands: {", ".join(COMMANDS)})')
        if name in ROBOT_FIRST:
            others = robot_first(others)
        if name in FIRST_OPTION and others and not others[0].startswith('-'):
            others = [FIRST_OPTION[name], *others]
        return super().resolve_command(ctx, [name, *others])

    def invoke(self, ctx: typer.Context) -> object:  # type: ignore[override]
        """Run the command; exit with code 130 at Ctrl-C, and replace texts of typer's messages."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise typer.Exit(130) from None
        except typer.BadParameter as error:
            for typers, plain in TYPER_WORDS.items():
                error.message = error.message.replace(typers, plain)
            # If an argument is missing, typer's error has no message. Then the message is the help
            # text of the argument.
            error.message = error.message or getattr(error.param, 'help', None) or ''
            raise


def home_of(command: str) -> str:
    """Return the name of the package that contains the file of a command."""
    root = __package__.partition('.')[0]
    return f'{root}.apps.{APPS[command]}.commands' if command in APPS else f'{root}.cli'


def robot_first(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with the values of `--robot` moved before all other arguments."""
    robots, others = list[str](), list[str]()
    words = iter(arguments)
    for word in words:
        name, equals, robot = word.partition('=')
        if name != ROBOT:
            others.append(word)
            continue
        robot = robot if equals else next(words, '')
        if not robot or robot.startswith('-'):
            message = f'{ROBOT}: write a robot file or the name of a bundled robot after it'
            raise WrongUsage(message)
        robots.append(robot)
    return [*robots, *others]


app = typer.Typer(
    cls=CommandGroup,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    invoke_without_command=True,
    context_settings={'help_option_names': ['-h', '--help']},
)


def _print_version(is_given: bool) -> None:
    if is_given:
        print(f'kinematics_service {__version__}')
        raise typer.Exit()


@app.callback()
def _node(
    context: typer.Context,
    robot: Optional[list[str]] = option(
        "A robot file, a cell, a URDF, or a bundled robot (see 'robots'). Repeat it to run "
        'several arms in one process, each in its own namespace.',
        '[NAMESPACE=]FILE|NAME',
        name=ROBOT,
        shown='puma560',
    ),
    allow_unsecured: bool = flag(
        UNSECURED, 'Start although ROS_SECURITY_ENABLE has no effect here.'
    ),
    allow_mixed_ros: bool = flag(
        MIXED_ROS, 'Start although two ROS installations are mixed here.'
    ),
    managed: bool = flag(
        MANAGED, 'Start as a lifecycle node: it works after configure and activate.'
    ),
    version: Annotated[
        bool, named('--version', 'Print the version.', callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """
    Pose, Jacobian, twist and singularity warning of any arm given by its Denavit-Hartenberg table.

    Without a command the ROS 2 node starts. It listens to joint_states and publishes ~/pose,
    ~/jacobian, ~/twist, ~/singularity/warning and others. Arguments from --ros-args on are ROS's
    own.

    \b
    Examples:
      kinematics_service --robot puma560
      kinematics_service --robot arm.urdf --base base_link --tip tool0
      kinematics_service --robot-description    (the URDF on /robot_description)
      kinematics_service --robot arm.yaml --ros-args -r __ns:=/left
      kinematics_service --robot left=ur5e --robot right=ur5e
      kinematics_service check arm.yaml
      kinematics_service COMMAND --help

    --robot-description [TOPIC] takes the URDF that the robot itself publishes, usually on
    /robot_description, and each newer URDF. --base LINK and --tip LINK choose the arm of a URDF.
    If you give neither, the arm is the longest chain of joints, without the joints of a hand.
    """
    command = context.invoked_subcommand
    if command is None:
        options = NodeOptions(robot or [], allow_unsecured, allow_mixed_ros, managed)
        raise typer.Exit(start_node(options, context.obj))
    if robot or allow_unsecured or allow_mixed_ros or managed:
        message = f'options before a command belong to the node; write them after {command!r}'
        raise WrongUsage(message)
    if context.obj and command not in WITH_ROS:
        raise WrongUsage(f'{command} takes no --ros-args: it needs no ROS')
    # Print a notice if the kernel is not compiled, unless the user chose the uncompiled kernel by
    # the environment variable VARIABLE. The node logs the notice itself.
    if VARIABLE not in os.environ and (notice := kernel.notice()):
        print(f'kinematics_service: {notice}', file=sys.stderr)


def command_group() -> Any:
    """
    Return one click command that contains all commands and the node. Its option `--help` prints a
    short help, `--help-all` the whole help.
    """
    return with_short_help(typer.main.get_command(app))
