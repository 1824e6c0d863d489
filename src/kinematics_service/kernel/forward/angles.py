# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Reduce an angle to at most half a turn, and compute its sine and cosine."""

import math

from ..layout import places
from . import chain_pass


def shortest_angle(step: float) -> float:
    """
    Return the angle `step`, rad, minus full turns, so that its size is at most half a turn. The
    result is bit for bit that of math.remainder(step, 2 pi).
    """
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
    """
    Return the sine and the cosine of the angle x, rad, as a pair, by the kernel's function
    `sincos`.
    """
    return chain_pass.sincos(x)
