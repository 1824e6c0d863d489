# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Load the kernel's source as plain Python modules, next to the compiled kernel.

Arms of the compiled kernel are copied to objects of the plain Python modules.
"""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from types import ModuleType
from typing import Any

from ... import kernel

# Name of the package that holds the modules of the source. The package has no file of its own: its
# modules are those of the folder `kernel`.
SOURCE = f'{__package__}.source_of_kernel'


def source(module: str) -> ModuleType:
    """Return a module of the kernel as plain Python, such as `forward.chain_pass`."""
    if SOURCE not in sys.modules:
        package = ModuleType(SOURCE)
        package.__path__ = list(kernel.__path__)
        sys.modules[SOURCE] = package
    return import_module(f'{SOURCE}.{module}')


@contextmanager
def replaced(module: ModuleType, **functions: Callable[..., Any]) -> Iterator[None]:
    """
    Replace functions of a plain Python module as long as a `with` block runs.

    The keywords are the names of the functions, and the values are the new functions.
    """
    before = {name: getattr(module, name) for name in functions}
    vars(module).update(functions)
    try:
        yield
    finally:
        vars(module).update(before)


def copied(thing: Any) -> Any:
    """
    Return a plain Python copy of a compiled chain, or of a part of the chain.

    The copy is an object of the module that `source` loads. Plain values are returned unchanged.
    """
    name = type(thing).__name__
    if name not in ('Chain', 'Closure', 'LoopGroup', 'Loop'):
        return thing
    return getattr(source('forward.chain'), name)(*map(copied, thing.__reduce__()[-1]))
