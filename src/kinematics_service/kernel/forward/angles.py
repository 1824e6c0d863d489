"""Remainders of angles after full turns, and sine and cosine."""

import math

from ..layout import places
from . import chain_pass


def shortest_angle(step: float) -> float:
    """Return the step of an angle without its full turns: math.remainder(step, 2 pi), exactly."""
    size = abs(step)
    if not math.isfinite(size):
        return places.NAN
    m = size if size < places.TAU else math.fmod(size, places.TAU)
    c = places.TAU - m
    if m < c:
        r = m
    elif m > c:
        r = -c
    else:
        r = m - 2.0 * math.fmod(0.5 * (size - m), places.TAU)
    return math.copysign(1.0, step) * r


def sine_and_cosine(x: float) -> tuple[float, float]:
    """Return sine and cosine of x in rad, as `chain_pass.sincos`."""
    return chain_pass.sincos(x)
