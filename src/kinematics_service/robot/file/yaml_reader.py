"""
The only reader of YAML: version 1.2, by its events, each looked at before anything is built.

What could build objects or grow (tags, anchors, aliases) is refused at the event that brings it,
and every scalar stays the text the user wrote.
"""

from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import (
    AliasEvent,
    DocumentStartEvent,
    MappingEndEvent,
    MappingStartEvent,
    NodeEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
)
from ruamel.yaml.reader import ReaderError

from ...errors import Fault, RobotFileError
from .fault_report import quoted
from .split_commas import rejoined_items, rejoined_values
from .yaml_document import Document, ListNode, MappingNode, Node, ScalarNode

MAX_BYTES = 256 * 1024
MAX_DEPTH = 16
MAX_NODES = 20_000  # read in half a second; a file of 128 joints and 512 rows has half as many


def read_document(text: str, file: str) -> Document:
    """
    Return the tree of a YAML text.

    Raises
    ------
    RobotFileError
        Not YAML, empty, several documents, or something that is refused: anchors, aliases,
        tags, directives, too large, nested too deeply.
    """
    if len(text.encode('utf-8', 'surrogatepass')) > MAX_BYTES:
        raise _refusal(file, 0, f'larger than {MAX_BYTES // 1024} KiB: not a robot file')
    builder = _Builder(file)
    try:
        for event in YAML(typ='safe', pure=True).parse(text):
            builder.take(event)
    except RobotFileError:
        raise
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        reason = ', '.join(str(part) for part in (error.context, error.problem) if part)
        reason = reason if len(reason) <= 200 else f'{reason[:197]}...'
        advice = ' (indent with spaces)' if r"'\t'" in reason else ''
        line = mark.line + 1 if mark else 0
        raise _refusal(file, line, f'not valid YAML: {reason}{advice}') from None
    except ReaderError as error:
        line = text.count('\n', 0, error.position) + 1
        reason = f'character {text[error.position]!a} is not accepted in YAML'
        raise _refusal(file, line, reason) from None
    except (YAMLError, ValueError, OverflowError):
        # The scanner meets some malformed escapes, \UFFFFFFFF, with Python's own errors.
        raise _refusal(file, 0, 'not valid YAML: malformed escape or indicator') from None
    if builder.root is None or builder.root == ScalarNode('', builder.root.line, False):
        raise _refusal(file, 0, 'the file is empty')
    return Document(file, builder.root)


def _refusal(file: str, line: int, message: str) -> RobotFileError:
    return RobotFileError((Fault(file, line, '', message),))


class _Builder:
    """The tree under construction: open sequences and mappings, innermost last."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.root: Node | None = None
        self.open: list[tuple[Any, list[Node]]] = []
        self.documents = 0
        self.nodes = 0

    def take(self, event: Any) -> None:
        line = event.start_mark.line + 1
        if isinstance(event, DocumentStartEvent):
            self._start_document(event, line)
        elif isinstance(event, NodeEvent):
            self._check(event, line)
            if isinstance(event, ScalarEvent):
                self._add(ScalarNode(event.value, line, event.style is not None))
            else:
                self.open.append((event, []))
                if len(self.open) > MAX_DEPTH:
                    raise _refusal(self.file, line, f'nested more than {MAX_DEPTH} deep')
        elif isinstance(event, (SequenceEndEvent, MappingEndEvent)):
            start, children = self.open.pop()
            self._add(self._closed(start, children))

    def _start_document(self, event: Any, line: int) -> None:
        self.documents += 1
        if self.documents > 1:
            raise _refusal(self.file, line, 'a second document: one file is one robot')
        if event.version or event.tags:
            raise _refusal(self.file, line, 'directives (%YAML, %TAG) are not accepted')

    def _check(self, event: Any, line: int) -> None:
        self.nodes += 1
        if self.nodes > MAX_NODES:
            raise _refusal(self.file, line, f'more than {MAX_NODES} values: not a robot file')
        if isinstance(event, AliasEvent):
            raise _refusal(
                self.file, line, f'aliases are not accepted: {quoted("*" + event.anchor)}'
            )
        if event.anchor is not None:
            raise _refusal(
                self.file, line, f'anchors are not accepted: {quoted("&" + event.anchor)}'
            )
        if event.tag is not None:
            raise _refusal(self.file, line, f'tags are not accepted: {quoted(str(event.tag))}')

    def _add(self, node: Node) -> None:
        if self.open:
            self.open[-1][1].append(node)
        else:
            self.root = node

    def _closed(self, start: Any, children: list[Node]) -> Node:
        line = start.start_mark.line + 1
        flow = bool(start.flow_style)
        if isinstance(start, SequenceStartEvent):
            return ListNode(tuple(rejoined_items(children) if flow else children), line)
        assert isinstance(start, MappingStartEvent)
        entries = []
        for key, value in zip(children[::2], children[1::2], strict=True):
            if not isinstance(key, ScalarNode):
                raise _refusal(self.file, key.line, 'a key must be a word, not a list or mapping')
            if not key.text.isprintable():
                message = f'the key {quoted(key.text)} holds control characters'
                raise _refusal(self.file, key.line, message)
            entries.append((key, value))
        return MappingNode(tuple(rejoined_values(entries) if flow else entries), line)
