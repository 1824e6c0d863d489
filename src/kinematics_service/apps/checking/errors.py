# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute RMS and largest errors of poses; write lengths, angles and times as text with units."""

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
    # Return a value (m or s) as text. If it is below UNIT_LIMIT thousandths, the text is in
    # thousandths of the unit, for example mm.
    thousandths = 1e3 * value
    if abs(thousandths) <= ROUND_OFF:
        return f'0 m{unit}'
    long = abs(thousandths) >= UNIT_LIMIT
    return f'{_number(value)} {unit}' if long else f'{_number(thousandths)} m{unit}'


def length_in_words(length: float) -> str:
    """Return a length (m) as text: in mm below 1 m, otherwise in m. Round-off becomes 0."""
    return _with_unit(length, 'm')


def angle_in_words(angle: float) -> str:
    """Return an angle (rad) as text in deg. Round-off becomes 0."""
    degrees = math.degrees(angle)
    return f'{_number(degrees)} deg' if abs(degrees) > ROUND_OFF else '0 deg'


def time_in_words(time: float) -> str:
    """Return a time (s) as text: in ms below 1 s, otherwise in s. Round-off becomes 0."""
    return _with_unit(time, 's')


class PoseLimit(NamedTuple):
    """
    Limits of the RMS residuals, position (m) and rotation (rad), after the offsets of base and
    tool are fitted.
    """

    position: float
    angle: float

    def in_words(self) -> str:
        """Return the largest allowed RMS residuals as text, such as `4 mm or 0.5 deg`."""
        return f'{length_in_words(self.position)} or {angle_in_words(self.angle)}'


# Largest RMS residuals between poses that an instrument measures and poses that the nominal table
# of an uncalibrated arm gives. The errors of the table alone are 1 to 3 mm and up to 0.4 deg.
NOMINAL = PoseLimit(4e-3, math.radians(0.5))
# A mistake explains the residuals if the RMS residuals after the correction are below this limit.
# The limit allows for an inexact table: if each length is off by 1 mm and each angle by 0.2 deg,
# the RMS residuals are 4 to 10 mm and 0.5 to 1 deg.
EXPLAINED = PoseLimit(12e-3, math.radians(1.25))
# If the RMS residuals between two sources of poses exceed these limits, the level is ERROR. With a
# right table the residuals are always below 20 mm and 2 deg.
ERROR_LIMIT = PoseLimit(20e-3, math.radians(2.0))


class Errors(NamedTuple):
    """RMS and largest differences of poses: position in m, orientation in rad."""

    position_rms: float
    position_max: float
    rotation_rms: float
    rotation_max: float

    @property
    def rms(self) -> tuple[float, float]:
        """Return the RMS values of position (m) and orientation (rad)."""
        return self.position_rms, self.rotation_rms

    def within(self, limit: PoseLimit) -> bool:
        """Return whether the RMS values of position and orientation are below a limit."""
        return self.position_rms < limit.position and self.rotation_rms < limit.angle

    def in_words(self) -> str:
        """Return the RMS errors of position (mm or m) and orientation (deg) as text."""
        return f'{length_in_words(self.position_rms)}, {angle_in_words(self.rotation_rms)}'

    def cells(self) -> list[str]:
        """
        Return four texts: RMS and largest position error, then RMS and largest orientation error.
        """
        words = (length_in_words, length_in_words, angle_in_words, angle_in_words)
        return [in_words(value) for in_words, value in zip(words, self)]


def errors_of(position: Floats, rotation: Floats) -> Errors:
    """
    Return RMS and largest residuals from the residuals of N poses: `position` (N, 3) in m and
    `rotation` (N, 3) in rad.
    """
    sizes = np.linalg.norm([position, rotation], axis=2)
    rms, largest = np.sqrt(np.mean(sizes**2, axis=1)), np.max(sizes, axis=1)
    return Errors(*np.stack([rms, largest], axis=1).ravel().tolist())
