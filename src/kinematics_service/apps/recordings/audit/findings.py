# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define a finding of an audit, and write durations as text."""

from ..readers.source import Remark

# A finding has the fields of a remark on the file: level OK, WARN or ERROR, text, and code. The
# code names the cause of a refusal or of a fault of the file; it is empty for other findings.
Finding = Remark


def seconds(time: float) -> str:
    """Return a duration (s) as text: 0.04 s, 3.2 s, 2 min 5 s, 1 h 3 min."""
    if time < 60.0:
        return f'{time:.3g} s'
    if time < 3600.0:
        return f'{int(time // 60)} min {int(time % 60)} s'
    return f'{int(time // 3600)} h {int(time % 3600 // 60)} min'
