# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Sample the motion that joint_trajectory_controller makes from a planned trajectory."""

import sys
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ....kernel import Floats, Integers
from ..plans.polynomials import polynomial_motion

# Largest motion of a joint between two samples, rad or m. It may be larger if a trajectory would
# otherwise need more than the largest number of samples.
MAX_STEP = 0.01
# Least number of samples between two points of the trajectory. Several samples are needed, because
# a joint may turn back between the points.
MIN_SAMPLES = 4
# Largest number of samples between two points of the trajectory.
MAX_SAMPLES = 2_000


class PlannedTrajectory(NamedTuple):
    """
    A planned trajectory of k joints: times and joint positions of its N points.

    Attributes
    ----------
    names
        Joint names.
    times : shape (N,), s
        Times of the points since the start.
    positions : shape (N, k), rad or m
    velocities, accelerations
        Derivatives of the positions; None if the points have none.
    """

    names: tuple[str, ...]
    times: Floats
    positions: Floats
    velocities: Floats | None
    accelerations: Floats | None

    def of(self, names: Sequence[str]) -> 'PlannedTrajectory':
        """Return the motion of some of the joints, in the order of `names`."""
        columns = [self.names.index(name) for name in names]
        qdot, qddot = (None if table is None else table[:, columns] for table in self[3:])
        q = self.positions[:, columns]
        return PlannedTrajectory(tuple(names), self.times, q, qdot, qddot)


class SampledSteps(NamedTuple):
    """
    A sampled motion: times (N,), s; positions (N, k), rad or m; velocities (N, k), rad/s or m/s.
    """

    times: Floats
    positions: Floats
    velocities: Floats


def sampled(planned: PlannedTrajectory, limit: int = sys.maxsize) -> SampledSteps:
    """
    Return samples of the motion along a trajectory, including the trajectory's points.

    The joints move at most about 0.01 (rad or m) from sample to sample. If the trajectory then
    needs more than `limit` samples, the steps are made larger. Each segment between two points has
    at least 4 samples; this minimum has priority over `limit`.
    """
    q = planned.positions
    motion = polynomial_motion(planned.times, q, planned.velocities, planned.accelerations)
    counts = _counts(planned, limit)
    segment = np.append(np.repeat(np.arange(len(counts)), counts), len(motion.begins) - 1)
    s = np.concatenate([*(np.arange(count) / count for count in counts), [1.0]])
    positions = motion.positions(segment, s)
    positions[-1] = q[-1]
    return SampledSteps(motion.times(segment, s), positions, motion.velocities(segment, s))


def _counts(planned: PlannedTrajectory, limit: int) -> Integers:
    # Returns the number of samples in each segment between two points. The sample at the end of a
    # segment belongs to the next segment.
    reach = np.max(np.abs(np.diff(planned.positions, axis=0)), axis=1)
    if planned.velocities is not None:
        # If a joint is fast at an end of a segment, it overshoots: it moves farther than the
        # difference between its positions at the two ends. So estimate the motion also by speed.
        speeds = np.max(np.abs(planned.velocities), axis=1)
        fastest = np.maximum(speeds[:-1], speeds[1:])
        reach = np.maximum(reach, 0.5 * np.diff(planned.times) * fastest)
    counts = np.clip(np.ceil(reach / MAX_STEP), MIN_SAMPLES, MAX_SAMPLES)
    fraction = min(limit / max(float(np.sum(counts)), 1.0), 1.0)
    return np.asarray(np.maximum(np.floor(fraction * counts), MIN_SAMPLES), dtype=np.int64)
