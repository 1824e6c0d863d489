# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Solve the inverse kinematics of six joints, two or three of which are prismatic. The method is a
resultant in the angle of one joint.

Let y and z be the directions of the axes of the last two revolute joints at rest, and G the
rotation of the goal. Let R be the rotation by the revolute joints before these two. The first
equation is R y . G z = y . z, because the last two revolute joints do not change the angle between
their axes.

If three joints are revolute, R is the rotation by the first of them, and the first equation has
two roots.

If four joints are revolute, let A and B be the rotations by the first two of them, so R = A B. Let
s be the direction of the first prismatic joint. Let u be the direction of the second prismatic
joint, turned by the revolute joints before it. The prismatic joints move the tool in a plane with
the normal n = s x u. Let the revolute joints move the tool and the prismatic joints stay at 0.
Then the vector from the tool to the goal must lie in this plane, which is the second equation.

Both equations become linear in nine products: (1, cos, sin) of the angle of A times (1, cos, sin)
of the angle of B. Only one term of the second equation must be rewritten for this. The vector from
the tool to the goal has a component along R y x G z, the common perpendicular of the last two
revolute axes. So the second equation contains n . (R y x G z), where n = s x u. The identity

    (a x b) . (c x d) = (a . c)(b . d) - (a . d)(b . c)

turns this term into (s . R y)(u . G z) - (s . G z)(u . R y). The first product may be quadratic in
the cosine and sine of A, because R y contains A, and u may contain A. If the identity is applied
to other vectors, it gives

    (s . R y)(u . G z) = (s x G z) . (R y x u) + (s . u)(R y . G z).

The first equation replaces R y . G z by the constant y . z. Each term then contains A and B at
most once. For example, if u is a direction w turned by A, then R y x u = A (B y x w).

The two equations contain only the first two revolute joints. One of these two joints is called
hidden, and the resultant is a polynomial in its angle. Let t be the angle of the joint that is not
hidden. At a given angle of the hidden joint, the two equations are linear in the vector v =
(1, cos t, sin t). The coefficients of the first equation are a vector E, those of the second a
vector F. So v is perpendicular to E and F, and proportional to V = E x F. The identity cos^2 +
sin^2 = 1 becomes the resultant V1^2 + V2^2 = V0^2, a trigonometric polynomial of degree 4. So a
target has at most eight isolated solutions. If several solutions share a root, this bound holds,
too: after a slight change of the arm's parameters, each of the solutions has its own root.
"""

import math

from ..forward import vectors
from ..layout import arrays, places
from ..layout.arrays import Numbers, Vector
from . import complex_motion, complex_numbers, lines, pairs, polynomials
from .complex_motion import Motion
from .pairs import Complex
from .six_screws import SixScrews

# Number of samples to interpolate the resultant, a trigonometric polynomial. If its degree is 4,
# it has nine coefficients, for the harmonics -4 to 4. The harmonics above the degree measure the
# round-off.
RESULTANT_SAMPLES = 16
# A function a + b cos t + c sin t is sampled at t = 0, 120 and 240 degrees. The coefficient c is
# the sum of the samples with the weights 0, ROOT_THIRD and -ROOT_THIRD. ROOT_THIRD is
# 2/3 * sin(120 degrees).
ROOT_THIRD = math.sqrt(1.0 / 3)
# Two directions are taken as parallel if the sine of their angle is below this, and as
# perpendicular if the cosine is below this. The bound is a thousand times the round-off of unit
# vectors.
PARALLEL_SINE = 1e-12


def _mean(p: int, turn: int) -> float:
    # A function a + b cos t + c sin t is sampled at t = 0, 120 and 240 degrees (`turn` = 0, 1, 2).
    # Each of the coefficients a, b and c (p = 0, 1, 2) is a weighted sum of the three samples.
    # Returns the weight of sample `turn` in the sum for coefficient p.
    if p == 0:
        return 1.0 / 3
    if p == 1:
        return 2.0 / 3 if turn == 0 else -1.0 / 3
    return 0.0 if turn == 0 else ROOT_THIRD if turn == 1 else -ROOT_THIRD


def _dot(a: Numbers, b: Numbers) -> Complex:
    value = pairs.times(pairs.pair(a, 0), pairs.pair(b, 0))
    value = pairs.plus(value, 1.0, pairs.times(pairs.pair(a, 1), pairs.pair(b, 1)))
    return pairs.plus(value, 1.0, pairs.times(pairs.pair(a, 2), pairs.pair(b, 2)))


def _at(table: Numbers, c: float, s: float) -> Vector:
    # `table` (E or F) has the coefficients of one equation in the angles of two joints: the hidden
    # joint, and a joint with angle t. The angle of the hidden joint is given by its cosine c and
    # sine s. Then the equation is linear in (1, cos t, sin t). Returns the three coefficients.
    v = vectors.plus(vectors.three(table, 0), c, vectors.three(table, 3))
    return vectors.plus(v, s, vectors.three(table, 6))


class SphericalLinkage:
    """
    The equations of the revolute joints of a loop with two or three prismatic joints, and their
    resultant.

    Attributes
    ----------
    hidden
        Index of the joint of the loop whose angle is the variable of the resultant.
    degree
        Degree of the resultant. It is 0 if the loop does not begin with a prismatic joint, if more
        than two revolute joints are before the second prismatic joint, or if the axes of the last
        two revolute joints are parallel.
    coefficients : shape (5,)
        Complex coefficients c[0] to c[4] of the resultant. Let t be the angle of the hidden joint.
        The resultant is the sum of c[k] e^(i k t) for k from -4 to 4, where c[-k] is the conjugate
        of c[k].
    noise
        Round-off of the resultant, divided by the largest absolute value of its samples.
    """

    def __init__(self) -> None:
        (self.order,) = arrays.whole_rooms(6)
        self.way, self.E, self.F = arrays.rooms(9, 9, 9)
        self.circle, self.values, self.coefficients = arrays.rooms(
            2 * RESULTANT_SAMPLES, RESULTANT_SAMPLES, 10
        )
        self.vector, self.turn, self.columns = arrays.rooms(6, 4, 24)
        self.turning, self.second, self.before = 0, 0, 0
        self.hidden, self.other, self.degree = 0, 0, 0
        self.across, self.offset, self.bound, self.noise = False, 0.0, 0.0, 1.0

    def build(self, loop: SixScrews, swapped: bool) -> None:
        """
        Compute the resultant in the angle of the first revolute joint. If `swapped` is set, the
        resultant is in the angle of the second revolute joint.
        """
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
        # Fills `order` with the indices of the revolute joints, then those of the prismatic
        # joints.
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
        # Count the revolute joints before the second prismatic joint.
        self.before = self.second - 1

    def _write_way(self, loop: SixScrews) -> bool:
        # Let A and B be the rotations by the first two revolute joints. Fills `way` with three
        # vectors and sets `offset`. The vector from the tool to the goal is
        # `way[0] - A way[1] - A B way[2]`, minus a term that is proportional to `offset`. Returns
        # False if the axes of the last two revolute joints are parallel.
        screws, order = loop.screws, self.order
        first, last = vectors.axis_of(screws, order[0]), vectors.axis_of(screws, order[3])
        axis = vectors.axis_of(screws, order[2])
        foot, end = vectors.point_of(screws, order[2]), vectors.point_of(screws, order[3])
        normal = vectors.cross(axis, last)
        square = vectors.dot(normal, normal)
        if square < PARALLEL_SINE * PARALLEL_SINE:
            return False
        between = vectors.plus(end, -1.0, foot)
        distance = vectors.dot(vectors.cross(between, last), normal) / square
        foot = vectors.plus(foot, distance, axis)
        distance = vectors.dot(vectors.cross(between, axis), normal) / square
        end = vectors.plus(end, distance, last)
        self.offset = vectors.dot(between, normal) / square
        a, b = vectors.point_of(screws, order[0]), vectors.point_of(screws, order[1])
        carried, twice = vectors.plus(b, -1.0, a), vectors.plus(foot, -1.0, b)
        tool = (loop.goal[3], loop.goal[7], loop.goal[11])
        fixed = vectors.plus(tool, -1.0, a)
        fixed = vectors.plus(fixed, 1.0, vectors.times_vector(loop.goal, end))
        lines.put(self.way, 0, fixed)
        lines.put(self.way, 3, carried)
        lines.put(self.way, 6, twice)
        self.bound = math.sqrt(vectors.dot(fixed, fixed)) + math.sqrt(vectors.dot(end, end))
        self.bound += math.sqrt(vectors.dot(carried, carried))
        self.bound += math.sqrt(vectors.dot(twice, twice)) + 3 * abs(self.offset)
        self.bound += math.sqrt(vectors.dot(between, between) / square)
        # Test whether the first revolute joint is between the two prismatic joints, and whether
        # the axis `first` of this revolute joint is perpendicular to both prismatic directions. If
        # so, the joint turns the second prismatic direction about `first`, and both directions are
        # perpendicular to `first` at each angle of the joint.
        slide, other = vectors.axis_of(screws, 0), vectors.axis_of(screws, self.second)
        self.across = self.before == 1 and abs(vectors.dot(slide, first)) < PARALLEL_SINE
        self.across = self.across and abs(vectors.dot(other, first)) < PARALLEL_SINE
        return True

    def _write_tables(self, loop: SixScrews, swapped: bool) -> None:
        # Each of the two equations (see the module's docstring) is linear in nine products
        # f_i(a) * f_j(b). The functions f_0, f_1 and f_2 are 1, cos and sin; a is the angle of the
        # hidden joint, and b that of joint `other`. Computes the coefficients of the products from
        # nine samples: E (3, 3) for the first equation, F (3, 3) for the second. Row i, column j
        # has the coefficient of f_i(a) * f_j(b).
        for k in range(9):
            self.E[k], self.F[k] = 0.0, 0.0
        for i in range(3):
            for j in range(3):
                self._evaluate(loop, places.TAU * i / 3, places.TAU * j / 3)
                for p in range(3):
                    for q in range(3):
                        weight = _mean(p, i) * _mean(q, j)
                        at = 3 * q + p if swapped else 3 * p + q
                        self.E[at] += weight * self.vector[0]
                        self.F[at] += weight * self.vector[1]

    def _evaluate(self, loop: SixScrews, alpha: float, beta: float) -> None:
        # Writes to `vector` the residuals of the first and second equation of the module's
        # docstring, if the first two revolute joints have the angles alpha and beta, rad.
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
        gap = vectors.three(self.way, 0)
        gap = vectors.plus(gap, -1.0, vectors.turned(a, alpha, vectors.three(self.way, 3)))
        carried = vectors.turned(b, beta, vectors.three(self.way, 6))
        gap = vectors.plus(gap, -1.0, vectors.turned(a, alpha, carried))
        if self.across:
            last = vectors.dot(a, vectors.cross(y, goal))
            self.vector[1] = vectors.dot(a, gap) - self.offset * last
            return
        slide, x = vectors.axis_of(screws, 0), vectors.axis_of(screws, self.second)
        if self.before == 2:
            x = vectors.turned(b, beta, x)
        if self.before > 0:
            x = vectors.turned(a, alpha, x)
        last = still * vectors.dot(slide, x) - vectors.dot(slide, goal) * vectors.dot(x, y)
        last += vectors.dot(vectors.cross(slide, goal), vectors.cross(y, x))
        self.vector[1] = vectors.dot(vectors.cross(slide, x), gap) - self.offset * last

    def _sample(self, degree: int) -> None:
        E, F, largest, steepest = self.E, self.F, 0.0, 0.0
        polynomials.write_circle(RESULTANT_SAMPLES, self.circle)
        for n in range(RESULTANT_SAMPLES):
            c, s = self.circle[2 * n], self.circle[2 * n + 1]
            if degree == 1:
                self.values[n] = E[0] + c * E[3] + s * E[6]
            else:
                v = vectors.cross(_at(E, c, s), _at(F, c, s))
                self.values[n] = v[1] * v[1] + v[2] * v[2] - v[0] * v[0]
                steepest = max(steepest, vectors.dot(v, v))
            largest = max(largest, abs(self.values[n]))
        if not complex_numbers.TINY < largest < 1.0 / complex_numbers.TINY:
            return
        self.degree = degree
        self.noise = polynomials.write_coefficients(
            self.values, RESULTANT_SAMPLES, self.circle, largest, degree, self.coefficients
        )
        # So far, `noise` is the largest harmonic above the degree of the resultant, which should
        # be 0. But errors of the coefficients E and F do not change the harmonics above the
        # degree. So compute a bound of the change of the resultant by these errors. If the bound
        # is larger than `noise`, it becomes the noise.
        error = 10.0 * complex_numbers.ROUND_OFF
        error *= 1.0 if degree == 1 else self.bound * math.sqrt(steepest)
        self.noise = max(self.noise, error / largest)

    def write_positions(self, loop: SixScrews, motion: Motion, z: Complex, t: Numbers) -> bool:
        """
        Write to t (6 complex numbers) the joint positions that belong to a root z of the
        resultant.

        Returns False if no joint positions belong to the root.
        """
        arrays.fill(t, 12, 0.0)
        pairs.put(t, self.hidden, complex_numbers.angle_of(z))
        if not complex_numbers.is_near(pairs.pair(t, self.hidden)):
            return False
        if self.turning == 4 and not self._write_other(t):
            return False
        for k in range(self.turning - 2, self.turning):
            joint = self.order[k]
            # Choose a direction v that the joints after `joint` do not turn. At most one of these
            # joints is revolute, and it does not turn its own axis, so take its axis as v. If
            # `joint` is the last revolute joint, take a direction perpendicular to its axis.
            v = vectors.across(vectors.axis_of(loop.screws, joint))
            if k + 1 < self.turning:
                v = vectors.axis_of(loop.screws, self.order[k + 1])
            angle = complex_motion.angle_left(loop, t, joint, v)
            if not complex_numbers.is_near(angle):
                return False
            pairs.put(t, joint, angle)
        return self._write_slides(loop, motion, t)

    def _write_other(self, t: Numbers) -> bool:
        # The two equations contain the hidden joint, whose angle is known, and joint `other`. With
        # the known angle, they are linear in (1, cos, sin) of joint `other`, and the vectors E and
        # F are the coefficients. So V = E x F is proportional to (1, cos, sin). Computes the angle
        # of joint `other` from V.
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

    def _write_slides(self, loop: SixScrews, motion: Motion, t: Numbers) -> bool:
        # Computes the positions of the prismatic joints. `t` has the angles of the revolute joints
        # and 0 for the prismatic joints. At these positions, the vector from the tool to the goal
        # is `gap`. Each prismatic joint moves the tool by its position times its direction. The
        # sum of these motions must be `gap`: a linear system, solved by Cramer's rule.
        motion.residual(loop, t)
        gap, M, C = self.columns, arrays.after(self.columns, 6), self.vector
        for i in range(3):
            p = pairs.pair(motion.p, i)
            pairs.put(gap, i, (loop.goal[4 * i + 3] - p[0], -p[1]))
            for k in range(6 - self.turning):
                axis = pairs.pair(motion.axes, 3 * self.order[self.turning + k] + i)
                pairs.put(M, 3 * k + i, axis)
        if self.turning == 4:
            # If there are two prismatic joints, add a third direction to make the system square.
            # The direction is the complex conjugate of the normal of the two prismatic axes,
            # because this vector is never in the plane of the axes.
            normal = arrays.after(M, 12)
            pairs.write_cross(M, arrays.after(M, 6), normal)
            for i in range(3):
                normal[2 * i + 1] = -normal[2 * i + 1]
        for k in range(6 - self.turning):
            pairs.write_cross(
                arrays.after(M, 6 * ((k + 1) % 3)), arrays.after(M, 6 * ((k + 2) % 3)), C
            )
            under = _dot(arrays.after(M, 6 * k), C)
            if pairs.square_of(under) < complex_numbers.TINY:
                return False
            position = pairs.over(_dot(gap, C), under)
            pairs.put(t, self.order[self.turning + k], position)
        return True
