"""The arcs of a curve of solutions that are inside the joint limits, full turns told apart."""

import functools
import math
import operator
from dataclasses import dataclass, replace

import numpy as np

from ... import kernel
from ...kernel import Floats
from ...robot.robot import Robot
from .curve import CurvePieces, SolutionCurve, pieces_of, places_of
from .plan import InversePlan
from .result import IkArc, IkArcEnd
from .sliced_arm import SlicedArm

SIDES = ('lower', 'upper')
Turns = tuple[int, ...]


class JointCurve:
    """
    A curve of solutions in positions of the joints.

    A closed one goes on beyond its last sample: its places are counted on, lap after lap.

    Parameters
    ----------
    robot, plan, arm
        The arm, its plan for the rows that count, and how its slices are solved.
    curve
        In positions of the screws.
    """

    def __init__(
        self, robot: Robot, plan: InversePlan, arm: SlicedArm, curve: SolutionCurve
    ) -> None:
        self.robot, self.plan, self.arm, self.curve = robot, plan, arm, curve
        self.last = len(curve.psi) - 1
        # Row j: joint j by the screws.
        self.path = curve.path(arm.uncoupling[: robot.dof])
        self.lap = np.zeros(robot.dof)
        if curve.closed:
            self.lap = arm.to_joints(curve.psi[-1] - curve.psi[0], robot.dof)

    @functools.cached_property
    def samples(self) -> Floats:
        """Return the joint positions (m, n) of the curve's samples."""
        return self.arm.to_joints(self.curve.psi, self.robot.dof)

    def at(self, places: Floats) -> Floats:
        """Return joint positions (m, n) at places (m,) of the curve."""
        laps = np.floor(places / self.last) if self.curve.closed else np.zeros(len(places))
        q = places_of(self.path, places - laps * self.last)
        return q + laps[:, None] * self.lap

    def nearest(self, begin: float, end: float, q: Floats) -> float:
        """Return the place nearest to joint positions (n,) between two next to each other."""
        lap = math.floor(0.5 * (begin + end) / self.last) if self.curve.closed else 0
        goal = np.array([q - lap * self.lap, self.plan.scales**-2])
        before = lap * self.last
        return before + kernel.nearest_place(self.path, goal, begin - before, end - before)

    def spread(self, places: Floats) -> Floats:
        """Return how far the joints (n,) leave the chord of two places at most, by proof."""
        laps = np.floor(places / self.last) if self.curve.closed else np.zeros(2)
        widths = self.curve.spread(*map(self.curve.at, places - laps * self.last))
        if not math.isfinite(widths[0]):
            return np.full(self.robot.dof, math.inf)
        return np.asarray(np.abs(self.arm.uncoupling[: self.robot.dof]) @ widths)

    def arcs(self) -> tuple[IkArc, ...]:
        """Return the arcs inside the limits; those that differ by full turns once."""
        pieces = pieces_of(self.path, _bounds_of(self.plan), self.curve.closed)
        if pieces is None:
            return ()
        # Those that differ by full turns have the same pieces.
        found: dict[tuple[int, int], list[tuple[Turns, bool]]] = {}
        for first, count, turns, closed in self._paths(_turns_inside(pieces.turns)):
            found.setdefault((first, count), []).append((turns, closed))
        return tuple(
            self._arc(pieces, *key, *windings[0], len(windings)) for key, windings in found.items()
        )

    def _paths(self, inside: list[set[Turns]]) -> list[tuple[int, int, Turns, bool]]:
        # Of each arc its first piece, how many it has, its turns, and whether it closes.
        nodes = [(i, turns) for i, lifts in enumerate(inside) for turns in sorted(lifts)]
        known = set(nodes)
        after = {node: self._next(*node, len(inside)) for node in nodes}
        entered = {node for node in after.values() if node in known}
        paths, seen = [], set()
        # Those that nothing leads to begin an arc; the others are on closed ones.
        for node in [*(node for node in nodes if node not in entered), *nodes]:
            count, at = 0, node
            while at in known and at not in seen:
                seen.add(at)
                count, at = count + 1, after[at]
            if count:
                paths.append((*node[:1], count, node[1], at == node))
        return paths

    def _next(self, i: int, turns: Turns, pieces: int) -> tuple[int, Turns]:
        if i + 1 < pieces or not self.curve.closed:
            return i + 1, turns
        return 0, tuple(map(operator.add, turns, self._turns_of_lap))

    @functools.cached_property
    def _turns_of_lap(self) -> Turns:
        laps = np.where(np.isfinite(self.plan.periods), self.lap / self.plan.periods, 0.0)
        limited = np.isfinite(self.plan.limits).all(axis=1)
        return tuple(np.where(limited, np.round(laps), 0.0).astype(int).tolist())

    def _arc(
        self, pieces: CurvePieces, first: int, count: int, turns: Turns, closed: bool, wound: int
    ) -> IkArc:
        # Of so many pieces, lap after lap.
        plan, last, laps = self.plan, first + count, 0
        if self.curve.closed:
            laps, last = divmod(last, len(pieces.begins))
        table, begin, stop = pieces.table, pieces.begins[first], pieces.begins[last] + 1
        rows = table[begin:stop]
        if laps:
            parts = [table[begin:-1], *[table[:-1]] * (laps - 1), table[:stop]]
            lap = table[-1] - table[0]
            rows = np.concatenate([part + k * lap for k, part in enumerate(parts)])
        offset = _turn_of(plan) * turns
        q, s, places = rows[:, 2:] + offset, rows[:, 1] - rows[0, 1], rows[:, 0].copy()
        ends = () if closed else (self._end(pieces, first, q[0]), self._end(pieces, last, q[-1]))
        along = ArcPlaces(self, s, places, offset)
        # The limits and scales of a plan are frozen.
        return IkArc(q, s, not ends, ends, wound, plan.limits, plan.scales, along)

    def _end(self, pieces: CurvePieces, k: int, q: Floats) -> IkArcEnd:
        joint, side = pieces.ends[k]
        if side >= len(SIDES):
            return IkArcEnd('', 'singular')
        # Where a lower limit is an upper one a turn farther, the turns tell which it is.
        low, high = np.abs(self.plan.limits[joint] - q[joint]).tolist()
        return IkArcEnd(self.robot.joint_names[joint], SIDES[high < low])


@functools.lru_cache(maxsize=128)
def _bounds_of(plan: InversePlan) -> Floats:
    # Of each joint its limits, period, and what a rad counts.
    return np.column_stack([plan.limits, plan.periods, plan.scales])


@functools.lru_cache(maxsize=128)
def _turn_of(plan: InversePlan) -> Floats:
    return np.where(np.isfinite(plan.periods), plan.periods, 0.0)


def _turns_inside(turns: list[list[list[int]]]) -> list[set[Turns]]:
    # Of each piece the numbers of periods that bring all joints inside their limits.
    inside: list[set[Turns]] = []
    for piece in turns:
        ways: list[Turns] = [()]
        for first, last in piece:
            ways = [(*way, k) for way in ways for k in range(first, last + 1)]
        inside.append(set(ways))
    return inside


@dataclass(frozen=True, eq=False)
class ArcPlaces:
    """
    Where an arc is on its curve.

    Attributes
    ----------
    curve
        The curve.
    s, places : shape (m,)
        Lengths of the arc (rad), and the places there.
    offset : shape (n,), rad or m
        What full turns add to the curve's joint positions.
    """

    curve: JointCurve
    s: Floats
    places: Floats
    offset: Floats

    def at(self, s: float) -> Floats:
        """Return the joint positions (n,) at a length."""
        place = np.interp(s, self.s, self.places)
        return np.asarray(self.curve.at(np.array([place]))[0] + self.offset)

    def nearest(self, k: int, q: Floats) -> Floats:
        """Return the joint positions (n,) nearest to others on the piece after sample k."""
        begin, end = self.places[k : k + 2].tolist()
        place = self.curve.nearest(begin, end, q - self.offset)
        return np.asarray(self.curve.at(np.array([place]))[0] + self.offset)

    def spread(self, first: float, last: float) -> Floats:
        """Return how far the joints (n,) leave their chord between two lengths at most."""
        return self.curve.spread(np.interp([first, last], self.s, self.places))

    def turned(self, offset: Floats) -> 'ArcPlaces':
        """Return the same with full turns (n,) added."""
        return replace(self, offset=self.offset + offset)
