"""Write the numbers of a table so that text and value agree exactly."""

import math
from dataclasses import dataclass
from fractions import Fraction

from ...typography import number_text

# Round-off of products of a few dozen rotations and lengths near 1: about 10 machine epsilons.
ROUND_OFF = 2e-15
DECIMALS = 12  # a value with 12 decimals, within ROUND_OFF, is written with 12 decimals
PARTS = 12  # angles are parts of pi in steps of 15 degrees, pi/12
LAST_DIGITS = 2.5  # largest error of a rounded part of pi, in units of its last digit
ROUNDED = 1e-3  # the same in rad
# Largest error of a right angle from a CAD program, rad: 32 bits (6e-8) and a few products.
CAD_NOISE = 1e-6


@dataclass(frozen=True)
class WrittenNumber:
    """A number and its text in a robot file, in rad or m."""

    text: str
    value: float


def length_of(value: float) -> WrittenNumber:
    """Return a length without round-off in its last digits, 0.4 for 0.40000000000000013."""
    value = float(value)  # a numpy number has another repr
    near = round(value, DECIMALS)
    value = (near if abs(value - near) <= ROUND_OFF * max(1.0, abs(value)) else value) + 0.0
    return WrittenNumber(number_text(value), value)


def angle_of(value: float) -> WrittenNumber:
    """Return an angle without round-off, and parts of pi by name, `-pi/2`."""
    part = Fraction(round(value / math.pi * PARTS), PARTS)
    over, under = part.numerator, part.denominator
    exact = over * math.pi / under
    if over == 0 or abs(value - exact) > ROUND_OFF * max(1.0, abs(value)):
        return length_of(value)
    name = {1: 'pi', -1: '-pi'}.get(over, f'{over}*pi')
    return WrittenNumber(name if under == 1 else f'{name}/{under}', exact)


def as_rounded_part_of_pi(text: str) -> float:
    """
    Return the part of pi that an angle rounds, or the angle itself.

    `1.57`, `1.5707` (cut off) and `1.570796325` (half of a rounded pi) are pi/2. An angle that
    differs before its last digits, such as a calibrated angle, stays as it is. The noise of CAD
    programs is removed: -9.4e-08 is 0.
    """
    near = min(LAST_DIGITS * 10.0 ** -len(text.partition('.')[2]), ROUNDED)
    return part_of_pi(float(text), CAD_NOISE if 'e' in text.lower() else max(near, CAD_NOISE))


def part_of_pi(value: float, near: float = CAD_NOISE) -> float:
    """Return the part of pi within `near` (rad) of an angle, or the angle itself."""
    exact = round(value / math.pi * PARTS) * math.pi / PARTS
    return exact if abs(exact - value) < near else value
