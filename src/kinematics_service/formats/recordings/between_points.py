"""The motion a controller makes of a planned trajectory: what happens between its points."""

import math
from typing import NamedTuple

import numpy as np

from ...kernel import Floats

# Between two points no joint moves more than this from sample to sample (rad, m).
FINEST = 0.01
# Samples between two points at least (so that a turning joint is seen), and at most.
FEWEST, MOST = 4, 2_000


class PlannedTrajectory(NamedTuple):
    """
    A trajectory as it was planned.

    Attributes
    ----------
    names
        Joint names.
    times : shape (N,), s
        Since the start.
    positions : shape (N, k), rad or m
    velocities, accelerations
        Likewise; None where the points have none.
    """

    names: tuple[str, ...]
    times: Floats
    positions: Floats
    velocities: Floats | None
    accelerations: Floats | None


class SampledSteps(NamedTuple):
    """A motion in steps: times (N,) in s, positions (N, k), velocities (N, k)."""

    times: Floats
    positions: Floats
    velocities: Floats


def sampled(planned: PlannedTrajectory) -> SampledSteps:
    """Return the motion along a trajectory, its points included."""
    times, q = planned.times, planned.positions
    if len(times) == 1:
        return SampledSteps(times, q, np.zeros_like(q))
    parts = [_segment(planned, k) for k in range(len(times) - 1)]
    end = _segment(planned, len(times) - 2, at_its_end=True)
    return SampledSteps(*(np.concatenate(columns) for columns in zip(*parts, end)))


def _segment(planned: PlannedTrajectory, k: int, at_its_end: bool = False) -> SampledSteps:
    duration = float(planned.times[k + 1] - planned.times[k])
    step = planned.positions[k + 1] - planned.positions[k]
    reach = float(np.max(np.abs(step)))
    if planned.velocities is not None:
        # A cubic may swing out; its speeds say how far.
        speeds = np.abs(planned.velocities[k : k + 2])
        reach = max(reach, 0.5 * duration * float(np.max(speeds)))
    count = min(max(math.ceil(reach / FINEST), FEWEST), MOST)
    s = np.ones(1) if at_its_end else np.arange(count) / count
    c = _polynomial(planned, k, duration)
    powers = np.arange(len(c))
    q = s[:, None] ** powers @ c
    slope = (powers[1:, None] * c[1:]) / duration
    qdot = s[:, None] ** powers[:-1] @ slope
    if at_its_end:
        q = planned.positions[k + 1 : k + 2]
    return SampledSteps(planned.times[k] + s * duration, q, qdot)


def _polynomial(planned: PlannedTrajectory, k: int, T: float) -> Floats:
    # Coefficients by powers of s = t/T, shape (degree + 1, joints): Hermite's conditions at 0, 1.
    p0, p1 = planned.positions[k], planned.positions[k + 1]
    if planned.velocities is None:
        return np.stack([p0, p1 - p0])
    v0, v1 = planned.velocities[k] * T, planned.velocities[k + 1] * T
    d = p1 - p0
    if planned.accelerations is None:
        return np.stack([p0, v0, 3 * d - 2 * v0 - v1, v0 + v1 - 2 * d])
    a0, a1 = planned.accelerations[k] * T * T, planned.accelerations[k + 1] * T * T
    return np.stack(
        [
            p0,
            v0,
            0.5 * a0,
            10 * d - 6 * v0 - 4 * v1 - 1.5 * a0 + 0.5 * a1,
            -15 * d + 8 * v0 + 7 * v1 + 1.5 * a0 - a1,
            6 * d - 3 * (v0 + v1) - 0.5 * (a0 - a1),
        ]
    )
