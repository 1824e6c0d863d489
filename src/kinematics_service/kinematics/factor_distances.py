"""The named factors of a robot file at a pose."""

from dataclasses import dataclass
from typing import Any

from ..kernel import Floats
from ..robot.factors import motions_to_zeros


@dataclass(frozen=True, eq=False)
class FactorMeasures:
    """
    The named factors of the robot file at a pose; see `Singularity.factors`.

    Attributes
    ----------
    names
        F names, as in the robot file.
    distances : shape (..., F)
        First-order joint motion to each factor's zero, rad, 0 to pi.
    results : shape (..., F, 1 + n)
        Value and gradient of each factor.
    column_scales : shape (..., n)
        Weight of a unit of each joint in rad.
    """

    names: tuple[str, ...]
    distances: Floats
    results: Floats
    column_scales: Floats

    @property
    def values(self) -> Floats:
        """Return the value of each factor, shape (..., F)."""
        return self.results[..., 0]

    @property
    def motions(self) -> Floats:
        """
        Return the joint motion to each factor's zero by first order, shape (..., F, n), rad or m.
        """
        return motions_to_zeros(self.results, self.column_scales[..., None, :])

    @property
    def nearest(self) -> Any:
        """
        Return the index of the factor nearest to its zero: an int for one pose, shape (...) for
        many.
        """
        index = self.distances.argmin(axis=-1)
        return index if index.ndim else int(index)
