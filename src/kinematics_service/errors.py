"""The errors of the package: one base, a few kinds that are also ValueError."""

from collections.abc import Sequence
from dataclasses import dataclass


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


class ExpressionError(KinematicsError, ValueError):
    """A text that is not an accepted expression."""


class RobotNotFoundError(KinematicsError, ValueError):
    """A name that is neither a file nor a bundled robot."""


class JointVectorError(KinematicsError, ValueError):
    """Joint values of the wrong shape, or not finite."""
