"""Whether the kernel is compiled, and from which source."""

import copyreg
import functools
import hashlib
import importlib
import os
import sys
from collections.abc import Callable, Sequence
from importlib.machinery import PathFinder
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np

from .layout.arrays import given

# If it is set, to anything, the kernel's source runs as plain Python: for coverage, a debugger,
# and as a second way to compute every number.
VARIABLE = 'KINEMATICS_UNCOMPILED'
_FOLDER = Path(__file__).parent


def use_compiled() -> None:
    """
    Put the compiled modules in the place of the files that they are made of. Not if the
    environment asks for plain Python, or if the source has changed since it was compiled: then
    modules of different versions would mix.
    """
    if is_compiled():
        for module, files in _built().MODULES.items():
            compiled = importlib.import_module(f'.{module}', __package__)
            sys.modules |= {f'{__package__}.{file}': compiled for file in files}


@functools.cache
def is_compiled() -> bool:
    """Return whether the kernel runs compiled."""
    return not os.environ.get(VARIABLE) and _built() is not None and not is_stale()


@functools.cache
def is_stale() -> bool:
    """Return whether there is a compiled kernel, but not of the source beside it."""
    built = _built()
    return built is not None and hash_of(built.FILES) != built.HASH


@functools.cache
def _built() -> Any:
    # What compiled modules were made from, None without them: those of another copy of the
    # package do not count, which an editable installation would find.
    name = f'{__package__}._origin'
    return importlib.import_module(name) if PathFinder.find_spec(name, [str(_FOLDER)]) else None


def as_exported(value: Any) -> Any:
    """
    Return a class, a function or a type of the kernel as the kernel exports it.

    A class is pickled by that name, which is the same compiled and not: a compiled class is known
    by the module that it was joined into. A function of plain Python is as quiet as a compiled
    one: its results tell of overflows and of invalid numbers; numpy would warn, or raise.
    """
    if isinstance(value, FunctionType):
        return _quiet(value)
    if isinstance(value, type) and value.__module__.startswith(f'{__package__}._'):
        try:
            value.__module__ = __package__
        except TypeError:  # that of an extension type is fixed
            copyreg.pickle(value, _reduced)
    return value


def restored(name: str, *arguments: Any) -> Any:
    """Return an object of a class that the kernel exports, as it was pickled."""
    return getattr(sys.modules[__package__], name)(*arguments)


def _reduced(one: Any) -> tuple[Any, ...]:
    return restored, (type(one).__name__, *one.__reduce__()[1])


def _quiet(function: Callable[..., Any]) -> Callable[..., Any]:
    kinds = [kind for name, kind in function.__annotations__.items() if name != 'return']

    @functools.wraps(function)
    def call(*arguments: Any) -> Any:
        for one, kind in zip(arguments, kinds):
            if one is None and isinstance(kind, type):
                given(one)
        with np.errstate(all='ignore'):
            return function(*arguments)

    return call


def hash_of(names: Sequence[str]) -> str:
    """
    Return the hash of the kernel's files of these names as they are now, nothing without them.
    """
    try:
        return hashlib.sha256(
            b''.join((_FOLDER / name).read_bytes() for name in names)
        ).hexdigest()
    except OSError:
        return ''


def notice() -> str:
    """
    Return a warning about the kernel before work begins, with the command that helps. It is empty
    if the kernel runs compiled.
    """
    slowly = 'runs as plain Python, hundreds of times slower'
    if os.environ.get(VARIABLE):
        return f'the kernel {slowly}, since {VARIABLE} is set'
    if is_compiled():
        return ''
    # Imported here, because it takes 60 ms.
    from .reinstallation import command

    if is_stale():
        return (
            'the source of the kernel has changed since it was compiled, so it '
            f'{slowly}; to compile it again: {command()}'
        )
    return f'the kernel is not compiled and {slowly}; to compile it: {command()}'
