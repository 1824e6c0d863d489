"""
Define the errors of the package: each is a KinematicsError, and its text is a sentence.

Errors with (V) are also ValueErrors. The words after a colon are further attributes of an error.

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
    One fault in a robot file.

    Parameters
    ----------
    file
        The path as the user gave it.
    line
        Line number from 1 on; 0 if the fault does not have a line (a missing file).
    where
        The key in the file, for example `links[2].alpha`; empty for the whole file.
    message
        The fault, and the accepted values.
    """

    file: str
    line: int
    where: str
    message: str

    def __str__(self) -> str:
        """Return `file:line: where: message`, without empty parts."""
        at = f'{self.file}:{self.line}' if self.line else self.file
        return ': '.join(part for part in (at, self.where, self.message) if part)


class KinematicsError(Exception):
    """Base of all errors of this package."""


class RobotFileError(KinematicsError, ValueError):
    """A robot file that does not describe a robot; its text has one line per fault."""

    def __init__(self, faults: Sequence[Fault]) -> None:
        self.faults = tuple(faults)
        super().__init__('\n'.join(map(str, self.faults)))

    def __reduce__(self) -> tuple[type['RobotFileError'], tuple[tuple[Fault, ...]]]:
        """Rebuild the error from its faults, so that it passes between processes unchanged."""
        return type(self), (self.faults,)


class RobotNotFoundError(KinematicsError, ValueError):
    """
    A name that is neither a file nor a bundled robot.

    Attributes
    ----------
    name, known
        The name, and the names of the bundled robots.
    """

    def __init__(self, message: str, name: str = '', known: Sequence[str] = ()) -> None:
        self.name, self.known = name, tuple(known)
        super().__init__(message)


class RobotFileWriteError(KinematicsError):
    """A robot file that cannot be changed without a change of its other content."""


class ExpressionError(KinematicsError, ValueError):
    """A text that is not an accepted expression."""


# A shape in words, or as dimensions, which may be letters: (6, 4), ('N', 6).
Shape = str | tuple[int | str, ...]


class ArgumentError(KinematicsError, ValueError):
    """
    An argument that a function of the library cannot take.

    Attributes
    ----------
    argument
        Name of the argument.
    expected
        Accepted values: shapes without leading dimensions, or words.
    given
        The given shape or words; None for a value without a shape.
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
        Index of the first pose of a batch that is not finite, over all leading dimensions; None if
        the shape is wrong.
    """

    row: int | None = None


class LoopError(JointVectorError):
    """
    Joint positions at which a closed loop of the arm does not close on its known branch.

    Attributes
    ----------
    loop
        Name of the loop.
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
    """A plan whose times do not increase, or a request about it without a meaning."""


class ServoSettingsError(ArgumentError):
    """Settings of the servo that are outside their ranges."""


class SweepError(KinematicsError):
    """Workers that cannot be used."""


class DerivationError(KinematicsError, ValueError):
    """A derivation that is not possible exactly; the message has the reason."""


class FormulaError(KinematicsError, ValueError):
    """A formula that cannot be read, with its place."""

    def __init__(self, message: str, line: int = 0, column: int = 0) -> None:
        self.message = message
        self.line = line
        self.column = column
        super().__init__(message)


class UrdfError(KinematicsError, ValueError):
    """A URDF that cannot be read, or that contains a chain without a robot file."""


class RecordingError(KinematicsError, ValueError):
    """A recording that cannot be read or judged; the message has the reason."""


class FramesError(KinematicsError, ValueError):
    """Poses or joint positions that cannot be compared."""


class CalibrationError(KinematicsError, ValueError):
    """Measured poses that do not identify a robot; the message has the reason."""


class ParameterNotFoundError(CalibrationError):
    """
    A name that is neither a parameter of an arm nor a group of parameters.

    Attributes
    ----------
    name, known
        The name, and the names of groups and parameters.
    """

    def __init__(self, message: str, name: str = '', known: Sequence[str] = ()) -> None:
        self.name, self.known = name, tuple(known)
        super().__init__(message)


class PlotError(KinematicsError, ValueError):
    """A picture that cannot be made."""


class ViewError(KinematicsError):
    """A page that cannot be served, because of its address or viser."""


class ArmsError(KinematicsError, ValueError):
    """Arms that cannot run side by side: wrong usage."""


class RobotConflictError(KinematicsError, ValueError):
    """The command line and a parameter name different robots: wrong usage."""


class SettingsError(KinematicsError, ValueError):
    """A wrong value of a parameter; the message has the name, the value and accepted values."""


class RefusedTargetError(KinematicsError, ValueError):
    """A target that the node cannot read, or not now; the message has the reason."""


class LayoutError(KinematicsError, ValueError):
    """A Float64MultiArray whose layout does not describe a matrix with labels."""


class CdrError(KinematicsError, ValueError):
    """Bytes with an encapsulation or with lengths that a message cannot have."""


class WireError(KinematicsError, ValueError):
    """Bytes that are not a message of their type; the official deserializer refuses them, too."""
