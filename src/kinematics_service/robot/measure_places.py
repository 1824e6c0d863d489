"""Compute the columns of a row of measures."""

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
    motion = kernel.LOST_AT + 6
    way = motion + dof
    sigma = way + dof
    judged = sigma + min(dof, rows)
    distances = judged + kernel.JUDGED
    results = distances + factors
    pose = results + factors * (1 + dof)
    return MeasurePlaces(
        kernel.LOST_AT, motion, way, sigma, judged, distances, results, pose, pose + dof
    )
