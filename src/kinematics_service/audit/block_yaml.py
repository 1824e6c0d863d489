"""
The YAML that `ros2 topic echo` prints: mappings, lists, numbers, words; read fast.

A thousand points are half a megabyte, for which a complete reader of YAML takes six seconds.
Anchors, tags and texts over several lines are not read; the error names the line.
"""

import re
from typing import Any, NamedTuple

KEY = re.compile(
    r"""("[^"]*"|'[^']*'|[^\s\[\]{},"'#&*!|>%@`-][^\[\]{},"'#]*?|-?\w[^:]*?)\s*:(?:\s+|$)"""
)
NUMBER = re.compile(r'[-+]?(?:\.\d+|\d[\d_]*(?:\.\d*)?)(?:[eE][-+]?\d+)?')
SPECIAL = {'.nan': float('nan'), '.inf': float('inf'), '-.inf': -float('inf')}
FLOW = re.compile(r"""\s*("(?:[^"\\]|\\.)*"|'(?:[^']|'')*'|[\[\]{},]|:(?=\s|$)|[^\[\]{},:]+|:)""")
DEEPEST = 40


class BlockYamlError(Exception):
    """
    A text that is not of this kind; its text is `line: reason`.

    """


class _Line(NamedTuple):
    number: int
    indent: int
    text: str


def read_documents(text: str) -> list[Any]:
    """
    Return the documents of a text: dicts, lists, numbers, texts, None.

    Raises
    ------
    BlockYamlError
        It is not of this kind; the line and the reason.

    """
    documents: list[list[_Line]] = [[]]
    for number, raw in enumerate(text.splitlines(), start=1):
        stripped = raw.strip()
        if raw.startswith(('---', '...')) and not raw[3:].strip():
            documents.append([])
        elif stripped and not stripped.startswith(('#', '%')):
            indent = len(raw) - len(raw.lstrip(' '))
            if raw[indent] == '\t':
                raise BlockYamlError(f'{number}: a tab; indent with spaces')
            documents[-1].append(_Line(number, indent, _without_comment(stripped)))
    return [_Reader(lines).read() for lines in documents if lines]


def _without_comment(text: str) -> str:
    if ' #' not in text or '"' in text or "'" in text:
        return text
    return text.partition(' #')[0].rstrip()


class _Reader:
    def __init__(self, lines: list[_Line]) -> None:
        self.lines, self.at = lines, 0

    def read(self) -> Any:
        value = self._value(self.lines[0].indent, 0)
        if self.at < len(self.lines):
            raise self._fault('is indented differently from what stands above it')
        return value

    def _value(self, indent: int, depth: int) -> Any:
        if depth > DEEPEST:
            raise self._fault('nested too deeply')
        text = self.lines[self.at].text
        if text == '-' or text.startswith('- '):
            return self._list(indent, depth)
        if KEY.match(text) and text[0] not in '[{':
            return self._mapping(indent, depth)
        self.at += 1
        return self._inline(text)

    def _list(self, indent: int, depth: int) -> list[Any]:
        items: list[Any] = []
        while self.at < len(self.lines):
            line = self.lines[self.at]
            if line.indent != indent or not (line.text == '-' or line.text.startswith('- ')):
                break
            rest = line.text[1:].lstrip()
            if not rest:
                self.at += 1
                items.append(self._below(indent + 1, depth))
            elif rest.startswith('- ') or (KEY.match(rest) and rest[0] not in '[{'):
                # What follows the dash is the first line of the item.
                inner = indent + len(line.text) - len(rest)
                self.lines[self.at] = _Line(line.number, inner, rest)
                items.append(self._value(inner, depth + 1))
            else:
                self.at += 1
                items.append(self._inline(rest))
        return items

    def _mapping(self, indent: int, depth: int) -> dict[str, Any]:
        entries: dict[str, Any] = {}
        while self.at < len(self.lines):
            line = self.lines[self.at]
            match = KEY.match(line.text)
            if line.indent != indent or match is None or line.text.startswith('- '):
                break
            key, rest = match[1].strip('"\''), line.text[match.end() :]
            if key in entries:
                raise self._fault(f'the key {key[:40]!a} is there twice')
            self.at += 1
            entries[key] = self._inline(rest) if rest else self._below_key(indent, depth)
        return entries

    def _below_key(self, indent: int, depth: int) -> Any:
        # A list may stand as far left as the key it belongs to.
        if self.at < len(self.lines):
            line = self.lines[self.at]
            if line.indent == indent and (line.text == '-' or line.text.startswith('- ')):
                return self._list(indent, depth + 1)
        return self._below(indent + 1, depth)

    def _below(self, least: int, depth: int) -> Any:
        if self.at >= len(self.lines) or self.lines[self.at].indent < least:
            return None
        return self._value(self.lines[self.at].indent, depth + 1)

    def _inline(self, text: str) -> Any:
        # A value on a line of its own, or a list in brackets over several lines.
        if text[0] in '&*!|>':
            raise self._fault(f'{text[:20]!a} is not read here', back=1)
        if text[0] not in '[{':
            return _scalar(text)
        while text.count('[') + text.count('{') > text.count(']') + text.count('}'):
            if self.at >= len(self.lines):
                raise self._fault('a bracket is never closed', back=1)
            text += ' ' + self.lines[self.at].text
            self.at += 1
        tokens = [token.strip() for token in FLOW.findall(text)]
        flow = _Flow([token for token in tokens if token])
        value = flow.value(0)
        if flow.at != len(flow.tokens) or flow.broken:
            raise self._fault('is not a list or mapping in brackets', back=1)
        return value

    def _fault(self, reason: str, back: int = 0) -> BlockYamlError:
        line = self.lines[max(0, min(self.at - back, len(self.lines) - 1))]
        return BlockYamlError(f'{line.number}: not valid YAML of this kind: {reason}')


class _Flow:
    """
    A list or mapping in brackets.

    """

    def __init__(self, tokens: list[str]) -> None:
        self.tokens, self.at, self.broken = tokens, 0, False

    def _next(self) -> str:
        self.at += 1
        if self.at > len(self.tokens):
            self.broken = True
            return ''
        return self.tokens[self.at - 1]

    def value(self, depth: int) -> Any:
        token = self._next()
        if depth > DEEPEST:
            self.broken = True
        if self.broken or token in ('', ']', '}', ',', ':'):
            self.broken = True
            return None
        if token == '[':
            return self._items(depth)
        if token == '{':
            return self._entries(depth)
        return _scalar(token)

    def _items(self, depth: int) -> list[Any]:
        items: list[Any] = []
        while not self.broken:
            if self.tokens[self.at : self.at + 1] == [']']:
                self.at += 1
                break
            items.append(self.value(depth + 1))
            end = self._next()
            if end == ']':
                break
            self.broken |= end != ','
        return items

    def _entries(self, depth: int) -> dict[str, Any]:
        entries: dict[str, Any] = {}
        while not self.broken:
            key = self._next()
            if key == '}':
                break
            self.broken |= self._next() != ':'
            entries[key.strip('"\'')] = None if self.broken else self.value(depth + 1)
            end = self._next()
            if end == '}':
                break
            self.broken |= end != ','
        return entries


def _scalar(text: str) -> Any:
    if text[0] in '"\'':
        return text[1:-1]
    if NUMBER.fullmatch(text):
        return float(text.replace('_', ''))
    return SPECIAL.get(text.lower(), None if text in ('null', '~') else text)
