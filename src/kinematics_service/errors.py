# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Define the errors of the package: each error is a KinematicsError, and its text is a sentence.

Errors with (V) are also ValueErrors. After a colon, the list has the attributes of an error. Each
error has a `code`: one to three words that name its cause. If a later version changes the
sentence, the code stays.

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
    +-- UrdfError (V): fault
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

import re
from collections.abc import Iterable, Sequence
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
        Line number from 1 on; 0 if the fault has no line, such as for a missing file.
    where
        The key in the file, for example `links[2].alpha`; empty for the whole file.
    message
        The fault as text, and the accepted values.
    code
        Stable name of the fault, for example `unknown-key`; it is not printed.
    """

    file: str
    line: int
    where: str
    message: str
    code: str

    def __str__(self) -> str:
        """Return `file:line: where: message`, without empty parts."""
        at = f'{self.file}:{self.line}' if self.line else self.file
        return ': '.join(part for part in (at, self.where, self.message) if part)


class KinematicsError(Exception):
    """
    Base of all errors of this package.

    Attributes
    ----------
    code
        Stable name of the cause, for example `unknown-name`; it is not printed. An error that is
        raised without a code has the general code of its class. The general code is made from the
        name of the class (`robot-file` for RobotFileError), unless the class defines another.
    """

    code = 'error'

    def __init_subclass__(cls) -> None:
        """If a subclass defines no code, make a code from the name of the subclass."""
        if 'code' not in vars(cls):
            words = re.findall('[A-Z][a-z]*', cls.__name__.removesuffix('Error'))
            cls.code = '-'.join(words).lower()

    def __init__(self, message: str = '', *, code: str = '') -> None:
        super().__init__(message)
        if code:
            self.code = code


class RobotFileError(KinematicsError, ValueError):
    """A robot file does not describe a robot; the text of the error has one line per fault."""

    def __init__(self, faults: Sequence[Fault]) -> None:
        self.faults = tuple(faults)
        super().__init__('\n'.join(map(str, self.faults)))

    def __reduce__(self) -> tuple[type['RobotFileError'], tuple[tuple[Fault, ...]]]:
        """
        Return the class and the faults, from which pickle makes an equal error in another process.
        """
        return type(self), (self.faults,)


class RobotNotFoundError(KinematicsError, ValueError):
    """
    A robot name is neither a file nor a bundled robot.

    Attributes
    ----------
    name, known
        The name, and the names of the bundled robots.
    """

    code = 'unknown-robot'

    def __init__(
        self, message: str, name: str = '', known: Sequence[str] = (), *, code: str = ''
    ) -> None:
        self.name, self.known = name, tuple(known)
        super().__init__(message, code=code)


class RobotFileWriteError(KinematicsError):
    """
    A part of a robot file cannot be written, because other parts of the file would change too.
    """


class ExpressionError(KinematicsError, ValueError):
    """A text is not an accepted mathematical expression."""

    code = 'syntax'


# A shape of an array: a text, or a tuple of dimensions. A dimension is a number or a letter, as in
# (6, 4) or ('N', 6).
Shape = str | tuple[int | str, ...]


class ArgumentError(KinematicsError, ValueError):
    """
    An argument of a function of the library has a wrong type, shape or value.

    Attributes
    ----------
    argument
        Name of the argument.
    expected
        Accepted shapes, without leading dimensions, or accepted values as texts.
    given
        The wrong argument: for an array its shape, for anything else its value. None if unknown.
    """

    def __init__(
        self,
        message: str,
        argument: str = '',
        expected: Sequence[Shape] = (),
        given: Any = None,
        *,
        code: str = '',
    ) -> None:
        self.argument, self.expected, self.given = argument, tuple(expected), given
        super().__init__(message, code=code)

    @classmethod
    def refused(
        cls, argument: str, expected: str, given: object, *, code: str = ''
    ) -> 'ArgumentError':
        """Return the error for an argument that is not what the text `expected` describes."""
        sentence = f'{argument} must be {expected}, not {given!r:.80}'
        return cls(sentence, argument, [expected], given, code=code)

    @classmethod
    def unknown_name(
        cls, argument: str, known: Iterable[str], given: object, others: str = ''
    ) -> 'ArgumentError':
        """
        Return the error for a name that is not in `known`.

        `others` is a text that the message has after the known names.
        """
        names = tuple(known)
        sentence = f'{argument} must be one of {", ".join(names)}{others}, not {given!r}'
        return cls(sentence, argument, names, given, code='unknown-name')

    @classmethod
    def wrong_shape(
        cls, argument: str, given: tuple[int, ...], expected: Sequence[Shape], accepted: str = ''
    ) -> 'ArgumentError':
        """
        Return the error for an array that does not have an `expected` shape.

        `accepted` replaces the list of expected shapes in the message.
        """
        shapes = accepted or ' or '.join(map(str, expected))
        sentence = f'{argument} has shape {given}; it must be {shapes}'
        return cls(sentence, argument, expected, given, code='wrong-shape')


class JointVectorError(ArgumentError):
    """
    Joint values have a wrong shape, or are not finite.

    Attributes
    ----------
    row
        Index of the first configuration with a value that is not finite; in a batch,
        configurations are counted over all leading dimensions. None if the shape is wrong.
    """

    code = 'joint-positions'
    row: int | None = None


class LoopError(JointVectorError):
    """
    A closed loop of the arm cannot be closed at the given joint positions on its present branch.

    Attributes
    ----------
    loop
        Name of the loop.
    """

    code = 'open-loop'
    loop = ''


class PointError(ArgumentError):
    """
    The arm has no point, table row or axes of this name, or the coordinates are not three numbers.
    """


class TargetError(ArgumentError):
    """
    A target is not a finite pose or position, or it names rows of the task that do not exist.
    """


class TwistError(ArgumentError):
    """A twist is not six finite numbers, or it is given in the axes of an unknown frame."""


class WrenchError(ArgumentError):
    """A wrench is not six finite numbers, or its leading dimensions do not fit those of `q`."""


class PlanError(ArgumentError):
    """
    The times of a plan do not increase, or a setting of the plan's check is outside its range.
    """


class ServoSettingsError(ArgumentError):
    """A setting for joint velocities (servo, damping or scale) is outside its range."""


class SweepError(KinematicsError):
    """The worker processes of a sweep (a computation over many poses) cannot be used."""


class DerivationError(KinematicsError, ValueError):
    """Formulas cannot be derived exactly; the message has the reason."""


class FormulaError(KinematicsError, ValueError):
    """A formula cannot be read; the error has the line and column."""

    def __init__(self, message: str, line: int = 0, column: int = 0, *, code: str = '') -> None:
        self.message = message
        self.line = line
        self.column = column
        super().__init__(message, code=code)


class UrdfError(KinematicsError, ValueError):
    """
    A URDF cannot be read, or its chain cannot be described by a robot file.

    Attributes
    ----------
    fault
        The fault, with its file, line and element.
    """

    def __init__(self, fault: Fault) -> None:
        self.fault = fault
        super().__init__(str(fault), code=fault.code)

    def __reduce__(self) -> tuple[type['UrdfError'], tuple[Fault]]:
        """
        Return the class and the fault, from which pickle makes an equal error in another process.
        """
        return type(self), (self.fault,)


class RecordingError(KinematicsError, ValueError):
    """A recording of joint positions cannot be read or evaluated; the message has the reason."""


class FramesError(KinematicsError, ValueError):
    """Measured poses and joint positions cannot be compared with an arm."""


class CalibrationError(KinematicsError, ValueError):
    """Measured poses do not identify the parameters of a robot; the message has the reason."""


class ParameterNotFoundError(CalibrationError):
    """
    A name is neither a parameter of the arm nor a group of parameters.

    Attributes
    ----------
    name, known
        The name, and the names of groups and parameters.
    """

    code = 'unknown-parameter'

    def __init__(
        self, message: str, name: str = '', known: Sequence[str] = (), *, code: str = ''
    ) -> None:
        self.name, self.known = name, tuple(known)
        super().__init__(message, code=code)


class PlotError(KinematicsError, ValueError):
    """A picture cannot be drawn."""


class ViewError(KinematicsError):
    """The live page cannot be served, because of its address or because viser is missing."""


class ArmsError(KinematicsError, ValueError):
    """Several arms cannot run together in one process; the exit code is 2 (wrong usage)."""


class RobotConflictError(KinematicsError, ValueError):
    """The command line and a parameter name different robots; the exit code is 2 (wrong usage)."""


class SettingsError(KinematicsError, ValueError):
    """A parameter has a wrong value; the message has the name, the value and accepted values."""

    code = 'parameter'


class RefusedTargetError(KinematicsError, ValueError):
    """The node cannot use a target, or cannot use the target now; the message has the reason."""


class LayoutError(KinematicsError, ValueError):
    """The layout of a Float64MultiArray does not describe a matrix with labels."""


class CdrError(KinematicsError, ValueError):
    """Serialized bytes have an encapsulation header or a length that a message cannot have."""


class WireError(KinematicsError, ValueError):
    """
    Serialized bytes are not a message of the expected type. ROS would refuse these bytes as well.
    """
