"""
The YAML of a plan, read by libyaml's events, each looked at before anything is built.

What could build objects or grow (tags, anchors, aliases) is refused at the event that brings it. A
plain scalar is a number where YAML 1.2 says so: `1e-3` is one, `1_0` and `0o7` are texts.
"""

import re
from typing import Any

import yaml

DEEPEST = 40
# A point of a six-joint arm has some thirty values: more than 100,000 points.
MOST_VALUES = 4_000_000
NUMBER = re.compile(r'[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?')
WORDS = {
    **dict.fromkeys(('', '~', 'null', 'Null', 'NULL')),
    **dict.fromkeys(('true', 'True', 'TRUE'), True),
    **dict.fromkeys(('false', 'False', 'FALSE'), False),
    **dict.fromkeys(('.nan', '.NaN', '.NAN'), float('nan')),
    **{sign + word: float(f'{sign}inf') for word in ('.inf', '.Inf', '.INF') for sign in '+-'},
    **dict.fromkeys(('.inf', '.Inf', '.INF'), float('inf')),
}
# Without libyaml PyYAML reads the same, twenty times as slowly.
LOADER: Any = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)


class PlanYamlError(Exception):
    """A text that is not accepted; its text is `line: reason`."""


def read_documents(text: str) -> list[Any]:
    """
    Return the documents of a text: dicts, lists, numbers, texts, truth values, None.

    Raises
    ------
    PlanYamlError
        It is not YAML, or something that is refused: anchors, aliases, tags, directives, a key
        that is there twice, too many values, nested too deeply.
    """
    builder = _DocumentBuilder()
    try:
        for event in yaml.parse(text, Loader=LOADER):
            builder.take(event)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        reason = ', '.join(str(part) for part in (error.context, error.problem) if part)
        advice = ' (a tab? indent with spaces)' if 'cannot start any token' in reason else ''
        raise PlanYamlError(f'{mark.line + 1}: not valid YAML: {reason}{advice}') from None
    except yaml.YAMLError as error:
        at = min(getattr(error, 'position', None) or 0, len(text))
        line = text.count('\n', 0, at) + 1
        reason = str(getattr(error, 'reason', '') or error)
        raise PlanYamlError(f'{line}: not valid YAML: {" ".join(reason.split())}') from None
    return [document for document in builder.documents if document is not None]


class _DocumentBuilder:
    """The documents under construction: open lists and mappings, innermost last."""

    def __init__(self) -> None:
        self.documents: list[Any] = []
        self._open: list[Any] = [self.documents]
        # The key whose value comes next, for each open mapping.
        self._keys: list[Any] = [None]
        self._values = 0

    def take(self, event: Any) -> None:
        kind = type(event)
        if kind is yaml.ScalarEvent:
            self._refuse_what_grows(event)
            self._add(_value(event), event)
        elif kind is yaml.SequenceStartEvent or kind is yaml.MappingStartEvent:
            self._refuse_what_grows(event)
            opened: Any = [] if kind is yaml.SequenceStartEvent else {}
            self._add(opened, event)
            self._open.append(opened)
            self._keys.append(_NO_KEY)
            if len(self._open) > DEEPEST:
                raise _refusal(event, f'nested more than {DEEPEST} deep')
        elif kind is yaml.SequenceEndEvent or kind is yaml.MappingEndEvent:
            self._open.pop()
            self._keys.pop()
        elif kind is yaml.AliasEvent:
            raise _refusal(event, f'aliases are not accepted: {"*" + event.anchor[:40]!a}')
        elif kind is yaml.DocumentStartEvent and (event.version or event.tags):
            raise _refusal(event, 'directives (%YAML, %TAG) are not accepted')

    def _refuse_what_grows(self, event: Any) -> None:
        if event.anchor is not None:
            raise _refusal(event, f'anchors are not accepted: {"&" + event.anchor[:40]!a}')
        if event.tag is not None:
            raise _refusal(event, f'tags are not accepted: {str(event.tag)[:40]!a}')
        self._values += 1
        if self._values > MOST_VALUES:
            raise _refusal(event, f'more than {MOST_VALUES:,} values: write it as a bag')

    def _add(self, value: Any, event: Any) -> None:
        innermost = self._open[-1]
        if type(innermost) is list:
            innermost.append(value)
        elif self._keys[-1] is not _NO_KEY:
            innermost[self._keys[-1]] = value
            self._keys[-1] = _NO_KEY
        else:
            if type(event) is not yaml.ScalarEvent:
                raise _refusal(event, 'a key must be a word, not a list or mapping')
            if event.value in innermost:
                raise _refusal(event, f'the key {event.value[:40]!a} is there twice')
            self._keys[-1] = event.value


_NO_KEY = object()


def _refusal(event: Any, reason: str) -> PlanYamlError:
    return PlanYamlError(f'{event.start_mark.line + 1}: {reason}')


def _value(event: Any) -> Any:
    text: str = event.value
    if not event.implicit[0]:
        return text  # in quotes, or over several lines
    if NUMBER.fullmatch(text):
        return float(text)
    return WORDS.get(text, text)
