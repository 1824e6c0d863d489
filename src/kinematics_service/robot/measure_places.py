# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute the columns of the result array in which `kernel.measure` writes each quantity."""

from itertools import accumulate
from typing import NamedTuple

from .. import kernel


class MeasurePlaces(NamedTuple):
    """
    The column indices of the quantities that `kernel.measure` writes. Each pose has one row.

    Attributes
    ----------
    lost, motion, way, sigma
        First columns of four vectors. `lost` and `motion` are the two singular vectors of the
        smallest singular value of J_t. At a singular pose, the tool cannot move along `lost`, and
        the joint motion `motion` does not move the tool. `way` is the joint motion away from the
        nearest singular pose. `sigma` are the singular values.
    judged
        First of four columns: the value of the watched measure, the level of this value (OK, WARN,
        ERROR), the index of the factor that is nearest to zero, and the first-order distance to a
        singular pose. The offsets from this column are kernel.WATCHED (0), LEVEL, NEAREST_FACTOR
        and FIRST_ORDER (3).
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
    Return the column indices for an arm with `dof` joints, `rows` task rows and `factors` factors.
    """
    widths = (6, dof, dof, min(dof, rows), kernel.JUDGED, factors, factors * (1 + dof), dof)
    return MeasurePlaces(*accumulate(widths, initial=kernel.LOST_AT))
