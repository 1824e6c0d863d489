"""The motion a controller makes of a planned trajectory: what happens between its points."""

import math
from typing import NamedTuple

import numpy as np

from ...kernel import Floats
from ...kinematics.plans.polynomials import polynomial_motion

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
        Likewise; None if the points have none.
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
    polynomials = polynomial_motion(times, q, planned.velocities, planned.accelerations)
    parts = [_segment(planned, k, c) for k, c in enumerate(polynomials.coefficients)]
    last = len(times) - 2
    end = _segment(planned, last, polynomials.coefficients[last], at_its_end=True)
    return SampledSteps(*(np.concatenate(columns) for columns in zip(*parts, end)))


def _segment(
    planned: PlannedTrajectory, k: int, c: Floats, at_its_end: bool = False
) -> SampledSteps:
    duration = float(planned.times[k + 1] - planned.times[k])
    step = planned.positions[k + 1] - planned.positions[k]
    reach = float(np.max(np.abs(step)))
    if planned.velocities is not None:
        # A cubic may swing out; its speeds bound how far.
        speeds = np.abs(planned.velocities[k : k + 2])
        reach = max(reach, 0.5 * duration * float(np.max(speeds)))
    count = min(max(math.ceil(reach / FINEST), FEWEST), MOST)
    s = np.ones(1) if at_its_end else np.arange(count) / count
    powers = np.arange(len(c))
    q = s[:, None] ** powers @ c
    slope = (powers[1:, None] * c[1:]) / duration
    qdot = s[:, None] ** powers[:-1] @ slope
    if at_its_end:
        q = planned.positions[k + 1 : k + 2]
    return SampledSteps(planned.times[k] + s * duration, q, qdot)
