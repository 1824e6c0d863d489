"""
The only reader of robot files' YAML: by its events, each looked at before anything is built.

What could build objects or grow (tags, anchors, aliases) is refused at the event that brings it,
and every scalar stays the text the user wrote.
"""

import re
from typing import Any

import yaml

from ....errors import Fault, RobotFileError
from .fault_report import quoted
from .split_commas import rejoined_items, rejoined_values
from .yaml_document import Document, ListNode, MappingNode, Node, ScalarNode

MAX_BYTES = 256 * 1024
MAX_DEPTH = 16
MAX_NODES = 20_000  # a file of 128 joints and 512 rows has half as many
LONGEST_REASON = 200
# What YAML does not accept, and three characters that end a line in its version 1.1 only.
UNACCEPTED = re.compile(
    '[^\t\n\r\x20-\x7e\xa0-\u2027\u202a-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]'
)
# Without libyaml PyYAML reads the same, twenty times as slowly.
LOADER: Any = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
# What that one makes of some escapes, \UFFFFFFFF.
MALFORMED = (ValueError, OverflowError)


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
    if found := UNACCEPTED.search(text):
        line = text.count('\n', 0, found.start()) + 1
        raise _refusal(file, line, f'character {found[0]!a} is not accepted in YAML')
    builder = _Builder(file)
    try:
        for event in yaml.parse(text, Loader=LOADER):
            builder.take(event)
    except RobotFileError:
        raise  # which is a ValueError, too
    except yaml.MarkedYAMLError as error:
        line, reason = _explained(error, text)
        reason = reason if len(reason) <= LONGEST_REASON else f'{reason[: LONGEST_REASON - 3]}...'
        advice = ' (indent with spaces)' if r"'\t'" in reason else ''
        raise _refusal(file, line, f'not valid YAML: {reason}{advice}') from None
    except MALFORMED:
        raise _refusal(file, 0, 'not valid YAML: malformed escape or indicator') from None
    if builder.root is None or builder.root == ScalarNode('', builder.root.line, False):
        raise _refusal(file, 0, 'the file is empty')
    return Document(file, builder.root)


def _explained(error: Any, text: str) -> tuple[int, str]:
    # libyaml says what is expected, PyYAML's own parser also what stands there instead. At the
    # end of a text libyaml may count a line more.
    try:
        for _ in yaml.parse(text, Loader=yaml.SafeLoader):
            pass
    except yaml.MarkedYAMLError as other:
        if 0 <= _line_of(error) - _line_of(other) <= 1:
            error = other
    except MALFORMED:
        pass
    reason = ', '.join(str(part) for part in (error.context, error.problem) if part)
    return _line_of(error), reason


def _line_of(error: Any) -> int:
    mark = error.problem_mark or error.context_mark
    return mark.line + 1 if mark else 0


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
        if isinstance(event, yaml.DocumentStartEvent):
            self._start_document(event)
        elif isinstance(event, yaml.NodeEvent):
            self._check(event, line)
            if isinstance(event, yaml.ScalarEvent):
                self._add(ScalarNode(event.value, line, bool(event.style)))
            else:
                self.open.append((event, []))
                if len(self.open) > MAX_DEPTH:
                    raise _refusal(self.file, line, f'nested more than {MAX_DEPTH} deep')
        elif isinstance(event, (yaml.SequenceEndEvent, yaml.MappingEndEvent)):
            start, children = self.open.pop()
            self._add(self._closed(start, children))

    def _start_document(self, event: Any) -> None:
        line = event.end_mark.line + 1  # behind its directives
        self.documents += 1
        if self.documents > 1:
            raise _refusal(self.file, line, 'a second document: one file is one robot')
        if event.version or event.tags:
            raise _refusal(self.file, line, 'directives (%YAML, %TAG) are not accepted')

    def _check(self, event: Any, line: int) -> None:
        self.nodes += 1
        if self.nodes > MAX_NODES:
            raise _refusal(self.file, line, f'more than {MAX_NODES} values: not a robot file')
        if isinstance(event, yaml.AliasEvent):
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
        if isinstance(start, yaml.SequenceStartEvent):
            return ListNode(tuple(rejoined_items(children) if flow else children), line)
        assert isinstance(start, yaml.MappingStartEvent)
        entries = []
        for key, value in zip(children[::2], children[1::2], strict=True):
            if not isinstance(key, ScalarNode):
                raise _refusal(self.file, key.line, 'a key must be a word, not a list or mapping')
            if not key.text.isprintable():
                message = f'the key {quoted(key.text)} holds control characters'
                raise _refusal(self.file, key.line, message)
            entries.append((key, value))
        return MappingNode(tuple(rejoined_values(entries) if flow else entries), line)
