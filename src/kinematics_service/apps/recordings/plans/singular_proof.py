"""
Whether a plan comes within a threshold of a singular pose: proved, refuted, or not decided.

The distance to a closed set changes no faster than the joints move. So a clearance at the middle
of a piece proves the piece where it exceeds how far the joints move from there, and the
threshold; and a singular pose within the threshold of a pose of the plan refutes it. What is
neither is split.
"""

import math
from typing import NamedTuple

import numpy as np

from ....kernel import Floats, Integers
from ....kinematics.clearance import clearances
from ....kinematics.singularity import singularity
from ....robot.clearance_bounds import moving_joints
from ....robot.robot import Robot
from .polynomials import Pieces, PolynomialMotion, Which, joined, moment_at
from .verdicts import PlanSingularity, PlanVerdict

# A clearance that exceeds the threshold by less than this share proves no more than its own pose.
LEAST_ROOM = 0.002
# A piece whose middle is not decided is split until it is shorter than this share of the
# threshold.
SHORTEST = 0.05
# Round-off of joint positions, rad, and as a share of the largest numbers they are made of.
ROUND_OFF, ROUND_OFF_SHARE = 1e-9, 1e-14
# Clearances computed at most: of a plan, and more for each of its segments.
BUDGET, BUDGET_OF_SEGMENT = 5_000, 20
# Clearances computed at most to raise the lower bound of a plan that is proved, and its rounds.
RAISING, RAISING_ROUNDS = 2_000, 8
# The lower bound is good enough at this share of the least clearance met.
GOOD_ENOUGH = 0.95
# Halvings of the share of a piece that a clearance covers.
HALVINGS = 14
# The nearest moment is looked for among so many around the nearest so far, in rounds.
AROUND, ROUNDS = 17, 4
# Poses whose measures are computed at once.
MOST_ROWS = 16_384


class _Proved(NamedTuple):
    """Pieces that are proved: clearances at their middles, and how far the joints move."""

    pieces: Pieces
    clearance: Floats
    span: Floats

    def chosen(self, which: Which) -> '_Proved':
        return _Proved(self.pieces.chosen(which), self.clearance[which], self.span[which])


class _FoundPose(NamedTuple):
    """The singular pose nearest to the plan so far: its distance, the place, the pose."""

    distance: float
    segment: int
    s: float
    pose: Floats | None


def singularity_of_plan(
    robot: Robot, motion: PolynomialMotion, threshold: float
) -> PlanSingularity:
    """Return whether a motion comes within a threshold (rad) of a singular pose."""
    return _Proof(robot, motion, threshold).run()


class _Proof:
    """The state of a proof: what is proved, what is open, and the nearest singular pose found."""

    def __init__(self, robot: Robot, motion: PolynomialMotion, threshold: float) -> None:
        self._robot, self._motion, self._threshold = robot, motion, threshold
        # The other joints change the rank of no pose, so their motion does not count.
        self._moving = moving_joints(robot.chain, robot.singularity.task)
        size = np.max(np.sum(np.abs(motion.coefficients), axis=1))
        self._round_off = ROUND_OFF + ROUND_OFF_SHARE * float(size)
        self._nearest = _FoundPose(math.inf, 0, 0.0, None)
        self._proved: list[_Proved] = []
        self._open: list[tuple[Pieces, Floats]] = []
        self._evaluations = 0

    def run(self) -> PlanSingularity:
        count = len(self._motion.begins)
        points = np.append(np.arange(count), count - 1)
        self._look_at(points, np.append(np.zeros(count), 1.0))
        if not self._refuted:
            self._decide(BUDGET + BUDGET_OF_SEGMENT * count)
        if self._refuted:
            self._look_around()
        elif not self._open:
            self._raise_lower_bound()
        return self._result()

    @property
    def _refuted(self) -> bool:
        return self._nearest.distance < self._threshold

    def _look_at(self, segment: Integers, s: Floats) -> None:
        # Looks for singular poses near some places of the plan.
        for begin in range(0, len(segment), MOST_ROWS):
            part = slice(begin, begin + MOST_ROWS)
            q = self._motion.positions(segment[part], s[part])
            poses = singularity(self._robot, q).nearest_singular
            away = np.linalg.norm((poses - q) / self._robot.singularity.task.column_scales, axis=1)
            away = np.where(np.isfinite(away), away, np.inf)
            k = int(np.argmin(away))
            if away[k] < self._nearest.distance:
                self._nearest = _FoundPose(
                    float(away[k]), int(segment[part][k]), float(s[part][k]), np.array(poses[k])
                )

    def _look_around(self) -> None:
        # Moves the nearest place along the plan to where it is nearer still.
        count, width = len(self._motion.begins), 1.0
        for _ in range(ROUNDS):
            x = self._nearest.segment + self._nearest.s
            places = np.clip(np.linspace(x - width, x + width, AROUND), 0.0, count)
            segment = np.minimum(places.astype(np.int64), count - 1)
            self._look_at(segment, places - segment)
            width *= 2.0 / (AROUND - 1)

    def _decide(self, budget: int) -> None:
        pieces = self._motion.whole()
        while len(pieces.segment) and not self._refuted:
            if self._evaluations + len(pieces.segment) > budget:
                self._open.append((pieces, np.zeros(len(pieces.segment))))
                return
            pieces = self._next(pieces)

    def _next(self, pieces: Pieces) -> Pieces:
        # Decides pieces as far as their middles do, and returns what is left to decide.
        clearance, taylor = self._clearances(pieces), self._taylor(pieces)
        span = _span(taylor, pieces.half)
        room = clearance - self._threshold
        whole = span < room
        self._keep(pieces.chosen(whole), clearance[whole], span[whole])
        some = ~whole & (room > LEAST_ROOM * self._threshold)
        none = ~whole & ~some
        self._look_at(pieces.segment[none], pieces.middle[none])
        short = none & (span < SHORTEST * self._threshold)
        if np.any(short):
            lowest = np.maximum(clearance[short] - span[short], 0.0)
            self._open.append((pieces.chosen(short), lowest))
        part = pieces.chosen(some)
        share = _covered(taylor[some], part.half, room[some])
        covered = part._replace(half=share * part.half)
        self._keep(covered, clearance[some], _span(taylor[some], covered.half))
        return joined([part.without(share), pieces.chosen(none & ~short).halved()])

    def _clearances(self, pieces: Pieces) -> Floats:
        self._evaluations += len(pieces.segment)
        q = self._motion.positions(pieces.segment, pieces.middle)
        return np.maximum(clearances(self._robot, q) - self._round_off, 0.0)

    def _taylor(self, pieces: Pieces) -> Floats:
        scaled = self._motion.taylor(pieces) / self._robot.singularity.task.column_scales
        return np.asarray(scaled[:, :, self._moving])

    def _keep(self, pieces: Pieces, clearance: Floats, span: Floats) -> None:
        if len(pieces.segment):
            self._proved.append(_Proved(pieces, clearance, span))

    def _all_proved(self) -> _Proved:
        return _Proved(
            joined([one.pieces for one in self._proved]),
            np.concatenate([np.zeros(0), *(one.clearance for one in self._proved)]),
            np.concatenate([np.zeros(0), *(one.span for one in self._proved)]),
        )

    def _raise_lower_bound(self) -> None:
        # Splits the pieces of which the least is proved, while that can raise the lower bound.
        begin = self._evaluations
        for _ in range(RAISING_ROUNDS):
            proved = self._all_proved()
            least = proved.clearance - proved.span
            low = least < GOOD_ENOUGH * np.min(proved.clearance)
            many = 2 * int(np.sum(low))
            if not many or self._evaluations - begin + many > RAISING:
                return
            halves = proved.pieces.chosen(low).halved()
            clearance = self._clearances(halves)
            span = _span(self._taylor(halves), halves.half)
            # A half has what its whole had, where its own middle proves less.
            inherited = np.tile(least[low], 2)
            span = np.minimum(span, clearance - inherited)
            self._proved = [proved.chosen(~low), _Proved(halves, clearance, span)]

    def _result(self) -> PlanSingularity:
        motion, nearest = self._motion, self._nearest
        lower, segment, s = self._lowest()
        verdict: PlanVerdict = 'not decided' if self._open else 'proved'
        if self._refuted:
            verdict, lower = 'refuted', 0.0
            segment, s = nearest.segment, nearest.s
        else:
            self._look_at(np.array([segment]), np.array([s]))
            nearest = self._nearest
        moment = moment_at(motion, segment, s)
        pose = nearest.pose if (nearest.segment, nearest.s) == (segment, s) else None
        return PlanSingularity(
            verdict,
            self._threshold,
            lower,
            nearest.distance,
            moment,
            pose,
            _times(motion, [pieces for pieces, _ in self._open]),
            self._evaluations,
        )

    def _lowest(self) -> tuple[float, int, float]:
        # The least distance that is proved, and the middle of the piece that it is of.
        parts = [(one.pieces, one.clearance - one.span) for one in self._proved] + self._open
        if not parts:
            return 0.0, 0, 0.0
        pieces = joined([part for part, _ in parts])
        lowest = np.concatenate([values for _, values in parts])
        k = int(np.argmin(lowest))
        return float(lowest[k]), int(pieces.segment[k]), float(pieces.middle[k])


def _span(taylor: Floats, reach: Floats) -> Floats:
    # How far the joints move at most from the middles of pieces, within a reach (shares of a
    # segment).
    powers = reach[:, None] ** np.arange(1, taylor.shape[1])
    most = np.sum(np.abs(taylor[:, 1:]) * powers[:, :, None], axis=1)
    return np.asarray(np.linalg.norm(most, axis=1))


def _covered(taylor: Floats, half: Floats, room: Floats) -> Floats:
    # The largest share of each piece within which the joints move less than there is room.
    good, bad = np.zeros(len(room)), np.ones(len(room))
    for _ in range(HALVINGS):
        share = 0.5 * (good + bad)
        fits = _span(taylor, share * half) < room
        good, bad = np.where(fits, share, good), np.where(fits, bad, share)
    return good


def _times(motion: PolynomialMotion, parts: list[Pieces]) -> tuple[tuple[float, float], ...]:
    # The times of pieces, those that touch taken together.
    pieces = joined(parts)
    begins = motion.times(pieces.segment, pieces.middle - pieces.half)
    ends = motion.times(pieces.segment, pieces.middle + pieces.half)
    merged: list[tuple[float, float]] = []
    for k in np.argsort(begins, kind='stable').tolist():
        begin, end = float(begins[k]), float(ends[k])
        if merged and begin <= merged[-1][1] + 1e-9 * max(1.0, abs(begin)):
            merged[-1] = (merged[-1][0], max(end, merged[-1][1]))
        else:
            merged.append((begin, end))
    return tuple(merged)
