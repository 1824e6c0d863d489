"""Differences of poses, and lengths, angles and times in words."""

import math
from typing import NamedTuple

import numpy as np

from ...kernel import Floats

# Values below 1e-6 (mm, deg, ms) are round-off and are printed as 0.
ROUND_OFF = 1e-6
# Values from 1000 mm or ms on are printed in m and s.
UNIT_LIMIT = 1e3
# Values from 1000 on (m, deg) are printed without decimals.
DECIMALS_LIMIT = 1e3


def _number(value: float) -> str:
    return f'{value:,.0f}' if abs(value) >= DECIMALS_LIMIT else f'{value:.3g}'


def _with_unit(value: float, unit: str) -> str:
    # Below UNIT_LIMIT thousandths of the unit are printed, for example mm.
    thousandths = 1e3 * value
    if abs(thousandths) <= ROUND_OFF:
        return f'0 m{unit}'
    long = abs(thousandths) >= UNIT_LIMIT
    return f'{_number(value)} {unit}' if long else f'{_number(thousandths)} m{unit}'


def length_in_words(length: float) -> str:
    """Return a length (m) in mm, from 1 m in m, and 0 for round-off."""
    return _with_unit(length, 'm')


def angle_in_words(angle: float) -> str:
    """Return an angle (rad) in deg, and 0 for round-off."""
    degrees = math.degrees(angle)
    return f'{_number(degrees)} deg' if abs(degrees) > ROUND_OFF else '0 deg'


def time_in_words(time: float) -> str:
    """Return a time (s) in ms, and 0 for round-off."""
    return _with_unit(time, 's')


class PoseLimit(NamedTuple):
    """Largest remainder (RMS, with constant offsets of base and tool): m and rad."""

    position: float
    angle: float

    def in_words(self) -> str:
        """Return both."""
        return f'{length_in_words(self.position)} or {angle_in_words(self.angle)}'


# An arm with the nominal table of its type, not the calibrated one of the unit, is off by 1 to 3
# mm and up to 0.4 deg: no more is left by it and an instrument that is worth the name.
NOMINAL = PoseLimit(4e-3, math.radians(0.5))
# If each number of a table is off by 1 mm and 0.2 deg, 4 to 10 mm and 0.5 to 1 deg remain. A cause
# that leaves more is not the only mistake.
EXPLAINED = PoseLimit(12e-3, math.radians(1.25))
# Every calibrated arm leaves less than 20 mm and 2 deg.
ERROR_LIMIT = PoseLimit(20e-3, math.radians(2.0))


class Errors(NamedTuple):
    """Differences of poses: RMS and largest, position in m, orientation in rad."""

    position_rms: float
    position_max: float
    rotation_rms: float
    rotation_max: float

    @property
    def rms(self) -> tuple[float, float]:
        """Return both RMS values, m and rad."""
        return self.position_rms, self.rotation_rms

    def within(self, limit: PoseLimit) -> bool:
        """Return whether both RMS values are below a limit."""
        return self.position_rms < limit.position and self.rotation_rms < limit.angle

    def in_words(self) -> str:
        """Return both RMS values, in mm or m and in deg."""
        return f'{length_in_words(self.position_rms)}, {angle_in_words(self.rotation_rms)}'

    def cells(self) -> list[str]:
        """Return all four in words, in their order."""
        words = (length_in_words, length_in_words, angle_in_words, angle_in_words)
        return [in_words(value) for in_words, value in zip(words, self)]


def errors_of(position: Floats, rotation: Floats) -> Errors:
    """Return the errors of remainders, position (N, 3) in m and rotation (N, 3) in rad."""
    sizes = np.linalg.norm([position, rotation], axis=2)
    rms, largest = np.sqrt(np.mean(sizes**2, axis=1)), np.max(sizes, axis=1)
    return Errors(*np.stack([rms, largest], axis=1).ravel().tolist())
