"""
Entries of a robot file: mappings whose keys and kinds of values are known, checked by pydantic.

Every value arrives as the text the user wrote (`ScalarNode`), so nothing is converted on the
way: `true` never becomes 1.0. What is missing or has been refused is None in an entry.
"""

import difflib
import re
from collections.abc import Callable, Mapping
from typing import Annotated, Any, ClassVar, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, PlainValidator, ValidationError
from pydantic_core import PydanticCustomError

from .fault_report import MAX_FAULTS, FaultReport, quoted, shown
from .yaml_document import Path, ScalarNode

NULL = re.compile(r'~|null|Null|NULL|')
TRUTH = re.compile(r'true|True|TRUE|false|False|FALSE')


def _wrong(message: str, meant: str | None = None) -> PydanticCustomError:
    # The message is an argument, not the template: it may hold braces of the user's.
    return PydanticCustomError('robot_file', '{message}', {'message': message, 'meant': meant})


def _scalar(value: Any, wanted: str) -> ScalarNode:
    if not isinstance(value, ScalarNode):
        raise _wrong(f'expected {wanted}, not {shown(value)}')
    if not value.quoted and NULL.fullmatch(value.text):
        raise _wrong(f'has no value: expected {wanted}')
    if not value.quoted and TRUTH.fullmatch(value.text):
        raise _wrong(f"expected {wanted}, not the truth value '{value.text}'")
    return value


# Names are short; a source may be a whole citation, or several.
LONGEST_NAME, LONGEST_CITATION = 256, 2000


def _text(value: Any, longest: int) -> str:
    text = _scalar(value, 'a text').text
    if not text:
        raise _wrong('is empty: expected a text')
    if not text.isprintable():
        raise _wrong(f'expected a text without control characters, not {quoted(text)}')
    if len(text) > longest:
        raise _wrong(f'too long: {len(text)} characters (at most {longest})')
    return text


def _word(value: Any) -> str:
    return _text(value, LONGEST_NAME)


def _citation(value: Any) -> str:
    return _text(value, LONGEST_CITATION)


def _number(value: Any) -> str:
    return _scalar(value, 'a number or an expression').text.strip()


def _truth(value: Any) -> bool:
    if isinstance(value, ScalarNode) and not value.quoted and TRUTH.fullmatch(value.text):
        return value.text.lower() == 'true'
    raise _wrong(f'expected true or false, not {shown(value)}')


def _listed(length: int | None, wanted: str) -> Callable[[Any], Any]:
    def check(value: Any) -> Any:
        if not isinstance(value, list):
            raise _wrong(f'expected {wanted}, not {shown(value)}')
        if length is not None and len(value) != length:
            raise _wrong(f'expected {wanted}, not {len(value)}')
        return value

    return check


def one_of(*accepted: str, also: Mapping[str, str] | None = None) -> PlainValidator:
    """
    Accept one of a few words; `also` has other words people use for them, to suggest the right.

    """

    def check(value: Any) -> str:
        text = _scalar(value, ' or '.join(accepted)).text
        if text not in accepted:
            meant = meant_by(text, accepted, also)
            raise _wrong(f'unknown {quoted(text)}{did_you_mean(meant)}{choice(accepted)}', meant)
        return text

    return PlainValidator(check)


def meant_by(
    text: str, accepted: tuple[str, ...], also: Mapping[str, str] | None = None
) -> str | None:
    """
    Return the accepted word that a text most likely means, or None.

    """
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
    """
    Return `, did you mean 'alpha'?`, or nothing where no word comes near.

    """
    return f', did you mean {meant!r}?' if meant else ''


def choice(accepted: tuple[str, ...]) -> str:
    """
    Return the accepted words in brackets.

    """
    return f' (accepted: {", ".join(accepted)})'


Word = Annotated[str | None, PlainValidator(_word)]
Citation = Annotated[str | None, PlainValidator(_citation)]
Number = Annotated[str | None, PlainValidator(_number)]
Truth = Annotated[bool | None, PlainValidator(_truth)]
Numbers = Annotated[list[Number], BeforeValidator(_listed(None, 'a list of numbers'))]
Pair = Annotated[list[Number], BeforeValidator(_listed(2, 'two numbers, [lower, upper]'))]
Triple = Annotated[list[Number], BeforeValidator(_listed(3, 'three numbers'))]
Words = Annotated[list[Word], BeforeValidator(_listed(None, 'a list of words'))]


class Entry(BaseModel):
    """
    A mapping of the file.

    """

    model_config = ConfigDict(extra='forbid', frozen=True)
    noun: ClassVar[str] = 'an entry'
    required: ClassVar[tuple[str, ...]] = ()
    also: ClassVar[Mapping[str, str]] = {}  # what people call its keys

    @classmethod
    def keys(cls) -> tuple[str, ...]:
        """
        Return the accepted keys as the file writes them.

        """
        return tuple(field.alias or name for name, field in cls.model_fields.items())


EntryType = TypeVar('EntryType', bound=Entry)


def checked(kind: type[EntryType], data: Any, path: Path, report: FaultReport) -> EntryType:
    """
    Return an entry with every fault reported, and None for each key that has one.

    Where a key or a word has been refused and another one was most likely meant, the entry is
    as if that stood there: one slip is one fault, and what it stands for is judged too.

    """
    keys = kind.keys()
    if not isinstance(data, dict):
        wanted = f'{{{", ".join(keys)}}}'
        report.fault(path, f'expected {kind.noun} as a mapping {wanted}, not {shown(data)}')
        return kind()
    # Of a file with thousands of unknown keys only the listed ones are worth a guess.
    unknown = [key for key in data if key not in keys][:MAX_FAULTS]
    renamed = {} if report.full else {key: meant_by(key, keys, kind.also) for key in unknown}
    for key in kind.required:
        if key not in data and key not in renamed.values():
            needed = ', '.join(kind.required)
            report.fault(path, f'the key {key!r} is missing ({kind.noun} needs: {needed})')
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        broken = set()
        repaired: dict[str, Any] = {}
        for detail in error.errors(include_url=False, include_input=False):
            place = detail['loc']
            broken.add(place[0])
            if detail['type'] == 'extra_forbidden':
                key = str(place[0])
                meant = renamed.get(key)
                message = f'unknown key{did_you_mean(meant)}{choice(keys)}'
                if meant and meant not in data:
                    repaired[meant] = data[key]
            else:
                message = detail['msg']
                if len(place) == 1 and (word := detail.get('ctx', {}).get('meant')):
                    repaired[str(place[0])] = ScalarNode(word, 0, quoted=False)
            report.fault((*path, *place), message)
    intact = {key: data[key] for key in data if key not in broken}
    try:
        return kind.model_validate({**intact, **repaired})
    except ValidationError:
        return kind.model_validate(intact)


def checked_number(data: Any, path: Path, report: FaultReport) -> str | None:
    """
    Return the text of a number or an expression, or None with its fault reported.

    """
    text: str | None = _reported(_number, data, path, report)
    return text


def checked_word(data: Any, path: Path, report: FaultReport) -> str | None:
    """
    Return a printable text, or None with its fault reported.

    """
    text: str | None = _reported(_word, data, path, report)
    return text


def checked_list(
    data: Any, path: Path, report: FaultReport, noun: str, length: int | None = None
) -> list[Any]:
    """
    Return the items of a list, or none with the fault reported.

    """
    result = _reported(_listed(length, noun), data, path, report)
    return result if isinstance(result, list) else []


def _reported(check: Callable[[Any], Any], data: Any, path: Path, report: FaultReport) -> Any:
    try:
        return check(data)
    except PydanticCustomError as error:
        report.fault(path, error.message())
        return None
