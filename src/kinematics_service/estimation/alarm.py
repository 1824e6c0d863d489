# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Decide when the node publishes a singularity warning: at each change of the singularity level (OK,
WARN, ERROR, STALE), and repeatedly while the level is WARN or ERROR.
"""

import math
from typing import NamedTuple

from ..kernel import Floats
from ..robot.measures import Level

# The lost direction is the direction in which the tool cannot move. The node repeats the warning
# if this direction has turned by at least this angle, rad, since the last warning.
TURNED = math.radians(30.0)
# The warning is repeated if the cosine of the angle between the present lost direction and that of
# the last warning is below this number, the cosine of `TURNED`.
TURNED_COSINE = math.cos(TURNED)
# Smallest time between two warnings if the lost direction keeps turning, ns. If the tool loses two
# directions at once, the lost direction is computed as an arbitrary combination of the two, and
# turns with every message.
MIN_TURN_PERIOD = 50_000_000
# Period at which the warning is repeated while the level is WARN or ERROR, ns.
REPEAT_PERIOD = 1_000_000_000
_QUIET = (Level.OK, Level.STALE)


class Alarm(NamedTuple):
    """
    The last published singularity warning: its level, lost direction, time, and nearest singular
    factor. `step` returns the next `Alarm`.

    Attributes
    ----------
    level
        Level of the last published warning.
    direction : shape (6,)
        The lost direction of the last warning.
    last : ns
        Time of the last warning, steady clock; None before the first warning.
    factor
        Index of the singular factor of the robot file that was nearest to zero at the last
        warning; None for an arm without singular factors.
    """

    level: Level = Level.OK
    direction: Floats | None = None
    last: int | None = None
    factor: int | None = None

    def is_settled(self, level: Level, arrival: int) -> bool:
        """
        Return whether level and time alone decide that `step` publishes no warning now.

        Then the lost direction and the nearest factor need not be computed.
        """
        if self.last is None or level != self.level:
            return False
        return level in _QUIET or arrival - self.last < MIN_TURN_PERIOD

    def step(
        self, level: Level, direction: Floats | None, arrival: int, factor: int | None = None
    ) -> tuple['Alarm', bool]:
        """
        Return the next alarm, and whether the node must publish a warning now.

        The node must publish for the first state and for each change of level. While the level is
        WARN or ERROR, it must publish once a second. It must also publish if the lost direction
        turns, or if another singular factor becomes the one nearest to zero.
        """
        if self.is_settled(level, arrival):
            return self, False
        recent = self.last is not None and arrival - self.last < REPEAT_PERIOD
        same = level == self.level and factor == self.factor
        if recent and same and not self._turned(direction):
            return self, False
        return Alarm(level, direction, arrival, factor), True

    def _turned(self, direction: Floats | None) -> bool:
        if direction is None or self.direction is None:
            return direction is not self.direction
        # Take the absolute value, because a lost direction and its negative describe one loss.
        return bool(abs(direction.dot(self.direction)) < TURNED_COSINE)
