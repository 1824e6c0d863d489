"""
Expressions that YAML has split at a comma, put together again.

In `[...]` and `{...}` YAML ends an unquoted text at every comma, so `atan2(1, 2)` arrives in
pieces. They are joined so that the rest of the file can still be read; the joined text says so
(`ScalarNode.rejoined`), and the file is refused with the advice to quote it.
"""

from collections.abc import Sequence

from .yaml_document import Node, ScalarNode

MAX_PIECES = 8  # no expression has more commas; a bound keeps the search linear


def rejoined_items(items: Sequence[Node]) -> list[Node]:
    """Return the items of a flow sequence: `[atan2(1, 2), 0]` has two, not three."""
    result: list[Node] = []
    position = 0
    while position < len(items):
        joined, used = _joined_from(items[position : position + MAX_PIECES])
        result.append(joined)
        position += used
    return result


def rejoined_values(entries: Sequence[tuple[ScalarNode, Node]]) -> list[tuple[ScalarNode, Node]]:
    """Return the entries of a flow mapping: `{a: atan2(1, 2)}` has one, and no key `2)`."""
    result: list[tuple[ScalarNode, Node]] = []
    position = 0
    while position < len(entries):
        key, value = entries[position]
        pieces: list[Node] = [value]
        for piece, nothing in entries[position + 1 : position + MAX_PIECES]:
            if nothing != ScalarNode('', nothing.line, False):
                break
            pieces.append(piece)
        joined, used = _joined_from(pieces)
        result.append((key, joined))
        position += used
    return result


def _open_parentheses(node: Node) -> int:
    if not isinstance(node, ScalarNode) or node.quoted:
        return 0
    return node.text.count('(') - node.text.count(')')


def _joined_from(pieces: Sequence[Node]) -> tuple[Node, int]:
    first, missing = pieces[0], _open_parentheses(pieces[0])
    if missing <= 0:
        return first, 1
    texts = [first.text] if isinstance(first, ScalarNode) else []
    for count, piece in enumerate(pieces[1:], start=2):
        if not isinstance(piece, ScalarNode) or piece.quoted:
            break
        texts.append(piece.text)
        missing += _open_parentheses(piece)
        if missing <= 0:
            return ScalarNode(', '.join(texts), first.line, False, rejoined=True), count
    return first, 1
