"""A joint path that follows a sequence of targets."""

from dataclasses import dataclass
from typing import Literal

from ....kernel import Floats
from ....kinematics.inverse.self_motion.arcs import IkArc
from ....robot.chain import FrozenArrays
from ..plans.verdicts import PlanCheck

FamilyVerdict = Literal['yes', 'not found']


@dataclass(frozen=True, eq=False)
class FollowedPath(FrozenArrays):
    """
    A joint path that meets all targets.

    Attributes
    ----------
    q : shape (N, n), rad or m
        A posture at each target; between two of them each joint moves straight.
    arcs
        On which arc of its target each of them is.
    step : rad
        The largest motion of a joint from a target to the next.
    residual : m
        The largest remaining error at a target, by forward kinematics, as in `IkSolution`.
    position_deviation, rotation_deviation : m, rad
        How far the tool leaves the straight line and the shortest turn from each target to the
        next, where it was sampled; no rotation where none counts.
    check
        Of it as a plan with a second for each step: limits and singular poses are proved. Its
        speeds are those of that clock.
    """

    q: Floats
    arcs: tuple[int, ...]
    step: float
    residual: float
    position_deviation: float
    rotation_deviation: float
    check: PlanCheck


@dataclass(frozen=True, eq=False)
class FamilyPath:
    """
    The search for a joint path of an arm with one joint more than its targets ask for.

    Attributes
    ----------
    reason
        How long the steps of the path are, or how far the search came.
    path
        The path, or None if none was found.
    arcs
        The arcs inside the limits that `inverse_kinematics` finds for each target; after a target
        without arcs the search ends.
    """

    reason: str
    path: FollowedPath | None
    arcs: tuple[tuple[IkArc, ...], ...]

    @property
    def verdict(self) -> FamilyVerdict:
        """Return `yes`, or `not found`: then there may be a path all the same."""
        return 'not found' if self.path is None else 'yes'

    def __repr__(self) -> str:
        return f'FamilyPath({self.verdict}, {self.reason})'
