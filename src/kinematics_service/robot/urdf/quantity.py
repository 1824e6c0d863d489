"""Numbers of a table as they will be written: text and value agree exactly."""

import math
from dataclasses import dataclass
from fractions import Fraction

from ...typography import number_text

# Round-off of products of a few dozen rotations and lengths near 1.
ROUND_OFF = 2e-15
DECIMALS = 12  # a value that is this round within ROUND_OFF is taken as round
PARTS = 12  # of pi: 15 degrees, the angles that arms are built of
# Largest error of a rounded part of pi, in units of its last digit and in rad.
LAST_DIGITS, ROUNDED = 2.5, 1e-3
# rad: what CAD programs leave of a right angle, computed with 32 bits (6e-8) and a few products.
CAD_NOISE = 1e-6


@dataclass(frozen=True)
class WrittenNumber:
    """A number and its text in a robot file, in rad or m."""

    text: str
    value: float


def length_of(value: float) -> WrittenNumber:
    """Return a length without the last digits that are round-off, 0.4 for 0.40000000000000013."""
    value = float(value)  # the repr of a numpy number is not a number
    near = round(value, DECIMALS)
    value = (near if abs(value - near) <= ROUND_OFF * max(1.0, abs(value)) else value) + 0.0
    return WrittenNumber(number_text(value), value)


def angle_of(value: float) -> WrittenNumber:
    """Return an angle likewise, and parts of pi by their name, -pi/2 for -1.5707963267948966."""
    part = Fraction(round(value / math.pi * PARTS), PARTS)
    over, under = part.numerator, part.denominator
    exact = over * math.pi / under
    if over == 0 or abs(value - exact) > ROUND_OFF * max(1.0, abs(value)):
        return length_of(value)
    name = {1: 'pi', -1: '-pi'}.get(over, f'{over}*pi')
    return WrittenNumber(name if under == 1 else f'{name}/{under}', exact)


def as_rounded_part_of_pi(text: str) -> float:
    """
    Return an angle, and for one that is a part of pi rounded to its digits, that part.

    `1.57`, `1.5707` (cut off) and `1.570796325` (half of a rounded pi) are pi/2; an angle with as
    many digits that differs earlier, such as a calibrated one, stays as it is. The noise of CAD
    programs goes, -9.4e-08 for 0.
    """
    near = min(LAST_DIGITS * 10.0 ** -len(text.partition('.')[2]), ROUNDED)
    return part_of_pi(float(text), CAD_NOISE if 'e' in text.lower() else max(near, CAD_NOISE))


def part_of_pi(value: float, near: float = CAD_NOISE) -> float:
    """Return the part of pi within `near` (rad) of an angle, or the angle itself."""
    exact = round(value / math.pi * PARTS) * math.pi / PARTS
    return exact if abs(exact - value) < near else value
