"""
The YAML of a robot file as a tree of texts.

In `[...]` and `{...}` YAML ends an unquoted text at every comma, so `atan2(1, 2)` arrives in
pieces. They are joined so that the rest of the file can still be read; the joined text says so
(`ScalarNode.rejoined`), and the file is refused with the advice to quote it.
"""

import re
from collections.abc import Sequence
from typing import Any

from ....errors import Fault, RobotFileError
from .fault_report import quoted
from .yaml_document import Document, ListNode, MappingNode, Node, ScalarNode
from .yaml_reader import YamlError, YamlReader, node_of

WHOLE_AT_END = re.compile(r'(?<![\w.])[0-9]+$')
MAX_BYTES = 256 * 1024
MAX_DEPTH = 16
MAX_NODES = 20_000  # a file of 128 joints and 512 rows has half as many
MAX_PIECES = 8  # no expression has more commas; a bound keeps the search linear


def read_document(text: str, file: str) -> Document:
    """
    Return the tree of a YAML text; every scalar stays the text the user wrote.

    Raises
    ------
    RobotFileError
        Not YAML, empty, several documents, too large, or something that `YamlReader` refuses.
    """
    try:
        if len(text.encode('utf-8', 'surrogatepass')) > MAX_BYTES:
            raise YamlError(0, f'larger than {MAX_BYTES // 1024} KiB: not a robot file')
        roots = _TreeReader(MAX_DEPTH, MAX_NODES, 'not a robot file').documents(text)
        if not roots or roots[0] == ScalarNode('', roots[0].line, False):
            raise YamlError(0, 'the file is empty')
    except YamlError as error:
        raise RobotFileError((Fault(file, error.line, '', error.reason),)) from None
    return Document(file, roots[0])


class _TreeReader(YamlReader):
    begun = False

    def begin_document(self, line: int) -> None:
        if self.begun:
            raise YamlError(line, 'a second document: one file is one robot')
        self.begun = True

    def scalar(self, event: Any) -> Node:
        return node_of(event)

    def sequence(self, start: Any, items: list[Node]) -> Node:
        joined = _rejoined_items(items) if start.flow_style else items
        return ListNode(tuple(joined), start.start_mark.line + 1)

    def mapping(self, start: Any, entries: list[tuple[ScalarNode, Node]]) -> Node:
        for key, _ in entries:
            if not key.text.isprintable():
                message = f'the key {quoted(key.text)} holds control characters'
                raise YamlError(key.line, message)
        joined = _rejoined_values(entries) if start.flow_style else entries
        return MappingNode(tuple(joined), start.start_mark.line + 1)


def _rejoined_items(items: Sequence[Node]) -> list[Node]:
    """Return the items of a flow sequence: `[atan2(1, 2), 0]` has two, not three."""
    result: list[Node] = []
    position = 0
    while position < len(items):
        joined, used = _joined_from(items[position : position + MAX_PIECES])
        result.append(joined)
        position += used
    return result


def _rejoined_values(entries: Sequence[tuple[ScalarNode, Node]]) -> list[tuple[ScalarNode, Node]]:
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
        if used == 1 and (number := _with_decimal_comma(pieces)):
            joined, used = number, 2
        result.append((key, joined))
        position += used
    return result


def _with_decimal_comma(pieces: Sequence[Node]) -> ScalarNode | None:
    # What was written as 0,4, for its reader to refuse; None for anything else.
    match pieces:
        case [ScalarNode(text, line, False), ScalarNode(decimals), *_]:
            if WHOLE_AT_END.search(text) and WHOLE_AT_END.fullmatch(decimals):
                return ScalarNode(f'{text},{decimals}', line, False)
    return None


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
