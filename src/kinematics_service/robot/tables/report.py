"""Collect the faults of a table, and the assumptions made to read it."""

from dataclasses import dataclass, field
from typing import NoReturn

from ...errors import Fault, RobotFileError


@dataclass(frozen=True)
class TableReport:
    """
    Faults and notes of one table.

    Parameters
    ----------
    file
        The name of the file in messages.
    """

    file: str
    faults: list[Fault] = field(default_factory=list)
    notes: list[Fault] = field(default_factory=list)

    def fault(self, message: str, line: int = 0, where: str = '') -> None:
        """Add a fault; `where` is a row and a column."""
        self.faults.append(Fault(self.file, line, where, message))

    def note(self, message: str) -> None:
        """Add an assumption that the user should know."""
        self.notes.append(Fault(self.file, 0, '', message))

    def raise_faults(self) -> None:
        """Raise the faults if there are any."""
        if self.faults:
            raise RobotFileError(self.faults)

    def refuse(self, message: str, line: int = 0) -> NoReturn:
        """Raise a fault of the whole table or of a line."""
        raise RobotFileError([Fault(self.file, line, '', message)])
