"""The largest speed of a point of the arm over a plan, between two numbers."""

import math
from typing import NamedTuple

import numpy as np

from .... import kernel
from ....errors import PlanError
from ....kernel import Chain, Floats
from ....robot.robot import Robot
from .extremes import Extreme
from .polynomials import Pieces, PolynomialMotion, derivative, moment_at
from .verdicts import PlanSpeed, PlanVerdict

TOOL = 'tool'
# The two numbers differ by at most this share, and speeds below this (m/s) by all of it.
SHARE, STILL = 0.01, 1e-9
# A speed above its limit by less than this share keeps it.
SLACK = 1e-6
# Splits of a piece, and pieces at once, before the two numbers are left as they are.
SPLITS, MOST_PIECES = 40, 200_000
MOST_ROWS = 16_384


class _Bounded(NamedTuple):
    """Speeds at the middles of pieces, and what they are at most within each, m/s."""

    speed: Floats
    most: Floats


def speed_over_plan(
    robot: Robot, motion: PolynomialMotion, of: str, limit: float | None
) -> PlanSpeed:
    """
    Return the largest speed of a point over a motion.

    Parameters
    ----------
    robot, motion
        The arm and its motion.
    of
        `tool`; the number of a frame; or a joint, for the point of its axis where its row begins.
    limit
        m/s; None without one.

    Raises
    ------
    PlanError
        There is no such point.
    """
    chain = chain_to(robot, of)
    if chain is None or len(chain.table.joint) == 0:
        still: PlanVerdict | None = None if limit is None else 'proved'
        return PlanSpeed(of, 0.0, 0.0, moment_at(motion, 0, 0.0), limit, still)
    allowed = math.inf if limit is None else limit * (1.0 + SLACK)
    largest, upper = _bracket(_Speeds(chain, motion), allowed)
    verdict: PlanVerdict | None = None
    if limit is not None:
        verdict = 'not decided'
        if largest.value > allowed:
            verdict = 'refuted'
        elif upper <= allowed:
            verdict = 'proved'
    moment = moment_at(motion, largest.segment, largest.s)
    return PlanSpeed(of, largest.value, upper, moment, limit, verdict)


def _bracket(speeds: '_Speeds', allowed: float) -> tuple[Extreme, float]:
    # Splits all pieces that may hold more than has been seen, until they hold hardly more.
    pieces = speeds.motion.whole()
    largest, upper = _at_the_points(speeds), 0.0
    for split in range(SPLITS):
        found = speeds.bounded(pieces)
        k = int(np.argmax(found.speed))
        if found.speed[k] > largest.value:
            place = int(pieces.segment[k]), float(pieces.middle[k])
            largest = Extreme(float(found.speed[k]), *place)
        enough = largest.value * (1.0 + SHARE) + STILL
        if largest.value <= allowed:  # the limit may be in between
            enough = min(enough, max(allowed, largest.value + STILL))
        left = found.most > enough
        last = split == SPLITS - 1 or 2 * np.sum(left) > MOST_PIECES
        upper = max(upper, float(np.max(found.most[~left | last], initial=0.0)))
        if last or not np.any(left):
            break
        pieces = pieces.chosen(left).halved()
    return largest, max(upper, largest.value)


def _at_the_points(speeds: '_Speeds') -> Extreme:
    # Pieces of no length at both ends of each segment.
    count = len(speeds.motion.begins)
    segment = np.tile(np.arange(count), 2)
    s = np.repeat([0.0, 1.0], count)
    found = speeds.bounded(Pieces(segment, s, np.zeros(2 * count))).speed
    k = int(np.argmax(found))
    return Extreme(float(found[k]), int(segment[k]), float(s[k]))


def chain_to(robot: Robot, of: str) -> Chain | None:
    """
    Return the chain that ends in a point; None where the point stands still.

    Raises
    ------
    PlanError
        There is no such point.
    """
    if of == TOOL:
        return robot.chain
    if of.isdecimal() and int(of) <= robot.rows:
        chain = robot.point(int(of)).chain
        return chain if chain.entries else None
    # A joint that stands in a loop's own chain has no axis in the table.
    joints = () if robot.chain.loops else robot.joint_names
    if of in joints:
        table = robot.chain.table
        entry = int(np.argmax(table.joint == joints.index(of)))
        element = int(np.searchsorted(table.first_entry, entry, side='right')) - 1
        return _shortened(robot, element - 1, table.before[element])
    frames = f'of a frame (0 to {robot.rows})'
    give = f'with closed loops give {TOOL} or the number {frames}'
    if joints:
        give = f'give {TOOL}, the number {frames}, or a joint ({", ".join(joints)})'
    raise PlanError(
        f'{robot.name} has no point {of!r}: {give}',
        'speed_of',
        (TOOL, f'a frame from 0 to {robot.rows}', *joints),
        of,
    )


def _shortened(robot: Robot, last: int, offset: Floats) -> Chain | None:
    # The chain up to element `last`, with its tool at an offset from there.
    if last < 0:
        return None
    table = robot.chain.table
    entries = int(table.first_entry[last + 1])
    return Chain(
        table._replace(
            before=np.concatenate([table.before[: last + 1], offset[None]]),
            theta_0=table.theta_0[: last + 1].copy(),
            d_0=table.d_0[: last + 1].copy(),
            first_entry=table.first_entry[: last + 2].copy(),
            joint=table.joint[:entries].copy(),
            by_theta=table.by_theta[:entries].copy(),
            by_d=table.by_d[:entries].copy(),
            frame_parent=table.frame_parent[:1].copy(),
            frame_offset=table.frame_offset[:1].copy(),
        )
    )


class _Speeds:
    """The speed of a chain's tool along a motion, with bounds of how it changes."""

    def __init__(self, chain: Chain, motion: PolynomialMotion) -> None:
        self.motion = motion
        self._chain = chain
        table = chain.table
        element = np.repeat(np.arange(chain.elements), np.diff(table.first_entry))
        # What each element turns and slides by a unit of each joint.
        self._by_theta = np.zeros((chain.dof, chain.elements))
        self._by_d = np.zeros((chain.dof, chain.elements))
        np.add.at(self._by_theta, (table.joint, element), table.by_theta)
        np.add.at(self._by_d, (table.joint, element), table.by_d)

    def bounded(self, pieces: Pieces) -> _Bounded:
        """Return the speeds at the middles of pieces, and what they are at most."""
        parts = []
        for begin in range(0, len(pieces.segment), MOST_ROWS):
            parts.append(self._part(pieces.chosen(slice(begin, begin + MOST_ROWS))))
        return _Bounded(*(np.concatenate(columns) for columns in zip(*parts)))

    def _part(self, pieces: Pieces) -> _Bounded:
        taylor, T = self.motion.taylor(pieces), self.motion.seconds(pieces.segment)
        v, a = self._velocity(taylor, T)
        seconds = pieces.half * T
        swing = a * seconds[:, None]
        # |v + a t| is convex in t, so it is largest at an end of the piece.
        ends = np.maximum(np.linalg.norm(v + swing, axis=1), np.linalg.norm(v - swing, axis=1))
        bend = self._third(taylor, pieces.half, T)
        most = ends + 0.5 * bend * seconds**2
        return _Bounded(np.linalg.norm(v, axis=1), np.where(np.isnan(most), np.inf, most))

    def _velocity(self, taylor: Floats, T: Floats) -> tuple[Floats, Floats]:
        # Velocity of the point at the middles, and its derivative: dv_f/dq_e = w_e x v_f for e
        # before f, or the same.
        chain, E = self._chain, self._chain.entries
        q, rates, accelerations = (derivative(taylor, order, T) for order in (0, 1, 2))
        rows = np.empty((len(q), chain.widths[kernel.JACOBIAN]))
        kernel.evaluate(chain, q, rates, kernel.JACOBIAN, rows)
        screws = rows[:, chain.screws_at : chain.screws_at + 6 * E].reshape(-1, 6, E)
        v, w = np.moveaxis(screws[:, :3], 1, 2), np.moveaxis(screws[:, 3:], 1, 2)
        rate = rates[:, chain.table.joint][:, :, None]
        moved, turned = v * rate, w * rate
        before = np.cumsum(turned, axis=1) - turned
        acceleration = v * accelerations[:, chain.table.joint][:, :, None]
        acceleration += np.cross(2.0 * before + turned, moved)
        return np.sum(moved, axis=1), np.sum(acceleration, axis=1)

    def _third(self, taylor: Floats, half: Floats, T: Floats) -> Floats:
        # At least the third derivative of the point's position anywhere in each piece. The point
        # is a sum of vectors, each turned by the elements before it: R' of such a product is at
        # most s = sum |theta'|, R'' at most s^2 + a, the third at most s^3 + 3 s a + j.
        table = self._chain.table
        turns, slides = taylor @ self._by_theta, taylor @ self._by_d
        s, a, j = (np.cumsum(_most(turns, order, half, T), axis=1) for order in (1, 2, 3))
        # Element k + 1 slides along its axis, turned by the elements up to k.
        moves, axes = table.before[1:, :, 3], table.before[1:-1, :, 2]
        stroke = table.d_0[1:] + slides[:, 0, 1:]
        lengths = np.linalg.norm(moves[:-1] + axes * stroke[:, :, None], axis=2)
        lengths += _most(slides, 0, half, T)[:, 1:] - np.abs(slides[:, 0, 1:])
        last = np.full((len(taylor), 1), np.linalg.norm(moves[-1]))
        far = np.concatenate([lengths, last], axis=1)
        d1, d2, d3 = (_most(slides, order, half, T) for order in (1, 2, 3))
        bound = np.sum(far * (s**3 + 3.0 * s * a + j), axis=1) + np.sum(d3, axis=1)
        bound += 3.0 * np.sum(d1[:, 1:] * (s**2 + a)[:, :-1], axis=1)
        return np.asarray(bound + 3.0 * np.sum(d2[:, 1:] * s[:, :-1], axis=1))


def _most(taylor: Floats, order: int, half: Floats, T: Floats) -> Floats:
    # At least a derivative by time anywhere in each piece.
    most = np.zeros_like(taylor[:, 0])
    for i in range(order, taylor.shape[1]):
        most += math.perm(i, order) * np.abs(taylor[:, i]) * half[:, None] ** (i - order)
    return np.asarray(most / T[:, None] ** order)
