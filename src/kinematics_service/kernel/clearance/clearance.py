"""
A radius around a pose in which no pose is singular, proved.

J_t is brought into the bases of its singular values. Between the directions of the larger ones it
stays invertible as long as bounds of its change say so; then it has full rank where the Schur
complement of that block is not zero. To first order the bases move along with the block, which
leaves hardly anything of what couples the two; what is left is known to third order, and bounded
beyond.

Of a redundant arm the complement has several numbers, of which not all are zero at once: a sum of
them, with weights that are polynomials too, is shown to be positive.
"""

import math

from ..forward import chain_pass
from ..layout import arrays, places
from ..layout.arrays import Flat, Floats, Integers
from ..measures import symmetric
from ..singular_search.arm import Arm
from . import directions
from .cubic import Cubic
from .directions import Directions
from .expansion import Expansion

# Largest number of halvings of the radius.
HALVINGS = 32
# The halvings end at this error of the radius, relative to it.
RADIUS_TOLERANCE = 1e-5
# Number of sums of the complement's entries that are tried.
SUMS = 4


class Clearance:
    """
    What is known of an arm's J_t at every pose, and room to prove that no pose nearby is singular.

    Parameters
    ----------
    arm
        The arm.
    moving : the joints that can change the rank of J_t
        Counted from 0.
    point : shape (3,), m
        The point whose velocity is taken, in the axes of the tool and from its origin: where all
        rows of J count, the rank is the same for each.
    bend, twist, fourth
        Bounds of the second, third and fourth derivatives of the scaled J_t along a unit motion of
        the joints that count; the last two infinite where they are not known.
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
        """Return the radius around q (n,) within which no pose is singular, rad."""
        k = self.arm.task.generic_rank
        self._stand_at(q)
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
        self._become(self.sum, self.first)
        radius = self._by_complement(radius)
        if self.directions.count > 1 and self._choose_shares():
            for turn in range(1, SUMS):
                self._mix(turn / (SUMS - 1.0))
                self._become(self.sum, self.across)
                radius = self._by_complement(radius)
            self._become(self.sum, self.shares)
            self._become(self.steep, self.steepest)
            self.steep.write_sizes()
            self.sum.take_away(self.steep)
            radius = self._by_complement(radius)
        return radius

    def _mix(self, share: float) -> None:
        # The sum between the first number alone and that with the least slope.
        for i in range(self.directions.count):
            self.across[i] = share * self.shares[i] + (1.0 - share) * self.first[i]
        unit(self.across, self.directions.count)

    def _become(self, cubic: Cubic, shares: Flat) -> None:
        # A sum of the complement's numbers.
        count, smallest = (
            self.directions.count,
            self.directions.sigma[self.arm.task.generic_rank - 1],
        )
        cubic.become(self.expansion, self.F, shares, count, shares[0] * smallest)

    def _stand_at(self, q: Flat) -> None:
        # Evaluates q, takes the velocities of the point, and decomposes J_t.
        n = self.arm.chain.dof
        arrays.copy(self.directions.q, n, q)
        row = self.directions.row
        chain_pass.evaluate_row(
            self.arm.chain, self.directions.q, self.directions.still, places.JACOBIAN, row
        )
        px, py, pz = self.point[0], self.point[1], self.point[2]
        x = row[0] * px + row[1] * py + row[2] * pz
        y = row[4] * px + row[5] * py + row[6] * pz
        z = row[8] * px + row[9] * py + row[10] * pz
        entries = self.arm.chain.entries
        v = arrays.after(row, self.arm.chain.screws_at)
        w = arrays.after(v, 3 * entries)
        for e in range(entries):
            wx, wy, wz = w[e], w[e + entries], w[e + 2 * entries]
            v[e] += wy * z - wz * y
            v[e + entries] += wz * x - wx * z
            v[e + 2 * entries] += wx * y - wy * x
        if self.arm.chain.form == places.MIXED:
            chain_pass.add_up_screws(self.arm.chain, v, row)
        self.directions.decompose()

    def _condition(self) -> float:
        # Which share of the largest singular value another one has counts at the tool's origin,
        # where a search judges it. On the way there from the point p, J_t is multiplied by
        # [1, p x / length; 0, 1]: by so much, its condition number, the share may fall.
        away = 0.0
        for i in range(self.arm.task.count):
            if self.arm.task.axis[i] >= 3:
                length = self.arm.task.row_scale[i]
                away = max(away, directions.length_of(self.point, 3) / length)
        root = 0.5 * away + math.sqrt(1.0 + 0.25 * away * away)
        return root * root

    def _changed(self, r: float) -> float:
        # How much J_t and its singular values change within r at most.
        return self.change * r + 0.5 * self.bend * r * r

    def _by_change(self, smallest: float) -> float:
        # Weyl: no singular value falls faster than J_t changes.
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
        # F, the complement of each line to third order; of what the moving bases leave of the
        # turns and lines, B and C, the second order.
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
        # The terms of J_t between a turn and a line.
        cell = turn * self.directions.length + line
        return arrays.after(self.expansion.G, cell * self.expansion.terms)

    def _subtract(self, a: Flat, b: Flat, order: int, product: Flat) -> None:
        # Subtracts the product of a, terms of the first order, and b, of an order.
        d, pair, triple = self.count, self.expansion.pair, self.expansion.triple
        for i in range(d):
            for j in range(d):
                if order == 1:
                    product[pair[i * d + j]] -= a[i] * b[j]
                    continue
                for p in range(j, d):
                    product[triple[(i * d + j) * d + p]] -= a[i] * b[pair[j * d + p]]

    def _write_norms(self) -> None:
        # How much block, turns and lines change for motions of length 1, order by order.
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
        # Of the sums of the complement's numbers that which has the least slope for its size, and
        # of those across it the steepest.
        d, count, terms = self.count, self.directions.count, self.expansion.terms
        trace, most = 0.0, 0.0
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
            if slope > most:
                most = slope
                arrays.copy(self.steepest, count, self.across)
        return most > 0.0

    def _by_complement(self, best: float) -> float:
        # The largest radius within which the sum is proved to be positive, or what is proved
        # already.
        self.sum.write_sizes()
        self.sum.diagonalise()
        good, bad = best, places.FARTHEST
        if not self._is_proved(
            (1.0 + RADIUS_TOLERANCE) * best + RADIUS_TOLERANCE * RADIUS_TOLERANCE
        ):
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
        # Whether the sum is positive for all |d| <= r. With P, B, C the changes of block, turns
        # and lines and B1, C1 their first order, the moving bases leave of the complement
        # f - C1 B' - C B1 - C' (1 + P)^-1 B', B' = B - (1 + P) B1, C' = C - C1 (1 + P). What a
        # singular value may be counts as a change: J_t stays regular with any that is as large.
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
        rest = fourth + self.by_lines * r * (twisted + bent * turns)
        twisted = min(third / root, self.twist_of_lines * square * r + fourth / root)
        behind = self.bend_of_lines * square + twisted + self.by_lines * r * bent
        rest += twisted * turns + behind * before / (1.0 - inside)
        # The weight of the steepest number, and its products with it from the fourth order on.
        slope, bend = self.sum.size_of_l * r, self.sum.size_of_M * square
        steep = self.steep.size_of_T * square * r
        rest *= 1.0 + abs(self.sum.weight) + slope + bend
        rest += slope * steep + bend * (self.steep.size_of_Q * square + steep)
        return self.sum.lowest(r) - rest > 0.0


def unit(v: Flat, count: int) -> bool:
    """Make the first number of v (count,) positive and its length 1, where it has one."""
    size = directions.length_of(v, count)
    if not size > 0.0:
        return False
    if v[0] < 0.0:
        size = -size
    for i in range(count):
        v[i] /= size
    return True


def clearances(clearance: Clearance, q: Floats, radii: Floats) -> None:
    """Fill `radii` (N,) with the radius around each q (N, n) in which no pose is singular, rad."""
    n, count = clearance.arm.chain.dof, arrays.extent(q, 0)
    positions, results = arrays.numbers(q, count * n), arrays.results(radii, count)
    lock = arrays.let_go()
    for k in range(count):
        results[k] = clearance.radius(arrays.after(positions, k * n))
    arrays.take_back(lock)
