# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Define the result of inverse kinematics: isolated solutions, families of solutions, and the nearest
pose.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, overload

import numpy as np

from ...kernel import Floats
from ...notebook import as_html
from ...robot.chain import FrozenArrays
from .self_motion.arcs import IkArc

Status = Literal['solved', 'family', 'outside_limits', 'unreachable']
Method = Literal['closed form', 'algebraic', 'search']
Complete = Literal['proved', 'found', 'partial']
# For each value of `Complete`, a text that says whether other solutions may exist.
OTHERS: dict[Complete, str] = {
    'proved': 'there are no others',
    'found': 'there may be others',
    'partial': 'others were not looked for',
}

# Joint positions are in a family of solutions if their distance from the family is below this,
# rad.
FAMILY_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Posture:
    """
    The posture of the arm in a solution, as a word each for shoulder, elbow and wrist. z1 to z6
    are the directions of the joint axes. A word is empty if it is not defined for the arm, or if
    the arm is between the two postures, as with a stretched elbow.

    Attributes
    ----------
    shoulder
        `right` if z2 x z1 points from axis 1 to the side of the wrist centre, `left` if it points
        to the other side.
    elbow
        `up` if axis 3 is above the line from axis 2 to the wrist, `down` if it is below; z1 points
        up.
    wrist
        `flip` if (z4 x z5) . z6 is negative, else `no_flip`.
    """

    shoulder: str = ''
    elbow: str = ''
    wrist: str = ''

    def __str__(self) -> str:
        """
        Return the words of the posture that are not empty: `shoulder left, elbow up, wrist flip`.
        """
        parts = (('shoulder', self.shoulder), ('elbow', self.elbow), ('wrist', self.wrist))
        return ', '.join(f'{name} {word.replace("_", " ")}' for name, word in parts if word)


@dataclass(frozen=True, eq=False)
class IkSolution(FrozenArrays):
    """
    Joint positions that bring the tool to the target.

    Attributes
    ----------
    q : shape (n,), rad or m
        The joint positions, read-only.
    residual
        The error of the tool's pose by forward kinematics, m: sqrt(p^2 + (L r)^2) with the
        position error p (m), the rotation error r (rad) and the characteristic length L (m). Only
        components of the pose that the target prescribes are included. If `exact` is False, the
        error is within the tolerance.
    feasible
        Whether every joint is inside its limits.
    beyond
        Names of the joints outside their limits.
    margin
        Distance to the nearest joint limit, rad or m; negative beyond a limit; infinite without
        limits.
    posture
        The arm's posture.
    multiplicity
        Number of solutions that coincide at `q`: 1 unless J is singular; 0 if unknown.
    exact
        Whether the target is met to round-off, not only within the tolerance.
    """

    q: Floats
    residual: float
    feasible: bool
    beyond: tuple[str, ...]
    margin: float
    posture: Posture
    multiplicity: int = 1
    exact: bool = True


@dataclass(frozen=True, eq=False)
class IkFamily(FrozenArrays):
    """
    A continuum of joint positions, all of which bring the tool to the target.

    Attributes
    ----------
    q : shape (n,), rad or m
        The posture found nearest to `near`, or to the middle of the limits.
    motions : shape (k, n)
        Orthonormal joint motions (prismatic motions divided by the characteristic length) along
        the family at `q`; k is the dimension of the family at `q`.
    straight
        Whether q plus any multiple of `motions` is in the family, as for two joints on one axis
        (`theta1 + theta2` constant).
    joints
        Names of the joints that move along the family.
    residual, feasible, beyond, margin, posture
        Properties of `q`, as in `IkSolution`.
    intervals
        The arcs of the family inside the limits, for an arm with one redundant joint; otherwise
        empty.
    closed
        Whether the family is a closed curve if joint limits are ignored. False if the search could
        not trace the whole curve, for example past a singular pose.
    """

    q: Floats
    motions: Floats
    straight: bool
    joints: tuple[str, ...]
    residual: float
    feasible: bool
    beyond: tuple[str, ...]
    margin: float
    posture: Posture
    scales: Floats
    periods: Floats
    intervals: tuple[IkArc, ...] = ()
    closed: bool = False

    def contains(self, q: Floats) -> bool:
        """
        Return whether joint positions q (n,) belong to the family, up to full turns.

        If the family is curved (`straight` is False), only its stored solution `self.q` is
        recognised.
        """
        return self.distance(q) < FAMILY_TOLERANCE

    def distance(self, q: Floats) -> float:
        """
        Return the distance of joint positions q (n,) from the family, rad.

        If the family is curved (`straight` is False), return the distance from its stored solution
        `self.q`.
        """
        away = np.asarray(q) - self.q
        if self.straight:
            away = off_motions(away, self.motions * self.scales)
        return float(np.max(np.abs(without_turns(away, self.periods) / self.scales)))


def off_motions(away: Floats, motions: Floats) -> Floats:
    """
    Return the joint difference `away` (n,) minus a combination of `motions` (k, n).

    The combination is chosen by Gaussian elimination, so that k components of the result are 0. If
    `away` is a full turn, the result is a full turn, too. Example: if the motion is (1, -1), the
    full turn (2 pi, 0) becomes (2 pi, 0) - 2 pi (1, -1) = (0, 2 pi). An orthogonal projection
    would give (pi, pi), which is not a full turn.
    """
    rows = motions.copy()
    for i in range(len(rows)):
        j = int(np.argmax(np.abs(rows[i])))
        away = away - rows[i] * (away[j] / rows[i, j])
        for k in range(len(rows)):
            if k != i:
                rows[k] = rows[k] - rows[i] * (rows[k, j] / rows[i, j])
    return np.asarray(away)


def without_turns(away: Floats, periods: Floats) -> Floats:
    """
    Return joint differences (..., n) without full turns, that is, reduced by multiples of
    `periods` (n,). A joint without a full turn has the period inf.
    """
    turns = np.where(np.isfinite(periods), np.round(away / periods), 0.0)
    return np.asarray(away - turns * np.where(np.isfinite(periods), periods, 0.0))


@dataclass(frozen=True, eq=False)
class NearestPose(FrozenArrays):
    """
    The joint positions inside the limits with the least residual that was found.

    Attributes
    ----------
    q : shape (n,), rad or m
        The joint positions, read-only.
    residual
        As in `IkSolution`.
    position_error, rotation_error
        The position error (m) and the rotation error (rad). Only components of the pose that the
        target prescribes are included.
    """

    q: Floats
    residual: float
    position_error: float
    rotation_error: float


@dataclass(frozen=True, eq=False)
class IkResult(Sequence[IkSolution]):
    """
    The result of inverse kinematics: a sequence of the isolated solutions, in order of their
    distance to `near` (or to the middle of the limits).

    Attributes
    ----------
    solutions
        The isolated solutions, which are also the items of the sequence.
    families
        Continua of solutions; empty for most targets. A curved family may be listed at several of
        its poses. An arm has one redundant joint if it has one joint more than the target has
        equations. Then each family is a whole curve, listed once, with its `intervals` inside the
        limits.
    status
        `solved`: an isolated solution, or an interval of a family, is inside the limits. `family`:
        only poses of families are inside the limits. `outside_limits`: the target can be reached
        only outside the limits. `unreachable`: no solution was found.
    reason
        The status as a sentence.
    method
        `closed form`, `algebraic` or `search`. `algebraic` is the elimination for six joints,
        which counts the complex solutions. It also replaces a closed form whose solutions are in
        doubt. `search` refines many start positions. An arm of five joints gets a sixth joint;
        solutions in which the sixth joint is at 0 are kept.
    nearest
        The nearest pose if no solution is inside the limits; for a family, its `q`.
    complete
        Whether the solutions are complete (with `respect_limits`, those inside the limits).
        `proved`: no other solutions exist. This is proved if each step of the computation was
        farther from a singular case than its error bound. `found`: a search may have missed some
        solutions, above all for six joints within 1e-6 rad of a singular pose. `partial`: other
        solutions were not searched for, as with `all_solutions=False`, `curves=False`, and for
        arms with two redundant joints or more. Curves are found by search, so they are never
        `proved`. With two redundant joints the solutions form a surface, on which the search finds
        only one posture.
    roots
        The number of certified complex solutions, and the largest number that is possible, both
        with multiplicity; None if they were not counted. If the two numbers are equal, the result
        is proved complete. A complete result may also have a smaller first number, because roots
        at infinity give no solutions. Then the proof is that every root which may be real has led
        to a solution.
    """

    solutions: tuple[IkSolution, ...]
    families: tuple[IkFamily, ...]
    status: Status
    reason: str
    method: Method
    nearest: NearestPose | None
    complete: Complete
    roots: tuple[int, int] | None = None

    def __repr__(self) -> str:
        parts = [f'{len(self)} solutions', self.method, OTHERS[self.complete]]
        if self.families:
            parts.insert(1, f'{len(self.families)} families')
        return f'IkResult({self.status}, {", ".join(parts)})'

    _repr_html_ = as_html

    def __len__(self) -> int:
        return len(self.solutions)

    @overload
    def __getitem__(self, index: int) -> IkSolution: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[IkSolution, ...]: ...

    def __getitem__(self, index: int | slice) -> IkSolution | tuple[IkSolution, ...]:
        return self.solutions[index]
