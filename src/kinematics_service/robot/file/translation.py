"""Translators of other formats, such as URDF, into the text of a robot file."""

from collections.abc import Callable
from pathlib import PurePath
from typing import TYPE_CHECKING, NamedTuple

from ...errors import Fault

if TYPE_CHECKING:
    from .parts.description import MimicFormula

# URDF files of humanoids have up to half a megabyte.
MAX_BYTES = 8 * 1024 * 1024


class RobotText(NamedTuple):
    """
    The text of a robot file that was translated from another format.

    Attributes
    ----------
    doubts
        Probable mistakes in the original.
    mimics
        Joints of the original that follow other joints.
    remarks
        Sentences that only `check` prints.
    """

    text: str
    doubts: tuple[Fault, ...]
    mimics: 'tuple[MimicFormula, ...]' = ()
    remarks: tuple[str, ...] = ()


# A function of the bytes of a file, its name for messages, and the first and last link of the arm
# (empty: chosen).
Translator = Callable[[bytes, str, str, str], RobotText]
# Translators by file suffix. The __init__ of the package adds them, because this package may not
# import them.
TRANSLATORS: dict[str, Translator] = {}


def translator_of(file: str) -> Translator | None:
    """Return the translator of a file, or None for a robot file."""
    return TRANSLATORS.get(PurePath(file).suffix.lower())
