"""What is known of a path of targets: a joint path that follows it, the proof that none does."""

from dataclasses import dataclass
from typing import Literal, NamedTuple

from ...kernel import Floats
from ...robot.chain import FrozenArrays
from ..inverse.result import Complete
from ..inverse.self_motion.arcs import IkArc
from ..plans.verdicts import PlanCheck

FamilyVerdict = Literal['yes', 'no', 'not decided']


class ArcLink(NamedTuple):
    """
    Whether a joint step leads from an arc of a target to one of the next.

    Attributes
    ----------
    first, second
        The arcs, by their places in `arcs` of both targets.
    verdict
        `yes`: between two of their postures; `not decided`: neither shown nor excluded. Arcs that
        are not listed are proved to be farther apart.
    """

    first: int
    second: int
    verdict: FamilyVerdict


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
    Whether an arm with one joint more than its targets ask for can follow them.

    Attributes
    ----------
    verdict
        `yes`: `path` does. `no`: proved that no posture leads as far as `target`. `not decided`.
    reason
        The same in a sentence.
    target
        Of `no` a target, counted from 0, that is not come to; an earlier one may not be, either.
        Otherwise None.
    path
        Of `yes`; otherwise None.
    arcs
        Of each target its arcs inside the limits, as `inverse_kinematics` has them; after a
        target without any of them none were looked for.
    complete
        Whether those are all.
    links
        From each target to the next the arcs that a step leads to. An arc without a link to the
        next target ends there; where two lead to one they join.
    """

    verdict: FamilyVerdict
    reason: str
    target: int | None
    path: FollowedPath | None
    arcs: tuple[tuple[IkArc, ...], ...]
    complete: tuple[Complete, ...]
    links: tuple[tuple[ArcLink, ...], ...]

    def __repr__(self) -> str:
        return f'FamilyPath({self.verdict}, {self.reason})'
