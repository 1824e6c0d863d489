"""Newton's method for six complex joint positions of a loop, and what certifies a solution."""

import math

from ..forward import vectors
from ..layout import arrays
from ..layout.arrays import Numbers, Vector
from . import complex_numbers, complex_product, pairs
from .complex_product import Product
from .pairs import Complex
from .six_screws import SixScrews

MOST_STEPS = 12
# Angles change by no more than this in a step. A step doubles the digits: after one below the
# second what is left is round-off.
LONGEST, STANDS = 0.5, 1e-7
# A solution misses the goal by less, in units of the loop, times what round-off grows by: nothing
# else has the same first order. What differs by half a turn misses it by more than a tenth.
MISSES, FAR_OFF = 1e-9, 0.1
# Round-off of one number of the product, and the most that Newton and Kantorovich's h may be.
# Below 1/2 there is a solution within two steps and no other within 1 / (beta K).
ROUND_OFF, CERTAIN = 1e-15, 0.0625
# Round-off grows by more where a position is far from the real ones.
FAR = 1e3
WIDTH = 13  # six columns of J, what is left, and six of the identity


def angle_left(
    loop: SixScrews, t: Numbers, k: int, v: Vector, vector: Numbers, turn: Numbers
) -> Complex:
    """
    Return the angle of joint k that turns a direction to where the goal has it.

    Joints before it are at positions t (6 pairs), those behind it do not turn the direction.
    `vector` (3 pairs) and `turn` (2 pairs) are room.
    """
    axis = vectors.axis_of(loop.screws, k)
    side = vectors.plus(v, -vectors.dot(axis, v), axis)
    goal = vectors.times_vector(loop.goal, v)
    for i in range(3):
        g = goal[0] if i == 0 else goal[1] if i == 1 else goal[2]
        pairs.put(vector, i, (g, 0.0))
    for j in range(k):
        if not vectors.slides(loop.screws, j):
            complex_numbers.write_turn(pairs.pair(t, j), turn)
            _turn_back(vector, vectors.axis_of(loop.screws, j), turn)
    re, im = (vector[0], vector[2], vector[4]), (vector[1], vector[3], vector[5])
    other = vectors.cross(axis, side)
    return complex_numbers.angle(
        (vectors.dot(side, re), vectors.dot(side, im)),
        (vectors.dot(other, re), vectors.dot(other, im)),
    )


def _turn_back(v: Numbers, axis: Vector, turn: Numbers) -> None:
    re, im = (v[0], v[2], v[4]), (v[1], v[3], v[5])
    arrays.fill(v, 6, 0.0)
    # A row times the turn is the column turned back.
    complex_product.add_turned(v, re, 0, axis, turn)
    complex_product.add_turned(v, im, 1, axis, turn)


class Motion:
    """
    Room for the product of a loop's screws at complex positions, and its derivatives.

    Attributes
    ----------
    first
        The largest change of a joint in the first step of `improve`.
    weights, radius : shape (6,)
        Of `certify`: what each joint's way counts; there is no other solution as near, and this
        one is nearer by far.
    """

    def __init__(self) -> None:
        self.product = Product(6)
        self.R, self.p = self.product.R, self.product.p
        self.axes, self.points = self.product.axes, self.product.points
        self.J, self.weights, self.sizes = arrays.rooms(12 * WIDTH, 6, 6)
        self.first, self.radius = 0.0, 0.0

    def improve(self, loop: SixScrews, t: Numbers) -> bool:
        """Move positions t (6 pairs) to a solution; return whether the steps ended at one."""
        step = 0.0
        for k in range(MOST_STEPS):
            self.product.multiply(loop.screws, t)
            self._fill(loop)
            if not self._solve(7):
                return False
            step = self._largest_step()
            if k == 0:
                self.first = step
            if not step < 1e6:
                return False
            share = min(1.0, LONGEST / step) if step > 0.0 else 1.0
            for j in range(6):
                for e in range(2):
                    t[2 * j + e] += share * self.J[2 * (WIDTH * j + 6) + e]
                # Ways have no cosines.
                if vectors.slides(loop.screws, j):
                    continue
                if abs(t[2 * j + 1]) > complex_numbers.FARTHEST:
                    return False
            if step < STANDS:
                return True
        return False

    def certify(self, loop: SixScrews, t: Numbers) -> bool:
        """
        Return whether there is one solution at t (6 pairs), and fill in how far there is no other.

        By the theorem of Newton and Kantorovich: beta is the norm of the inverse of J, and K
        bounds the change of J. Where a way is long, it is the unit of length. Far from real
        positions twists are large: there, where that is not enough, each is a unit of its own.
        """
        missed, growth = self.miss(loop, t), self._growth(loop)
        if not missed < min(MISSES * max(growth / 6.0, 1.0), FAR_OFF):
            return False
        self._fill(loop)
        unit = self._measure_by_ways(loop, t)
        turning, reaching, sizes, apart = 0.0, 0.0, 0.0, 0.0
        for j in range(6):
            axis, reach = 0.0, 0.0
            for i in range(3):
                axis += pairs.square_of(pairs.pair(self.axes, 3 * j + i))
                point = pairs.pair(self.points, 3 * j + i)
                arm = pairs.plus(pairs.pair(self.p, i), -1.0, point)
                reach += pairs.square_of(arm)
            size = 1.0 + math.sqrt(reach) / unit
            turning += axis
            reaching += axis * size * size
            self.sizes[j] = math.sqrt(axis) * size
            sizes += self.sizes[j]
            apart += 1.0 / (size * size)
        if not self._solve(WIDTH):
            return False
        off = ROUND_OFF * max(sizes, growth)
        if self._is_certain(math.sqrt(turning) * math.sqrt(reaching), off, False):
            return True
        # Each twist is one in units of itself.
        return growth > FAR and self._is_certain(math.sqrt(6.0 * apart), off, True)

    def _is_certain(self, bound: float, off: float, weighted: bool) -> bool:
        # Whether h is small enough, with the twists as units or not; fills weights and radius.
        step, inverse = 0.0, 0.0
        for j in range(6):
            row = arrays.after(self.J, 2 * WIDTH * j)
            self.weights[j] = self.sizes[j] if weighted else 1.0
            square = self.weights[j] * self.weights[j]
            step += square * (row[12] * row[12] + row[13] * row[13])
            for k in range(14, 2 * WIDTH):
                inverse += square * row[k] * row[k]
        beta = math.sqrt(inverse)
        way = math.sqrt(step) + beta * off
        self.radius = 1.0 / (beta * bound)
        return way * beta * bound < CERTAIN

    def _growth(self, loop: SixScrews) -> float:
        # By how much the product may enlarge the round-off of its factors, all added up: by the
        # norms of what is before and behind each, which are one where a position is real.
        growth = 0.0
        for k in range(6):
            square = 0.0
            for i in range(9):
                square += pairs.square_of(pairs.pair(self.product.frames, 9 * k + i))
            o = vectors.point_of(loop.screws, k)
            growth += square / 3.0 * (1.0 + math.sqrt(vectors.dot(o, o)))
        return growth

    def _measure_by_ways(self, loop: SixScrews, t: Numbers) -> float:
        # Makes the longest way the unit of length in J, and in what is left, unless it is shorter
        # than the present one: far away lengths are large and their inverses small.
        unit = 1.0
        for k in range(6):
            if vectors.slides(loop.screws, k):
                unit = max(unit, math.sqrt(pairs.square_of(pairs.pair(t, k))))
        for i in range(3):
            for k in range(7):
                if k == 6 or not vectors.slides(loop.screws, k):
                    at = 2 * (WIDTH * i + k)
                    self.J[at] /= unit
                    self.J[at + 1] /= unit
        return unit

    def miss(self, loop: SixScrews, t: Numbers) -> float:
        """Return by how much positions t (6 pairs) miss the goal: the largest difference."""
        self.product.multiply(loop.screws, t)
        missed: float = 0.0
        for i in range(3):
            missed = max(missed, abs(self.p[2 * i] - loop.goal[4 * i + 3]), abs(self.p[2 * i + 1]))
            for j in range(3):
                re = self.R[6 * i + 2 * j] - loop.goal[4 * i + j]
                missed = max(missed, abs(re), abs(self.R[6 * i + 2 * j + 1]))
        return missed

    def _fill(self, loop: SixScrews) -> None:
        # J, what is left, and the identity beside them.
        for k in range(6):
            slides = vectors.slides(loop.screws, k)
            for i in range(3):
                a, b = (i + 1) % 3, (i + 2) % 3
                z: Complex = pairs.pair(self.axes, 3 * k + i)
                linear: Complex = z
                if not slides:
                    linear = pairs.plus(self._moment(k, a, b), -1.0, self._moment(k, b, a))
                else:
                    z = (0.0, 0.0)
                pairs.put(self.J, WIDTH * i + k, linear)
                pairs.put(self.J, WIDTH * (3 + i) + k, z)
            for i in range(6):
                pairs.put(self.J, WIDTH * i + 7 + k, (1.0 if i == k else 0.0, 0.0))
        for i in range(3):
            goal = loop.goal
            left = (goal[4 * i + 3] - self.p[2 * i], -self.p[2 * i + 1])
            pairs.put(self.J, WIDTH * i + 6, left)
            a, b = (i + 2) % 3, (i + 1) % 3
            # Half of what is skew in goal R^T: the axis times the sine of what is left.
            re, im = 0.0, 0.0
            for m in range(3):
                re += goal[4 * a + m] * self.R[6 * b + 2 * m]
                re -= goal[4 * b + m] * self.R[6 * a + 2 * m]
                im += goal[4 * a + m] * self.R[6 * b + 2 * m + 1]
                im -= goal[4 * b + m] * self.R[6 * a + 2 * m + 1]
            pairs.put(self.J, WIDTH * (3 + i) + 6, (0.5 * re, 0.5 * im))

    def _moment(self, k: int, a: int, b: int) -> Complex:
        # One product of axis k with the way from its point to the end.
        way = pairs.plus(pairs.pair(self.p, b), -1.0, pairs.pair(self.points, 3 * k + b))
        return pairs.times(pairs.pair(self.axes, 3 * k + a), way)

    def _solve(self, width: int) -> bool:
        # Solves J x = each further column in its place, up to a width; False: J is singular.
        J = self.J
        for k in range(6):
            p, best = k, -1.0
            for i in range(k, 6):
                square = pairs.square_of(pairs.pair(J, WIDTH * i + k))
                if square > best:
                    best, p = square, i
            if not 0.0 < best < 1e300:
                return False
            row = arrays.after(J, 2 * WIDTH * k)
            if p != k:
                other = arrays.after(J, 2 * WIDTH * p)
                for j in range(2 * k, 2 * width):
                    row[j], other[j] = other[j], row[j]
            inverse = pairs.over((1.0, 0.0), pairs.pair(J, WIDTH * k + k))
            for i in range(k + 1, 6):
                share = pairs.times(pairs.pair(J, WIDTH * i + k), inverse)
                pairs.subtract(arrays.after(J, 2 * WIDTH * i), row, k + 1, width, share)
            for j in range(k + 1, width):
                at = WIDTH * k + j
                pairs.put(J, at, pairs.times(pairs.pair(J, at), inverse))
        for k in range(5, 0, -1):
            row = arrays.after(J, 2 * WIDTH * k)
            for i in range(k):
                share = pairs.pair(J, WIDTH * i + k)
                pairs.subtract(arrays.after(J, 2 * WIDTH * i), row, 6, width, share)
        return True

    def _largest_step(self) -> float:
        largest = 0.0
        for j in range(6):
            square = pairs.square_of(pairs.pair(self.J, WIDTH * j + 6))
            largest = max(largest, square)
        return math.sqrt(largest)
