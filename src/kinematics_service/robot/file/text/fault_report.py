# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Collect the faults, warnings and remarks of one robot file while it is read."""

import math

from ....errors import Fault, RobotFileError
from .expression_syntax import IDENTIFIER
from .yaml_document import Document, Path, ScalarNode, Yaml

MAX_FAULTS = 100  # limits the length of the message, and the time for a hostile file


def dotted(path: Path) -> str:
    """Return the keys and indices of a value in the file as one text, such as `links[2].alpha`."""
    text = ''
    for step in path:
        if isinstance(step, int):
            text += f'[{step}]'
        elif IDENTIFIER.fullmatch(step) and len(step) <= 60:
            text += f'.{step}' if text else step
        else:
            text += f'[{quoted(step)}]' if text else quoted(step)
    return text


def quoted(text: str) -> str:
    """
    Return a text of the file in quotes, cut to 60 characters, with control characters escaped.
    """
    return repr(text if len(text) <= 60 else f'{text[:57]}...')


def shown(value: Yaml) -> str:
    """Return a value of the file as short text for messages."""
    if isinstance(value, dict):
        return 'a mapping'
    if isinstance(value, list):
        return 'a list'
    if isinstance(value, ScalarNode):
        return quoted(value.text) if value.text or value.quoted else 'nothing'
    return quoted(str(value))


def number(value: float) -> str:
    """Return a number as text with at most six digits."""
    return f'{value:.6g}' if math.isfinite(value) else str(value)


class Place:
    """
    A place (a key or list item) in a file, at which faults, warnings and remarks are reported.

    Parameters
    ----------
    report
        The report of the file.
    path
        The keys and indices that lead to the place; empty for the whole file.
    """

    def __init__(self, report: 'FaultReport', path: Path = ()) -> None:
        self.report, self.path = report, path
        self._before = report.fault_count

    def __getitem__(self, steps: str | int | Path) -> 'Place':
        """
        Return the place of an inner value, given its key, its index, or a tuple of keys and
        indices.
        """
        inside = steps if isinstance(steps, tuple) else (steps,)
        return Place(self.report, (*self.path, *inside))

    @property
    def intact(self) -> bool:
        """Return whether no fault was reported in the whole file since this object was created."""
        return self.report.fault_count == self._before

    @property
    def line(self) -> int:
        """Return the line of the place in the file."""
        return self.report.document.line(self.path)

    def fault(self, message: str, code: str) -> None:
        """Report a fault at this place."""
        # If the list of faults is full, use line 0, because this fault is only counted and the
        # search for a line takes time.
        self.report.add(self.path, 0 if self.report.full else self.line, message, code)

    def warn(self, message: str, code: str) -> None:
        """Report a probable mistake at this place; the file stays valid."""
        report = self.report
        if len(report.warned) < MAX_FAULTS:
            file = report.document.file
            report.warned.append(Fault(file, self.line, dotted(self.path), message, code))

    def remark(self, sentence: str) -> None:
        """Add a sentence about this place that only the command `check` prints."""
        line = self.line
        self.report.remarked.append((line, f'line {line}: {dotted(self.path)}: {sentence}'))


class FaultReport:
    """The faults, warnings and remarks of one YAML document."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.warned: list[Fault] = []
        self.remarked: list[tuple[int, str]] = []
        self.fault_count = 0
        self._faults: list[Fault] = []
        for path, line, message in document.faults:
            self.add(path, line, message, 'duplicate-key')

    @property
    def full(self) -> bool:
        """Return whether MAX_FAULTS faults are listed; further faults are only counted."""
        return self.fault_count >= MAX_FAULTS

    def add(self, path: Path, line: int, message: str, code: str) -> None:
        """Add a fault at a path and line of the file."""
        self.fault_count += 1
        if self.fault_count <= MAX_FAULTS:
            self._faults.append(Fault(self.document.file, line, dotted(path), message, code))

    def warnings(self) -> tuple[Fault, ...]:
        """Return the warnings in the order of the file."""
        return tuple(sorted(self.warned, key=lambda warning: warning.line))

    def remarks(self) -> tuple[str, ...]:
        """Return the remarks in the order of the file."""
        return tuple(sentence for _, sentence in sorted(self.remarked, key=lambda pair: pair[0]))

    def raise_faults(self) -> None:
        """
        Raise an error with all faults in the order of the file, if at least one was reported.

        Raises
        ------
        RobotFileError
            At least one fault was reported; the message has one line for each fault.
        """
        if not self._faults:
            return
        faults = sorted(self._faults, key=lambda fault: fault.line)
        if self.fault_count > MAX_FAULTS:
            more = f'{self.fault_count - MAX_FAULTS} more faults are not listed'
            faults.append(Fault(self.document.file, 0, '', more, 'too-many-faults'))
        raise RobotFileError(faults)
