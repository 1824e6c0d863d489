# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write the head of the audit page: recording, robot file, date, and version of the package."""

import hashlib
from html import escape
from pathlib import Path
from typing import NamedTuple

from .....page import facts
from .....robot.bundled import find_robot_file
from .....robot.measures import MEASURES
from .....version import __version__
from ..auditing import Audit

# Number of bytes read at once for a checksum.
READ_SIZE = 1 << 20


class Provenance(NamedTuple):
    """
    The inputs of an audit, for the head of its page.

    Attributes
    ----------
    date
        Date of the audit, as text. The date is an input, so that equal inputs give equal pages.
    robot_file
        The robot file.
    recording_sha256, robot_sha256
        Checksums of the files, in hexadecimal digits; for a folder, of its files in the order of
        their names.
    """

    date: str
    recording_sha256: str
    robot_file: str
    robot_sha256: str


def origin_of(recording: Path, robot: str, date: str) -> Provenance:
    """
    Return the provenance of an audit: recording, robot file and date. The robot is a name or a
    file.
    """
    return Provenance(date, _sha256(recording), robot, _sha256(find_robot_file(robot)))


def _sha256(path: Path) -> str:
    files = [path] if path.is_file() else sorted(p for p in path.rglob('*') if p.is_file())
    total = hashlib.sha256()
    for file in files:
        with file.open('rb') as stream:
            while piece := stream.read(READ_SIZE):
                total.update(piece)
    return total.hexdigest()


def header(audit: Audit, origin: Provenance | None) -> str:
    """
    Return the head of the page as HTML; date and checksums are shown if the provenance is given.
    """
    thresholds, robot = audit.robot.singularity.thresholds, audit.robot
    unit = MEASURES[thresholds.measure].unit
    warn, stop = (f'{value:g} {unit}'.strip() for value in (thresholds.warn, thresholds.stop))
    sha256 = origin.recording_sha256 if origin else ''
    frames = f'{escape(robot.tool_frame)} in {escape(robot.base_frame)}'
    levels = f'{thresholds.measure.replace("_", " ")}: WARN at {warn}, ERROR at {stop}'
    rows = [
        ('plan' if audit.planned else 'recording', _file(audit.file, sha256)),
        ('robot', f'{escape(robot.name)}, {frames}'),
        ('version', f'kinematics_service {__version__}'),
        ('thresholds', levels),
    ]
    if origin is not None:
        rows.insert(2, ('robot file', _file(origin.robot_file, origin.robot_sha256)))
        rows.insert(3, ('date', escape(origin.date)))
    return facts(rows)


def _file(name: str, sha256: str) -> str:
    return escape(name) + (f'<br><code>sha256 {sha256}</code>' if sha256 else '')
