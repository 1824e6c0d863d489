# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Hold a YAML document as a tree of texts with line numbers, without conversion to numbers."""

from collections.abc import Iterator
from typing import NamedTuple, TypeAlias


class ScalarNode(NamedTuple):
    """A scalar of YAML as text, with the line of the scalar in the file."""

    text: str
    line: int
    quoted: bool


class ListNode(NamedTuple):
    """A sequence of YAML as a list, with the line of the sequence in the file."""

    items: tuple['Node', ...]
    line: int


class MappingNode(NamedTuple):
    """A mapping of YAML as pairs in the order of the file; the first of two equal keys is used."""

    entries: tuple[tuple[ScalarNode, 'Node'], ...]
    line: int


Node: TypeAlias = ScalarNode | ListNode | MappingNode
Path: TypeAlias = tuple[str | int, ...]
# A YAML value as Python containers, without line numbers of lists and mappings. The value of a
# missing key is None.
Yaml: TypeAlias = ScalarNode | list['Yaml'] | dict[str, 'Yaml'] | None


class Document:
    """
    One YAML document, with the line of each key and item.

    Attributes
    ----------
    data
        The document as dicts and lists, with a `ScalarNode` for each scalar.
    faults
        Path, line and message of each key that a mapping has twice.
    """

    def __init__(self, file: str, root: Node) -> None:
        self.file = file
        self._lines: dict[Path, int] = {}
        self.faults: list[tuple[Path, int, str]] = []
        self.data = self._value(root, (), root.line)

    def line(self, path: Path) -> int:
        """
        Return the line of the key or item at a path. If the file does not have it, return the line
        of the list or mapping in which it is missing.
        """
        while path not in self._lines:
            path = path[:-1]
        return self._lines[path]

    def _value(self, node: Node, path: Path, line: int) -> Yaml:
        self._lines[path] = line
        if isinstance(node, ListNode):
            return [self._value(item, (*path, k), item.line) for k, item in enumerate(node.items)]
        if not isinstance(node, MappingNode):
            return node
        mapping: dict[str, Yaml] = {}
        for key, value in node.entries:
            inner = (*path, key.text)
            if key.text in mapping:
                first = self.line(inner)
                lines = f'lines {first} and {key.line}' if first < key.line else f'line {first}'
                self.faults.append((inner, key.line, f'the key is written twice, on {lines}'))
            else:
                mapping[key.text] = self._value(value, inner, key.line)
        return mapping


def texts_in(data: Yaml) -> Iterator[str]:
    """Yield the text of every scalar in a value, except keys of mappings."""
    if isinstance(data, ScalarNode):
        yield data.text
    elif isinstance(data, (list, dict)):
        for value in data.values() if isinstance(data, dict) else data:
            yield from texts_in(value)
