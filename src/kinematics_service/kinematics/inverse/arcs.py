"""The arcs of a curve of solutions that are inside the joint limits, full turns told apart."""

import itertools
import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...kernel import Floats
from ...robot.robot import Robot
from .curve import SolutionCurve
from .plan import InversePlan
from .result import IkArc, IkArcEnd
from .sliced_arm import SlicedArm

SIDES = ('lower', 'upper')
# Crossings as near to each other are one, as a share of the way between samples.
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
        self.samples = arm.to_joints(curve.psi, robot.dof)
        self.last = len(self.samples) - 1
        # Row j: joint j by the screws.
        self.rows = arm.to_joints(np.eye(len(arm.table)), robot.dof).T
        self.folds = [curve.folds(row) for row in self.rows]
        self.lap = self.samples[-1] - self.samples[0] if curve.closed else np.zeros(robot.dof)

    def at(self, place: float) -> Floats:
        """Return joint positions (n,) at a place of the curve."""
        lap, psi = self._screws_at(place)
        return self.arm.to_joints(psi, self.robot.dof) + lap * self.lap

    def _screws_at(self, place: float) -> tuple[int, Floats]:
        # The lap, and the positions of the screws in the first one.
        lap = math.floor(place / self.last) if self.curve.closed else 0
        return lap, self.curve.at(place - lap * self.last)

    def spread(self, begin: float, end: float) -> Floats:
        """Return how far the joints (n,) leave their chord between two places at most."""
        (_, first), (_, last) = self._screws_at(begin), self._screws_at(end)
        widths = self.curve.spread(first, last)
        if not math.isfinite(widths[0]):
            return np.full(self.robot.dof, math.inf)
        return np.asarray(np.abs(self.rows) @ widths)

    def arcs(self) -> tuple[IkArc, ...]:
        """Return the arcs inside the limits; those that differ by full turns once."""
        crossings = _once(sorted(self._crossings()))
        if not self.curve.closed:
            stop = IkArcEnd('', 'singular')
            crossings = [_Crossing(0.0, stop), *crossings, _Crossing(float(self.last), stop)]
        elif not crossings:
            crossings = [_Crossing(0.0, IkArcEnd('', ''))]
        pieces = len(crossings) if self.curve.closed else len(crossings) - 1
        crossings += [one._replace(place=one.place + self.last) for one in crossings]
        inside = [self._turns_inside(crossings[i], crossings[i + 1]) for i in range(pieces)]
        arcs: dict[tuple[int, int], IkArc] = {}
        for first, count, turns, closed in self._paths(inside):
            if (first, count) in arcs:
                arcs[first, count] = arcs[first, count].wound_once_more()
                continue
            laps, last = divmod(first + count, pieces) if self.curve.closed else (0, first + count)
            end = crossings[last].place + laps * self.last
            arc = self._arc(crossings[first].place, end, turns)
            if not closed:
                ends = crossings[first].end, crossings[last].end
                arc = replace(arc, closed=False, ends=self._with_sides(ends, arc.q))
            arcs[first, count] = arc
        return tuple(arcs.values())

    def _crossings(self) -> list[_Crossing]:
        found = []
        for j, (row, folds) in enumerate(zip(self.rows, self.folds)):
            values = np.concatenate([self.samples[:, j], [self.at(x)[j] for x in folds]])
            low, high, period = float(values.min()), float(values.max()), self.plan.periods[j]
            for limit, side in zip(self.plan.limits[j].tolist(), SIDES):
                end = IkArcEnd(self.robot.joint_names[j], side)
                for value in _lifts(limit, low, high, period):
                    places = self.curve.crossings(row, value, folds)
                    found += [_Crossing(place % self.last, end) for place in places]
        return found

    def _turns_inside(self, begin: _Crossing, end: _Crossing) -> set[Turns]:
        # The numbers of periods that bring all joints inside their limits on a piece.
        q = self.at(0.5 * (begin.place + end.place))
        choices = []
        for value, (low, high), period in zip(q, self.plan.limits, self.plan.periods):
            if math.isfinite(low) and math.isfinite(high) and math.isfinite(period):
                first, last = (
                    math.ceil((low - value) / period),
                    math.floor((high - value) / period),
                )
                choices.append(range(first, last + 1))
            else:
                choices.append(range(0, 1 if low <= value <= high else 0))
        return set(itertools.product(*choices))

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

    def _arc(self, begin: float, end: float, turns: Turns) -> IkArc:
        laps = range(int(end // self.last) + 1)
        folds = (x + lap * self.last for row in self.folds for x in row for lap in laps)
        special = {begin, end, *(x for x in folds if begin < x < end)}
        whole = set(range(math.ceil(begin), math.floor(end) + 1)) - special
        places = np.array(sorted([*special, *map(float, whole)]))
        offset = np.array(turns) * np.where(np.isfinite(self.plan.periods), self.plan.periods, 0.0)
        rows = []
        for place in places.tolist():
            if place in special:
                rows.append(self.at(place))
            else:
                lap, k = divmod(int(place), self.last) if self.curve.closed else (0, int(place))
                rows.append(self.samples[k] + lap * self.lap)
        q = np.array(rows) + offset
        ways = np.linalg.norm(np.diff(q / self.plan.scales, axis=0), axis=1)
        s = np.concatenate([[0.0], np.cumsum(ways)])

        def along(at: float) -> Floats:
            return np.asarray(self.at(float(np.interp(at, s, places))) + offset)

        def spread(first: float, last: float) -> Floats:
            ends = np.interp([first, last], s, places).tolist()
            return self.spread(*ends)

        limits, scales = self.plan.limits.copy(), self.plan.scales.copy()
        return IkArc(q, s, True, (), 1, limits, scales, along, spread)


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


def _lifts(limit: float, low: float, high: float, period: float) -> list[float]:
    # Where a limit is between two positions, full periods added.
    if not math.isfinite(limit):
        return []
    if not math.isfinite(period):
        return [limit]
    first, last = math.ceil((low - limit) / period), math.floor((high - limit) / period)
    return [limit + turn * period for turn in range(first, last + 1)]
