"""Compute the columns of a row of measures."""

from itertools import accumulate
from typing import NamedTuple

from .. import kernel


class MeasurePlaces(NamedTuple):
    """
    The columns of a row of measures, as `kernel.measure` fills it.

    Attributes
    ----------
    lost, motion, way, sigma
        First column of the lost direction, the joint motion, the way out, the singular values.
    judged
        The column kernel.WATCHED; those up to FIRST_ORDER follow.
    distances, results
        First column of the factors' distances, and of their values and gradients.
    pose
        First column of the nearest singular pose.
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
    """Return the columns for an arm, by the numbers of its joints, task rows and factors."""
    widths = (6, dof, dof, min(dof, rows), kernel.JUDGED, factors, factors * (1 + dof), dof)
    return MeasurePlaces(*accumulate(widths, initial=kernel.LOST_AT))
