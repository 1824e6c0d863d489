"""The motion a controller makes of a planned trajectory: what happens between its points."""

import sys
from typing import NamedTuple

import numpy as np

from ....kernel import Floats, Integers
from ..plans.polynomials import polynomial_motion

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


def sampled(planned: PlannedTrajectory, most: int = sys.maxsize) -> SampledSteps:
    """
    Return the motion along a trajectory, its points included.

    In at most so many steps, and a few for each segment: more coarsely if that takes more.
    """
    times, q = planned.times, planned.positions
    if len(times) == 1:
        return SampledSteps(times, q, np.zeros_like(q))
    polynomials = polynomial_motion(times, q, planned.velocities, planned.accelerations)
    counts = _counts(planned, most)
    parts = [
        _segment(planned, k, c, np.arange(count) / count)
        for k, (c, count) in enumerate(zip(polynomials.coefficients, counts.tolist()))
    ]
    last = len(times) - 2
    end = _segment(planned, last, polynomials.coefficients[last], np.ones(1))
    end = end._replace(positions=q[-1:])
    return SampledSteps(*(np.concatenate(columns) for columns in zip(*parts, end)))


def _counts(planned: PlannedTrajectory, most: int) -> Integers:
    # The number of samples of each segment, at its begin and after it.
    reach = np.max(np.abs(np.diff(planned.positions, axis=0)), axis=1)
    if planned.velocities is not None:
        # A cubic may swing out; its speeds bound how far.
        speeds = np.max(np.abs(planned.velocities), axis=1)
        fastest = np.maximum(speeds[:-1], speeds[1:])
        reach = np.maximum(reach, 0.5 * np.diff(planned.times) * fastest)
    counts = np.clip(np.ceil(reach / FINEST), FEWEST, MOST)
    share = min(most / float(np.sum(counts)), 1.0)
    return np.asarray(np.maximum(np.floor(share * counts), FEWEST), dtype=np.int64)


def _segment(planned: PlannedTrajectory, k: int, c: Floats, s: Floats) -> SampledSteps:
    # At shares of the segment, 0 to 1.
    duration = float(planned.times[k + 1] - planned.times[k])
    powers = np.arange(len(c))
    q = s[:, None] ** powers @ c
    slope = (powers[1:, None] * c[1:]) / duration
    qdot = s[:, None] ** powers[:-1] @ slope
    return SampledSteps(planned.times[k] + s * duration, q, qdot)
