"""Reduce angles by full turns, and compute sine and cosine."""

import math

from ..layout import places
from . import chain_pass


def shortest_angle(step: float) -> float:
    """Return an angle step, rad, minus full turns: math.remainder(step, 2 pi), bit for bit."""
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
    """Return sine and cosine of x, rad, by `chain_pass.sincos`."""
    return chain_pass.sincos(x)
