"""A YAML document as a tree of texts with line numbers; nothing in it is resolved to a number."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias


class ScalarNode(NamedTuple):
    """A text."""

    text: str
    line: int
    quoted: bool


class ListNode(NamedTuple):
    """A sequence."""

    items: tuple['Node', ...]
    line: int


class MappingNode(NamedTuple):
    """Pairs in the order of the file; the first of two equal keys is the one that counts."""

    entries: tuple[tuple[ScalarNode, 'Node'], ...]
    line: int

    def find(self, key: str) -> tuple[ScalarNode, 'Node'] | None:
        """Return the first entry with a key."""
        return next((entry for entry in self.entries if entry[0].text == key), None)


Node: TypeAlias = ScalarNode | ListNode | MappingNode
Path: TypeAlias = tuple[str | int, ...]


@dataclass(frozen=True)
class Document:
    """One YAML document and the file it came from."""

    file: str
    root: Node

    @property
    def data(self) -> Any:
        """Return dicts and lists with `ScalarNode` at the leaves."""
        return _plain(self.root)

    def line(self, path: Path) -> int:
        """Return the line of the key or item at a path, or of the nearest thing around it."""
        node, line = self.root, self.root.line
        for step in path:
            if isinstance(node, MappingNode) and (entry := node.find(str(step))):
                node, line = entry[1], entry[0].line
            elif isinstance(node, ListNode) and isinstance(step, int) and step < len(node.items):
                node = node.items[step]
                line = node.line
            else:
                break
        return line

    def faults(self) -> Iterator[tuple[Path, int, str]]:
        """Yield path, line and message of equal keys."""
        yield from _faults(self.root, ())


def texts_in(data: Any) -> Iterator[str]:
    """Yield every text in what `Document.data` holds, keys aside."""
    if isinstance(data, ScalarNode):
        yield data.text
    elif isinstance(data, (list, dict)):
        for value in data.values() if isinstance(data, dict) else data:
            yield from texts_in(value)


def _plain(node: Node) -> Any:
    if isinstance(node, ListNode):
        return [_plain(item) for item in node.items]
    if isinstance(node, MappingNode):
        result: dict[str, Any] = {}
        for key, value in node.entries:
            result.setdefault(key.text, _plain(value))
        return result
    return node


def _faults(node: Node, path: Path) -> Iterator[tuple[Path, int, str]]:
    if isinstance(node, ListNode):
        for index, item in enumerate(node.items):
            yield from _faults(item, (*path, index))
    elif isinstance(node, MappingNode):
        seen: dict[str, int] = {}
        for key, value in node.entries:
            inner = (*path, key.text)
            if key.text in seen:
                first = seen[key.text]
                lines = f'lines {first} and {key.line}' if first < key.line else f'line {first}'
                message = f'this key stands twice, on {lines}'
                yield inner, key.line, message
            else:
                seen[key.text] = key.line
                yield from _faults(value, inner)
