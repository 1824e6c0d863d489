# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Check entries of a robot file: mappings with a fixed set of keys and value types.

Every value arrives as the text that the user wrote (`ScalarNode`), not as a bool or a number. A
value that is missing or has a fault is None in an entry.
"""

import difflib
import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from keyword import iskeyword
from typing import Annotated, Any, ClassVar, TypeAlias, TypeVar, get_origin, get_type_hints

from ....typography import plain_names
from .fault_report import MAX_FAULTS, Place, quoted, shown
from .yaml_document import Path, ScalarNode, Yaml

NULL = re.compile(r'~|null|Null|NULL|')
WHOLE = re.compile(r'[0-9]{1,6}')
TRUTH = re.compile(r'true|True|TRUE|false|False|FALSE')


# The type of the value of a key in an entry, after the value was checked.
Value: TypeAlias = Yaml | str | int | bool | list[str | None]
Check = Callable[[Yaml], Any]


class WrongValue(Exception):
    """A value has a fault; `suggestion` is the accepted word that the user probably meant."""

    def __init__(self, message: str, code: str, suggestion: str | None = None) -> None:
        super().__init__(message)
        self.code, self.suggestion = code, suggestion


def is_null(value: Yaml) -> bool:
    """Return whether a value is YAML's null: an unquoted `null`, `~`, or no text."""
    return isinstance(value, ScalarNode) and not value.quoted and bool(NULL.fullmatch(value.text))


def _scalar(value: Yaml, expected: str) -> ScalarNode:
    if not isinstance(value, ScalarNode):
        raise WrongValue(f'expected {expected}, not {shown(value)}', 'wrong-type')
    if is_null(value):
        raise WrongValue(f'has no value; write {expected}', 'empty')
    if not value.quoted and TRUTH.fullmatch(value.text):
        raise WrongValue(f"expected {expected}, not the truth value '{value.text}'", 'wrong-type')
    return value


MAX_NAME_LENGTH = 256
MAX_CITATION_LENGTH = 2000  # characters; the key `source` may have several citations


def _text(value: Yaml, longest: int) -> str:
    text = _scalar(value, 'a text').text
    if not text:
        raise WrongValue('is empty; write a text', 'empty')
    if not text.isprintable():
        message = f'expected a text without control characters, not {quoted(text)}'
        raise WrongValue(message, 'control-characters')
    if len(text) > longest:
        raise WrongValue(f'too long: {len(text)} characters (at most {longest})', 'too-long')
    return text


_word = partial(_text, longest=MAX_NAME_LENGTH)
_citation = partial(_text, longest=MAX_CITATION_LENGTH)


def _formula(value: Yaml) -> str:
    node = _scalar(value, 'a text')
    return _word(node._replace(text=plain_names(node.text)))


def _number(value: Yaml) -> str:
    return plain_names(_scalar(value, 'a number or an expression').text).strip()


def _whole(value: Yaml) -> int:
    text = _scalar(value, 'a whole number').text.strip()
    if not WHOLE.fullmatch(text):
        raise WrongValue(f'expected a whole number, not {quoted(text)}', 'not-a-number')
    return int(text)


def _truth(value: Yaml) -> bool:
    if isinstance(value, ScalarNode) and not value.quoted and TRUTH.fullmatch(value.text):
        return value.text.lower() == 'true'
    raise WrongValue(f'expected true or false, not {shown(value)}', 'wrong-type')


def _listed(length: int | None, expected: str) -> Callable[[Yaml], list[Yaml]]:
    def check(value: Yaml) -> list[Yaml]:
        if not isinstance(value, list):
            raise WrongValue(f'expected {expected}, not {shown(value)}', 'wrong-type')
        if length is not None and len(value) != length:
            comma = ' (a decimal is written with a point: 0.4)' if len(value) > length else ''
            raise WrongValue(f'expected {expected}, not {len(value)}{comma}', 'wrong-length')
        return value

    return check


def one_of(*accepted: str, also: Mapping[str, str] | None = None) -> Check:
    """
    Return a function that checks a value, and accepts only the given words.

    `also` maps wrong words to the accepted words that the error suggests.
    """

    def check(value: Yaml) -> str:
        text = _scalar(value, ' or '.join(accepted)).text
        if text not in accepted:
            suggestion = meant_by(text, accepted, also)
            message = f'unknown {quoted(text)}{did_you_mean(suggestion)}{choice(accepted)}'
            raise WrongValue(message, 'unknown-name', suggestion)
        return text

    return check


def called(**words: str) -> dict[str, str]:
    """
    Return a dictionary from words that users write by mistake to the accepted words.

    `called(a='length l')` maps the words `length` and `l` to the accepted word `a`.
    """
    return {
        other: accepted.rstrip('_')
        for accepted, others in words.items()
        for other in others.split()
    }


def meant_by(
    text: str, accepted: tuple[str, ...], also: Mapping[str, str] | None = None
) -> str | None:
    """
    Return the accepted word that is most similar to a wrong word; None if no word is similar.
    """
    folded = text[:60].lower().replace('-', '_').replace(' ', '_')
    if folded in accepted:
        return folded
    if also and folded in also:
        return also[folded]
    if len(text) < 3:
        return None  # too many accepted words are similar to a text of one or two letters
    near = difflib.get_close_matches(text[:60], accepted, n=1)
    return near[0] if near else None


def did_you_mean(word: str | None) -> str:
    """Return `, did you mean 'alpha'?` for the word `alpha`, and '' for None."""
    return f', did you mean {word!r}?' if word else ''


def choice(accepted: tuple[str, ...]) -> str:
    """Return the accepted words as the end of a message: ` (accepted: a, alpha)`."""
    return f' (accepted: {", ".join(accepted)})'


# Types of the values of keys. Each type is annotated with the function that checks a value. The
# type of a list has a second function, which checks each item.
Word = Annotated[str | None, _word]
Formula = Annotated[str | None, _formula]
Citation = Annotated[str | None, _citation]
Number = Annotated[str | None, _number]
Whole = Annotated[int | None, _whole]
Truth = Annotated[bool | None, _truth]
Numbers = Annotated[list[str | None] | None, _listed(None, 'a list of numbers'), _number]
Pair = Annotated[list[str | None] | None, _listed(2, 'two numbers, [lower, upper]'), _number]
Triple = Annotated[list[str | None] | None, _listed(3, 'three numbers'), _number]
Words = Annotated[list[str | None] | None, _listed(None, 'a list of words'), _word]


class Entry:
    """
    A mapping of the robot file as a frozen object. Subclasses annotate one attribute for each key.

    If a key is a Python keyword, the name of its attribute ends with an underscore.
    """

    noun: ClassVar[str] = 'an entry'
    required: ClassVar[tuple[str, ...]] = ()
    also: ClassVar[Mapping[str, str]] = {}  # maps wrong keys to keys that the error suggests

    # maps each key to the functions that check the value of the key
    checks: ClassVar[Mapping[str, tuple[Check, ...]]]

    def __init_subclass__(cls) -> None:
        cls.checks = {
            name.rstrip('_'): getattr(hint, '__metadata__', ())
            for name, hint in get_type_hints(cls, include_extras=True).items()
            if get_origin(hint) is not ClassVar
        }

    def __init__(self, values: Mapping[str, Value | None]) -> None:
        for key in type(self).checks:
            vars(self)[f'{key}_' if iskeyword(key) else key] = values.get(key)

    def __setattr__(self, name: str, value: Value) -> None:
        raise AttributeError(f'an entry is frozen: {name}')


def _apply(
    checks: Sequence[Check], value: Yaml, place: Path
) -> tuple[Any, list[tuple[Path, WrongValue]]]:
    # Apply the functions `checks` to a value. Return the checked value, and the place and the
    # reason of each fault.
    if not checks:
        return value, []
    check, *item_checks = checks
    try:
        result = check(value)
    except WrongValue as wrong:
        return None, [(place, wrong)]
    if not item_checks:
        return result, []
    items = [_apply(item_checks, item, (*place, k)) for k, item in enumerate(result)]
    return [item for item, _ in items], [refusal for _, refusals in items for refusal in refusals]


def _before_colon(key: str, keys: tuple[str, ...]) -> str | None:
    # Return the word before the colon if this word is a key: `a` for the text `a:0.4`. Without a
    # space after the colon, YAML reads the text as one key without a value.
    word, colon, _ = key.partition(':')
    return word if colon and word in keys else None


EntryType = TypeVar('EntryType', bound=Entry)
Result = TypeVar('Result')


def checked(kind: type[EntryType], data: Yaml, at: Place) -> EntryType:
    """
    Check a mapping of the file, and return it as an entry, in which values with faults are None.

    If a key or word is misspelled, the fault is reported, and the entry has the key or word that
    the user probably meant. Therefore one mistake causes only one fault.
    """
    checks, keys = kind.checks, tuple(kind.checks)
    if not isinstance(data, dict):
        expected = f'{{{", ".join(keys)}}}'
        advice = _named(keys, data) if isinstance(data, list) else ''
        message = f'expected {kind.noun} as a mapping {expected}, not {shown(data)}{advice}'
        at.fault(message, 'wrong-type')
        return kind({})
    # The search for a similar key takes time, so do it only for the unknown keys that the message
    # lists.
    unknown = [key for key in data if key not in checks]
    listed = [] if at.report.full else unknown[:MAX_FAULTS]
    renamed = {key: _before_colon(key, keys) or meant_by(key, keys, kind.also) for key in listed}
    for key in kind.required:
        if key not in data and key not in renamed.values():
            needed = ', '.join(kind.required)
            message = f'the key {key!r} is missing ({kind.noun} needs: {needed})'
            at.fault(message, 'missing-key')
    values: dict[str, Value | None] = {}
    for key in [key for key in keys if key in data]:
        checked_value, refusals = _apply(checks[key], data[key], (key,))
        values[key] = None if refusals else checked_value
        for place, wrong in refusals:
            at[place].fault(str(wrong), wrong.code)
            if wrong.suggestion and place == (key,):
                values[key], _ = _apply(checks[key], ScalarNode(wrong.suggestion, 0, False), place)
    for key in unknown:
        word = renamed.get(key)
        if _before_colon(key, keys):
            advice = f"write '{key.replace(':', ': ', 1)}', with a space after the colon"
            at[key].fault(advice, 'missing-space')
            continue
        if key.isdecimal():
            at[key].fault('a decimal is written with a point: 0.4', 'decimal-comma')
            continue
        at[key].fault(f'unknown key{did_you_mean(word)}{choice(keys)}', 'unknown-key')
        if word and word not in data:
            value, refusals = _apply(checks[word], data[key], ())
            values[word] = None if refusals else value
    return kind(values)


def _named(keys: tuple[str, ...], values: list[Yaml]) -> str:
    # A mapping is expected, but the value is a list, such as a row copied from a table. Return
    # advice that pairs the keys with the items of the list.
    texts = [value.text for value in values if isinstance(value, ScalarNode)]
    if not len(keys) == len(values) == len(texts):
        return ''
    pairs = ', '.join(f'{key}: {text}' for key, text in zip(keys, texts))
    return f'; write {{{pairs}}}, if this is their order'


def checked_number(data: Yaml, at: Place) -> str | None:
    """Return the text of a number or an expression. Report faults; after a fault return None."""
    return _reported(_number, data, at)


def checked_word(data: Yaml, at: Place) -> str | None:
    """
    Return the text of a value. Report faults, such as control characters; after a fault return
    None.
    """
    return _reported(_word, data, at)


def checked_formula(data: Yaml, at: Place) -> str | None:
    """
    Return the text of a formula in ASCII, such as `theta1` for the Greek letter with index. Report
    faults; after a fault return None.
    """
    return _reported(_formula, data, at)


def checked_list(data: Yaml, at: Place, noun: str, length: int | None = None) -> list[Yaml]:
    """Return the items of a list. Report faults; after a fault return no items."""
    return _reported(_listed(length, noun), data, at) or []


def checked_mapping(data: Yaml, at: Place, noun: str) -> dict[str, Yaml]:
    """
    Return a mapping of the robot file, such as `constants`, in which the user chooses the keys.

    If the value is missing, the result is empty. If the value is not a mapping, the function
    reports a fault, and the result is empty.
    """
    if data is not None and not isinstance(data, dict):
        at.fault(f'expected a mapping of {noun}, not {shown(data)}', 'wrong-type')
    return data if isinstance(data, dict) else {}


def _reported(check: Callable[[Yaml], Result], data: Yaml, at: Place) -> Result | None:
    try:
        return check(data)
    except WrongValue as wrong:
        at.fault(str(wrong), wrong.code)
        return None
