# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Register functions that translate other formats, such as URDF, to the text of a robot file."""

from collections.abc import Callable
from pathlib import PurePath
from typing import TYPE_CHECKING, NamedTuple

from ...errors import Fault

if TYPE_CHECKING:
    from .parts.description import MimicFormula

# Largest size of a file that is translated, bytes: 16 times the size of a humanoid's URDF.
MAX_BYTES = 8 * 1024 * 1024


class RobotText(NamedTuple):
    """
    The text of a robot file that was translated from another format.

    Attributes
    ----------
    doubts
        Probable mistakes in the original file.
    mimics
        Joints of the original file that mimic other joints.
    remarks
        Sentences about the original file that only the command `check` prints.
    """

    text: str
    doubts: tuple[Fault, ...]
    mimics: 'tuple[MimicFormula, ...]' = ()
    remarks: tuple[str, ...] = ()


# A function that translates a file. Its arguments are the bytes of the file, the file's name for
# messages, and the first and the last link of the arm ('' if the translator chooses the link).
Translator = Callable[[bytes, str, str, str], RobotText]
# Translators by file suffix. `kinematics_service/__init__.py` adds them, because the package
# `file` may not import `urdf`.
TRANSLATORS: dict[str, Translator] = {}


def translator_of(file: str) -> Translator | None:
    """
    Return the function that translates a file to the text of a robot file; None if the file is a
    robot file.
    """
    return TRANSLATORS.get(PurePath(file).suffix.lower())
