"""The result of inverse kinematics: solutions, families of them, or the nearest pose."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol, overload

import numpy as np

from ...kernel import Floats
from ...notebook import as_html
from ...robot.chain import FrozenArrays
from ...robot.robot import Robot
from ..clearance import clearances

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
# Golden sections to the best pose of an arc: a tenth of a rad becomes 1e-9.
GOLDEN, SECTIONS = 0.6180339887498949, 38


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


class IkArcEnd(NamedTuple):
    """
    Where an arc ends.

    Attributes
    ----------
    joint
        The joint that is at a limit there, by name; empty where none is.
    limit
        `lower` or `upper`; `singular` where the arc cannot be followed farther.
    """

    joint: str
    limit: str


class CurveOfArc(Protocol):
    """The curve that an arc is part of."""

    def at(self, s: float) -> Floats:
        """Return the joint positions (n,) at a length of the arc."""

    def nearest(self, k: int, q: Floats) -> Floats:
        """Return the joint positions (n,) nearest to others on the piece after sample k."""

    def spread(self, first: float, last: float) -> Floats:
        """Return how far the joints (n,) leave their chord between two lengths at most."""

    def turned(self, offset: Floats) -> 'CurveOfArc':
        """Return the curve with full turns (n,) added."""


@dataclass(frozen=True, eq=False)
class IkArc(FrozenArrays):
    """
    A continuous motion inside the joint limits during which the tool stays at the target.

    Attributes
    ----------
    q : shape (m, n), rad or m
        Joint positions along it, not farther apart than a tenth of a rad; among them all where a
        joint is at an end of its range.
    s : shape (m,), rad
        How long the arc is up to each: prismatic joints divided by the arm's length.
    closed
        Whether the last one is the first one again, but for full turns.
    ends
        Of one that is not closed: where it begins and ends.
    windings
        How many arcs are this one but for full turns of some joints, each inside the limits.
    limits : shape (n, 2), rad or m
        The joint limits.
    """

    q: Floats
    s: Floats
    closed: bool
    ends: tuple[IkArcEnd, ...]
    windings: int
    limits: Floats
    scales: Floats
    along: CurveOfArc

    @property
    def length(self) -> float:
        """Return its length in rad: prismatic joints divided by the arm's length."""
        return float(self.s[-1])

    @property
    def ranges(self) -> Floats:
        """Return the least and the largest position of each joint, shape (n, 2), rad or m."""
        return np.column_stack([self.q.min(axis=0), self.q.max(axis=0)])

    def at(self, s: float) -> Floats:
        """
        Return the joint positions (n,) at a length from 0 to `length` (rad), to round-off.

        A closed arc goes on before and behind, lap by lap.
        """
        laps = math.floor(s / self.length) if self.closed else 0
        return np.asarray(self.along.at(s - laps * self.length) + laps * (self.q[-1] - self.q[0]))

    def margins(self) -> Floats:
        """Return the distance of each of `q` to the nearest limit, shape (m,), rad or m."""
        return self.margin(self.q)

    def margin(self, q: Floats) -> Floats:
        """Return the distance of joint positions (..., n) to the nearest limit, rad or m."""
        low, high = self.limits.T
        return np.asarray(np.min(np.minimum(q - low, high - q), axis=-1))

    def with_largest_margin(self) -> Floats:
        """Return the joint positions (n,) farthest from their limits."""
        return self._best(lambda q: -self.margin(q))

    def nearest_to(self, q: Floats) -> Floats:
        """Return the joint positions (n,) nearest to others: root of the sum of squares."""
        away = squares_of((self.q - q) / self.scales)
        k, last, lap = int(away.argmin()), len(self.q) - 1, self.q[-1] - self.q[0]
        pieces = [(i, 0.0) for i in (k - 1, k) if 0 <= i < last]
        if self.closed and k in (0, last):
            pieces = [(last - 1, k / last - 1.0), (0, k / last)]
        ways = [self.along.nearest(i, q - turn * lap) + turn * lap for i, turn in pieces]
        rows = np.array(ways)
        return np.array(rows[int(squares_of((rows - q) / self.scales).argmin())])

    def with_largest_clearance(self, robot: Robot) -> Floats:
        """Return the joint positions (n,) of `q` with the largest proved radius free of singular
        poses.
        """
        return np.array(self.q[int(np.argmax(clearances(robot, np.array(self.q))))])

    def place_of_least(self, cost: Callable[[Floats], Floats]) -> float:
        """Return the length (rad) at which a cost of joint positions (..., n) is least."""
        k, place = self._least(cost)
        return min((float(self.s[k]), place), key=lambda s: cost(self.at(s)))

    def _best(self, cost: Callable[[Floats], Floats]) -> Floats:
        k, place = self._least(cost)
        return min((np.array(self.q[k]), self.at(place)), key=cost)

    def _least(self, cost: Callable[[Floats], Floats]) -> tuple[int, float]:
        # The sample that has the least cost, and the place next to it by golden sections.
        k, last = int(np.argmin(cost(self.q))), len(self.s) - 1
        a, b = float(self.s[max(k - 1, 0)]), float(self.s[min(k + 1, last)])
        if self.closed and k == 0:
            a = float(self.s[-2]) - self.length
        if self.closed and k == last:
            b = self.length + float(self.s[1])
        for _ in range(SECTIONS):
            x, y = b - GOLDEN * (b - a), a + GOLDEN * (b - a)
            a, b = (a, y) if cost(self.at(x)) < cost(self.at(y)) else (x, b)
        return k, 0.5 * (a + b)


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


def squares_of(ways: Floats) -> Floats:
    """Return the square of each of ways (m, n): a third of the time of their norms."""
    return np.asarray(np.einsum('ij,ij->i', ways, ways))


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
        in doubt). `search`: all that many starts found.
    nearest
        The nearest pose, where no solution is inside the limits; of a family its representative.
    complete
        Whether there are others of what was asked for (with or without those outside the limits).
        `proved`: there are none, each step that led to the solutions having been farther from
        singular than it may be off by. `found`: none was found. `partial`:
        others were not looked for, as with `all_solutions=False`, with `curves=False`, and for
        arms with two joints more than the target asks for. Of curves, `proved`: there is no other
        along which the joint at the arm's end moves that was held for the proof.
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
