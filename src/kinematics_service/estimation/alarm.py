"""When a singularity warning is worth saying again."""

import math
from typing import NamedTuple

from ..kernel import Floats
from ..robot.measures import Level

# The lost direction is said again when it has turned by more than this.
TURNED = math.radians(30.0)
AGREES = math.cos(TURNED)
# But not more often than this: where two directions are lost at once it is arbitrary, and turns
# with every message.
TURNS_APART = 50_000_000
# While not OK it is said again after this, so that nobody has to remember.
REPEAT = 1_000_000_000
_QUIET = (Level.OK, Level.STALE)


class Alarm(NamedTuple):
    """
    What was said last; `step` returns the next one.

    Attributes
    ----------
    level
        Level now; None before the first.
    direction : shape (6,)
        The lost direction said last.
    said : ns
        When something was said last, steady clock.
    factor
        Index of the nearest named factor said last; None where there are none.
    """

    level: Level = Level.OK
    direction: Floats | None = None
    last: int | None = None
    factor: int | None = None

    def is_settled(self, level: Level, arrival: int) -> bool:
        """Return whether `step` would say nothing and change nothing, whatever is lost or near."""
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
        Return the alarm after a state of this level, and whether to say it.

        Said are the first state, each change of level, each turn of the lost direction and change
        of the nearest factor while not OK, and once a second while it is WARN or ERROR.
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
