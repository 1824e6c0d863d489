"""The level of a disagreement between two sources of poses: the remainder against two limits."""

from typing import NamedTuple

from ...robot.measures import Level
from .diagnosis import FrameDiagnosis
from .errors import ERROR_LIMIT, EXPLAINED, NOMINAL, Errors, PoseLimit


class FrameLimits(NamedTuple):
    """The remainders from which on there is a warning, and an error."""

    warn: PoseLimit = NOMINAL
    bad: PoseLimit = ERROR_LIMIT

    @property
    def explained(self) -> PoseLimit:
        """Return what a cause may leave that explains a remainder: never less than the warning."""
        return PoseLimit(*map(max, zip(EXPLAINED, self.warn)))

    def level(self, diagnosis: FrameDiagnosis) -> Level:
        """
        Return ERROR if a cause is named or the remainder is bad, WARN if it is beyond the first
        limit.
        """
        if diagnosis.cause is not None:
            return Level.ERROR
        return self.of(diagnosis.errors)

    def of(self, errors: Errors) -> Level:
        """Return the level of a remainder."""
        if not errors.within(self.bad):
            return Level.ERROR
        return Level.OK if errors.within(self.warn) else Level.WARN

    def sentence(self, diagnosis: FrameDiagnosis) -> str:
        """Return the result in words, with the limit that is exceeded if no cause is named."""
        level = self.level(diagnosis)
        if diagnosis.cause is not None or level == Level.OK:
            return diagnosis.sentence
        limit = self.bad if level == Level.ERROR else self.warn
        return f'{diagnosis.sentence} ({level.name} at {limit.in_words()})'
