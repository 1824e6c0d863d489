# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Collect the faults of a pasted table, and the assumptions under which the program read it."""

from dataclasses import dataclass, field
from typing import NoReturn

from ...errors import Fault, RobotFileError


@dataclass(frozen=True)
class TableReport:
    """
    Faults of one pasted table, and notes about assumptions.

    Parameters
    ----------
    file
        The name of the file in messages.
    """

    file: str
    faults: list[Fault] = field(default_factory=list)
    notes: list[Fault] = field(default_factory=list)

    def fault(self, message: str, code: str, line: int = 0, where: str = '') -> None:
        """Add a fault; `where` names the row and column as text."""
        self.faults.append(Fault(self.file, line, where, message, code))

    def note(self, message: str, code: str) -> None:
        """Add an assumption that the user should know."""
        self.notes.append(Fault(self.file, 0, '', message, code))

    def raise_faults(self) -> None:
        """Raise RobotFileError with all faults if the report has at least one."""
        if self.faults:
            raise RobotFileError(self.faults)

    def refuse(self, message: str, code: str, line: int = 0) -> NoReturn:
        """Raise RobotFileError with one fault of a line, or of the whole table."""
        raise RobotFileError([Fault(self.file, line, '', message, code)])
