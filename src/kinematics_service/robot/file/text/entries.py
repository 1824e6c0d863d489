"""
Entries of a robot file: mappings whose keys and kinds of values are known.

Every value arrives as the text the user wrote (`ScalarNode`), so nothing is converted on the
way: `true` never becomes 1.0. What is missing or has been refused is None in an entry.
"""

import difflib
import re
from collections.abc import Callable, Mapping
from functools import partial
from keyword import iskeyword
from typing import (
    Annotated,
    Any,
    ClassVar,
    NamedTuple,
    TypeAlias,
    TypeVar,
    get_origin,
    get_type_hints,
)

from ....typography import plain_names
from .fault_report import MAX_FAULTS, Place, quoted, shown
from .yaml_document import Path, ScalarNode, Yaml

NULL = re.compile(r'~|null|Null|NULL|')
WHOLE = re.compile(r'[0-9]{1,6}')
TRUTH = re.compile(r'true|True|TRUE|false|False|FALSE')


# A value of an entry, as its check returns it.
Value: TypeAlias = Yaml | str | int | bool | list[str | None]
Check = Callable[[Yaml], Any]


class WrongValue(Exception):
    """A value is refused: why, and the word that was most likely meant."""

    def __init__(self, message: str, meant: str | None = None) -> None:
        super().__init__(message)
        self.meant = meant


def is_null(value: Yaml) -> bool:
    """Return whether a key stands without a value."""
    return isinstance(value, ScalarNode) and not value.quoted and bool(NULL.fullmatch(value.text))


def _scalar(value: Yaml, wanted: str) -> ScalarNode:
    if not isinstance(value, ScalarNode):
        raise WrongValue(f'expected {wanted}, not {shown(value)}')
    if is_null(value):
        raise WrongValue(f'has no value: expected {wanted}')
    if not value.quoted and TRUTH.fullmatch(value.text):
        raise WrongValue(f"expected {wanted}, not the truth value '{value.text}'")
    return value


# Names are short; a source may be a whole citation, or several.
LONGEST_NAME, LONGEST_CITATION = 256, 2000


def _text(value: Yaml, longest: int) -> str:
    text = _scalar(value, 'a text').text
    if not text:
        raise WrongValue('is empty: expected a text')
    if not text.isprintable():
        raise WrongValue(f'expected a text without control characters, not {quoted(text)}')
    if len(text) > longest:
        raise WrongValue(f'too long: {len(text)} characters (at most {longest})')
    return text


_word = partial(_text, longest=LONGEST_NAME)
_citation = partial(_text, longest=LONGEST_CITATION)


def _formula(value: Yaml) -> str:
    node = _scalar(value, 'a text')
    return _word(node._replace(text=plain_names(node.text)))


def _number(value: Yaml) -> str:
    return plain_names(_scalar(value, 'a number or an expression').text).strip()


def _whole(value: Yaml) -> int:
    text = _scalar(value, 'a whole number').text.strip()
    if not WHOLE.fullmatch(text):
        raise WrongValue(f'expected a whole number, not {quoted(text)}')
    return int(text)


def _truth(value: Yaml) -> bool:
    if isinstance(value, ScalarNode) and not value.quoted and TRUTH.fullmatch(value.text):
        return value.text.lower() == 'true'
    raise WrongValue(f'expected true or false, not {shown(value)}')


def _listed(length: int | None, wanted: str) -> Callable[[Yaml], list[Yaml]]:
    def check(value: Yaml) -> list[Yaml]:
        if not isinstance(value, list):
            raise WrongValue(f'expected {wanted}, not {shown(value)}')
        if length is not None and len(value) != length:
            comma = ' (a decimal is written with a point: 0.4)' if len(value) > length else ''
            raise WrongValue(f'expected {wanted}, not {len(value)}{comma}')
        return value

    return check


def one_of(*accepted: str, also: Mapping[str, str] | None = None) -> Check:
    """
    Accept one of a few words; `also` has other words people use for them, to suggest the right.
    """

    def check(value: Yaml) -> str:
        text = _scalar(value, ' or '.join(accepted)).text
        if text not in accepted:
            meant = meant_by(text, accepted, also)
            raise WrongValue(
                f'unknown {quoted(text)}{did_you_mean(meant)}{choice(accepted)}', meant
            )
        return text

    return check


def called(**words: str) -> dict[str, str]:
    """Return the accepted word for each of the other words people use for it."""
    return {
        other: accepted.rstrip('_')
        for accepted, others in words.items()
        for other in others.split()
    }


def meant_by(
    text: str, accepted: tuple[str, ...], also: Mapping[str, str] | None = None
) -> str | None:
    """Return the accepted word that a text most likely means, or None."""
    folded = text[:60].lower().replace('-', '_').replace(' ', '_')
    if folded in accepted:
        return folded
    if also and folded in also:
        return also[folded]
    if len(text) < 3:
        return None  # anything is near to 'm'
    near = difflib.get_close_matches(text[:60], accepted, n=1)
    return near[0] if near else None


def did_you_mean(meant: str | None) -> str:
    """Return `, did you mean 'alpha'?`, or nothing where no word comes near."""
    return f', did you mean {meant!r}?' if meant else ''


def choice(accepted: tuple[str, ...]) -> str:
    """Return the accepted words in brackets."""
    return f' (accepted: {", ".join(accepted)})'


# What a value must be, and for a list what each of its items must be.
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
    A mapping of the file, frozen: annotated attributes are its keys, an underscore behind a word
    of Python's; their values in the class are those of what is missing.
    """

    noun: ClassVar[str] = 'an entry'
    required: ClassVar[tuple[str, ...]] = ()
    also: ClassVar[Mapping[str, str]] = {}  # what people call its keys

    def __init__(self, values: Mapping[str, Value]) -> None:
        vars(self).update(values)

    def __setattr__(self, name: str, value: Value) -> None:
        raise AttributeError(f'an entry is frozen: {name}')

    @classmethod
    def keys(cls) -> tuple[str, ...]:
        """Return the accepted keys as the file writes them."""
        return tuple(_checks(cls))


def _checks(kind: type[Entry]) -> dict[str, tuple[Check, ...]]:
    # By key.
    if kind not in _CHECKS:
        _CHECKS[kind] = {
            name.rstrip('_'): getattr(hint, '__metadata__', ())
            for name, hint in get_type_hints(kind, include_extras=True).items()
            if get_origin(hint) is not ClassVar
        }
    return _CHECKS[kind]


_CHECKS: dict[type[Entry], dict[str, tuple[Check, ...]]] = {}


class _Refusal(NamedTuple):
    # Where in the entry, why, and what was most likely meant.
    place: Path
    message: str
    meant: str | None


def _taken(checks: tuple[Check, ...], value: Yaml, place: Path) -> tuple[Any, list[_Refusal]]:
    # A value as it is read, and why it or some of its items are refused.
    if not checks:
        return value, []
    whole, *each = checks
    try:
        result = whole(value)
    except WrongValue as wrong:
        return None, [_Refusal(place, str(wrong), wrong.meant)]
    if not each:
        return result, []
    items = [_taken(tuple(each), item, (*place, k)) for k, item in enumerate(result)]
    return [item for item, _ in items], [one for _, refused in items for one in refused]


def _before_colon(key: str, keys: tuple[str, ...]) -> str | None:
    # To YAML `a:0.4` is one word, without a value.
    word, colon, _ = key.partition(':')
    return word if colon and word in keys else None


EntryType = TypeVar('EntryType', bound=Entry)
Result = TypeVar('Result')


def checked(kind: type[EntryType], data: Yaml, at: Place) -> EntryType:
    """
    Return an entry with every fault reported, and None for each key that has one.

    Where a key or a word has been refused and another one was most likely meant, the entry is
    as if that stood there: one slip is one fault, and what it stands for is judged too.
    """
    checks, keys = _checks(kind), kind.keys()
    if not isinstance(data, dict):
        wanted = f'{{{", ".join(keys)}}}'
        advice = _named(keys, data) if isinstance(data, list) else ''
        message = f'expected {kind.noun} as a mapping {wanted}, not {shown(data)}{advice}'
        at.fault(message)
        return kind({})
    # Of a file with thousands of unknown keys only the listed ones are worth a guess.
    unknown = [key for key in data if key not in checks]
    listed = [] if at.report.full else unknown[:MAX_FAULTS]
    renamed = {key: _before_colon(key, keys) or meant_by(key, keys, kind.also) for key in listed}
    for key in kind.required:
        if key not in data and key not in renamed.values():
            needed = ', '.join(kind.required)
            at.fault(f'the key {key!r} is missing ({kind.noun} needs: {needed})')
    intact, meant = _judged({key: data[key] for key in keys if key in data}, checks, at)
    for key in unknown:
        word = renamed.get(key)
        if _before_colon(key, keys):
            at[key].fault(f"write '{key.replace(':', ': ', 1)}', with a space")
            continue
        if key.isdecimal():
            at[key].fault('a decimal is written with a point: 0.4')
            continue
        at[key].fault(f'unknown key{did_you_mean(word)}{choice(keys)}')
        if word and word not in data:
            value, refusals = _taken(checks[word], data[key], ())
            meant |= {} if refusals else {word: value}
    values = {**intact, **meant}
    return kind({f'{key}_' if iskeyword(key) else key: value for key, value in values.items()})


def _named(keys: tuple[str, ...], values: list[Yaml]) -> str:
    # A row without its names, as it is copied from a table.
    texts = [value.text for value in values if isinstance(value, ScalarNode)]
    if not len(keys) == len(values) == len(texts):
        return ''
    pairs = ', '.join(f'{key}: {text}' for key, text in zip(keys, texts))
    return f': write {{{pairs}}}, if they stand in this order'


def _judged(
    data: dict[str, Yaml], checks: dict[str, tuple[Check, ...]], at: Place
) -> tuple[dict[str, Yaml], dict[str, Yaml]]:
    # What has no fault, and what was meant by words that have one.
    intact: dict[str, Yaml] = {}
    meant: dict[str, Yaml] = {}
    for key, value in data.items():
        taken, refusals = _taken(checks[key], value, (key,))
        if not refusals:
            intact[key] = taken
        for refusal in refusals:
            at[refusal.place].fault(refusal.message)
            if refusal.meant and len(refusal.place) == 1:
                node = ScalarNode(refusal.meant, 0, quoted=False)
                meant[key], _ = _taken(checks[key], node, ())
    return intact, meant


def checked_number(data: Yaml, at: Place) -> str | None:
    """Return the text of a number or an expression, or None with its fault reported."""
    return _reported(_number, data, at)


def checked_word(data: Yaml, at: Place) -> str | None:
    """Return a printable text, or None with its fault reported."""
    return _reported(_word, data, at)


def checked_formula(data: Yaml, at: Place) -> str | None:
    """Return a printable text in plain signs, or None with its fault reported."""
    return _reported(_formula, data, at)


def checked_list(data: Yaml, at: Place, noun: str, length: int | None = None) -> list[Yaml]:
    """Return the items of a list, or none with the fault reported."""
    return _reported(_listed(length, noun), data, at) or []


def checked_mapping(data: Yaml, at: Place, noun: str) -> dict[str, Yaml]:
    """
    Return a mapping of names that the user chooses; empty where there is none or has a fault.
    """
    if data is not None and not isinstance(data, dict):
        at.fault(f'expected a mapping of {noun}, not {shown(data)}')
    return data if isinstance(data, dict) else {}


def _reported(check: Callable[[Yaml], Result], data: Yaml, at: Place) -> Result | None:
    try:
        return check(data)
    except WrongValue as wrong:
        at.fault(str(wrong))
        return None
