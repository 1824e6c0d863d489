# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Kinematics of any arm given by its Denavit-Hartenberg table: a library and a ROS 2 node.

The library does not need ROS. Its main functions are `load_robot`, `forward_kinematics`,
`jacobian`, `twist` and `singularity`.

Each name is imported at its first use, so that the command line prints `--help`, and reacts to
Ctrl-C, before the kernel is loaded.
"""

# Import the C module `_signal`, not `signal`, because `_signal` loads at once. Loading `signal`
# takes longer, and Ctrl-C during this time would print a traceback.
import _signal
import sys

# If the process is a command, give SIGINT its default action, so that Ctrl-C ends the command
# without a traceback. This is done here because Python runs this file before `__main__`.
_program = sys.argv[0] if sys.argv else ''
_is_command = (_program == '-m' and __name__ in sys.orig_argv) or _program.endswith(f'/{__name__}')
if _is_command and _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:
    _signal.signal(_signal.SIGINT, _signal.SIG_DFL)

from importlib import import_module  # noqa: E402

# Type checkers read the public names and their modules from a stub file. Read the same file here
# instead of a second list. Each line of the stub is `from .module import name as name`.
with open(f'{__path__[0]}/__init__.pyi', encoding='utf-8') as _stub:
    _HOME = {_line.split()[-1]: _line.split()[1] for _line in _stub}

__all__ = list(_HOME)

from .robot.file.translation import TRANSLATORS, RobotText  # noqa: E402


def _translate_urdf(content: bytes, file: str, base: str, tip: str) -> RobotText:
    from .robot.urdf.importer import urdf_as_robot_file  # load the importer only for a URDF

    return urdf_as_robot_file(content, file, base, tip)


TRANSLATORS.update(dict.fromkeys(('.urdf', '.xacro', '.xml'), _translate_urdf))


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    value = getattr(import_module(_HOME[name], __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(_HOME)
