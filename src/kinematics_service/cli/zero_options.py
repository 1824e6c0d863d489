"""`calibrate --zeros`: the sheet of known points, and the calibration file of the servos."""

import math
import sys
from collections.abc import Mapping
from enum import Enum
from pathlib import Path
from typing import Any, NamedTuple, TextIO

from ..diagnosis.calibration.calibration import Calibration
from ..diagnosis.calibration.output.servo_file import read_servos, servos_text
from ..diagnosis.calibration.output.sheet import SHEETS, Sheet
from ..diagnosis.calibration.zeros import zeros_of
from ..output_file import say_written, write_file
from ..robot.robot import Robot
from .frame_options import given_limit
from .options import WrongUsage, refuse_unwritable

# The column that names the point of each row where --same-point names no other.
POINT = 'point'


class SheetChoice(str, Enum):
    """The sizes of paper."""

    a4 = 'a4'
    letter = 'letter'


class ZeroOptions(NamedTuple):
    """
    What --zeros asks for.

    Attributes
    ----------
    sheet
        Of the points.
    play : rad
        Of the turning joints; 0 if it is not known.
    servos, written
        The calibration of the servos as it is, and its new file; None if it is not wanted.
    """

    sheet: Sheet
    play: float
    servos: dict[str, Any] | None
    written: Path | None

    def write_sheet(self, file: Path | None) -> None:
        """Write the page to print."""
        if file is None:
            raise WrongUsage('give FILE with touches, or --html FILE for the sheet to print')
        write_file(file, self.sheet.page)
        say_written(file, sys.stdout)

    def write_servos(self, found: Calibration, stream: TextIO) -> None:
        """Write the calibration file of the servos, if it is asked for."""
        if self.servos is not None and self.written is not None:
            write_file(self.written, servos_text(self.servos, zeros_of(found)))
            say_written(self.written, stream)


def given_zeros(
    wanted: bool,
    robot: Robot,
    words: tuple[SheetChoice | None, str | None, tuple[Path, Path] | None],
    force: bool,
    others: Mapping[str, object],
) -> ZeroOptions | None:
    """
    Return what --zeros asks for, None where it is not given.

    Parameters
    ----------
    words
        Those of --sheet, --backlash and --motors.
    others
        Options that it does not take, by name; None, or empty, where they are not given.
    """
    if not wanted:
        if any(one is not None for one in words):
            raise WrongUsage(
                '--sheet, --backlash and --motors are for the zeros of joints: give --zeros too'
            )
        return None
    sheet, backlash, motors = words
    given = [name for name, value in others.items() if value]
    if given:
        raise WrongUsage(f'--zeros fits the offsets of the joints alone: no {", ".join(given)}')
    paper = SHEETS[(sheet or SheetChoice.a4).value]
    play = 0.0 if backlash is None else given_limit('--backlash', backlash).angle
    if math.isinf(play):
        raise WrongUsage(f'--backlash: {backlash!r} is no angle; write for instance 0.5deg')
    if motors is None:
        return ZeroOptions(paper, play, None, None)
    old, new = motors
    refuse_unwritable('--motors', new)
    if new.exists() and not force:
        raise WrongUsage(f'{new} exists already: give another name, or --force')
    return ZeroOptions(paper, play, read_servos(old, robot.joint_names), new)
