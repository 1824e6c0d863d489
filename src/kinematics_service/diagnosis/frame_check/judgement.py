"""The level of a disagreement between two sources of poses: the remainder against two limits."""

import math
from typing import NamedTuple

from ...robot.measures import Level
from .diagnosis import FrameDiagnosis
from .errors import angle_in_words, length_in_words


class PoseLimit(NamedTuple):
    """Largest remainder (RMS, with constant offsets of base and tool): m and rad."""

    position: float
    angle: float

    def in_words(self) -> str:
        """Return both."""
        return f'{length_in_words(self.position)} or {angle_in_words(self.angle)}'


class FrameLimits(NamedTuple):
    """
    The remainders from which on there is a warning, and an error.

    An arm with the nominal table of its type, not the calibrated one of the unit, is off by 1 to 3
    mm and up to 0.4 deg: that is no warning. No calibration leaves 20 mm or 2 deg.
    """

    warn: PoseLimit = PoseLimit(4e-3, math.radians(0.5))
    bad: PoseLimit = PoseLimit(20e-3, math.radians(2.0))

    def level(self, diagnosis: FrameDiagnosis) -> Level:
        """
        Return ERROR if a cause is named or the remainder is bad, WARN if it is beyond the first
        limit.
        """
        p, r = diagnosis.errors.position_rms, diagnosis.errors.rotation_rms
        if diagnosis.cause is not None or p >= self.bad.position or r >= self.bad.angle:
            return Level.ERROR
        return Level.WARN if p >= self.warn.position or r >= self.warn.angle else Level.OK

    def sentence(self, diagnosis: FrameDiagnosis) -> str:
        """Return the result in words, with the limit that is exceeded if no cause is named."""
        level = self.level(diagnosis)
        if diagnosis.cause is not None or level == Level.OK:
            return diagnosis.sentence
        limit, word = (self.bad, 'bad') if level == Level.ERROR else (self.warn, 'a warning')
        return f'{diagnosis.sentence} ({limit.in_words()} is {word})'
