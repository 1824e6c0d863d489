# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Eliminate joints 1 and 2 from the loop equation of six joints (dialytic elimination, Raghavan and
Roth 1993).

M. Raghavan and B. Roth, "Inverse kinematics of the general 6R manipulator and related linkages",
J. Mech. Des. 115 (1993) 502. Let ek be the motion by joint k, and V the line of axis 6 at rest, a
vector of 15 numbers (lines.py). The loop equation e1 ... e6 = goal, applied to V, is e3 e4 e5 V =
e2^-1 e1^-1 goal V, because joint 6 does not move its own axis. The first number of a line is 1; so
14 equations remain.

The parts of a revolute joint with angle t are (1, cos t, sin t). The parts of a prismatic joint
with position d are (1, d, d^2). The left sides are linear in 27 products, each of one part of
joint 3, one of joint 4 and one of joint 5. The right sides are linear in 9 products, each of one
part of joint 1 and one of joint 2; one of these products is 1. Gaussian elimination of the other
eight products leaves six equations in joints 3, 4 and 5. More equations are left if axes have
special positions, for example if they are parallel or meet. Modified Gram-Schmidt makes the
equations orthonormal.
"""

import math

from ..forward import vectors
from ..layout import arrays
from ..layout.arrays import Flat
from . import complex_numbers, lines
from .six_screws import SixScrews

# Number of equations: one for each number of a line (lines.py) except the first, which is always
# 1.
EQUATIONS = 14
# Number of different products on the left sides of the equations: 3^3. Each product has three
# factors, one part of each of the joints 3, 4 and 5 (cosine, sine or 1).
LEFT = 27
# Number of different products on the right sides: 3^2 - 1. Each product has two factors, one part
# of joint 1 and one of joint 2. The product of 1 and 1 is a constant and does not count.
RIGHT = 8
# A pivot is taken as zero if its ratio to the first pivot is at most this. For axes that are
# exactly parallel or meet exactly, some pivots would be zero without round-off (1e-15) and without
# the errors of a calibration. A pivot of 1e-9 keeps seven digits.
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
        Coefficients of the line of axis 6 after the motions by joints 5, 4 and 3. The line is a
        sum of 27 products. Row 9 h + 3 a + b has the coefficients of the product of part h of
        joint 3, part a of joint 4 and part b of joint 5; the parts are numbered from 0. For
        example, h = 1, a = 0, b = 2 is cos t3 times 1 times sin t5.
    goal : shape (15,)
        The line of axis 6 moved by the goal.
    equations : shape (count, 27)
        Orthonormal rows; each row times the 27 products of parts is 0 at a solution.
    count
        Number of equations.
    rank
        Rank of the eight columns of products of joints 1 and 2, which are eliminated; less than 8
        for example if axes are parallel or meet.
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
        # `fourth` has the line of axis 6 after the motions by joints 5 and 4: row 3 b + a is
        # multiplied by part a of joint 4 and part b of joint 5. Move each row by joint 3.
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
        # Changes the parts of joint k to those of its inverse motion: the part of the sine, or of
        # the position d of a prismatic joint, changes its sign.
        odd = 1 if vectors.slides(screws, k) else 2
        for i in range(15):
            parts[15 * odd + i] = -parts[15 * odd + i]

    def _pivot(self, width: int) -> int:
        # Eliminates the columns of the right sides by Gaussian elimination with complete pivoting.
        # Returns the rank of these columns.
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
        # Increase the relative error. Subtractions have made the shortest row shorter, but not the
        # errors in this row.
        if shortest > 0.0:
            self.error *= math.sqrt(longest / shortest)

    def _clear_below(self, i: int, rows: int) -> None:
        row = arrays.after(self.equations, LEFT * i)
        for j in range(i + 1, rows):
            below = arrays.after(self.equations, LEFT * j)
            along = arrays.dot(row, below, LEFT)
            for k in range(LEFT):
                below[k] -= along * row[k]
