# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute the columns of the result array in which `kernel.measure` writes each quantity."""

from itertools import accumulate
from typing import NamedTuple

from .. import kernel


class MeasurePlaces(NamedTuple):
    """
    Indices of the columns in which `kernel.measure` writes its results. Each pose has one row.

    Attributes
    ----------
    lost, motion, way, sigma
        Each field is the index of the first column of a vector. `lost` and `motion` are the two
        singular vectors of the smallest singular value of J_t (the task rows of the Jacobian). At
        a singular pose, the tool cannot move along `lost`, and the joint motion `motion` does not
        move the tool. `way` is the joint motion away from the nearest singular pose. `sigma` has
        the singular values of J_t.
    judged
        First of four columns: the value of the measure to which the arm's thresholds apply, the
        level of this value (OK, WARN, ERROR), the index of the factor that is nearest to zero, and
        the first-order distance to a singular pose. The offsets from this column are
        kernel.WATCHED (0), LEVEL, NEAREST_FACTOR and FIRST_ORDER (3).
    distances, results
        `distances`: first of the columns that have, for each factor, the distance from the pose to
        a zero of the factor. `results`: first of the columns that have value and gradient of each
        factor.
    pose
        First column of the joint positions of the nearest singular pose.
    width
        Number of columns.
    """

    lost: int
    motion: int
    way: int
    sigma: int
    judged: int
    distances: int
    results: int
    pose: int
    width: int


def measure_places(dof: int, rows: int, factors: int = 0) -> MeasurePlaces:
    """
    Return the indices of the columns in which `kernel.measure` writes its results for an arm.

    `dof` is the number of joints, `rows` the number of task rows, and `factors` the number of
    singular factors.
    """
    widths = (6, dof, dof, min(dof, rows), kernel.JUDGED, factors, factors * (1 + dof), dof)
    return MeasurePlaces(*accumulate(widths, initial=kernel.LOST_AT))
