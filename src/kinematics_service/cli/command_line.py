# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Run a command line; print each error as a sentence, and return an exit code."""

import io
import os
import sys
import traceback
from collections.abc import Sequence
from contextlib import nullcontext, suppress
from typing import Any

from .. import errors
from ..stop_signals import interruptible
from .arguments import WrongArguments, join_numbers, name_robots, split_ros_arguments
from .missing_ros import RosMissingError
from .node import plain_options, start_node
from .ros_variables import RosVariableError
from .standard_output import checked_output

# Exit code if the process that reads the output through a pipe has ended. The number is 128 +
# SIGPIPE, as in a shell.
READER_GONE = 141
# Value of the key `code` in the JSON object for an error in the use of the command line.
WRONG_USAGE = 'wrong-usage'
# Name of the installed program. A shell sets the environment variable COMPLETION_VARIABLE to
# request completions. The options COMPLETION_OPTIONS install or print the completion script of a
# shell.
PROGRAM = 'kinematics_service'
COMPLETION_OPTIONS = ('--install-completion', '--show-completion')
COMPLETION_VARIABLE = f'_{PROGRAM.upper()}_COMPLETE'


def run(argv: Sequence[str] | None = None) -> int:
    """
    Run a command line and return the exit code: 0, 1 for a failure, 2 for wrong usage, 141 if the
    process that reads the output has ended.

    Parameters
    ----------
    argv
        The arguments without the program's name; default: those of this process.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # Print '?' for each character that the encoding of the stream lacks.
            stream.reconfigure(errors='replace')
    if argv is not None:
        return _code_of(argv)
    output = sys.stdout or open(os.devnull, 'w')  # noqa: SIM115, of this process
    with suppress(OSError):
        sys.stdout = checked_output(output)
    code = _code_of(None)
    try:
        sys.stdout.flush()
    except errors.KinematicsError as error:
        return _failed(str(error))
    except BrokenPipeError:
        return READER_GONE
    return code


def _code_of(argv: Sequence[str] | None) -> int:
    ours, ros = split_ros_arguments(sys.argv[1:] if argv is None else argv)
    try:
        if ours[:1] != ['import']:  # the command `import` has its own options --base and --tip
            ours = name_robots(ours)
        completion = COMPLETION_VARIABLE in os.environ or any(
            word.startswith(COMPLETION_OPTIONS) for word in ours
        )
        options = None if completion else plain_options(ours)
        if options is not None:
            # Do not use `interruptible` for the node, because the node handles signals itself.
            return start_node(options, ros)
        # Import the commands only here, because the node does not need typer and starts faster
        # without it. During the import, Ctrl-C has its default action.
        from .commands import command_group

        if fault := _typer_fault():
            return _failed(f'kinematics_service: {fault}')
        with nullcontext() if argv is not None else interruptible():
            command_group()(join_numbers(ours), obj=ros, prog_name=PROGRAM if completion else None)
        return 0
    except SystemExit as end:
        # click turns a BrokenPipeError into SystemExit with code 1. The BrokenPipeError is in the
        # context of the exception.
        if isinstance(end.__context__, BrokenPipeError):
            return READER_GONE
        # typer has printed the message on standard error. If the user gave the flag --json, print
        # the message as JSON too.
        if (message := getattr(end.__context__, 'format_message', None)) and _wants_json(ours):
            _print_error(WRONG_USAGE, message())
        return end.code if isinstance(end.code, int) else 0
    except (errors.RobotConflictError, errors.ArmsError) as error:
        return _refused(error, ours, 2)
    except errors.KinematicsError as error:
        return _refused(error, ours)
    except RosMissingError as error:
        return _failed(f'kinematics_service: {error}')
    except (RosVariableError, WrongArguments) as error:
        return _failed(f'kinematics_service: {error}', 2)
    except Exception as error:
        text = ' '.join(f'{type(error).__name__}: {error}'.split())
        return _failed(f'kinematics_service: {text} (set KINEMATICS_TRACEBACK=1 for the details)')


def _typer_fault() -> str | None:
    # Return a sentence if typer is too old for click. With typer before 0.13 and click 8.3 or
    # newer, typer behaves as if the user had typed every flag, also --version. So any command
    # would only print the version.
    import typer

    if tuple(map(int, typer.__version__.split('.')[:2])) >= (0, 13):
        return None
    from importlib.metadata import version

    if tuple(map(int, version('click').split('.')[:2])) < (8, 3):
        return None
    message = f'typer {typer.__version__} cannot read options with click {version("click")}'
    return f"{message}: pip install 'typer>=0.13', or pip install 'click<8.3'"


def _refused(error: errors.KinematicsError, ours: Sequence[str], code: int = 1) -> int:
    if _wants_json(ours):
        faults = error.faults if isinstance(error, errors.RobotFileError) else ()
        if isinstance(error, errors.UrdfError):
            faults = (error.fault,)
        _print_error(error.code, str(error), faults)
    return _failed(str(error), code)


def _print_error(code: str, message: str, faults: Sequence[errors.Fault] = ()) -> None:
    from ..printing import attributes, json_text

    entry: dict[str, Any] = {'code': code, 'message': message}
    if faults:
        fields = ('file', 'line', 'where', 'message', 'code')
        entry['faults'] = [attributes(fault, *fields) for fault in faults]
    print(json_text({'error': entry}))


def _wants_json(ours: Sequence[str]) -> bool:
    # Return whether the user gave the flag --json to a command that has this flag. In other
    # commands, the option --json takes the name of a file.
    if '--json' not in ours:
        return False
    from .commands import command_group

    command = command_group().get_command(None, ours[0])
    options = command.params if command else ()
    return any('--json' in option.opts and option.is_flag for option in options)


def _failed(sentence: str, code: int = 1) -> int:
    if os.environ.get('KINEMATICS_TRACEBACK'):
        traceback.print_exc()
    print(sentence, file=sys.stderr)
    return code
