"""The arcs of a curve of solutions that are inside the joint limits, full turns told apart."""

import functools
import itertools
import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ... import kernel
from ...kernel import Floats
from ...robot.robot import Robot
from .curve import CurveMarks, SolutionCurve, marks_of, places_of
from .plan import InversePlan
from .result import IkArc, IkArcEnd
from .sliced_arm import SlicedArm

SIDES = ('lower', 'upper')
# Places as near to each other are one, as a share of the way between samples.
ONE = 1e-7
Turns = tuple[int, ...]


class _Crossing(NamedTuple):
    # A place of a curve where a joint is at a limit.
    place: float
    end: IkArcEnd


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
        self.marks = marks_of(self.path, plan.limits, plan.periods)
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
        psi = places_of(self.path, places - laps * self.last)
        return self.arm.to_joints(psi, self.robot.dof) + laps[:, None] * self.lap

    def nearest(self, begin: float, end: float, q: Floats) -> float:
        """Return the place nearest to joint positions (n,) between two next to each other."""
        lap = math.floor(0.5 * (begin + end) / self.last) if self.curve.closed else 0
        goal = np.array([q - lap * self.lap, self.plan.scales**-2])
        before = lap * self.last
        return before + kernel.nearest_place(self.path, goal, begin - before, end - before)

    def spread(self, places: Floats) -> Floats:
        """Return how far the joints (n,) leave the chord of two places at most, by proof."""
        laps = np.floor(places / self.last) if self.curve.closed else np.zeros(2)
        widths = self.curve.spread(*places_of(self.path, places - laps * self.last))
        if not math.isfinite(widths[0]):
            return np.full(self.robot.dof, math.inf)
        return np.asarray(np.abs(self.arm.uncoupling[: self.robot.dof]) @ widths)

    def arcs(self) -> tuple[IkArc, ...]:
        """Return the arcs inside the limits; those that differ by full turns once."""
        if self.marks is None:
            return ()
        crossings = self._crossings(self.marks)
        if not self.curve.closed:
            stop = IkArcEnd('', 'singular')
            crossings = [_Crossing(0.0, stop), *crossings, _Crossing(float(self.last), stop)]
        elif not crossings:
            crossings = [_Crossing(0.0, IkArcEnd('', ''))]
        pieces = len(crossings) if self.curve.closed else len(crossings) - 1
        ends = np.array([one.place for one in crossings])
        following = np.append(ends, ends[0] + self.last)[: pieces + 1]
        q = self.at(np.concatenate([ends, 0.5 * (following[:-1] + following[1:])]))
        inside = self._turns_inside(q[len(ends) :])
        if not any(inside):
            return ()
        samples = self._samples(self.marks.places[self.marks.sides > 1])
        arcs: dict[tuple[int, int], IkArc] = {}
        for first, count, turns, closed in self._paths(inside):
            if (first, count) in arcs:
                arcs[first, count] = arcs[first, count].wound_once_more()
                continue
            laps, last = divmod(first + count, pieces) if self.curve.closed else (0, first + count)
            stop = ends[last] + laps * self.last
            sides = () if closed else (crossings[first].end, crossings[last].end)
            rows = q[first], q[last] + laps * self.lap
            arcs[first, count] = self._arc((ends[first], stop), rows, turns, sides, samples)
        return tuple(arcs.values())

    def _crossings(self, marks: CurveMarks) -> list[_Crossing]:
        names, at_limit = self.robot.joint_names, marks.sides < 2
        limits = zip(*(column[at_limit].tolist() for column in marks))
        return _once(
            sorted(_Crossing(x % self.last, IkArcEnd(names[j], SIDES[i])) for x, j, i in limits)
        )

    def _turns_inside(self, q: Floats) -> list[set[Turns]]:
        # Of each piece, by its middle, the numbers of periods that bring all joints inside their
        # limits.
        low, high = self.plan.limits.T
        wound = np.isfinite(low) & np.isfinite(high) & np.isfinite(self.plan.periods)
        periods = np.where(wound, self.plan.periods, 1.0)
        first = np.where(wound, np.ceil((np.where(wound, low, 0.0) - q) / periods), 0.0)
        last = np.where(wound, np.floor((np.where(wound, high, 0.0) - q) / periods), 0.0)
        last[~wound & ((q < low) | (q > high))] = -1.0
        choices: list[set[Turns]] = [set() for _ in q]
        for i in np.flatnonzero(np.all(first <= last, axis=1)).tolist():
            ways = zip(first[i].astype(int).tolist(), last[i].astype(int).tolist())
            choices[i] = set(itertools.product(*(range(a, b + 1) for a, b in ways)))
        return choices

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
        laps = np.where(np.isfinite(self.plan.periods), self.lap / self.plan.periods, 0.0)
        limited = np.isfinite(self.plan.limits).all(axis=1)
        ways = np.where(limited, np.round(laps), 0.0).astype(int).tolist()
        return 0, tuple(k + way for k, way in zip(turns, ways))

    def _with_sides(self, ends: tuple[IkArcEnd, ...], q: Floats) -> tuple[IkArcEnd, ...]:
        # Where a lower limit is an upper one a turn farther, the turns tell which it is.
        sided = []
        for end, at in zip(ends, (q[0], q[-1])):
            if end.joint:
                j = self.robot.joint_names.index(end.joint)
                side = SIDES[int(np.argmin(np.abs(self.plan.limits[j] - at[j])))]
                end = IkArcEnd(end.joint, side)
            sided.append(end)
        return tuple(sided)

    def _samples(self, folds: Floats) -> tuple[Floats, Floats]:
        # All places of a lap, sorted, where there are samples or ends of ranges; positions there.
        places = np.concatenate([np.arange(self.last), folds])
        order = np.argsort(places, kind='stable')
        q = np.concatenate([self.samples[:-1], self.at(folds)])
        # An end of a range at a sample is that sample.
        apart = np.diff(places[order], prepend=-1.0) > ONE
        return places[order][apart], q[order][apart]

    def _arc(
        self,
        ends: tuple[float, float],
        rows: tuple[Floats, Floats],
        turns: Turns,
        sides: tuple[IkArcEnd, ...],
        samples: tuple[Floats, Floats],
    ) -> IkArc:
        # Between two places, with the joint positions there.
        places, q = [np.array(ends[:1])], [rows[0][None]]
        for lap in range(int(ends[1] // self.last) + 1):
            within = np.array([ends[0] + ONE, ends[1] - ONE]) - lap * self.last
            begin, stop = np.searchsorted(samples[0], within).tolist()
            places.append(samples[0][begin:stop] + lap * self.last)
            q.append(samples[1][begin:stop] + lap * self.lap)
        places.append(np.array(ends[1:]))
        q.append(rows[1][None])
        periods = np.where(np.isfinite(self.plan.periods), self.plan.periods, 0.0)
        offset = np.array(turns) * periods
        positions, at = np.concatenate(q) + offset, np.concatenate(places)
        ways = (positions[1:] - positions[:-1]) / self.plan.scales
        s = np.zeros(len(at))
        np.cumsum(np.sqrt(np.einsum('ij,ij->i', ways, ways)), out=s[1:])
        along = ArcPlaces(self, s, at, offset)
        sided = self._with_sides(sides, positions)
        # The limits and scales of a plan are frozen.
        return IkArc(positions, s, not sides, sided, 1, self.plan.limits, self.plan.scales, along)


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


def _once(crossings: list[_Crossing]) -> list[_Crossing]:
    # Of crossings of a joint at one place the first one.
    kept: list[_Crossing] = []
    for one in crossings:
        same = (
            other.end.joint == one.end.joint for other in kept if one.place - other.place < ONE
        )
        if not any(same):
            kept.append(one)
    return kept
