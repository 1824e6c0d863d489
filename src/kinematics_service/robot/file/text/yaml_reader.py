"""
The reader of YAML: by its events, each looked at before anything is built.

What could build objects or grow (tags, anchors, aliases) is refused at the event that brings it.
"""

import re
from typing import Any, Generic, TypeAlias, TypeVar

import yaml

from .fault_report import quoted
from .yaml_document import ScalarNode

LONGEST_REASON = 200
# Texts of this many characters are parsed again for a better reason why they are no YAML.
EXPLAINED = 256 * 1024
# What YAML does not accept, and three characters that end a line in its version 1.1 only.
UNACCEPTED = re.compile(
    '[^\t\n\r\x20-\x7e\xa0-\u2027\u202a-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]'
)
# Without libyaml PyYAML reads the same, twenty times as slowly.
LOADER: type[yaml.SafeLoader] = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
Scalar: TypeAlias = yaml.ScalarEvent
SequenceStart: TypeAlias = yaml.SequenceStartEvent
MappingStart: TypeAlias = yaml.MappingStartEvent
Read = TypeVar('Read')  # what a node becomes
# What that one makes of some escapes, \UFFFFFFFF.
MALFORMED = (ValueError, OverflowError)


class YamlError(Exception):
    """
    A text that is not accepted; its text is `line: reason`.

    Attributes
    ----------
    line
        Counted from 1; 0 if none can be named.
    reason
    """

    def __init__(self, line: int, reason: str) -> None:
        self.line, self.reason = line, reason
        super().__init__(f'{line or ""}: {reason}'.removeprefix(':'))


class YamlReader(Generic[Read]):
    """
    The documents of one text; what becomes of a node is for the kind of file to say.

    Parameters
    ----------
    deepest, most_values
        How deep values may be nested, and how many there may be.
    advice
        What to do, or what it is, if there are more.
    """

    def __init__(self, deepest: int, most_values: int, advice: str) -> None:
        self._deepest, self._most_values, self._advice = deepest, most_values, advice
        self._documents: list[Read] = []
        # Lists and mappings that are open, innermost last: what began each, and its children.
        self._open: list[tuple[yaml.Event, list[Any]]] = [(None, self._documents)]
        self._values = 0

    def scalar(self, event: Scalar) -> Read:
        """Return the value of a text that is no key."""
        raise NotImplementedError

    def sequence(self, start: SequenceStart, items: list[Read]) -> Read:
        """Return a list that began with an event."""
        raise NotImplementedError

    def mapping(self, start: MappingStart, entries: list[tuple[ScalarNode, Read]]) -> Read:
        """Return a mapping that began with an event."""
        raise NotImplementedError

    def begin_document(self, line: int) -> None:
        """Look at the beginning of a document."""

    def documents(self, text: str) -> list[Read]:
        """
        Return the documents of the text.

        Raises
        ------
        YamlError
            It is not YAML, or something that is refused: anchors, aliases, tags, directives, keys
            that are no words, too many values, nested too deeply.
        """
        if found := UNACCEPTED.search(text):
            line = text.count('\n', 0, found.start()) + 1
            raise YamlError(line, f'character {found[0]!a} is not accepted in YAML')
        try:
            for event in yaml.parse(text, Loader=LOADER):
                self._take(event)
        except yaml.MarkedYAMLError as error:
            line, reason = self._explained(error, text)
            cut = reason if len(reason) <= LONGEST_REASON else f'{reason[: LONGEST_REASON - 3]}...'
            advice = ' (indent with spaces)' if r"'\t'" in reason else ''
            raise YamlError(line, f'not valid YAML: {cut}{advice}') from None
        except MALFORMED:
            raise YamlError(0, 'not valid YAML: malformed escape or indicator') from None
        return self._documents

    def _explained(self, error: yaml.MarkedYAMLError, text: str) -> tuple[int, str]:
        # libyaml says what is expected, PyYAML's own parser also what stands there instead. At the
        # end of a text libyaml may count a line more.
        depth = 0
        try:
            for event in yaml.parse(
                text if len(text) <= EXPLAINED else '', Loader=yaml.SafeLoader
            ):
                depth += isinstance(event, yaml.CollectionStartEvent)
                depth -= isinstance(event, yaml.CollectionEndEvent)
                if depth > self._deepest:  # its own parser takes minutes of deep ones
                    raise self._too_deep(event) from None
        except yaml.MarkedYAMLError as other:
            if 0 <= _line_of(error) - _line_of(other) <= 1:
                error = other
        except MALFORMED:
            pass
        reason = ', '.join(str(part) for part in (error.context, error.problem) if part)
        return _line_of(error), reason

    def _take(self, event: yaml.Event) -> None:
        kind = type(event)
        if kind is Scalar:
            self._check(event)
            value = node_of(event) if self._at_key() else self.scalar(event)
            self._open[-1][1].append(value)
        elif kind is SequenceStart or kind is MappingStart:
            self._check(event)
            if self._at_key():
                raise _refusal(event, 'a key must be a word, not a list or mapping')
            if len(self._open) > self._deepest:
                raise self._too_deep(event)
            self._open.append((event, []))
        elif kind is yaml.SequenceEndEvent:
            start, items = self._open.pop()
            self._open[-1][1].append(self.sequence(start, items))
        elif kind is yaml.MappingEndEvent:
            start, both = self._open.pop()
            entries = list(zip(both[::2], both[1::2], strict=True))
            self._open[-1][1].append(self.mapping(start, entries))
        elif kind is yaml.AliasEvent:
            raise _refusal(event, f'aliases are not accepted: {quoted("*" + event.anchor)}')
        elif kind is yaml.DocumentStartEvent:
            line = event.end_mark.line + 1  # behind its directives
            self.begin_document(line)
            if event.version or event.tags:
                raise YamlError(line, 'directives (%YAML, %TAG) are not accepted')

    def _too_deep(self, event: yaml.Event) -> YamlError:
        return _refusal(event, f'nested more than {self._deepest} deep')

    def _at_key(self) -> bool:
        start, children = self._open[-1]
        return type(start) is MappingStart and len(children) % 2 == 0

    def _check(self, event: yaml.Event) -> None:
        self._values += 1
        if self._values > self._most_values:
            raise _refusal(event, f'more than {self._most_values:,} values: {self._advice}')
        if event.anchor is not None:
            raise _refusal(event, f'anchors are not accepted: {quoted("&" + event.anchor)}')
        if event.tag is not None:
            raise _refusal(event, f'tags are not accepted: {quoted(str(event.tag))}')


def node_of(event: Scalar) -> ScalarNode:
    """Return the text of an event as the user wrote it."""
    return ScalarNode(event.value, event.start_mark.line + 1, bool(event.style))


def _line_of(error: yaml.MarkedYAMLError) -> int:
    mark = error.problem_mark or error.context_mark
    return mark.line + 1 if mark else 0


def _refusal(event: yaml.Event, reason: str) -> YamlError:
    return YamlError(event.start_mark.line + 1, reason)
