# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Files that cannot be read or judged, and their errors."""

from arms import robot_of
from refusal import refused

from kinematics_service.apps.recordings.audit.auditing import audit
from kinematics_service.apps.recordings.readers.open_file import open_source
from kinematics_service.apps.recordings.readers.source import Selection
from kinematics_service.errors import RecordingError


def refuse(file, code, *words, robot='planar_2r', **wanted):
    """
    Fail unless the audit of a file is refused with this code and these words; return the sentence.

    Parameters
    ----------
    wanted
        Fields of the `Selection`.
    """
    arm = robot_of(robot)
    with (
        refused(RecordingError, code, *words) as raised,
        open_source(file, Selection(arm, **wanted)) as source,
    ):
        audit(source, arm, str(file))
    sentence = str(raised.value)
    assert sentence.startswith(str(file))
    assert '\n' not in sentence
    return sentence
