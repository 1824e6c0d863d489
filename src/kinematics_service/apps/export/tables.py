# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write objects of the kernel's source as structures of constants in C."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from .translation import literal

OWN = ('Chain', 'Closure', 'LoopGroup', 'Loop', 'TaskRows')


def fields_of(things: Sequence[Any], prefix: str) -> dict[str, dict[str, str]]:
    """Return the C types of the fields of objects and of the objects in their fields."""
    found: dict[str, dict[str, str]] = {}
    waiting = list(things)
    while waiting:
        thing = waiting.pop()
        fields = found.setdefault(type(thing).__name__, {})
        for field, value in vars(thing).items():
            name = type(value).__name__
            # A field that is None has the type that it has in the other objects.
            if name in OWN:
                waiting.append(value)
                fields[field] = f'{prefix}{name} *'
            elif isinstance(value, np.ndarray):
                fields[field] = 'double *' if value.dtype == float else 'int *'
            elif isinstance(value, int | float):
                fields[field] = 'double' if isinstance(value, float) else 'int'
            elif field == 'following':
                fields.setdefault(field, f'{prefix}{type(thing).__name__} *')
    return found


class Tables:
    """
    Structures and constants in C.

    Parameters
    ----------
    prefix, constant
        Text before the names, and before the type of a constant, such as `static const`.
    fields
        The C types of the fields, by the name of the class.
    used
        The fields to write, by the name of the class.
    """

    def __init__(
        self,
        prefix: str,
        constant: str,
        fields: Mapping[str, Mapping[str, str]],
        used: Mapping[str, Collection[str]],
    ) -> None:
        self.prefix, self.constant = prefix, constant
        self.fields = {
            name: {field: kind for field, kind in own.items() if field in used[name]}
            for name, own in fields.items()
        }
        self.names: dict[int, str] = {}
        self.lines: list[str] = []

    def structures(self) -> list[str]:
        """Return the declarations of the structures."""
        lines = [
            f'typedef struct {self.prefix}{name} {self.prefix}{name};' for name in self.fields
        ]
        for name, fields in self.fields.items():
            own = [
                f'    {"const " * kind.endswith("*")}{kind} {field};'
                for field, kind in fields.items()
            ]
            lines += [f'struct {self.prefix}{name} {{', *own, '};']
        return lines

    def add(self, thing: Any) -> str:
        """Add an object, after the objects in its fields; return the name of its constant."""
        if id(thing) in self.names:
            return self.names[id(thing)]
        kind = type(thing).__name__
        name = f'{self.prefix}{kind.lower()}_{len(self.names)}'
        self.names[id(thing)] = name
        values = []
        for field in self.fields[kind]:
            value = getattr(thing, field)
            if isinstance(value, np.ndarray):
                values.append(self.array(f'{name}_{field}', value))
            elif type(value).__name__ in OWN:
                values.append(f'&{self.add(value)}')
            else:
                values.append('0' if value is None else literal(value))
        self.lines.append(f'{self.constant} {self.prefix}{kind} {name} = {{{", ".join(values)}}};')
        return name

    def array(self, name: str, numbers: Any) -> str:
        """Add an array of numbers; return its name."""
        kind = 'double' if numbers.dtype == float else 'int'
        text = ', '.join(map(literal, numbers.ravel().tolist())) or '0'
        self.lines.append(f'{self.constant} {kind} {name}[] = {{{text}}};')
        return name
