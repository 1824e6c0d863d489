"""Compute the column of each quantity in the rows that `kernel.measure` fills."""

from itertools import accumulate
from typing import NamedTuple

from .. import kernel


class MeasurePlaces(NamedTuple):
    """
    The column indices of the quantities in a row that `kernel.measure` fills.

    Attributes
    ----------
    lost, motion, way, sigma
        First column of four quantities: the direction of the tool that is null at a singular pose,
        the joint motion that belongs to it, the joint motion away from the nearest singular pose,
        and the singular values.
    judged
        The column of kernel.WATCHED, followed by the columns up to kernel.FIRST_ORDER.
    distances, results
        First column of the distances to the factors' zeros, and of the values and gradients of
        the factors.
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
    """Return the columns for an arm, given its numbers of joints, task rows and factors."""
    widths = (6, dof, dof, min(dof, rows), kernel.JUDGED, factors, factors * (1 + dof), dof)
    return MeasurePlaces(*accumulate(widths, initial=kernel.LOST_AT))
