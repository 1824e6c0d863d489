"""
A chart of the solutions next to one: a piece of their curve, and a tube that holds no other.

The joints, one more than equations, are complex. Near a solution the motions of all joints, u,
move the tool from the target by g(u). One joint, the parameter s, is given; A is the inverse of
the other columns of g's derivative, w the tangent and b the bend of the curve (A g'' w w = -b).
Krawczyk's operator u - A g(u) maps the ball of radius r about s w + s^2 b / 2 into itself, and
contracts it, for each complex s up to h: so each has exactly one solution in its ball. The second
derivative is computed; the third is bounded by the joints' twists, whose norms are the units of u.
"""

import math

from ..forward import vectors
from ..layout import arrays, places
from ..layout.arrays import Flat, Floats, Numbers
from ..six_joints import complex_numbers, pairs
from ..six_joints.complex_product import Product
from ..six_joints.pairs import Complex

# Round-off of a number of the equations, in units of the sum of the twists.
ROUND_OFF = 4e-15
# Newton's steps, and what is round-off after one.
MOST_STEPS, STANDS = 12, 1e-7
LONGEST = 0.5
# The radius of a tube, and the shortest piece, as a share of h |w| and in units of u.
RADIUS, SHORTEST = 0.1, 1e-12
# Where the sum of motions is less a rotation whose skew part vanishes is none, and the operator
# contracts by this share at least.
FARTHEST, CONTRACTS = 0.69, 0.9
SHRINK = 0.85
# Imaginary parts of angles that make rotations no larger by much.
NEARLY_REAL = 0.3
# Steps to a fold are no longer, in units of the parameter.
NEAR_FOLD = 0.1
ANY = -1


class CurveChart:
    """
    A chart of the solutions of an arm, at one of them.

    Parameters
    ----------
    screws : shape (n, 7)
        Each joint at rest: its axis, a point on it, 1 where it slides; at most one more than there
        are equations.
    motion : shape (4, 4)
        From rest to the target; of a position the translation alone counts.
    centre : shape (3,), m
        The point whose position counts where the rotation does not: the target's.
    whole
        Whether the rotation counts.
    length
        What a rad counts, m.

    Attributes
    ----------
    parameter
        The joint that is the parameter.
    h, r
        How far the chart reaches, in units of the parameter's motion, and the tube's radius.
    """

    def __init__(
        self, screws: Floats, motion: Floats, centre: Floats, whole: bool, length: float
    ) -> None:
        self.n, self.rows = arrays.extent(screws, 0), 6 if whole else 3
        if self.n != self.rows + 1:
            raise TypeError('a self-motion has one joint more than its target has rows')
        self.whole, self.length = whole, length
        self.width = self.n + 1 + self.rows
        self.screws, self.given = arrays.numbers(screws, 7 * self.n), arrays.numbers(centre, 3)
        self.motion = arrays.numbers(motion, 16)
        self.product = Product(self.n)
        n = self.n
        self.t, self.linear, self.angular, self.sizes = arrays.rooms(2 * n, 6 * n, 6 * n, n)
        self.W, self.w, self.b, self.c = arrays.rooms(12 * self.width, 2 * n, 2 * n, 2 * n)
        self.predicted, self.kept, self.turning = arrays.rooms(2 * n, n, 12 * n)
        self.column, self.series, self.centre = arrays.rooms(12, 48, 6)
        self.order, self.used = arrays.whole_rooms(6, n)
        self.parameter, self.frame, self.h, self.r = 0, 0, 0.0, 0.0
        self.inverse, self.second, self.turned = 0.0, 0.0, 0.0
        self.along, self.bending, self.cubic, self.left = 0.0, 0.0, 0.0, 0.0

    def require(self, joint: int) -> None:
        """Raise TypeError if there is no such joint."""
        if not 0 <= joint < self.n:
            raise TypeError('an arm has no such joint')

    def stand_at(self, positions: Flat) -> None:
        """Take positions (n pairs) for t."""
        arrays.copy(self.t, 2 * self.n, positions)

    def write_place(self, positions: Numbers) -> None:
        """Write t (n pairs)."""
        arrays.copy(positions, 2 * self.n, self.t)

    def improve(self, parameter: int) -> bool:
        """
        Move t to a solution, the parameter held; return whether the steps ended at one.

        `ANY`: the joint that moves most is held in each step.
        """
        for _ in range(MOST_STEPS):
            self._linearise()
            if not self._solve(parameter, self.n + 1):
                return False
            square = 0.0
            for i in range(self.rows):
                square += pairs.square_of(pairs.pair(self.W, self.width * i + self.n))
            step = math.sqrt(square)
            if not step < 1e6:
                return False
            share = min(1.0, LONGEST / step) if step > 0.0 else 1.0
            for i in range(self.rows):
                j = self.order[i]
                way = pairs.pair(self.W, self.width * i + self.n)
                self._move(j, -share * way[0], -share * way[1])
                if abs(self.t[2 * j + 1]) > complex_numbers.FARTHEST:
                    return False
            if step < STANDS:
                return True
        return False

    def open(self, parameter: int, radius: float) -> bool:
        """Chart the solutions next to t; return False where that is singular."""
        self._linearise()
        if not self._solve(parameter, self.width):
            return False
        self._differentiate()
        return self._reach(radius)

    def bend_further(self, radius: float) -> bool:
        """Give an open chart its path's third derivative, too: a narrower tube."""
        self._write_third()
        return self._reach(radius)

    def follow(self, s: Complex) -> bool:
        """Move t along the curve to s of the parameter; return whether it ended in the tube."""
        for j in range(self.n):
            # The units stay those of the chart until the end is known.
            self.kept[j] = self.sizes[j]
            way = self.path(s, j)
            self._move(j, way[0], way[1])
            pairs.put(self.predicted, j, pairs.pair(self.t, j))
        if not self.improve(self.parameter):
            return False
        away = 0.0
        for j in range(self.n):
            for e in range(2):
                way_of = self.kept[j] * (self.t[2 * j + e] - self.predicted[2 * j + e])
                away += way_of * way_of
        return math.sqrt(away) <= self.r

    def move_to_fold(self, joint: int) -> bool:
        """Move t to where a joint is at an end of its range; return whether the steps ended."""
        for _ in range(2 * MOST_STEPS):
            if not self.open(ANY, RADIUS) or self.parameter == joint:
                return False
            w, b = pairs.pair(self.w, joint), pairs.pair(self.b, joint)
            if not pairs.square_of(b) > 1e-24:
                return False
            s = pairs.over((-w[0], -w[1]), b)
            size = math.sqrt(pairs.square_of(s))
            share = min(1.0, NEAR_FOLD / size) if size > 0.0 else 1.0
            self.follow((share * s[0], share * s[1]))
            if size < STANDS:
                return True
        return False

    def holds(self, other: Numbers, share: float) -> bool:
        """
        Return whether a solution (n pairs) is on this chart's curve, up to a share of h.

        Full turns of joints that turn do not count.
        """
        j = self.parameter
        s: Complex = self._away(other, j)
        if not math.sqrt(pairs.square_of(s)) <= share * self.h:
            return False
        square = 0.0
        for j in range(self.n):
            way = pairs.plus(self._away(other, j), -1.0, self.path(s, j))
            square += pairs.square_of(way)
        return math.sqrt(square) <= self.r

    def path(self, s: Complex, j: int) -> Complex:
        """Return how far joint j is along the middle of the tube, in units of u."""
        way = pairs.plus(pairs.pair(self.b, j), 1.0 / 3.0, pairs.times(s, pairs.pair(self.c, j)))
        way = pairs.plus(pairs.pair(self.w, j), 0.5, pairs.times(s, way))
        return pairs.times(s, way)

    def along_parameter(self, other: Numbers) -> float:
        """Return where a solution (n pairs) is along the parameter, its real part."""
        way = self._away(other, self.parameter)
        return way[0]

    def _away(self, other: Numbers, j: int) -> Complex:
        re, im = other[2 * j] - self.t[2 * j], other[2 * j + 1] - self.t[2 * j + 1]
        if not vectors.slides(self.screws, j):
            re -= places.TAU * math.floor(re / places.TAU + 0.5)
        return (self.sizes[j] * re, self.sizes[j] * im)

    def _move(self, j: int, re: float, im: float) -> None:
        # Moves joint j by so much in units of u.
        self.t[2 * j] += re / self.sizes[j]
        self.t[2 * j + 1] += im / self.sizes[j]

    def _linearise(self) -> None:
        # Twists and their sizes at t, and in W the columns in units of u, what is left, identity.
        n, width = self.n, self.width
        self.product.multiply(self.screws, self.t)
        axes, points, z = self.product.axes, self.product.points, self.series
        self._choose_centre()
        self._choose_frame()
        for k in range(n):
            linear, angular = arrays.after(self.linear, 6 * k), arrays.after(self.angular, 6 * k)
            slides = vectors.slides(self.screws, k)
            for i in range(3):
                pairs.put(z, i, pairs.pair(axes, 3 * k + i))
                o = pairs.pair(points, 3 * k + i)
                pairs.put(z, 3 + i, pairs.plus(pairs.pair(self.centre, i), -1.0, o))
            if slides:
                self._turn_back(z, 1.0 / self.length, linear)
            else:
                pairs.write_cross(z, arrays.after(z, 6), arrays.after(z, 12))
                self._turn_back(arrays.after(z, 12), 1.0 / self.length, linear)
            self._turn_back(z, 0.0 if slides else 1.0, angular)
            square = 0.0
            for i in range(6):
                square += linear[i] * linear[i] + angular[i] * angular[i]
            size = max(math.sqrt(square), 1e-300)
            self.sizes[k] = size
            for i in range(self.rows):
                v = pairs.pair(linear if i < 3 else angular, i % 3)
                pairs.put(self.W, width * i + k, (v[0] / size, v[1] / size))
        self._write_left()
        for i in range(self.rows):
            for k in range(self.rows):
                one = 1.0 if i == k else 0.0
                pairs.put(self.W, width * i + n + 1 + k, (one, 0.0))

    def _choose_centre(self) -> None:
        # Of a pose any point at the target will do: the middle of the arm is near to all axes.
        for i in range(3):
            middle = (self.given[i], 0.0)
            if self.whole:
                middle = (0.0, 0.0)
                for k in range(self.n):
                    o = pairs.pair(self.product.points, 3 * k + i)
                    middle = pairs.plus(middle, 1.0 / self.n, o)
            pairs.put(self.centre, i, middle)

    def _choose_frame(self) -> None:
        # Far from real positions rotations are large: the frame of the joint in which the axes
        # are least, by their product: one of them is large in any. Real ones are of unit length
        # in each.
        self.frame = 0
        axes = self.product.axes
        best: float = places.INFINITY
        imaginary: float = 0.0
        for j in range(self.n):
            imaginary = max(imaginary, abs(self.t[2 * j + 1]))
        if imaginary < NEARLY_REAL:
            return
        for k in range(self.n):
            frame, logarithms = arrays.after(self.product.frames, 18 * k), 0.0
            for j in range(self.n):
                square = 0.0
                for i in range(3):
                    total = (0.0, 0.0)
                    for m in range(3):
                        way = pairs.times(
                            pairs.pair(frame, 3 * m + i), pairs.pair(axes, 3 * j + m)
                        )
                        total = pairs.plus(total, 1.0, way)
                    square += pairs.square_of(total)
                logarithms += math.log(square)
            if logarithms < best:
                best, self.frame = logarithms, k

    def _turn_back(self, v: Flat, share: float, turned: Flat) -> None:
        frame = arrays.after(self.product.frames, 18 * self.frame)
        for i in range(3):
            total = (0.0, 0.0)
            for k in range(3):
                way = pairs.times(pairs.pair(frame, 3 * k + i), pairs.pair(v, k))
                total = pairs.plus(total, share, way)
            pairs.put(turned, i, total)

    def _write_left(self) -> None:
        # By how much the centre, and the half of what is skew in R goal^T, miss the target.
        R, goal, n, width = self.product.R, self.motion, self.n, self.width
        back, left = self.series, arrays.after(self.series, 6)
        turned = arrays.after(self.series, 12)
        for i in range(3):
            total = (0.0, 0.0)
            for m in range(3):
                c = pairs.pair(self.centre, m)
                total = pairs.plus(total, goal[4 * m + i], (c[0] - goal[4 * m + 3], c[1]))
            pairs.put(back, i, total)
        for i in range(3):
            total = pairs.plus(pairs.pair(self.product.p, i), -1.0, pairs.pair(self.centre, i))
            for m in range(3):
                way = pairs.times(pairs.pair(R, 3 * i + m), pairs.pair(back, m))
                total = pairs.plus(total, 1.0, way)
            pairs.put(left, i, total)
        self._turn_back(left, 1.0 / self.length, turned)
        for i in range(3):
            pairs.put(self.W, width * i + n, pairs.pair(turned, i))
        if not self.whole:
            return
        for i in range(3):
            a, b = (i + 1) % 3, (i + 2) % 3
            total = (0.0, 0.0)
            for m in range(3):
                # Entry (b, a) less (a, b).
                total = pairs.plus(total, 0.5 * goal[4 * a + m], pairs.pair(R, 3 * b + m))
                total = pairs.plus(total, -0.5 * goal[4 * b + m], pairs.pair(R, 3 * a + m))
            pairs.put(left, i, total)
        self._turn_back(left, 1.0, turned)
        for i in range(3):
            pairs.put(self.W, width * (3 + i) + n, pairs.pair(turned, i))

    def _solve(self, parameter: int, width: int) -> bool:
        # Gauss and Jordan with complete pivoting: `order` says which joint each row gives, the one
        # that is left is the parameter.
        rows, n, wide = self.rows, self.n, self.width
        W, order = self.W, self.order
        for j in range(n):
            self.used[j] = 1 if j == parameter else 0
        for k in range(rows):
            row, q, best = k, 0, 0.0
            for i in range(k, rows):
                for j in range(n):
                    square = pairs.square_of(pairs.pair(W, wide * i + j))
                    if self.used[j] == 0 and square > best:
                        best, row, q = square, i, j
            if not 1e-30 < best < 1e300:
                return False
            self.used[q], order[k] = 1, q
            self._exchange(row, k, width)
            pivot = arrays.after(W, 2 * wide * k)
            inverse = pairs.over((1.0, 0.0), pairs.pair(W, wide * k + q))
            for j in range(width):
                pairs.put(W, wide * k + j, pairs.times(pairs.pair(W, wide * k + j), inverse))
            for i in range(rows):
                if i != k:
                    share = pairs.pair(W, wide * i + q)
                    pairs.subtract(arrays.after(W, 2 * wide * i), pivot, 0, width, share)
        for j in range(n):
            if self.used[j] == 0:
                self.parameter = j
        if parameter >= 0:
            self.parameter = parameter
        return True

    def _exchange(self, i: int, k: int, width: int) -> None:
        one = arrays.after(self.W, 2 * self.width * i)
        other = arrays.after(self.W, 2 * self.width * k)
        for j in range(2 * width):
            one[j], other[j] = other[j], one[j]

    def _differentiate(self) -> None:
        # Tangent, bend, and the norms that the chart's reach follows from.
        n, rows, width, W = self.n, self.rows, self.width, self.W
        arrays.fill(self.w, 2 * n, 0.0)
        arrays.fill(self.b, 2 * n, 0.0)
        arrays.fill(self.c, 2 * n, 0.0)
        self.w[2 * self.parameter] = 1.0
        left, inverse, sizes = 0.0, 0.0, 0.0
        for i in range(rows):
            v = pairs.pair(W, width * i + self.parameter)
            pairs.put(self.w, self.order[i], (-v[0], -v[1]))
            left += pairs.square_of(pairs.pair(W, width * i + n))
            for k in range(rows):
                inverse += pairs.square_of(pairs.pair(W, width * i + n + 1 + k))
        second, turning = 0.0, 0.0
        arrays.fill(self.turning, 12 * n, 0.0)
        for k in range(n):
            sizes += self.sizes[k]
            for j in range(k + 1):
                second += self._second_of(j, k)
        for k in range(n):
            # Only the joints that are not given are solved for.
            if k != self.parameter:
                for i in range(rows):
                    turning += pairs.square_of(pairs.pair(self.turning, 6 * k + i))
        self.inverse, self.second = math.sqrt(inverse), math.sqrt(second)
        self.turned = math.sqrt(turning)
        self.left = math.sqrt(left) + self.inverse * ROUND_OFF * sizes
        along, bending = 0.0, 0.0
        for j in range(n):
            along += pairs.square_of(pairs.pair(self.w, j))
            bending += pairs.square_of(pairs.pair(self.b, j))
        self.along, self.bending, self.cubic = math.sqrt(along), math.sqrt(bending), 0.0

    def _second_of(self, j: int, k: int) -> float:
        # Adds what joints j <= k bend to b, and returns the square of A g''_jk, counted twice
        # where they differ: screw j moves the velocity that k gives.
        share = 1.0 / (self.sizes[j] * self.sizes[k])
        w = arrays.after(self.angular, 6 * j)
        self._write_cross(w, arrays.after(self.linear, 6 * k), 0, share)
        if self.whole:
            self._write_cross(w, arrays.after(self.angular, 6 * k), 3, 0.5 * share)
        times = 1.0 if j == k else 2.0
        both = pairs.times(pairs.pair(self.w, j), pairs.pair(self.w, k))
        square = 0.0
        for i in range(self.rows):
            re, im = 0.0, 0.0
            row = arrays.after(self.W, 2 * (self.width * i + self.n + 1))
            for m in range(self.rows):
                x, y, u, v = row[2 * m], row[2 * m + 1], self.column[2 * m], self.column[2 * m + 1]
                re += x * u - y * v
                im += x * v + y * u
            square += re * re + im * im
            at = self.order[i]
            bend = pairs.times(both, (re, im))
            self._add_turning(j, i, pairs.times(pairs.pair(self.w, k), (re, im)))
            if j != k:
                self._add_turning(k, i, pairs.times(pairs.pair(self.w, j), (re, im)))
            pairs.put(self.b, at, pairs.plus(pairs.pair(self.b, at), -times, bend))
        return times * square

    def _add_turning(self, j: int, i: int, way: Complex) -> None:
        # Along the tangent, column j of A g' changes by so much in row i.
        at = 6 * j + i
        pairs.put(self.turning, at, pairs.plus(pairs.pair(self.turning, at), 1.0, way))

    def _write_cross(self, a: Flat, b: Flat, at: int, share: float) -> None:
        cross = arrays.after(self.column, 2 * at)
        pairs.write_cross(a, b, cross)
        for i in range(6):
            cross[i] *= share

    def _reach(self, radius: float) -> bool:
        # The largest h, up to a factor, for which Krawczyk's operator is proved to contract.
        h = CONTRACTS / max(self.turned + self.second * radius * self.along, self.along)
        while h * self.along > SHORTEST:
            self.h, self.r = h, radius * h * self.along
            if self._contracts():
                return True
            h *= SHRINK
        return False

    def _contracts(self) -> bool:
        h, root = self.h, math.sqrt(float(self.n))
        one, two = h * self.along, 0.5 * h * h * self.bending
        three = h * h * h * self.cubic / 6.0
        path = one + two + three
        far = path + self.r
        if root * far > FARTHEST:
            return False
        # A bound of g's third derivative, by the norms of products of the twists.
        third = self.inverse * math.sqrt(2.0) * root * root * root * math.exp(root * far)
        share = self.turned * h + self.second * (two + three + self.r) + 0.5 * third * far * far
        if share > CONTRACTS:
            return False
        left = self.left
        if self.cubic == 0.0:
            left += self.second * two * (one + 0.5 * two) + third * path * path * path / 6.0
        else:
            fourth = _of_fourth_order(root * one, root * two, root * three)
            left += math.sqrt(2.0) * self.inverse * fourth
        return left <= (1.0 - share) * self.r

    def _write_third(self) -> None:
        # The third derivative of the path: what is left of third order along w s + b s^2 / 2.
        n, x = self.n, self.series
        for of in range(4 if self.whole else 1):
            arrays.fill(x, 24, 0.0)
            if of > 0:
                x[2 * (of - 1)] = 1.0
            for i in range(n):
                self._move_series(n - 1 - i, of == 0)
            for i in range(3):
                if of == 0:
                    pairs.put(self.column, i, pairs.pair(x, 9 + i))
                    pairs.put(self.column, 3 + i, (0.0, 0.0))
                else:
                    # Column k of the rotation: half of what is skew in it.
                    k = of - 1
                    if i != k:
                        sign = 0.5 if (k + 1) % 3 == i else -0.5
                        to = 3 + 3 - i - k
                        way = pairs.plus(pairs.pair(self.column, to), sign, pairs.pair(x, 9 + i))
                        pairs.put(self.column, to, way)
        square = 0.0
        for i in range(self.rows):
            way = (0.0, 0.0)
            for m in range(self.rows):
                a = pairs.pair(self.W, self.width * i + self.n + 1 + m)
                way = pairs.plus(way, -6.0, pairs.times(a, pairs.pair(self.column, m)))
            pairs.put(self.c, self.order[i], way)
            square += pairs.square_of(way)
        self.cubic = math.sqrt(square)

    def _move_series(self, j: int, is_point: bool) -> None:
        # Moves a point or a vector, a power series in s up to s^3, by screw j, which moves by the
        # path w s + b s^2 / 2: exp(p S) = 1 + p S + p^2 S^2 / 2 + p^3 S^3 / 6.
        x, size = self.series, 1.0 / self.sizes[j]
        w, b = pairs.pair(self.w, j), pairs.pair(self.b, j)
        p, q = (size * w[0], size * w[1]), (0.5 * size * b[0], 0.5 * size * b[1])
        square = pairs.times(p, p)
        axis = arrays.after(self.angular, 6 * j)
        y, z = arrays.after(x, 24), arrays.after(x, 30)
        # S^2 and S of the coefficients of s and s^2.
        pairs.write_cross(axis, arrays.after(x, 12), y)
        _add_share(x, 9, p, y)
        pairs.write_cross(axis, arrays.after(x, 6), y)
        _add_share(x, 9, q, y)
        _add_share(x, 6, p, y)
        pairs.write_cross(axis, y, z)
        _add_share(x, 9, (0.5 * square[0], 0.5 * square[1]), z)
        # Of the constant one.
        if is_point:
            arrays.copy(y, 6, arrays.after(self.linear, 6 * j))
        else:
            pairs.write_cross(axis, x, y)
        _add_share(x, 3, p, y)
        _add_share(x, 6, q, y)
        pairs.write_cross(axis, y, z)
        _add_share(x, 6, (0.5 * square[0], 0.5 * square[1]), z)
        _add_share(x, 9, pairs.times(p, q), z)
        pairs.write_cross(axis, z, y)
        cube = pairs.times(square, p)
        _add_share(x, 9, (cube[0] / 6.0, cube[1] / 6.0), y)


def _add_share(x: Flat, at: int, share: Complex, v: Flat) -> None:
    for i in range(3):
        way = pairs.times(share, pairs.pair(v, i))
        pairs.put(x, at + i, pairs.plus(pairs.pair(x, at + i), 1.0, way))


def _of_fourth_order(one: float, two: float, three: float) -> float:
    # exp(one s + two s^2 + three s^3) at s = 1 without the terms up to s^3: what bounds those of
    # the product of the screws.
    total = one + two + three
    rest = total * total * total * total * math.exp(total) / 24.0
    rest += one * three + 0.5 * two * two + two * three + 0.5 * three * three
    return rest + (total * total * total - one * one * one) / 6.0
