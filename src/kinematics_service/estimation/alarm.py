"""The rules by which a singularity warning is repeated."""

import math
from typing import NamedTuple

from ..kernel import Floats
from ..robot.measures import Level

# The warning is repeated when the lost direction has turned by more than this.
TURNED = math.radians(30.0)
AGREES = math.cos(TURNED)
# It is not repeated more often than this: if two directions are lost at once, the direction is
# arbitrary and turns with every message.
TURNS_APART = 50_000_000
# While the level is not OK the warning is repeated after this time, so that nobody has to remember
# it.
REPEAT = 1_000_000_000
_QUIET = (Level.OK, Level.STALE)


class Alarm(NamedTuple):
    """
    The state of the warning that was published last; `step` returns the next state.

    Attributes
    ----------
    level
        Level now; None before the first.
    direction : shape (6,)
        The lost direction of the last warning.
    last : ns
        Time of the last warning, steady clock.
    factor
        Index of the nearest named factor of the last warning; None if there are no factors.
    """

    level: Level = Level.OK
    direction: Floats | None = None
    last: int | None = None
    factor: int | None = None

    def is_settled(self, level: Level, arrival: int) -> bool:
        """
        Return whether `step` would publish nothing and change nothing, whatever is lost or near.
        """
        if self.last is None or level is not self.level:
            return False
        return level in _QUIET or arrival - self.last < TURNS_APART

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
        lost direction and change of the nearest factor while the level is not OK, and once a
        second while it is WARN or ERROR.
        """
        if self.last is None or level != self.level:
            say = True
        elif level in _QUIET:
            say = False
        else:
            since = arrival - self.last
            say = since >= REPEAT or (
                since >= TURNS_APART and (factor != self.factor or self._turned(direction))
            )
        if say:
            return Alarm(level, direction, arrival, factor), True
        return self, False

    def _turned(self, direction: Floats | None) -> bool:
        if direction is None or self.direction is None:
            return direction is not self.direction
        # A lost direction is a line: its sign means nothing.
        return bool(abs(direction.dot(self.direction)) < AGREES)
