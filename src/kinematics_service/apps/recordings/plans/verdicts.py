"""What is known of a plan: proved, refuted by a pose, or not decided."""

from dataclasses import dataclass
from typing import Literal, NamedTuple

from ....kernel import Floats
from ....robot.chain import FrozenArrays

PlanVerdict = Literal['proved', 'refuted', 'not decided']
# From the best to the worst.
_ORDER: tuple[PlanVerdict, ...] = ('proved', 'not decided', 'refuted')


@dataclass(frozen=True, eq=False)
class PlanMoment(FrozenArrays):
    """
    A moment of a plan.

    Attributes
    ----------
    time
        s, as the points have it.
    point
        The point before it, counted from 0.
    q : shape (n,), rad or m
        Joint positions; read-only.
    """

    time: float
    point: int
    q: Floats


@dataclass(frozen=True, eq=False)
class PlanSingularity:
    """
    How near a plan comes to singular poses.

    Attributes
    ----------
    verdict
        `proved`: nowhere within the threshold. `refuted`: at `moment` the plan is that near to
        `nearest_singular`. `not decided`: neither.
    threshold
        rad; prismatic joints are divided by the characteristic length.
    lower
        The plan is proved to keep this distance from every singular pose, rad; 0 where nothing is
        proved of all of it.
    upper
        The least distance to a singular pose that was found, rad; infinite where none was.
    moment
        Where `upper` is taken if the plan is refuted, otherwise where the least is proved.
    nearest_singular : shape (n,), rad or m
        The singular pose found for `moment`; read-only; None where none was.
    undecided
        Times (begin, end) for which nothing is decided, s.
    evaluations
        Number of poses at which a clearance was computed.
    """

    verdict: PlanVerdict
    threshold: float
    lower: float
    upper: float
    moment: PlanMoment
    nearest_singular: Floats | None
    undecided: tuple[tuple[float, float], ...]
    evaluations: int

    def __post_init__(self) -> None:
        """Freeze the pose."""
        if self.nearest_singular is not None:
            self.nearest_singular.setflags(write=False)


class JointExtreme(NamedTuple):
    """An extreme of a joint's motion: rad or m, or its speed in rad/s or m/s; at which moment."""

    value: float
    moment: PlanMoment


@dataclass(frozen=True, eq=False)
class PlanJoint:
    """
    A joint's range and speed over all of a plan, exact to round-off.

    Attributes
    ----------
    name
        Of the joint.
    least, greatest, fastest
        Its extremes.
    limits, speed
        Whether they are inside its limits, and below its velocity limit: proved or refuted.
    """

    name: str
    least: JointExtreme
    greatest: JointExtreme
    fastest: JointExtreme
    limits: PlanVerdict
    speed: PlanVerdict


@dataclass(frozen=True, eq=False)
class PlanSpeed:
    """
    The largest speed of a point of the arm over all of a plan.

    Attributes
    ----------
    of
        `tool`, a frame by its number, or a joint.
    lower, upper
        m/s: it has the first at `moment`, and nowhere more than the second.
    moment
        A moment with the speed `lower`.
    limit
        m/s; None without one.
    verdict
        Whether it keeps below the limit; None without one.
    """

    of: str
    lower: float
    upper: float
    moment: PlanMoment
    limit: float | None
    verdict: PlanVerdict | None


@dataclass(frozen=True, eq=False)
class PlanClosure:
    """
    Whether the closed loops of an arm close along a plan.

    Attributes
    ----------
    verdict
        `refuted`: at `moment` a loop does not close. `not decided`: they close at all samples,
        each by itself on the branch of the known positions; nothing is proved between them.
    loop, sentence
        The loop that does not close, and why; empty where all do.
    samples
        Number of poses that were looked at.
    moment
        The first sample that does not close, brought to where the branch ends; None where all do.
    """

    verdict: PlanVerdict
    loop: str
    sentence: str
    samples: int
    moment: PlanMoment | None


@dataclass(frozen=True, eq=False)
class PlanCheck:
    """
    What is known of a plan between its points too.

    It is no safety function: it speaks of the polynomials that it was given, not of what a robot
    does.

    Attributes
    ----------
    singularity
        How near it comes to singular poses.
    joints
        Range and speed of each joint.
    speeds
        The largest speeds of the tool and of the other points asked for.
    closure
        Of an arm with closed loops; None for others. Singular poses and speeds of such a plan are
        looked at where it was sampled, and proved nowhere.
    """

    singularity: PlanSingularity
    joints: tuple[PlanJoint, ...]
    speeds: tuple[PlanSpeed, ...]
    closure: PlanClosure | None = None

    @property
    def verdict(self) -> PlanVerdict:
        """Return the worst verdict of all."""
        verdicts = [self.singularity.verdict]
        if self.closure is not None:
            verdicts.append(self.closure.verdict)
        for joint in self.joints:
            verdicts += [joint.limits, joint.speed]
        verdicts += [speed.verdict for speed in self.speeds if speed.verdict is not None]
        return max(verdicts, key=_ORDER.index)
