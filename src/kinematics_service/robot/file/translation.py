"""Robots in the formats of others: translated into the text of a robot file, and read as that."""

from collections.abc import Callable
from pathlib import PurePath
from typing import TYPE_CHECKING, NamedTuple

from ...errors import Fault

if TYPE_CHECKING:
    from .parts.description import MimicFormula

# The largest descriptions of whole humanoids have half a megabyte.
MAX_BYTES = 8 * 1024 * 1024


class RobotText(NamedTuple):
    """
    The text of a robot file, made from another format.

    Attributes
    ----------
    doubts
        What was most likely meant otherwise there.
    mimics
        Joints that follow others there.
    remarks
        Sentences for those who check the file.
    """

    text: str
    doubts: tuple[Fault, ...]
    mimics: 'tuple[MimicFormula, ...]' = ()
    remarks: tuple[str, ...] = ()


# Takes the bytes of a file, its name for messages, and the links at which the arm begins and ends,
# empty where they are not given.
Translator = Callable[[bytes, str, str, str], RobotText]
# By the ending of the file's name. Translators belong to rooms above this one: the package itself,
# which knows all of them, puts them here.
TRANSLATORS: dict[str, Translator] = {}


def translator_of(file: str) -> Translator | None:
    """Return what translates a file of that name, None for a robot file."""
    return TRANSLATORS.get(PurePath(file).suffix.lower())
