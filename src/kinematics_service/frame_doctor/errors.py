"""
How far poses are apart.

"""

import math
from typing import NamedTuple

import numpy as np

from ..kernel import Floats


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
        return f'{1e3 * self.position_rms:.3g} mm, {math.degrees(self.rotation_rms):.3g} deg'


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
