# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Define the results of the check of a plan: each claim is proved, refuted by a pose, or not decided.
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple

from ....kernel import Floats
from ....robot.chain import FrozenArrays

PlanVerdict = Literal['proved', 'refuted', 'not decided']
# The possible verdicts, the best first.
_ORDER: tuple[PlanVerdict, ...] = ('proved', 'not decided', 'refuted')


@dataclass(frozen=True, eq=False)
class PlanMoment(FrozenArrays):
    """
    A moment of a plan: its time, and the joint positions at this time.

    Attributes
    ----------
    time
        Time in s, on the clock of the plan's points.
    point
        Number of the last point before the moment, from 0.
    q : shape (n,), rad or m
        Joint positions; read-only.
    """

    time: float
    point: int
    q: Floats


@dataclass(frozen=True, eq=False)
class PlanSingularity:
    """
    The verdict on the least distance of a plan to singular poses, with bounds of this distance.

    Attributes
    ----------
    verdict
        `proved`: the distance is at least the threshold everywhere. `refuted`: at `moment` the
        distance to `nearest_singular` is less than the threshold. `not decided`: neither.
    threshold
        The least allowed distance, rad; motions of prismatic joints are divided by the
        characteristic length.
    lower
        Proved lower bound of the distance over the whole plan, rad; 0 without a proof.
    upper
        Upper bound of the distance, rad: the least distance from the plan to any of the singular
        poses that the search found. Infinite if the search found no singular pose.
    moment
        If the plan is refuted, the moment at which the distance is `upper`. Otherwise the moment
        at which the proved lower bound of the distance is least.
    nearest_singular : shape (n,), rad or m
        The singular pose found for `moment`; read-only; None if none was found.
    undecided
        Intervals of time (begin, end), s, in which nothing is decided.
    evaluations
        Number of clearances that were computed. A clearance is a radius around a pose within which
        it is proved that no pose is singular.
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
        """Make the array `nearest_singular` read-only."""
        if self.nearest_singular is not None:
            self.nearest_singular.setflags(write=False)


class JointExtreme(NamedTuple):
    """
    The largest position, the least position (rad, m) or the largest speed (rad/s, m/s) of a joint
    over a plan. `moment` is when the value occurs.
    """

    value: float
    moment: PlanMoment


@dataclass(frozen=True, eq=False)
class PlanJoint:
    """
    Range and largest speed of a joint over a plan, exact up to round-off.

    Attributes
    ----------
    name
        Name of the joint.
    least, greatest, fastest
        Least and greatest position, and the largest speed.
    limits, speed
        Verdicts, proved or refuted: whether the joint keeps its position limits, and its velocity
        limit.
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
    Bounds of the largest speed of a point of the arm over a plan, with the verdict on the limit.

    Attributes
    ----------
    of
        The point: `tool`, the number of a frame, or a joint.
    lower, upper
        Bounds of the largest speed, m/s.
    moment
        A moment with the speed `lower`.
    limit
        Largest allowed speed, m/s; None without a limit.
    verdict
        Whether the speed keeps the limit; None without a limit.
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
    The verdict on whether the closed loops of an arm close along a plan.

    Attributes
    ----------
    verdict
        `refuted`: at `moment` a loop does not close. `not decided`: all loops close at all
        samples; nothing is proved between the samples. A loop may close in several shapes, such as
        elbow up and elbow down. Only the shape that the robot file's key `assembled` gives is
        checked.
    loop, sentence
        The loop that does not close, and the reason; empty if all loops close.
    samples
        Number of sampled poses.
    moment
        The moment at which a loop first does not close, found by bisection between two samples;
        None if all loops close.
    """

    verdict: PlanVerdict
    loop: str
    sentence: str
    samples: int
    moment: PlanMoment | None


@dataclass(frozen=True, eq=False)
class PlanCheck:
    """
    The result of the check of a plan, at and between its points.

    The check is not a safety function: it holds for the polynomials of the plan, not for the
    robot.

    Attributes
    ----------
    singularity
        The least distance to singular poses.
    joints
        Range and speed of each joint.
    speeds
        The largest speeds of the tool and of the further points that were requested.
    closure
        Whether closed loops close; None for an arm without loops. For an arm with loops, singular
        poses and speeds are sampled, and nothing is proved about them.
    """

    singularity: PlanSingularity
    joints: tuple[PlanJoint, ...]
    speeds: tuple[PlanSpeed, ...]
    closure: PlanClosure | None = None

    @property
    def verdict(self) -> PlanVerdict:
        """Return the worst verdict on all claims about the plan."""
        parts = [part.verdict for part in (self.singularity, self.closure, *self.speeds) if part]
        joints = [verdict for joint in self.joints for verdict in (joint.limits, joint.speed)]
        return max(filter(None, (*parts, *joints)), key=_ORDER.index)
