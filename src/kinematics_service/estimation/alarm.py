"""Decide when to publish a singularity warning: at changes, and repeatedly while it lasts."""

import math
from typing import NamedTuple

from ..kernel import Floats
from ..robot.measures import Level

# The warning is repeated if the lost direction has turned by more than this, rad.
TURNED = math.radians(30.0)
# Cosine between two lost directions below which the warning is repeated.
TURNED_COSINE = math.cos(TURNED)
# Smallest time between two repetitions because of turns, ns. If two directions are lost at once,
# the lost direction is arbitrary and turns with every message.
MIN_TURN_PERIOD = 50_000_000
# Period of the warning while the level is WARN or ERROR, ns.
REPEAT_PERIOD = 1_000_000_000
_QUIET = (Level.OK, Level.STALE)


class Alarm(NamedTuple):
    """
    The state of the last published warning; `step` returns the next state.

    Attributes
    ----------
    level
        Level of the last published warning.
    direction : shape (6,)
        The lost direction of the last warning.
    last : ns
        Time of the last warning, steady clock; None before the first warning.
    factor
        Index of the nearest named factor at the last warning; None for an arm without factors.
    """

    level: Level = Level.OK
    direction: Floats | None = None
    last: int | None = None
    factor: int | None = None

    def is_settled(self, level: Level, arrival: int) -> bool:
        """
        Return whether `step` would neither publish nor change anything, for any direction and
        factor.
        """
        if self.last is None or level is not self.level:
            return False
        return level in _QUIET or arrival - self.last < MIN_TURN_PERIOD

    def step(
        self,
        level: Level,
        direction: Floats | None,
        arrival: int,
        factor: int | None = None,
    ) -> tuple['Alarm', bool]:
        """
        Return the alarm after a state of this level, and whether to publish a warning.

        A warning is published for the first state, for each change of level, for each turn of the
        lost direction and change of the nearest factor while the level is WARN or ERROR, and once
        a second while the level is WARN or ERROR.
        """
        if self.last is None or level != self.level:
            say = True
        elif level in _QUIET:
            say = False
        else:
            since = arrival - self.last
            say = since >= REPEAT_PERIOD or (
                since >= MIN_TURN_PERIOD and (factor != self.factor or self._turned(direction))
            )
        if say:
            return Alarm(level, direction, arrival, factor), True
        return self, False

    def _turned(self, direction: Floats | None) -> bool:
        if direction is None or self.direction is None:
            return direction is not self.direction
        # The sign of a lost direction is arbitrary.
        return bool(abs(direction.dot(self.direction)) < TURNED_COSINE)
