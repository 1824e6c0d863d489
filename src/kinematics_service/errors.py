"""
The errors of the package: whatever it refuses is a KinematicsError, its text a sentence.

Those with (V) are ValueErrors as well; behind a colon stands what an error carries besides.

    KinematicsError
    +-- RobotFileError (V): faults
    +-- RobotNotFoundError (V): name, known
    +-- RobotFileWriteError
    +-- ExpressionError (V)
    +-- ArgumentError (V): argument, expected, given
    |   +-- JointVectorError: row
    |   |   +-- LoopError: loop
    |   +-- PointError
    |   +-- TargetError
    |   +-- TwistError
    |   +-- WrenchError
    |   +-- PlanError
    |   +-- ServoSettingsError
    +-- SweepError
    +-- DerivationError (V)
    +-- FormulaError (V): line, column
    +-- UrdfError (V)
    +-- RecordingError (V)
    +-- FramesError (V)
    +-- CalibrationError (V)
    |   +-- ParameterNotFoundError: name, known
    +-- PlotError (V)
    +-- ViewError
    +-- ArmsError (V)
    +-- RobotConflictError (V)
    +-- SettingsError (V)
    +-- RefusedTargetError (V)
    +-- LayoutError (V)
    +-- CdrError (V)
    +-- WireError (V)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Fault:
    """
    One thing that is wrong in a robot file.

    Parameters
    ----------
    file
        The path as the user gave it.
    line
        Counted from 1; 0 if no line can be named (a missing file).
    where
        The key in the file, `links[2].alpha`; empty for the whole file.
    message
        The fault, and what is accepted.
    """

    file: str
    line: int
    where: str
    message: str

    def __str__(self) -> str:
        """Return `file:line: where: message`, without the parts that are not known."""
        at = f'{self.file}:{self.line}' if self.line else self.file
        return ': '.join(part for part in (at, self.where, self.message) if part)


class KinematicsError(Exception):
    """Anything this package refuses to do."""


class RobotFileError(KinematicsError, ValueError):
    """A robot file that does not describe a robot; its text has one line per fault."""

    def __init__(self, faults: Sequence[Fault]) -> None:
        self.faults = tuple(faults)
        super().__init__('\n'.join(map(str, self.faults)))

    def __reduce__(self) -> tuple[type['RobotFileError'], tuple[tuple[Fault, ...]]]:
        """Rebuild from the faults, not from the text: so it passes between processes unchanged."""
        return type(self), (self.faults,)


class RobotNotFoundError(KinematicsError, ValueError):
    """
    A name that is neither a file nor a bundled robot.

    Attributes
    ----------
    name, known
        The name, and those of the bundled robots.
    """

    def __init__(self, message: str, name: str = '', known: Sequence[str] = ()) -> None:
        self.name, self.known = name, tuple(known)
        super().__init__(message)


class RobotFileWriteError(KinematicsError):
    """A robot file that cannot be changed without touching what is not ours."""


class ExpressionError(KinematicsError, ValueError):
    """A text that is not an accepted expression."""


# In words, or by dimensions, some of them letters: (6, 4), ('N', 6).
Shape = str | tuple[int | str, ...]


class ArgumentError(KinematicsError, ValueError):
    """
    An argument that a function of the library cannot take.

    Attributes
    ----------
    argument
        Its name.
    expected
        What is accepted: shapes, leading dimensions left out, or words.
    given
        The shape or the words given; None where it has no shape.
    """

    def __init__(
        self, message: str, argument: str = '', expected: Sequence[Shape] = (), given: Any = None
    ) -> None:
        self.argument, self.expected, self.given = argument, tuple(expected), given
        super().__init__(message)


class JointVectorError(ArgumentError):
    """
    Joint values of the wrong shape, or not finite.

    Attributes
    ----------
    row
        Of a batch the first pose that is not finite, counted over all leading dimensions; None
        where the shape is wrong.
    """

    row: int | None = None


class LoopError(JointVectorError):
    """
    Joint positions at which a closed loop of the arm does not close, on the branch it is known on.

    Attributes
    ----------
    loop
        Its name.
    """

    loop = ''


class PointError(ArgumentError):
    """A point, row or axes that the arm does not have; a place that is not three numbers."""


class TargetError(ArgumentError):
    """A target that is neither a pose nor a position, or not finite; rows that do not exist."""


class TwistError(ArgumentError):
    """A twist that is not six finite numbers, or in axes that do not exist."""


class WrenchError(ArgumentError):
    """A wrench that is not six finite numbers, or of other leading dimensions than the pose."""


class PlanError(ArgumentError):
    """A plan whose times do not rise, or a question about it that means nothing."""


class ServoSettingsError(ArgumentError):
    """Settings of the servo that mean nothing."""


class SweepError(KinematicsError):
    """Workers that cannot be used."""


class DerivationError(KinematicsError, ValueError):
    """What cannot be derived exactly, and why."""


class FormulaError(KinematicsError, ValueError):
    """A formula that cannot be read, and where."""

    def __init__(self, message: str, line: int = 0, column: int = 0) -> None:
        self.message = message
        self.line = line
        self.column = column
        super().__init__(message)


class UrdfError(KinematicsError, ValueError):
    """A URDF that cannot be read, or a chain in it that no robot file can say."""


class RecordingError(KinematicsError, ValueError):
    """A recording that cannot be read or judged; one sentence says why and what is accepted."""


class FramesError(KinematicsError, ValueError):
    """Poses or joint positions that cannot be compared."""


class CalibrationError(KinematicsError, ValueError):
    """Measured poses that no robot can be identified from; one sentence says why."""


class ParameterNotFoundError(CalibrationError):
    """
    A name that is no parameter of an arm, nor a group of them.

    Attributes
    ----------
    name, known
        The name, and those of the groups and parameters.
    """

    def __init__(self, message: str, name: str = '', known: Sequence[str] = ()) -> None:
        self.name, self.known = name, tuple(known)
        super().__init__(message)


class PlotError(KinematicsError, ValueError):
    """A picture that cannot be made."""


class ViewError(KinematicsError):
    """A page that cannot be served: its address, viser missing or unknown; what to change."""


class ArmsError(KinematicsError, ValueError):
    """Arms that cannot run side by side: wrong usage."""


class RobotConflictError(KinematicsError, ValueError):
    """The command line and a parameter name different robots: wrong usage."""


class SettingsError(KinematicsError, ValueError):
    """A parameter's value is refused; the message names it, the value and what is accepted."""


class RefusedTargetError(KinematicsError, ValueError):
    """A target that cannot be understood, or not now; the message says why."""


class LayoutError(KinematicsError, ValueError):
    """A Float64MultiArray whose layout does not describe a matrix with labels."""


class CdrError(KinematicsError, ValueError):
    """Bytes whose encapsulation or lengths cannot be those of a message."""


class WireError(KinematicsError, ValueError):
    """Bytes that are no message of their type: the official deserializer refuses them too."""
