"""
How far poses are apart.

"""

import math
from typing import NamedTuple

import numpy as np

from ..kernel import Floats

# Smaller than this (mm, deg) is round-off.
NOTHING = 1e-6


def in_mm(length: float) -> str:
    """
    Return a length (m) in mm, and 0 for round-off.

    """
    return f'{1e3 * length:.3g} mm' if 1e3 * length > NOTHING else '0 mm'


def in_degrees(angle: float) -> str:
    """
    Return an angle (rad) in deg, and 0 for round-off.

    """
    degrees = math.degrees(angle)
    return f'{degrees:.3g} deg' if degrees > NOTHING else '0 deg'


class Errors(NamedTuple):
    """
    How far poses are apart: RMS and largest, position in m, orientation in rad.

    """

    position_rms: float
    position_max: float
    rotation_rms: float
    rotation_max: float

    def in_words(self) -> str:
        """
        Return both RMS values, in mm and deg.

        """
        return f'{in_mm(self.position_rms)}, {in_degrees(self.rotation_rms)}'


def errors_of(position: Floats, rotation: Floats) -> Errors:
    """
    Return the errors of what remains, position (N, 3) in m and rotation (N, 3) in rad.

    """
    p, r = np.linalg.norm(position, axis=1), np.linalg.norm(rotation, axis=1)
    return Errors(
        float(np.sqrt(np.mean(p**2))),
        float(np.max(p)),
        float(np.sqrt(np.mean(r**2))),
        float(np.max(r)),
    )
