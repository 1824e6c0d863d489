"""The result of inverse kinematics: solutions, families of them, or the nearest pose."""

from collections.abc import Iterator, Sequence
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
# What a line says of the solutions that are not there.
OTHERS: dict[Complete, str] = {
    'proved': 'there are no others',
    'found': 'there may be others',
    'partial': 'others were not looked for',
}

# Tolerance of angles that belong to a family (rad).
ON_FAMILY = 1e-6


@dataclass(frozen=True)
class Posture:
    """
    The arm's posture in a solution; a word is empty if the arm has no such feature.

    Attributes
    ----------
    shoulder
        `right` if the wrist centre is on the side of axis 1 that z2 x z1 points to, or `left`.
    elbow
        `up` if axis 3 is above the line from axis 2 to the wrist (z1 is up), else `down`.
    wrist
        `flip` if (z4 x z5) . z6 is negative, else `no_flip`.
    """

    shoulder: str = ''
    elbow: str = ''
    wrist: str = ''

    def __str__(self) -> str:
        """Return the words that are not empty, as `shoulder left, elbow up, wrist flip`."""
        parts = (('shoulder', self.shoulder), ('elbow', self.elbow), ('wrist', self.wrist))
        return ', '.join(f'{name} {word.replace("_", " ")}' for name, word in parts if word)


@dataclass(frozen=True, eq=False)
class IkSolution(FrozenArrays):
    """
    Joint positions that bring the tool to the target.

    Attributes
    ----------
    q : shape (n,), rad or m
        Read-only.
    residual
        The remaining error by forward kinematics: norm of the position error (m) and of the
        rotation vector times the arm's length, over the wanted rows. Where it is not
        `exact`, the target is met to within the tolerance only.
    feasible
        Whether every joint is inside its limits.
    beyond
        Names of the joints outside their limits.
    margin
        Distance to the nearest limit, rad or m; negative beyond one; infinite without any.
    posture
        Which of the arm's postures it is.
    multiplicity
        How many solutions have become this one: 1 but at singular positions; 0 where that is not
        known.
    exact
        Whether the target is met to round-off, rather than to within the tolerance.
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
        One of them: as near to `near`, or to the middle of the limits, as the search came.
    motions : shape (k, n)
        Orthonormal joint motions (prismatic ones divided by the arm's length) along the family at
        `q`; k is its dimension there.
    straight
        Whether q + any multiple of the motions is in the family, as for two joints on one axis
        (`theta1 + theta2` constant).
    joints
        Names of the joints that move along it.
    residual, feasible, beyond, margin, posture
        Of `q`, as in `IkSolution`.
    intervals
        Of an arm with one joint more than the target asks for: the parts of the family inside the
        limits, each an arc. Otherwise empty.
    closed
        Whether the family, limits left aside, is a closed curve; not where it passes a pose at
        which it could not be followed.
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
        Return whether joint positions (n,) lie on a straight family, modulo full turns.

        A curved family is known at its representative only: there this is whether q is that one.
        """
        return self.distance(q) < ON_FAMILY

    def distance(self, q: Floats) -> float:
        """Return how far joint positions (n,) are from the family, in rad; see `contains`."""
        away = np.asarray(q) - self.q
        if self.straight:
            away = off_motions(away, self.motions * self.scales)
        return float(np.max(np.abs(_wrapped(away, self.periods) / self.scales)))


def off_motions(away: Floats, motions: Floats) -> Floats:
    """
    Return a way (n,) without some multiples of motions (k, n), so that k joints are not on it.

    A full turn of one of those changes nothing; the others are compared after it.
    """
    left = motions.copy()
    for i in range(len(left)):
        j = int(np.argmax(np.abs(left[i])))
        away = away - left[i] * (away[j] / left[i, j])
        for k in range(len(left)):
            if k != i:
                left[k] = left[k] - left[i] * (left[k, j] / left[i, j])
    return np.asarray(away)


def _wrapped(away: Floats, periods: Floats) -> Floats:
    turns = np.where(np.isfinite(periods), np.round(away / periods), 0.0)
    return np.asarray(away - turns * np.where(np.isfinite(periods), periods, 0.0))


@dataclass(frozen=True, eq=False)
class NearestPose(FrozenArrays):
    """
    Joint positions inside the limits that come as near to the target as any that were found.

    Attributes
    ----------
    q : shape (n,), rad or m
        Read-only.
    residual
        As in `IkSolution`.
    position_error, rotation_error
        Its parts, over the wanted rows: m, rad.
    """

    q: Floats
    residual: float
    position_error: float
    rotation_error: float


@dataclass(frozen=True, eq=False)
class IkResult(Sequence[IkSolution]):
    """
    The isolated solutions, in order of their distance to `near` (or to the middle of the limits).

    Attributes
    ----------
    solutions
        The sequence itself.
    families
        Continua of solutions; empty for most targets. A curved one may be listed at several of
        its poses. Of an arm with one joint more than the target asks for each is a whole curve,
        once, with its `intervals` inside the limits.
    status
        `solved`: there is an isolated solution inside the limits, or a family whose intervals
        inside them are known. `family`: only families are, known at a pose of them.
        `outside_limits`: the target can be reached, but not inside the limits. `unreachable`.
    reason
        The same in a sentence.
    method
        `closed form` and `algebraic`: all there are (the latter counts the complex solutions of
        six joints, too, until none is missing; an arm with a closed form has them so where that is
        in doubt). `search`: all that many starts found. Five joints are six that hold an added
        turn at 0.
    nearest
        The nearest pose, where no solution is inside the limits; of a family its representative.
    complete
        Whether there are others of what was asked for (with or without those outside the limits).
        `proved`: there are none, each step that led to the solutions having been farther from
        singular than it may be off by. `found`: a search ended; it may have missed some, above all
        of six joints within 1e-6 rad of a singular pose, where postures run together. `partial`:
        others were not looked for, as with `all_solutions=False`, with `curves=False`, and for
        arms with two joints more than the target asks for. Curves are searched for, with one joint
        more: never `proved`. If postures form a surface at a singular one, `reason` says so, and
        the search does not follow the surface.
    roots
        How many complex solutions were found and certified, and how many there can be, each
        counted as often as it is a solution; None where they were not counted. Fewer than there
        can be are a proof, too, where each root that is real, or may be, has led to its solution:
        the others may be infinitely far away.
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

    def __iter__(self) -> Iterator[IkSolution]:
        return iter(self.solutions)

    @overload
    def __getitem__(self, index: int) -> IkSolution: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[IkSolution, ...]: ...

    def __getitem__(self, index: int | slice) -> IkSolution | tuple[IkSolution, ...]:
        return self.solutions[index]
