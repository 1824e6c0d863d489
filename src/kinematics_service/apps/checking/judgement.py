# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Rate a disagreement between two sources of poses: OK, WARN or ERROR by two limits."""

from typing import NamedTuple

from ...robot.measures import Level
from .diagnosis import FrameDiagnosis
from .errors import ERROR_LIMIT, EXPLAINED, NOMINAL, Errors, PoseLimit


class FrameLimits(NamedTuple):
    """
    Limits of the RMS residuals between two sources of poses: above `warn` the level is WARN, above
    `bad` ERROR.
    """

    warn: PoseLimit = NOMINAL
    bad: PoseLimit = ERROR_LIMIT

    @property
    def explained(self) -> PoseLimit:
        """
        Return the limit of the RMS residuals that remain after a cause is corrected. If the
        residuals are larger, the cause does not explain the disagreement.
        """
        return PoseLimit(*map(max, zip(EXPLAINED, self.warn)))

    def level(self, diagnosis: FrameDiagnosis) -> Level:
        """
        Return ERROR if a cause is named or residuals exceed `bad`, WARN if they exceed `warn`,
        else OK.
        """
        if diagnosis.cause is not None:
            return Level.ERROR
        return self.of(diagnosis.errors)

    def of(self, errors: Errors) -> Level:
        """Return OK, WARN or ERROR: compare the RMS residuals with the limits `warn` and `bad`."""
        if not errors.within(self.bad):
            return Level.ERROR
        return Level.OK if errors.within(self.warn) else Level.WARN

    def sentence(self, diagnosis: FrameDiagnosis) -> str:
        """
        Return the diagnosis as text.

        If the diagnosis has no decisive cause and the level is WARN or ERROR, the text ends with
        the limit that the RMS residuals exceed.
        """
        level = self.level(diagnosis)
        if diagnosis.cause is not None or level == Level.OK:
            return diagnosis.sentence
        limit = self.bad if level == Level.ERROR else self.warn
        return f'{diagnosis.sentence} ({level.name} at {limit.in_words()})'
