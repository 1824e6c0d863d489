# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Convert numbers of a table to texts, which have exactly the values of the numbers."""

import math
from dataclasses import dataclass
from fractions import Fraction

from ...typography import number_text

# Round-off of products of a few dozen rotations and lengths near 1: about 10 machine epsilons.
ROUND_OFF = 2e-15
DECIMALS = 12  # round a value to 12 decimals if the change is at most ROUND_OFF
PARTS = 12  # write multiples of pi/12 (15 degrees) as fractions of pi
# An angle such as 1.57 counts as a rounded multiple of pi/12 if its difference from the multiple
# is below two limits. One limit is ROUNDED. The other limit is LAST_DIGITS times the unit of the
# last written digit. For 1.57 this unit is 0.01, and the limit 0.025.
LAST_DIGITS = 2.5
ROUNDED = 1e-3  # rad
# Largest error of a right angle from a CAD program, rad. The value is the round-off of 32 bit
# numbers (6e-8) after a few products.
CAD_NOISE = 1e-6


@dataclass(frozen=True)
class WrittenNumber:
    """A number in rad or m, and the text of the number in a robot file."""

    text: str
    value: float


def length_of(value: float) -> WrittenNumber:
    """Return a length, m, without round-off, and its text: `0.4` for 0.40000000000000013."""
    # Convert a numpy number to a float, because its repr contains the name of its type.
    value = float(value)
    near = round(value, DECIMALS)
    value = (near if abs(value - near) <= ROUND_OFF * max(1.0, abs(value)) else value) + 0.0
    return WrittenNumber(number_text(value), value)


def angle_of(value: float) -> WrittenNumber:
    """Return an angle, rad, without round-off, and its text: `-pi/2` for -1.5707963267948966."""
    part = Fraction(round(value / math.pi * PARTS), PARTS)
    over, under = part.numerator, part.denominator
    exact = over * math.pi / under
    if over == 0 or abs(value - exact) > ROUND_OFF * max(1.0, abs(value)):
        return length_of(value)
    name = {1: 'pi', -1: '-pi'}.get(over, f'{over}*pi')
    return WrittenNumber(name if under == 1 else f'{name}/{under}', exact)


def as_rounded_part_of_pi(text: str) -> float:
    """
    Return the angle in a text, rad. If the text is a rounded multiple of pi/12, return the
    multiple.

    For `1.57`, `1.5707` (cut off) and `1.570796325` (3.14159265 / 2), the result is pi/2. If the
    difference from each multiple is larger than a rounding error, as for a calibrated angle, the
    angle is not changed. The noise of CAD programs is removed: for `-9.4e-08` the result is 0.
    """
    near = min(LAST_DIGITS * 10.0 ** -len(text.partition('.')[2]), ROUNDED)
    return part_of_pi(float(text), CAD_NOISE if 'e' in text.lower() else max(near, CAD_NOISE))


def part_of_pi(value: float, near: float = CAD_NOISE) -> float:
    """
    Return the multiple of pi/12 whose distance to an angle is less than `near` (rad). If no
    multiple is so close, return the angle.
    """
    exact = round(value / math.pi * PARTS) * math.pi / PARTS
    return exact if abs(exact - value) < near else value
