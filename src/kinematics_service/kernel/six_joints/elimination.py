# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Eliminate joints 1 and 2 from the loop equation of six joints (dialytic elimination, Raghavan and
Roth 1993).

M. Raghavan and B. Roth, "Inverse kinematics of the general 6R manipulator and related linkages",
J. Mech. Des. 115 (1993) 502. Let ek be the motion by joint k. Let V be axis 6 at rest, a line in
space that is represented by a vector of 15 numbers (lines.py). Joint 6 does not move its own axis,
so e6 V = V. The loop equation e1 ... e6 = goal, applied to V, then becomes e3 e4 e5 V =
e2^-1 e1^-1 goal V. These are 15 equations, one for each number of the vector. The first number is
1 on both sides, so 14 equations remain.

If a joint moves a line, each of the 15 numbers becomes a linear combination of three functions of
the joint position: 1, cos t and sin t for a revolute joint with angle t; 1, d and d^2 for a
prismatic joint with position d. So the left sides of the equations are linear in 27 products: a
function of joint 3 times a function of joint 4 times a function of joint 5. The right sides are
linear in 9 products: a function of joint 1 times a function of joint 2. One of the 9 products is
the constant 1. Gaussian elimination of the other eight products leaves six equations in joints 3,
4 and 5. More equations are left if axes have special positions, for example if they are parallel
or meet. Modified Gram-Schmidt makes the equations orthonormal.
"""

import math

from ..forward import vectors
from ..layout import arrays
from ..layout.arrays import Flat
from . import complex_numbers, lines
from .six_screws import SixScrews

# Number of equations. A line in space is represented by 15 numbers (lines.py). Two lines are equal
# if these numbers are equal: 15 equations. The first number is always 1, so it gives no equation.
EQUATIONS = 14
# Number of different products on the left sides of the equations: 3^3. Each product has one factor
# for each of the joints 3, 4 and 5. The factor is 1, the cosine or the sine of the joint's angle
# (1, d or d^2 for a prismatic joint with position d).
LEFT = 27
# Number of different products on the right sides of the equations: 3^2 - 1. The right sides
# contain joints 1 and 2. Each product has one factor for joint 1 and one factor for joint 2. The
# factor is 1, the cosine or the sine of the joint's angle (1, d or d^2 for a prismatic joint with
# position d). The product 1 * 1 is a constant and does not count.
RIGHT = 8
# A pivot is taken as zero if its ratio to the first pivot is at most this. If axes are parallel or
# meet, some pivots should be zero. Round-off (1e-15) and the errors of a calibration make these
# pivots nonzero. A pivot with the ratio 1e-9 still has seven of sixteen digits.
PIVOT_RATIO = 1e-9
# A row of the equations is left out as dependent if its length, relative to the longest row, is at
# most this ratio. The ratio is smaller than PIVOT_RATIO, because leaving out a good row loses an
# equation, but keeping a dependent row only increases `error`.
DEPENDENT_ROW_RATIO = 1e-11


class Elimination:
    """
    The equations in joints 3, 4 and 5 of a loop of six joints, and work arrays.

    Attributes
    ----------
    left : shape (27, 15)
        Joints 5, 4 and 3 move axis 6 to a line, which is stored as a vector of 15 numbers
        (lines.py). The vector is a linear combination of the 27 rows. Let f_0, f_1 and f_2 be the
        functions 1, cos and sin (1, d and d^2 for a prismatic joint with position d). Let t3, t4
        and t5 be the positions of joints 3, 4 and 5. The factor of row 9 h + 3 a + b is
        f_h(t3) * f_a(t4) * f_b(t5). For example, the factor of row 11 is cos t3 * 1 * sin t5.
    goal : shape (15,)
        The line of axis 6 moved by the goal.
    equations : shape (count, 27)
        Orthonormal rows. At a solution, the scalar product of each row and the vector of the 27
        factors (see `left`) is 0.
    count
        Number of equations.
    rank
        Joints 1 and 2 occur in the 14 equations only in eight terms, for example cos t1 * sin t2.
        The elimination removes these terms. `rank` is the rank of the matrix (14, 8) of the
        coefficients of the terms. It is below 8, for example, if axes are parallel or meet.
    error
        Relative error of the equations from round-off and from pivots taken as zero.
    """

    def __init__(self) -> None:
        self.line, self.goal, self.fifth, self.fourth = arrays.rooms(15, 15, 45, 135)
        self.left, self.first, self.right, self.table = arrays.rooms(405, 45, 135, 490)
        (self.equations,) = arrays.rooms(EQUATIONS * LEFT)
        self.count, self.rank, self.error = 0, 0, 0.0

    def eliminate(self, loop: SixScrews) -> None:
        """Compute the equations in joints 3, 4 and 5 from the screws and the goal of a loop."""
        self._write_sides(loop)
        width = RIGHT + LEFT
        for i in range(EQUATIONS):
            row = arrays.after(self.table, width * i)
            for k in range(RIGHT):
                row[k] = self.right[15 * (k + 1) + 1 + i]
            for k in range(LEFT):
                row[RIGHT + k] = self.left[15 * k + 1 + i]
            row[RIGHT] -= self.right[1 + i]
        self.rank = self._pivot(width)
        self._orthonormalize(self.rank, width)

    def _write_sides(self, loop: SixScrews) -> None:
        screws = loop.screws
        lines.write_line(vectors.axis_of(screws, 5), vectors.point_of(screws, 5), self.line)
        lines.write_parts(screws, 4, self.line, self.fifth)
        for b in range(3):
            line = arrays.after(self.fifth, 15 * b)
            lines.write_parts(screws, 3, line, arrays.after(self.fourth, 45 * b))
        # Joints 5 and 4 move axis 6 to a line, which is stored as a vector of 15 numbers. The
        # vector is a linear combination of the nine rows of `fourth`. The factor of row
        # `3 * b + a` is `f_a(t4) * f_b(t5)`, where t4 and t5 are joint angles, and f_0, f_1 and
        # f_2 are the functions 1, cos and sin. The motion by joint 3 is a linear map of the
        # vector, so apply it to each row.
        for a in range(3):
            for b in range(3):
                line = arrays.after(self.fourth, 15 * (3 * b + a))
                lines.write_parts(screws, 2, line, self.first)
                for h in range(3):
                    to = arrays.after(self.left, 15 * (9 * h + 3 * a + b))
                    arrays.copy(to, 15, arrays.after(self.first, 15 * h))
        arrays.copy(self.goal, 15, self.line)
        lines.carry(self.goal, loop.goal)
        lines.write_parts(screws, 0, self.goal, self.first)
        self._invert(screws, 0, self.first)
        for a in range(3):
            to = arrays.after(self.right, 45 * a)
            lines.write_parts(screws, 1, arrays.after(self.first, 15 * a), to)
            self._invert(screws, 1, to)

    def _invert(self, screws: Flat, k: int, parts: Flat) -> None:
        # Joint k has moved a line. The rows of `parts` (3, 15) are the coefficients of 1, cos t
        # and sin t in the moved line (of 1, d and d^2 for a prismatic joint). The inverse motion
        # of the joint has -t or -d instead. So the row of sin t or of d changes its sign.
        odd = 1 if vectors.slides(screws, k) else 2
        for i in range(15):
            parts[15 * odd + i] = -parts[15 * odd + i]

    def _pivot(self, width: int) -> int:
        # Each row of the table is one equation. The first RIGHT = 8 columns have the coefficients
        # of the terms with joints 1 and 2, for example of cos t1 * sin t2. Eliminates these terms
        # by Gaussian elimination with complete pivoting. Returns the rank of the eight columns.
        A, largest = self.table, 0.0
        self.error = 0.0
        for k in range(RIGHT):
            best, p, c = 0.0, k, k
            for i in range(k, EQUATIONS):
                for j in range(k, RIGHT):
                    if abs(A[width * i + j]) > best:
                        best, p, c = abs(A[width * i + j]), i, j
            if k == 0:
                largest = best
            if best <= PIVOT_RATIO * largest:
                if largest > 0.0:
                    self.error = max(self.error, best / largest)
                return k
            self.error = complex_numbers.ROUND_OFF * largest / best
            for i in range(EQUATIONS):
                A[width * i + k], A[width * i + c] = A[width * i + c], A[width * i + k]
            for j in range(k, width):
                A[width * k + j], A[width * p + j] = A[width * p + j], A[width * k + j]
            for i in range(k + 1, EQUATIONS):
                factor = A[width * i + k] / A[width * k + k]
                for j in range(k, width):
                    A[width * i + j] -= factor * A[width * k + j]
        return RIGHT

    def _orthonormalize(self, rank: int, width: int) -> None:
        # Makes the rows that remain after the elimination orthonormal by modified Gram-Schmidt;
        # each step takes the longest row next. Leaves out dependent rows.
        F = self.equations
        rows = EQUATIONS - rank
        for i in range(rows):
            row = arrays.after(self.table, width * (rank + i) + RIGHT)
            arrays.copy(arrays.after(F, LEFT * i), LEFT, row)
        longest, shortest = 0.0, 0.0
        self.count = rows
        for i in range(rows):
            best, p = -1.0, i
            for j in range(i, rows):
                row = arrays.after(F, LEFT * j)
                square = arrays.dot(row, row, LEFT)
                if square > best:
                    best, p = square, j
            if i == 0:
                longest = best
            if best <= DEPENDENT_ROW_RATIO * DEPENDENT_ROW_RATIO * longest:
                self.count = i
                break
            shortest = best
            scale = 1.0 / math.sqrt(best)
            for k in range(LEFT):
                x = F[LEFT * i + k]
                F[LEFT * i + k] = F[LEFT * p + k] * scale
                if p != i:
                    F[LEFT * p + k] = x
            self._clear_below(i, rows)
        # Increase the relative error. The subtractions have made the rows shorter, the shortest
        # row most. The absolute errors in the shortest row have not become smaller, so its
        # relative error is larger.
        if shortest > 0.0:
            self.error *= math.sqrt(longest / shortest)

    def _clear_below(self, i: int, rows: int) -> None:
        row = arrays.after(self.equations, LEFT * i)
        for j in range(i + 1, rows):
            below = arrays.after(self.equations, LEFT * j)
            along = arrays.dot(row, below, LEFT)
            for k in range(LEFT):
                below[k] -= along * row[k]
