# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute a lower bound of a cubic polynomial over a ball of joint motions (Lagrange dual)."""

from ..layout import arrays
from ..layout.arrays import Flat
from ..measures import symmetric
from . import directions
from .expansion import Expansion
from .norms import Norms

# `Cubic.lowest` computes a lower bound of a cubic polynomial over the ball |d| <= r of joint
# motions d. It searches the best Lagrange multiplier of the constraint |d| <= r with this number
# of bisections. The lower bound is valid after any number of bisections; more bisections increase
# it.
MULTIPLIER_HALVINGS = 20
# Number of steps in `Cubic.take_away`. Let s and t be two polynomials of the joint motion d, and
# let g.d be the linear part of t. A step adds the product p t to s, where p is a quadratic
# polynomial. One part of the product, p (g.d), cancels all terms of s that contain g.d. The other
# part adds new terms that contain g.d. The next step cancels the new terms.
DIVISIONS = 4
# Smallest denominator in the formula of the lower bound, so that no number is divided by 0. It is
# relative to the length of the interval in which the Lagrange multiplier is searched.
MIN_DENOMINATOR = 1e-14


class Cubic:
    """
    A cubic polynomial constant + g.d + d^T Q d + T(d, d, d) of the motion d of some joints.

    The method `lowest` returns a lower bound of the polynomial over all |d| <= r.

    Parameters
    ----------
    count
        Number of joints that move.

    Attributes
    ----------
    constant, g, Q, T
        Coefficients: a number, (count,), symmetric (count, count), and symmetric (count, count,
        count).
    weight, l, M
        Coefficients of a quadratic polynomial p = weight + l.d + d^T M d. The call `take_away(t)`
        adds the product p t to the cubic polynomial, and stores the coefficients of p. Before the
        call, all coefficients of p are 0.
    size_of_l, size_of_M, size_of_Q, size_of_T
        Bounds of the absolute values of l.d, d^T M d, d^T Q d and T(d, d, d) for motions d of
        length 1.
    """

    def __init__(self, count: int) -> None:
        self.count = count
        d = count
        self.norms = Norms(max(d, 1), max(d * d * d, 1))
        self.constant, self.weight, self.size_of_l, self.size_of_M = 0.0, 0.0, 0.0, 0.0
        self.size_of_Q, self.size_of_T = 0.0, 0.0
        self.g, self.l, self.way = arrays.rooms(d, d, d)
        self.along, self.more, self.turned = arrays.rooms(d, d, d)
        self.Q, self.M, self.H = arrays.rooms(d * d, d * d, d * d)
        self.Z, self.half, self.T = arrays.rooms(d * d, d * d, d * d * d)

    def set_sum(
        self, expansion: Expansion, F: Flat, shares: Flat, count: int, constant: float
    ) -> None:
        """
        Set this polynomial to a weighted sum of `count` polynomials. Each row of F has the
        coefficients of one polynomial, `shares` has the weights, and `constant` is the constant
        term of the sum.
        """
        d, begins = self.count, expansion.begins
        self.constant, self.weight, self.size_of_l, self.size_of_M = constant, 0.0, 0.0, 0.0
        for a in range(d):
            self.g[a] = _sum(arrays.after(F, a), shares, count, expansion.terms)
            self.l[a] = 0.0
            for b in range(d):
                self.M[a * d + b] = 0.0
                at = begins[2] + expansion.pair[a * d + b]
                value = _sum(arrays.after(F, at), shares, count, expansion.terms)
                self.Q[a * d + b] = expansion.share[at] * value
                for c in range(d):
                    at = begins[3] + expansion.triple[(a * d + b) * d + c]
                    value = _sum(arrays.after(F, at), shares, count, expansion.terms)
                    self.T[(a * d + b) * d + c] = expansion.share[at] * value

    def take_away(self, other: 'Cubic') -> None:
        """
        Add the product p t to this polynomial s, where t is `other` and p is quadratic.

        Let g.d be the linear part of t. The coefficients of p are chosen so that p t cancels the
        terms of s that contain g.d. If the constant term of s + p t is negative, all coefficients
        of s + p t change their signs. If t is 0 at a joint motion d, the absolute value of s at d
        stays unchanged.
        """
        d = self.count
        slope = directions.length_of(other.g, d)
        if not slope > 0.0:
            return
        for j in range(d):
            self.way[j] = other.g[j] / slope
        for _ in range(DIVISIONS):
            self._divide(slope)
            self._add_product(other)
        self.size_of_l = directions.length_of(self.l, d)
        self.size_of_M = self._norm(self.M, d)
        if self.constant < 0.0:
            self.constant = -self.constant
            for j in range(d):
                self.g[j] = -self.g[j]
            for p in range(d * d):
                self.Q[p] = -self.Q[p]
            for p in range(d * d * d):
                self.T[p] = -self.T[p]

    def _divide(self, slope: float) -> None:
        # Let s be this polynomial of the joint motion d, and let t be the argument of `take_away`.
        # The linear part of t is slope * (u.d), where the vector u (`way`) has length 1. Computes
        # the quadratic polynomial p for which p * slope * (u.d) cancels all terms of s that
        # contain u.d. The coefficients of p are the number along[0], the vector `more` (linear
        # part) and the matrix `half` (quadratic part).
        d, u, whole = self.count, self.way, 0.0
        for a in range(d):
            self.more[a], self.along[a] = 0.0, 0.0
            for b in range(d):
                self.more[a] += 2.0 * self.Q[a * d + b] * u[b]
                value = 0.0
                for c in range(d):
                    value += u[c] * self.T[(c * d + a) * d + b]
                self.half[a * d + b] = value
                self.along[a] += value * u[b]
            whole += self.along[a] * u[a]
        square = 0.0
        for a in range(d):
            square += 0.5 * self.more[a] * u[a]
            for b in range(d):
                both = u[a] * self.along[b] + self.along[a] * u[b]
                value = 3.0 * self.half[a * d + b] - 1.5 * both + whole * u[a] * u[b]
                self.half[a * d + b] = -value / slope
        value = 0.0
        for a in range(d):
            value += self.g[a] * u[a]
            self.more[a] = -(self.more[a] - square * u[a]) / slope
        self.along[0] = -value / slope

    def _add_product(self, other: 'Cubic') -> None:
        # Adds to this polynomial the product of `other` and the quadratic polynomial that
        # `_divide` computed. Leaves out the terms of the product beyond third order.
        d, first, more, half = self.count, self.along[0], self.more, self.half
        self.weight += first
        self.constant += first * other.constant
        for a in range(d):
            self.l[a] += more[a]
            self.g[a] += first * other.g[a] + other.constant * more[a]
            for b in range(d):
                p = a * d + b
                self.M[p] += half[p]
                both = more[a] * other.g[b] + other.g[a] * more[b]
                self.Q[p] += first * other.Q[p] + 0.5 * both + other.constant * half[p]
                for c in range(d):
                    value = more[a] * other.Q[b * d + c] + more[b] * other.Q[a * d + c]
                    value += more[c] * other.Q[p] + half[p] * other.g[c]
                    value += half[a * d + c] * other.g[b] + half[b * d + c] * other.g[a]
                    self.T[p * d + c] += first * other.T[p * d + c] + value / 3.0

    def write_sizes(self) -> None:
        """
        Compute `size_of_Q` and `size_of_T`, bounds of the quadratic and the cubic term.

        The quadratic term is d^T Q d, and the cubic term is T(d, d, d). The bounds hold for all
        joint motions d of length 1.
        """
        self.size_of_Q = self._norm(self.Q, self.count)
        self.size_of_T = self._norm(self.T, self.count * self.count)

    def _norm(self, matrix: Flat, length: int) -> float:
        # Returns an upper bound of the largest singular value of `matrix`, shape (count, length).
        arrays.copy(self.norms.W, self.count * length, matrix)
        return self.norms.norm(self.count, length)

    def diagonalise(self) -> None:
        """Compute the eigenvalues and eigenvectors of 2 Q, which `lowest` needs."""
        d = self.count
        for p in range(d * d):
            self.H[p] = 2.0 * self.Q[p]
        symmetric.diagonalise(self.H, self.Z, d, symmetric.ROUND_OFF)
        for i in range(d):
            self.turned[i] = arrays.dot(arrays.after(self.Z, i * d), self.g, d)

    def lowest(self, r: float) -> float:
        """
        Return a lower bound of this polynomial over all joint motions |d| <= r.

        Call `write_sizes` and `diagonalise` first. The bound of g.d + d^T Q d is its Lagrange
        dual. Each multiplier m of the constraint |d| <= r for which the matrix 2 Q + m I is
        positive definite gives a valid bound (Boyd and Vandenberghe, Convex Optimization, 5.2).
        """
        d = self.count
        least, size = 0.0, 0.0
        for i in range(d):
            least = max(least, -self.H[i * d + i])
            size = max(size, abs(self.H[i * d + i]))
        whole = 2.0 * size + directions.length_of(self.turned, d) / r
        tiny = MIN_DENOMINATOR * whole if whole > 0.0 else 1.0
        low: float = least
        high: float = least + whole
        for _ in range(MULTIPLIER_HALVINGS):
            multiplier: float = 0.5 * (low + high)
            squares: float = 0.0
            for i in range(d):
                away: float = self.turned[i] / max(self.H[i * d + i] + multiplier, tiny)
                squares += away * away
            if squares > r * r:
                low = multiplier
            else:
                high = multiplier
        value: float = self.constant - self.size_of_T * r * r * r - 0.5 * high * r * r
        for i in range(d):
            value -= 0.5 * self.turned[i] * self.turned[i] / max(self.H[i * d + i] + high, tiny)
        return value


def _sum(terms: Flat, shares: Flat, count: int, apart: int) -> float:
    value = 0.0
    for i in range(count):
        value += shares[i] * terms[i * apart]
    return value
