"""A moment of a plan by its place in it."""

import numpy as np

from .polynomials import PolynomialMotion
from .verdicts import PlanMoment


def moment_at(motion: PolynomialMotion, segment: int, s: float) -> PlanMoment:
    """Return the moment at a share s of a segment."""
    at, share = np.array([segment]), np.array([s])
    time = float(motion.times(at, share)[0])
    last = segment == len(motion.begins) - 1 and s == 1.0 and motion.durations[segment] > 0.0
    return PlanMoment(time, segment + int(last), motion.positions(at, share)[0])
