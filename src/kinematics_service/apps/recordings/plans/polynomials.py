"""The motion that a controller makes of a plan: a polynomial of time between each two points."""

import math
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from ....kernel import Floats, Integers
from .verdicts import PlanMoment

Which: TypeAlias = npt.NDArray[np.bool_] | slice


class Pieces(NamedTuple):
    """
    N pieces of a motion, each within one polynomial.

    Attributes
    ----------
    segment : shape (N,)
        The polynomial, counted from 0: that between points `segment` and `segment + 1`.
    middle, half : shape (N,)
        Where its middle is, and half its length, in shares of the segment.
    """

    segment: Integers
    middle: Floats
    half: Floats

    def chosen(self, which: Which) -> 'Pieces':
        """Return some of them."""
        return Pieces(self.segment[which], self.middle[which], self.half[which])

    def halved(self) -> 'Pieces':
        """Return both halves of each."""
        return self.without(np.zeros(len(self.segment)))

    def without(self, share: Floats) -> 'Pieces':
        """Return what is left on both sides when a share of each, around its middle, is taken."""
        half = 0.5 * (1.0 - share) * self.half
        away = 0.5 * (1.0 + share) * self.half
        both = Pieces(
            np.concatenate([self.segment, self.segment]),
            np.concatenate([self.middle - away, self.middle + away]),
            np.concatenate([half, half]),
        )
        return both.chosen(both.half > 0.0)


def joined(parts: list[Pieces]) -> Pieces:
    """Return the pieces of all parts."""
    none = Pieces(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0))
    return Pieces(*(np.concatenate(columns) for columns in zip(none, *parts)))


class PolynomialMotion(NamedTuple):
    """
    A motion of n joints in S polynomials, one after the other.

    Attributes
    ----------
    begins, durations : shape (S,), s
    coefficients : shape (S, degree + 1, n), rad or m
        By powers of s, which goes from 0 to 1 in each segment.
    """

    begins: Floats
    durations: Floats
    coefficients: Floats

    def times(self, segment: Integers, s: Floats) -> Floats:
        """Return the times of places in segments, s."""
        return np.asarray(self.begins[segment] + s * self.durations[segment])

    def positions(self, segment: Integers, s: Floats) -> Floats:
        """Return the joint positions there, shape (N, n), rad or m."""
        value: Floats = self.coefficients[segment, -1].copy()
        for i in range(self.coefficients.shape[1] - 2, -1, -1):
            value = value * s[:, None] + self.coefficients[segment, i]
        return np.asarray(value)

    def seconds(self, segment: Integers) -> Floats:
        """Return how long segments are, s; 1 where one has no length."""
        durations = self.durations[segment]
        return np.where(durations > 0.0, durations, 1.0)

    def whole(self) -> Pieces:
        """Return the segments as pieces."""
        count = len(self.begins)
        return Pieces(np.arange(count), np.full(count, 0.5), np.full(count, 0.5))

    def taylor(self, pieces: Pieces) -> Floats:
        """
        Return the polynomials by powers of the way from the middle of each piece.

        Shape (N, degree + 1, n); the way is in shares of the segment.
        """
        moved = self.coefficients[pieces.segment]
        degree = moved.shape[1] - 1
        # Synthetic division, once for each power.
        for i in range(degree):
            for k in range(degree - 1, i - 1, -1):
                moved[:, k] += pieces.middle[:, None] * moved[:, k + 1]
        return np.asarray(moved)


def derivative(taylor: Floats, order: int, seconds: Floats) -> Floats:
    """Return a derivative by time (N, n) at the middles of pieces of `taylor`."""
    if order >= taylor.shape[1]:
        return np.zeros_like(taylor[:, 0])
    scale = seconds[:, None] ** order
    return np.ascontiguousarray(math.factorial(order) * taylor[:, order] / scale)


def polynomial_motion(
    times: Floats, positions: Floats, velocities: Floats | None, accelerations: Floats | None
) -> PolynomialMotion:
    """
    Return the motion of joint_trajectory_controller through the points of a plan.

    It is straight where points have positions alone, cubic with velocities, and quintic with
    accelerations too; a plan of one point stays there.

    Parameters
    ----------
    times : shape (N,), s
        Rising.
    positions, velocities, accelerations : shape (N, n)
        rad or m, and their derivatives; None where the points have none.
    """
    if len(times) == 1:
        return PolynomialMotion(times, np.zeros(1), positions[:, None])
    durations = np.diff(times)
    T = durations[:, None]
    p0, p1 = positions[:-1], positions[1:]
    d = p1 - p0
    if velocities is None:
        return PolynomialMotion(times[:-1], durations, np.stack([p0, d], axis=1))
    v0, v1 = velocities[:-1] * T, velocities[1:] * T
    if accelerations is None:
        # Hermite's conditions at both ends.
        cubic = [p0, v0, 3 * d - 2 * v0 - v1, v0 + v1 - 2 * d]
        return PolynomialMotion(times[:-1], durations, np.stack(cubic, axis=1))
    a0, a1 = accelerations[:-1] * T * T, accelerations[1:] * T * T
    quintic = [
        p0,
        v0,
        0.5 * a0,
        10 * d - 6 * v0 - 4 * v1 - 1.5 * a0 + 0.5 * a1,
        -15 * d + 8 * v0 + 7 * v1 + 1.5 * a0 - a1,
        6 * d - 3 * (v0 + v1) - 0.5 * (a0 - a1),
    ]
    return PolynomialMotion(times[:-1], durations, np.stack(quintic, axis=1))


def moment_at(motion: PolynomialMotion, segment: int, s: float) -> PlanMoment:
    """Return the moment at a share s of a segment."""
    at, share = np.array([segment]), np.array([s])
    time = float(motion.times(at, share)[0])
    last = segment == len(motion.begins) - 1 and s == 1.0 and motion.durations[segment] > 0.0
    return PlanMoment(time, segment + int(last), motion.positions(at, share)[0])
