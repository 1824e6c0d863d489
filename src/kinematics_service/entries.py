"""
Entries of a robot file: mappings whose keys and kinds of values are known, checked by pydantic.

Every value arrives as the text the user wrote (`ScalarNode`), so nothing is converted on the
way: `true` never becomes 1.0. What is missing or has been refused is None in an entry.
"""

import difflib
import re
from collections.abc import Callable
from typing import Annotated, Any, ClassVar, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, PlainValidator, ValidationError
from pydantic_core import PydanticCustomError

from .fault_report import FaultReport, quoted, shown
from .yaml_document import Path, ScalarNode

NULL = re.compile(r'~|null|Null|NULL|')
TRUTH = re.compile(r'true|True|TRUE|false|False|FALSE')


def _wrong(message: str) -> PydanticCustomError:
    # The message is an argument, not the template: it may hold braces of the user's.
    return PydanticCustomError('robot_file', '{message}', {'message': message})


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


def _listed(length: int | None, wanted: str) -> Callable[[Any], Any]:
    def check(value: Any) -> Any:
        if not isinstance(value, list):
            raise _wrong(f'expected {wanted}, not {shown(value)}')
        if length is not None and len(value) != length:
            raise _wrong(f'expected {wanted}, not {len(value)}')
        return value

    return check


def one_of(*accepted: str) -> PlainValidator:
    """
    Accept one of a few words.

    """

    def check(value: Any) -> str:
        text = _scalar(value, ' or '.join(accepted)).text
        if text not in accepted:
            raise _wrong(f'unknown {quoted(text)}{did_you_mean(text, accepted)}{choice(accepted)}')
        return text

    return PlainValidator(check)


def did_you_mean(text: str, accepted: tuple[str, ...]) -> str:
    """
    Return `, did you mean 'alpha'?` for a near miss, otherwise nothing.

    """
    if len(text) < 3:
        return ''  # anything is near to 'm'
    near = difflib.get_close_matches(text[:60], accepted, n=1)
    return f', did you mean {near[0]!r}?' if near else ''


def choice(accepted: tuple[str, ...]) -> str:
    """
    Return the accepted words in brackets.

    """
    return f' (accepted: {", ".join(accepted)})'


Word = Annotated[str | None, PlainValidator(_word)]
Citation = Annotated[str | None, PlainValidator(_citation)]
Number = Annotated[str | None, PlainValidator(_number)]
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

    """
    keys = kind.keys()
    if not isinstance(data, dict):
        wanted = f'{{{", ".join(keys)}}}'
        report.fault(path, f'expected {kind.noun} as a mapping {wanted}, not {shown(data)}')
        return kind()
    for key in kind.required:
        if key not in data:
            needed = ', '.join(kind.required)
            report.fault(path, f'the key {key!r} is missing ({kind.noun} needs: {needed})')
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        broken = set()
        for detail in error.errors(include_url=False, include_input=False):
            place = detail['loc']
            broken.add(place[0])
            if detail['type'] == 'extra_forbidden':
                key = str(place[0])
                hint = '' if report.full else did_you_mean(key, keys)
                message = f'unknown key{hint}{choice(keys)}'
            else:
                message = detail['msg']
            report.fault((*path, *place), message)
    return kind.model_validate({key: data[key] for key in data if key not in broken})


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
