"""
A real solution of an arm with one joint more than its target asks for, and the curve through it.

What is left of the target is that of a point of the tool, and half of what is skew in the rotation
from the target; its derivative has the joints' twists as columns.
"""

import math

from ..forward import chain_pass, vectors
from ..layout import arrays
from ..layout.arrays import Flat, Floats, Vector

# Newton's steps, their longest, and what is round-off after one.
MOST_STEPS, LONGEST, STANDS = 12, 0.5, 1e-7
ANY = -1


class CurvePoint:
    """
    A place for a solution, and the tangent of the curve there.

    Parameters
    ----------
    screws : shape (n, 7)
        Axis and point of each screw at rest, and 1 if it slides.
    motion : shape (4, 4)
        The motion from rest to the target.
    centre : shape (3,), m
        The tool's origin at the target.
    whole
        Whether the rotation counts, not only the position.
    length
        Length that compares with 1 rad, m.

    Attributes
    ----------
    psi, tangent : shape (n,)
        Positions of the screws; the unit tangent, whose sign is that of the parameter's motion.
    parameter
        The joint that was held last.
    orientation
        1 or -1: times the tangent it gives the one whose determinant below the derivative's rows
        is positive, which changes continuously along a curve (Allgower and Georg, definition
        2.1.1) and is the opposite one on a curve that another curve nearly crosses.
    """

    def __init__(
        self, screws: Floats, motion: Floats, centre: Floats, whole: bool, length: float
    ) -> None:
        self.n, self.rows = arrays.extent(screws, 0), 6 if whole else 3
        if self.n != self.rows + 1:
            raise TypeError('a self-motion has one joint more than its target has rows')
        self.whole, self.length, self.parameter, self.orientation = whole, length, 0, 1.0
        n = self.n
        self.screws, self.motion = arrays.numbers(screws, 7 * n), arrays.numbers(motion, 16)
        self.centre = arrays.numbers(centre, 3)
        self.psi, self.tangent, self.W = arrays.rooms(n, n, 6 * (n + 1))
        self.R, self.back = arrays.rooms(9, 3)
        self.order, self.joints = arrays.whole_rooms(6, n + 1)

    def improve(self, parameter: int) -> bool:
        """
        Move psi to a solution, the parameter held; return whether the steps ended at one.

        `ANY`: the joint that moves most is held in each step.
        """
        for _ in range(MOST_STEPS):
            if not self.write_tangent(parameter):
                return False
            square: float = 0.0
            for i in range(self.rows):
                way = self.W[(self.n + 1) * i]
                square += way * way
            step = math.sqrt(square)
            if not step < 1e6:
                return False
            share: float = min(1.0, LONGEST / step) if step > 0.0 else 1.0
            for i in range(self.rows):
                self.psi[self.order[i]] -= share * self.W[(self.n + 1) * i]
            if step < STANDS:
                return True
        return False

    def write_tangent(self, parameter: int) -> bool:
        """Write the tangent at psi, and the parameter; return False where it is singular."""
        self._linearise()
        if not self._solve(parameter):
            return False
        square = 1.0
        for i in range(self.rows):
            way = -self.W[(self.n + 1) * i + 1]
            self.tangent[self.order[i]] = way
            square += way * way
        size = 1.0 / math.sqrt(square)
        self.tangent[self.parameter] = 1.0
        for j in range(self.n):
            self.tangent[j] *= size
        return True

    def _linearise(self) -> None:
        # Writes what is left, and behind it the columns of the derivative.
        R, M, unit = self.R, self.motion, 1.0 / self.length
        c = vectors.three(self.centre, 0)
        p: Vector = (0.0, 0.0, 0.0)
        for i in range(9):
            R[i] = 1.0 if i % 4 == 0 else 0.0
        for k in range(self.n):
            screw = arrays.after(self.screws, 7 * k)
            axis, reach = self._turned(screw), self._turned(arrays.after(screw, 3))
            if screw[6] > 0.5:
                self._write_column(1 + k, unit, axis, 0.0, axis)
                p = _plus(p, self.psi[k], axis)
                continue
            o = _plus(p, 1.0, reach)
            x, y, z = c[0] - o[0], c[1] - o[1], c[2] - o[2]
            lever: Vector = (
                axis[1] * z - axis[2] * y,
                axis[2] * x - axis[0] * z,
                axis[0] * y - axis[1] * x,
            )
            self._write_column(1 + k, unit, lever, 1.0, axis)
            s, cosine = chain_pass.sincos(self.psi[k])
            # R becomes R times the turn: each row v of it v c + v x z s + (v . z) z (1 - c).
            turn: Vector = (s * screw[0], s * screw[1], s * screw[2])
            share: float = 1.0 - cosine
            _turn_row(R, screw, cosine, turn, share * axis[0])
            _turn_row(arrays.after(R, 3), screw, cosine, turn, share * axis[1])
            _turn_row(arrays.after(R, 6), screw, cosine, turn, share * axis[2])
            p = _plus(o, -1.0, self._turned(arrays.after(screw, 3)))
        x, y, z = c[0] - M[3], c[1] - M[7], c[2] - M[11]
        back, left = self.back, _plus(p, -1.0, c)
        for i in range(3):
            back[i] = M[i] * x + M[4 + i] * y + M[8 + i] * z
        self._write_column(0, unit, _plus(left, 1.0, self._turned(back)), 1.0, self._left())

    def _left(self) -> Vector:
        # Half of what is skew in R M^T: (entry (2, 1) - (1, 2), ...) / 2.
        R, M = self.R, self.motion
        a, b, c = vectors.three(R, 0), vectors.three(R, 3), vectors.three(R, 6)
        x, y, z = vectors.three(M, 0), vectors.three(M, 4), vectors.three(M, 8)
        return (
            0.5 * (vectors.dot(c, y) - vectors.dot(b, z)),
            0.5 * (vectors.dot(a, z) - vectors.dot(c, x)),
            0.5 * (vectors.dot(b, x) - vectors.dot(a, y)),
        )

    def _turned(self, v: Flat) -> Vector:
        R, x, y, z = self.R, v[0], v[1], v[2]
        return (
            R[0] * x + R[1] * y + R[2] * z,
            R[3] * x + R[4] * y + R[5] * z,
            R[6] * x + R[7] * y + R[8] * z,
        )

    def _write_column(self, k: int, unit: float, v: Vector, share: float, w: Vector) -> None:
        W, wide = self.W, self.n + 1
        W[k], W[wide + k], W[2 * wide + k] = unit * v[0], unit * v[1], unit * v[2]
        if self.whole:
            W[3 * wide + k], W[4 * wide + k] = share * w[0], share * w[1]
            W[5 * wide + k] = share * w[2]

    def _solve(self, parameter: int) -> bool:
        # Gauss and Jordan with complete pivoting: `order` says which joint each row gives. Columns
        # change places, so that those that are not done come first: behind what is left, and a
        # parameter that is given. In the end it, or the one that no row gives, is the second.
        rows, wide, W, joints = self.rows, self.n + 1, self.W, self.joints
        self.orientation = 1.0
        for j in range(self.n):
            joints[1 + j] = j
        first = 1
        if parameter >= 0:
            self._exchange_columns(1, 1 + parameter)
            first = 2
        for k in range(rows):
            count = wide - k
            if not self._take_pivot(k, first, count):
                return False
            count -= 1
            pivot = arrays.after(W, wide * k)
            for i in range(rows):
                row = arrays.after(W, wide * i)
                share = row[count]
                if i != k:
                    for j in range(count):
                        row[j] -= share * pivot[j]
        self.parameter = joints[1]
        self._orient()
        return True

    def _orient(self) -> None:
        # The determinant has the signs of the pivots, and of the order of columns and parameter.
        inversions = self.parameter
        for i in range(self.rows):
            for k in range(i):
                if self.order[k] > self.order[i]:
                    inversions += 1
        if inversions % 2 == 1:
            self.orientation = -self.orientation

    def _exchange_columns(self, a: int, b: int) -> None:
        W, wide, joints = self.W, self.n + 1, self.joints
        for i in range(self.rows):
            W[wide * i + a], W[wide * i + b] = W[wide * i + b], W[wide * i + a]
        joints[a], joints[b] = joints[b], joints[a]

    def _take_pivot(self, k: int, first: int, count: int) -> bool:
        # Brings the largest number of the columns left into row k, makes it 1, and brings its
        # column behind the others; False where all are nothing.
        wide, W = self.n + 1, self.W
        at, best = first, 0.0
        row: int = k
        for i in range(k, self.rows):
            line = arrays.after(W, wide * i)
            for j in range(first, count):
                size = abs(line[j])
                if size > best:
                    best, row, at = size, i, j
        if not 1e-15 < best < 1e150:
            return False
        self.order[k] = self.joints[at]
        if at != count - 1:
            self._exchange_columns(at, count - 1)
        line, pivot = arrays.after(W, wide * row), arrays.after(W, wide * k)
        inverse = 1.0 / line[count - 1]
        if (inverse < 0.0) != (row != k):
            self.orientation = -self.orientation
        for j in range(count):
            x = line[j] * inverse
            line[j] = pivot[j]
            pivot[j] = x
        return True


def write_derivative(point: CurvePoint, psi: Floats, derivative: Floats) -> None:
    """
    Write the derivative of the target's residual at positions of the screws.

    Parameters
    ----------
    point
        The arm and its target.
    psi : shape (n,), rad or m
    derivative : shape (n - 1, n)
    """
    n = point.n
    arrays.copy(point.psi, n, arrays.numbers(psi, n))
    J = arrays.results(derivative, point.rows * n)
    point._linearise()
    for i in range(point.rows):
        arrays.copy(arrays.after(J, i * n), n, arrays.after(point.W, i * (n + 1) + 1))


# In this module, so that the compiler makes it a part of its caller, as vectors.plus is not.
def _plus(a: Vector, share: float, b: Vector) -> Vector:
    return (a[0] + share * b[0], a[1] + share * b[1], a[2] + share * b[2])


def _turn_row(row: Flat, axis: Flat, cosine: float, turn: Vector, along: float) -> None:
    x, y, z = row[0], row[1], row[2]
    row[0] = cosine * x + (y * turn[2] - z * turn[1]) + along * axis[0]
    row[1] = cosine * y + (z * turn[0] - x * turn[2]) + along * axis[1]
    row[2] = cosine * z + (x * turn[1] - y * turn[0]) + along * axis[2]
