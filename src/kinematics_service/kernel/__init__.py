"""
The kernel: the computations for every message, compiled when the package is installed.

Each name is imported when it is first used: a process that needs the Jacobian alone does not load
inverse kinematics. Compiled, all modules are there at once.
"""

from importlib import import_module

from . import compiled
from .layout.places import *  # noqa: F403

compiled.use_compiled()

# The exported names and their modules are written once, in the stub, for type checkers and for
# this: each line is `from .module import name as name`.
with open(f'{__path__[0]}/__init__.pyi', encoding='utf-8') as _stub:  # noqa: F405
    _LINES = [_line.split() for _line in _stub if ' as ' in _line]
_HOME = {_words[-1]: (_words[1], _words[3]) for _words in _LINES}


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    module, original = _HOME[name]
    value = getattr(import_module(module, __name__), original)
    # Functions of `compiled` are plain Python in both cases.
    globals()[name] = value if module == '.compiled' else compiled.as_exported(value)
    return globals()[name]


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})


if compiled.is_compiled():
    for _name in _HOME:
        __getattr__(_name)
