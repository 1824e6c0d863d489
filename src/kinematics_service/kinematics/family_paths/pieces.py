"""
The arcs of a target in pieces, each inside a box of joint positions, and which are a step apart.

The box is that of a piece's two ends, wider by how far the curve leaves their chord at most.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...kernel import Floats, Integers
from ...robot.robot import Robot
from ..inverse.problem.plan import InversePlan
from ..inverse.self_motion.arcs import IkArc
from ..singularity import singularity

# Halvings of a piece that is too long for a box.
SHORTER = 4
# Pairs of pieces that are looked at together.
AT_ONCE = 1 << 20


class StepRule(NamedTuple):
    """
    What a step from a target to the next is allowed to be.

    Attributes
    ----------
    scales : shape (n,)
        What a rad counts: the length for prismatic joints.
    periods : shape (n,)
        Of the joints whose limits are wider than a turn, or that have none; infinite for others.
    most : rad
        The largest motion of a joint.
    """

    scales: Floats
    periods: Floats
    most: float

    def shortest(self, way: Floats, joint: int | slice = slice(None)) -> Floats:
        """Return ways (..., n), or of a joint (...), less the full turns that joints can make."""
        period = self.periods[joint]
        turn = np.where(np.isfinite(period), period, 0.0)
        return np.asarray(way - np.round(way / period) * turn)


def step_rule(plan: InversePlan, most: float) -> StepRule:
    """Return the rule of an arm."""
    stroke = plan.limits[:, 1] - plan.limits[:, 0]
    return StepRule(plan.scales, np.where(stroke < plan.periods, np.inf, plan.periods), most)


class ArcPieces(NamedTuple):
    """
    Pieces of the arcs of a target.

    Attributes
    ----------
    arc : shape (m,)
        The number of the arc of each.
    s : shape (m, 2), rad
        From where to where on it.
    begin, end : shape (m, n), rad or m
        The postures there.
    spread : shape (m, n), rad or m
        How far the joints leave the chord of both at most, by proof.
    away : shape (m,), rad
        How far from `begin` a singular pose was found.
    """

    arc: Integers
    s: Floats
    begin: Floats
    end: Floats
    spread: Floats
    away: Floats

    def chosen(self, which: npt.NDArray[np.bool_]) -> 'ArcPieces':
        """Return some of them."""
        ends = self.begin[which], self.end[which], self.spread[which]
        return ArcPieces(self.arc[which], self.s[which], *ends, self.away[which])

    def box(self) -> tuple[Floats, Floats]:
        """Return the middle (m, n) and half the widths (m, n) of the boxes that hold them."""
        return (
            0.5 * (self.begin + self.end),
            0.5 * np.abs(self.end - self.begin) + self.spread,
        )

    def are_within(self, distance: float, scales: Floats) -> npt.NDArray[np.bool_]:
        """Return which of them are as a whole that near (rad) to a singular pose, shape (m,)."""
        across = 2.0 * np.linalg.norm(self.box()[1] / scales, axis=1)
        return np.asarray(self.away + across < distance)

    def halves(self, robot: Robot, arcs: Sequence[IkArc]) -> 'ArcPieces':
        """Return both halves of each."""
        middle = self.s.mean(axis=1)
        places = zip(self.arc.tolist(), middle.tolist())
        q = np.array([arcs[k].at(s) for k, s in places]).reshape(self.begin.shape)
        s = np.column_stack([self.s[:, 0], middle])
        lower = self._replace(s=s, end=q, spread=_spread(arcs, self.arc, s, q.shape))
        s = np.column_stack([middle, self.s[:, 1]])
        upper = self._replace(
            s=s, begin=q, spread=_spread(arcs, self.arc, s, q.shape), away=_away(robot, q)
        )
        return ArcPieces(*(np.concatenate(both) for both in zip(lower, upper)))


def pieces_of(robot: Robot, arcs: Sequence[IkArc]) -> ArcPieces:
    """Return arcs in pieces from sample to sample, or shorter where one has no box."""
    none = np.empty((0, robot.dof))
    begin = np.vstack([none, *(arc.q[:-1] for arc in arcs)])
    ends = [np.empty((0, 2)), *(np.column_stack([arc.s[:-1], arc.s[1:]]) for arc in arcs)]
    counts = [len(arc.q) - 1 for arc in arcs]
    arc, s = np.repeat(np.arange(len(arcs)), counts), np.vstack(ends)
    end = np.vstack([none, *(arc.q[1:] for arc in arcs)])
    pieces = ArcPieces(arc, s, begin, end, _spread(arcs, arc, s, end.shape), _away(robot, begin))
    for _ in range(SHORTER):
        boxed = np.asarray(np.isfinite(pieces.spread).all(axis=1))
        if boxed.all():
            break
        both = pieces.chosen(boxed), pieces.chosen(~boxed).halves(robot, arcs)
        pieces = ArcPieces(*(np.concatenate(values) for values in zip(*both)))
    return pieces


def only(robot: Robot, arcs: Sequence[IkArc], q: Floats, rule: StepRule) -> ArcPieces:
    """Return a posture (n,), on any turns of the nearest of the arcs, as a piece of no length."""
    ways = [rule.shortest(arc.q - q) / rule.scales for arc in arcs]
    away = [np.min(np.linalg.norm(way, axis=1)) for way in ways]
    arc = int(np.argmin(away)) if away else 0
    still = np.zeros((1, len(q)))
    return ArcPieces(np.array([arc]), still[:, :2], q[None], q[None], still, _away(robot, q[None]))


def _spread(arcs: Sequence[IkArc], arc: Integers, s: Floats, shape: tuple[int, ...]) -> Floats:
    rows = [arcs[k].spread(*ends) for k, ends in zip(arc.tolist(), s.tolist())]
    return np.array(rows).reshape(shape)


def _away(robot: Robot, q: Floats) -> Floats:
    if not len(q):
        return np.empty(0)
    q = np.ascontiguousarray(q)
    way = np.atleast_2d(singularity(robot, q).nearest_singular) - q
    away = np.linalg.norm(way / robot.task.column_scales, axis=1)
    return np.asarray(np.where(np.isfinite(away), away, np.inf))


def a_step_apart(first: ArcPieces, second: ArcPieces, rule: StepRule) -> tuple[Integers, Integers]:
    """Return all pairs of pieces (i,), (j,) between whose boxes a step may lead."""
    a, wide_a = first.box()
    b, wide_b = second.box()
    reach = wide_a + rule.most * rule.scales
    found = []
    order, begin, end = _candidates(a, reach, b, wide_b, rule)
    count = end - begin
    for rows in np.array_split(np.arange(len(a)), 1 + int(count.sum()) // AT_ONCE):
        of = count[rows]
        i = np.repeat(rows, of)
        j = order[np.arange(len(i)) + np.repeat(begin[rows] - (np.cumsum(of) - of), of)]
        # Joint by joint, since few pairs are left after some.
        for k in range(a.shape[1]):
            way = rule.shortest(b[j, k] - a[i, k], k)
            near = np.abs(way) <= reach[i, k] + wide_b[j, k]
            i, j = i[near], j[near]
        found.append(np.column_stack([i, j]))
    pairs = np.vstack(found)
    return pairs[:, 0], pairs[:, 1]


def _candidates(
    a: Floats, reach: Floats, b: Floats, wide: Floats, rule: StepRule
) -> tuple[Integers, Integers, Integers]:
    # The pieces in order along one joint, and which of them are near each of the first ones.
    best: tuple[Integers, Integers, Integers] | None = None
    for j, period in enumerate(rule.periods.tolist()):
        along, here, rows = b[:, j], a[:, j], np.arange(len(b))
        room = reach[:, j] + np.max(wide[:, j], initial=0.0)
        if np.isfinite(period):
            if 2.0 * np.max(room, initial=0.0) >= period:
                continue
            along, here = along % period, here % period
            along = np.concatenate([along - period, along, along + period])
            rows = np.tile(rows, 3)
        order = np.argsort(along)
        begin = np.searchsorted(along[order], here - room, 'left')
        end = np.searchsorted(along[order], here + room, 'right')
        if best is None or np.sum(end - begin) < np.sum(best[2] - best[1]):
            best = rows[order], begin, end
    if best is None:
        return np.arange(len(b)), np.zeros(len(a), dtype=int), np.full(len(a), len(b))
    return best
