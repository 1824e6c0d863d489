"""The named factors of a robot file at a pose."""

from dataclasses import dataclass, fields
from typing import Any, ClassVar, Generic, Protocol

import numpy as np

from ..kernel import Floats
from ..robot.factors import motions_to_zeros
from .one_or_many import Index


class _Dataclass(Protocol):
    __dataclass_fields__: ClassVar[dict[str, Any]]


@dataclass(frozen=True, eq=False)
class FactorMeasures(Generic[Index]):
    """
    The named factors of the robot file at a pose; see `Singularity.factors`.

    Attributes
    ----------
    names
        F names, as in the robot file.
    estimates : shape (..., F)
        First-order joint motion to each factor's zero, rad, 0 to pi: no distance. Of a closed loop
        what was found, where its flat position was.
    results : shape (..., F, 1 + n)
        Value and gradient of each factor.
    column_scales : shape (..., n)
        Weight of a unit of each joint in rad.
    """

    names: tuple[str, ...]
    estimates: Floats
    results: Floats
    column_scales: Floats

    def __eq__(self, other: object) -> bool:
        """Compare every value exactly; what is no number equals itself."""
        return same_values(self, other) if isinstance(other, FactorMeasures) else NotImplemented

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
    def nearest(self) -> Index:
        """
        Return the index of the factor nearest to its zero: an int for one pose, shape (...) for
        many.
        """
        found = self.estimates.argmin(axis=-1)
        index: Index = found if found.ndim else found.item()
        return index


def same_values(one: _Dataclass, other: _Dataclass) -> bool:
    """Return whether the fields of two results hold the same values; NaN is the same as NaN."""

    def same(a: Any, b: Any) -> bool:
        if isinstance(a, np.ndarray | float) and isinstance(b, np.ndarray | float):
            return np.array_equal(a, b, equal_nan=True)
        return type(a) is type(b) and bool(a == b)

    return all(same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
