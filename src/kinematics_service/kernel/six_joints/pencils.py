"""
The square matrix of a hidden joint that is singular where the six joints meet their target.

The equations of `Elimination`, each multiplied by cos and sin of half an angle of one of the other
two joints, are linear in twelve products: (cos t/2, sin t/2, cos 3t/2, sin 3t/2) of that joint
with (1, cos, sin) of the last one. No angle is special, as 180 degrees are to tangents of halves.
Where the multiplied joint slides, by d, the products are of (1, d, d^2, d^3).
"""

import math

from ..forward import chain_pass
from ..layout import arrays, places
from ..layout.arrays import Numbers
from . import pairs, polynomials
from .elimination import Elimination
from .pairs import Complex

SIZE, SQUARE = 12, 144
# The determinant is a trigonometric polynomial of degree 8 where six equations are left over, of
# 12 where there are more. It is sampled at more angles than it has coefficients: those beyond its
# degree measure the round-off.
DEGREE, FULL_DEGREE = 8, 12
SAMPLES, MOST_SAMPLES = 25, 32
TINY, ROUND_OFF = 1e-300, 1e-16


class Pencil:
    """
    Room for a matrix M0 + cos(t) M1 + sin(t) M2, t the angle of the hidden joint.

    Attributes
    ----------
    degree
        Of its determinant; 0 where too few equations were left for a square one.
    coefficients : shape (13,)
        Complex, of the determinant: of e^(i k t); those of -k are conjugate.
    noise
        What those beyond the degree are, as a share of the largest sample: round-off, or all of
        a determinant that vanishes at every angle.
    gap
        The last pivot but one of `write_null_vector`, as a share of the first one.
    count
        How many equations there were before they were combined into twelve.
    error
        How far round-off may have moved them.
    """

    def __init__(self) -> None:
        self.rows, self.M, self.columns = arrays.rooms(3 * 336, 3 * SQUARE, SIZE)
        self.work, self.coefficients = arrays.rooms(2 * SQUARE, 26)
        self.circle, self.samples = arrays.rooms(2 * MOST_SAMPLES, MOST_SAMPLES)
        self.degree, self.count = 0, 0
        self.noise, self.gap, self.error, self.pivot = 0.0, 0.0, 0.0, 0.0

    def build(self, elimination: Elimination, swapped: bool, slides: bool) -> None:
        """
        Fill the matrices from the equations that are left.

        `swapped`: joint 5 is multiplied, not joint 4; `slides`: the joint that is multiplied does.
        """
        count = elimination.count
        self.degree, self.count, self.error = 0, 2 * count, elimination.error
        if 2 * count < SIZE:
            return
        for h in range(3):
            for r in range(count):
                self._write_two_rows(elimination, h, r, swapped, slides)
        if 2 * count == SIZE:
            self.degree = DEGREE
            for k in range(3):
                arrays.copy(
                    arrays.after(self.M, SQUARE * k), SQUARE, arrays.after(self.rows, 336 * k)
                )
        else:
            self.degree = FULL_DEGREE
            self._compress(2 * count)
        self._balance()

    def _write_two_rows(
        self, elimination: Elimination, h: int, r: int, swapped: bool, slides: bool
    ) -> None:
        first = arrays.after(self.rows, 336 * h + 24 * r)
        second = arrays.after(first, SIZE)
        f = arrays.after(elimination.equations, 27 * r + 9 * h)
        step, across = (1, 3) if swapped else (3, 1)
        for b in range(3):
            f0, f1, f2 = f[across * b], f[across * b + step], f[across * b + 2 * step]
            if slides:
                first[b], first[3 + b], first[6 + b], first[9 + b] = f0, f1, f2, 0.0
                second[b], second[3 + b], second[6 + b], second[9 + b] = 0.0, f0, f1, f2
            else:
                half_1, half_2 = 0.5 * f1, 0.5 * f2
                first[b], first[3 + b] = f0 + half_1, half_2
                first[6 + b], first[9 + b] = half_1, half_2
                second[b], second[3 + b] = half_2, f0 - half_1
                second[6 + b], second[9 + b] = -half_2, half_1

    def _compress(self, count: int) -> None:
        # Twelve orthogonal combinations of the rows: those of the cosine transform.
        arrays.fill(self.M, SQUARE * 3, 0.0)
        for i in range(SIZE):
            for r in range(count):
                _, share = chain_pass.sincos(places.PI * i * (2 * r + 1) / (2 * count))
                for k in range(3):
                    for j in range(SIZE):
                        self.M[SQUARE * k + SIZE * i + j] += (
                            share * self.rows[336 * k + SIZE * r + j]
                        )

    def _balance(self) -> None:
        # Columns, then rows of all three matrices together: every angle is scaled alike.
        M = self.M
        for j in range(SIZE):
            square = 0.0
            for k in range(3 * SIZE):
                square += M[SIZE * k + j] * M[SIZE * k + j]
            self.columns[j] = 1.0 / math.sqrt(square) if square > TINY else 1.0
            for k in range(3 * SIZE):
                M[SIZE * k + j] *= self.columns[j]
        for i in range(SIZE):
            square = 0.0
            for k in range(3):
                for j in range(SIZE):
                    x = M[SQUARE * k + SIZE * i + j]
                    square += x * x
            share = 1.0 / math.sqrt(square) if square > TINY else 1.0
            for k in range(3):
                for j in range(SIZE):
                    M[SQUARE * k + SIZE * i + j] *= share

    def sample(self) -> None:
        """Fill in the coefficients of the determinant, its largest sample 1, and their noise."""
        count = SAMPLES if self.degree == DEGREE else MOST_SAMPLES
        polynomials.write_circle(count, self.circle)
        largest, minor = 0.0, 0.0
        for n in range(count):
            c, s = self.circle[2 * n], self.circle[2 * n + 1]
            for i in range(SQUARE):
                self.work[i] = self.M[i] + c * self.M[SQUARE + i] + s * self.M[2 * SQUARE + i]
            self.samples[n] = self._determinant()
            largest = max(largest, abs(self.samples[n]))
            if self.pivot > 0.0:
                minor = max(minor, abs(self.samples[n]) / self.pivot)
        self.noise = 1.0
        if not TINY < largest < 1.0 / TINY:
            return
        noise = polynomials.write_coefficients(
            self.samples, count, self.circle, largest, self.degree, self.coefficients
        )
        # Errors of the matrix need not show beyond the degree: they count as minors do.
        self.noise = max(noise, max(self.error, ROUND_OFF) * minor / largest)

    def _determinant(self) -> float:
        # Of the matrix (12, 12) in the room for work, which is overwritten; its least pivot stays.
        A, product = self.work, 1.0
        self.pivot = places.INFINITY
        for k in range(SIZE):
            p = k
            for i in range(k + 1, SIZE):
                if abs(A[SIZE * i + k]) > abs(A[SIZE * p + k]):
                    p = i
            pivot = A[SIZE * p + k]
            self.pivot = min(self.pivot, abs(pivot))
            if pivot == 0.0:
                return 0.0
            if p != k:
                product = -product
                for j in range(k, SIZE):
                    A[SIZE * k + j], A[SIZE * p + j] = A[SIZE * p + j], A[SIZE * k + j]
            product *= pivot
            for i in range(k + 1, SIZE):
                share = A[SIZE * i + k] / pivot
                for j in range(k + 1, SIZE):
                    A[SIZE * i + j] -= share * A[SIZE * k + j]
        return product

    def write_null_vector(self, z: Complex, x: Numbers) -> None:
        """
        Write the products (12 complex ones) that the matrix at e^(i t) = z maps to least.

        By elimination with complete pivoting, the last pivot taken as zero.
        """
        order = [0] * 12
        first, last = 0.0, 0.0
        self._fill(z)
        W = self.work
        for i in range(SIZE):
            order[i] = i
        for k in range(SIZE - 1):
            best, p, c = -1.0, k, k
            for i in range(k, SIZE):
                for j in range(k, SIZE):
                    at = 2 * (SIZE * i + j)
                    square = W[at] * W[at] + W[at + 1] * W[at + 1]
                    if square > best:
                        best, p, c = square, i, j
            if best <= 0.0:
                last = 0.0
                break
            if k == 0:
                first = best
            last = best
            self._exchange(k, p, c)
            order[k], order[c] = order[c], order[k]
            self._clear_column(k)
        self.gap = math.sqrt(last / first) if first > 0.0 else 0.0
        self._substitute()
        for i in range(SIZE):
            # The vector stands in the first column, of which elimination left nothing.
            k = order[i]
            x[2 * k] = W[24 * i] * self.columns[k]
            x[2 * k + 1] = W[24 * i + 1] * self.columns[k]

    def misses(self, z: Complex, x: Numbers) -> float:
        """
        Return by what share the equations are missed by products x at e^(i t) = z near the circle.

        Twelve combinations of more equations are singular at angles that solve none of these.
        """
        inverse = pairs.over((1.0, 0.0), z)
        c = (0.5 * (z[0] + inverse[0]), 0.5 * (z[1] + inverse[1]))
        s = (0.5 * (z[1] - inverse[1]), -0.5 * (z[0] - inverse[0]))
        longest, missed = 0.0, 0.0
        for j in range(SIZE):
            square = pairs.square_of(pairs.pair(x, j)) / (self.columns[j] * self.columns[j])
            longest = max(longest, square)
        for i in range(self.count):
            left, terms = (0.0, 0.0), 0.0
            for j in range(SIZE):
                at = SIZE * i + j
                A, B, C = self.rows[at], self.rows[336 + at], self.rows[672 + at]
                entry = (A + B * c[0] + C * s[0], B * c[1] + C * s[1])
                left = pairs.plus(left, 1.0, pairs.times(entry, pairs.pair(x, j)))
                terms += (abs(A) + abs(B) + abs(C)) * self.columns[j]
            if terms > 0.0:
                share: float = math.sqrt(pairs.square_of(left) / longest) / terms
                missed = max(missed, share)
        return missed

    def _fill(self, z: Complex) -> None:
        # The complex matrix at z, divided by the size of the cosine far from the real angles.
        inverse = pairs.over((1.0, 0.0), z)
        c_re, c_im = 0.5 * (z[0] + inverse[0]), 0.5 * (z[1] + inverse[1])
        s_re, s_im = 0.5 * (z[1] - inverse[1]), -0.5 * (z[0] - inverse[0])
        share = 1.0 / max(1.0, math.sqrt(c_re * c_re + c_im * c_im))
        c_re, c_im, s_re, s_im = share * c_re, share * c_im, share * s_re, share * s_im
        for i in range(SQUARE):
            A, B, C = self.M[i], self.M[SQUARE + i], self.M[2 * SQUARE + i]
            self.work[2 * i] = share * A + c_re * B + s_re * C
            self.work[2 * i + 1] = c_im * B + s_im * C

    def _exchange(self, k: int, p: int, c: int) -> None:
        W = self.work
        if p != k:
            for j in range(2 * SIZE):
                W[24 * k + j], W[24 * p + j] = W[24 * p + j], W[24 * k + j]
        if c != k:
            for i in range(SIZE):
                for e in range(2):
                    one, other = 24 * i + 2 * k + e, 24 * i + 2 * c + e
                    W[one], W[other] = W[other], W[one]

    def _clear_column(self, k: int) -> None:
        W = self.work
        row = arrays.after(W, 24 * k)
        inverse = pairs.over((1.0, 0.0), pairs.pair(W, 13 * k))
        for i in range(k + 1, SIZE):
            share = pairs.times(pairs.pair(W, SIZE * i + k), inverse)
            pairs.subtract(arrays.after(W, 24 * i), row, k + 1, SIZE, share)

    def _substitute(self) -> None:
        # Back substitution with 1 as the last number; x[i] is left in W[i][0].
        W = self.work
        first = pairs.pair(W, 0)
        W[24 * (SIZE - 1)], W[24 * (SIZE - 1) + 1] = 1.0, 0.0
        for i in range(SIZE - 2, -1, -1):
            re, im = 0.0, 0.0
            for j in range(i + 1, SIZE):
                a, b = W[24 * i + 2 * j], W[24 * i + 2 * j + 1]
                x, y = W[24 * j], W[24 * j + 1]
                re -= a * x - b * y
                im -= a * y + b * x
            pivot: Complex = first if i == 0 else pairs.pair(W, 13 * i)
            if pairs.square_of(pivot) == 0.0:
                pivot = (1.0, 0.0)
            value = pairs.over((re, im), pivot)
            W[24 * i], W[24 * i + 1] = value[0], value[1]
