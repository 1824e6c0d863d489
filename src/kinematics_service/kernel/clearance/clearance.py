# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the clearance of joint positions q: a radius, rad, with a proof that no joint positions
within this radius around q are singular.

A first radius follows from Weyl's inequality. For a larger radius, the task Jacobian J_t is
written in the bases of its singular vectors at q. In these bases J_t is the block matrix
[S, 0; 0, s] at q. S is diagonal and has all singular values except the smallest; s has the
smallest. A joint motion d changes J_t to [A, B; C, f]. A is invertible if a bound of the change
A - S, relative to S, is below 1. Then J_t has full rank if the Schur complement f - C A^-1 B is
not zero. Row and column operations that are linear in d remove the first-order terms of B and C.
The operations leave the Schur complement unchanged. The Schur complement is expanded to third
order in d. Bounds cover the terms of higher order.

The Schur complement of a redundant arm has several entries, and J_t has full rank unless all
entries are zero. The proof shows that a sum of the entries, with polynomials as weights, is
positive.
"""

import math

from ..forward import chain_pass, vectors
from ..layout import arrays, places
from ..layout.arrays import Flat, Floats, Integers
from ..measures import symmetric
from ..singular_search.arm import Arm
from . import directions
from .cubic import Cubic
from .directions import Directions
from .expansion import Expansion

# Largest number of bisections in the search for the proved radius.
HALVINGS = 32
# The bisection ends if the relative error of the proved radius is below this number.
RADIUS_TOLERANCE = 1e-5
# The Schur complement of J_t has one or several entries. If a weighted sum of the entries is
# positive, J_t has full rank. At most MAX_SUMS sums with constant weights are tried. Then one sum
# with polynomials as weights is tried (`Cubic.take_away`).
MAX_SUMS = 4


class Clearance:
    """
    Computes the clearance of joint positions q: the radius of a ball without singular poses, rad.

    The center of the ball is q. Bounds of the derivatives of the task Jacobian J_t prove the
    radius. The rows and columns of J_t are scaled as in `TaskRows`.

    Parameters
    ----------
    arm
        The arm.
    moving
        Indices, from 0, of the joints that can change the rank of J_t.
    point : shape (3,), m
        The point whose velocity J_t describes, in tool axes relative to the tool's origin. If J_t
        has all six rows, its rank does not depend on the point.
    bend, twist, fourth
        Bounds of the norms of the second (`bend`), third (`twist`) and fourth derivatives of J_t
        along a motion of length 1 of the joints in `moving`; the motion of a prismatic joint is
        divided by the characteristic length. `twist` and `fourth` are infinite if they are
        unknown.
    """

    def __init__(
        self,
        arm: Arm,
        moving: Integers,
        point: Floats,
        bend: float,
        twist: float,
        fourth: float,
    ) -> None:
        if arm.chain.loops > 0:
            raise TypeError('the bounds of a clearance do not know closed loops')
        if moving.min(initial=0) < 0 or moving.max(initial=-1) >= arm.chain.dof:
            raise TypeError('a joint that counts is none')
        self.arm, self.directions = arm, Directions(arm.chain, arm.task)
        self.count, self.point = arrays.size(moving), arrays.numbers(point, 3)
        self.bend, self.twist, self.fourth = bend, twist, fourth
        self.share: float = places.SINGULAR_VALUE_RATIO * self._condition()
        self.largest, self.change = 0.0, 0.0
        self.known = twist < places.INFINITY and fourth < places.INFINITY
        self.expansion = Expansion(arm.chain, arm.task, moving, 3 if self.known else 1)
        self.by_block, self.bend_of_block, self.second = 0.0, 0.0, 0.0
        self.by_turns, self.bend_of_turns, self.twist_of_turns = 0.0, 0.0, 0.0
        self.by_lines, self.bend_of_lines, self.twist_of_lines = 0.0, 0.0, 0.0
        self.sum, self.steep = Cubic(self.count), Cubic(self.count)
        count, k = self.directions.count, self.arm.task.generic_rank - 1
        pairs = self.expansion.sizes[2]
        (self.F,) = arrays.rooms(count * self.expansion.terms)
        self.B, self.C = arrays.rooms(k * count * pairs, k * pairs)
        self.shares, self.across = arrays.rooms(count, count)
        self.steepest, self.first = arrays.rooms(count, count)
        self.gram, self.factor = arrays.rooms(count * count, count * count)

    def radius(self, q: Flat) -> float:
        """
        Return a radius, rad, such that no joint positions within this radius around q (n,) are
        singular.
        """
        k = self.arm.task.generic_rank
        self._evaluate(q)
        sigma = self.directions.sigma
        smallest, self.largest = sigma[k - 1], sigma[0]
        if not smallest > self.share * self.largest:
            return 0.0
        self.expansion.write(self.directions.row)
        self.change = self.expansion.change()
        radius = self._by_change(smallest)
        if k == 1 or not self.known:
            return radius
        self.second = sigma[k - 2]
        self.expansion.turn(self.directions)
        self._write_complement()
        self._write_norms()
        arrays.fill(self.first, self.directions.count, 0.0)
        self.first[0] = 1.0
        self._set_sum(self.sum, self.first)
        radius = self._by_complement(radius)
        if self.directions.count > 1 and self._choose_shares():
            for turn in range(1, MAX_SUMS):
                self._mix(turn / (MAX_SUMS - 1.0))
                self._set_sum(self.sum, self.across)
                radius = self._by_complement(radius)
            self._set_sum(self.sum, self.shares)
            self._set_sum(self.steep, self.steepest)
            self.steep.write_sizes()
            self.sum.take_away(self.steep)
            radius = self._by_complement(radius)
        return radius

    def _mix(self, fraction: float) -> None:
        # Fills `across` with weights for the entries of the Schur complement. The Euclidean norm
        # of the weights is 1. If `fraction` is 0, all weights except the first are 0. If it is 1,
        # the weights equal `shares` (see `_choose_shares`). If it is between 0 and 1, the weights
        # are between these two cases.
        for i in range(self.directions.count):
            self.across[i] = fraction * self.shares[i] + (1.0 - fraction) * self.first[i]
        unit(self.across, self.directions.count)

    def _set_sum(self, cubic: Cubic, shares: Flat) -> None:
        # Sets `cubic` to the sum of the entries of the Schur complement, each multiplied by its
        # weight in `shares`.
        count = self.directions.count
        smallest = self.directions.sigma[self.arm.task.generic_rank - 1]
        cubic.set_sum(self.expansion, self.F, shares, count, shares[0] * smallest)

    def _evaluate(self, q: Flat) -> None:
        # Evaluates the Jacobian at q, changes its linear velocities to those of `point`, and
        # computes the singular value decomposition of J_t.
        n = self.arm.chain.dof
        arrays.copy(self.directions.q, n, q)
        row = self.directions.row
        chain_pass.evaluate_row(
            self.arm.chain, self.directions.q, self.directions.still, places.JACOBIAN, row
        )
        point = vectors.times_vector(row, vectors.three(self.point, 0))
        entries = self.arm.chain.entries
        v = arrays.after(row, self.arm.chain.screws_at)
        w = arrays.after(v, 3 * entries)
        for e in range(entries):
            velocity = vectors.cross(vectors.apart(w, e, entries), point)
            v[e] += velocity[0]
            v[e + entries] += velocity[1]
            v[e + 2 * entries] += velocity[2]
        if self.arm.chain.form == places.MIXED:
            chain_pass.add_up_screws(self.arm.chain, v, row)
        self.directions.decompose()

    def _condition(self) -> float:
        # The search for singular poses uses J_t with the linear velocities of the tool's origin.
        # The clearance uses J_t with the linear velocities of `point`. The second matrix is M
        # times the first, where M is the block matrix [I, P / length; 0, I]. P is the matrix with
        # P w = w x point (vector product), and `length` scales the angular rows.
        # Let r_tool and r_point be the smallest singular value divided by the largest, for the
        # first and the second matrix. Then r_tool >= r_point / c, where c is the condition number
        # of M. Returns c.
        away = 0.0
        for i in range(self.arm.task.count):
            if self.arm.task.axis[i] >= 3:
                length = self.arm.task.row_scale[i]
                away = max(away, directions.length_of(self.point, 3) / length)
        root = 0.5 * away + math.sqrt(1.0 + 0.25 * away * away)
        return root * root

    def _changed(self, r: float) -> float:
        # Returns an upper bound of the norm of the change of J_t for joint motions up to length r.
        # No singular value changes by more than this bound.
        return self.change * r + 0.5 * self.bend * r * r

    def _by_change(self, smallest: float) -> float:
        # Returns the radius that follows from Weyl's inequality. The inequality says that a
        # singular value changes at most by the norm of the change of J_t.
        good, bad = 0.0, places.FARTHEST
        for _ in range(HALVINGS):
            r = 0.5 * (good + bad)
            moved = self._changed(r)
            if smallest - moved > self.share * (self.largest + moved):
                good = r
            else:
                bad = r
        return good

    def _write_complement(self) -> None:
        # J_t is the block matrix [A, B; C, f] with the invertible block A (see the module's
        # docstring). Fills row i of the array F with the Taylor terms, up to third order, of entry
        # i of the Schur complement f - C A^-1 B.
        # Row and column operations remove the first-order terms of the blocks B and C, and change
        # the second-order terms of these blocks. Fills the arrays self.B and self.C with the
        # changed second-order terms.
        d, k, count = self.count, self.arm.task.generic_rank - 1, self.directions.count
        terms, pairs = self.expansion.terms, self.expansion.sizes[2]
        for a in range(k):
            C = arrays.after(self.C, a * pairs)
            arrays.copy(C, pairs, arrays.after(self._cell(k, a), d))
            for b in range(k):
                self._subtract(self._cell(k, b), self._cell(b, a), 1, C)
            for i in range(count):
                B = arrays.after(self.B, (a * count + i) * pairs)
                arrays.copy(B, pairs, arrays.after(self._cell(a, k + i), d))
                for b in range(k):
                    self._subtract(self._cell(a, b), self._cell(b, k + i), 1, B)
        for i in range(count):
            F = arrays.after(self.F, i * terms)
            arrays.copy(F, terms, self._cell(k, k + i))
            squared, cubed = arrays.after(F, d), arrays.after(F, d + pairs)
            for a in range(k):
                line, turn = self._cell(k, a), self._cell(a, k + i)
                self._subtract(line, turn, 1, squared)
                B = arrays.after(self.B, (a * count + i) * pairs)
                self._subtract(line, B, 2, cubed)
                self._subtract(turn, arrays.after(line, d), 2, cubed)

    def _cell(self, turn: int, line: int) -> Flat:
        # Returns the Taylor terms of the entry of J_t in row `turn` and column `line` (see
        # `Directions`).
        cell = turn * self.directions.length + line
        return arrays.after(self.expansion.G, cell * self.expansion.terms)

    def _subtract(self, a: Flat, b: Flat, order: int, product: Flat) -> None:
        # Multiplies the first-order Taylor terms `a` by the Taylor terms `b`, whose order is
        # `order` (1 or 2). Subtracts the result from the Taylor terms in `product`.
        d, pair, triple = self.count, self.expansion.pair, self.expansion.triple
        for i in range(d):
            for j in range(d):
                if order == 1:
                    product[pair[i * d + j]] -= a[i] * b[j]
                    continue
                for p in range(j, d):
                    product[triple[(i * d + j) * d + p]] -= a[i] * b[pair[j * d + p]]

    def _write_norms(self) -> None:
        # J_t is the block matrix [A, B; C, f] (see the module's docstring). Computes upper bounds
        # of the changes of A, B and C by a joint motion of length 1. Each order of the Taylor
        # expansion has its own bounds. Their names end in `block` for A, in `turns` for B and in
        # `lines` for C.
        k, count, d = self.arm.task.generic_rank - 1, self.directions.count, self.count
        terms, pairs = self.expansion.terms, self.expansion.sizes[2]
        step, cubed = self.directions.length * terms, d + pairs
        block, turns, lines = self._cell(0, 0), self._cell(0, k), self._cell(k, 0)
        self.by_block = self.expansion.norm(block, k, step, k, terms, 1, 1)
        self.bend_of_block = self.expansion.norm(arrays.after(block, d), k, step, k, terms, 1, 2)
        self.by_turns = self.expansion.norm(turns, k, step, count, terms, 1, 1)
        self.bend_of_turns = self.expansion.norm(self.B, k, count * pairs, count, pairs, 1, 2)
        turns = arrays.after(turns, cubed)
        self.twist_of_turns = self.expansion.norm(turns, k, step, count, terms, 1, 3)
        self.by_lines = self.expansion.norm(lines, k, terms, 1, 0, 1, 1)
        self.bend_of_lines = self.expansion.norm(self.C, k, pairs, 1, 0, 1, 2)
        lines = arrays.after(lines, cubed)
        self.twist_of_lines = self.expansion.norm(lines, k, terms, 1, 0, 1, 3)

    def _choose_shares(self) -> bool:
        # Chooses two vectors of weights, `shares` and `steepest`. Each vector has one weight for
        # each entry of the Schur complement and gives a weighted sum of the entries. The sum with
        # the weights `shares` has the smallest gradient, relative to the value of the sum.
        # The candidates for `steepest` are the coordinate vectors (weight 1 for one entry, 0 for
        # the others), made orthogonal to `shares`. `steepest` is the candidate whose weighted sum
        # has the largest gradient. Returns False if `shares` or `steepest` would be zero.
        d, count, terms = self.count, self.directions.count, self.expansion.terms
        trace, max_slope = 0.0, 0.0
        for i in range(count):
            a = arrays.after(self.F, i * terms)
            for p in range(count):
                self.gram[i * count + p] = arrays.dot(a, arrays.after(self.F, p * terms), d)
            trace += self.gram[i * count + i]
        if not symmetric.damped_step(
            count, self.gram, self.first, 1e-9 * trace, self.factor, self.shares
        ) or not unit(self.shares, count):
            return False
        for i in range(count):
            for p in range(count):
                self.across[p] = -self.shares[i] * self.shares[p]
            self.across[i] += 1.0
            if not unit(self.across, count):
                continue
            slope = 0.0
            for p in range(count):
                for j in range(count):
                    slope += self.across[p] * self.across[j] * self.gram[p * count + j]
            if slope > max_slope:
                max_slope = slope
                arrays.copy(self.steepest, count, self.across)
        return max_slope > 0.0

    def _by_complement(self, best: float) -> float:
        # Searches by bisection the largest radius within which `self.sum` is proved to be
        # positive. Returns this radius, but at least `best`.
        self.sum.write_sizes()
        self.sum.diagonalise()
        good, bad = best, places.FARTHEST
        at_least = (1.0 + RADIUS_TOLERANCE) * best + RADIUS_TOLERANCE * RADIUS_TOLERANCE
        if not self._is_proved(at_least):
            return best
        if self._is_proved(bad):
            return bad
        for _ in range(HALVINGS):
            r = 0.5 * (good + bad)
            if self._is_proved(r):
                good = r
            else:
                bad = r
            if bad - good < RADIUS_TOLERANCE * good:
                break
        return good

    def _is_proved(self, r: float) -> bool:
        # Returns whether `self.sum`, a weighted sum of the entries of the Schur complement, is
        # proved to be positive for all joint motions |d| <= r. After the motion d, the scaled J_t
        # is the block matrix [I + P, B; C, f], where I + P is invertible. B1 and C1 are the
        # first-order parts of B and C. Let B' = B - (I + P) B1 and C' = C - C1 (I + P). Then the
        # Schur complement is f - C1 B' - C B1 - C' (I + P)^-1 B'.
        # A pose is also taken as singular if the smallest singular value of J_t is at most
        # `singular`. Then a matrix of lower rank is within the distance `singular` of J_t. So the
        # proof must show full rank for each matrix within the distance `singular` of J_t.
        # Therefore each bound of a change of J_t is increased by `singular`.
        square, singular = r * r, self.share * (self.largest + self._changed(r))
        third = self.twist * square * r / 6.0 + singular
        fourth = self.fourth * square * square / 24.0 + singular
        root = math.sqrt(self.second)
        bent = 0.5 * self.bend * square + singular
        bent = min(bent / self.second, self.bend_of_block * square + third / self.second)
        inside = self.by_block * r + bent
        if not inside < 1.0:
            return False
        twisted = min(third / root, self.twist_of_turns * square * r + fourth / root)
        turns = self.by_turns * r
        before = self.bend_of_turns * square + twisted + bent * turns
        remainder = fourth + self.by_lines * r * (twisted + bent * turns)
        twisted = min(third / root, self.twist_of_lines * square * r + fourth / root)
        behind = self.bend_of_lines * square + twisted + self.by_lines * r * bent
        remainder += twisted * turns + behind * before / (1.0 - inside)
        # Let s be the weighted sum of the entries of the Schur complement. `self.sum` has the
        # terms of s up to third order in d. `remainder` bounds the sum of the other terms of s.
        # `take_away` may have replaced s by s + p t. Here p is a quadratic polynomial, and t is a
        # second weighted sum, `self.steep`. `remainder` also bounds the terms of t beyond third
        # order. So `remainder * (1 + |p|)` bounds the terms that `self.sum` and `self.steep` leave
        # out.
        # `take_away` has dropped the terms of fourth and fifth order of p t. So a bound of the
        # dropped terms is added.
        slope, bend = self.sum.size_of_l * r, self.sum.size_of_M * square
        steep = self.steep.size_of_T * square * r
        remainder *= 1.0 + abs(self.sum.weight) + slope + bend
        remainder += slope * steep + bend * (self.steep.size_of_Q * square + steep)
        return self.sum.lowest(r) - remainder > 0.0


def unit(v: Flat, count: int) -> bool:
    """
    Scale the vector v (count,) to length 1, and change its sign if its first number is negative.
    Return False if v is 0.
    """
    size = directions.length_of(v, count)
    if not size > 0.0:
        return False
    if v[0] < 0.0:
        size = -size
    for i in range(count):
        v[i] /= size
    return True


def clearances(clearance: Clearance, q: Floats, radii: Floats) -> None:
    """
    Fill `radii` (N,) with the clearances, rad, of the rows of q (N, n).

    No joint positions within the distance radii[k] from row k of q are singular.
    """
    n, count = clearance.arm.chain.dof, arrays.extent(q, 0)
    positions, results = arrays.numbers(q, count * n), arrays.results(radii, count)
    with arrays.without_lock():
        for k in range(count):
            results[k] = clearance.radius(arrays.after(positions, k * n))
