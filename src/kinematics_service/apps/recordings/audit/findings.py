# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define a finding of an audit, and write durations as text."""

from typing import NamedTuple

from ....robot.measures import Level


class Finding(NamedTuple):
    """
    One finding of an audit: a sentence with its `level` OK, WARN or ERROR. If a file or its poses
    cannot be used, `code` names the cause; otherwise it is empty.
    """

    level: Level
    text: str
    code: str = ''


def seconds(time: float) -> str:
    """Return a duration (s) as text: 0.04 s, 3.2 s, 2 min 5 s, 1 h 3 min."""
    if time < 60.0:
        return f'{time:.3g} s'
    if time < 3600.0:
        return f'{int(time // 60)} min {int(time % 60)} s'
    return f'{int(time // 3600)} h {int(time % 3600 // 60)} min'
