"""
A real solution of an arm with one joint more than its target asks for, and the curve through it.

What is left of the target is that of a point of the tool, and half of what is skew in the rotation
from the target; its derivative has the joints' twists as columns.
"""

import math

from ..forward import chain_pass, vectors
from ..layout import arrays
from ..layout.arrays import Flat, FlatIntegers, Floats, Vector

# Newton's steps, their longest, and what is round-off after one.
MOST_STEPS, LONGEST, STANDS = 12, 0.5, 1e-7
ANY = -1


class CurvePoint:
    """
    A place for a solution, and the tangent of the curve there.

    Parameters
    ----------
    screws, motion, centre, whole, length
        As those of `CurveChart`.

    Attributes
    ----------
    psi, tangent : shape (n,)
        Positions of the screws; the unit tangent, whose sign is that of the parameter's motion.
    parameter
        The joint that was held last.
    """

    n: int
    rows: int
    whole: bool
    length: float
    parameter: int

    def __init__(
        self, screws: Floats, motion: Floats, centre: Floats, whole: bool, length: float
    ) -> None:
        self.n, self.rows = arrays.extent(screws, 0), 6 if whole else 3
        if self.n != self.rows + 1:
            raise TypeError('a self-motion has one joint more than its target has rows')
        self.whole, self.length, self.parameter = whole, length, 0
        n = self.n
        self.screws: Flat = arrays.numbers(screws, 7 * n)
        self.motion: Flat = arrays.numbers(motion, 16)
        self.centre: Flat = arrays.numbers(centre, 3)
        self.room: Flat = arrays.scratch(2 * n + 6 * (n + 1) + 9 + 6 + n)
        self.psi: Flat = self.room
        self.tangent: Flat = arrays.after(self.psi, n)
        self.W: Flat = arrays.after(self.tangent, n)
        self.R: Flat = arrays.after(self.W, 6 * (n + 1))
        self.order: FlatIntegers = arrays.as_whole(arrays.after(self.R, 9))
        self.used: FlatIntegers = arrays.whole_after(self.order, 6)
        self._arrays: tuple[object, ...] = screws, motion, centre

    def __dealloc__(self) -> None:
        """Give the room back."""
        arrays.give_back(self.room)

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
                way = self.W[(self.n + 1) * i + self.n]
                square += way * way
            step = math.sqrt(square)
            if not step < 1e6:
                return False
            share: float = min(1.0, LONGEST / step) if step > 0.0 else 1.0
            for i in range(self.rows):
                self.psi[self.order[i]] -= share * self.W[(self.n + 1) * i + self.n]
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
            way = -self.W[(self.n + 1) * i + self.parameter]
            self.tangent[self.order[i]] = way
            square += way * way
        size = 1.0 / math.sqrt(square)
        self.tangent[self.parameter] = 1.0
        for j in range(self.n):
            self.tangent[j] *= size
        return True

    def _linearise(self) -> None:
        # Writes the columns of the derivative, and behind them what is left.
        R, M, unit = self.R, self.motion, 1.0 / self.length
        c = vectors.three(self.centre, 0)
        p: Vector = (0.0, 0.0, 0.0)
        for i in range(9):
            R[i] = 1.0 if i % 4 == 0 else 0.0
        for k in range(self.n):
            z, at = vectors.axis_of(self.screws, k), vectors.point_of(self.screws, k)
            axis = self._turned(z)
            if vectors.slides(self.screws, k):
                self._write_column(k, unit, axis, 0.0, axis)
                p = vectors.plus(p, self.psi[k], axis)
                continue
            o = vectors.plus(self._turned(at), 1.0, p)
            lever = vectors.cross(axis, vectors.plus(c, -1.0, o))
            self._write_column(k, unit, lever, 1.0, axis)
            s, cosine = chain_pass.sincos(self.psi[k])
            for i in range(3):
                v = vectors.three(R, 3 * i)
                along = vectors.dot(z, v) * (1.0 - cosine)
                w = vectors.cross(v, z)
                R[3 * i] = cosine * v[0] + s * w[0] + along * z[0]
                R[3 * i + 1] = cosine * v[1] + s * w[1] + along * z[1]
                R[3 * i + 2] = cosine * v[2] + s * w[2] + along * z[2]
            p = vectors.plus(o, -1.0, self._turned(at))
        away = vectors.plus(c, -1.0, vectors.apart(M, 3, 4))
        back = (
            M[0] * away[0] + M[4] * away[1] + M[8] * away[2],
            M[1] * away[0] + M[5] * away[1] + M[9] * away[2],
            M[2] * away[0] + M[6] * away[1] + M[10] * away[2],
        )
        left = vectors.plus(vectors.plus(self._turned(back), 1.0, p), -1.0, c)
        self._write_column(self.n, unit, left, 1.0, self._turn_left())

    def _turn_left(self) -> Vector:
        # Half of what is skew in R M^T: (entry (2, 1) - (1, 2), ...) / 2.
        R, M = self.R, self.motion
        a, b, c = vectors.three(R, 0), vectors.three(R, 3), vectors.three(R, 6)
        x, y, z = vectors.three(M, 0), vectors.three(M, 4), vectors.three(M, 8)
        return (
            0.5 * (vectors.dot(c, y) - vectors.dot(b, z)),
            0.5 * (vectors.dot(a, z) - vectors.dot(c, x)),
            0.5 * (vectors.dot(b, x) - vectors.dot(a, y)),
        )

    def _turned(self, v: Vector) -> Vector:
        R = self.R
        return (
            R[0] * v[0] + R[1] * v[1] + R[2] * v[2],
            R[3] * v[0] + R[4] * v[1] + R[5] * v[2],
            R[6] * v[0] + R[7] * v[1] + R[8] * v[2],
        )

    def _write_column(self, k: int, unit: float, v: Vector, share: float, w: Vector) -> None:
        W, wide = self.W, self.n + 1
        W[k], W[wide + k], W[2 * wide + k] = unit * v[0], unit * v[1], unit * v[2]
        if self.whole:
            W[3 * wide + k], W[4 * wide + k] = share * w[0], share * w[1]
            W[5 * wide + k] = share * w[2]

    def _solve(self, parameter: int) -> bool:
        # Gauss and Jordan with complete pivoting: `order` says which joint each row gives, the one
        # that is left is the parameter.
        rows, n, wide, W = self.rows, self.n, self.n + 1, self.W
        for j in range(n):
            self.used[j] = 1 if j == parameter else 0
        for k in range(rows):
            if not self._take_pivot(k):
                return False
            q = self.order[k]
            for i in range(rows):
                share = W[wide * i + q]
                if i != k and share != 0.0:
                    for j in range(wide):
                        W[wide * i + j] -= share * W[wide * k + j]
        for j in range(n):
            if self.used[j] == 0:
                self.parameter = j
        if parameter >= 0:
            self.parameter = parameter
        return True

    def _take_pivot(self, k: int) -> bool:
        # Brings the largest number left into row k, and makes it 1; False where all are nothing.
        rows, n, wide, W = self.rows, self.n, self.n + 1, self.W
        row, q, best = k, 0, 0.0
        for i in range(k, rows):
            for j in range(n):
                size = abs(W[wide * i + j])
                if size > best and self.used[j] == 0:
                    best, row, q = size, i, j
        if not 1e-15 < best < 1e150:
            return False
        self.used[q], self.order[k] = 1, q
        if row != k:
            for j in range(wide):
                x = W[wide * row + j]
                W[wide * row + j] = W[wide * k + j]
                W[wide * k + j] = x
        inverse = 1.0 / W[wide * k + q]
        for j in range(wide):
            W[wide * k + j] *= inverse
        return True
