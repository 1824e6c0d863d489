"""
Six joints of which two or three slide: equations in the joints that turn, y and z the last two.

Let joints before y turn its axis by R, and let the goal be the rotation G. Since y does not turn
its own axis, nor z, R y . G z = y . z. Three joints turn: R is that of the first one, and its
angle has two roots.

Four: R = A B. Slides move the tool in a plane only, whose normal is n = s x u: s is the direction
of the first one, u that of the second one as A and B have turned it. What the turning joints leave
of the way to the goal is in this plane. Its last part is the common perpendicular of y and z,
along R y x G z, and n . (R y x G z) = (s . R y)(G z . u) - (s . G z)(u . R y). By the first
equation (s . R y)(G z . u) = (y . z)(s . u) + (s x G z) . (R y x u), so that there are no products
but those of 1, cos, sin of A with those of B, in both equations. For an angle of one of these
joints both are linear in (1, cos, sin) of the other, which is V = E x F of their coefficients E
and F, up to a factor: V1^2 + V2^2 = V0^2, a trigonometric polynomial of degree 4. It has eight
roots; so no target has more than eight isolated solutions. (Where several share a root, there are
as many on an arm beside this one, each with a root of its own.)
"""

import math

from ..forward import vectors
from ..layout import arrays, places
from ..layout.arrays import Numbers, Vector
from . import complex_motion, complex_numbers, lines, pairs, polynomials
from .complex_motion import Motion
from .pairs import Complex
from .six_screws import SixScrews

SAMPLES, TINY = 16, 1e-300
ROUND_OFF, ROOT_THIRD = 1e-15, math.sqrt(1.0 / 3.0)
# Directions are across an axis, or parallel, to this share.
ACROSS = 1e-12


def _mean(p: int, turn: int) -> float:
    # What a value at so many thirds of a turn counts in the coefficient of 1, cos, or sin.
    if p == 0:
        return 1.0 / 3.0
    if p == 1:
        return 2.0 / 3.0 if turn == 0 else -1.0 / 3.0
    return 0.0 if turn == 0 else ROOT_THIRD if turn == 1 else -ROOT_THIRD


def _dot(a: Numbers, b: Numbers) -> Complex:
    value = pairs.times(pairs.pair(a, 0), pairs.pair(b, 0))
    value = pairs.plus(value, 1.0, pairs.times(pairs.pair(a, 1), pairs.pair(b, 1)))
    return pairs.plus(value, 1.0, pairs.times(pairs.pair(a, 2), pairs.pair(b, 2)))


def _at(table: Numbers, c: float, s: float) -> Vector:
    # The coefficients of the other joint at an angle of the hidden one.
    v = vectors.plus(vectors.three(table, 0), c, vectors.three(table, 3))
    return vectors.plus(v, s, vectors.three(table, 6))


class SphericalLinkage:
    """
    Room for the equations of the turning joints of a loop.

    Attributes
    ----------
    hidden
        Which joint of the loop the polynomial is of.
    degree
        Of the polynomial, 0 where the loop begins with another joint than a slide, where the
        second slide has more than two turning joints before it, or the last axes are parallel.
    coefficients : shape (5,)
        Complex, of e^(i k t); those of -k are conjugate.
    noise
        Round-off, as a share of the polynomial's largest value.
    """

    def __init__(self) -> None:
        (self.order,) = arrays.whole_rooms(6)
        self.way, self.E, self.F = arrays.rooms(9, 9, 9)
        self.circle, self.values, self.coefficients = arrays.rooms(2 * SAMPLES, SAMPLES, 10)
        self.vector, self.turn, self.columns = arrays.rooms(6, 4, 24)
        self.turning, self.second, self.before = 0, 0, 0
        self.hidden, self.other, self.degree = 0, 0, 0
        self.across, self.bent, self.reach, self.noise = False, 0.0, 0.0, 1.0

    def build(self, loop: SixScrews, swapped: bool) -> None:
        """Fill in the polynomial; `swapped`: of the second turning joint, not of the first."""
        self.degree, self.noise = 0, 1.0
        self._sort(loop)
        self.hidden, self.other = self.order[0], self.order[1]
        if self.turning == 3:
            self._write_tables(loop, False)
            self._sample(1)
            return
        if not vectors.slides(loop.screws, 0) or self.before > 2 or self.turning != 4:
            return
        if not self._write_way(loop):
            return
        if swapped:
            self.hidden, self.other = self.order[1], self.order[0]
        self._write_tables(loop, swapped)
        self._sample(4)

    def _sort(self, loop: SixScrews) -> None:
        # The turning joints in `order`, the others behind them.
        self.turning = 0
        for k in range(6):
            if not vectors.slides(loop.screws, k):
                self.order[self.turning] = k
                self.turning += 1
        place = self.turning
        for k in range(6):
            if vectors.slides(loop.screws, k):
                self.order[place] = k
                place += 1
        self.second = self.order[5]
        # How many turning joints carry the second slide.
        self.before = self.second - 1

    def _write_way(self, loop: SixScrews) -> bool:
        # What A, and A and B, carry of the way, and what the base does.
        screws, order = loop.screws, self.order
        first, last = vectors.axis_of(screws, order[0]), vectors.axis_of(screws, order[3])
        axis = vectors.axis_of(screws, order[2])
        foot, end = vectors.point_of(screws, order[2]), vectors.point_of(screws, order[3])
        normal = vectors.cross(axis, last)
        square = vectors.dot(normal, normal)
        if square < ACROSS * ACROSS:
            return False
        between = vectors.plus(end, -1.0, foot)
        share = vectors.dot(vectors.cross(between, last), normal) / square
        foot = vectors.plus(foot, share, axis)
        share = vectors.dot(vectors.cross(between, axis), normal) / square
        end = vectors.plus(end, share, last)
        self.bent = vectors.dot(between, normal) / square
        a, b = vectors.point_of(screws, order[0]), vectors.point_of(screws, order[1])
        carried, twice = vectors.plus(b, -1.0, a), vectors.plus(foot, -1.0, b)
        tool = (loop.goal[3], loop.goal[7], loop.goal[11])
        left = vectors.plus(tool, -1.0, a)
        left = vectors.plus(left, 1.0, vectors.times_vector(loop.goal, end))
        lines.put(self.way, 0, left)
        lines.put(self.way, 3, carried)
        lines.put(self.way, 6, twice)
        self.reach = math.sqrt(vectors.dot(left, left)) + math.sqrt(vectors.dot(end, end))
        self.reach += math.sqrt(vectors.dot(carried, carried))
        self.reach += math.sqrt(vectors.dot(twice, twice)) + 3.0 * abs(self.bent)
        self.reach += math.sqrt(vectors.dot(between, between) / square)
        # Slides across joint A, on either side of it, span the plane across it at every angle.
        slide, other = vectors.axis_of(screws, 0), vectors.axis_of(screws, self.second)
        self.across = self.before == 1 and abs(vectors.dot(slide, first)) < ACROSS
        self.across = self.across and abs(vectors.dot(other, first)) < ACROSS
        return True

    def _write_tables(self, loop: SixScrews, swapped: bool) -> None:
        # Coefficients of the products of parts: those of the joint that is hidden first.
        for k in range(9):
            self.E[k], self.F[k] = 0.0, 0.0
        for i in range(3):
            for j in range(3):
                self._evaluate(loop, places.TAU * i / 3.0, places.TAU * j / 3.0)
                for p in range(3):
                    for q in range(3):
                        share = _mean(p, i) * _mean(q, j)
                        at = 3 * q + p if swapped else 3 * p + q
                        self.E[at] += share * self.vector[0]
                        self.F[at] += share * self.vector[1]

    def _evaluate(self, loop: SixScrews, alpha: float, beta: float) -> None:
        # Both equations at angles of the first two turning joints.
        screws, order = loop.screws, self.order
        y = vectors.axis_of(screws, order[self.turning - 2])
        z = vectors.axis_of(screws, order[self.turning - 1])
        goal, still = vectors.times_vector(loop.goal, z), vectors.dot(y, z)
        a, b = vectors.axis_of(screws, order[0]), vectors.axis_of(screws, order[1])
        if self.turning == 3:
            self.vector[0] = vectors.dot(vectors.turned(a, alpha, y), goal) - still
            return
        y = vectors.turned(a, alpha, vectors.turned(b, beta, y))
        self.vector[0] = vectors.dot(y, goal) - still
        way = vectors.three(self.way, 0)
        way = vectors.plus(way, -1.0, vectors.turned(a, alpha, vectors.three(self.way, 3)))
        carried = vectors.turned(b, beta, vectors.three(self.way, 6))
        way = vectors.plus(way, -1.0, vectors.turned(a, alpha, carried))
        if self.across:
            last = vectors.dot(a, vectors.cross(y, goal))
            self.vector[1] = vectors.dot(a, way) - self.bent * last
            return
        slide, x = vectors.axis_of(screws, 0), vectors.axis_of(screws, self.second)
        if self.before == 2:
            x = vectors.turned(b, beta, x)
        if self.before > 0:
            x = vectors.turned(a, alpha, x)
        last = still * vectors.dot(slide, x) - vectors.dot(slide, goal) * vectors.dot(x, y)
        last += vectors.dot(vectors.cross(slide, goal), vectors.cross(y, x))
        self.vector[1] = vectors.dot(vectors.cross(slide, x), way) - self.bent * last

    def _sample(self, degree: int) -> None:
        E, F, largest, steepest = self.E, self.F, 0.0, 0.0
        polynomials.write_circle(SAMPLES, self.circle)
        for n in range(SAMPLES):
            c, s = self.circle[2 * n], self.circle[2 * n + 1]
            if degree == 1:
                self.values[n] = E[0] + c * E[3] + s * E[6]
            else:
                v = vectors.cross(_at(E, c, s), _at(F, c, s))
                self.values[n] = v[1] * v[1] + v[2] * v[2] - v[0] * v[0]
                steepest = max(steepest, vectors.dot(v, v))
            largest = max(largest, abs(self.values[n]))
        if not TINY < largest < 1.0 / TINY:
            return
        self.degree = degree
        self.noise = polynomials.write_coefficients(
            self.values, SAMPLES, self.circle, largest, degree, self.coefficients
        )
        # Errors of the equations do not show beyond the degree.
        moved = 1.0 if degree == 1 else self.reach * math.sqrt(steepest)
        self.noise = max(self.noise, ROUND_OFF * moved / largest)

    def write_positions(self, loop: SixScrews, motion: Motion, z: Complex, t: Numbers) -> bool:
        """Write the positions t (6 pairs) of a root z = e^(i t); return whether there are any."""
        arrays.fill(t, 12, 0.0)
        pairs.put(t, self.hidden, complex_numbers.angle_of(z))
        if not complex_numbers.is_near(pairs.pair(t, self.hidden)):
            return False
        if self.turning == 4 and not self._write_other(t):
            return False
        for k in range(self.turning - 2, self.turning):
            joint = self.order[k]
            # The axis of the next one, which turns it no more.
            v = vectors.across(vectors.axis_of(loop.screws, joint))
            if k + 1 < self.turning:
                v = vectors.axis_of(loop.screws, self.order[k + 1])
            angle = complex_motion.angle_left(loop, t, joint, v, self.vector, self.turn)
            if not complex_numbers.is_near(angle):
                return False
            pairs.put(t, joint, angle)
        return self._write_ways(loop, motion, t)

    def _write_other(self, t: Numbers) -> bool:
        # The joint that both equations are linear in: V is proportional to 1, cos and sin.
        turn, C = self.turn, self.columns
        complex_numbers.write_turn(pairs.pair(t, self.hidden), turn)
        for k in range(3):
            for e in range(2):
                C[2 * k + e] = turn[e] * self.E[3 + k] + turn[2 + e] * self.E[6 + k]
                C[6 + 2 * k + e] = turn[e] * self.F[3 + k] + turn[2 + e] * self.F[6 + k]
            C[2 * k] += self.E[k]
            C[6 + 2 * k] += self.F[k]
        V = arrays.after(C, 12)
        pairs.write_cross(C, arrays.after(C, 6), V)
        first, unit = pairs.pair(V, 0), (V[2] - V[5], V[3] + V[4])
        if pairs.square_of(first) == 0.0:
            return False
        angle = complex_numbers.angle_of(pairs.over(unit, first))
        pairs.put(t, self.other, angle)
        return complex_numbers.is_near(angle)

    def _write_ways(self, loop: SixScrews, motion: Motion, t: Numbers) -> bool:
        # With the angles known, what is left of the way is linear in those of the slides.
        motion.miss(loop, t)
        left, M, C = self.columns, arrays.after(self.columns, 6), self.vector
        for i in range(3):
            p = pairs.pair(motion.p, i)
            pairs.put(left, i, (loop.goal[4 * i + 3] - p[0], -p[1]))
            for k in range(6 - self.turning):
                axis = pairs.pair(motion.axes, 3 * self.order[self.turning + k] + i)
                pairs.put(M, 3 * k + i, axis)
        if self.turning == 4:
            # Nothing is left along the normal of two; its conjugate is never in their plane.
            normal = arrays.after(M, 12)
            pairs.write_cross(M, arrays.after(M, 6), normal)
            for i in range(3):
                normal[2 * i + 1] = -normal[2 * i + 1]
        for k in range(6 - self.turning):
            pairs.write_cross(
                arrays.after(M, 6 * ((k + 1) % 3)), arrays.after(M, 6 * ((k + 2) % 3)), C
            )
            under = _dot(arrays.after(M, 6 * k), C)
            if pairs.square_of(under) < TINY:
                return False
            way = pairs.over(_dot(left, C), under)
            pairs.put(t, self.order[self.turning + k], way)
        return True
