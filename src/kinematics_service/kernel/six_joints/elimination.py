"""
Two joints of six eliminated: equations in the other three (Raghavan and Roth 1993).

e3 e4 e5 (line of axis 6) = e2^-1 e1^-1 goal (line of axis 6), as lines.py has lines: fourteen
equations, left linear in the 27 products of the parts of joints 3, 4, 5, right in the nine of
joints 1, 2. The eight that are not constant are eliminated.
"""

import math

from ..forward import vectors
from ..layout import arrays
from ..layout.arrays import Flat
from . import lines
from .six_screws import SixScrews

EQUATIONS, LEFT, RIGHT = 14, 27, 9
# A pivot below this share of the first one is zero, and so is what is left of an equation.
PIVOT, DEPENDENT = 1e-9, 1e-11
ROUND_OFF = 1e-16


class Elimination:
    """
    Room for the equations of a loop.

    Attributes
    ----------
    left : shape (27, 15)
        The line of axis 6 moved by joints 5, 4 and 3: its parts, those of joint 3 first.
    goal : shape (15,)
        The line of axis 6 moved by the goal.
    equations : shape (count, 27)
        What is left, orthonormal: equations . products of parts = 0.
    count
        How many there are.
    rank
        How many columns of the right side are independent; 8 but for special axes.
    error
        How far round-off may move the equations: what was taken for zero, or the share of the
        last pivot that round-off is, as a share of what is left of the shortest one.
    """

    def __init__(self) -> None:
        self.line, self.goal, self.fifth, self.fourth = arrays.rooms(15, 15, 45, 135)
        self.left, self.first, self.right, self.table = arrays.rooms(405, 45, 135, 490)
        (self.equations,) = arrays.rooms(EQUATIONS * LEFT)
        self.count, self.rank, self.error = 0, 0, 0.0

    def eliminate(self, loop: SixScrews) -> None:
        """Fill in the equations of a loop."""
        self._write_sides(loop)
        width = RIGHT - 1 + LEFT
        for i in range(EQUATIONS):
            row = arrays.after(self.table, width * i)
            for k in range(RIGHT - 1):
                row[k] = self.right[15 * (k + 1) + 1 + i]
            for k in range(LEFT):
                row[RIGHT - 1 + k] = self.left[15 * k + 1 + i]
            row[RIGHT - 1] -= self.right[1 + i]
        self.rank = self._pivot(width)
        self._orthonormalise(self.rank, width)

    def _write_sides(self, loop: SixScrews) -> None:
        screws = loop.screws
        lines.write_line(vectors.axis_of(screws, 5), vectors.point_of(screws, 5), self.line)
        lines.write_parts(screws, 4, self.line, self.fifth)
        for b in range(3):
            lines.write_parts(
                screws, 3, arrays.after(self.fifth, 15 * b), arrays.after(self.fourth, 45 * b)
            )
        # Products of the parts stand as 9 h + 3 a + b, of joints 3, 4, 5; `fourth` as 3 b + a.
        for a in range(3):
            for b in range(3):
                lines.write_parts(
                    screws,
                    2,
                    arrays.after(self.fourth, 15 * (3 * b + a)),
                    self.first,
                )
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
        # The sine of the opposite angle, or the opposite way.
        odd = 1 if vectors.slides(screws, k) else 2
        for i in range(15):
            parts[15 * odd + i] = -parts[15 * odd + i]

    def _pivot(self, width: int) -> int:
        # Gauss with complete pivoting on the columns of the right side; their rank.
        A, largest = self.table, 0.0
        self.error = 0.0
        for k in range(RIGHT - 1):
            best, p, c = 0.0, k, k
            for i in range(k, EQUATIONS):
                for j in range(k, RIGHT - 1):
                    if abs(A[width * i + j]) > best:
                        best, p, c = abs(A[width * i + j]), i, j
            if k == 0:
                largest = best
            if best <= PIVOT * largest:
                if largest > 0.0:
                    self.error = max(self.error, best / largest)
                return k
            self.error = ROUND_OFF * largest / best
            for i in range(EQUATIONS):
                A[width * i + k], A[width * i + c] = A[width * i + c], A[width * i + k]
            for j in range(k, width):
                A[width * k + j], A[width * p + j] = A[width * p + j], A[width * k + j]
            for i in range(k + 1, EQUATIONS):
                share = A[width * i + k] / A[width * k + k]
                for j in range(k, width):
                    A[width * i + j] -= share * A[width * k + j]
        return RIGHT - 1

    def _orthonormalise(self, rank: int, width: int) -> None:
        # Gram and Schmidt, the longest row next: rows that depend on others are left out.
        F = self.equations
        rows = EQUATIONS - rank
        for i in range(rows):
            arrays.copy(
                arrays.after(F, LEFT * i),
                LEFT,
                arrays.after(self.table, width * (rank + i) + RIGHT - 1),
            )
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
            if best <= DEPENDENT * DEPENDENT * longest:
                self.count = i
                break
            shortest = best
            share = 1.0 / math.sqrt(best)
            for k in range(LEFT):
                x = F[LEFT * i + k]
                F[LEFT * i + k] = F[LEFT * p + k] * share
                if p != i:
                    F[LEFT * p + k] = x
            self._clear_below(i, rows)
        # What is left of a row has the errors of all that was subtracted.
        if shortest > 0.0:
            self.error *= math.sqrt(longest / shortest)

    def _clear_below(self, i: int, rows: int) -> None:
        row = arrays.after(self.equations, LEFT * i)
        for j in range(i + 1, rows):
            below = arrays.after(self.equations, LEFT * j)
            along = arrays.dot(row, below, LEFT)
            for k in range(LEFT):
                below[k] -= along * row[k]
