# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Import the compiled kernel, or decide that its source runs as plain Python."""

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

# Name of an environment variable. If the variable is set to any text, the kernel's source runs as
# plain Python. Use it to measure coverage, to debug, or to check numbers of the compiled kernel.
VARIABLE = 'KINEMATICS_UNCOMPILED'
_FOLDER = Path(__file__).parent


def use_compiled() -> None:
    """
    Register the compiled modules in sys.modules under the names of their source files.

    Register no module if the variable KINEMATICS_UNCOMPILED is set. Register no module if the
    source has changed since it was compiled, because new source and old compiled modules must not
    be mixed.
    """
    if is_compiled():
        for module, files in _built().MODULES.items():
            compiled = importlib.import_module(f'.{module}', __package__)
            sys.modules |= {f'{__package__}.{file}': compiled for file in files}


@functools.cache
def is_compiled() -> bool:
    """Return True if the compiled kernel runs, False if the kernel runs as plain Python."""
    return not os.environ.get(VARIABLE) and _built() is not None and not is_stale()


@functools.cache
def is_stale() -> bool:
    """Return whether the kernel's source has changed since it was compiled."""
    built = _built()
    return built is not None and hash_of(built.FILES) != built.HASH


@functools.cache
def _built() -> Any:
    # Returns the module `_origin`, in which the build lists the compiled modules; None if it does
    # not exist. Searches only this folder, because a search of an editable installation could find
    # the `_origin` of another copy of the package.
    name = f'{__package__}._origin'
    return importlib.import_module(name) if PathFinder.find_spec(name, [str(_FOLDER)]) else None


def as_exported(value: Any) -> Any:
    """
    Prepare a class, function or type of the kernel for export, and return the exported object.

    The attribute `__module__` of a class is set to `kernel`, so that pickle finds the class in the
    compiled kernel and in plain Python. A function that runs as plain Python is wrapped, so that
    numpy prints no warnings. Overflows and invalid numbers then appear only in the results, as in
    the compiled kernel.
    """
    if isinstance(value, FunctionType):
        return _quiet(value)
    if isinstance(value, type) and value.__module__.startswith(f'{__package__}._'):
        try:
            value.__module__ = __package__
        except TypeError:  # the `__module__` of a compiled class is read-only
            copyreg.pickle(value, _reduced)
    return value


def restored(name: str, *arguments: Any) -> Any:
    """
    Return an object of the exported class `name`. Pickle calls this function to restore the
    object.
    """
    return getattr(sys.modules[__package__], name)(*arguments)


def _reduced(instance: Any) -> tuple[Any, ...]:
    return restored, (type(instance).__name__, *instance.__reduce__()[1])


def _quiet(function: Callable[..., Any]) -> Callable[..., Any]:
    kinds = [kind for name, kind in function.__annotations__.items() if name != 'return']

    @functools.wraps(function)
    def call(*arguments: Any) -> Any:
        for argument, kind in zip(arguments, kinds):
            if argument is None and isinstance(kind, type):
                given(argument)
        with np.errstate(all='ignore'):
            return function(*arguments)

    return call


def hash_of(names: Sequence[str]) -> str:
    """
    Return the SHA-256 hash of the content of the kernel files `names`; '' if a file is missing.
    """
    try:
        return hashlib.sha256(
            b''.join((_FOLDER / name).read_bytes() for name in names)
        ).hexdigest()
    except OSError:
        return ''


def notice() -> str:
    """
    Return a warning if the kernel runs as plain Python, else ''.

    The warning includes the command that compiles the kernel, unless the variable
    KINEMATICS_UNCOMPILED is set.
    """
    slowly = 'runs as plain Python, hundreds of times slower'
    if os.environ.get(VARIABLE):
        return f'the kernel {slowly}, since {VARIABLE} is set'
    if is_compiled():
        return ''
    # Import `command` only if it is needed, because the import takes 60 ms.
    from .reinstallation import command

    if is_stale():
        return (
            'the source of the kernel has changed since it was compiled, so it '
            f'{slowly}; to compile it again: {command()}'
        )
    return f'the kernel is not compiled and {slowly}; to compile it: {command()}'
