# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute six complex joint positions that reach a goal by Newton's method, and prove that a solution
is near the computed positions.

The equations compare the product of the six screw motions with the goal. The two must have the
same position, and the rotation matrix from the product to the goal must have no skew part. The
columns of the Jacobian J of the equations are twists (Pluecker coordinates of the screws).

The proof is the Newton-Kantorovich theorem (L. V. Kantorovich 1948; P. Deuflhard, Newton Methods
for Nonlinear Problems, 2004, section 2.1). Let s be the Newton step, beta a bound of |J^-1|, and K
a Lipschitz constant of J. Let h = beta K |s|. If h <= 1/2, there is a solution within the distance
2 |s|, and no other solution within the distance 1 / (beta K).
"""

import math

from ..forward import vectors
from ..layout import arrays
from ..layout.arrays import Numbers, Vector
from . import complex_numbers, complex_product, pairs
from .complex_product import Product
from .pairs import Complex
from .six_screws import SixScrews

# Largest number of Newton steps from one candidate. Most candidates need one or two steps.
MAX_ITERATIONS = 12
# Largest change of a joint in one Newton step, rad; for prismatic joints in the loop's unit of
# length (`SixScrews.length`). Longer steps are shortened.
MAX_STEP = 0.5
# J is taken as singular, and the iteration ends, if a Newton step is at least this (in rad, or in
# the loop's unit of length). A step as long as this would be shortened to MAX_STEP, and the method
# would not converge in MAX_ITERATIONS. The test saves 5 % of the time in which the inverse
# kinematics of a UR5e is solved, if the numbers of its DH table have errors of 1e-5.
SINGULAR_STEP = 1e6
# Newton's method ends after a step below this length (in rad, or in the loop's unit of length).
# Convergence is quadratic, so the next step would be about 1e-14, which is round-off.
STEP_TOLERANCE = 1e-7
# Largest residual (`Motion.residual`) of a solution, without unit for rotations and in the loop's
# unit of length for positions. Newton's method solves equations that compare only the skew part of
# the rotation. They also hold if the rotation is wrong by 180 degrees. Then the residual is at
# least 2/3, because it compares all elements of the rotation matrix.
MAX_RESIDUAL = 0.5
# Largest accepted h of the Newton-Kantorovich theorem. If h < 1/8, the distance between two
# results of the iteration near one solution is below half the radius of uniqueness
# (`Motion.radius`). The value 1/16 adds a safety factor of two.
MAX_KANTOROVICH_H = 0.0625
# If the product of the screws increases round-off by more than this factor, `certify` tries a
# second proof. In the second proof, each joint is weighted by the length of its twist. If all
# joint positions are real (imaginary part 0), round-off increases about 10 times. It increases
# more only if imaginary parts are large.
MIN_GROWTH = 1e3
# Number of columns of the linear system of Newton's method: six of J, one of the residual, and six
# of the identity.
WIDTH = 13


def angle_left(loop: SixScrews, t: Numbers, k: int, v: Vector) -> Complex:
    """
    Return the complex angle of joint k, rad, for which joints 0 to k rotate v as the goal does.

    The goal of the loop is a rigid motion. It rotates the vector v to a vector u. Joints after k
    do not change v, so joints 0 to k together must rotate v to u.

    `t` has six complex joint positions. Only the positions of joints 0 to k - 1 are used.
    """
    vector, turn = [0.0] * 6, [0.0] * 4
    axis = vectors.axis_of(loop.screws, k)
    side = vectors.plus(v, -vectors.dot(axis, v), axis)
    goal = vectors.times_vector(loop.goal, v)
    vector[0], vector[2], vector[4] = goal[0], goal[1], goal[2]
    for j in range(k):
        if not vectors.slides(loop.screws, j):
            complex_numbers.write_turn(pairs.pair(t, j), turn)
            # Apply the inverse of the rotation E by joint j. The inverse is the transpose, so
            # multiply the vector v as a row: (E^-1 v)^T = v^T E.
            re, im = (vector[0], vector[2], vector[4]), (vector[1], vector[3], vector[5])
            complex_product.write_turned(re, im, vectors.axis_of(loop.screws, j), turn, vector)
    re, im = (vector[0], vector[2], vector[4]), (vector[1], vector[3], vector[5])
    other = vectors.cross(axis, side)
    return complex_numbers.angle(
        (vectors.dot(side, re), vectors.dot(side, im)),
        (vectors.dot(other, re), vectors.dot(other, im)),
    )


class Motion:
    """
    Newton's method for the six joints of a loop, with the arrays that it needs: the product of the
    screws, and the derivatives of this product.

    Attributes
    ----------
    first
        Largest change of a joint in the first step of `improve`, rad or the loop's unit of length.
    weights : shape (6,)
        Factors of the joints in the norm in which `radius` is measured.
    radius
        Radius of uniqueness, set by `certify`: exactly one solution is within `radius` of the
        joint positions that were certified. The distance from these joint positions to the
        solution is at most `radius / 8`.
    """

    def __init__(self) -> None:
        self.product = Product()
        self.R, self.p = self.product.R, self.product.p
        self.axes, self.points = self.product.axes, self.product.points
        self.J, self.weights, self.sizes = arrays.rooms(12 * WIDTH, 6, 6)
        self.first, self.radius = 0.0, 0.0

    def improve(self, loop: SixScrews, t: Numbers) -> bool:
        """
        Move the joint positions t (6 complex numbers) to a solution by Newton's method.

        Returns whether the method converged.
        """
        for k in range(MAX_ITERATIONS):
            self.product.multiply(loop.screws, t)
            self._fill(loop)
            if not self._solve(7):
                return False
            step = self._largest_step()
            if k == 0:
                self.first = step
            if not step < SINGULAR_STEP:
                return False
            damping = min(1.0, MAX_STEP / step) if step > 0.0 else 1.0
            for j in range(6):
                for e in range(2):
                    t[2 * j + e] += damping * self.J[2 * (WIDTH * j + 6) + e]
                if vectors.slides(loop.screws, j):
                    continue
                if not complex_numbers.is_near(pairs.pair(t, j)):
                    return False
            if step < STEP_TOLERANCE:
                return True
        return False

    def certify(self, loop: SixScrews, t: Numbers) -> bool:
        """
        Return whether a solution near t is proved to exist (Newton-Kantorovich theorem).

        `t` has six complex joint positions. Fills `weights` and `radius`. If the longest prismatic
        motion exceeds the loop's unit of length, this motion becomes the unit.

        There are two proofs. In the first proof, all joints have the weight 1. If a joint position
        has a large imaginary part, some columns of J (twists of joints) are long, and the first
        proof may fail. In the second proof, the weight of each joint is the length of its column.
        The second proof is tried only if round-off grows by more than MIN_GROWTH. Such a growth
        occurs only if imaginary parts are large.
        """
        if not self.residual(loop, t) < MAX_RESIDUAL:
            return False
        growth = self._growth(loop)
        self._fill(loop)
        unit = self._scale_by_slides(loop, t)
        # Compute K = |axes| |twists|, the Lipschitz constant of J, from the squared Frobenius
        # norms of the axes and of the twists.
        turning, reaching, sizes, inverses = 0.0, 0.0, 0.0, 0.0
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
            inverses += 1.0 / (size * size)
        if not self._solve(WIDTH):
            return False
        error = 10.0 * complex_numbers.ROUND_OFF * max(sizes, growth)
        if self._is_certain(math.sqrt(turning) * math.sqrt(reaching), error, False):
            return True
        if growth <= MIN_GROWTH:
            return False
        return self._is_certain(math.sqrt(6 * inverses), error, True)

    def _is_certain(self, K: float, error: float, weighted: bool) -> bool:
        # Returns whether h of the Newton-Kantorovich theorem is below MAX_KANTOROVICH_H. Fills
        # `weights` and `radius`. If `weighted` is set, joints are weighted by the lengths of their
        # twists.
        step, inverse = 0.0, 0.0
        for j in range(6):
            row = arrays.after(self.J, 2 * WIDTH * j)
            self.weights[j] = self.sizes[j] if weighted else 1.0
            square = self.weights[j] * self.weights[j]
            step += square * (row[12] * row[12] + row[13] * row[13])
            for k in range(14, 2 * WIDTH):
                inverse += square * row[k] * row[k]
        beta = math.sqrt(inverse)
        self.radius = 1.0 / (beta * K)
        return (math.sqrt(step) + beta * error) * beta * K < MAX_KANTOROVICH_H

    def _growth(self, loop: SixScrews) -> float:
        # Returns the factor by which the product of the six screw motions increases round-off.
        # Each screw k has two numbers. Let F be the product of the complex rotation matrices of
        # the screws before screw k, and s_k the mean squared length of the rows of F. If all joint
        # positions are real, s_k is 1. Let o_k be the stored point of axis k. The factor is the
        # sum of `s_k * (1 + |o_k|)` over the six screws.
        growth = 0.0
        for k in range(6):
            square = 0.0
            for i in range(9):
                square += pairs.square_of(pairs.pair(self.product.frames, 9 * k + i))
            o = vectors.point_of(loop.screws, k)
            growth += square / 3 * (1.0 + math.sqrt(vectors.dot(o, o)))
        return growth

    def _scale_by_slides(self, loop: SixScrews, t: Numbers) -> float:
        # If the longest prismatic motion exceeds the loop's unit of length, this motion becomes
        # the unit. Then the lengths in the linear system are divided by the new unit: the linear
        # velocities of the revolute joints in J, and the position errors in the residual. Returns
        # the new unit, divided by the loop's unit of length.
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

    def residual(self, loop: SixScrews, t: Numbers) -> float:
        """
        Return the largest absolute difference between the product of the screws and the goal.

        The product of the screws at positions t is compared with the goal element by element.
        """
        self.product.multiply(loop.screws, t)
        largest: float = 0.0
        for i in range(3):
            re = self.p[2 * i] - loop.goal[4 * i + 3]
            largest = max(largest, abs(re), abs(self.p[2 * i + 1]))
            for j in range(3):
                re = self.R[6 * i + 2 * j] - loop.goal[4 * i + j]
                largest = max(largest, abs(re), abs(self.R[6 * i + 2 * j + 1]))
        return largest

    def _fill(self, loop: SixScrews) -> None:
        # Fills the columns of the linear system of Newton's method: J, the residual, and the
        # identity.
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
            residual = (goal[4 * i + 3] - self.p[2 * i], -self.p[2 * i + 1])
            pairs.put(self.J, WIDTH * i + 6, residual)
            a, b = (i + 2) % 3, (i + 1) % 3
            # R is the rotation by the six screws. The product of the goal's rotation and R^T is
            # the rotation from R to the goal. Compute its skew part: axis times sine.
            re, im = 0.0, 0.0
            for m in range(3):
                re += goal[4 * a + m] * self.R[6 * b + 2 * m]
                re -= goal[4 * b + m] * self.R[6 * a + 2 * m]
                im += goal[4 * a + m] * self.R[6 * b + 2 * m + 1]
                im -= goal[4 * b + m] * self.R[6 * a + 2 * m + 1]
            pairs.put(self.J, WIDTH * (3 + i) + 6, (0.5 * re, 0.5 * im))

    def _moment(self, k: int, a: int, b: int) -> Complex:
        # Returns element a of axis k times element b of the vector from the point of axis k to the
        # end of the loop.
        arm = pairs.plus(pairs.pair(self.p, b), -1.0, pairs.pair(self.points, 3 * k + b))
        return pairs.times(pairs.pair(self.axes, 3 * k + a), arm)

    def _solve(self, width: int) -> bool:
        # Multiplies columns 6 to width - 1 of the system by J^-1: Gauss-Jordan elimination with
        # partial pivoting. Returns False if J is singular.
        J = self.J
        for k in range(6):
            p, best = k, -1.0
            for i in range(k, 6):
                square = pairs.square_of(pairs.pair(J, WIDTH * i + k))
                if square > best:
                    best, p = square, i
            if not 0.0 < best < 1.0 / complex_numbers.TINY:
                return False
            row = arrays.after(J, 2 * WIDTH * k)
            if p != k:
                other = arrays.after(J, 2 * WIDTH * p)
                for j in range(2 * k, 2 * width):
                    row[j], other[j] = other[j], row[j]
            inverse = pairs.over((1.0, 0.0), pairs.pair(J, WIDTH * k + k))
            for i in range(k + 1, 6):
                factor = pairs.times(pairs.pair(J, WIDTH * i + k), inverse)
                pairs.subtract(arrays.after(J, 2 * WIDTH * i), row, k + 1, width, factor)
            for j in range(k + 1, width):
                at = WIDTH * k + j
                pairs.put(J, at, pairs.times(pairs.pair(J, at), inverse))
        for k in range(5, 0, -1):
            row = arrays.after(J, 2 * WIDTH * k)
            for i in range(k):
                factor = pairs.pair(J, WIDTH * i + k)
                pairs.subtract(arrays.after(J, 2 * WIDTH * i), row, 6, width, factor)
        return True

    def _largest_step(self) -> float:
        largest = 0.0
        for j in range(6):
            square = pairs.square_of(pairs.pair(self.J, WIDTH * j + 6))
            largest = max(largest, square)
        return math.sqrt(largest)
