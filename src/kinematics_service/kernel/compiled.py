"""Whether the kernel is compiled, and from which source."""

import functools
import hashlib
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from importlib.machinery import SOURCE_SUFFIXES, FileFinder, ModuleSpec, SourceFileLoader
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

import numpy as np

# If it is set, to anything, the kernel's source runs as plain Python: for coverage, a debugger,
# and as a second way to compute every number.
VARIABLE = 'KINEMATICS_UNCOMPILED'
_FOLDER = Path(__file__).parent


class _SourceOnly:
    # Finds the kernel's modules as source even if compiled ones are beside it.
    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        above = name.rpartition('.')[0]
        if above != __package__ and not above.startswith(f'{__package__}.'):
            return None
        folder = _FOLDER.joinpath(*above.removeprefix(__package__).split('.'))
        return FileFinder(str(folder), (SourceFileLoader, SOURCE_SUFFIXES)).find_spec(name)


def prefer_source_where_needed() -> None:
    """
    Let the kernel's modules be imported as plain Python if compiled ones are not wanted. That is
    so if the environment asks for it, or if the source has changed since it was compiled: then
    modules of different versions would mix.
    """
    if os.environ.get(VARIABLE) or is_stale():
        sys.meta_path.insert(0, _SourceOnly())


@functools.cache
def is_stale() -> bool:
    """Return whether there is a compiled kernel, but not of the source beside it."""
    try:
        from .origin import source
    except ImportError:  # for another Python, for instance
        return True
    built = source().decode().split()
    if not built or built[0] == hash_of(built[1:]):
        return False
    del sys.modules[source.__module__]  # it is imported again, as source
    return True


def without_warnings(names: Mapping[str, Any]) -> dict[str, Any]:
    """
    Return the kernel's functions among these names, as quiet as compiled ones.

    Their results tell of overflows and of invalid numbers; numpy would warn, or raise.
    """
    return {
        name: _quiet(value)
        for name, value in names.items()
        if isinstance(value, FunctionType) and value.__module__ != __name__
    }


def _quiet(function: Callable[..., Any]) -> Callable[..., Any]:
    @functools.wraps(function)
    def call(*arguments: Any) -> Any:
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


def is_compiled() -> bool:
    """Return whether the kernel runs compiled."""
    from .origin import source

    return source() != b''


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
