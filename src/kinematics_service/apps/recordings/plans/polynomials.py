# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Interpolate a plan as joint_trajectory_controller does: by a polynomial of time between two points.
"""

import math
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from ....kernel import Floats, Integers
from .verdicts import PlanMoment

Index: TypeAlias = npt.NDArray[np.bool_] | slice


class Pieces(NamedTuple):
    """
    N pieces of a planned motion. A piece is an interval of time within one segment of the plan.

    Attributes
    ----------
    segment : shape (N,)
        Number of the segment in which each piece lies. Segment k is the motion from point k of the
        plan to point k + 1, counted from 0.
    middle, half : shape (N,)
        Middle and half length of each piece, as fractions of the segment's duration.
    """

    segment: Integers
    middle: Floats
    half: Floats

    def chosen(self, index: Index) -> 'Pieces':
        """Return the pieces that `index` (an index array or a slice) selects."""
        return Pieces(self.segment[index], self.middle[index], self.half[index])

    def halved(self) -> 'Pieces':
        """Split each piece in the middle, and return both halves."""
        half = 0.5 * self.half
        return Pieces(
            np.tile(self.segment, 2),
            np.concatenate([self.middle - half, self.middle + half]),
            np.tile(half, 2),
        )


def joined(parts: list[Pieces]) -> Pieces:
    """Join several `Pieces` to one object with all pieces."""
    none = Pieces(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0))
    return Pieces(*(np.concatenate(columns) for columns in zip(none, *parts)))


class PolynomialMotion(NamedTuple):
    """
    A motion of n joints as S polynomials of time, one for each segment, in the order of time.

    Attributes
    ----------
    begins, durations : shape (S,), seconds
        Begin and duration of each segment.
    coefficients : shape (S, degree + 1, n), rad or m
        Coefficients of the powers of `s`, the fraction of the segment's duration: 0 at the begin
        of the segment, 1 at the end.
    """

    begins: Floats
    durations: Floats
    coefficients: Floats

    def place(self, x: npt.ArrayLike) -> tuple[Integers, Floats]:
        """
        Split places along the motion into segment numbers and fractions `s` (0 to 1) of a segment:
        1.25 is s = 0.25 in segment 1.
        """
        segment = np.minimum(np.asarray(x, dtype=np.int64), len(self.begins) - 1)
        return segment, np.asarray(x - segment)

    def times(self, segment: Integers, s: Floats) -> Floats:
        """Return the times in seconds, as in the plan, at fractions `s` (0 to 1) of segments."""
        return np.asarray(self.begins[segment] + s * self.durations[segment])

    def positions(self, segment: Integers, s: Floats) -> Floats:
        """Return the joint positions at fractions `s` (0 to 1) of segments, (N, n), rad or m."""
        value: Floats = self.coefficients[segment, -1].copy()
        for i in range(self.coefficients.shape[1] - 2, -1, -1):
            value = value * s[:, None] + self.coefficients[segment, i]
        return np.asarray(value)

    def seconds(self, segment: Integers) -> Floats:
        """Return the durations of segments, s. Return 1 for a segment of duration 0."""
        durations = self.durations[segment]
        return np.where(durations > 0.0, durations, 1.0)

    def velocities(self, segment: Integers, s: Floats) -> Floats:
        """
        Return the joint velocities at fractions `s` (0 to 1) of segments, (N, n), rad/s or m/s.
        """
        taylor = self.taylor(Pieces(segment, s, np.zeros(len(s))))
        return derivative(taylor, 1, self.seconds(segment))

    def whole(self) -> Pieces:
        """Return each segment of the motion as one piece."""
        count = len(self.begins)
        return Pieces(np.arange(count), np.full(count, 0.5), np.full(count, 0.5))

    def taylor(self, pieces: Pieces) -> Floats:
        """
        Return the Taylor coefficients of the joint positions about the middle of each piece, shape
        (N, degree + 1, n).

        A piece is an interval of time within a segment. Let s be the fraction of the segment's
        duration, 0 to 1, and let m be s at the middle of the piece. Then the joint positions are
        the sum over k of coefficient[k] * (s - m)**k.
        """
        moved = self.coefficients[pieces.segment]
        degree = moved.shape[1] - 1
        # Shift the polynomials to the middle of each piece, by repeated synthetic division.
        for i in range(degree):
            for k in range(degree - 1, i - 1, -1):
                moved[:, k] += pieces.middle[:, None] * moved[:, k + 1]
        return np.asarray(moved)


def derivative(taylor: Floats, order: int, seconds: Floats) -> Floats:
    """
    Return the time derivative of order `order` of the joint positions, at the middle of each piece
    (an interval of time), shape (N, n).

    `taylor` (N, degree + 1, n) holds Taylor coefficients of the joint positions at the middle of
    each piece. `seconds` (N,) holds the duration of the whole segment in which each piece lies.
    """
    if order >= taylor.shape[1]:
        return np.zeros_like(taylor[:, 0])
    scale = seconds[:, None] ** order
    return np.ascontiguousarray(math.factorial(order) * taylor[:, order] / scale)


def polynomial_motion(
    times: Floats, positions: Floats, velocities: Floats | None, accelerations: Floats | None
) -> PolynomialMotion:
    """
    Return the motion that joint_trajectory_controller makes through the points of a plan.

    The polynomials of the motion are linear if the points have only positions, cubic if they also
    have velocities, and quintic if they also have accelerations. A plan of one point does not
    move.

    Parameters
    ----------
    times : shape (N,), s
        Times of the points, which must rise.
    positions, velocities, accelerations : shape (N, n)
        rad or m, and their derivatives; None if the points have none.
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
        # Solve Hermite's conditions: position and velocity at both ends of a segment.
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


def moment_at(motion: PolynomialMotion, segment: int | Integers, s: float | Floats) -> PlanMoment:
    """
    Return the moment at the fraction `s` (0 to 1) of a segment: time, index of the last plan point
    at or before this time, and joint positions.
    """
    at, fraction = np.array([segment]), np.array([s])
    time = float(motion.times(at, fraction)[0])
    last = segment == len(motion.begins) - 1 and s == 1.0 and motion.durations[segment] > 0.0
    return PlanMoment(time, int(segment + last), motion.positions(at, fraction)[0])
