# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Read YAML from the events of PyYAML's parser; check each event before a value is built.

The reader refuses tags, anchors and aliases, which could build objects or multiply values.
"""

import re
from typing import Any, Generic, TypeAlias, TypeVar

import yaml

from .fault_report import quoted
from .yaml_document import ScalarNode

MAX_REASON_LENGTH = 200  # characters; longer reasons of the YAML parser are cut in messages
# A text with a syntax error is parsed a second time for a better message if it has at most this
# number of characters.
MAX_EXPLAINED_LENGTH = 256 * 1024
# Matches the characters that the reader refuses. YAML does not accept most of them. The other
# three (U+0085, U+2028, U+2029) end a line only in YAML 1.1, and would make line numbers
# ambiguous.
UNACCEPTED = re.compile(
    '[^\t\n\r\x20-\x7e\xa0-\u2027\u202a-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]'
)
# Use the parser libyaml if PyYAML has it, because PyYAML's own parser takes 20 times as long. Both
# parsers return equal events.
LOADER: type[yaml.SafeLoader] = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
Scalar: TypeAlias = yaml.ScalarEvent
SequenceStart: TypeAlias = yaml.SequenceStartEvent
MappingStart: TypeAlias = yaml.MappingStartEvent
Read = TypeVar('Read')  # the type of the values that a subclass of YamlReader builds
# Advice on a syntax error, by a part of the parser's reason. {line} is the line on which the list,
# the mapping, the quoted text or the key begins.
ADVICE = {
    r"'\t'": 'indent with spaces',
    "',' or ']'": 'close the [ of line {line}, or write the missing comma',
    "',' or '}'": 'close the {{ of line {line}, or write the missing comma',
    'escape character': r'write \\ for a backslash, or use single quotation marks',
    'quoted scalar': 'close the quotation mark of line {line}',
    'cannot start any token': 'put the text into quotation marks',
    'mapping values': 'write one `key: value` a line, in its column; quote a text with a colon',
    '<block end>': 'begin the line at the same column as the lines of its level',
    "expected ':'": 'write line {line} as `key: value`',
}
# For some escapes, such as \UFFFFFFFF, PyYAML raises these errors and not a YAMLError.
MALFORMED = (ValueError, OverflowError)


class YamlError(Exception):
    """
    The YAML text is not accepted; the message is `line: reason`.

    Attributes
    ----------
    line
        The line of the fault, counted from 1; 0 if unknown.
    reason, code
        The fault as text, and its stable name.
    """

    def __init__(self, line: int, reason: str, code: str = 'syntax') -> None:
        self.line, self.reason, self.code = line, reason, code
        super().__init__(f'{line or ""}: {reason}'.removeprefix(':'))


class YamlReader(Generic[Read]):
    """
    A reader of the YAML documents of one text; subclasses define which values it builds.

    Parameters
    ----------
    deepest, most_values
        The largest nesting depth, and the largest number of values.
    advice
        The end of the message about too many values.
    second
        The message that refuses a second document; '' if several documents are accepted.
    """

    def __init__(self, deepest: int, most_values: int, advice: str, second: str = '') -> None:
        self._deepest, self._most_values = deepest, most_values
        self._advice, self._second = advice, second
        self._documents: list[Read] = []
        # The lists and mappings whose end was not read yet, innermost last. For each of them,
        # `_open` has the event of its beginning, and the values read so far.
        self._open: list[tuple[yaml.Event, list[Any]]] = [(None, self._documents)]
        self._values = 0

    def scalar(self, event: Scalar) -> Read:
        """Build the value of a scalar that is not a key."""
        raise NotImplementedError

    def sequence(self, start: SequenceStart, items: list[Read]) -> Read:
        """Build the value of a list from its first event and its items."""
        raise NotImplementedError

    def mapping(self, start: MappingStart, entries: list[tuple[ScalarNode, Read]]) -> Read:
        """Build the value of a mapping from its first event and its keys and values."""
        raise NotImplementedError

    def documents(self, text: str) -> list[Read]:
        """
        Return the documents of the text.

        Raises
        ------
        YamlError
            The text is not YAML, or has anchors, aliases, tags, directives, keys that are lists or
            mappings, too many values, or too deep nesting.
        """
        if match := UNACCEPTED.search(text):
            line = text.count('\n', 0, match.start()) + 1
            message = f'character {match[0]!a} is not accepted in YAML; delete it'
            raise YamlError(line, message, 'control-characters')
        try:
            for event in yaml.parse(text, Loader=LOADER):
                self._take(event)
        except yaml.MarkedYAMLError as error:
            line, reason = self._explained(error, text)
            raise YamlError(line, f'not valid YAML: {reason}') from None
        except MALFORMED:
            raise YamlError(0, 'not valid YAML: malformed escape or indicator') from None
        return self._documents

    def _explained(self, error: yaml.MarkedYAMLError, text: str) -> tuple[int, str]:
        # Return the line and the reason of a syntax error, with advice. The message of libyaml
        # names the element that was expected, but not the element in its place. For an error at
        # the end of the text, the line may be too large by one. So parse the text again with
        # PyYAML's own parser, whose messages have neither fault.
        depth = 0
        try:
            for event in yaml.parse(
                text if len(text) <= MAX_EXPLAINED_LENGTH else '', Loader=yaml.SafeLoader
            ):
                depth += isinstance(event, yaml.CollectionStartEvent)
                depth -= isinstance(event, yaml.CollectionEndEvent)
                # Stop at a deeply nested text, because PyYAML's own parser needs minutes for it.
                if depth > self._deepest:
                    raise self._too_deep(event) from None
        except yaml.MarkedYAMLError as other:
            if 0 <= _line_of(error) - _line_of(other) <= 1:
                error = other
        except MALFORMED:
            pass
        reason = ', '.join(str(part) for part in (error.context, error.problem) if part)
        advice = next((f'; {text}' for part, text in ADVICE.items() if part in reason), '')
        if len(reason) > MAX_REASON_LENGTH:
            reason = f'{reason[: MAX_REASON_LENGTH - 3]}...'
        mark = error.context_mark or error.problem_mark
        return _line_of(error), reason + advice.format(line=mark.line + 1 if mark else '')

    def _take(self, event: yaml.Event) -> None:
        kind = type(event)
        if kind is Scalar:
            self._check(event)
            value = node_of(event) if self._at_key() else self.scalar(event)
            self._open[-1][1].append(value)
        elif kind is SequenceStart or kind is MappingStart:
            self._check(event)
            if self._at_key():
                raise _refusal(event, 'a key must be a word, not a list or mapping', 'wrong-type')
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
            alias = quoted('*' + event.anchor)
            raise _refusal(
                event, f'aliases are not accepted: {alias}; write the value', 'unsupported'
            )
        elif kind is yaml.DocumentStartEvent:
            # The line of `---`, which comes after the directives (%YAML, %TAG) of the document.
            line = event.end_mark.line + 1
            if self._second and self._documents:
                raise YamlError(line, self._second, 'too-many')
            if event.version or event.tags:
                raise YamlError(
                    line, 'directives (%YAML, %TAG) are not accepted; delete them', 'unsupported'
                )

    def _too_deep(self, event: yaml.Event) -> YamlError:
        return _refusal(event, f'nested more than {self._deepest} deep', 'too-deep')

    def _at_key(self) -> bool:
        start, children = self._open[-1]
        return type(start) is MappingStart and len(children) % 2 == 0

    def _check(self, event: yaml.Event) -> None:
        self._values += 1
        if self._values > self._most_values:
            message = f'more than {self._most_values:,} values: {self._advice}'
            raise _refusal(event, message, 'too-many')
        if event.anchor is not None:
            anchor = quoted('&' + event.anchor)
            raise _refusal(event, f'anchors are not accepted: {anchor}; delete it', 'unsupported')
        if event.tag is not None:
            tag = quoted(str(event.tag))
            raise _refusal(event, f'tags are not accepted: {tag}; delete it', 'unsupported')


def node_of(event: Scalar) -> ScalarNode:
    """Return the scalar of a parser event as text, without conversion to a number."""
    return ScalarNode(event.value, event.start_mark.line + 1, bool(event.style))


def _line_of(error: yaml.MarkedYAMLError) -> int:
    mark = error.problem_mark or error.context_mark
    return mark.line + 1 if mark else 0


def _refusal(event: yaml.Event, reason: str, code: str) -> YamlError:
    return YamlError(event.start_mark.line + 1, reason, code)
