# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The kernel: the code that runs for each message and target. Installing the package compiles it.

If the kernel is not compiled, each name is imported when it is first used. So a process that only
needs the Jacobian does not load inverse kinematics. The compiled kernel imports all modules at
once.
"""

from importlib import import_module

from . import compiled
from .layout.places import *  # noqa: F403

compiled.use_compiled()

# Read the exported names and their modules from the stub `__init__.pyi`, which type checkers read
# too. Each line of the stub is `from .module import name as name`.
with open(f'{__path__[0]}/__init__.pyi', encoding='utf-8') as _stub:  # noqa: F405
    _LINES = [_line.split() for _line in _stub if ' as ' in _line]
_HOME = {_words[-1]: (_words[1], _words[3]) for _words in _LINES}


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    module, original = _HOME[name]
    value = getattr(import_module(module, __name__), original)
    # If the kernel runs as plain Python, `as_exported` wraps each function, so that the function
    # behaves like the compiled one. The build never compiles the module `compiled`, so its
    # functions need no wrapper.
    globals()[name] = value if module == '.compiled' else compiled.as_exported(value)
    return globals()[name]


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})


if compiled.is_compiled():
    for _name in _HOME:
        __getattr__(_name)
